"""Quaternions and Euler angles against scipy's rotations and the closed forms of Euler-angle kinematics."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from vehicle_model.rotation import (
    body_to_ned,
    euler_from_quaternion,
    ned_to_body,
    quaternion_conjugate,
    quaternion_from_euler,
    quaternion_multiply,
    quaternion_normalise,
    quaternion_rate,
)

angle = st.floats(-math.pi, math.pi)
pitch_angle = st.floats(-math.pi / 2, math.pi / 2)
component = st.floats(-100.0, 100.0)


def scipy_rotation(q: tuple[float, float, float, float]) -> Rotation:
    return Rotation.from_quat([q[1], q[2], q[3], q[0]])


@given(angle, pitch_angle, angle, component, component, component)
def test_vectors_turn_as_scipy_turns_them_by_yaw_pitch_roll(
    roll: float, pitch: float, yaw: float, x: float, y: float, z: float
) -> None:
    q = quaternion_from_euler(roll, pitch, yaw)
    expected = Rotation.from_euler("ZYX", [yaw, pitch, roll])
    np.testing.assert_allclose(body_to_ned(*q, x, y, z), expected.apply([x, y, z]), atol=1e-12)
    np.testing.assert_allclose(ned_to_body(*q, x, y, z), expected.inv().apply([x, y, z]), atol=1e-12)


@given(angle, pitch_angle, angle)
def test_euler_angles_give_back_the_attitude_even_straight_up_or_down(roll: float, pitch: float, yaw: float) -> None:
    q = quaternion_from_euler(roll, pitch, yaw)
    again = quaternion_from_euler(*euler_from_quaternion(*q))
    # q and -q are one attitude. Close to the vertical the angles lose digits, the attitude keeps half of them.
    assert abs(np.dot(q, again)) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("pitch", [-math.pi / 2, math.pi / 2])
@pytest.mark.parametrize("yaw", [-3.0, -1.0, 0.0, 2.0, 3.1])
def test_straight_up_or_down_all_turning_about_the_vertical_is_yaw(pitch: float, yaw: float) -> None:
    assert euler_from_quaternion(*quaternion_from_euler(0.0, pitch, yaw)) == pytest.approx((0.0, pitch, yaw), abs=1e-7)


@given(st.floats(-3.1, 3.1), st.floats(-1.5, 1.5), st.floats(-3.1, 3.1))
def test_euler_angles_come_back(roll: float, pitch: float, yaw: float) -> None:
    angles = euler_from_quaternion(*quaternion_from_euler(roll, pitch, yaw))
    assert angles == pytest.approx((roll, pitch, yaw), abs=1e-12)


@given(angle, pitch_angle, angle, angle, pitch_angle, angle)
def test_product_applies_the_right_factor_first(a: float, b: float, c: float, d: float, e: float, f: float) -> None:
    first, second = quaternion_from_euler(a, b, c), quaternion_from_euler(d, e, f)
    product = scipy_rotation(quaternion_multiply(*second, *first))
    np.testing.assert_allclose(
        product.as_matrix(), (scipy_rotation(second) * scipy_rotation(first)).as_matrix(), atol=1e-12
    )


@given(angle, pitch_angle, angle)
def test_a_quaternion_times_its_conjugate_is_no_rotation(roll: float, pitch: float, yaw: float) -> None:
    q = quaternion_from_euler(roll, pitch, yaw)
    assert quaternion_multiply(*q, *quaternion_conjugate(*q)) == pytest.approx((1.0, 0.0, 0.0, 0.0), abs=1e-14)


def test_normalising_changes_length_only() -> None:
    assert quaternion_normalise(2.0, -4.0, 4.0, 8.0) == pytest.approx((0.2, -0.4, 0.4, 0.8))


@given(angle, st.floats(-1.4, 1.4), angle, st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
def test_rate_of_the_quaternion_is_that_of_the_euler_angles(
    roll: float, pitch: float, yaw: float, p: float, q: float, r: float
) -> None:
    turning = quaternion_rate(*quaternion_from_euler(roll, pitch, yaw), p, q, r)
    # Euler-angle kinematics, any text on flight dynamics (Nelson, eq. 3.33).
    along = q * math.sin(roll) + r * math.cos(roll)
    roll_rate = p + along * math.tan(pitch)
    pitch_rate = q * math.cos(roll) - r * math.sin(roll)
    yaw_rate = along / math.cos(pitch)
    h = 1e-5
    ahead = quaternion_from_euler(roll + h * roll_rate, pitch + h * pitch_rate, yaw + h * yaw_rate)
    behind = quaternion_from_euler(roll - h * roll_rate, pitch - h * pitch_rate, yaw - h * yaw_rate)
    np.testing.assert_allclose(turning, (np.array(ahead) - np.array(behind)) / (2.0 * h), atol=2e-6)
