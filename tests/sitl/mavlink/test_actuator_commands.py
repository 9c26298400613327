"""Actuators moved by commands: on the ground, one by one, for a while; and the outputs that are free."""

import math

import pytest

from sitl.mavlink.dialect import tiltwing as mav
from tests.sitl.mavlink.in_memory import Desk

ACCEPTED, DENIED, LATER = mav.MAV_RESULT_ACCEPTED, mav.MAV_RESULT_DENIED, mav.MAV_RESULT_TEMPORARILY_REJECTED
TEST = mav.MAV_CMD_ACTUATOR_TEST
MOTOR, SERVO = mav.ACTUATOR_OUTPUT_FUNCTION_MOTOR1, mav.ACTUATOR_OUTPUT_FUNCTION_SERVO1


def actuate(desk: Desk, value: float, seconds: float, function: int) -> int:
    return desk.command(TEST, value, seconds, 0, 0, function, 0, 0).result


@pytest.mark.parametrize("first", [MOTOR, 1101])
@pytest.mark.parametrize("motor", [0, 1, 2])
def test_one_motor_turns_for_its_time_and_no_other(desk: Desk, motor: int, first: int) -> None:
    desk.advance(0.5)
    assert actuate(desk, 0.2, 1.0, first + motor) == ACCEPTED
    desk.advance(0.5)
    expected = [0.0, 0.0, 0.0]
    expected[motor] = 0.2
    assert desk.simulation.controls[:3] == pytest.approx(expected)
    speeds = desk.simulation.flight.view.rotor_speeds
    assert abs(speeds[motor]) > 50.0
    desk.advance(0.7)
    assert desk.simulation.controls[:3] == pytest.approx([0.0] * 3)
    assert not desk.simulation.flight.armed


@pytest.mark.parametrize(("servo", "control"), [(0, 3), (1, 4), (2, 5), (3, 6)])
def test_servos_move_to_the_ends_of_their_travel(desk: Desk, servo: int, control: int) -> None:
    desk.advance(0.5)
    channel = next(channel for channel in desk.simulation.aircraft.channels if channel.index == control)
    for value, angle in ((1.0, channel.maximum), (-1.0, channel.minimum)):
        assert actuate(desk, value, 20.0, SERVO + servo) == ACCEPTED
        desk.advance(10.0)
        assert desk.simulation.state[-4 + servo] == pytest.approx(angle, abs=0.02)
    assert actuate(desk, math.nan, 0.0, SERVO + servo) == ACCEPTED
    desk.advance(0.1)
    assert desk.simulation.flight.actuator_test.controls(desk.simulation.flight.view) is None


def test_nothing_is_tried_while_armed_and_arming_ends_it(desk: Desk) -> None:
    desk.advance(0.5)
    assert actuate(desk, 0.1, 30.0, MOTOR) == ACCEPTED
    desk.advance(0.1)
    assert desk.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1, 21196).result == ACCEPTED
    assert actuate(desk, 0.1, 1.0, MOTOR) == LATER
    desk.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 0)
    desk.advance(0.2)
    assert desk.simulation.controls[0] == 0.0


@pytest.mark.parametrize(
    ("value", "seconds", "function"),
    [(0.1, 1.0, 0), (0.1, 1.0, MOTOR + 3), (0.1, 1.0, SERVO + 4), (2.0, 1.0, MOTOR), (-0.1, 1.0, MOTOR),
     (0.1, 1000.0, MOTOR), (math.inf, 1.0, SERVO), (0.1, 1.0, math.nan)],
)  # fmt: skip
def test_what_cannot_be_tried_is_denied(desk: Desk, value: float, seconds: float, function: float) -> None:
    desk.advance(0.5)
    assert desk.command(TEST, value, seconds, 0, 0, function, 0, 0).result == DENIED


def test_motors_turn_one_after_the_other(desk: Desk) -> None:
    desk.advance(0.5)
    assert desk.command(mav.MAV_CMD_DO_MOTOR_TEST, 1, 0, 15.0, 1.0, 3, 0).result == ACCEPTED
    turning = []
    for _ in range(3):
        desk.advance(0.5)
        turning.append([round(float(value), 3) for value in desk.simulation.controls[:3]])
        desk.advance(0.5)
    assert turning == [[0.15, 0.0, 0.0], [0.0, 0.15, 0.0], [0.0, 0.0, 0.15]]
    assert desk.command(mav.MAV_CMD_DO_MOTOR_TEST, 1, 1, 1300.0, 1.0, 1, 0).result == ACCEPTED
    desk.advance(0.2)
    assert desk.simulation.controls[0] == pytest.approx(0.3)
    for wrong in ((0, 0, 10.0), (4, 0, 10.0), (1, 2, 10.0), (1, 0, 101.0), (1, 0, -1.0), (math.nan, 0, 10.0)):
        assert desk.command(mav.MAV_CMD_DO_MOTOR_TEST, *wrong, 1.0, 1, 0).result == DENIED


def test_free_channels_can_be_set_and_are_told_those_of_the_controller_cannot(desk: Desk) -> None:
    assert desk.command(mav.MAV_CMD_DO_SET_SERVO, 9, 1700).result == ACCEPTED
    assert (
        desk.command(mav.MAV_CMD_DO_SET_ACTUATOR, -1.0, math.nan, 1.0, math.nan, math.nan, math.nan, 0).result
        == ACCEPTED
    )
    desk.advance(0.1)
    output = desk.of("SERVO_OUTPUT_RAW")[-1]
    assert (output.servo8_raw, output.servo9_raw, output.servo10_raw) == (1000, 1700, 2000)
    assert desk.command(mav.MAV_CMD_DO_SET_SERVO, 4, 1500).result == DENIED
    assert "tilt" in desk.texts[-1]
    for channel, pulse in ((0, 1500), (17, 1500), (9, 100), (9, math.nan), (math.nan, 1500)):
        assert desk.command(mav.MAV_CMD_DO_SET_SERVO, channel, pulse).result == DENIED
    for values in ((2.0, 0, 0, 0, 0, 0, 0), (0, 0, 0, 0, 0, 0, 1)):
        assert desk.command(mav.MAV_CMD_DO_SET_ACTUATOR, *values).result == DENIED
