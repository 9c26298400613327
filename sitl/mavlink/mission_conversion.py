"""Plan items between the wire and the flight: MISSION_ITEM_INT and MISSION_ITEM, mission, geofence and rally points.

https://mavlink.io/en/services/mission.html. An item is kept as it came, so that it goes back as it came, and what the
flight needs is made from it. Plans that come from elsewhere, a plan file or a script, are made into items here.
"""

import math
from collections.abc import Sequence
from typing import Any, Final, NamedTuple

from sitl.flight.feasibility import Problem, unsupported
from sitl.flight.geofence import LARGEST_RADIUS, FenceCircle, FencePolygon
from sitl.flight.mission_items import Frame, MissionItem
from sitl.flight.rally import RallyPoint
from sitl.mavlink.dialect import tiltwing as mav

__all__ = [
    "FENCE", "GLOBAL_FRAMES", "MISSION", "RALLY", "RETURN_POINT", "InvalidPlanError", "StoredItem", "fence_areas",
    "fence_items", "home_item", "item_fields", "item_int_fields", "mission_item", "mission_items", "rally_items",
    "rally_points", "result_of", "stored", "unsupported_item",
]  # fmt: skip

MISSION: Final = mav.MAV_MISSION_TYPE_MISSION
FENCE: Final = mav.MAV_MISSION_TYPE_FENCE
RALLY: Final = mav.MAV_MISSION_TYPE_RALLY

UNSET = 0x7FFFFFFF  # INT32_MAX: a coordinate that is not given
UNSET_TOO = -0x80000000  # what a C compiler makes of NaN
PER_DEGREE, PER_METRE = 1e7, 1e4  # of the integer coordinates in global and in local frames
LOCAL_FRAMES = frozenset({
    mav.MAV_FRAME_LOCAL_NED, mav.MAV_FRAME_LOCAL_ENU, mav.MAV_FRAME_LOCAL_OFFSET_NED, mav.MAV_FRAME_BODY_NED,
    mav.MAV_FRAME_BODY_OFFSET_NED, mav.MAV_FRAME_BODY_FRD, mav.MAV_FRAME_LOCAL_FRD, mav.MAV_FRAME_LOCAL_FLU,
})  # fmt: skip
GLOBAL_FRAMES = frozenset(frame for frame in Frame if frame.above_sea or frame.above_home)
# Frames that say that coordinates are integers, and the same ones with coordinates in degrees.
PLAIN_FRAMES = {
    mav.MAV_FRAME_GLOBAL_INT: mav.MAV_FRAME_GLOBAL,
    mav.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT: mav.MAV_FRAME_GLOBAL_RELATIVE_ALT,
    mav.MAV_FRAME_GLOBAL_TERRAIN_ALT_INT: mav.MAV_FRAME_GLOBAL_TERRAIN_ALT,
}
# Commands whose param5 and param6 are no coordinates, whatever frame they are sent in.
PLACELESS = frozenset(number for number, entry in mav.enums["MAV_CMD"].items() if not entry.has_location)

RETURN_POINT: Final = mav.MAV_CMD_NAV_FENCE_RETURN_POINT
POLYGONS = {
    mav.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION: True,
    mav.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION: False,
}
CIRCLES = {mav.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION: True, mav.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION: False}
# PX4's rally points may bring the loiters from which they are approached; they are kept and not flown.
APPROACH: Final = mav.MAV_CMD_NAV_LOITER_TO_ALT
COMMANDS = {
    FENCE: frozenset({RETURN_POINT, *POLYGONS, *CIRCLES}),
    RALLY: frozenset({mav.MAV_CMD_NAV_RALLY_POINT, APPROACH}),
}

RESULTS = {
    "command": mav.MAV_MISSION_UNSUPPORTED,
    "frame": mav.MAV_MISSION_UNSUPPORTED_FRAME,
    "param1": mav.MAV_MISSION_INVALID_PARAM1,
    "param2": mav.MAV_MISSION_INVALID_PARAM2,
    "param3": mav.MAV_MISSION_INVALID_PARAM3,
    "param4": mav.MAV_MISSION_INVALID_PARAM4,
    "x": mav.MAV_MISSION_INVALID_PARAM5_X,
    "y": mav.MAV_MISSION_INVALID_PARAM6_Y,
    "z": mav.MAV_MISSION_INVALID_PARAM7,
}


class InvalidPlanError(ValueError):
    """A geofence or rally points that make no sense; `problems` lists the items and the reasons."""

    def __init__(self, problems: list[Problem]) -> None:
        super().__init__("; ".join(map(str, problems)))
        self.problems = sorted(problems, key=lambda problem: problem.index)


