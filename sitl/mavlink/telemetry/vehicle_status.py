"""How the vehicle does: SYSTEM_TIME, EXTENDED_SYS_STATE, and the angle of its wing."""

import math
from typing import Any

from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.telemetry.context import Context, boot_ms
from sitl.snapshot import Snapshot

__all__ = ["extended_sys_state", "named_value_float", "system_time", "tilt_status"]

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
