"""What a vehicle says by STATUSTEXT: long texts put together from their chunks, the latest ones kept.

Source: MAVLink guide, messages/common, STATUSTEXT (fields `id` and `chunk_seq`).
"""

from collections import deque
from typing import Any, NamedTuple

from pymavlink.dialects.v20 import all as mav

__all__ = ["StatusTexts", "Text"]

KEPT = 200
CHUNK = 50  # characters of a full chunk; a shorter one ends the text


class Text(NamedTuple):
    """One text: MAV_SEVERITY, words, and when its last part came [s, monotonic]."""

    severity: int
    text: str
    time: float


class StatusTexts:
    """Texts in the order of their coming.

    Attributes:
        kept: the latest ones.
        count: how many there have been.
    """

    def __init__(self) -> None:
        self.kept: deque[Text] = deque(maxlen=KEPT)
        self.count = 0
        self._open: tuple[int, int] | None = None  # component and id of a text whose end has not come
        self._parts: dict[int, str] = {}
        self._severity = 0
        self._time = 0.0

    def add(self, message: Any, now: float) -> None:
        """Take in a STATUSTEXT. Of a text with a lost chunk what came is kept, a gap marked by dots."""
        if message.id == 0:
            self._close()
            self._keep(Text(message.severity, message.text, now))
            return
        key = (message.get_srcComponent(), message.id)
        if key != self._open:
            self._close()
            self._open, self._severity = key, message.severity
        self._parts[message.chunk_seq] = message.text
        self._time = now
        last = max(self._parts)
        if len(self._parts[last]) < CHUNK and len(self._parts) == last + 1:
            self._close()

    def since(self, count: int) -> list[Text]:
        """Those after the first `count`, as far as they are kept."""
        new = min(self.count - count, len(self.kept))
        return list(self.kept)[len(self.kept) - new :]

    def warnings_since(self, time: float) -> list[str]:
        """Words of those at least as grave as a warning that came at or after a time, each once."""
        self._close()
        grave = [t.text for t in self.kept if t.time >= time and t.severity <= mav.MAV_SEVERITY_WARNING]
        return list(dict.fromkeys(grave))

    def _close(self) -> None:
        if self._open is not None:
            whole = "".join(self._parts.get(i, "...") for i in range(max(self._parts) + 1))
            self._open, self._parts = None, {}
            self._keep(Text(self._severity, whole, self._time))

    def _keep(self, text: Text) -> None:
        self.kept.append(text)
        self.count += 1
