"""What transitions must show (issue 3): height kept, no actuator at a limit, no stall; in wind, climbing, sinking."""

import functools
import math

import numpy as np
import pytest

from tests.sitl.control.flown import Flown, at_a_limit
from vehicle_model.force_map import STALL_MARGIN

Wind = tuple[float, float, float]
HEIGHT = 300.0
CRUISE = 25.0  # [m/s]
CALM, HEAD, TAIL, FROM_LEFT, FROM_RIGHT = (
    (0.0, 0.0, 0.0), (-8.0, 0.0, 0.0), (8.0, 0.0, 0.0), (0.0, 8.0, 0.0), (0.0, -8.0, 0.0)
)  # fmt: skip
BRAKING_DISTANCE = {CALM: 600.0, HEAD: 350.0, TAIL: 900.0, FROM_LEFT: 600.0, FROM_RIGHT: 600.0}  # and some cruise [m]
GRAVITY = 9.80665
CORRIDOR_FROM = 8.0  # forward airspeed below which a rotor carries the vehicle however it sinks [m/s]


@functools.cache
def front(wind: Wind, sinking: float) -> tuple[np.ndarray, float]:
    """Hover to 25 m/s on a leg north, climbing or sinking [m/s]; the flight, and the largest error of height [m]."""
    flown = Flown(height=HEIGHT)
    flown.demand.point((0.0, 0.0, -HEIGHT), speed=5.0)
    flown.demand.heading(0.0)
    flown.fly(2.0)
    flown.airframe.set_wind(wind)
    flown.fly(20.0)
    start, down = flown.time, flown.now["position"][2]
    flown.demand.leg((0.0, 0.0, -HEIGHT), (5000.0, 0.0, -HEIGHT), speed=CRUISE, cruise=True)
    if sinking:
        flown.demand.climb(sinking)
    flown.until(lambda row: row["airspeed"] > 0.99 * CRUISE, timeout=30.0)
    rows = flown.history(start)
    return rows, np.abs(rows["position"][:, 2] - down - sinking * (rows["time"] - start)).max()


@functools.cache
def back(wind: Wind, sinking: float) -> tuple[np.ndarray, np.ndarray, float]:
    """25 m/s to hover at a point north, climbing or sinking [m/s]; the flight, the point, the error of height [m]."""
    flown = Flown(CRUISE, height=HEIGHT, wind=wind)
    flown.demand.leg((0.0, 0.0, -HEIGHT), (5000.0, 0.0, -HEIGHT), speed=CRUISE, cruise=True)
    flown.fly(20.0)
    start, down = flown.time, flown.now["position"][2]
    point = np.array([flown.now["position"][0] + BRAKING_DISTANCE[wind], 0.0, -HEIGHT])
    flown.demand.point(point.tolist(), speed=CRUISE, cruise=True)
    if sinking:
        flown.demand.climb(sinking)
    flown.fly(90.0)
    rows = flown.history(start)
    return rows, point, np.abs(rows["position"][:, 2] - down - sinking * (rows["time"] - start)).max()


def assert_easy(rows: np.ndarray) -> None:
    """No actuator but the tilt is at a limit for longer than 1 s, nor any strip in the slipstream near its stall."""
    assert max(at_a_limit(rows).values()) < 1.0
    assert np.degrees(rows["wetted_margin"].min()) > 2.0


def test_front_transition_in_a_calm_keeps_height_within_3_m() -> None:
    rows, error = front(CALM, 0.0)
    assert error < 3.0
    assert np.abs(rows["position"][:, 1]).max() < 0.1  # nothing pushes it aside
    assert_easy(rows)


def test_back_transition_in_a_calm_keeps_height_within_5_m_and_ends_hovering_at_the_point() -> None:
    rows, point, error = back(CALM, 0.0)
    assert error < 5.0
    assert rows["position"][:, 0].max() < point[0] + 5.0
    assert_hovers_at(rows, point)
    assert_easy(rows)


@pytest.mark.parametrize("wind", [HEAD, TAIL, FROM_LEFT, FROM_RIGHT])
def test_both_transitions_in_8_m_s_of_wind_keep_height_within_6_m(wind: Wind) -> None:
    forward, error = front(wind, 0.0)
    assert error < 6.0
    assert_easy(forward)
    rows, point, error = back(wind, 0.0)
    assert error < 6.0
    assert_hovers_at(rows, point)
    assert_easy(rows)


def test_both_transitions_while_climbing_2_m_s_keep_to_the_climb() -> None:
    rows, error = front(CALM, -2.0)
    assert error < 3.0
    assert_easy(rows)
    rows, point, error = back(CALM, -2.0)
    assert error < 5.0
    assert_hovers_at(rows, point, sinking=-2.0)
    assert_easy(rows)


def test_front_transition_while_sinking_2_m_s_keeps_to_the_descent() -> None:
    rows, error = front(CALM, 2.0)
    assert error < 3.0
    assert_easy(rows)


@pytest.mark.parametrize("wind", [CALM, HEAD, TAIL])
def test_back_transition_while_sinking_gives_up_the_sink_that_the_wing_cannot_bear(wind: Wind) -> None:
    """Along the path a - g vd/u is what the force forward per mass has to be: no less than the map's lowest one."""
    rows, point, _ = back(wind, 2.0)
    slowing = rows[: np.argmax(rows["forward"] < CORRIDOR_FROM)]
    assert len(slowing) > 100
    acceleration = np.gradient(np.hypot(slowing["velocity"][:, 0], slowing["velocity"][:, 1]), slowing["time"])
    allowed = np.maximum(acceleration - slowing["lowest_force"], 0.0) * slowing["forward"] / GRAVITY
    # The velocity loop follows its reference this closely.
    assert (slowing["velocity"][:, 2] - allowed).max() < 0.35
    assert slowing["velocity"][:, 2].min() < 1.0  # so some was given up
    assert slowing["wetted_margin"].min() > STALL_MARGIN - math.radians(2.5)
    # In the end it sinks as told. In 8 m/s of wind that takes what force there is, and leaves little to hold the point.
    last = rows[-1]
    assert math.hypot(*(last["position"] - point)[:2]) < (5.0 if any(wind) else 1.0)
    np.testing.assert_allclose(last["velocity"], (0.0, 0.0, 2.0), atol=1.0 if any(wind) else 0.2)
    assert rows[-1000:]["wetted_margin"].min() > 0.0


def assert_hovers_at(rows: np.ndarray, point: np.ndarray, sinking: float = 0.0) -> None:
    """In the end it stands over the point, or climbs or sinks there."""
    last = rows[-1]
    assert math.hypot(*(last["position"] - point)[:2]) < 1.0
    np.testing.assert_allclose(last["velocity"], (0.0, 0.0, sinking), atol=0.2)


def test_cruise_takes_less_than_a_third_of_the_power_of_hover() -> None:
    rows, _, _ = back(CALM, 0.0)
    assert rows["power"][0] < rows["power"][-1] / 3.0
