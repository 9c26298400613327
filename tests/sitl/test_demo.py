"""The demo from the shell: it flies the mission, says where recording and report are, and they are there."""

import subprocess
import sys
from pathlib import Path

import matplotlib.image
import pytest


def demo(*options: str) -> "subprocess.CompletedProcess[str]":
    command = [sys.executable, "-m", "sitl.demo", *options]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """Where the demo left its files, and what it said."""
    folder = tmp_path_factory.mktemp("demo") / "new"
    done = demo("--out", str(folder), "--no-map")
    assert done.returncode == 0, done.stdout + done.stderr
    return folder, done.stdout


def test_it_tells_the_flight_from_arming_to_disarming(flown: tuple[Path, str]) -> None:
    told = flown[1]
    order = [told.index(word) for word in ("Armed", "Landing detected", "Mission finished", "Disarmed")]
    assert order == sorted(order)


def test_it_leaves_the_report_where_it_says(flown: tuple[Path, str]) -> None:
    folder, told = flown
    assert f"report     {folder / 'survey_3km.png'}" in told
    assert matplotlib.image.imread(folder / "survey_3km.png").shape[:2] == (1753, 1240)


def test_it_leaves_the_recording_where_it_says(flown: tuple[Path, str]) -> None:
    folder, told = flown
    assert f"recording  {folder / 'survey_3km.rrd'}" in told
    assert (folder / "survey_3km.rrd").stat().st_size > 1_000_000


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        (("--mission", "/no/such.plan"), "/no/such.plan: cannot be read"),
        (("--aircraft", "/no/such.toml"), "/no/such.toml: cannot be read"),
        (("--rerun", "window"), "'--rerun'"),
    ],
)
def test_what_cannot_be_flown_is_told_in_one_line(options: tuple[str, str], complaint: str) -> None:
    done = demo(*options)
    assert done.returncode == 2
    assert complaint in done.stderr
    assert len(done.stderr.splitlines()) == 1
