"""Lists and downloads a vehicle's logs by LOG_REQUEST_*. Source: MAVLink guide, messages/common, LOG_*.

A log comes in pieces of 90 bytes. It is asked for a window at a time; what got lost of a window is asked for again
before the next. What has come without a gap is kept when a download ends early, and the next one goes on from there.
"""

import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np

from gcs_scripts.connection import RETRY, Vehicle
from gcs_scripts.errors import RefusedError

__all__ = ["LogEntry", "download", "erase", "list_logs"]

PIECE = 90  # bytes of a full LOG_DATA
WINDOW = 8192  # pieces asked for at once: 720 kB
JOIN = 16  # pieces between two gaps that are at least worth it to ask for both as one
SHORTEST_WAIT, LONGEST_WAIT = 0.4, 2.0  # [s] without data after which it is asked for again; vehicles send in bursts
PATIENCE = 3.0  # times the usual wait for an answer
MEMORY = 0.05  # share of the latest in what a question is found to cost
MANY = 64  # pieces of an answer that tell how fast the vehicle sends
MAGIC = {b"ULog\x01\x12\x35": ".ulg", b"\xa3\x95\x80": ".bin"}  # PX4's ULog, ArduPilot's dataflash log
PART = ".part"


class LogEntry(NamedTuple):
    """One log: its id, when it was begun (UTC, seconds since 1970, 0 unknown) and its size in bytes."""

    id: int
    time_utc: int
    size: int

    @property
    def date(self) -> str:
        """When it was begun, as text."""
        return f"{datetime.fromtimestamp(self.time_utc, UTC):%Y-%m-%d %H:%M:%S}" if self.time_utc else "unknown"

    @property
    def name(self) -> str:
        """Name for a file, without ending."""
        return f"log_{self.id}_{datetime.fromtimestamp(self.time_utc, UTC):%Y-%m-%dT%H-%M-%SZ}_{self.size}"


def list_logs(vehicle: Vehicle) -> list[LogEntry]:
    """All logs, by id. Raises UnansweredError, LinkLostError."""
    found: dict[int, LogEntry] = {}
    total = None
    waited_since = time.monotonic()
    first, last = 0, 0xFFFF
    while total is None or len(found) < total:
        if time.monotonic() - waited_since > vehicle.timeout:
            part = "no LOG_ENTRY" if total is None else f"{len(found)} of {total}"
            raise vehicle.unanswered(f"system {vehicle.system} does not list its logs: {part}", vehicle.timeout)
        vehicle.send.log_request_list_send(vehicle.system, vehicle.component, first, last)
        while (entry := vehicle.receive("LOG_ENTRY", RETRY)) is not None:
            total = entry.num_logs
            if total == 0:
                return []
            if entry.id not in found:
                waited_since = time.monotonic()
            found[entry.id] = LogEntry(entry.id, entry.time_utc, entry.size)
            last = entry.last_log_num
            if len(found) == total:
                break
        first = next((i for i in range(last - (total or 0) + 1, last + 1) if i not in found), 0)
        first, last = max(first, 0), last if total else 0xFFFF
    return [found[i] for i in sorted(found)]


def erase(vehicle: Vehicle) -> tuple[int, int]:
    """Erase all logs; returns how many there were and are now. One that is begun at once may be among these.

    Raises RefusedError if the same logs are still there after the vehicle's timeout, UnansweredError, LinkLostError.
    """
    before = left = list_logs(vehicle)
    begin = time.monotonic()
    while _begun(left) == _begun(before) and left:
        if time.monotonic() - begin > vehicle.timeout:
            raise vehicle.refusal("to erase its logs", f"{len(left)} are left", begin)
        vehicle.send.log_erase_send(vehicle.system, vehicle.component)
        vehicle.listen(RETRY)
        left = list_logs(vehicle)
    return len(before), len(left)


def _begun(logs: list[LogEntry]) -> set[tuple[int, int]]:
    """What tells logs apart, though one of them may still be growing."""
    return {(entry.id, entry.time_utc) for entry in logs}


def download(vehicle: Vehicle, entry: LogEntry, folder: Path, progress: Callable[[int], None]) -> Path:
    """Fetch one log into a file of the folder; `progress` is told the number of bytes that are there.

    Returns the file. A file that is there already is not fetched again. Raises UnansweredError, LinkLostError, and
    RefusedError if the log turns out shorter than listed; OSError.
    """
    for ending in (*MAGIC.values(), ".log"):
        whole = folder / (entry.name + ending)
        if whole.exists() and whole.stat().st_size == entry.size:
            progress(entry.size)
            return whole
    folder.mkdir(parents=True, exist_ok=True)
    part = folder / (entry.name + PART)
    part.touch()
    with part.open("r+b") as file:
        transfer = _Transfer(vehicle, entry, file, progress)
        try:
            transfer.run()
        finally:
            file.truncate(transfer.without_gap())
            vehicle.send.log_request_end_send(vehicle.system, vehicle.component)
    with part.open("rb") as file:
        head = file.read(max(map(len, MAGIC)))
    whole = part.with_suffix(next((ending for magic, ending in MAGIC.items() if head.startswith(magic)), ".log"))
    return part.rename(whole)