class StoredItem(NamedTuple):
    """An item as it came. `x` and `y` are degrees, metres or plain numbers, by frame and command; NaN is unset."""

    command: int
    frame: int = mav.MAV_FRAME_GLOBAL
    param1: float = 0.0
    param2: float = 0.0
    param3: float = 0.0
    param4: float = 0.0
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    autocontinue: int = 1


# -- the wire ----------------------------------------------------------------------------------------------------------


def stored(message: Any, *, is_int: bool) -> StoredItem:
    """The item in a MISSION_ITEM_INT, or a MISSION_ITEM (`is_int` False)."""
    x, y = message.x, message.y
    if is_int:
        scale = _scale(message.command, message.frame)
        x, y = x / scale, y / scale
    return StoredItem(
        message.command, message.frame, message.param1, message.param2, message.param3, message.param4,
        x, y, message.z, message.autocontinue,
    )  # fmt: skip


def item_int_fields(item: StoredItem) -> dict[str, Any]:
    """Fields of a MISSION_ITEM_INT that describe an item."""
    scale = _scale(item.command, item.frame)
    return {**_common_fields(item), "frame": item.frame, "x": _whole(item.x * scale), "y": _whole(item.y * scale)}


def item_fields(item: StoredItem) -> dict[str, Any]:
    """Fields of a MISSION_ITEM that describe an item: coordinates as plain numbers, in degrees or metres."""
    x, y = _given(item)
    return {**_common_fields(item), "frame": PLAIN_FRAMES.get(item.frame, item.frame), "x": x, "y": y}


def _common_fields(item: StoredItem) -> dict[str, Any]:
    return {
        "command": item.command, "param1": item.param1, "param2": item.param2, "param3": item.param3,
        "param4": item.param4, "z": item.z, "autocontinue": item.autocontinue,
    }  # fmt: skip


def _scale(command: int, frame: int) -> float:
    """What the integer coordinates of an item are multiples of, per degree, per metre or per one."""
    if frame in LOCAL_FRAMES:
        return PER_METRE
    return 1.0 if frame == mav.MAV_FRAME_MISSION or command in PLACELESS else PER_DEGREE


def _whole(number: float) -> int:
    if math.isnan(number):
        return UNSET
    return round(min(max(number, UNSET_TOO), UNSET))


def _given(item: StoredItem) -> tuple[float, float]:
    """Coordinates, NaN where integers said that they are unset."""
    scale = _scale(item.command, item.frame)
    unset = (UNSET / scale, UNSET_TOO / scale)
    return (math.nan if item.x in unset else item.x, math.nan if item.y in unset else item.y)


def result_of(problem: Problem) -> int:
    """The MAV_MISSION_RESULT that says what is wrong with an item, or with the plan as a whole."""
    return RESULTS.get(problem.field, mav.MAV_MISSION_ERROR if problem.index < 0 else mav.MAV_MISSION_INVALID)


def unsupported_item(kind: int, index: int, item: StoredItem) -> Problem | None:
    """What no plan of this MAV_MISSION_TYPE could hold, so that an upload may end there; None if there is nothing."""
    if kind == MISSION:
        found = unsupported(mission_item(item))
        return None if found is None else Problem(index, found[1], found[0])
    if item.command not in COMMANDS[kind]:
        what = "geofences" if kind == FENCE else "rally points"
        return Problem(index, f"command {item.command} is not supported in {what}", "command")
    for number, name in enumerate(("param1", "param2", "param3", "param4", "x", "y", "z")):
        if math.isinf(getattr(item, name)):
            return Problem(index, f"param{number + 1}: expected a finite number, got {getattr(item, name)}", name)
    if item.frame not in GLOBAL_FRAMES:
        return Problem(index, f"frame {item.frame} is not supported, expected a GLOBAL one", "frame")
    return None


# -- missions ----------------------------------------------------------------------------------------------------------


def mission_item(item: StoredItem, *, always_continues: bool = False) -> MissionItem:
    """The flight's item; `always_continues`: autocontinue has no meaning, as with ArduPilot and its clients."""
    x, y = _given(item)
    return MissionItem(
        item.command, item.frame, item.param1, item.param2, item.param3, item.param4, x, y, item.z,
        autocontinue=always_continues or item.autocontinue != 0,
    )  # fmt: skip


def mission_items(items: Sequence[MissionItem]) -> tuple[StoredItem, ...]:
    """The flight's items as they go over the wire."""
    return tuple(
        StoredItem(
            item.command, item.frame, item.param1, item.param2, item.param3, item.param4, item.x, item.y, item.z,
            int(item.autocontinue),
        )
        for item in items
    )  # fmt: skip


