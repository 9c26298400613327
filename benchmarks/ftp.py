"""MAVLink FTP: a file down by burst reads and up by writes, beside what pymavlink's client makes of the same vehicle.

The client that can take it is a plain socket: it takes datagrams apart, copies what they bring to its place and asks
for the next burst when one is complete. It believes checksums, for the loopback flips no bits.
"""

import os
import socket
import struct
import tempfile
import time
from pathlib import Path

from fastcrc.crc16 import mcrf4xx
from figures import Figure
from pymavlink import mavftp, mavutil
from pymavlink.dialects.v20 import common
from vehicle import Vehicle

__all__ = ["measure"]

SIZE = 32 << 20  # of the file [bytes]
SMALL = 4 << 20  # for the ways that are slower
HEADER = struct.Struct("<HBBBBBBI")
FTP = 110
RESET, OPEN, CREATE, WRITE, BURST, TERMINATE, ACK = 2, 4, 6, 7, 15, 1, 128
CHUNK = 239
WINDOW = 32  # writes under way
SILENCE = 0.5  # after which a burst is asked for again [s]
EXTRA = bytes([common.MAVLink_file_transfer_protocol_message.crc_extra])


class Client:
    """A ground station that knows nothing but FTP."""

    def __init__(self, connection: socket.socket, *, is_stream: bool) -> None:
        """Talk over a connected socket."""
        self.socket = connection
        self.is_stream = is_stream
        self.sequence = 0
        self.rest = b""
        connection.settimeout(SILENCE)

    def request(
        self, opcode: int, data: bytes = b"", *, session: int = 0, offset: int = 0, size: int | None = None
    ) -> None:
        """Send one request."""
        length = len(data) if size is None else size
        header = HEADER.pack(self.sequence, session, opcode, length, 0, 0, 0, offset)
        self.sequence = (self.sequence + 1) & 0xFFFF
        payload = (b"\0\1\1" + header + data).rstrip(b"\0")
        body = struct.pack("<BBBBBBHB", len(payload), 0, 0, 0, 255, 190, FTP, 0) + payload
        self.socket.send(b"\xfd" + body + mcrf4xx(body + EXTRA).to_bytes(2, "little"))

    def answers(self) -> list[tuple[int, int, int, int, int, bytes]]:
        """Session, opcode, opcode answered, burst complete, offset and data of each answer in the next piece."""
        piece = self.rest + self.socket.recv(1 << 16)
        self.rest = b""
        found: list[tuple[int, int, int, int, int, bytes]] = []
        at, end = 0, len(piece)
        while at < end:
            if at + 12 > end or at + 12 + piece[at + 1] > end:
                self.rest = piece[at:] if self.is_stream else b""
                break
            length = piece[at + 1]
            if piece[at + 7] == FTP and not piece[at + 8]:
                payload = piece[at + 10 : at + 10 + length].ljust(3 + HEADER.size, b"\0")
                _, session, opcode, size, asked, complete, _, offset = HEADER.unpack_from(payload, 3)
                data = payload[3 + HEADER.size : 3 + HEADER.size + size].ljust(size, b"\0")
                found.append((session, opcode, asked, complete, offset, data))
            at += 12 + length
        return found

    def ask(self, opcode: int, data: bytes = b"", *, session: int = 0) -> tuple[int, bytes]:
        """Session and data that come of a request."""
        self.request(opcode, data, session=session)
        while True:
            for found_session, kind, asked, _, _, found in self.answers():
                if asked == opcode:
                    assert kind == ACK, f"request {opcode} refused: {found.hex()}"
                    return found_session, found

    def download(self, path: str) -> tuple[bytes, float]:
        """A file, and how long it took [s]."""
        session, length = self.ask(OPEN, path.encode())
        size = int.from_bytes(length, "little")
        content = bytearray(size)
        begin = time.perf_counter()
        taken = 0
        self.request(BURST, session=session, size=CHUNK)
        while taken < size:
            is_complete = False
            try:
                answers = self.answers()
            except TimeoutError:
                answers, is_complete = [], True
            for _, kind, asked, complete, offset, data in answers:
                if kind == ACK and asked == BURST and offset == taken:
                    content[offset : offset + len(data)] = data
                    taken = offset + len(data)
                    is_complete |= bool(complete)
            if is_complete and taken < size:
                self.request(BURST, session=session, offset=taken, size=CHUNK)
        elapsed = time.perf_counter() - begin
        self.ask(TERMINATE, session=session)
        return bytes(content), elapsed

    def upload(self, path: str, content: bytes) -> float:
        """Put a file there; how long it took [s]."""
        session, _ = self.ask(CREATE, path.encode())
        begin = time.perf_counter()
        waiting = {offset: content[offset : offset + CHUNK] for offset in range(0, len(content), CHUNK)}
        order = iter(list(waiting))
        under_way: set[int] = set()
        while waiting:
            while len(under_way) < WINDOW and (offset := next(order, None)) is not None:
                self.request(WRITE, waiting[offset], session=session, offset=offset)
                under_way.add(offset)
            for _, _, asked, _, offset, _ in self.answers():
                if asked == WRITE:
                    waiting.pop(offset, None)
                    under_way.discard(offset)
        elapsed = time.perf_counter() - begin
        self.ask(TERMINATE, session=session)
        return elapsed