class _Pace:
    """What a link has been found to take, which tells whether a question is dearer than data that are there already.

    Attributes:
        wait: without data after which is asked again [s].
    """

    def __init__(self) -> None:
        self.wait = SHORTEST_WAIT
        self._latency: float | None = None  # from a question to its first piece [s]
        self._question = self._rate = 0.0  # what one costs, also in vain [s]; pieces a second of an answer

    def learn(self, until_first: float | None, duration: float, pieces: int) -> None:
        """Take in one question: time to its first piece [s], None if none came, time it took in all, its pieces."""
        self._question += MEMORY * ((duration if until_first is None else until_first) - self._question)
        if until_first is not None:
            latency = until_first if self._latency is None else self._latency
            self._latency = latency + MEMORY * (until_first - latency)
            self.wait = min(max(PATIENCE * self._latency, SHORTEST_WAIT), LONGEST_WAIT)
            if pieces >= MANY and duration > until_first:
                self._rate = pieces / (duration - until_first)
        elif self._latency is None:  # the answer may still be under way
            self.wait = min(2.0 * self.wait, LONGEST_WAIT)

    @property
    def join(self) -> int:
        """Pieces between two gaps that are sent in less time than a question of its own for the second takes."""
        return int(min(max(JOIN, self._rate * self._question), WINDOW))


class _Transfer:
    """A download that is under way: which pieces of the log are in the file."""

    def __init__(self, vehicle: Vehicle, entry: LogEntry, file: BinaryIO, progress: Callable[[int], None]) -> None:
        self._vehicle, self._entry, self._file, self._progress = vehicle, entry, file, progress
        self._have = np.zeros(-(-entry.size // PIECE), dtype=bool)
        there = file.seek(0, 2) // PIECE  # pieces of an earlier download
        self._have[:there] = True
        self._count = int(self._have.sum())
        self._pace = _Pace()

    def without_gap(self) -> int:
        """Bytes at the beginning of the log that have come."""
        first = int(np.argmin(self._have)) if not self._have.all() else len(self._have)
        return min(first * PIECE, self._entry.size)

    def run(self) -> None:
        """Fetch what is missing."""
        self._progress(min(self._count * PIECE, self._entry.size))
        advanced = time.monotonic()
        while (span := self._next_span()) is not None:
            before = self._count
            self._ask(*span)
            if self._count > before:
                advanced = time.monotonic()
            elif time.monotonic() - advanced > self._vehicle.timeout:
                failure = f"system {self._vehicle.system} sends no more of log {self._entry.id}: no LOG_DATA"
                raise self._vehicle.unanswered(failure, self._vehicle.timeout)

    def _ask(self, first: int, end: int) -> None:
        """Ask for the pieces [first, end) and take what comes, until the last one has come or nothing comes."""
        vehicle = self._vehicle
        size = min(end * PIECE, self._entry.size) - first * PIECE
        vehicle.send.log_request_data_send(vehicle.system, vehicle.component, self._entry.id, first * PIECE, size)
        asked = latest = time.monotonic()
        until_first, pieces = None, 0
        while not self._have[end - 1] and (data := vehicle.receive("LOG_DATA", self._pace.wait)) is not None:
            latest = time.monotonic()
            until_first = latest - asked if until_first is None else until_first
            pieces += 1
            self._take(data)
        self._pace.learn(until_first, (latest if pieces else time.monotonic()) - asked, pieces)

    def _next_span(self) -> tuple[int, int] | None:
        """Pieces to ask for next, [first, end), or None when all are there."""
        start = self.without_gap() // PIECE
        missing = start + np.flatnonzero(~self._have[start : start + WINDOW])
        if len(missing) == 0:
            return None
        gaps = np.flatnonzero(np.diff(missing) > self._pace.join)
        last = missing[gaps[0]] if len(gaps) else missing[-1]
        return int(missing[0]), int(last) + 1

    def _take(self, data: Any) -> None:
        if data.id != self._entry.id or data.ofs % PIECE or data.ofs >= self._entry.size:
            return
        if data.count != min(PIECE, self._entry.size - data.ofs):
            end = data.ofs + data.count
            raise RefusedError(
                f"log {self._entry.id} ends after {end} of {self._entry.size} bytes: list the logs again"
            )
        piece = data.ofs // PIECE
        if not self._have[piece]:
            self._file.seek(data.ofs)
            self._file.write(bytes(data.data[: data.count]))
            self._have[piece] = True
            self._count += 1
            self._progress(min(self._count * PIECE, self._entry.size))
