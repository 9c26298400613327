"""Guided items: a MISSION_ITEM that is no part of a mission but a place to fly to, or an altitude to hold, at once.

`current` is 2 or 3 in them. That is how ArduPilot's older clients (DroneKit's simple_goto) send a vehicle somewhere.
"""

from typing import Final

from sitl.flight.flight import Flight
from sitl.flight.mission_items import MissionItem
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.mission_conversion import GLOBAL_FRAMES

__all__ = ["ALTITUDE_ITEM", "GUIDED_ITEM", "fly_item"]

GUIDED_ITEM: Final = 2
ALTITUDE_ITEM: Final = 3


def fly_item(flight: Flight, item: MissionItem, *, altitude_only: bool) -> int:
    """Fly to an item's place, or to its altitude where the vehicle is; returns the MAV_MISSION_RESULT.

    Raises Refused for what the flight does not do.
    """
    if item.command != mav.MAV_CMD_NAV_WAYPOINT:
        return mav.MAV_MISSION_UNSUPPORTED
    if item.frame not in GLOBAL_FRAMES:
        return mav.MAV_MISSION_UNSUPPORTED_FRAME
    altitude = flight.places.altitude - item.down(item.z, flight.places)
    if altitude_only:
        flight.change_altitude(altitude)
    else:
        flight.reposition(item.x, item.y, altitude)
    return mav.MAV_MISSION_ACCEPTED
