"""Bad links, and a ground station that gets through them: it asks again when no answer comes, as the guide says.

https://mavlink.io/en/services/: what is asked again and how is each service's own matter. How long to wait is said
there for missions only (1.5 s, five times more), so the others are given as long.
"""

from collections.abc import Callable, Iterator
from typing import Any

from sitl.mavlink.dialect import tiltwing as mav
from tests.sitl.mavlink.ftp_client import HEADER, Answer, errors, opcodes
from tests.sitl.mavlink.in_memory import Desk

__all__ = ["BAD_LINKS", "PatientFtp", "PatientStation"]

BAD_LINKS = {
    "loss": {"loss": 0.3},
    "duplicates": {"duplicates": 0.3},
    "reordering": {"reordering": 0.5},
    "delay": {"delay": 0.5},
    "everything": {"loss": 0.3, "duplicates": 0.3, "reordering": 0.5, "delay": 0.5},
}
TIMEOUT = 1.5  # [s], wall time
RETRIES = 5
PATIENCE = 60  # tries of what the guide lets a client repeat as often as it likes


class PatientStation:
    """Asks again, with the same station, until an answer comes or it was asked often enough."""

    def __init__(self, desk: Desk, how: str, seed: int) -> None:
        self.desk = desk
        self.station = desk.join(100 + seed)
        for name, value in BAD_LINKS[how].items():
            setattr(self.station, name, value)

    def since(self, mark: int, name: str) -> Iterator[Any]:
        """Messages of a kind that came after the first `mark` messages."""
        return (message for message in self.station.received[mark:] if message.get_type() == name)

    def ask(
        self,
        send: Callable[[int], None],
        name: str,
        *,
        fits: Callable[[Any], bool] = lambda _: True,
        tries: int = 1 + RETRIES,
    ) -> Any:
        """The first fitting message of this name after `send`, called with the number of the try; None: none came."""
        mark = len(self.station.received)
        for number in range(tries):
            send(number)
            self.desk.wait_until(lambda: any(map(fits, self.since(mark, name))), TIMEOUT)
            for message in self.since(mark, name):
                if fits(message):
                    return message
        return None

    def command(self, command: int, *params: float, tries: int = PATIENCE) -> int | None:
        """Result of a COMMAND_LONG; while it is under way the station waits and, on silence, asks again."""
        mark = len(self.station.received)
        for number in range(tries):
            self.station.command(command, *params, confirmation=min(number, 255))
            seen = -1
            while seen < (seen := self._heard_of(command, mark)):
                self.desk.wait_until(lambda: self._heard_of(command, mark) > seen, TIMEOUT)  # noqa: B023  (called now)
                for ack in self.since(mark, "COMMAND_ACK"):
                    if ack.command == command and ack.result != mav.MAV_RESULT_IN_PROGRESS:
                        return ack.result
        return None

    def _heard_of(self, command: int, mark: int) -> int:
        return sum(ack.command == command for ack in self.since(mark, "COMMAND_ACK"))


class PatientFtp:
    """A client of MAVLink FTP: a request with the same number again on silence, gaps of a burst asked for again."""

    def __init__(self, patient: PatientStation) -> None:
        self._patient = patient
        self._sequence = 0

    def ask(self, opcode: int, data: bytes = b"", **options: Any) -> Answer:
        """The answer to one request; `options` are session, offset and size."""
        sequence = self._number()
        message = self._patient.ask(
            lambda _: self._send(sequence, opcode, data, **options),
            "FILE_TRANSFER_PROTOCOL",
            fits=lambda message: _answer(message)[:5:4] == ((sequence + 1) % 65536, opcode),
            tries=PATIENCE,
        )
        return _answer(message)

    def put(self, path: bytes, content: bytes) -> None:
        """Upload a file."""
        session = self.ask(opcodes.CREATE, path).session
        for offset in range(0, len(content), 239):
            answer = self.ask(opcodes.WRITE, content[offset : offset + 239], session=session, offset=offset)
            assert answer.opcode == opcodes.ACK, answer
        self.ask(opcodes.TERMINATE, session=session)

    def get(self, path: bytes) -> bytes:
        """Download a file by reads."""
        session = self.ask(opcodes.OPEN, path).session
        content = b""
        while (answer := self.ask(opcodes.READ, session=session, offset=len(content), size=239)).opcode == opcodes.ACK:
            content += answer.data
        assert answer.error == errors.EOF
        self.ask(opcodes.TERMINATE, session=session)
        return content

    def get_by_bursts(self, path: bytes) -> bytes:
        """Download a file by bursts, the first gap being asked for until there is none."""
        opened = self.ask(opcodes.OPEN, path)
        size = int.from_bytes(opened.data, "little")
        pieces: dict[int, bytes] = {}
        while (missing := next((at for at in range(0, size, 239) if at not in pieces), None)) is not None:
            mark = len(self._patient.station.received)
            self._send(self._number(), opcodes.BURST, session=opened.session, offset=missing, size=239)
            self._patient.desk.wait_until(lambda: self._is_complete(mark), TIMEOUT)  # noqa: B023  (called at once)
            for message in self._patient.since(mark, "FILE_TRANSFER_PROTOCOL"):
                answer = _answer(message)
                if answer.asked == opcodes.BURST and answer.opcode == opcodes.ACK:
                    pieces[answer.offset] = answer.data
        self.ask(opcodes.TERMINATE, session=opened.session)
        return b"".join(pieces[offset] for offset in sorted(pieces))

    def _number(self) -> int:
        self._sequence = (self._sequence + 1) % 65536
        return self._sequence

    def _send(
        self,
        sequence: int,
        opcode: int,
        data: bytes = b"",
        *,
        session: int = 0,
        offset: int = 0,
        size: int | None = None,
    ) -> None:
        length = len(data) if size is None else size
        payload = HEADER.pack(sequence, session, opcode, length, 0, 0, 0, offset) + data
        self._patient.station.send("FILE_TRANSFER_PROTOCOL", payload=list(payload))

    def _is_complete(self, mark: int) -> bool:
        answers = map(_answer, self._patient.since(mark, "FILE_TRANSFER_PROTOCOL"))
        return any(answer.asked == opcodes.BURST and answer.complete for answer in answers)


def _answer(message: Any) -> Answer:
    raw = bytes(message.payload)
    sequence, session, opcode, size, asked, complete, _, offset = HEADER.unpack_from(raw)
    return Answer(sequence, session, opcode, size, asked, complete, offset, raw[12 : 12 + size])
