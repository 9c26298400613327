"""MAVLink FTP over a link that loses, doubles, delays and reorders, with two kinds of clients.

One does as the guide says: it repeats a request with its sequence number until an answer has come. The other does as
MAVSDK: it repeats with a new number, uses session 0 for everything, and looks at the answer to the latest request only.
"""

import heapq
import random
from collections.abc import Iterator
from itertools import count
from pathlib import Path

import pytest

from sitl.mavlink.links import Peer
from tests.sitl.mavlink.ftp_client import Answer, FtpClient, errors, opcodes
from tests.sitl.mavlink.in_memory import Desk, MemoryLink

LOSS, DOUBLED, LATEST = 0.3, 0.2, 0.5  # shares each way, and the longest delay [s]
RETRY = 0.4  # [s]
SECONDS = 3600.0  # of invented time that a transfer may take


class BadLink(MemoryLink):
    """Brings each datagram never, once or twice, each time after a delay of its own; all drawn from a seed."""

    def __init__(self, seed: int) -> None:
        super().__init__()
        self.random = random.Random(seed)
        self.now = 0.0
        self._numbers = count()
        self._way_in: list[tuple[float, int, Peer, bytes]] = []
        self._way_out: list[tuple[float, int, Peer, bytes]] = []

    def receive(self, wall_time: float) -> Iterator[tuple[Peer, bytes]]:
        self.now = wall_time
        while self.arrived:
            self._send(self._way_in, *self.arrived.popleft())
        while self._way_out and self._way_out[0][0] <= wall_time:
            _, _, peer, data = heapq.heappop(self._way_out)
            self.stations[peer].take(data)
        while self._way_in and self._way_in[0][0] <= wall_time:
            _, _, peer, data = heapq.heappop(self._way_in)
            yield peer, data

    def _transmit(self, peer: Peer, data: bytes) -> bool:
        self._send(self._way_out, peer, data)
        return True

    def _send(self, way: list[tuple[float, int, Peer, bytes]], peer: Peer, data: bytes) -> None:
        for _ in range(1 + (self.random.random() < DOUBLED)):
            if self.random.random() >= LOSS:
                due = self.now + self.random.uniform(0.0, LATEST)
                heapq.heappush(way, (due, next(self._numbers), peer, data))


class PatientClient(FtpClient):
    """Repeats requests with their sequence number."""

    def ask(self, opcode: int, data: bytes = b"", **options: int) -> Answer:  # type: ignore[override]
        sequence = self.sequence
        self.sequence = (sequence + 1) % 65536
        return self._answered(opcode, data, sequence, options, renumbers=False)

    def _answered(self, opcode: int, data: bytes, sequence: int, options: dict[str, int], *, renumbers: bool) -> Answer:
        end = self.desk.wall + SECONDS
        while self.desk.wall < end:
            self.request(opcode, data, sequence=sequence, **options)
            retry = self.desk.wall + RETRY
            while self.desk.wall < retry:
                self.desk.wait(0.005)
                for answer in self.answers():
                    if (answer.sequence, answer.asked) == ((sequence + 1) % 65536, opcode):
                        return answer
            if renumbers:
                sequence = self.sequence
                self.sequence = (sequence + 1) % 65536
        pytest.fail(f"no answer to {opcode}")


class MavsdkClient(PatientClient):
    """Repeats requests with a new sequence number, and ends paths with a zero."""

    def ask(self, opcode: int, data: bytes = b"", **options: int) -> Answer:  # type: ignore[override]
        sequence = self.sequence
        self.sequence = (sequence + 1) % 65536
        is_path = opcode in (opcodes.OPEN, opcodes.CREATE)
        options["session"] = 0
        return self._answered(opcode, data + b"\0" * is_path, sequence, options, renumbers=True)


@pytest.fixture(params=range(8))
def desk(request: pytest.FixtureRequest) -> Iterator[Desk]:
    made = Desk(links=[BadLink(request.param)])
    yield made
    made.close()


@pytest.mark.parametrize("kind", [PatientClient, MavsdkClient])
def test_every_transfer_ends_with_the_whole_file(desk: Desk, kind: type[PatientClient]) -> None:
    files: Path = desk.face.state.files
    client = kind(desk)
    for number in range(3):
        data = random.Random(number).randbytes(1500)
        name = f"/file{number}".encode()
        client.put(name, data)
        assert (files / f"file{number}").read_bytes() == data
        assert client.get(name) == data
        assert (files / f"file{number}").read_bytes() == data


def test_what_is_asked_for_once_happens_once(desk: Desk) -> None:
    files: Path = desk.face.state.files
    client = PatientClient(desk)
    for _ in range(3):
        client.done(opcodes.MAKE_DIRECTORY, b"/d")
        client.put(b"/d/a", b"12345")
        client.done(opcodes.RENAME, b"/d/a\0/d/b")
        client.done(opcodes.TRUNCATE, b"/d/b", offset=3)
        assert (files / "d" / "b").read_bytes() == b"123"
        client.done(opcodes.REMOVE, b"/d/b")
        client.done(opcodes.REMOVE_DIRECTORY, b"/d")
        assert list(files.iterdir()) == []


def test_a_refusal_arrives_as_one(desk: Desk) -> None:
    client = PatientClient(desk)
    assert client.ask(opcodes.OPEN, b"/missing").error == errors.NOT_FOUND
    assert client.ask(opcodes.READ, session=3, size=1).error == errors.SESSION
    assert client.ask(99).error == errors.UNKNOWN
