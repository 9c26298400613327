"""The compile cache: never old code, never compiled twice, nobody else's business."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import vehicle_model.compiled as compiled_module
from vehicle_model.compiled import compiled, source_hash

# A core of two modules: `caller` calls `callee` in another file, which is the change that Numba's own cache misses.
CALLEE = "from core.compiled import compiled\n\n@compiled\ndef callee(x):\n    return {factor} * x\n"
CALLER = (
    "from core.callee import callee\nfrom core.compiled import compiled\n\n"
    "@compiled\ndef caller(x):\n    return callee(x) + 1.0\n"
)
PROBE = """
import json
{before}
from numba.core import config
from core.caller import caller
from core.compiled import CACHE_FOLDER
value = caller(10.0)
hits, misses = caller.stats.cache_hits, caller.stats.cache_misses
print(json.dumps({{"value": value, "loaded": sum(hits.values()), "compiled": sum(misses.values()),
                   "folder": str(CACHE_FOLDER), "others": config.CACHE_DIR}}))
"""


@pytest.fixture
def core(tmp_path: Path) -> Path:
    """Package folder `core` with the real compiled.py and two modules that use it."""
    package = tmp_path / "core"
    package.mkdir()
    (package / "__init__.py").touch()
    shutil.copy(compiled_module.__file__, package / "compiled.py")
    (package / "callee.py").write_text(CALLEE.format(factor="2.0"))
    (package / "caller.py").write_text(CALLER)
    return package


def run(core: Path, before: str = "", **environment: str) -> dict[str, object]:
    """Call `caller(10)` in a fresh process whose user cache lies beside the package."""
    done = subprocess.run(
        [sys.executable, "-c", PROBE.format(before=before)],
        cwd=core.parent,
        env={**os.environ, "XDG_CACHE_HOME": str(core.parent / "cache"), **environment},
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    )
    return json.loads(done.stdout)


def test_changed_callee_in_another_module_is_recompiled_into_a_new_folder(core: Path) -> None:
    first = run(core)
    again = run(core)
    (core / "callee.py").write_text(CALLEE.format(factor="3.0"))
    changed = run(core)

    assert first["value"] == 21.0
    assert (first["compiled"], again["compiled"], again["loaded"]) == (1, 0, 1)
    assert again["folder"] == first["folder"]
    assert changed["folder"] != first["folder"]
    assert changed["value"] == 31.0


def test_cache_folder_holds_when_numba_was_imported_first_and_leaves_its_settings_alone(core: Path) -> None:
    elsewhere = str(core.parent / "somebody-else")
    report = run(core, before="import numba", NUMBA_CACHE_DIR=elsewhere)
    assert report["others"] == elsewhere
    assert list(Path(str(report["folder"])).rglob("*.nbi"))
    assert not list(core.rglob("*.nbi"))


def test_without_a_writable_user_cache_the_code_still_runs_and_keeps_nothing(core: Path) -> None:
    (core.parent / "cache").write_text("a file where the folder should go")
    report = run(core)
    assert report["value"] == 21.0
    assert report["folder"] == "None"
    assert not list(core.parent.rglob("*.nbi"))


def test_hash_sees_what_compiled_code_can_mean_at_any_depth_and_nothing_else(core: Path) -> None:
    hashes = {source_hash(core)}
    (core / "deep").mkdir()
    (core / "deep" / "new.py").write_text("@compiled\ndef f(x):\n    return x + 1\n")
    hashes.add(source_hash(core))
    (core / "deep" / "new.py").write_text(
        "from core.deep.constant import ONE\n\n\n@compiled\ndef f(x):\n    return x + ONE\n"
    )
    hashes.add(source_hash(core))
    (core / "deep" / "constant.py").write_text("from core.deep import (\n    numbers,\n)\n\nONE = numbers.ONE\n")
    (core / "deep" / "numbers.py").write_text("ONE = 1\n")
    hashes.add(source_hash(core))
    (core / "deep" / "numbers.py").write_text("ONE = 2\n")
    hashes.add(source_hash(core))
    (core / "deep" / "new.py").rename(core / "deep" / "renamed.py")
    hashes.add(source_hash(core))
    assert len(hashes) == 6
    (core / "notes.txt").write_text("not a source")
    (core / "talks.py").write_text("# nothing compiled here, nor needed there\n")
    assert source_hash(core) in hashes


def test_same_sources_at_another_place_do_not_count_as_compiled(core: Path) -> None:
    # Numba files its index under the source's path: code cached for one checkout is not found from another.
    twin = core.parent / "twin" / "core"
    shutil.copytree(core, twin)
    assert source_hash(twin) != source_hash(core)


def test_package_above_the_core_is_recompiled_when_the_core_changes(core: Path) -> None:
    above = core.parent / "above"
    above.mkdir()
    (above / "__init__.py").touch()
    (above / "caller.py").write_text(CALLER)
    use_above = "import sys, above.caller; sys.modules['core.caller'] = above.caller"
    first = run(core, before=use_above)
    again = run(core, before=use_above)
    (core / "callee.py").write_text(CALLEE.format(factor="3.0"))
    assert (first["value"], again["value"], again["compiled"]) == (21.0, 21.0, 0)
    assert run(core, before=use_above)["value"] == 31.0


def test_function_outside_any_package_is_not_kept(tmp_path: Path) -> None:
    source = "@compiled\ndef half(x):\n    return 0.5 * x\n"
    script = tmp_path / "script.py"
    script.write_text(source)
    names: dict[str, Any] = {"compiled": compiled}
    exec(compile(source, script, "exec"), names)
    half = names["half"]
    assert half(3.0) == 1.5
    assert half.stats.cache_path is None


def test_division_by_zero_gives_inf_instead_of_raising() -> None:
    @compiled
    def divide(a: float, b: float) -> float:
        return a / b

    assert divide(1.0, 0.0) == float("inf")
