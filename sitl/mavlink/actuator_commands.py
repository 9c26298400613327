"""Commands that move actuators: tests of motors and servos on the ground, and outputs for a payload in flight.

The flight controller's own outputs are the aircraft's channels; a test moves them while disarmed. The other channels up
to 16 are free: what a command sets there is seen in SERVO_OUTPUT_RAW and moves nothing.
"""

import math
from collections.abc import Mapping

from sitl.flight.refused import Refused
from sitl.mavlink.command import Command, CommandHandler, Running, whole_number
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.service import Exchange, Service
from sitl.mavlink.telemetry.context import Context
from vehicle_model.aircraft import Channel

__all__ = ["ActuatorCommands"]

FIRST_MOTOR = mav.ACTUATOR_OUTPUT_FUNCTION_MOTOR1
FIRST_SERVO = mav.ACTUATOR_OUTPUT_FUNCTION_SERVO1
# QGroundControl sends the functions of PX4's outputs, which our actuator metadata name too, plus 1000.
FIRST_MOTORS, FIRST_SERVOS = (FIRST_MOTOR, 1101), (FIRST_SERVO, 1201)
PERCENT, PULSE = mav.MOTOR_TEST_THROTTLE_PERCENT, mav.MOTOR_TEST_THROTTLE_PWM
LAST_CHANNEL = 16
SHORTEST, LONGEST = 500, 2500  # pulse a servo could possibly be sent [us]
CENTRE, TRAVEL = 1500.0, 500.0  # of a free channel [us]
USUAL_TEST = 3.0  # of an actuator, when no time is given [s]


class ActuatorCommands(Service):
    """ACTUATOR_TEST, DO_MOTOR_TEST, DO_SET_SERVO, DO_SET_ACTUATOR."""

    def __init__(self, exchange: Exchange, context: Context) -> None:
        """Serve through `exchange`; free outputs are told through `context`."""
        super().__init__(exchange)
        self._pulses = context.free_pulses
        channels = context.channels
        self._motors = [channel for channel in channels if channel.is_motor]
        self._servos = [channel for channel in channels if not channel.is_motor]
        self._taken = {channel.number: channel for channel in channels}

    def commands(self) -> Mapping[int, CommandHandler]:
        """See Service."""
        return {
            mav.MAV_CMD_ACTUATOR_TEST: self._test,
            mav.MAV_CMD_DO_MOTOR_TEST: self._test_motors,
            mav.MAV_CMD_DO_SET_SERVO: self._set_servo,
            mav.MAV_CMD_DO_SET_ACTUATOR: self._set_actuators,
        }

    def restarted(self) -> None:
        """See Service."""
        self._pulses.clear()

    def _test(self, command: Command) -> None:
        """ACTUATOR_TEST: one output by its function, -1..1 (a motor 0..1), NaN ends the test."""
        value, seconds, function = command.params[0], command.params[1], whole_number(command.params[4])
        channel = None if function is None else self._by_function(function)
        if channel is None:
            msg = (
                f"actuator test: expected function {FIRST_MOTOR} to {FIRST_MOTOR + len(self._motors) - 1} (motors) or "
                f"{FIRST_SERVO} to {FIRST_SERVO + len(self._servos) - 1} (servos), got {command.params[4]:g}"
            )
            raise Refused(msg)
        if math.isnan(value):
            self._move(channel, 0.0, 0.0)
            return
        if not channel.normalised_minimum <= value <= 1.0:
            msg = f"actuator test: expected {channel.normalised_minimum:g} to 1, got {value:g}"
            raise Refused(msg)
        self._move(channel, channel.from_normalised(value), seconds if seconds > 0.0 else USUAL_TEST)

    def _by_function(self, function: int) -> Channel | None:
        for firsts, channels in ((FIRST_MOTORS, self._motors), (FIRST_SERVOS, self._servos)):
            for first in firsts:
                if first <= function < first + len(channels):
                    return channels[function - first]
        return None

    def _test_motors(self, command: Command) -> Running | None:
        """DO_MOTOR_TEST: a motor, or several one after the other, at a throttle in percent or as a pulse."""
        first, kind, throttle, seconds, count = (*command.params[:4], whole_number(command.params[4]) or 1)
        number = whole_number(first)
        if number is None or not 1 <= number <= len(self._motors) or not 1 <= count <= len(self._motors):
            msg = f"motor test: expected motor 1 to {len(self._motors)}, got {first:g} and {count - 1} more"
            raise Refused(msg)
        kind = PERCENT if math.isnan(kind) else whole_number(kind)
        if kind not in (PERCENT, PULSE) or not 0.0 <= throttle <= (100.0 if kind == PERCENT else LONGEST):
            msg = f"motor test: expected 0 to 100 % (type {PERCENT}) or a pulse (type {PULSE}), got {throttle:g}"
            raise Refused(msg)
        seconds = seconds if seconds > 0.0 else USUAL_TEST
        for place in range(count):
            channel = self._motors[(number - 1 + place) % len(self._motors)]
            value = channel.from_pwm(throttle) if kind == PULSE else channel.from_normalised(throttle / 100.0)
            self._move(channel, value, seconds, place * seconds)
        return None

    def _move(self, channel: Channel, value: float, seconds: float, delay: float = 0.0) -> None:
        self.exchange.simulation.flight.test_actuator(channel.index, value, seconds, delay)

    def _set_servo(self, command: Command) -> None:
        """DO_SET_SERVO: the pulse [us] of a free channel."""
        number, pulse = whole_number(command.params[0]), command.params[1]
        if number in self._taken:
            msg = f"servo: channel {number} is the flight controller's ({self._taken[number].control})"
            raise Refused(msg)
        if number is None or not 1 <= number <= LAST_CHANNEL:
            msg = f"servo: expected a free channel up to {LAST_CHANNEL}, got {command.params[0]:g}"
            raise Refused(msg)
        if not SHORTEST <= pulse <= LONGEST:
            msg = f"servo: expected a pulse of {SHORTEST} to {LONGEST} us, got {pulse:g}"
            raise Refused(msg)
        self._pulses[number] = round(pulse)

    def _set_actuators(self, command: Command) -> None:
        """DO_SET_ACTUATOR: up to six free channels, -1..1, NaN leaves one as it is."""
        index = 0.0 if math.isnan(command.params[6]) else command.params[6]
        free = [number for number in range(1, LAST_CHANNEL + 1) if number not in self._taken]
        if index != 0.0:
            msg = f"actuators: expected index 0, the first six free channels, got {index:g}"
            raise Refused(msg)
        given = [(place, value) for place, value in enumerate(command.params[:6]) if not math.isnan(value)]
        if any(not -1.0 <= value <= 1.0 for _, value in given) or any(place >= len(free) for place, _ in given):
            msg = f"actuators: expected -1 to 1 for the {min(len(free), 6)} free channels, got {command.params[:6]}"
            raise Refused(msg)
        for place, value in given:
            self._pulses[free[place]] = round(CENTRE + value * TRAVEL)
