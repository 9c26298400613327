"""The repository itself: what is pinned, what the README promises, how files begin."""

import ast
import re
import subprocess
import sys
import tomllib
from importlib.metadata import distribution, version
from pathlib import Path

import pytest
from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
LOCK = (ROOT / "requirements.lock").read_text()
README = (ROOT / "README.md").read_text()


def tracked(*patterns: str) -> list[Path]:
    """Files that belong to the project, present or about to be committed."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard", "--", *patterns]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    return [ROOT / name for name in listed.split("\0") if name and (ROOT / name).is_file()]


def pinned() -> dict[str, str]:
    """Name to version, as the lock file pins them for this interpreter."""
    lines = [line.partition("#")[0].strip() for line in LOCK.splitlines()]
    pins = [Requirement(line) for line in lines if line]
    return {pin.name: str(pin.specifier).removeprefix("==") for pin in pins if not pin.marker or pin.marker.evaluate()}


def test_lock_satisfies_every_requirement_of_the_project() -> None:
    extras = PROJECT["project"]["optional-dependencies"]
    required = PROJECT["project"]["dependencies"] + [line for extra in extras.values() for line in extra]
    pins = pinned()
    for requirement in map(Requirement, required):
        assert requirement.specifier.contains(pins[requirement.name.lower()]), requirement


def test_lock_pins_exactly_what_is_installed() -> None:
    assert {name: version(name) for name in pinned()} == pinned()


def test_lock_names_no_host_and_no_place_on_a_machine() -> None:
    assert not re.search(r"://|--index|--find-links|file:|@ ", LOCK)


def test_build_uses_the_message_definitions_that_are_pinned_for_running() -> None:
    build = {r.name: r for r in map(Requirement, PROJECT["build-system"]["requires"])}
    assert build["pymavlink"].specifier.contains(pinned()["pymavlink"])


@pytest.mark.parametrize("script", PROJECT["project"]["scripts"])
def test_entry_point_can_be_loaded(script: str) -> None:
    (entry,) = [e for e in distribution("tiltwing-sitl").entry_points if e.name == script]
    assert callable(entry.load())


def test_every_make_command_in_the_readme_exists() -> None:
    makefile = (ROOT / "Makefile").read_text()
    targets = set(re.findall(r"^([a-z-]+):", makefile, re.MULTILINE))
    named = set(re.findall(r"\bmake ([a-z-]+)", README))
    assert {"run", "test"} <= named <= targets


def test_every_link_in_the_documents_leads_somewhere() -> None:
    for page in tracked("*.md"):
        for target in re.findall(r"\]\(([^)#\s]+)[^)]*\)|src=\"([^\"]+)\"", page.read_text()):
            path = target[0] or target[1]
            if "://" not in path:
                assert (page.parent / path).exists(), f"{page.name}: {path}"


def test_every_source_file_begins_by_saying_what_lives_there() -> None:
    silent = [p for p in tracked("*.py") if p.stat().st_size and not ast.get_docstring(ast.parse(p.read_text()))]
    assert silent == []


def test_source_files_fit_one_sitting() -> None:
    lengths = {str(path.relative_to(ROOT)): len(path.read_text().splitlines()) for path in tracked("*.py")}
    assert {name: length for name, length in lengths.items() if length > 400} == {}


def test_starting_leaves_the_slow_libraries_alone() -> None:
    # Each would cost the start a good part of its second; they are imported where they are used.
    # (Numba itself imports the shell of scipy, which is cheap; its parts are not.)
    slow = ("scipy.linalg", "scipy.optimize", "scipy.integrate", "matplotlib", "rerun", "pyarrow")
    probe = f"import sys, sitl.launch, vehicle_model.trim; print([m for m in {slow} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout.strip() == "[]"
