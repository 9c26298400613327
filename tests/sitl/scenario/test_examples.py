"""The scenarios and snippets of the documents, flown: each shows what it says it shows."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

from sitl import Simulation
from sitl.flight.landed import LandedState
from sitl.flight.mode import Mode
from sitl.scenario import load_scenario
from vehicle_model.state import ROTOR_SPEED

ROOT = Path(__file__).parents[3]
EXAMPLES = ROOT / "docs" / "examples"


def flown(name: str, timeout: float) -> tuple[Simulation, np.ndarray]:
    """An example from its beginning until it is disarmed after its landing, and its history."""
    simulation = Simulation(EXAMPLES / name)
    history = simulation.record(0.02)
    simulation.advance(2.0)  # those that begin on the ground arm after one second
    assert simulation.run_until(lambda s: not s.flight.armed, timeout=timeout)
    texts = [message.text for message in simulation.flight.messages.kept]
    assert texts[-2:] == ["Landing detected", "Disarmed: landed"]
    assert not any("refused" in text for text in texts)
    return simulation, history.rows


def test_every_example_loads_is_named_in_the_page_and_says_how_to_run_it() -> None:
    page = (ROOT / "docs" / "scenario.md").read_text(encoding="utf-8")
    for file in EXAMPLES.glob("*.toml"):
        assert load_scenario(file).steps
        assert f"](examples/{file.name})" in page
        assert f"--scenario docs/examples/{file.name} --speed max --duration " in file.read_text(encoding="utf-8")


def test_gusts_in_cruise_do_not_stall_the_wing_and_the_vehicle_comes_home() -> None:
    simulation, rows = flown("gust_in_cruise.toml", 300.0)
    cruise = rows[(rows["time"] > 10.0) & (rows["time"] < 60.0)]
    assert -cruise["wind_ned"][:, 2].min() == pytest.approx(4.0, abs=0.05)
    assert -cruise["wind_ned"][:, 0].min() == pytest.approx(8.0, abs=0.05)
    assert cruise["stall_margin_wetted"].min() > 0.0
    assert cruise["stall_margin_outer"].min() > 0.0
    assert np.abs(cruise["position_ned"][:, 2] + 100.0).max() < 3.0
    assert math.hypot(*simulation.snapshot().position_ned[:2]) < 1.0


def test_a_weak_propeller_makes_the_vehicle_lurch_and_no_more() -> None:
    simulation, rows = flown("motor_fault.toml", 120.0)
    hover = rows[(rows["mode"] == Mode.HOLD) & (rows["landed"] == LandedState.IN_AIR)]
    since_the_fault = hover[hover["time"] > hover["time"][0] + 10.0]
    assert 3.0 < np.degrees(np.abs(since_the_fault["euler"][:, 0])).max() < 10.0
    place = np.array([0.0, 0.0, hover["position_ned"][-1, 2]])
    away = np.linalg.norm(since_the_fault["position_ned"] - place, axis=1)
    assert 0.5 < away.max() < 1.5
    assert away[-1] < 0.3
    left, right = since_the_fault["state"][-1, ROTOR_SPEED : ROTOR_SPEED + 2]
    assert left > 1.1 * right, "the weak propeller turns faster"
    assert math.hypot(*simulation.snapshot().position_ned[:2]) < 1.0


def test_the_nose_follows_a_veering_wind_while_the_place_is_held() -> None:
    _, rows = flown("hover_in_wind.toml", 200.0)
    hover = rows[(rows["mode"] == Mode.HOLD) & (rows["landed"] == LandedState.IN_AIR)]
    yaw = np.degrees(hover["euler"][:, 2])
    north_wind, north_easter = hover["wind_ned"][:, 1] == 0.0, hover["wind_ned"][:, 1] < 0.0
    assert yaw[north_wind][-1] == pytest.approx(0.0, abs=3.0)
    assert yaw[north_easter][-1] == pytest.approx(45.0, abs=3.0)
    away = hover["position_ned"][:, :2]
    assert np.hypot(away[:, 0], away[:, 1]).max() < 1.5


def test_the_snippets_of_the_page_on_python_run_in_the_order_in_which_they_stand(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(ROOT)
    page = (ROOT / "docs" / "in-process.md").read_text(encoding="utf-8")
    snippets = re.findall(r"^```python\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    assert len(snippets) > 5
    names: dict[str, object] = {}
    for snippet in snippets:
        exec(compile(snippet, "docs/in-process.md", "exec"), names)
