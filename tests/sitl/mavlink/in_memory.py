"""A vehicle and ground stations in one process: the real simulation and face, on a link made of lists.

Wall time is invented: it moves with simulated time in `advance`, and alone in `wait`. So retries and timeouts of
minutes take no time, and every run is the same.
"""

import math
import random
import socket
from collections import deque
from collections.abc import Callable, Iterator
from typing import Any

from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.face import MavlinkFace
from sitl.mavlink.links import Link, LinkSpec, Peer
from sitl.mavlink.timers import Timers
from sitl.simulation import Simulation
from sitl.start import StartError

__all__ = ["Desk", "MemoryLink", "Station"]

TURN = 0.001  # of invented wall time while waiting [s]
SHORTEST_TURN = 1e-4  # what the vehicle wants to do at once again is as late as this [s]
OVERTAKING = 0.2  # by how much a datagram may be overtaken [s]


class MemoryLink(Link):
    """A link whose peers are stations in this process; what they have sent is taken in order."""

    def __init__(self, name: str = "memory", *, streams: str = "normal", trusted: bool = False) -> None:
        super().__init__(LinkSpec(name, "memory", name, 0, streams, trusted), 1, 1)
        self.stations: dict[Peer, Station] = {}
        self.arrived: deque[tuple[Peer, bytes]] = deque()

    @property
    def sockets(self) -> list[socket.socket]:
        return []

    @property
    def audience(self) -> list[Peer]:
        return list(self.stations)

    def receive(self, wall_time: float) -> Iterator[tuple[Peer, bytes]]:  # noqa: ARG002
        while self.arrived:
            yield self.arrived.popleft()

    def close(self) -> None:
        self.stations.clear()

    def _transmit(self, peer: Peer, data: bytes) -> bool:
        return self.stations[peer].take(data)


class Station:
    """A ground station: sends messages of our dialect, keeps what it has received.

    Attributes:
        received: messages decoded by pymavlink.
        full: its socket takes nothing.
        loss, duplicates: shares of the datagrams lost, or brought twice, each way; drawn from `random`.
        delay: how long each datagram takes, each way [s], invented wall time.
        reordering: share of the datagrams that take up to OVERTAKING longer, so that later ones overtake them.
    """

    def __init__(self, desk: "Desk", link: MemoryLink, system: int, component: int) -> None:
        self.mav = mav.MAVLink(None, srcSystem=system, srcComponent=component)
        self.mav.robust_parsing = True
        self.system, self.component = system, component
        self.received: list[Any] = []
        self.full = False
        self.loss = self.duplicates = self.delay = self.reordering = 0.0
        self.random = random.Random(system)
        self._desk, self._link = desk, link
        self.peer = Peer((f"station-{system}-{component}", 0), is_stream=False)
        link.stations[self.peer] = self

    @property
    def now(self) -> float:
        """Wall time [s]."""
        return self._desk.wall

    def await_news(self, timeout: float) -> None:
        """Let wall time pass until something more has come, for so long at most [s]."""
        before = len(self.received)
        self._desk.wait_until(lambda: len(self.received) > before, timeout)

    def take(self, data: bytes) -> bool:
        if self.full:
            return False
        self._carry(lambda: self.hear(data))
        return True

    def hear(self, data: bytes) -> None:
        """Keep the messages of a datagram that has come."""
        self.received += self.mav.parse_buffer(data) or []

    def send(self, name: str, **fields: Any) -> None:
        """Send a message by name; target fields are the vehicle's unless given, other fields left out are zero."""
        kind, ours = mav.mavlink_map[NAMES[name]], self._desk.face.system
        values: list[Any] = []
        for field, length, native in zip(kind.fieldnames, _lengths(kind), _kinds(kind), strict=True):
            default = {"target_system": ours, "target": ours, "target_component": 1}.get(field, 0)
            value = fields.pop(field, default if not length else b"" if native == "char" else [])
            if isinstance(value, str):
                value = value.encode()
            if length and native != "char":
                value = [*value, *[0] * (length - len(value))]
            values.append(value)
        assert not fields, f"{name} has no {fields}"
        self.send_bytes(kind(*values).pack(self.mav))
        self.mav.seq = (self.mav.seq + 1) % 256

    def send_bytes(self, data: bytes) -> None:
        """Send bytes as they are, and let the vehicle take them in."""
        self._carry(lambda: self._link.arrived.append((self.peer, data)))
        self._desk.turn()

    def of(self, name: str) -> list[Any]:
        """Messages of a kind that have come."""
        return [message for message in self.received if message.get_type() == name]

    @property
    def texts(self) -> list[str]:
        """Status texts that have come, long ones put together."""
        texts: list[str] = []
        for message in self.of("STATUSTEXT"):
            if message.id and message.chunk_seq:
                texts[-1] += message.text
            else:
                texts.append(message.text)
        return texts

    def command(self, command: int, *params: float, confirmation: int = 0, **target: int) -> Any:
        """Send a COMMAND_LONG, parameters left out unset (NaN); returns its COMMAND_ACK, None if there is none."""
        padded = [*params, *[math.nan] * (7 - len(params))]
        named = {f"param{number}": value for number, value in enumerate(padded, start=1)}
        before = len(self.of("COMMAND_ACK"))
        self.send("COMMAND_LONG", command=command, confirmation=confirmation, **named, **target)
        answers = self.of("COMMAND_ACK")[before:]
        return answers[-1] if answers else None

    def _carry(self, arrive: Callable[[], None]) -> None:
        """Have a datagram arrive as this link brings it: not at all, twice, later."""
        for _ in range(self._copies()):
            late = self.delay
            if self.reordering and self.random.random() < self.reordering:
                late += self.random.uniform(0.0, OVERTAKING)
            if late:
                self._desk.under_way.at(self._desk.wall + late, arrive)
            else:
                arrive()

    def _copies(self) -> int:
        if self.loss and self.random.random() < self.loss:
            return 0
        return 2 if self.duplicates and self.random.random() < self.duplicates else 1


