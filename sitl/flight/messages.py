"""What the flight tells the pilot."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum

__all__ = ["Message", "Messages", "Severity"]

KEPT = 200


class Severity(IntEnum):
    """How grave a message is; numbers of MAVLink's MAV_SEVERITY."""

    EMERGENCY = 0
    ALERT = 1
    CRITICAL = 2
    ERROR = 3
    WARNING = 4
    NOTICE = 5
    INFO = 6
    DEBUG = 7


@dataclass(frozen=True, slots=True)
class Message:
    """One line, at a simulated time [s]."""

    time: float
    severity: Severity
    text: str


class Messages:
    """The latest messages, oldest first, and who is told of each at once.

    Attributes:
        time: simulated time [s] that the next message gets.
    """

    def __init__(self) -> None:
        self.time = 0.0
        self.kept: deque[Message] = deque(maxlen=KEPT)
        self.listeners: list[Callable[[Message], None]] = []

    def say(self, severity: int, text: str) -> None:
        """Tell the pilot."""
        message = Message(self.time, Severity(severity), text)
        self.kept.append(message)
        for listener in self.listeners:
            listener(message)
