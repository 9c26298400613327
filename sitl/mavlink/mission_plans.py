"""The three plans of a vehicle, as ground stations see them: mission, geofence and rally points, each with its id.

The flight holds what it flies by; here is what was sent, beside it, for as long as the flight holds just that. A plan
the flight has from elsewhere is made into items. What was uploaded is stored, and loaded again at the next start.
"""

import math
import struct
import zlib
from collections.abc import Sequence
from typing import Annotated, Any, NamedTuple

import msgspec

from sitl.flight.feasibility import Problem
from sitl.flight.flight import Flight
from sitl.flight.mission import InfeasibleMissionError
from sitl.flight.refused import Refused
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.mission_conversion import (
    FENCE,
    MISSION,
    RALLY,
    RETURN_POINT,
    InvalidPlanError,
    StoredItem,
    fence_areas,
    fence_items,
    mission_item,
    mission_items,
    rally_items,
    rally_points,
)
from sitl.mavlink.service import Exchange
from sitl.mavlink.state_folder import StateError

__all__ = ["KINDS", "Plan", "Plans"]

KINDS = {MISSION: "mission", FENCE: "fence", RALLY: "rally"}
FILE = "mission.json"

_PACKED = struct.Struct("<qq7dq")


class Plan(NamedTuple):
    """Items in the flight's numbers, and the opaque id by which ground stations notice a change; 0 without items."""

    items: tuple[StoredItem, ...] = ()
    id: int = 0


class _Held(NamedTuple):
    """A plan, what the flight has of it, and whether a ground station sent it."""

    contents: tuple[Any, ...]
    plan: Plan
    uploaded: bool


class _Item(msgspec.Struct, omit_defaults=True):
    """An item in the file; null is a parameter that is unset."""

    command: Annotated[int, msgspec.Meta(ge=0, le=0xFFFF)]
    frame: Annotated[int, msgspec.Meta(ge=0, le=0xFF)]
    params: tuple[float | None, float | None, float | None, float | None, float | None, float | None, float | None]
    autocontinue: Annotated[int, msgspec.Meta(ge=0, le=0xFF)] = 1


class _File(msgspec.Struct, omit_defaults=True):
    """What was uploaded; what was not is left out."""

    mission: list[_Item] | None = None
    fence: list[_Item] | None = None
    rally: list[_Item] | None = None