def home_item(latitude: float, longitude: float, altitude_msl: float) -> StoredItem:
    """Home as ArduPilot's missions begin with it [deg, deg, m]."""
    return StoredItem(mav.MAV_CMD_NAV_WAYPOINT, x=latitude, y=longitude, z=altitude_msl)


# -- geofences ---------------------------------------------------------------------------------------------------------


def fence_areas(items: Sequence[StoredItem]) -> tuple[tuple[FencePolygon, ...], tuple[FenceCircle, ...]]:
    """Areas of a geofence; raises InvalidPlanError. A return point is no area: it is left out."""
    problems = _item_problems(FENCE, items)
    polygons: list[FencePolygon] = []
    circles: list[FenceCircle] = []
    index = 0
    while index < len(items):
        item = items[index]
        if item.command in CIRCLES:
            if 0.0 < item.param1 <= LARGEST_RADIUS:
                circles.append(FenceCircle(item.x, item.y, item.param1, CIRCLES[item.command]))
            else:
                reason = (
                    f"radius: expected more than 0 m and at most {LARGEST_RADIUS / 1e3:g} km, got {item.param1:g} m"
                )
                problems.append(Problem(index, reason, "param1"))
        elif item.command in POLYGONS:
            corners = _corners(items, index)
            if isinstance(corners, Problem):
                problems.append(corners)
                break
            polygons.append(FencePolygon(corners, POLYGONS[item.command]))
            index += len(corners) - 1
        index += 1
    if problems:
        raise InvalidPlanError(problems)
    return tuple(polygons), tuple(circles)


def _corners(items: Sequence[StoredItem], first: int) -> tuple[tuple[float, float], ...] | Problem:
    """Corners of the polygon that begins at an item, as many as it says, or why there are not."""
    command, count = items[first].command, items[first].param1
    if not (count >= 3.0 and count == math.floor(count)):
        return Problem(first, f"polygon: expected a number of corners of at least 3, got {count:g}", "param1")
    end = first
    while end < len(items) and end < first + count and items[end].command == command and items[end].param1 == count:
        end += 1
    if end < first + count:
        return Problem(first, f"polygon: expected {count:g} corners one after the other, got {end - first}", "param1")
    return tuple((item.x, item.y) for item in items[first:end])


def fence_items(polygons: Sequence[FencePolygon], circles: Sequence[FenceCircle]) -> tuple[StoredItem, ...]:
    """The flight's areas as they go over the wire."""
    corner = {inclusion: command for command, inclusion in POLYGONS.items()}
    centre = {inclusion: command for command, inclusion in CIRCLES.items()}
    return (
        *(
            StoredItem(corner[polygon.inclusion], param1=float(len(polygon.points)), x=point[0], y=point[1])
            for polygon in polygons
            for point in polygon.points
        ),
        *(
            StoredItem(centre[circle.inclusion], param1=circle.radius, x=circle.latitude, y=circle.longitude)
            for circle in circles
        ),
    )


# -- rally points ------------------------------------------------------------------------------------------------------


def rally_points(items: Sequence[StoredItem]) -> tuple[RallyPoint, ...]:
    """The flight's rally points; raises InvalidPlanError. Approaches to them are left out."""
    problems = _item_problems(RALLY, items)
    problems += [
        Problem(index, "altitude: expected one, got none", "z")
        for index, item in enumerate(items)
        if math.isnan(item.z)
    ]
    if problems:
        raise InvalidPlanError(problems)
    return tuple(
        RallyPoint(item.x, item.y, item.z, Frame(item.frame).above_home) for item in items if item.command != APPROACH
    )


def rally_items(points: Sequence[RallyPoint]) -> tuple[StoredItem, ...]:
    """The flight's rally points as they go over the wire."""
    return tuple(
        StoredItem(
            mav.MAV_CMD_NAV_RALLY_POINT,
            mav.MAV_FRAME_GLOBAL_RELATIVE_ALT if point.above_home else mav.MAV_FRAME_GLOBAL,
            x=point.latitude,
            y=point.longitude,
            z=point.altitude,
        )
        for point in points
    )


def _item_problems(kind: int, items: Sequence[StoredItem]) -> list[Problem]:
    """What is wrong with the items of a geofence or of rally points by themselves: places must be on the map."""
    problems: list[Problem] = []
    for index, item in enumerate(items):
        found = unsupported_item(kind, index, item)
        if found is not None:
            problems.append(found)
            continue
        for field, what, value, most in (("x", "latitude", item.x, 90.0), ("y", "longitude", item.y, 180.0)):
            if not abs(value) <= most:
                reason = f"{what}: expected one within +-{most:g} deg, got {value:g}"
                problems.append(Problem(index, reason, field))
    return problems
