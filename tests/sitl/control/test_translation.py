"""The velocity reference keeps to what the aircraft can do, the demand follows it, the integral does not wind up."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.control.design_names import (
    BRAKE,
    COLUMNS,
    FORWARD_GAIN,
    INTEGRAL_SHARE,
    LATERAL_GAIN,
    LOWEST_FORCE,
    VERTICAL_GAIN,
)
from sitl.control.records import ESTIMATE, GAINS, MEMORY, SETPOINT, Horizontal, Vertical
from sitl.control.translation import (
    FURTHEST,
    acceleration_demand,
    advance_reference,
    integrate_velocity,
)
from vehicle_model.earth import STANDARD_GRAVITY

DT = 0.02  # coarser than a tick: the formulas know no other difference [s]
FORWARD, LATERAL, DOWN, SHARE = 1.1, 0.9, 2.0, 0.15
BRAKING = np.full(25, 0.7)

heading = st.floats(-math.pi, math.pi)
metre_per_second = st.floats(-8.0, 8.0)
velocity = st.tuples(metre_per_second, metre_per_second, st.floats(-3.0, 3.0))


def estimate(**values: object) -> np.void:
    array = np.zeros(1, ESTIMATE)
    for name, value in values.items():
        array[name] = value
    return array[0]


def setpoint(**values: object) -> np.void:
    array = np.zeros(1, SETPOINT)
    array["horizontal"], array["vertical"] = Horizontal.VELOCITY, Vertical.RATE
    array["climb_rate"], array["sink_rate"], array["max_bank"] = 4.0, 4.0, math.radians(35.0)
    for name, value in values.items():
        array[name] = value
    return array[0]


def gains() -> np.void:
    array = np.zeros(1, GAINS)
    array["reference"] = 1.2
    array["forward_acceleration"], array["lateral_acceleration"], array["vertical_acceleration"] = 2.0, 1.5, 2.5
    array["wing_borne_from"], array["wing_borne_at"] = 11.0, 15.0
    return array[0]


def schedule(brake: float = 0.7, lowest: float = -1.2) -> np.ndarray:
    row = np.zeros(len(COLUMNS))
    row[BRAKE], row[LOWEST_FORCE] = brake, lowest
    row[FORWARD_GAIN], row[LATERAL_GAIN], row[VERTICAL_GAIN], row[INTEGRAL_SHARE] = FORWARD, LATERAL, DOWN, SHARE
    return row


def remembered(reference: tuple[float, ...] = (0.0, 0.0, 0.0)) -> np.void:
    array = np.zeros(1, MEMORY)
    array["velocity_reference_ned"] = reference
    return array[0]


def body(yaw: float) -> np.ndarray:
    """North, east, down to forward, right, down of the heading."""
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def advanced(
    seen: np.void, task: np.void, memory: np.void, u: float = 0.0, row: np.ndarray | None = None
) -> np.ndarray:
    """The reference's acceleration in NED over one step."""
    row = schedule() if row is None else row
    return np.array(advance_reference(seen, task, gains(), row, BRAKING, -14.0, 2.0, u, memory, DT))


@settings(max_examples=30)
@given(heading, velocity)
def test_a_perfect_aircraft_reaches_the_velocity_asked_for_without_overshoot(
    yaw: float, wanted: tuple[float, ...]
) -> None:
    seen, task, memory = estimate(euler=(0.0, 0.0, yaw)), setpoint(velocity_ned=wanted), remembered()
    for _ in range(round(15.0 / DT)):
        before = memory["velocity_reference_ned"].copy()
        acceleration = advanced(seen, task, memory)
        np.testing.assert_allclose(memory["velocity_reference_ned"], before + DT * acceleration, atol=1e-12)
        forward, right, down = body(yaw) @ acceleration
        assert -1.2 - 1e-9 <= forward <= 2.0 + 1e-9  # braking no harder than the corridor's lowest force
        assert abs(right) <= 1.5 + 1e-9
        assert abs(down) <= 2.5 + 1e-9
        seen["velocity_ned"] = memory["velocity_reference_ned"]
        if np.abs(seen["velocity_ned"] - wanted).max() < 1e-3:
            break
    np.testing.assert_allclose(memory["velocity_reference_ned"], wanted, atol=1e-3)


def test_the_reference_never_runs_far_ahead_of_a_vehicle_that_does_not_follow() -> None:
    seen, task, memory = estimate(), setpoint(velocity_ned=(8.0, -8.0, 9.0)), remembered()
    for _ in range(500):
        advanced(seen, task, memory)
    np.testing.assert_allclose(memory["velocity_reference_ned"], (FURTHEST, -FURTHEST, FURTHEST), atol=1e-9)
    assert FURTHEST < 3.0


