"""What the analysis differentiates is what flies, and the linear models say what it does next."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sitl.control.corridor import DELAY, RATE, CorridorFlight, analyse_point
from sitl.control.design import design_for
from sitl.control.linear import CHART, chart_from_state, linear_plant, state_from_chart
from sitl.control.report import margin_table, page, write_report
from sitl.tick import CRAFT, fly
from vehicle_model.aircraft import load_aircraft
from vehicle_model.battery import make_battery
from vehicle_model.wind import make_wind

AIRCRAFT = load_aircraft()
DESIGN = design_for(AIRCRAFT)


def settled(airspeed: float, climb: float = 0.0) -> CorridorFlight:
    flight = CorridorFlight(AIRCRAFT, DESIGN, airspeed, climb)
    flight.settle()
    return flight


def test_what_is_analysed_is_the_tick_that_flies() -> None:
    ticks = 200
    ours, theirs = settled(10.0), settled(10.0)
    for flight in (ours, theirs):
        flight.state[:] = state_from_chart(chart_from_state(flight.state) + 0.01)
    ours.fly(ticks)
    craft = np.zeros(1, CRAFT)
    for name in ("state", "controls", "following", "vehicle", "environment", "estimate", "memory", "status"):
        craft[name][0] = getattr(theirs, name)
    craft["wind"][0], craft["battery"][0] = make_wind(), make_battery(AIRCRAFT.battery)
    assert fly(
        craft, theirs.setpoint, DESIGN.gains, DESIGN.table, DESIGN.axes, DESIGN.schedule, DESIGN.vehicle,
        True, False, 0, RATE, ticks,
    )  # fmt: skip
    np.testing.assert_array_equal(ours.state, craft["state"][0])
    np.testing.assert_array_equal(ours.controls, craft["controls"][0])


@pytest.mark.parametrize(("airspeed", "climb"), [(0.0, 2.0), (6.0, 2.0), (20.0, 2.0), (28.0, -2.0)])
def test_linear_model_predicts_two_seconds_of_flight(airspeed: float, climb: float) -> None:
    flight, disturbed = settled(airspeed, climb), settled(airspeed, climb)
    laws, _ = flight.linear_laws()
    plant = linear_plant(flight.vehicle, flight.environment, flight.state, flight.controls, 1.0 / RATE)
    x = np.zeros(len(CHART))
    for name, size in (("vn", 2e-4), ("ve", 3e-4), ("vd", -2e-4), ("roll", 1e-4), ("pitch", -1e-4), ("r", 1e-4)):
        x[CHART.index(name)] = size
    disturbed.state[:] = state_from_chart(chart_from_state(flight.state) + x)
    memory, queue = np.zeros(len(laws.a)), [np.zeros(len(laws.outputs))] * DELAY
    found, foretold = np.empty((2, 2 * RATE, len(CHART)))
    for k in range(len(found)):
        y = plant.c @ x
        queue.append(laws.c @ memory + laws.d @ y)
        memory = laws.a @ memory + laws.b @ y
        x = plant.a @ x + plant.b @ queue.pop(0)
        flight.fly(1)
        disturbed.fly(1)
        found[k], foretold[k] = chart_from_state(disturbed.state) - chart_from_state(flight.state), x
    error, size = np.abs(found - foretold).max(axis=0), np.abs(foretold).max(axis=0)
    np.testing.assert_array_less(error, 0.02 * size + 1e-7)


def test_margins_of_a_point_are_those_of_its_own_loops() -> None:
    point = analyse_point(AIRCRAFT, DESIGN, 20.0, 0.0)
    assert point.held
    assert point.stable
    assert {"throttle_left", "tilt", "elevator", "p", "q", "r", "roll", "pitch", "vd", "down"} <= set(point.margins)
    assert "airspeed" not in point.margins  # the laws do not read it
    # all at once bear no more than the weakest alone
    actuators = [point.margins[name].disk for name in ("throttle_left", "throttle_right", "throttle_tail", "tilt",
                                                       "aileron_left", "aileron_right", "elevator")]  # fmt: skip
    assert 0.0 < point.actuators_disk <= min(actuators) * 1.001


def test_page_has_every_loop_and_says_which_points_are_not_held() -> None:
    points = [analyse_point(AIRCRAFT, DESIGN, airspeed, 0.0) for airspeed in (0.0, 20.0)]
    text = page("some.toml", points)
    table = margin_table(points)
    assert table.airspeeds == (0.0, 20.0)
    for name in table.loops:
        assert f"| {name} |" in text
    assert "not held" not in text
    points[0] = replace(points[0], flown=(4.0, 0.0))
    assert "0 m/s (flown: 4.0 m/s" in page("some.toml", points)
    assert margin_table(points).airspeeds == (20.0,)


def test_report_writes_the_page_and_every_figure_on_it(tmp_path: Path) -> None:
    written = write_report(AIRCRAFT, tmp_path / "new", lambda points: [(v, c) for v, c in points if v == 20.0])
    text = written[0].read_text(encoding="utf-8")
    assert text.startswith("# Control report: hong2013.toml\n\n3 points")
    assert len(written) == 7
    for figure in written[1:]:
        assert f"({figure.name})" in text
        assert figure.read_bytes().startswith(b"\x89PNG")
