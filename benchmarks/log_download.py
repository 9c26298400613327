"""Downloads of a log from a running vehicle by LOG_REQUEST_DATA: bytes of the log per second, what got lost included.

The client that can take it is a plain socket with a large buffer that looks at headers only; its peer does the same
with pymavlink's own connection. Both ask for all of the log, then for the gaps.
"""

import os
import socket
import statistics
import struct
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from figures import Figure
from pymavlink import mavutil
from pymavlink.dialects.v20 import common
from vehicle import Vehicle, frames

__all__ = ["measure"]

SIZE = 24_000_000
PIECE = 90
ALL = 0xFFFFFFFF
LOG_DATA = 120
ROUNDS = 3
IDLE = 0.1  # without data, after which gaps are asked for [s]
MOST_GAPS = 20  # asked for at once
PATIENCE = 120.0  # [s]

Ask = Callable[[int, int], object]


class Download:
    """What has come of a log."""

    def __init__(self, ask: Ask) -> None:
        """Ask for all of it; `ask` takes offset and count."""
        self.content = bytearray(SIZE)
        self.missing = set(range(0, SIZE, PIECE))
        self._ask = ask
        ask(0, ALL)

    def take(self, offset: int, data: bytes) -> None:
        """One LOG_DATA."""
        if offset in self.missing:
            self.content[offset : offset + len(data)] = data
            self.missing.discard(offset)

    def fill_gaps(self) -> None:
        """Ask for some of what is missing."""
        gaps = sorted(self.missing)
        for _ in range(MOST_GAPS):
            if not gaps:
                return
            first = last = gaps.pop(0)
            while gaps and gaps[0] == last + PIECE:
                last = gaps.pop(0)
            self._ask(first, last + PIECE - first)


def by_socket(link: socket.socket, vehicle: tuple[str, int]) -> Download:
    """With a plain socket."""
    pack = common.MAVLink(None, srcSystem=255, srcComponent=190)
    link.settimeout(IDLE)
    download = Download(
        lambda ofs, count: link.sendto(common.MAVLink_log_request_data_message(1, 1, 0, ofs, count).pack(pack), vehicle)
    )
    header = struct.Struct("<IHB")
    end = time.monotonic() + PATIENCE
    while download.missing and time.monotonic() < end:
        idle = time.monotonic() + IDLE
        while download.missing and time.monotonic() < idle:
            try:
                datagram = link.recv(65535)
            except TimeoutError:
                break
            for identity, payload in frames(datagram):
                if identity == LOG_DATA:
                    offset, _, count = header.unpack(payload[:7].ljust(7, b"\0"))
                    download.take(offset, payload[7 : 7 + count].ljust(count, b"\0"))
                    idle = time.monotonic() + IDLE
        download.fill_gaps()
    return download


def by_pymavlink(link: mavutil.mavudp) -> Download:
    """With pymavlink's connection."""
    link.wait_heartbeat()
    download = Download(lambda ofs, count: link.mav.log_request_data_send(1, 1, 0, ofs, count))
    end = time.monotonic() + PATIENCE
    while download.missing and time.monotonic() < end:
        while (message := link.recv_match(type="LOG_DATA", blocking=True, timeout=IDLE)) is not None:
            download.take(message.ofs, bytes(message.data[: message.count]))
            if not download.missing:
                break
        download.fill_gaps()
    return download


def speed(content: bytes, run: Callable[[], Download]) -> float:
    """MB/s of one download; raises RuntimeError unless all of it has come."""
    begin = time.perf_counter()
    download = run()
    if bytes(download.content) != content:
        raise RuntimeError(f"{len(download.missing)} pieces of the log are missing or wrong")
    return SIZE / (time.perf_counter() - begin) / 1e6


def measure() -> list[Figure]:
    """Megabytes per second of both clients."""
    content = os.urandom(SIZE)
    with tempfile.TemporaryDirectory() as folder:
        logs = Path(folder, "logs")
        logs.mkdir()
        (logs / "log_1_2026-03-06-12-00-00.ulg").write_bytes(content)
        with Vehicle(f"--state={folder}", count=2) as vehicle:
            _, _, source = vehicle.receive(0)
            vehicle.receive(1)
            port = vehicle.sockets[1].getsockname()[1]
            vehicle.sockets[1].close()
            peer = mavutil.mavlink_connection(f"udpin:127.0.0.1:{port}", source_system=254, dialect="common")
            ours: list[float] = []
            theirs: list[float] = []
            for _ in range(ROUNDS):
                ours.append(speed(content, lambda: by_socket(vehicle.sockets[0], source)))
                theirs.append(speed(content, lambda: by_pymavlink(peer)))
            peer.close()
    return [
        Figure("LOG_DATA to a plain socket", statistics.median(ours), "MB/s", goal=3.0,
               peer="a client on pymavlink", peer_value=statistics.median(theirs)),
    ]  # fmt: skip
