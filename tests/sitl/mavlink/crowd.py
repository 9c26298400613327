"""Ground stations on real sockets that count what they miss: by the sequence numbers of the frames that come."""

import contextlib
import socket
from collections.abc import Iterator

from sitl.mavlink.codec import codec
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.frames import FrameScanner, sequence_of

__all__ = ["Listener", "greeting", "request"]

HEARTBEAT = codec("HEARTBEAT")
COMMAND = codec("COMMAND_LONG")
VEHICLE = 1  # system id


def greeting(system: int) -> bytes:
    """A heartbeat of a ground station."""
    fields = {"type": mav.MAV_TYPE_GCS, "autopilot": mav.MAV_AUTOPILOT_INVALID, "mavlink_version": 3}
    return HEARTBEAT.frame(HEARTBEAT.payload_of(**fields), 0, system, 190)


def request(system: int, command: int, *params: float) -> bytes:
    """A COMMAND_LONG."""
    named = {f"param{number}": value for number, value in enumerate(params, start=1)}
    payload = COMMAND.payload_of(target_system=1, target_component=1, command=command, **named)
    return COMMAND.frame(payload, 1, system, 190)


class Listener:
    """One station; it greets as soon as it is there.

    Attributes:
        heard: frames of the vehicle that have come.
        missed: numbers that have not, between those that have.
    """

    def __init__(self, kind: str, port: int, system: int, *, receive_buffer: int = 1 << 20) -> None:
        """Connect by `udp` or `tcp` to a port on loopback."""
        self.system = system
        self.heard = self.missed = 0
        self._scanner = FrameScanner(is_stream=kind == "tcp")
        self._last: int | None = None
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_STREAM if kind == "tcp" else socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
        self.socket.connect(("127.0.0.1", port))
        self.socket.setblocking(False)
        self.socket.send(greeting(system))

    def listen(self) -> None:
        """Take in all that has come."""
        for data in self._pieces():
            for frame in self._scanner.scan(data):
                if frame.system != VEHICLE:  # what others have said is passed on, with numbers of their own
                    continue
                number = sequence_of(frame.raw)
                if self._last is not None:
                    self.missed += (number - self._last - 1) % 256
                self._last = number
                self.heard += 1

    def _pieces(self) -> Iterator[bytes]:
        with contextlib.suppress(BlockingIOError):
            while data := self.socket.recv(1 << 16):
                yield data
