"""How the vehicle does: SYS_STATUS, SYSTEM_TIME, EXTENDED_SYS_STATE, and the angle of its wing."""

import math
from typing import Any

from sitl.mavlink.context import Context, boot_ms
from sitl.mavlink.dialect import tiltwing as mav
from sitl.snapshot import Snapshot

__all__ = ["extended_sys_state", "named_value_float", "sys_status", "system_time", "tilt_status"]

HOVER_TILT = math.radians(75.0)  # steeper: flies as a multicopter
CRUISE_TILT = math.radians(15.0)  # flatter: flies as an aeroplane
TILT_END = math.radians(0.5)  # closer to an end of the range counts as being there
VTOL_STATES = {
    "HOVER": mav.MAV_VTOL_STATE_MC,
    "TO_CRUISE": mav.MAV_VTOL_STATE_TRANSITION_TO_FW,
    "CRUISE": mav.MAV_VTOL_STATE_FW,
    "TO_HOVER": mav.MAV_VTOL_STATE_TRANSITION_TO_MC,
}
LANDED_STATES = {
    "ON_GROUND": mav.MAV_LANDED_STATE_ON_GROUND,
    "IN_AIR": mav.MAV_LANDED_STATE_IN_AIR,
    "TAKEOFF": mav.MAV_LANDED_STATE_TAKEOFF,
    "LANDING": mav.MAV_LANDED_STATE_LANDING,
}

SENSORS = (
    mav.MAV_SYS_STATUS_SENSOR_3D_GYRO
    | mav.MAV_SYS_STATUS_SENSOR_3D_ACCEL
    | mav.MAV_SYS_STATUS_SENSOR_3D_MAG
    | mav.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE
    | mav.MAV_SYS_STATUS_SENSOR_DIFFERENTIAL_PRESSURE
    | mav.MAV_SYS_STATUS_SENSOR_GPS
    | mav.MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS
    | mav.MAV_SYS_STATUS_AHRS
    | mav.MAV_SYS_STATUS_SENSOR_BATTERY
)
NOT_MEASURED = -1
MOST_ERRORS = 0xFFFF  # that errors_comm can hold


def sys_status(snapshot: Snapshot, context: Context) -> tuple[Any, ...]:
    """SYS_STATUS: sensors, processor load [per mille of one core], battery [mV, cA, %], link errors."""
    remaining = snapshot.battery_remaining
    pieces = context.received + context.malformed
    return (
        SENSORS,
        SENSORS,
        SENSORS,
        round(min(context.load, 1.0) * 1000.0),
        round(snapshot.battery_voltage * 1e3),
        round(snapshot.battery_current * 100.0),
        NOT_MEASURED if remaining is None else round(remaining * 100.0),
        round(10000.0 * context.malformed / pieces) if pieces else 0,
        min(context.malformed, MOST_ERRORS),
        *(0, 0, 0, 0),
        *(0, 0, 0),
    )


def system_time(snapshot: Snapshot, context: Context) -> tuple[Any, ...]:
    """SYSTEM_TIME: UTC [us since 1970] and time since start [ms], both running with simulated time."""
    return (round((context.unix_epoch + snapshot.time) * 1e6), boot_ms(snapshot))


def extended_sys_state(snapshot: Snapshot, context: Context) -> tuple[Any, ...]:
    """EXTENDED_SYS_STATE: VTOL and landed state, as the flight controller knows them.

    While it does not fly the one comes from the tilt angle and the other from the landing gear.
    """
    if snapshot.regime is not None and snapshot.landed is not None:
        return (VTOL_STATES[snapshot.regime], LANDED_STATES[snapshot.landed])
    if snapshot.tilt > HOVER_TILT:
        vtol = mav.MAV_VTOL_STATE_MC
    elif snapshot.tilt < CRUISE_TILT:
        vtol = mav.MAV_VTOL_STATE_FW
    elif context.tilt_direction > 0:
        vtol = mav.MAV_VTOL_STATE_TRANSITION_TO_MC
    else:
        vtol = mav.MAV_VTOL_STATE_TRANSITION_TO_FW
    landed = mav.MAV_LANDED_STATE_ON_GROUND if snapshot.on_ground else mav.MAV_LANDED_STATE_IN_AIR
    return (vtol, landed)


def tilt_status(snapshot: Snapshot, context: Context) -> tuple[Any, ...]:
    """TILT_STATUS of our dialect: angle, command and rate limit of the wing [rad, rad/s], and what holds it back."""
    command = float(snapshot.controls[3])
    flags = 0
    # The servo is a first-order lag whose rate saturates: it asks for (command - angle) / time constant.
    reachable = min(max(command, context.tilt_minimum), context.tilt_maximum)
    if abs(reachable - snapshot.tilt) > context.tilt_rate_limit * context.tilt_time_constant:
        flags |= mav.TILT_STATUS_FLAGS_RATE_LIMITED
    if snapshot.tilt < context.tilt_minimum + TILT_END or snapshot.tilt > context.tilt_maximum - TILT_END:
        flags |= mav.TILT_STATUS_FLAGS_AT_LIMIT
    return (boot_ms(snapshot), snapshot.tilt, command, context.tilt_rate_limit, flags)


def named_value_float(snapshot: Snapshot, _: Context) -> tuple[Any, ...]:
    """NAMED_VALUE_FLOAT "TILT": angle of the wing in degrees, for tools that do not know our dialect."""
    return (boot_ms(snapshot), b"TILT", math.degrees(snapshot.tilt))
