"""Guidance against its closed forms: wind triangle, stopping distance, circle; and paths that it converges to."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from sitl.control.guidance import course_speed, horizontal_demand, stopping_speed, vertical_demand
from sitl.control.records import ESTIMATE, GAINS, SETPOINT, Horizontal, Vertical

AXIS = np.arange(-14.0, 36.0, 2.0)
# Deceleration over airspeed that varies as a corridor's does: strong in hover, weakest half-way.
BRAKING = 0.9 - 0.5 * np.exp(-(((AXIS - 13.0) / 5.0) ** 2))
FIRST, STEP = float(AXIS[0]), 2.0

metres = st.floats(-300.0, 300.0)
course = st.floats(-math.pi, math.pi)


def setpoint(kind: Horizontal, **values: object) -> np.void:
    array = np.zeros(1, SETPOINT)
    array["horizontal"] = kind
    for name, value in values.items():
        array[name] = value
    return array[0]


def estimate(**values: object) -> np.void:
    array = np.zeros(1, ESTIMATE)
    for name, value in values.items():
        array[name] = value
    return array[0]


def gains() -> np.void:
    array = np.zeros(1, GAINS)
    array["position"], array["path"], array["altitude"] = 0.4, 0.25, 0.6
    return array[0]


def asked(seen: np.void, task: np.void) -> np.ndarray:
    """Velocity north, east [m/s], acceleration north, east [m/s^2]."""
    return np.array(horizontal_demand(seen, task, gains(), BRAKING, FIRST, STEP))


@given(course, st.floats(0.0, 10.0), course, st.floats(12.0, 30.0))
def test_ground_speed_closes_the_wind_triangle(track: float, wind: float, blows_to: float, airspeed: float) -> None:
    air = np.array([wind * math.cos(blows_to), wind * math.sin(blows_to), 0.0])
    north, east = math.cos(track), math.sin(track)
    speed = course_speed(north, east, air, airspeed)
    assert math.hypot(speed * north - air[0], speed * east - air[1]) == pytest.approx(airspeed, rel=1e-12)
    assert speed > 0.0


def test_in_a_wind_stronger_than_the_aircraft_the_way_is_still_forward() -> None:
    assert 0.0 < course_speed(1.0, 0.0, np.array([-20.0, 0.0, 0.0]), 15.0) < 1.0


@pytest.mark.parametrize(("headwind", "crosswind"), [(0.0, 0.0), (8.0, 0.0), (-8.0, 0.0), (3.0, -6.0)])
@pytest.mark.parametrize("distance", [1.0, 20.0, 150.0, 400.0])
def test_stopping_speed_is_that_of_its_own_braking_integrated_finely(
    distance: float, headwind: float, crosswind: float
) -> None:
    """ds/dv = v/a(airspeed) from the stop up, by an error-controlled Runge-Kutta."""

    def slope(v: float, _: np.ndarray) -> list[float]:
        airspeed = math.copysign(math.hypot(v + headwind, crosswind), v + headwind)
        return [v / np.interp(airspeed, AXIS, BRAKING)]

    speed = stopping_speed(distance, headwind, crosswind, BRAKING, FIRST, STEP, 40.0)
    covered = solve_ivp(slope, (0.0, speed), [0.0], rtol=1e-9, atol=1e-9, max_step=0.1).y[0, -1]
    # Its sum goes in steps of 0.5 m/s.
    assert covered == pytest.approx(distance, rel=0.01, abs=0.03)


def test_stopping_speed_is_limited_and_nothing_is_asked_for_at_the_point() -> None:
    assert stopping_speed(1e4, 0.0, 0.0, BRAKING, FIRST, STEP, 17.0) == 17.0
    assert stopping_speed(0.0, 0.0, 0.0, BRAKING, FIRST, STEP, 17.0) == 0.0
    here = setpoint(Horizontal.POINT, position_ned=(3.0, 4.0, 0.0), speed=5.0)
    np.testing.assert_array_equal(asked(estimate(position_ned=(3.0, 4.0, 0.0)), here), 0.0)


@given(metres, metres, st.integers(0, 1))
def test_a_point_is_flown_to_straight_at_no_more_than_the_speed(north: float, east: float, cruise: int) -> None:
    distance = math.hypot(north, east)
    assume(distance > 1.0)
    wind = (2.0, -3.0, 0.0)
    task = setpoint(Horizontal.POINT, position_ned=(north, east, 0.0), speed=15.0, cruise=cruise)
    vn, ve, an, ae = asked(estimate(wind_ned=wind), task)
    speed = math.hypot(vn, ve)
    assert (vn * east - ve * north) / distance == pytest.approx(0.0, abs=1e-9)
    assert vn * north + ve * east > 0.0
    assert speed <= 0.4 * distance + 1e-9
    through_air = math.hypot(vn - wind[0], ve - wind[1]) if cruise else speed
    assert through_air <= max(15.0, math.hypot(*wind)) + 1e-9
    assert (an, ae) == (0.0, 0.0)


def flown(task: np.void, start: tuple[float, float], wind: tuple[float, float], seconds: float) -> np.ndarray:
    """Positions (n, 2) of a point that moves as guidance asks, 50 times a second."""
    seen = estimate(position_ned=(*start, 0.0), wind_ned=(*wind, 0.0))
    rows = np.empty((round(seconds / 0.02), 2))
    for row in rows:
        velocity = asked(seen, task)[:2]
        seen["velocity_ned"][:2] = velocity
        seen["position_ned"][:2] += 0.02 * velocity
        row[:] = seen["position_ned"][:2]
    return rows


@pytest.mark.parametrize("wind", [(0.0, 0.0), (5.0, 6.0), (-7.0, 3.0)])
@pytest.mark.parametrize("cruise", [0, 1])
@pytest.mark.parametrize("side", [80.0, -80.0])
def test_a_leg_is_joined_without_crossing_it_and_followed_beyond_its_end(
    side: float, cruise: int, wind: tuple[float, float]
) -> None:
    along = np.array([math.cos(0.7), math.sin(0.7)])
    right = np.array([-along[1], along[0]])
    task = setpoint(Horizontal.LEG, position_ned=(*(200.0 * along), 0.0), speed=15.0, cruise=cruise)
    rows = flown(task, tuple(side * right), wind, 60.0)
    off = rows @ right
    assert np.all(np.diff(np.abs(off)) < 1e-9)
    assert np.abs(off[-1]) < 0.05
    assert rows[-1] @ along > 300.0
    assert np.all(np.diff(rows @ along) > 0.0)


@pytest.mark.parametrize("cruise", [0, 1])
def test_close_to_a_leg_the_distance_dies_out_with_the_gain_as_its_rate(cruise: int) -> None:
    """exp(-k t): path 0.25 /s wing-borne, position 0.4 /s in hover."""
    task = setpoint(Horizontal.LEG, position_ned=(1000.0, 0.0, 0.0), speed=15.0, cruise=cruise)
    rows = flown(task, (0.0, 1.0), (0.0, 0.0), 4.0)
    rate = 0.25 if cruise else 0.4
    assert rows[-1, 1] == pytest.approx(math.exp(-4.0 * rate), rel=0.02)


def test_a_leg_of_no_length_is_flown_along_the_heading() -> None:
    task = setpoint(Horizontal.LEG, speed=15.0, cruise=1)
    velocity = asked(estimate(euler=(0.0, 0.0, 1.0)), task)[:2]
    np.testing.assert_allclose(velocity, (15.0 * math.cos(1.0), 15.0 * math.sin(1.0)), atol=1e-9)


@given(course, st.floats(20.0, 150.0), st.sampled_from([1.0, -1.0]), st.floats(12.0, 30.0))
def test_on_a_circle_the_velocity_is_its_tangent_and_the_acceleration_centripetal(
    where: float, radius: float, sense: float, speed: float
) -> None:
    centre, outward = np.array([40.0, -30.0]), np.array([math.cos(where), math.sin(where)])
    tangent = sense * np.array([-outward[1], outward[0]])  # clockwise seen from above: north turns to east
    seen = estimate(position_ned=(*(centre + radius * outward), 0.0), velocity_ned=(*(speed * tangent), 0.0))
    task = setpoint(Horizontal.CIRCLE, position_ned=(*centre, 0.0), radius=sense * radius, speed=speed, cruise=1)
    found = asked(seen, task)
    np.testing.assert_allclose(found[:2], speed * tangent, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(found[2:], -(speed**2) / radius * outward, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("start", [(5.0, 3.0), (250.0, 0.0), (0.0, -100.0)])
@pytest.mark.parametrize("radius", [100.0, -100.0])
def test_a_circle_is_joined_from_inside_and_outside_in_a_wind(radius: float, start: tuple[float, float]) -> None:
    task = setpoint(Horizontal.CIRCLE, radius=radius, speed=18.0, cruise=1)
    rows = flown(task, start, (4.0, -4.0), 90.0)
    distance = np.hypot(rows[:, 0], rows[:, 1])
    # Sampling a turn of 1/R at 50 Hz leaves centimetres.
    np.testing.assert_allclose(distance[-500:], 100.0, atol=0.2)
    turning = rows[-2, 0] * rows[-1, 1] - rows[-2, 1] * rows[-1, 0]
    assert math.copysign(1.0, turning) == math.copysign(1.0, radius)


def test_far_from_a_circle_nothing_pulls_inwards() -> None:
    seen = estimate(position_ned=(500.0, 0.0, 0.0), velocity_ned=(0.0, 20.0, 0.0))
    found = asked(seen, setpoint(Horizontal.CIRCLE, radius=100.0, speed=20.0, cruise=1))
    np.testing.assert_array_equal(found[2:], 0.0)
    assert found[0] < 0.0  # but it is headed for


def test_a_velocity_is_asked_for_as_it_stands_and_a_bank_as_the_airspeed_ahead() -> None:
    task = setpoint(Horizontal.VELOCITY, velocity_ned=(1.0, -2.0, 3.0))
    np.testing.assert_array_equal(asked(estimate(), task), (1.0, -2.0, 0.0, 0.0))
    seen = estimate(euler=(0.3, 0.0, math.pi / 2.0), wind_ned=(0.0, -5.0, 0.0))
    banked = asked(seen, setpoint(Horizontal.BANK, bank=0.3, speed=20.0))
    np.testing.assert_allclose(banked, (0.0, 15.0, 0.0, 0.0), atol=1e-9)


@given(st.floats(-200.0, 200.0), st.floats(-200.0, 200.0))
def test_height_is_approached_in_proportion_within_the_climb_and_sink_rates(down: float, wanted: float) -> None:
    task = setpoint(
        Horizontal.POINT, vertical=Vertical.ALTITUDE, position_ned=(0.0, 0.0, wanted), climb_rate=3.0, sink_rate=2.0
    )
    rate = vertical_demand(estimate(position_ned=(0.0, 0.0, down)), task, gains())
    assert rate == pytest.approx(np.clip(0.6 * (wanted - down), -3.0, 2.0), abs=1e-12)


@pytest.mark.parametrize(("rate", "flown_at"), [(-1.0, -1.0), (-9.0, -3.0), (1.5, 1.5), (9.0, 2.0)])
def test_a_vertical_rate_is_flown_within_the_limits(rate: float, flown_at: float) -> None:
    task = setpoint(
        Horizontal.POINT, vertical=Vertical.RATE, velocity_ned=(0.0, 0.0, rate), climb_rate=3.0, sink_rate=2.0
    )
    assert vertical_demand(estimate(), task, gains()) == flown_at
