"""Plan files of QGroundControl (.plan): mission, geofence and rally points as a ground station saves them.

Source: QGroundControl's developer guide, "Plan File Format", and what it writes itself. Complex items are read where
the file holds the items they stand for (surveys, corridor scans) or they are few and plain (the VTOL landing pattern).
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NoReturn, TypeVar

import msgspec

from sitl.flight.geofence import FenceCircle, FencePolygon
from sitl.flight.mission_items import Command, Frame, MissionItem
from sitl.flight.rally import RallyPoint

__all__ = ["Plan", "PlanError", "read_plan"]


class PlanError(ValueError):
    """A plan file that cannot be read; one line with the file, the place in it and what was expected."""


@dataclass(frozen=True)
class Plan:
    """What a plan file holds.

    `home` is the planned home: latitude, longitude [deg] and altitude above mean sea level [m]. `cruise_speed` and
    `hover_speed` [m/s] are what the planner reckoned with, wing-borne and hovering; nan where the file has none. A
    flight's speeds are those of its parameters and of DO_CHANGE_SPEED items, as with every ground station.
    """

    items: tuple[MissionItem, ...]
    home: tuple[float, float, float]
    polygons: tuple[FencePolygon, ...] = ()
    circles: tuple[FenceCircle, ...] = ()
    rally_points: tuple[RallyPoint, ...] = ()
    cruise_speed: float = math.nan
    hover_speed: float = math.nan


class _Simple(msgspec.Struct, tag="SimpleItem", rename="camel"):
    command: int
    frame: int
    params: tuple[
        float | None, float | None, float | None, float | None, float | None, float | None, float | None
    ]  # fmt: skip
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


_T = TypeVar("_T")


class _Mission(msgspec.Struct, rename="camel"):
    items: list[msgspec.Raw]
    planned_home_position: tuple[float, float, float]
    cruise_speed: float = math.nan
    hover_speed: float = math.nan


class _Polygon(msgspec.Struct):
    polygon: list[tuple[float, float]]
    inclusion: bool


class _Round(msgspec.Struct):
    center: tuple[float, float]
    radius: float


class _Circle(msgspec.Struct):
    circle: _Round
    inclusion: bool


class _Fence(msgspec.Struct):
    polygons: list[_Polygon] = []
    circles: list[_Circle] = []


class _Rally(msgspec.Struct):
    points: list[tuple[float, float, float]] = []


class _File(msgspec.Struct, rename="camel"):
    file_type: str
    mission: _Mission
    geo_fence: _Fence = msgspec.field(default_factory=_Fence)
    rally_points: _Rally = msgspec.field(default_factory=_Rally)


_FILE = msgspec.json.Decoder(_File)
_ITEM: "msgspec.json.Decoder[_Simple | _Complex]" = msgspec.json.Decoder(_Simple | _Complex)


@dataclass
class _Numbered:
    """Items as they are collected, with the numbers by which a file's jumps know them."""

    items: list[MissionItem] = field(default_factory=list[MissionItem])
    index_of: dict[int, int] = field(default_factory=dict[int, int])

    def add(self, item: MissionItem, jump_id: int | None) -> None:
        self.index_of.setdefault(len(self.items) + 1 if jump_id is None else jump_id, len(self.items))
        self.items.append(item)


def read_plan(path: Path | str) -> Plan:
    """Read a plan file; raises PlanError.

    Whether the mission can be flown, and the fence makes sense, is for those who load them to say.
    """
    path = Path(path)
    try:
        given = _decoded(path.read_bytes(), _FILE)
        if given.file_type != "Plan":
            _refuse("fileType", f"expected Plan, got {given.file_type}")
        items = _items([_decoded(item, _ITEM, f"mission.items[{i}]") for i, item in enumerate(given.mission.items)])
    except OSError as error:
        msg = f"{path}: cannot be read: {error.strerror}"
        raise PlanError(msg) from None
    except PlanError as error:
        msg = f"{path}: {error}"
        raise PlanError(msg) from None
    fence = given.geo_fence
    return Plan(
        items=tuple(items),
        home=given.mission.planned_home_position,
        polygons=tuple(FencePolygon(tuple(area.polygon), area.inclusion) for area in fence.polygons),
        circles=tuple(FenceCircle(*area.circle.center, area.circle.radius, area.inclusion) for area in fence.circles),
        rally_points=tuple(RallyPoint(*point) for point in given.rally_points.points),
        cruise_speed=given.mission.cruise_speed,
        hover_speed=given.mission.hover_speed,
    )


