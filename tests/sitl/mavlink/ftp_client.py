"""A client of MAVLink FTP that sends what it is told, one request at a time, and pymavlink's client at a desk."""

import struct
from typing import Any, NamedTuple

from pymavlink import mavftp

from tests.sitl.mavlink.in_memory import Desk, Station

__all__ = ["Answer", "FtpClient", "errors", "opcodes", "pymavlink_client"]

HEADER = struct.Struct("<HBBBBBBI")


class opcodes:  # noqa: N801  (a list of names)
    """MAV_FTP_OPCODE."""

    NONE, TERMINATE, RESET, LIST, OPEN, READ, CREATE, WRITE, REMOVE, MAKE_DIRECTORY = range(10)
    REMOVE_DIRECTORY, OPEN_TO_WRITE, TRUNCATE, RENAME, CRC, BURST, LIST_WITH_TIME = range(10, 17)
    ACK, NAK = 128, 129


class errors:  # noqa: N801
    """MAV_FTP_ERR."""

    NONE, FAIL, FAIL_ERRNO, DATA_SIZE, SESSION, NO_SESSIONS, EOF, UNKNOWN, EXISTS, PROTECTED, NOT_FOUND = range(11)


class Answer(NamedTuple):
    """One answer, taken apart."""

    sequence: int
    session: int
    opcode: int
    size: int
    asked: int
    complete: int
    offset: int
    data: bytes

    @property
    def error(self) -> int:
        """Code of a NAK, 0 for an ACK."""
        return self.data[0] if self.opcode == opcodes.NAK else errors.NONE


class FtpClient:
    """Counts its requests and keeps the answers."""

    def __init__(self, desk: Desk, station: Station | None = None) -> None:
        self.desk = desk
        self.station = station or desk.station
        self.sequence = 0
        self._taken = 0

    def request(
        self,
        opcode: int,
        data: bytes = b"",
        *,
        session: int = 0,
        offset: int = 0,
        size: int | None = None,
        sequence: int | None = None,
    ) -> list[Answer]:
        """Send a request with the next sequence number, or this one; all answers that come at once."""
        if sequence is None:
            sequence = self.sequence
            self.sequence = (self.sequence + 1) % 65536
        length = len(data) if size is None else size
        payload = HEADER.pack(sequence, session, opcode, length, 0, 0, 0, offset) + data
        self.station.send("FILE_TRANSFER_PROTOCOL", payload=list(payload))
        return self.answers()

    def answers(self) -> list[Answer]:
        """Answers that have come since."""
        messages = self.station.of("FILE_TRANSFER_PROTOCOL")
        new = messages[self._taken :]
        self._taken = len(messages)
        found: list[Answer] = []
        for message in new:
            assert (message.target_system, message.target_component) == (self.station.system, self.station.component)
            raw = bytes(message.payload)
            sequence, session, opcode, size, asked, complete, padding, offset = HEADER.unpack_from(raw)
            assert padding == 0
            found.append(Answer(sequence, session, opcode, size, asked, complete, offset, raw[12 : 12 + size]))
        return found

    def ask(self, opcode: int, data: bytes = b"", **options: Any) -> Answer:
        """The one answer to a request; its numbers must be those of the request."""
        (answer,) = self.request(opcode, data, **options)
        expected = options.get("sequence", self.sequence - 1)
        assert (answer.sequence, answer.asked) == ((expected + 1) % 65536, opcode)
        return answer

    def done(self, opcode: int, data: bytes = b"", **options: Any) -> Answer:
        """As `ask`, for what must be acknowledged."""
        answer = self.ask(opcode, data, **options)
        assert answer.opcode == opcodes.ACK, answer
        return answer

    def listed(self, path: bytes = b"/", opcode: int = opcodes.LIST) -> list[bytes]:
        """All entries of a directory, page by page."""
        entries: list[bytes] = []
        while True:
            answer = self.ask(opcode, path, offset=len(entries))
            if answer.error == errors.EOF:
                return entries
            assert answer.opcode == opcodes.ACK, answer
            entries += answer.data.removesuffix(b"\0").split(b"\0")

    def put(self, path: bytes, content: bytes) -> None:
        """Upload a file."""
        session = self.done(opcodes.CREATE, path).session
        for offset in range(0, len(content), 239):
            self.done(opcodes.WRITE, content[offset : offset + 239], session=session, offset=offset)
        self.done(opcodes.TERMINATE, session=session)

    def get(self, path: bytes) -> bytes:
        """Download a file by single reads."""
        session = self.done(opcodes.OPEN, path).session
        content = b""
        while True:
            answer = self.ask(opcodes.READ, session=session, offset=len(content), size=239)
            if answer.error == errors.EOF:
                self.done(opcodes.TERMINATE, session=session)
                return content
            assert answer.opcode == opcodes.ACK, answer
            content += answer.data

    def get_by_bursts(self, path: bytes, each: int = 239) -> bytes:
        """Download a file by bursts."""
        session = self.done(opcodes.OPEN, path).session
        content = b""
        while True:
            parts = self.request(opcodes.BURST, session=session, offset=len(content), size=each)
            while not parts:
                self.desk.wait(0.001)
                parts = self.answers()
            if parts[0].error == errors.EOF:
                self.done(opcodes.TERMINATE, session=session)
                return content
            assert [part.complete for part in parts] == [0] * (len(parts) - 1) + [1]
            first = self.sequence
            assert [part.sequence for part in parts] == [(first + number) % 65536 for number in range(len(parts))]
            for part in parts:
                assert part.offset == len(content)
                content += part.data


class _Time:
    """The desk's invented wall clock in place of the module `time`."""

    def __init__(self, desk: Desk) -> None:
        self._desk = desk
        self._calls = 0

    def time(self) -> float:
        self._calls += 1  # between two calls some time passes: it divides by that
        return self._desk.wall + 1e-6 * self._calls

    def sleep(self, seconds: float) -> None:
        self._desk.wait(max(seconds, 0.001))


class _Master:
    """What pymavlink's client needs of a connection."""

    def __init__(self, desk: Desk, station: Station) -> None:
        self._desk, self._station = desk, station
        self.source_system, self.source_component = station.system, station.component
        self.mav = self

    def file_transfer_protocol_send(self, network: int, system: int, component: int, payload: bytearray) -> None:
        self._station.send(
            "FILE_TRANSFER_PROTOCOL",
            target_network=network,
            target_system=system,
            target_component=component,
            payload=list(payload),
        )

    def recv_match(self, type: object = None, blocking: bool = False, timeout: float = 0.0) -> Any:  # noqa: A002, ARG002
        end = self._desk.wall + timeout
        while True:
            for number, message in enumerate(self._station.received):
                if message.get_type() == "FILE_TRANSFER_PROTOCOL":
                    return self._station.received.pop(number)
            if self._desk.wall >= end:
                return None
            self._desk.wait(0.001)


def pymavlink_client(desk: Desk, monkeypatch: Any, station: Station | None = None) -> mavftp.MAVFTP:
    """pymavlink.mavftp at a desk, living in its invented wall time."""
    monkeypatch.setattr(mavftp, "time", _Time(desk))
    return mavftp.MAVFTP(_Master(desk, station or desk.station), 1, 1)
