"""Ground stations that download logs, each in the way of a well-known one. Time is the desk's."""

from typing import Any

from sitl.flight_log.folder import LogFolder
from tests.sitl.mavlink.in_memory import Desk, Station

__all__ = ["PIECE", "all_gaps_at_once", "entries", "keep", "pieces", "put_together", "window_by_window"]

PIECE = 90
ALL = 0xFFFFFFFF
ROUNDS = 2000


def keep(desk: Desk, *contents: bytes) -> None:
    """Logs with these contents, one after the other."""
    folder = LogFolder(desk.face.state.logs)
    folder.path.mkdir(exist_ok=True)
    for content in contents:
        folder.next_path(1.7e9).write_bytes(content)


def entries(station: Desk | Station, start: int = 0, end: int = 0xFFFF) -> list[Any]:
    """The LOG_ENTRYs that are sent when they are asked for."""
    before = len(station.of("LOG_ENTRY"))
    station.send("LOG_REQUEST_LIST", start=start, end=end)
    return station.of("LOG_ENTRY")[before:]


def pieces(desk: Desk, station: Desk | Station, log: int, ofs: int, count: int, seconds: float = 0.5) -> list[Any]:
    """The LOG_DATAs that are sent within so much wall time."""
    before = len(station.of("LOG_DATA"))
    station.send("LOG_REQUEST_DATA", id=log, ofs=ofs, count=count)
    desk.wait(seconds)
    return station.of("LOG_DATA")[before:]


def put_together(messages: list[Any]) -> dict[int, bytes]:
    """What LOG_DATAs hold, by offset."""
    return {message.ofs: bytes(message.data[: message.count]) for message in messages}


def all_gaps_at_once(desk: Desk, station: Station, log: int) -> bytes:
    """As MAVProxy does: asks for all, and for up to 20 gaps in one go whenever nothing has come for 0.7 s."""
    station.send("LOG_REQUEST_DATA", id=log, ofs=0, count=ALL)
    for _ in range(ROUNDS):
        seen = -1
        while seen < (seen := len(station.of("LOG_DATA"))):
            desk.wait(0.7)
        have = put_together([message for message in station.of("LOG_DATA") if message.count])
        numbers = {offset // PIECE for offset in have}
        highest = max(numbers, default=-1)
        missing = sorted(set(range(highest)) - numbers)
        short = have and len(have[highest * PIECE]) < PIECE
        empty = any(message.count == 0 for message in station.of("LOG_DATA"))
        if not missing and (short or empty):
            return b"".join(have[number * PIECE] for number in range(highest + 1))
        if not missing:
            station.send("LOG_REQUEST_DATA", id=log, ofs=(highest + 1) * PIECE, count=ALL)
        for _ in range(20):
            if missing:
                first = last = missing.pop(0)
                while missing and missing[0] == last + 1:
                    last = missing.pop(0)
                station.send("LOG_REQUEST_DATA", id=log, ofs=first * PIECE, count=(last + 1 - first) * PIECE)
    raise AssertionError("it never came to an end")


def window_by_window(desk: Desk, station: Station, log: int, size: int, window: int = 512) -> bytes:
    """As MAVSDK and QGroundControl do: asks for so many pieces, then again for the first gap among them."""
    content = bytearray(size)
    for begin in range(0, size, window * PIECE):
        end = min(begin + window * PIECE, size)
        missing = set(range(begin, end, PIECE))
        for _ in range(ROUNDS):
            if not missing:
                break
            first = last = min(missing)
            while last + PIECE in missing:
                last += PIECE
            for message in pieces(desk, station, log, first, min(last + PIECE, end) - first, 0.05):
                if message.ofs in missing and message.count == min(PIECE, end - message.ofs):
                    content[message.ofs : message.ofs + message.count] = bytes(message.data[: message.count])
                    missing.discard(message.ofs)
        assert not missing, "it never came to an end"
    return bytes(content)
