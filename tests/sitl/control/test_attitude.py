"""Rates that bring the attitude to its target the shortest way, and the moment of Euler's equations."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl.control.attitude import moment_demand, rate_demand
from sitl.control.records import ESTIMATE
from tests.sitl.control.flown import aircraft
from vehicle_model.rotation import quaternion_from_euler, quaternion_multiply, quaternion_normalise

angle = st.floats(-1.2, 1.2)
heading = st.floats(-math.pi, math.pi)
rate = st.floats(-3.0, 3.0)
ROLL_GAIN, PITCH_GAIN, MOST = 3.0, 2.5, 1.0


def estimate(roll: float, pitch: float, yaw: float, sign: float = 1.0) -> np.void:
    array = np.zeros(1, ESTIMATE)
    array["euler"] = roll, pitch, yaw
    array["quaternion"] = sign * np.array(quaternion_from_euler(roll, pitch, yaw))
    return array[0]


def demanded(seen: np.void, roll: float, pitch: float, turn: float = 0.0, most: float = MOST) -> np.ndarray:
    return np.array(rate_demand(seen, roll, pitch, turn, ROLL_GAIN, PITCH_GAIN, most))


@given(angle, angle, heading)
def test_at_the_target_no_rate_is_asked_for(roll: float, pitch: float, yaw: float) -> None:
    np.testing.assert_allclose(demanded(estimate(roll, pitch, yaw), roll, pitch), 0.0, atol=1e-12)


@given(angle, angle, heading, angle, angle)
def test_either_of_the_two_quaternions_of_an_attitude_asks_for_the_same(
    roll: float, pitch: float, yaw: float, roll_wanted: float, pitch_wanted: float
) -> None:
    one = demanded(estimate(roll, pitch, yaw), roll_wanted, pitch_wanted)
    other = demanded(estimate(roll, pitch, yaw, sign=-1.0), roll_wanted, pitch_wanted)
    np.testing.assert_allclose(one, other, atol=1e-12)


def test_of_two_ways_to_the_target_the_shorter_is_taken() -> None:
    """170 deg of roll to the left is 190 deg to the right."""
    assert demanded(estimate(math.radians(100.0), 0.0, 0.3), math.radians(-70.0), 0.0)[0] < 0.0
    assert demanded(estimate(math.radians(100.0), 0.0, 0.3), math.radians(-90.0), 0.0)[0] > 0.0


@given(st.floats(-0.02, 0.02), st.floats(-0.02, 0.02), heading)
def test_small_errors_are_met_in_proportion(roll: float, pitch: float, yaw: float) -> None:
    p, q, _ = demanded(estimate(0.0, 0.0, yaw), roll, pitch)
    assert p == pytest.approx(ROLL_GAIN * roll, rel=1e-3, abs=2e-3 * abs(pitch) + 1e-12)
    assert q == pytest.approx(PITCH_GAIN * pitch, rel=1e-3, abs=2e-3 * abs(roll) + 1e-12)


def test_the_roll_rate_is_limited() -> None:
    assert demanded(estimate(0.0, 0.0, 0.0), 1.5, 0.0)[0] == MOST
    assert demanded(estimate(0.0, 0.0, 0.0), -1.5, 0.0)[0] == -MOST


@given(angle, angle, heading, st.floats(-0.8, 0.8))
def test_a_turn_at_the_target_turns_the_heading_alone(roll: float, pitch: float, yaw: float, turn: float) -> None:
    """Body rates of d(yaw)/dt with roll and pitch constant, checked by turning the quaternion a little with them."""
    seen = estimate(roll, pitch, yaw)
    step = 1e-5
    half = 0.5 * step * demanded(seen, roll, pitch, turn)
    q0, q1, q2, q3 = seen["quaternion"]
    moved = np.array(quaternion_normalise(*quaternion_multiply(q0, q1, q2, q3, 1.0, half[0], half[1], half[2])))
    expected = np.array(quaternion_from_euler(roll, pitch, yaw + turn * step))
    assert abs(moved @ expected) == pytest.approx(1.0, abs=1e-10)
    np.testing.assert_allclose(moved * np.sign(moved @ expected), expected, atol=1e-9)


@given(st.tuples(rate, rate, rate), st.tuples(rate, rate, rate))
def test_the_moment_is_that_of_eulers_equations(
    rates: tuple[float, float, float], acceleration: tuple[float, float, float]
) -> None:
    """J w' + w x J w, with an inertia that has all its products."""
    craft = aircraft().vehicle.copy()
    inertia = np.array([[1.1, -0.05, 0.12], [-0.05, 1.3, 0.03], [0.12, 0.03, 1.9]])
    craft["inertia"] = inertia
    w = np.array(rates)
    moment = moment_demand(craft[0], w, acceleration)
    np.testing.assert_allclose(moment, inertia @ acceleration + np.cross(w, inertia @ w), rtol=1e-12, atol=1e-12)