def _decoded(data: bytes | msgspec.Raw, decoder: "msgspec.json.Decoder[_T]", place: str = "") -> _T:
    """A part of the file, found at a place; raises PlanError."""
    try:
        return decoder.decode(data)
    except msgspec.ValidationError as error:
        problem, _, inside = str(error).partition(" - at `$")
        where = f"{place}{inside.rstrip('`')}".lstrip(".") or "file"
        _refuse(where, problem[:1].lower() + problem[1:])
    except msgspec.DecodeError as error:
        _refuse("file", f"expected JSON as QGroundControl saves it: {error}")


def _refuse(place: str, problem: str) -> NoReturn:
    msg = f"{place}: {problem}"
    raise PlanError(msg) from None


def _items(given: list[_Simple | _Complex]) -> list[MissionItem]:
    """All items in the order of flight, complex ones taken apart, jumps by the mission's own numbers."""
    collected = _Numbered()
    for number, entry in enumerate(given):
        if isinstance(entry, _Simple):
            collected.add(_item(entry), entry.do_jump_id)
        elif entry.transects is not None:
            for part in entry.transects.items:
                collected.add(_item(part), part.do_jump_id)
        elif entry.complex_item_type == "vtolLandingPattern":
            for item in _landing(number, entry):
                collected.add(item, None)
        else:
            _refuse(
                f"mission.items[{number}]: complex item {entry.complex_item_type}",
                "expected one with its items in the file, as surveys and corridor scans have, or a vtolLandingPattern",
            )
    return [_by_own_numbers(index, item, collected) for index, item in enumerate(collected.items)]


def _item(given: _Simple) -> MissionItem:
    values = [math.nan if value is None else value for value in given.params]
    return MissionItem(given.command, given.frame, *values, autocontinue=given.auto_continue)


def _by_own_numbers(index: int, item: MissionItem, collected: _Numbered) -> MissionItem:
    """A jump with the index of its target, which the file names by its doJumpId."""
    if item.command != Command.DO_JUMP:
        return item
    target = collected.index_of.get(int(item.param1)) if math.isfinite(item.param1) else None
    if target is None:
        _refuse(f"mission item {index}: jump", f"expected the doJumpId of an item, got {item.param1:g}")
    return replace(item, param1=float(target))


def _landing(number: int, given: _Complex) -> Iterator[MissionItem]:
    """What QGroundControl sends for its VTOL landing pattern."""
    approach, land = given.landing_approach_coordinate, given.land_coordinate
    if approach is None or land is None:
        _refuse(f"mission.items[{number}]", "expected landCoordinate and landingApproachCoordinate")
    frame = Frame.GLOBAL_RELATIVE_ALT if given.altitudes_are_relative else Frame.GLOBAL
    yield MissionItem(Command.DO_LAND_START, Frame.MISSION, param4=0.0)
    if given.stop_taking_photos:
        yield MissionItem(Command.DO_SET_CAM_TRIGG_DIST, Frame.MISSION, param4=0.0)
        yield MissionItem(Command.IMAGE_STOP_CAPTURE, Frame.MISSION)
    if given.stop_video_photos:
        yield MissionItem(Command.VIDEO_STOP_CAPTURE, Frame.MISSION)
    if given.use_loiter_to_alt:
        radius = given.loiter_radius if given.loiter_clockwise else -given.loiter_radius
        yield MissionItem(Command.LOITER_TO_ALT, frame, 1.0, radius, 0.0, 1.0, *approach)
    else:
        yield MissionItem(Command.WAYPOINT, frame, 0.0, 0.0, 0.0, math.nan, *approach)
    yield MissionItem(Command.VTOL_LAND, frame, 0.0, 0.0, 0.0, math.nan, *land)
