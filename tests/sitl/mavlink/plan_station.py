"""Plans for tests, and a ground station that sends and fetches them as the MAVLink guide says, also on a bad link."""

import math
from collections.abc import Sequence
from typing import Any

from sitl.mavlink.codec import codec
from sitl.mavlink.dialect import tiltwing as mav
from tests.sitl.mavlink.in_memory import Desk, Station

__all__ = [
    "FENCE", "MISSION", "RALLY", "Transfer", "asked", "begin", "fence", "fetched", "give", "item",
    "jumping", "last", "mission", "rally", "same_items", "sent", "texts",
]  # fmt: skip

MISSION, FENCE, RALLY = mav.MAV_MISSION_TYPE_MISSION, mav.MAV_MISSION_TYPE_FENCE, mav.MAV_MISSION_TYPE_RALLY
FIELDS = ("command", "frame", "param1", "param2", "param3", "param4", "x", "y", "z", "autocontinue")
LATITUDE, LONGITUDE = 473977418, 85455939  # home of an ordinary flight [1e-7 deg]

Fields = dict[str, Any]


def item(command: int, north: float = 0.0, east: float = 0.0, z: float = 30.0, **fields: Any) -> Fields:
    """A MISSION_ITEM_INT's own fields, at a place about so many metres from home."""
    place = {"x": LATITUDE + round(north * 90.0), "y": LONGITUDE + round(east * 133.0), "z": z}
    given = {"command": command, "frame": mav.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT, "autocontinue": 1, **place, **fields}
    return {**dict.fromkeys(FIELDS, 0), **given}


def mission(waypoints: int = 3, *, radius: float = 200.0) -> list[Fields]:
    """Take-off, waypoints on a wavy line, landing."""
    takeoff = item(mav.MAV_CMD_NAV_VTOL_TAKEOFF, param4=math.nan)
    way = [
        item(mav.MAV_CMD_NAV_WAYPOINT, radius + 30.0 * i % 1500.0, radius * math.sin(0.5 * i), 40.0, param4=math.nan)
        for i in range(waypoints)
    ]
    return [takeoff, *way, item(mav.MAV_CMD_NAV_VTOL_LAND, z=0.0, param4=math.nan)]


def jumping() -> list[Fields]:
    """Two waypoints, flown twice."""
    way = [item(mav.MAV_CMD_NAV_WAYPOINT, north) for north in (30.0, 80.0, 120.0)]
    return [item(mav.MAV_CMD_NAV_TAKEOFF), *way[:2], item(177, frame=2, param1=1, param2=1), way[2]]


def fence(corners: int = 4, radius: float = 2000.0) -> list[Fields]:
    """A polygon to stay in, and a circle to stay out of."""
    frame, angles = mav.MAV_FRAME_GLOBAL, [2.0 * math.pi * i / corners for i in range(corners)]
    polygon = [
        item(5001, radius * math.cos(angle), radius * math.sin(angle), 0.0, frame=frame, param1=corners)
        for angle in angles
    ]
    return [*polygon, item(5004, -900.0, 900.0, 0.0, frame=frame, param1=50.0)]


def rally(points: int = 2) -> list[Fields]:
    return [item(mav.MAV_CMD_NAV_RALLY_POINT, 100.0 * i, -50.0) for i in range(points)]


def sent(station: Station, items: Sequence[Fields], kind: int = MISSION) -> Any:
    """Send a plan on a good link; returns the MISSION_ACK."""
    station.send("MISSION_COUNT", count=len(items), mission_type=kind)
    while True:
        answer = [m for m in station.received if m.get_type() in ("MISSION_REQUEST_INT", "MISSION_ACK")][-1]
        assert answer.mission_type == kind
        if answer.get_type() == "MISSION_ACK":
            return answer
        station.send("MISSION_ITEM_INT", seq=answer.seq, mission_type=kind, **items[answer.seq])


def fetched(station: Station, kind: int = MISSION) -> list[Fields]:
    """A plan fetched on a good link."""
    station.send("MISSION_REQUEST_LIST", mission_type=kind)
    items: list[Fields] = []
    for number in range(station.of("MISSION_COUNT")[-1].count):
        station.send("MISSION_REQUEST_INT", seq=number, mission_type=kind)
        message = station.of("MISSION_ITEM_INT")[-1]
        assert (message.seq, message.mission_type) == (number, kind)
        items.append({name: getattr(message, name) for name in FIELDS})
    station.send("MISSION_ACK", type=mav.MAV_MISSION_ACCEPTED, mission_type=kind)
    return items


