"""Plan files of QGroundControl (.plan) as the MISSION_ITEM_INTs that QGroundControl would send for them.

Sources: QGroundControl's developer guide, "Plan File Format"; MAVLink guide, services/mission. Of the complex items
those are read that bring their items with them (surveys, corridor scans) and the landing patterns, a fixed few.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
from pymavlink.dialects.v20 import all as mav

from gcs_scripts.errors import GroundError

__all__ = ["Item", "Plan", "read_plan", "wire_items"]

LANDINGS = (mav.MAV_CMD_NAV_LAND, mav.MAV_CMD_NAV_VTOL_LAND, mav.MAV_CMD_NAV_RETURN_TO_LAUNCH)
HEADING_MAY_BE_NAN = (
    mav.MAV_CMD_NAV_WAYPOINT, mav.MAV_CMD_NAV_LAND, mav.MAV_CMD_NAV_TAKEOFF,
    mav.MAV_CMD_NAV_VTOL_TAKEOFF, mav.MAV_CMD_NAV_VTOL_LAND,
)  # fmt: skip
LOCAL_FRAMES = (mav.MAV_FRAME_LOCAL_NED, mav.MAV_FRAME_LOCAL_ENU, mav.MAV_FRAME_LOCAL_OFFSET_NED)
DEGREE, DECIMETRE = 1e7, 1e4  # what x and y of a MISSION_ITEM_INT count, in a degree and in a metre
INT32_LIMIT = (1 << 31) - 1


class Item(NamedTuple):
    """One item: MAV_CMD, MAV_FRAME and its seven parameters, NaN where the plan leaves one open."""

    command: int
    frame: int
    params: tuple[float, ...]
    autocontinue: bool = True


@dataclass(frozen=True)
class Plan:
    """What a plan file holds: the items of the three lists, and home (latitude, longitude [deg], altitude [m, MSL])."""

    home: tuple[float, float, float]
    mission: tuple[Item, ...]
    fence: tuple[Item, ...]
    rally: tuple[Item, ...]

    @property
    def landing(self) -> int | None:
        """Index of the last item that brings the vehicle down; None if there is none."""
        return max((i for i, item in enumerate(self.mission) if item.command in LANDINGS), default=None)


class _Simple(msgspec.Struct, tag="SimpleItem", rename="camel"):
    command: int
    frame: int
    params: list[float | None]
    auto_continue: bool = True
    do_jump_id: int | None = None


class _Transects(msgspec.Struct):
    items: list[_Simple] = msgspec.field(name="Items")


class _Complex(msgspec.Struct, tag="ComplexItem", rename="camel"):
    complex_item_type: str
    transects: _Transects | None = msgspec.field(name="TransectStyleComplexItem", default=None)
    land_coordinate: tuple[float, float, float] | None = None
    landing_approach_coordinate: tuple[float, float, float] | None = None
    altitudes_are_relative: bool = True
    use_loiter_to_alt: bool = True
    loiter_radius: float = 0.0
    loiter_clockwise: bool = True
    stop_taking_photos: bool = False
    stop_video_photos: bool = False


class _Mission(msgspec.Struct, rename="camel"):
    planned_home_position: tuple[float, float, float | None]
    items: list[_Simple | _Complex]


class _Polygon(msgspec.Struct):
    polygon: list[tuple[float, float]]
    inclusion: bool


class _Centre(msgspec.Struct):
    center: tuple[float, float]
    radius: float


class _Circle(msgspec.Struct):
    circle: _Centre
    inclusion: bool


class _Fence(msgspec.Struct, rename="camel"):
    polygons: list[_Polygon] = []
    circles: list[_Circle] = []
    breach_return: tuple[float, float, float] | None = None


class _Rally(msgspec.Struct):
    points: list[tuple[float, float, float]] = []


class _File(msgspec.Struct, rename="camel"):
    file_type: str
    mission: _Mission
    geo_fence: _Fence = msgspec.field(default_factory=_Fence)
    rally_points: _Rally = msgspec.field(default_factory=_Rally)


def read_plan(path: Path) -> Plan:
    """Read a plan file. Raises GroundError, one line with the file, the place in it and what was expected."""
    try:
        given = msgspec.json.decode(path.read_bytes(), type=_File)
        if given.file_type != "Plan":
            raise GroundError(f"{path}: fileType: expected Plan, got {given.file_type!r}")
        mission = tuple(_mission(given.mission.items))
    except OSError as error:
        raise GroundError(f"{path}: cannot be read: {error.strerror}") from None
    except msgspec.ValidationError as error:
        problem, _, place = str(error).partition(" - at `$")
        raise GroundError(f"{path}: {place.strip('.`') or 'the whole'}: {problem[:1].lower()}{problem[1:]}") from None
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise GroundError(f"{path}: expected JSON as QGroundControl saves it: {error}") from None
    except _PlanError as error:
        raise GroundError(f"{path}: {error}") from None
    relative = mav.MAV_FRAME_GLOBAL_RELATIVE_ALT
    rally = (Item(mav.MAV_CMD_NAV_RALLY_POINT, relative, (0, 0, 0, 0, *p)) for p in given.rally_points.points)
    latitude, longitude, altitude = given.mission.planned_home_position
    home = (latitude, longitude, 0.0 if altitude is None else altitude)
    return Plan(home, mission, tuple(_fence(given.geo_fence)), tuple(rally))


class _PlanError(ValueError):
    """What is wrong, and where in the file."""


def _mission(given: Sequence[_Simple | _Complex]) -> list[Item]:
    """All items in the order of flight; jumps go to indices instead of the file's doJumpIds."""
    items: list[Item] = []
    index_of: dict[int, int] = {}
    for number, entry in enumerate(given):
        place = f"mission.items[{number}]"
        if isinstance(entry, _Simple):
            parts = [entry]
        elif entry.transects is not None:
            parts = entry.transects.items
        else:
            items += _landing_pattern(entry, place)
            continue
        for part in parts:
            if len(part.params) != 7:
                raise _PlanError(f"{place}: expected 7 params, got {len(part.params)}")
            index_of.setdefault(len(items) + 1 if part.do_jump_id is None else part.do_jump_id, len(items))
            params = tuple(math.nan if value is None else value for value in part.params)
            items.append(Item(part.command, part.frame, params, part.auto_continue))
    for index, item in enumerate(items):
        if item.command == mav.MAV_CMD_DO_JUMP:
            target = index_of.get(int(item.params[0])) if math.isfinite(item.params[0]) else None
            if target is None:
                raise _PlanError(f"mission item {index}: jump: expected an item's doJumpId, got {item.params[0]:g}")
            items[index] = item._replace(params=(float(target), *item.params[1:]))
    return items


