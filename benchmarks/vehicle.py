"""A running vehicle to measure: started as a person would, heard over UDP with the kernel's own arrival times."""

import socket
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

import psutil

__all__ = ["HEARTBEAT", "HIL_STATE_QUATERNION", "Vehicle", "altitude_msl", "frames", "sim_time"]

HEARTBEAT = 0
HIL_STATE_QUATERNION = 115
SO_TIMESTAMPNS = 35  # Linux; Python's socket module has no name for it
MAVLINK2 = 0xFD
PATIENCE = 60.0  # [s] to start, compilation of changed sources included


def frames(datagram: bytes) -> Iterator[tuple[int, bytes]]:
    """Message id and payload of each MAVLink 2 frame of a datagram."""
    at = 0
    while at + 12 <= len(datagram) and datagram[at] == MAVLINK2:
        length = datagram[at + 1]
        signature = 13 if datagram[at + 2] & 1 else 0
        yield int.from_bytes(datagram[at + 7 : at + 10], "little"), datagram[at + 10 : at + 10 + length]
        at += 12 + length + signature


def sim_time(payload: bytes) -> float:
    """Simulated time [s] of a HIL_STATE_QUATERNION, whose first field is time_usec."""
    return int.from_bytes(payload[:8], "little") * 1e-6


def altitude_msl(payload: bytes) -> float:
    """Altitude [m] of a HIL_STATE_QUATERNION."""
    return int.from_bytes(payload[44:48], "little", signed=True) * 1e-3


class Vehicle:
    """The vehicle's process, with sockets of ours where its links send to: `count`, or one per set of `streams`."""

    def __init__(self, *options: str, count: int = 1, streams: Sequence[str] = ()) -> None:
        """Start it with these command line options."""
        streams = streams or ("normal",) * count
        self.sockets = [_listener() for _ in streams]
        links = [
            f"--link=udpout:127.0.0.1:{s.getsockname()[1]},{name}"
            for s, name in zip(self.sockets, streams, strict=True)
        ]
        self.folder = tempfile.TemporaryDirectory()
        self._log = Path(self.folder.name, "log")
        self.started = time.time()
        with self._log.open("w") as log:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "sitl", *links, *options], cwd=self.folder.name, stdout=log, stderr=log
            )

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.process.terminate()
        try:
            self.process.wait(10.0)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        for s in self.sockets:
            s.close()
        self.folder.cleanup()

    def receive(self, index: int = 0) -> tuple[float, bytes, tuple[str, int]]:
        """Next datagram of a link: when it arrived [s, wall], its bytes, and from where.

        Raises RuntimeError with the vehicle's own words when nothing comes.
        """
        try:
            datagram, ancillary, _, source = self.sockets[index].recvmsg(65535, 64)
        except TimeoutError:
            raise RuntimeError(f"the vehicle is silent; it said:\n{self._log.read_text()}") from None
        for level, kind, data in ancillary:
            if (level, kind) == (socket.SOL_SOCKET, SO_TIMESTAMPNS):
                seconds, nanoseconds = struct.unpack("@ll", data)
                return seconds + nanoseconds * 1e-9, datagram, source
        return time.time(), datagram, source

    def messages(self, message_id: int, index: int = 0) -> Iterator[tuple[float, bytes, tuple[str, int]]]:
        """Payloads of one message as they come, with arrival time and source."""
        while True:
            arrival, datagram, source = self.receive(index)
            for identity, payload in frames(datagram):
                if identity == message_id:
                    yield arrival, payload, source

    def cpu_seconds(self) -> float:
        """CPU time of the process and its children so far [s]."""
        root = psutil.Process(self.process.pid)
        return sum(sum(p.cpu_times()[:2]) for p in [root, *root.children(recursive=True)])


def _listener() -> socket.socket:
    s = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    s.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4 << 20)
    if sys.platform == "linux":
        s.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
    s.bind(("127.0.0.1", 0))
    s.settimeout(PATIENCE)
    return s
