"""The one way a function of the numeric core is compiled.

Numba's on-disk cache notices a change in the file of a function, but not in the functions it calls from
other modules nor in globals. So the cache folder is named after a hash of all sources of the core, and is
chosen here, before numba is imported: whoever changes an equation gets a new folder and never old code.
"""

import hashlib
import os
import platform
import sys
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

__all__ = ["CACHE_FOLDER", "compiled", "is_warm", "source_hash"]


def source_hash(*packages: Path) -> str:
    """Hash of every Python source below the given package folders and of what compiles them.

    Two processes get the same hash exactly when compiled code of one is valid for the other.
    """
    digest = hashlib.sha256()
    digest.update(f"{sys.version} {platform.machine()} {version('numba')} {version('numpy')}".encode())
    for package in packages:
        for source in sorted(package.rglob("*.py")):
            digest.update(source.relative_to(package).as_posix().encode())
            digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


def _user_cache() -> Path:
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local"))
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches"
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache"))


CACHE_FOLDER = _user_cache() / "tiltwing-sitl" / source_hash(Path(__file__).parent)
os.environ["NUMBA_CACHE_DIR"] = str(CACHE_FOLDER)

from numba import njit  # noqa: E402  (numba reads NUMBA_CACHE_DIR when it is imported)

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import TypeVar

    _F = TypeVar("_F", bound=Callable[..., Any])

    def compiled(function: _F) -> _F:
        """Compile a function of the numeric core; the type checker sees the plain function."""
        return function

else:
    # fastmath stays off so that the same seed gives the same bits; numpy's error model (1/0 = inf) spares a
    # branch at every division and lets bad numbers show as inf/nan instead of raising in the middle of a flight.
    compiled: Any = njit(cache=True, error_model="numpy", nogil=True)


def is_warm() -> bool:
    """True when a compiled core for exactly these sources is on disk."""
    return CACHE_FOLDER.is_dir() and any(CACHE_FOLDER.rglob("*.nbi"))