def _landing_pattern(given: _Complex, place: str) -> Iterator[Item]:
    land, approach = given.land_coordinate, given.landing_approach_coordinate
    command = {
        "vtolLandingPattern": mav.MAV_CMD_NAV_VTOL_LAND,
        "fwLandingPattern": mav.MAV_CMD_NAV_LAND,
    }.get(given.complex_item_type)
    if command is None:
        raise _PlanError(
            f"{place}: {given.complex_item_type}: expected a complex item that has its items in the file, as surveys"
            " and corridor scans, or a landing pattern"
        )
    if land is None or approach is None:
        raise _PlanError(f"{place}: expected landCoordinate and landingApproachCoordinate")
    frame = mav.MAV_FRAME_GLOBAL_RELATIVE_ALT if given.altitudes_are_relative else mav.MAV_FRAME_GLOBAL
    nothing = (0.0,) * 7
    yield Item(mav.MAV_CMD_DO_LAND_START, mav.MAV_FRAME_MISSION, nothing)
    if given.stop_taking_photos:
        yield Item(mav.MAV_CMD_DO_SET_CAM_TRIGG_DIST, mav.MAV_FRAME_MISSION, nothing)
        yield Item(mav.MAV_CMD_IMAGE_STOP_CAPTURE, mav.MAV_FRAME_MISSION, nothing)
    if given.stop_video_photos:
        yield Item(mav.MAV_CMD_VIDEO_STOP_CAPTURE, mav.MAV_FRAME_MISSION, nothing)
    if given.use_loiter_to_alt:
        radius = given.loiter_radius if given.loiter_clockwise else -given.loiter_radius
        yield Item(mav.MAV_CMD_NAV_LOITER_TO_ALT, frame, (1.0, radius, 0.0, 1.0, *approach))
    else:
        yield Item(mav.MAV_CMD_NAV_WAYPOINT, frame, (0.0, 0.0, 0.0, math.nan, *approach))
    heading = math.nan if command == mav.MAV_CMD_NAV_VTOL_LAND else 0.0
    yield Item(command, frame, (0.0, 0.0, 0.0, heading, *land))


