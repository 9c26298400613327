"""How good a link is: messages and bytes a second, messages lost by the gaps in their numbers, time there and back.

Sources: MAVLink guide, guide/serialization (the sequence number, one count per component), services/timesync,
services/ping.
"""

import time
from collections import deque
from typing import Any

from gcs_scripts.connection import Vehicle

__all__ = ["Latency", "LinkQuality", "SequenceCounter"]

WINDOW = 10  # [s] that rates and losses are reckoned over
NUMBERS = 256  # of sequence numbers
ASK_INTERVAL = 1.0  # [s] between questions that tell the latency
KEPT_LATENCIES = 10
V1_MARKER = 0xFE


class SequenceCounter:
    """Counts the messages of one component and those that are missing between them.

    A message that comes late is taken back from the lost ones; one that comes twice is not counted. A jump by half of
    all numbers or more is taken for a late message, so a pause that long cannot be told from one.
    """

    def __init__(self) -> None:
        self.received = self.lost = 0
        self._last = -1
        self._missing: deque[int] = deque(maxlen=NUMBERS // 2)

    def add(self, number: int) -> None:
        """Take in a message's sequence number."""
        if self._last < 0:
            self._last, self.received = number, 1
            return
        ahead = (number - self._last) % NUMBERS
        if 0 < ahead < NUMBERS // 2:
            self._missing.extend((self._last + i) % NUMBERS for i in range(1, ahead))
            self.lost += ahead - 1
            self._last = number
            self.received += 1
        elif number in self._missing:
            self._missing.remove(number)
            self.lost -= 1
            self.received += 1


class LinkQuality:
    """What comes over a link, in total and by system; `add` is meant for `Vehicle.on_message`."""

    def __init__(self, now: float) -> None:
        """Begin at a time [s, monotonic]."""
        self._counters: dict[tuple[int, int], SequenceCounter] = {}
        self._bins: deque[tuple[float, dict[int, tuple[int, int]], int, int]] = deque()
        self._bytes = self._messages = 0
        self._mark(now)

    def add(self, message: Any) -> None:
        """Take in any message that pymavlink gives, with its header where it knows the message and without."""
        buffer = message.get_msgbuf()
        kind = message.get_type()
        if kind == "BAD_DATA" or len(buffer) < 6:
            return
        number, system, component = buffer[2:5] if buffer[0] == V1_MARKER else buffer[4:7]
        if kind.startswith("UNKNOWN") and (system, component) not in self._counters:
            return  # its checksum cannot be known, so it may be anybody's noise
        self._counters.setdefault((system, component), SequenceCounter()).add(number)
        self._bytes += len(buffer)
        self._messages += 1

    def update(self, now: float) -> None:
        """Let time pass [s, monotonic]: once a second or more often."""
        if now - self._bins[-1][0] >= 1.0:
            self._mark(now)
            while len(self._bins) > 2 and now - self._bins[1][0] >= WINDOW:
                self._bins.popleft()

    def rates(self, now: float) -> tuple[float, float]:
        """Messages and bytes a second of late."""
        begin, _, messages, size = self._bins[0]
        span = max(now - begin, 1e-3)
        return (self._messages - messages) / span, (self._bytes - size) / span

    def loss(self) -> dict[int, float]:
        """Share of the messages lost of late, by system."""
        before = self._bins[0][1]
        shares: dict[int, float] = {}
        for system, (received, lost) in self._by_system().items():
            received_before, lost_before = before.get(system, (0, 0))
            gone = max(lost - lost_before, 0)
            total = received - received_before + gone
            shares[system] = gone / total if total > 0 else 0.0
        return shares

    def _mark(self, now: float) -> None:
        self._bins.append((now, self._by_system(), self._messages, self._bytes))

    def _by_system(self) -> dict[int, tuple[int, int]]:
        sums: dict[int, tuple[int, int]] = {}
        for (system, _), counter in self._counters.items():
            received, lost = sums.get(system, (0, 0))
            sums[system] = (received + counter.received, lost + counter.lost)
        return sums


class Latency:
    """Time there and back, asked for by TIMESYNC, or by PING where that is not answered.

    Attributes:
        last: of the latest answer [s]; None before there is one.
    """

    def __init__(self, vehicle: Vehicle) -> None:
        self.last: float | None = None
        self.kept: deque[float] = deque(maxlen=KEPT_LATENCIES)
        self._vehicle = vehicle
        self._asked_at = -ASK_INTERVAL
        self._asked: dict[tuple[str, int], float] = {}  # message and stamp of open questions, when they were asked
        self._kind = "TIMESYNC"

    @property
    def least(self) -> float | None:
        """The least of the latest ten [s]: what the link needs when nobody is busy."""
        return min(self.kept, default=None)

    def update(self, now: float) -> None:
        """Ask again if it is time [s, monotonic]."""
        if now - self._asked_at < ASK_INTERVAL:
            return
        self._asked_at = now
        stamp = time.monotonic_ns()
        if self._kind == "TIMESYNC":
            self._vehicle.send.timesync_send(0, stamp)
        else:
            self._vehicle.send.ping_send(stamp, 0, 0, 0)
        self._asked = {key: at for key, at in self._asked.items() if now - at < WINDOW} | {(self._kind, stamp): now}
        if self.last is None:  # not answered yet: try the other one next
            self._kind = "PING" if self._kind == "TIMESYNC" else "TIMESYNC"

    def add(self, message: Any, now: float) -> None:
        """Take in a message of the vehicle; those that answer us tell the latency."""
        kind = message.get_type()
        if kind == "TIMESYNC" and message.tc1 != 0:
            stamp = message.ts1
        elif kind == "PING" and message.target_system == self._vehicle.own[0]:
            stamp = message.time_usec
        else:
            return
        asked = self._asked.pop((kind, stamp), None)
        if asked is not None:
            self.last = now - asked
            self.kept.append(self.last)
            self._kind = kind