@settings(max_examples=30)
@given(st.floats(9.0, 30.0), st.floats(-3.0, -0.4), st.floats(0.2, 0.6), st.floats(0.0, 3.0))
def test_wing_borne_braking_and_sinking_share_the_force_at_hand(
    u: float, lowest: float, brake_share: float, sinking: float
) -> None:
    """a - g vd/u, the force forward per mass along a path, settles at no less than the corridor's lowest."""
    brake = brake_share * -lowest
    row = schedule(brake=brake, lowest=lowest)
    seen, memory = estimate(velocity_ned=(u, 0.0, sinking)), remembered((u, 0.0, sinking))
    task = setpoint(velocity_ned=(-50.0, 0.0, 4.0))
    acceleration = np.zeros(3)
    for _ in range(300):
        acceleration = advanced(seen, task, memory, u, row)
        seen["velocity_ned"] = memory["velocity_reference_ned"]
    down = memory["velocity_reference_ned"][2]
    assert acceleration[0] - STANDARD_GRAVITY * down / u >= lowest - 1e-3
    assert acceleration[0] <= -brake + 1e-9  # braking as planned comes first
    assert 0.0 <= down <= 4.0 + 1e-9


def test_for_an_acceleration_the_reference_is_the_present_velocity() -> None:
    task = setpoint(horizontal=Horizontal.ACCELERATION, acceleration=(0.5, -0.25))
    memory = remembered((9.0, 9.0, 0.0))
    acceleration = advanced(estimate(velocity_ned=(1.0, 2.0, 0.0), euler=(0.0, 0.0, 0.6)), task, memory)
    np.testing.assert_allclose(body(0.6) @ acceleration, (0.5, -0.25, 0.0), atol=1e-12)
    np.testing.assert_allclose(memory["velocity_reference_ned"][:2], (1.0, 2.0), atol=0.6 * DT)


def test_a_bank_is_turned_with_as_its_tangent_says() -> None:
    task = setpoint(horizontal=Horizontal.BANK, bank=0.4, speed=20.0)
    seen = estimate(velocity_ned=(20.0, 0.0, 0.0))
    acceleration = advanced(seen, task, remembered((20.0, 0.0, 0.0)), 20.0)
    np.testing.assert_allclose(acceleration, (0.0, STANDARD_GRAVITY * math.tan(0.4), 0.0), atol=1e-9)


@given(heading, velocity, velocity, velocity, velocity)
def test_the_acceleration_demand_is_feed_forward_and_proportional_and_integral_in_the_axes_of_the_heading(
    yaw: float,
    now: tuple[float, ...],
    reference: tuple[float, ...],
    feed: tuple[float, ...],
    integral: tuple[float, ...],
) -> None:
    memory = remembered(reference)
    memory["velocity_integral_ned"] = integral
    found = acceleration_demand(estimate(velocity_ned=now, euler=(0.1, 0.2, yaw)), schedule(), memory, *feed)
    error = body(yaw) @ (np.array(reference) - now)
    expected = body(yaw) @ (np.array(feed) + integral) + np.array([FORWARD, LATERAL, DOWN]) * error
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)


def integrated(error: tuple[float, ...], lack: tuple[float, ...], yaw: float = 0.0, ticks: int = 1) -> np.ndarray:
    """Integral in the axes of the heading after so many steps with an error (forward, right, down) and a lack."""
    seen, memory = estimate(euler=(0.0, 0.0, yaw)), remembered(tuple(body(yaw).T @ error))
    for _ in range(ticks):
        integrate_velocity(seen, setpoint(), schedule(), memory, lack[0], lack[1], lack[2], DT)
    return body(yaw) @ memory["velocity_integral_ned"]


@pytest.mark.parametrize("yaw", [0.0, 2.0])
def test_the_integral_gathers_the_error_by_share_and_square_of_the_gain(yaw: float) -> None:
    found = integrated((0.3, -0.2, 0.1), (0.0, 0.0, 0.0), yaw)
    expected = DT * SHARE * np.array([FORWARD, LATERAL, DOWN]) ** 2 * (0.3, -0.2, 0.1)
    np.testing.assert_allclose(found, expected, rtol=1e-12)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_error_that_the_force_cannot_meet_is_not_integrated(axis: int, sign: float) -> None:
    error, lack = np.zeros(3), np.zeros(3)
    error[axis], lack[axis] = sign * 0.5, -sign * 0.5
    assert integrated(tuple(error), tuple(lack))[axis] == 0.0
    # What brings it back is, and so is an error that the force exceeds.
    assert sign * integrated(tuple(error), tuple(-lack))[axis] > 0.0


def test_the_integral_is_limited() -> None:
    np.testing.assert_allclose(integrated((8.0, -8.0, 8.0), (0.0, 0.0, 0.0), ticks=2500), (6.0, -6.0, 6.0), atol=1e-9)