def _fence(given: _Fence) -> Iterator[Item]:
    for area in given.polygons:
        command = (
            mav.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION
            if area.inclusion
            else mav.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION
        )
        for corner in area.polygon:
            yield Item(command, mav.MAV_FRAME_GLOBAL, (len(area.polygon), 0, 0, 0, *corner, 0))
    for area in given.circles:
        command = mav.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION if area.inclusion else mav.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION
        yield Item(command, mav.MAV_FRAME_GLOBAL, (area.circle.radius, 0, 0, 0, *area.circle.center, 0))
    if given.breach_return is not None:
        yield Item(
            mav.MAV_CMD_NAV_FENCE_RETURN_POINT,
            mav.MAV_FRAME_GLOBAL_RELATIVE_ALT,
            (0, 0, 0, 0, *given.breach_return),
        )


def wire_items(
    items: Sequence[Item], mission_type: int, home: tuple[float, float, float] | None = None
) -> list[dict[str, Any]]:
    """Fields of the MISSION_ITEM_INTs that carry items, all but the target.

    With `home`, as ArduPilot wants a mission: home is item 0, and of the first four parameters only a heading is NaN.
    """
    if home is not None:
        place = Item(mav.MAV_CMD_NAV_WAYPOINT, mav.MAV_FRAME_GLOBAL, (0.0, 0.0, 0.0, 0.0, *home))
        items = [place, *(_for_ardupilot(item) for item in items)]
    wire: list[dict[str, Any]] = []
    for seq, item in enumerate(items):
        scale = 1.0 if item.frame == mav.MAV_FRAME_MISSION else DECIMETRE if item.frame in LOCAL_FRAMES else DEGREE
        wire.append(
            {
                "seq": seq,
                "frame": item.frame,
                "command": item.command,
                "current": int(seq == 0 and mission_type == mav.MAV_MISSION_TYPE_MISSION),
                "autocontinue": int(item.autocontinue),
                **{f"param{n + 1}": item.params[n] for n in range(4)},
                "x": _scaled(item.params[4], scale),
                "y": _scaled(item.params[5], scale),
                "z": item.params[6],
                "mission_type": mission_type,
            }
        )
    return wire


def _for_ardupilot(item: Item) -> Item:
    params = [0.0 if math.isnan(value) else value for value in item.params]
    params[6] = item.params[6]  # an open height is for the vehicle to refuse, not for us to make the ground
    if item.command in HEADING_MAY_BE_NAN:
        params[3] = item.params[3]
    if item.command == mav.MAV_CMD_DO_JUMP:
        params[0] += 1.0
    return item._replace(params=tuple(params))


def _scaled(value: float, scale: float) -> int:
    """A place that is left open is 0, as QGroundControl leaves it in items that have none."""
    return 0 if math.isnan(value) else max(-INT32_LIMIT, min(INT32_LIMIT, round(value * scale)))
