"""The one way a compiled function is made, and where its machine code is kept.

Numba's on-disk cache notices a change in the file of a function, but not in the functions it calls from other
modules, nor in globals. So the cache folder is named after a hash of all sources that can be meant: whoever changes
an equation gets a new folder and never old code. `vehicle_model.warm` fills the folder ahead of time.
"""

import functools
import hashlib
import os
import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import llvmlite
import numba
import numpy as np
from numba.core import config

__all__ = ["CACHE_FOLDER", "WARM_MARK", "cache_folder", "compiled", "compiled_loop", "is_warm", "source_hash"]

_CORE = Path(__file__).resolve().parent
_COMPILES = re.compile(rb"^@compiled", re.MULTILINE)
# Not those for type checkers, which are indented.
_IMPORTS = re.compile(r"^from ([\w.]+) import (\([^)]*\)|[^\n]*)", re.MULTILINE)
_NAME = re.compile(r"\w+")


def source_hash(*packages: Path) -> str:
    """Hash of what compiled code can mean in these package folders, of its place and what compiles it; 16 hex digits.

    That is every source with a compiled function, and all that these import from the same packages, at any remove.
    Two processes get the same hash exactly when compiled code of one can be loaded by the other. The processor is
    not part of it: Numba keeps code of different processors apart by itself.
    """
    digest = hashlib.sha256(f"{sys.version} {numba.__version__} {llvmlite.__version__} {np.__version__}".encode())
    for package in packages:
        sources = {source: source.read_bytes() for source in package.rglob("*.py")}
        meant = [source for source, content in sources.items() if _COMPILES.search(content)]
        seen = set(meant)
        while meant:
            for module, names in _IMPORTS.findall(sources[meant.pop()].decode()):
                place = package.parent.joinpath(*module.split("."))
                modules = {place, place / "__init__", *(place / name for name in _NAME.findall(names))}
                found = {module.with_suffix(".py") for module in modules} & sources.keys() - seen
                meant += found
                seen |= found
        for source in sorted(seen):
            digest.update(f" {source} {len(sources[source])} ".encode())
            digest.update(sources[source])
    return digest.hexdigest()[:16]


def _user_cache() -> Path:
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")


@functools.cache
def cache_folder(source_folder: Path) -> Path | None:
    """Cache folder for the functions of one source folder, or None where nothing can be kept.

    The hash covers the core and the function's own package, so a function may call what is in those two. Code that is
    in no package (a script, a test) is not kept. Nor is any where this user may not write a cache: then every process
    compiles for itself. Numba would fall back to `__pycache__`, where old code can linger, and in a shared temporary
    folder other users of the machine could plant code.
    """
    package = None
    while (source_folder / "__init__.py").exists():
        package, source_folder = source_folder, source_folder.parent
    if package is None:
        return None
    try:
        folder = _user_cache() / "tiltwing-sitl" / source_hash(*sorted({_CORE, package}))
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, RuntimeError):  # RuntimeError: no home directory is known
        return None
    return folder if os.access(folder, os.W_OK) else None


CACHE_FOLDER = cache_folder(_CORE)
WARM_MARK = "complete"  # file in the cache folder, written when every entry point has been compiled into it


if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import TypeVar

    _F = TypeVar("_F", bound=Callable[..., Any])

    def compiled(function: _F) -> _F:
        """Compile a function of the numeric core; the type checker sees the plain function."""
        return function

    def compiled_loop(function: _F) -> _F:
        """Compile a function that runs for long; the type checker sees the plain function."""
        return function

else:

    def compiled(function: Any) -> Any:
        """Compile a function of the core, or of a package above it that calls the core's.

        fastmath stays off so that the same seed gives the same bits. Numpy's error model (1/0 = inf) spares a branch
        at every division and lets bad numbers show as inf or nan instead of raising in the middle of a flight. Inlining
        lets small functions cost nothing: without it an array handed from one to the next is counted in and out
        atomically, a fifth of the time of a step.
        """
        return _compile(function, releases_gil=False)

    def compiled_loop(function: Any) -> Any:
        """As `compiled`, for what runs so long that other threads should: it lets go of the interpreter meanwhile."""
        return _compile(function, releases_gil=True)

    def _compile(function: Any, *, releases_gil: bool) -> Any:
        folder = cache_folder(Path(function.__code__.co_filename).resolve().parent)
        # Numba picks a function's cache folder as it wraps it. Setting the folder for just that moment leaves other
        # users of Numba in this process alone, and works however early they imported it.
        outer, config.CACHE_DIR = config.CACHE_DIR, str(folder)
        try:
            settings = {"error_model": "numpy", "nogil": releases_gil, "forceinline": True}
            return numba.njit(cache=folder is not None, **settings)(function)
        finally:
            config.CACHE_DIR = outer


def is_warm(folder: Path | None = CACHE_FOLDER) -> bool:
    """True when all of a package (the core, if none is said), compiled from just these sources, is in its folder."""
    return folder is not None and (folder / WARM_MARK).exists()
