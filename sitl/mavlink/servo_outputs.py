"""Servo outputs: our own as SERVO_OUTPUT_RAW, and those of an outside controller on their way in.

What comes in is only taken apart here; `sitl.hil.servo_input` decides whose it is and what it means.
"""

from collections.abc import Callable
from typing import Any

from sitl.hil.servo_input import ServoInput, Source
from sitl.mavlink.codec import codec
from sitl.mavlink.telemetry.context import Context, boot_us
from sitl.snapshot import Snapshot

__all__ = ["servo_input_handlers", "servo_output_raw"]

CHANNELS = 16
MAIN_PORT = 0


def servo_output_raw(snapshot: Snapshot, context: Context) -> tuple[Any, ...]:
    """SERVO_OUTPUT_RAW: pulse widths [us] of the commands in force, 0 for channels the aircraft does not have."""
    pulses = [0] * CHANNELS
    for number, pulse in context.free_pulses.items():
        pulses[number - 1] = pulse
    for channel in context.channels:
        pulses[channel.number - 1] = channel.to_pwm(float(snapshot.controls[channel.index]))
    return (boot_us(snapshot) & 0xFFFFFFFF, MAIN_PORT, *pulses)


def servo_input_handlers(servos: ServoInput) -> dict[int, Callable[[bytes, Source, float], None]]:
    """By message id, what passes a payload, its source and the wall time on to `servos`.

    The true state of other vehicles is among them: it says whose SERVO_OUTPUT_RAW is telemetry.
    """
    raw, actuators, controls = codec("SERVO_OUTPUT_RAW"), codec("HIL_ACTUATOR_CONTROLS"), codec("HIL_CONTROLS")
    raw_unpack, actuators_unpack, controls_unpack = raw.unpack, actuators.unpack, controls.unpack

    def on_servo_output_raw(payload: bytes, source: Source, wall_time: float) -> None:
        values = raw_unpack(payload)
        servos.servo_output_raw(values[1], values[2:], source, wall_time)

    def on_hil_actuator_controls(payload: bytes, source: Source, wall_time: float) -> None:
        values = actuators_unpack(payload)
        servos.hil_actuator_controls(values[0], values[1:17], values[17], source, wall_time)

    def on_hil_controls(payload: bytes, source: Source, wall_time: float) -> None:
        _, roll, pitch, yaw, throttle, tilt, tail, *_ = controls_unpack(payload)
        servos.hil_controls((roll, pitch, yaw, throttle), tilt, tail, source, wall_time)

    def on_hil_state(_payload: bytes, source: Source, _wall_time: float) -> None:
        servos.simulated_vehicle(source.system)

    return {
        raw.id: on_servo_output_raw,
        actuators.id: on_hil_actuator_controls,
        controls.id: on_hil_controls,
        codec("HIL_STATE").id: on_hil_state,
        codec("HIL_STATE_QUATERNION").id: on_hil_state,
    }
