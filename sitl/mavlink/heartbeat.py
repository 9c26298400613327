"""Heartbeat protocol: that the vehicle is here, what it is and whether its motors may turn.

https://mavlink.io/en/services/heartbeat.html. Sent once per wall second at any speed of the simulation, also while
simulated time stands still: the one who waits for it lives in wall time.
"""

from typing import Any

from sitl.mavlink.context import Context
from sitl.mavlink.dialect import tiltwing as mav
from sitl.snapshot import Snapshot

__all__ = ["HEARTBEAT_PERIOD", "heartbeat"]

HEARTBEAT_PERIOD = 1.0  # [s], wall time
MANUAL, ALTITUDE, POSITION, AUTO, OFFBOARD, STABILIZED, TERMINATION = 1, 2, 3, 4, 6, 7, 10  # PX4's main modes
ORBIT = 1  # its sub modes of POSITION and AUTO
TAKEOFF, LOITER, MISSION, RETURN, LAND = 2, 3, 4, 5, 6
PX4_MODES: dict[str | None, tuple[int, int]] = {
    None: (MANUAL, 0),
    "MANUAL": (MANUAL, 0),
    "STABILIZED": (STABILIZED, 0),
    "ALTITUDE": (ALTITUDE, 0),
    "POSITION": (POSITION, 0),
    "ORBIT": (POSITION, ORBIT),
    "HOLD": (AUTO, LOITER),
    "TAKEOFF": (AUTO, TAKEOFF),
    "LAND": (AUTO, LAND),
    "RETURN": (AUTO, RETURN),
    "MISSION": (AUTO, MISSION),
    "OFFBOARD": (OFFBOARD, 0),
    "TERMINATION": (TERMINATION, 0),
}
# What each main mode is in the terms that all autopilots share.
_STABILISED = mav.MAV_MODE_FLAG_STABILIZE_ENABLED
_BY_STICKS = mav.MAV_MODE_FLAG_MANUAL_INPUT_ENABLED
_GUIDED = mav.MAV_MODE_FLAG_AUTO_ENABLED | mav.MAV_MODE_FLAG_GUIDED_ENABLED
BASE_MODES = {
    MANUAL: _BY_STICKS,
    STABILIZED: _BY_STICKS | _STABILISED,
    ALTITUDE: _BY_STICKS | _STABILISED,
    POSITION: _BY_STICKS | _STABILISED,
    AUTO: _STABILISED | _GUIDED,
    OFFBOARD: _STABILISED | _GUIDED,
    TERMINATION: 0,
}
MAVLINK_VERSION = 3  # of the field of this name, as every implementation sends it


def heartbeat(snapshot: Snapshot, _: Context) -> tuple[Any, ...]:
    """HEARTBEAT: a tilt-wing that speaks PX4's dialect, its custom modes too.

    While its own flight controller does not fly it counts as under manual control, and as armed while any motor is told
    to turn.
    """
    main, sub = PX4_MODES[snapshot.mode]
    mode = mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | BASE_MODES[main]
    armed = snapshot.armed
    if armed is None:
        armed = bool(snapshot.controls[0] or snapshot.controls[1] or snapshot.controls[2])
    if armed:
        mode |= mav.MAV_MODE_FLAG_SAFETY_ARMED
        status = mav.MAV_STATE_ACTIVE
    else:
        status = mav.MAV_STATE_STANDBY if snapshot.on_ground else mav.MAV_STATE_ACTIVE
    if main == TERMINATION:
        status = mav.MAV_STATE_FLIGHT_TERMINATION
    custom_mode = main << 16 | sub << 24
    return (mav.MAV_TYPE_VTOL_TILTWING, mav.MAV_AUTOPILOT_PX4, mode, custom_mode, status, MAVLINK_VERSION)
