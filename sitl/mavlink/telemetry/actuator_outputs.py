"""What the controller sends to motors and servos, normalised: ACTUATOR_OUTPUT_STATUS and HIL_ACTUATOR_CONTROLS.

A value is 0..1 for a motor, -1..1 for one that turns both ways and for a servo (see `vehicle_model.channels`).
SERVO_OUTPUT_RAW has the same as pulses.
"""

from typing import Any

from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.telemetry.context import Context, boot_us
from sitl.snapshot import Snapshot

__all__ = ["actuator_output_status", "hil_actuator_controls"]

CENTRE, HALF_TRAVEL = 1500.0, 500.0  # of a pulse on a channel that the aircraft has no use for [us]
OUTPUTS = 32
HIL_OUTPUTS = 16


def actuator_output_status(snapshot: Snapshot, context: Context) -> tuple[Any, ...]:
    """ACTUATOR_OUTPUT_STATUS: a bit for each channel there is, and its value."""
    active = 0
    for channel in context.channels:
        active |= 1 << channel.number - 1
    for number in context.free_pulses:
        active |= 1 << number - 1
    return (boot_us(snapshot), active, *_values(snapshot, context, OUTPUTS))


def hil_actuator_controls(snapshot: Snapshot, context: Context) -> tuple[Any, ...]:
    """HIL_ACTUATOR_CONTROLS: the values and whether the vehicle is armed, as an autopilot tells its simulator."""
    mode = mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
    if snapshot.armed:
        mode |= mav.MAV_MODE_FLAG_SAFETY_ARMED
    return (boot_us(snapshot), *_values(snapshot, context, HIL_OUTPUTS), mode, 0)


def _values(snapshot: Snapshot, context: Context, count: int) -> list[float]:
    values = [0.0] * count
    for number, pulse in context.free_pulses.items():
        values[number - 1] = (pulse - CENTRE) / HALF_TRAVEL
    controls = snapshot.controls.tolist()
    for channel in context.channels:
        values[channel.number - 1] = channel.to_normalised(controls[channel.index])
    return values
