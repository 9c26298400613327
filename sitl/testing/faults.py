"""What can happen to a MAVLink frame between client and vehicle, one class each.

A fault decides by counting: the n-th frame of a message in a direction meets the same fate in every run with the same
seed, whatever else is sent meanwhile and whenever it comes.
"""

import random
import struct
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from typing import Literal, NamedTuple, Self, get_args

__all__ = ["Delay", "Deny", "Direction", "Drop", "Duplicate", "Fault", "Passage", "Reorder", "Which", "split_frames"]

Direction = Literal["both", "to_vehicle", "to_client"]

_MAGIC_V1, _MAGIC_V2 = 0xFE, 0xFD
_SIGNED, _SIGNATURE = 0x01, 13
_NO_FRAME = -1
_COMMAND_INT, _COMMAND_LONG = 75, 76
_COMMAND_AND_TARGET = struct.Struct("<HBB")  # at the same place in both
_COMMAND_OFFSET = 28
_AUTOPILOT = 1  # MAV_COMP_ID_AUTOPILOT1


def split_frames(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Frames of a datagram, each with its message id; nothing but their lengths is looked at.

    From where no frame begins, the rest of the datagram is one piece with the id -1.
    """
    position, length = 0, len(data)
    while position < length:
        left = length - position
        magic = data[position]
        message, size = _NO_FRAME, left
        if magic == _MAGIC_V2 and left >= 12:
            size = 12 + data[position + 1] + (_SIGNATURE if data[position + 2] & _SIGNED else 0)
            message = int.from_bytes(data[position + 7 : position + 10], "little")
        elif magic == _MAGIC_V1 and left >= 8:
            size = 8 + data[position + 1]
            message = data[position + 5]
        if size > left:
            message, size = _NO_FRAME, left
        yield message, data[position : position + size]
        position += size


class Passage:
    """One frame on its way, and what faults have made of it.

    Attributes:
        message: its message id.
        frame: its bytes.
        to_vehicle: which way it goes.
        copies: how often it arrives.
        delay: wall time that it takes [s].
        behind: how many later frames overtake it.
        answer: command and MAV_RESULT of the COMMAND_ACK that the wire answers with.
    """

    __slots__ = ("answer", "behind", "copies", "delay", "frame", "message", "to_vehicle")

    def __init__(self, message: int, frame: bytes, *, to_vehicle: bool) -> None:
        self.message = message
        self.frame = frame
        self.to_vehicle = to_vehicle
        self.copies = 1
        self.delay = 0.0
        self.behind = 0
        self.answer: tuple[int, int] | None = None

    @property
    def sender(self) -> tuple[int, int]:
        """System and component id of the sender."""
        start = 5 if self.frame[0] == _MAGIC_V2 else 3
        return self.frame[start], self.frame[start + 1]

    def command(self) -> tuple[int, int, int] | None:
        """MAV_CMD, target system and target component of a COMMAND_LONG or COMMAND_INT, None for other messages."""
        if self.message not in (_COMMAND_INT, _COMMAND_LONG):
            return None
        start = 10 if self.frame[0] == _MAGIC_V2 else 6
        payload = self.frame[start : start + self.frame[1]].ljust(_COMMAND_OFFSET + 4, b"\0")  # zeros may be cut
        command, system, component = _COMMAND_AND_TARGET.unpack_from(payload, _COMMAND_OFFSET)
        return command, system, component


class Which(NamedTuple):
    """Which frames a fault strikes; `Wire` says what each means."""

    share: float
    messages: frozenset[int] | None
    direction: Direction
    limit: int | None


class Fault(ABC):
    """Something wrong with the wire, until `remove`, or to the end of a with block.

    Attributes:
        hits: how many frames it has struck.
    """

    stage = 0  # faults of a lower stage see a frame earlier

    def __init__(self, remove: Callable[["Fault"], None], seed: str, which: Which) -> None:
        """`remove` takes it off the wire; `seed` is its own. Raises ValueError for what no frame can be."""
        if not 0.0 <= which.share <= 1.0:
            msg = f"share: expected 0 to 1, got {which.share}"
            raise ValueError(msg)
        if which.direction not in get_args(Direction):
            msg = f"direction: expected one of {', '.join(get_args(Direction))}, got {which.direction!r}"
            raise ValueError(msg)
        if which.limit is not None and which.limit < 1:
            msg = f"count: expected at least 1, got {which.limit}"
            raise ValueError(msg)
        self.hits = 0
        self._remove = remove
        self._seed = seed
        self._which = which
        self._chances: dict[tuple[bool, int], random.Random] = {}

    def __enter__(self) -> Self:
        """Remove the fault at the end of a with block."""
        return self

    def __exit__(self, *_: object) -> None:
        """See __enter__."""
        self.remove()

    def remove(self) -> None:
        """Mend this fault; others stay."""
        self._remove(self)

    def strikes(self, passage: Passage) -> bool:
        """Whether this frame is meant; counts it if so."""
        if self.hits == self._which.limit or not self._concerns(passage):
            return False
        if self._which.share < 1.0 and self._chance(passage).random() >= self._which.share:
            return False
        self.hits += 1
        return True

    @abstractmethod
    def act(self, passage: Passage) -> None:
        """Do to the frame what is to be done."""

    def _concerns(self, passage: Passage) -> bool:
        direction, messages = self._which.direction, self._which.messages
        if direction != "both" and passage.to_vehicle != (direction == "to_vehicle"):
            return False
        return messages is None or passage.message in messages

    def _chance(self, passage: Passage) -> random.Random:
        """Random numbers of this message in this direction: telemetry between two answers changes no answer's fate."""
        key = (passage.to_vehicle, passage.message)
        if key not in self._chances:
            self._chances[key] = random.Random(f"{self._seed} {key}")
        return self._chances[key]


class Drop(Fault):
    """Frames are lost."""

    def act(self, passage: Passage) -> None:
        """See Fault."""
        passage.copies = 0


class Deny(Fault):
    """Commands for the vehicle are answered by the wire and do not arrive."""

    stage = 1  # a command that is lost is not answered

    def __init__(
        self,
        remove: Callable[[Fault], None],
        seed: str,
        which: Which,
        *,
        system: int,
        commands: frozenset[int] | None,
        result: int,
    ) -> None:
        """`system`: the vehicle's id; `commands`: None for all; `result`: MAV_RESULT of the answer."""
        super().__init__(remove, seed, which)
        self._system = system
        self._commands = commands
        self._result = result

    def act(self, passage: Passage) -> None:
        """See Fault."""
        command = passage.command()
        if command is not None:
            passage.copies = 0
            passage.answer = (command[0], self._result)

    def _concerns(self, passage: Passage) -> bool:
        command = passage.command() if super()._concerns(passage) else None
        return (
            command is not None
            and (self._commands is None or command[0] in self._commands)
            and command[1] in (0, self._system)
            and command[2] in (0, _AUTOPILOT)
        )


class Duplicate(Fault):
    """Frames arrive twice."""

    stage = 2

    def act(self, passage: Passage) -> None:
        """See Fault."""
        passage.copies += 1


class Reorder(Fault):
    """Frames are overtaken by the next ones."""

    stage = 2

    def __init__(self, remove: Callable[[Fault], None], seed: str, which: Which, *, behind: int) -> None:
        """`behind`: how many frames overtake."""
        super().__init__(remove, seed, which)
        if behind < 1:
            msg = f"behind: expected at least 1, got {behind}"
            raise ValueError(msg)
        self._behind = behind

    def act(self, passage: Passage) -> None:
        """See Fault."""
        passage.behind = max(passage.behind, self._behind)


class Delay(Fault):
    """Frames take time."""

    stage = 2

    def __init__(
        self, remove: Callable[[Fault], None], seed: str, which: Which, *, seconds: float, jitter: float
    ) -> None:
        """`seconds` of wall time, and up to `jitter` more."""
        super().__init__(remove, seed, which)
        for name, value in (("seconds", seconds), ("jitter", jitter)):
            if not 0.0 <= value < float("inf"):
                msg = f"{name}: expected wall seconds, 0 or more, got {value}"
                raise ValueError(msg)
        self._seconds = seconds
        self._jitter = jitter

    def act(self, passage: Passage) -> None:
        """See Fault."""
        passage.delay += self._seconds
        if self._jitter:
            passage.delay += self._jitter * self._chance(passage).random()