class Desk:
    """One vehicle and the stations that talk to it; `station` is the first, and its methods are here too."""

    def __init__(
        self, simulation: Simulation | None = None, *, links: list[MemoryLink] | None = None, **face: Any
    ) -> None:
        self.simulation = Simulation() if simulation is None else simulation
        self.links = links or [MemoryLink()]
        self.face = MavlinkFace(self.links, self.simulation, unix_epoch=1.8e9, **face)
        self.simulation.listener = self.face.statustext
        self.wall = self.face.wall_time  # timers set while it was made count from there
        self.under_way = Timers()  # datagrams on slow links
        self.station = self.join()
        self.send, self.of, self.command = self.station.send, self.station.of, self.station.command
        self.face.attend(self.wall)
        self.publish()

    def join(self, system: int = 255, component: int = 190, link: int = 0) -> Station:
        """One more station."""
        return Station(self, self.links[link], system, component)

    @property
    def received(self) -> list[Any]:
        return self.station.received

    @property
    def texts(self) -> list[str]:
        return self.station.texts

    def turn(self) -> None:
        """Let the vehicle take in what has come, and begin anew if it was asked to."""
        self.under_way.run(self.wall)
        self.face.receive(self.wall)
        self.face.attend(self.wall)
        if self.face.restart_wanted is not None:
            try:
                self.simulation.restart(**self.face.restart_wanted)
            except StartError as error:
                self.face.restart_refused(str(error))
            else:
                self.face.restarted()

    def publish(self) -> None:
        self.face.publish(self.simulation.snapshot(), self.wall)

    def advance(self, seconds: float) -> None:
        """Fly so many simulated seconds; wall time passes as fast."""
        for _ in range(round(seconds * 50)):
            self.simulation.advance(0.02)
            self.wall += 0.02
            self.publish()
            self.turn()

    def wait(self, seconds: float) -> None:
        """Let only wall time pass."""
        for _ in range(round(seconds / TURN)):
            self.wall += TURN
            self.turn()

    def wait_until(self, condition: Callable[[], object], timeout: float) -> bool:
        """Let only wall time pass until a condition holds, from event to event; False if it does not in time [s]."""
        end = self.wall + timeout
        while not condition():
            if self.wall >= end:
                return False
            event = min(self.under_way.next_due, self.face.next_attention)
            self.wall = min(max(event, self.wall + SHORTEST_TURN), end)
            self.turn()
        return True

    def until(self, condition: Callable[[], object], timeout: float = 60.0) -> None:
        """Fly until a condition holds, for so many simulated seconds at most."""
        end = self.simulation.time + timeout
        while not condition():
            assert self.simulation.time < end, "the condition never came true"
            self.advance(0.1)

    def close(self) -> None:
        self.face.close()


NAMES = {message.msgname: number for number, message in mav.mavlink_map.items()}


def _lengths(kind: Any) -> list[int]:
    by_name = dict(zip(kind.ordered_fieldnames, kind.array_lengths, strict=True))
    return [by_name[name] for name in kind.fieldnames]


def _kinds(kind: Any) -> list[str]:
    return list(kind.fieldtypes)