def measure() -> list[Figure]:
    """Download over UDP and TCP, upload over UDP, and the download by pymavlink.mavftp."""
    content = os.urandom(SIZE)
    tcp_port, peer_port = _free_port(), _free_port()
    with tempfile.TemporaryDirectory() as state:
        files = Path(state, "files")
        files.mkdir()
        (files / "large.bin").write_bytes(content)
        (files / "small.bin").write_bytes(content[:SMALL])
        links = (f"--link=tcpin:{tcp_port}", f"--link=udpin:{peer_port}")
        with Vehicle(*links, "--state", state) as vehicle:
            _, _, source = vehicle.receive()
            own = vehicle.sockets[0]
            own.connect(source)
            client = Client(own, is_stream=False)
            client.ask(RESET)
            before = vehicle.cpu_seconds()
            down, elapsed = client.download("/large.bin")
            load = (vehicle.cpu_seconds() - before) / elapsed
            assert down == content
            udp = SIZE / elapsed / 1e6
            up = SMALL / client.upload("/up.bin", content[:SMALL]) / 1e6
            assert (files / "up.bin").read_bytes() == content[:SMALL]
            with socket.create_connection(("127.0.0.1", tcp_port)) as connection:
                connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                down, elapsed = Client(connection, is_stream=True).download("/large.bin")
            assert down == content
            tcp = SIZE / elapsed / 1e6
            peer = SMALL / _by_pymavlink(peer_port, content[:SMALL]) / 1e6
    return [
        Figure("FTP burst download, UDP", udp, "MB/s", goal=10.0, peer="by pymavlink.mavftp", peer_value=peer),
        Figure("FTP burst download, TCP", tcp, "MB/s", goal=10.0, peer="by pymavlink.mavftp", peer_value=peer),
        Figure("FTP upload, UDP, 32 writes under way", up, "MB/s"),
        Figure("load of the vehicle while it is downloaded from, UDP", load, "cores"),
    ]


def _by_pymavlink(port: int, content: bytes) -> float:
    """How long pymavlink's own client takes for the small file [s]."""
    master = mavutil.mavlink_connection(f"udpout:127.0.0.1:{port}", source_system=250, source_component=190)
    master.mav.heartbeat_send(6, 8, 0, 0, 0)
    master.wait_heartbeat(timeout=10)
    client = mavftp.MAVFTP(master, 1, 1)
    client.cmd_set(["burst_read_size", str(CHUNK)])
    with tempfile.TemporaryDirectory() as folder:
        there = Path(folder, "small.bin")
        begin = time.perf_counter()
        client.cmd_get(["/small.bin", str(there)])
        client.process_ftp_reply("OpenFileRO", timeout=60)
        elapsed = time.perf_counter() - begin
        assert there.read_bytes() == content
    master.close()
    return elapsed


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]
