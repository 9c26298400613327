"""Mission items as ground stations send them: commands and frames by MAVLink's numbers, parameters by its meanings.

Source: MAVLink `common.xml`, enumerations MAV_CMD and MAV_FRAME. The numbers are written here once more because the
flight knows no protocol: a plan file brings the same items without any link.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

from sitl.flight.places import LocalFrame, Ned

__all__ = [
    "CONDITIONS", "FLOWN", "FOR_PAYLOADS", "LOITERS", "PLACED", "Command", "Frame", "MissionItem", "begins_with_home",
    "place_of",
]  # fmt: skip

ON_GROUND = 2.0  # below this height a waypoint is not one to fly to [m]


class Command(IntEnum):
    """MAV_CMD of the items that missions may hold."""

    WAYPOINT = 16
    LOITER_UNLIM = 17
    LOITER_TURNS = 18
    LOITER_TIME = 19
    RETURN_TO_LAUNCH = 20
    LAND = 21
    TAKEOFF = 22
    LOITER_TO_ALT = 31
    VTOL_TAKEOFF = 84
    VTOL_LAND = 85
    DELAY = 93
    CONDITION_DELAY = 112
    CONDITION_DISTANCE = 114
    CONDITION_YAW = 115
    DO_JUMP = 177
    DO_CHANGE_SPEED = 178
    DO_SET_HOME = 179
    DO_CHANGE_ALTITUDE = 186
    DO_LAND_START = 189
    DO_SET_ROI_LOCATION = 195
    DO_SET_ROI_WPNEXT_OFFSET = 196
    DO_SET_ROI_NONE = 197
    DO_CONTROL_VIDEO = 200
    DO_SET_ROI = 201
    DO_DIGICAM_CONTROL = 203
    DO_MOUNT_CONFIGURE = 204
    DO_MOUNT_CONTROL = 205
    DO_SET_CAM_TRIGG_DIST = 206
    DO_SET_CAM_TRIGG_INTERVAL = 214
    SET_CAMERA_MODE = 530
    SET_CAMERA_ZOOM = 531
    SET_CAMERA_FOCUS = 532
    DO_GIMBAL_MANAGER_PITCHYAW = 1000
    IMAGE_START_CAPTURE = 2000
    IMAGE_STOP_CAPTURE = 2001
    VIDEO_START_CAPTURE = 2500
    VIDEO_STOP_CAPTURE = 2501
    DO_VTOL_TRANSITION = 3000


LOITERS = frozenset({Command.LOITER_UNLIM, Command.LOITER_TURNS, Command.LOITER_TIME, Command.LOITER_TO_ALT})
# Items with a place to fly to.
PLACED = LOITERS | {Command.WAYPOINT, Command.TAKEOFF, Command.VTOL_TAKEOFF, Command.LAND, Command.VTOL_LAND}
# Items that are flown, or waited for, one after the other; all others happen at once.
FLOWN = PLACED | {
    Command.RETURN_TO_LAUNCH, Command.DELAY, Command.CONDITION_YAW, Command.DO_VTOL_TRANSITION,
}  # fmt: skip
# Items that hold back the commands after them.
CONDITIONS = frozenset({Command.CONDITION_DELAY, Command.CONDITION_DISTANCE})
# Items for cameras and gimbals, of which this aircraft has none: accepted, and nothing happens.
FOR_PAYLOADS = frozenset({
    Command.DO_SET_ROI_LOCATION, Command.DO_SET_ROI_WPNEXT_OFFSET, Command.DO_SET_ROI_NONE, Command.DO_SET_ROI,
    Command.DO_CONTROL_VIDEO, Command.DO_DIGICAM_CONTROL, Command.DO_MOUNT_CONFIGURE, Command.DO_MOUNT_CONTROL,
    Command.DO_SET_CAM_TRIGG_DIST, Command.DO_SET_CAM_TRIGG_INTERVAL, Command.SET_CAMERA_MODE,
    Command.SET_CAMERA_ZOOM, Command.SET_CAMERA_FOCUS, Command.DO_GIMBAL_MANAGER_PITCHYAW,
    Command.IMAGE_START_CAPTURE, Command.IMAGE_STOP_CAPTURE, Command.VIDEO_START_CAPTURE, Command.VIDEO_STOP_CAPTURE,
})  # fmt: skip


class Frame(IntEnum):
    """MAV_FRAME of an item: what its altitude counts from."""

    GLOBAL = 0
    LOCAL_NED = 1
    MISSION = 2
    GLOBAL_RELATIVE_ALT = 3
    LOCAL_ENU = 4
    GLOBAL_INT = 5
    GLOBAL_RELATIVE_ALT_INT = 6
    GLOBAL_TERRAIN_ALT = 10
    GLOBAL_TERRAIN_ALT_INT = 11

    @property
    def above_sea(self) -> bool:
        """Altitudes count from mean sea level."""
        return self in (Frame.GLOBAL, Frame.GLOBAL_INT)

    @property
    def above_home(self) -> bool:
        """Altitudes count from home, or from the ground, which is flat here and as high as home."""
        return self in (Frame.GLOBAL_RELATIVE_ALT, Frame.GLOBAL_RELATIVE_ALT_INT) or self.above_terrain

    @property
    def above_terrain(self) -> bool:
        """Altitudes count from the ground."""
        return self in (Frame.GLOBAL_TERRAIN_ALT, Frame.GLOBAL_TERRAIN_ALT_INT)


@dataclass(frozen=True, slots=True)
class MissionItem:
    """One item. `x` and `y` are latitude and longitude [deg], `z` the altitude [m] above what `frame` says.

    `command` and `frame` may be plain numbers that Command and Frame do not know: then `sitl.flight.feasibility` says
    so. A parameter that is not a number is unset, as in MAVLink.
    """

    command: int
    frame: int = Frame.GLOBAL_RELATIVE_ALT
    param1: float = 0.0
    param2: float = 0.0
    param3: float = 0.0
    param4: float = math.nan
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    autocontinue: bool = True

    @property
    def here(self) -> bool:
        """The item means wherever the vehicle is: no latitude and longitude, or both zero as ground stations send."""
        return math.isnan(self.x) or math.isnan(self.y) or (self.x == 0.0 and self.y == 0.0)

    def same_as(self, other: "MissionItem") -> bool:
        """Whether nothing differs; what is unset in both does not."""
        pairs = ((getattr(self, name), getattr(other, name)) for name in self.__slots__)
        return all(one == another or (one != one and another != another) for one, another in pairs)  # noqa: PLR0124

    def down(self, altitude: float, places: LocalFrame) -> float:
        """Down [m] of an altitude in this item's frame."""
        return (places.altitude if Frame(self.frame).above_sea else places.home.down) - altitude


def place_of(item: MissionItem, places: LocalFrame, here: Ned) -> Ned:
    """Where an item with a place leads to, in the local frame [m]; what it leaves open is that of `here`.

    Relative altitudes follow home as it is now.
    """
    north, east, down = here
    if not math.isnan(item.z):
        down = item.down(item.z, places)
    if not item.here:
        north, east, _ = places.to_ned(item.x, item.y, places.altitude - down)
    return north, east, down


def begins_with_home(items: Sequence[MissionItem], places: LocalFrame) -> bool:
    """Whether the first item only says where home is, as the mission files of ArduPilot's ground stations begin.

    That is a waypoint by absolute altitude, on the ground or below it. It is not flown to.
    """
    if len(items) < 2 or items[0].command != Command.WAYPOINT or items[0].frame not in (Frame.GLOBAL, Frame.GLOBAL_INT):
        return False
    return items[0].z - places.home.altitude < ON_GROUND