class Plans:
    """Mission, geofence and rally points, by MAV_MISSION_TYPE."""

    def __init__(self, exchange: Exchange) -> None:
        """Load what is stored, where the flight has nothing else."""
        self._exchange = exchange
        self._held: dict[int, _Held] = {}
        self._restore()

    @property
    def flight(self) -> Flight | None:
        """The flight, None with the autopilot off."""
        try:
            return self._exchange.simulation.flight
        except Refused:
            return None

    def offset(self, kind: int) -> int:
        """Number that stations give a plan's first item: 1 where missions begin with home."""
        return int(kind == MISSION and self._exchange.identity.mission_has_home)

    def count(self, kind: int) -> int:
        """How many items of a plan stations see, home among them unless there is nothing else."""
        items = self.plan(kind).items
        return len(items) + self.offset(kind) if items else 0

    def plan(self, kind: int) -> Plan:
        """The plan the flight has."""
        flight = self.flight
        if flight is None:
            return Plan()
        contents = _contents(flight, kind)
        held = self._held.get(kind)
        if held is not None and all(a is b for a, b in zip(held.contents, contents, strict=True)):
            return held.plan
        items = _encoded(contents, kind)
        plan = Plan(items, _opaque_id(kind, items))
        self._held[kind] = _Held(contents, plan, uploaded=False)
        return plan

    def store(self, kind: int, items: Sequence[StoredItem]) -> list[Problem]:
        """Replace a plan as a whole, and store it; returns what speaks against it, and then keeps the old one."""
        problems = self._load(kind, tuple(items))
        if not problems:
            self._write()
            if any(item.command == RETURN_POINT for item in items):
                text = "Geofence: the return point is kept but not flown to; rally points are"
                self._exchange.statustext(mav.MAV_SEVERITY_INFO, text)
        return problems

    def _load(self, kind: int, items: tuple[StoredItem, ...]) -> list[Problem]:
        flight = self.flight
        if flight is None:
            return [Problem(-1, "the autopilot is off")]
        try:
            if kind == MISSION:
                always = self._exchange.identity.mission_always_continues
                flight.load_mission(tuple(mission_item(item, always_continues=always) for item in items))
            elif kind == FENCE:
                flight.fence.load(*fence_areas(items))
            else:
                flight.rally.load(rally_points(items))
        except (InfeasibleMissionError, InvalidPlanError) as error:
            return error.problems
        except (ValueError, Refused) as error:
            return [Problem(-1, str(error))]
        self._held[kind] = _Held(_contents(flight, kind), Plan(items, _opaque_id(kind, items)), uploaded=True)
        return []

    # -- storage -------------------------------------------------------------------------------------------------------

    def _write(self) -> None:
        """Store what was uploaded, all in one file."""
        uploaded = {KINDS[kind]: held.plan.items for kind, held in self._held.items() if held.uploaded}
        file = _File(**{name: [_to_file(item) for item in items] for name, items in uploaded.items()})
        try:
            self._exchange.state.write(FILE, msgspec.json.encode(file))
        except StateError as error:
            self._exchange.statustext(mav.MAV_SEVERITY_WARNING, f"Mission not stored: {error}")

    def _restore(self) -> None:
        """Load what is stored: first the fence, inside which the mission must be."""
        warn = self._exchange.statustext
        try:
            data = self._exchange.state.read(FILE)
        except StateError as error:
            warn(mav.MAV_SEVERITY_WARNING, f"Mission not loaded: {error}")
            return
        if data is None or self.flight is None:
            return
        try:
            file = msgspec.json.decode(data, type=_File)
        except msgspec.DecodeError as error:
            self._set_aside(str(error))
            return
        for kind in (FENCE, RALLY, MISSION):
            items = getattr(file, KINDS[kind])
            if items is not None and not self.plan(kind).items:
                problems = self._load(kind, tuple(map(_from_file, items)))
                if problems:
                    warn(mav.MAV_SEVERITY_WARNING, f"Stored {KINDS[kind]} not loaded: {problems[0]}")

    def _set_aside(self, reason: str) -> None:
        text = f"{FILE}: {reason}"
        try:
            text += f"; kept as {self._exchange.state.set_aside(FILE)}"
        except StateError as error:
            text += f"; {error}"
        self._exchange.statustext(mav.MAV_SEVERITY_WARNING, text)


def _contents(flight: Flight, kind: int) -> tuple[Any, ...]:
    """What the flight has of a plan: objects that are others whenever the plan is another."""
    if kind == MISSION:
        return (flight.mission.items,)
    return (flight.fence.polygons, flight.fence.circles) if kind == FENCE else (flight.rally.points,)


def _encoded(contents: tuple[Any, ...], kind: int) -> tuple[StoredItem, ...]:
    if kind == MISSION:
        return mission_items(*contents)
    return fence_items(*contents) if kind == FENCE else rally_items(*contents)


def _opaque_id(kind: int, items: Sequence[StoredItem]) -> int:
    """A number made from the items: the same plan has the same one, and another plan most likely another."""
    if not items:
        return 0
    check = zlib.crc32(bytes((kind,)))
    for item in items:
        check = zlib.crc32(_PACKED.pack(*item), check)
    return check or 1


def _to_file(item: StoredItem) -> _Item:
    values = (item.param1, item.param2, item.param3, item.param4, item.x, item.y, item.z)
    return _Item(item.command, item.frame, values, item.autocontinue)


def _from_file(item: _Item) -> StoredItem:
    params = [math.nan if value is None else value for value in item.params]
    return StoredItem(item.command, item.frame, *params, autocontinue=item.autocontinue)