def same_items(some: Sequence[Fields], others: Sequence[Fields]) -> bool:
    """Whether all fields are equal, as single-precision numbers, and NaN where NaN."""
    return [_packed(one) for one in some] == [_packed(one) for one in others]


def last(station: Station | Desk, *names: str) -> Any:
    """The latest message, of these kinds."""
    return [m for m in station.received if not names or m.get_type() in names][-1]


def asked(station: Station | Desk) -> list[tuple[str, int]]:
    """All requests for items, in order."""
    return [
        (m.get_type(), m.seq)
        for m in station.received
        if m.get_type() in ("MISSION_REQUEST_INT", "MISSION_REQUEST")
    ]  # fmt: skip


def texts(station: Station | Desk) -> str:
    """All status texts, long ones put together."""
    return "".join(("" if m.chunk_seq else "\n") + m.text for m in station.of("STATUSTEXT"))


def begin(station: Station | Desk, count: int, kind: int = MISSION) -> None:
    station.send("MISSION_COUNT", count=count, mission_type=kind)


def give(station: Station | Desk, number: int, fields: dict[str, Any], kind: int = MISSION) -> None:
    station.send("MISSION_ITEM_INT", seq=number, mission_type=kind, **fields)


def _packed(one: Fields) -> bytes:
    return codec("MISSION_ITEM_INT").payload_of(**one)


class Transfer:
    """One upload or download by the guide's rules: 1.5 s until a message is sent again, 5 times.

    `result` is the MAV_MISSION_RESULT in the end, or "timeout"; `items` what was fetched.
    """

    def __init__(self, station: Station, kind: int, items: Sequence[Fields] | None = None) -> None:
        self.station, self.kind, self.items = station, kind, list(items or [])
        self._uploads = items is not None
        self._count: int | None = None
        self.result: int | str | None = None
        self._seen = len(station.received)
        if items is None:
            self._say("MISSION_REQUEST_LIST")
        else:
            self._say("MISSION_COUNT", count=len(items))

    def run(self, timeout: float = 600.0) -> int | str:
        """Until it has ended; returns the result."""
        end = self.station.now + timeout
        while self.result is None:
            assert self.station.now < end, "the transfer never ends"
            self.station.await_news(0.1)
            self.step()
        return self.result

    def step(self) -> None:
        for message in self.station.received[self._seen :]:
            self._seen += 1
            if getattr(message, "mission_type", None) == self.kind and self.result is None:
                (self._take_up if self._uploads else self._take_down)(message)
        if self.result is None and self.station.now > self._again:
            if self._tries == 5:
                self.result = "timeout"
            else:
                self._tries += 1
                self._repeat()

    def _take_up(self, message: Any) -> None:
        if message.get_type() == "MISSION_ACK":
            self.result = message.type
        elif message.get_type() == "MISSION_REQUEST_INT":
            self._say("MISSION_ITEM_INT", seq=message.seq, **self.items[message.seq])

    def _take_down(self, message: Any) -> None:
        if message.get_type() == "MISSION_ACK":
            self.result = message.type
        elif message.get_type() == "MISSION_COUNT" and self._count is None:
            self._count = message.count
            self._next()
        elif message.get_type() == "MISSION_ITEM_INT" and message.seq == len(self.items) and self._count is not None:
            self.items.append({name: getattr(message, name) for name in FIELDS})
            self._next()

    def _next(self) -> None:
        if len(self.items) == self._count:
            self.result = mav.MAV_MISSION_ACCEPTED
            self._say("MISSION_ACK", type=mav.MAV_MISSION_ACCEPTED)
        else:
            self._say("MISSION_REQUEST_INT", seq=len(self.items))

    def _say(self, name: str, **fields: Any) -> None:
        self._last = (name, fields)
        self._tries = 0
        self._repeat()

    def _repeat(self) -> None:
        name, fields = self._last
        self.station.send(name, mission_type=self.kind, **fields)
        self._again = self.station.now + 1.5
