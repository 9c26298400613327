"""The identification: its misfit is nothing where the paper is met, grows with each error, and the search lowers it."""

import dataclasses
import math
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vehicle_model import identify
from vehicle_model.aircraft import load_aircraft
from vehicle_model.identify import RANGES, TABLE_1, Figures, figures_of, misfit
from vehicle_model.linearise import linearise, modes
from vehicle_model.trim import trim_sweep

AIRCRAFT = load_aircraft()
OURS = figures_of(AIRCRAFT)
SPEEDS = np.arange(31.0)

# An aircraft that does all that the paper shows: straight curves through the printed values.
PERFECT = dataclasses.replace(
    OURS,
    rpm=6000.0 - 45.0 * SPEEDS,
    tilt=np.radians(84.0 - 2.5 * SPEEDS),
    elevator=np.radians(-3.0 + 0.05 * SPEEDS),
    unbalanced=np.zeros(31),
    wetted_margin=np.full(31, math.radians(8.0)),
    unwetted_margin=np.full(31, math.radians(12.0)),
    max_lift_angle=math.radians(19.0),
    blade_lift=0.8,
    short_period=TABLE_1["short_period"],
    phugoid=TABLE_1["phugoid"],
    lift_to_drag=7.0,
    theta_peak=math.radians(0.5),
    q_peak=math.radians(2.5),
)


def cost(found: Figures) -> float:
    return float(np.sum(misfit(found) ** 2))


def with_bump(values: np.ndarray, at: int, by: float) -> np.ndarray:
    changed = values.copy()
    changed[at] += by
    return changed


ERRORS: dict[str, Any] = {
    "short period damping": lambda k: {"short_period": TABLE_1["short_period"] - 0.3 * k},
    "short period frequency": lambda k: {"short_period": TABLE_1["short_period"] + 0.5j * k},
    "phugoid damping": lambda k: {"phugoid": TABLE_1["phugoid"] + 0.01 * k},
    "phugoid frequency": lambda k: {"phugoid": TABLE_1["phugoid"] - 0.05j * k},
    "hover rpm": lambda k: {"rpm": with_bump(PERFECT.rpm, 0, 200.0 * k)},
    "cruise rpm": lambda k: {"rpm": with_bump(PERFECT.rpm, 30, 500.0 * k)},
    "a kink in rpm": lambda k: {"rpm": with_bump(PERFECT.rpm, 12, 300.0 * k)},
    "hover tilt": lambda k: {"tilt": with_bump(PERFECT.tilt, 0, 0.15 * k)},
    "cruise tilt": lambda k: {"tilt": with_bump(PERFECT.tilt, 30, 0.2 * k)},
    "tilt that rises": lambda k: {"tilt": with_bump(PERFECT.tilt, 15, 0.1 * k)},
    "elevator out of its axis": lambda k: {"elevator": PERFECT.elevator - 0.12 * k},
    "a kink in the elevator": lambda k: {"elevator": with_bump(PERFECT.elevator, 10, 0.05 * k)},
    "no trim": lambda k: {"unbalanced": with_bump(PERFECT.unbalanced, 5, 0.02 * k)},
    "stalled wetted wing": lambda k: {"wetted_margin": with_bump(PERFECT.wetted_margin, 8, -0.15 * k)},
    "no gust margin": lambda k: {"unwetted_margin": with_bump(PERFECT.unwetted_margin, 28, -0.15 * k)},
    "overloaded blades": lambda k: {"blade_lift": PERFECT.blade_lift + 0.5 * k},
    "a wing that never stalls": lambda k: {"max_lift_angle": PERFECT.max_lift_angle + 0.2 * k},
    "a clean glider": lambda k: {"lift_to_drag": 7.0 + 5.0 * k},
    "theta out of its axis": lambda k: {"theta_peak": PERFECT.theta_peak + 0.02 * k},
    "q out of its axis": lambda k: {"q_peak": PERFECT.q_peak + 0.05 * k},
}  # fmt: skip


def test_misfit_is_nothing_where_the_paper_is_met() -> None:
    assert misfit(PERFECT) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("name", ERRORS)
def test_misfit_grows_with_each_error(name: str) -> None:
    small, large = (cost(dataclasses.replace(PERFECT, **ERRORS[name](size))) for size in (1.0, 2.0))
    assert 0.0 < small < large


def test_figures_are_the_trims_and_poles_that_the_commands_print() -> None:
    trims = trim_sweep(AIRCRAFT, SPEEDS)
    assert OURS.rpm == pytest.approx([trim.rpm for trim in trims], rel=1e-7)
    assert OURS.tilt == pytest.approx([trim.tilt for trim in trims], abs=1e-8)
    assert OURS.elevator == pytest.approx([trim.elevator for trim in trims], abs=1e-8)
    assert OURS.unbalanced.max() < 1e-9
    poles = {mode.name: complex(mode.real, mode.imag) for mode in modes(linearise(AIRCRAFT, trims[30], "throttle"))}
    # The full model has the tail rotor's torque, which couples the two planes of motion a little.
    assert OURS.short_period == pytest.approx(poles["short_period"], rel=1e-3)
    assert OURS.phugoid == pytest.approx(poles["phugoid"], rel=1e-2)


def test_the_shipped_aircraft_is_an_identified_one() -> None:
    values = AIRCRAFT
    for path, (low, high) in RANGES.items():
        at: Any = values
        for name in path.split("."):
            at = at["xyz".index(name)] if isinstance(at, tuple) else getattr(at, name)
        assert low <= at <= high, path
    assert np.abs(misfit(OURS)).max() < 2.0
    for ours, paper in ((OURS.short_period, TABLE_1["short_period"]), (OURS.phugoid, TABLE_1["phugoid"])):
        assert ours.real == pytest.approx(paper.real, rel=0.02)
        assert ours.imag == pytest.approx(paper.imag, rel=0.02)


NARROW = {path: RANGES[path] for path in ("mass_properties.iyy", "tail.horizontal.area", "fuselage.drag_area.x")}


def test_a_search_over_three_parameters_lowers_the_cost_repeatably_and_writes_what_it_found(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(identify, "RANGES", NARROW)
    off = AIRCRAFT.with_values({"mass_properties.iyy": 1.9, "tail.horizontal.area": 0.07})
    found, values, reached = identify.identify(off, "throttle", 2, 1, 4)
    again = identify.identify(off, "throttle", 2, 1, 4)
    assert (values, reached) == again[1:]
    assert cost(figures_of(found)) < 0.5 * cost(figures_of(off))
    assert all(low <= values[path] <= high for path, (low, high) in NARROW.items())

    file = tmp_path / "aircraft.toml"
    shutil.copy(AIRCRAFT.source_file, file)
    identify.main(starts=2, polished=1, seed=4, aircraft=file, write=file)
    assert "cost" in capsys.readouterr().out
    written = load_aircraft(file)
    assert written.mass_properties.iyy == pytest.approx(values["mass_properties.iyy"], rel=1e-3)
    assert written.tail.horizontal.area == pytest.approx(values["tail.horizontal.area"], rel=1e-3)
    assert written.fuselage.drag_area[0] == pytest.approx(values["fuselage.drag_area.x"], rel=1e-3)
    assert written.wing == AIRCRAFT.wing
    assert "calibrated to the paper" in file.read_text()
