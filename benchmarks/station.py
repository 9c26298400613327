"""A ground station of a plain socket that packs and reads frames by precompiled structs: a client that can take it."""

import select
import socket
import time
from collections import Counter
from collections.abc import Callable, Iterator
from typing import Any

from sitl.mavlink.codec import MAGIC_V2, codec
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.frames import FrameScanner, sequence_of
from sitl.mavlink.signing import SIGNED

__all__ = ["Station", "free_port", "listen"]

VEHICLE = 1  # system id
BUFFER = 4 << 20


def free_port() -> int:
    """A port on loopback that nobody uses now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Station:
    """Connected to a port of the vehicle, over UDP or TCP; it greets as soon as it is there.

    Attributes:
        heard: frames of the vehicle that have come.
        missed: numbers of frames that have not, between those that have.
        signed: the latest of them had a signature.
        tally: counts what comes by message id, where somebody wants to know.
    """

    def __init__(self, port: int, kind: str = "udp", *, system: int = 255, receive_buffer: int = BUFFER) -> None:
        """Connect by `udp` or `tcp`."""
        self.system = system
        self.heard = self.missed = 0
        self.signed = False
        self.tally: Counter[int] | None = None
        self._watched: dict[int, Callable[[bytes], object]] = {}
        self._scanner = FrameScanner(is_stream=kind == "tcp")
        self._sequence = 0
        self._last: int | None = None
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_STREAM if kind == "tcp" else socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
        self.socket.connect(("127.0.0.1", port))
        self.socket.setblocking(False)
        self.greet()

    def greet(self) -> None:
        """A heartbeat of a ground station."""
        self.send("HEARTBEAT", type=mav.MAV_TYPE_GCS, autopilot=mav.MAV_AUTOPILOT_INVALID, mavlink_version=3)

    def send(self, name: str, **fields: Any) -> None:
        """A message to the vehicle."""
        packer = codec(name)
        targets = {"target_system": VEHICLE, "target_component": 1}
        fields = {field: value for field, value in targets.items() if field in packer.field_names} | fields
        frame = packer.frame(packer.payload_of(**fields), self._sequence, self.system, 190)
        self._sequence = (self._sequence + 1) & 0xFF
        self.socket.send(frame)

    def watch(self, name: str, take: Callable[[Any], object]) -> None:
        """Have a function called with every message of this name."""
        packer = codec(name)
        self._watched[packer.id] = lambda payload: take(packer.read(payload))

    def forget(self, name: str) -> None:
        """Have nothing called any more."""
        self._watched.pop(codec(name).id, None)

    def listen(self) -> None:
        """Take in what has come, without waiting."""
        for data in self._pieces():
            for frame in self._scanner.scan(data):
                if frame.system != VEHICLE:
                    continue  # of another station, passed on with its own numbers
                number = sequence_of(frame.raw)
                if self._last is not None:
                    self.missed += (number - self._last - 1) & 0xFF
                self._last = number
                self.heard += 1
                self.signed = frame.raw[0] == MAGIC_V2 and bool(frame.raw[2] & SIGNED)
                if self.tally is not None:
                    self.tally[frame.message] += 1
                take = self._watched.get(frame.message)
                if take is not None:
                    take(frame.payload)

    def until(self, condition: Callable[[], object], patience: float = 10.0) -> float:
        """Listen until a condition holds; returns how long that took [s]. Raises TimeoutError."""
        begin = time.perf_counter()
        while not condition():
            if time.perf_counter() > begin + patience:
                raise TimeoutError(f"{condition} did not come true within {patience} s")
            select.select([self.socket], (), (), 0.1)
            self.listen()
        return time.perf_counter() - begin

    def _pieces(self) -> Iterator[bytes]:
        while True:
            try:
                data = self.socket.recv(1 << 16)
            except (BlockingIOError, ConnectionRefusedError):
                return
            if not data:
                return
            yield data


def listen(stations: list[Station], seconds: float) -> None:
    """Have all of them listen for so long, and greet once a second, as ground stations do."""
    end, greeted = time.monotonic() + seconds, time.monotonic()
    by_socket = {station.socket: station for station in stations}
    while (now := time.monotonic()) < end:
        for ready in select.select(list(by_socket), (), (), 0.05)[0]:
            by_socket[ready].listen()
        if now - greeted >= 1.0:
            greeted = now
            for station in stations:
                station.greet()
