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
PX4_MANUAL = 1 << 16  # custom mode: PX4's main mode 1
MAVLINK_VERSION = 3  # of the field of this name, as every implementation sends it


def heartbeat(snapshot: Snapshot, _: Context) -> tuple[Any, ...]:
    """HEARTBEAT: a tilt-wing that speaks PX4's dialect, under manual control as long as no autopilot flies it.

    It counts as armed while any motor is told to turn.
    """
    mode = mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | mav.MAV_MODE_FLAG_MANUAL_INPUT_ENABLED
    if snapshot.controls[0] or snapshot.controls[1] or snapshot.controls[2]:
        mode |= mav.MAV_MODE_FLAG_SAFETY_ARMED
        status = mav.MAV_STATE_ACTIVE
    else:
        status = mav.MAV_STATE_STANDBY if snapshot.on_ground else mav.MAV_STATE_ACTIVE
    return (mav.MAV_TYPE_VTOL_TILTWING, mav.MAV_AUTOPILOT_PX4, mode, PX4_MANUAL, status, MAVLINK_VERSION)
