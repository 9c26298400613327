"""Motor and servos: power balance of the equivalent circuit, limits, inverses, exact first-order response."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vehicle_model.motor import electrical_power, motor_current, motor_torque, servo_rate, throttle_for
from vehicle_model.records import ROTOR, SERVO

KV = 23.0  # [rad/s/V]


def motor(*, power: bool = True, reversible: bool = False, max_current: float = 110.0) -> np.void:
    rotor = np.zeros(1, ROTOR)[0]
    rotor["torque_constant"], rotor["resistance"], rotor["no_load_current"] = 1.0 / KV, 0.03, 1.5
    rotor["battery_voltage"], rotor["max_current"], rotor["max_power"] = 44.4, max_current, 2200.0
    rotor["throttle_sets_power"], rotor["min_throttle"] = power, -1.0 if reversible else 0.0
    return rotor


POWER, VOLTAGE = motor(), motor(power=False)
REVERSIBLE = motor(reversible=True)


@given(st.floats(0.01, 1.0), st.floats(0.0, 700.0))
def test_power_throttle_sets_the_electrical_power_of_the_circuit(throttle: float, speed: float) -> None:
    current = motor_current(POWER, throttle, speed)
    voltage = current * 0.03 + speed / KV
    assert voltage * current == pytest.approx(current**2 * 0.03 + current * speed / KV, rel=1e-12)
    if voltage < 44.4 - 1e-9 and current < 110.0 - 1e-9:
        assert voltage * current == pytest.approx(throttle * 2200.0, rel=1e-9)
    else:
        assert voltage * current <= throttle * 2200.0 * (1.0 + 1e-9)


@given(st.floats(0.0, 1.0), st.floats(0.0, 700.0))
def test_what_comes_out_at_the_shaft_is_what_goes_in_less_heat_and_friction(throttle: float, speed: float) -> None:
    current = motor_current(VOLTAGE, throttle, speed)
    electrical = (current * 0.03 + speed / KV) * current
    shaft = motor_torque(VOLTAGE, current, speed) * speed
    friction = 1.5 * min(max(speed, -1.0), 1.0) * speed / KV
    assert shaft == pytest.approx(electrical - current**2 * 0.03 - friction, rel=1e-9, abs=1e-9)


@given(st.floats(-2.0, 2.0), st.floats(-1500.0, 1500.0))
def test_current_never_exceeds_the_controllers_limit(throttle: float, speed: float) -> None:
    for each in (POWER, VOLTAGE, REVERSIBLE, motor(power=False, reversible=True)):
        assert abs(motor_current(each, throttle, speed)) <= 110.0


@given(st.floats(0.0, 2.0), st.floats(0.0, 1500.0))
def test_power_throttle_never_needs_more_than_the_battery_or_brakes(throttle: float, speed: float) -> None:
    current = motor_current(POWER, throttle, speed)
    assert current >= 0.0
    if speed < 44.4 * KV:
        assert current * 0.03 + speed / KV <= 44.4 + 1e-9
    else:
        assert current == 0.0


def test_voltage_throttle_is_ohms_law_and_brakes_when_driven() -> None:
    assert motor_current(VOLTAGE, 0.45, 400.0) == pytest.approx((0.45 * 44.4 - 400.0 / KV) / 0.03)
    assert motor_current(VOLTAGE, 0.3, 400.0) == -110.0  # (13.3 V - 17.4 V)/0.03 ohm is beyond the limit
    assert motor_current(VOLTAGE, 0.39, 400.0) == pytest.approx((0.39 * 44.4 - 400.0 / KV) / 0.03)
    assert motor_current(VOLTAGE, 0.39, 400.0) < 0.0


def test_throttle_beyond_its_range_counts_as_its_end() -> None:
    for each in (POWER, VOLTAGE, REVERSIBLE):
        assert motor_current(each, 7.0, 300.0) == motor_current(each, 1.0, 300.0)
    assert motor_current(POWER, -0.5, 300.0) == 0.0
    assert motor_current(REVERSIBLE, -7.0, -300.0) == motor_current(REVERSIBLE, -1.0, -300.0) < 0.0


@given(st.floats(0.01, 1.0), st.floats(0.0, 900.0))
def test_a_reversible_motor_runs_backwards_as_it_runs_forwards(throttle: float, speed: float) -> None:
    assert motor_current(REVERSIBLE, -throttle, -speed) == -motor_current(REVERSIBLE, throttle, speed)
    forwards = motor_torque(REVERSIBLE, 10.0, speed)
    assert motor_torque(REVERSIBLE, -10.0, -speed) == -forwards


@given(st.floats(0.02, 1.0), st.floats(20.0, 600.0))
def test_throttle_for_is_the_inverse_where_no_limit_binds(throttle: float, speed: float) -> None:
    for each in (motor(max_current=1e4), motor(power=False, max_current=1e4)):
        current = motor_current(each, throttle, speed)
        if current <= 0.0 or current * 0.03 + speed / KV > 44.4 - 1e-6:
            continue
        torque = motor_torque(each, current, speed)
        assert throttle_for(each, speed, torque) == pytest.approx(throttle, rel=1e-9)


def test_throttle_for_asks_for_more_than_there_is_where_the_motor_cannot_hold_the_torque() -> None:
    assert throttle_for(POWER, 600.0, 10.0) > 1.0
    assert throttle_for(VOLTAGE, 960.0, 10.0) > 1.0
    assert throttle_for(motor(reversible=True), -600.0, -10.0) < -1.0


def test_throttle_for_gives_no_throttle_where_the_flow_drives_the_motor() -> None:
    assert throttle_for(POWER, 300.0, -0.5) == 0.0
    assert throttle_for(POWER, 0.0, 0.0) == 0.0


def test_friction_is_the_no_load_current_against_the_rotation_and_none_at_rest() -> None:
    assert motor_torque(POWER, 1.5, 500.0) == pytest.approx(0.0, abs=1e-6)
    assert motor_torque(POWER, 0.0, 500.0) < 0.0 < motor_torque(POWER, 0.0, -500.0)
    assert motor_torque(POWER, 0.0, 0.0) == 0.0


def servo(time_constant: float = 0.1, rate_limit: float = 1.0, low: float = -0.4, high: float = 1.9) -> np.void:
    return np.array([(time_constant, rate_limit, low, high)], SERVO)[0]


def follow(servo: np.void, start: float, command: float, seconds: float) -> float:
    """Position after some time by the textbook Runge-Kutta 4."""
    dt, position = 1e-3, start
    for _ in range(round(seconds / dt)):
        k1 = servo_rate(servo, position, command)
        k2 = servo_rate(servo, position + 0.5 * dt * k1, command)
        k3 = servo_rate(servo, position + 0.5 * dt * k2, command)
        k4 = servo_rate(servo, position + dt * k3, command)
        position += dt / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return position


def test_a_small_command_is_followed_with_the_exact_first_order_lag() -> None:
    for seconds in (0.05, 0.1, 0.4):
        expected = 0.2 + 0.05 * (1.0 - math.exp(-seconds / 0.1))
        assert follow(servo(), 0.2, 0.25, seconds) == pytest.approx(expected, abs=1e-9)


def test_a_large_command_is_followed_at_the_rate_limit_and_then_with_the_lag() -> None:
    # 1 rad at 1 rad/s with 0.1 s lag: 0.9 s at the limit, then an exponential from 0.1 rad short.
    assert follow(servo(), 0.0, 1.0, 0.5) == pytest.approx(0.5, abs=1e-9)
    assert follow(servo(), 0.0, 1.0, 1.1) == pytest.approx(1.0 - 0.1 * math.exp(-2.0), abs=1e-6)
    assert servo_rate(servo(), 1.0, -5.0) == -1.0


@given(st.floats(-20.0, 20.0))
def test_travel_ends_at_the_stops(command: float) -> None:
    reached = follow(servo(rate_limit=50.0), 0.5, command, 2.0)
    assert reached == pytest.approx(min(max(command, -0.4), 1.9), abs=1e-6)


def test_electrical_power_is_throttle_times_full_power_or_voltage_times_current() -> None:
    assert electrical_power(POWER, motor_current(POWER, 0.4, 500.0), 500.0) == pytest.approx(0.4 * 2200.0, rel=1e-12)
    current = motor_current(VOLTAGE, 0.5, 480.0)
    assert electrical_power(VOLTAGE, current, 480.0) == pytest.approx(0.5 * 44.4 * current, rel=1e-12)


def test_a_braking_motor_gives_power_back() -> None:
    current = motor_current(VOLTAGE, 0.39, 400.0)
    assert current < 0.0
    assert electrical_power(VOLTAGE, current, 400.0) == pytest.approx(0.39 * 44.4 * current, rel=1e-12)


def test_a_servo_without_speed_stays_where_it_is() -> None:
    servo = np.zeros(1, SERVO)[0]
    servo["time_constant"], servo["rate_limit"], servo["minimum"], servo["maximum"] = 0.1, 0.0, -1.0, 2.0
    for position, command in ((0.5, 2.0), (0.5, -1.0), (0.5, 0.5), (-3.0, 7.0)):
        assert servo_rate(servo, position, command) == 0.0
