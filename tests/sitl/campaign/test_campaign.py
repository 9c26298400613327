"""A small campaign, really flown: it lands, and neither processes nor order nor company change a flight."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from sitl.campaign.fly import Campaign, Flyer
from sitl.campaign.outcome import as_table
from sitl.campaign.pool import fly_all

MISSION = Path(__file__).parents[3] / "docs" / "examples" / "survey_3km.plan"
CAMPAIGN = Campaign(0, MISSION)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where a campaign of two cases, flown from the shell by two processes, has left what came of it."""
    out = tmp_path_factory.mktemp("campaign")
    command = [sys.executable, "-m", "sitl.campaign", "--cases", "2", "--jobs", "2", "--out", str(out)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "2 flights, 0 lost" in done.stdout
    assert "cross-track [m]" in " ".join(done.stdout.split())
    return out


def test_no_flight_is_lost_and_all_are_told(folder: Path) -> None:
    table = json.loads((folder / "campaign.json").read_text())
    assert table["lost"] == 0
    assert [flight["case"]["number"] for flight in table["flights"]] == [0, 1]
    for flight in table["flights"]:
        assert flight["summary"]["distance"] > 3000.0
        assert flight["summary"]["touchdown_speed"] < 0.6
    assert "2 flights of survey_3km.plan by hong2013, seed 0: **0 lost**" in (folder / "README.md").read_text()


def test_a_case_is_the_same_flight_alone_and_in_company(folder: Path) -> None:
    together = json.loads((folder / "campaign.json").read_text())["flights"][1]
    alone = Flyer(CAMPAIGN).fly(1)
    assert json.loads(json.dumps(as_table(alone.outcome))) == together
    assert len(alone.page.route) >= 6
    assert alone.page.fences


def test_one_process_flies_the_cases_in_order() -> None:
    (outcome,) = fly_all(CAMPAIGN, 1, jobs=1)
    assert outcome.case.number == 0
    assert outcome.lost == ()


def test_one_case_flown_again_leaves_its_report(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "sitl.campaign", "--only", "1", "--out", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert (tmp_path / "case_0_1.png").stat().st_size > 50_000


@pytest.mark.parametrize("option", ["--mission", "--aircraft"])
def test_a_file_that_is_none_is_told_in_one_line(tmp_path: Path, option: str) -> None:
    missing = tmp_path / "missing"
    command = [sys.executable, "-m", "sitl.campaign", "--cases", "1", "--jobs", "1", option, str(missing)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith(f"campaign: {missing}: cannot be read")
    assert len(done.stderr.splitlines()) == 1
