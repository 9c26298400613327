"""Finds MAVLink 1 and 2 frames in received bytes and checks them; whatever else is in there is counted and skipped."""

from functools import cache
from typing import NamedTuple

from fastcrc.crc16 import mcrf4xx

from sitl.mavlink.codec import MAGIC_V1, MAGIC_V2
from sitl.mavlink.dialect import tiltwing

__all__ = ["Frame", "FrameScanner", "sequence_of"]

_SIGNED = 0x01
_SIGNATURE = 13
# After so many false starts in one piece the rest of it is thrown away: each costs a checksum, and whoever sends
# megabytes of almost-frames must not take the flight's time.
_MAX_FALSE_STARTS = 32


class Frame(NamedTuple):
    """A frame whose checksum is right, or of a message that we do not know and therefore cannot check.

    The payload is as on the wire: trailing zeros may be cut. `raw` is the whole frame.
    """

    message: int
    system: int
    component: int
    payload: bytes
    raw: bytes
    is_known: bool = True


@cache
def _extras() -> dict[int, bytes]:
    """CRC_EXTRA of each message of the dialect, as the byte to append."""
    return {message_id: bytes((message.crc_extra,)) for message_id, message in tiltwing.mavlink_map.items()}


class FrameScanner:
    """Takes received bytes apart. One per peer, for it keeps the beginning of a frame that a stream has cut in two.

    Attributes:
        malformed: how often bytes were met that are no frame: noise, bad checksums, cut datagrams.
    """

    def __init__(self, *, is_stream: bool) -> None:
        """`is_stream`: frames may run over from one piece to the next (TCP); datagrams hold whole ones (UDP)."""
        self.malformed = 0
        self._is_stream = is_stream
        self._rest = b""
        self._extras = _extras()

    def scan(self, data: bytes) -> list[Frame]:
        """Frames in `data`, in order."""
        if self._rest:
            data = self._rest + data
            self._rest = b""
        frames: list[Frame] = []
        position, length, false_starts = 0, len(data), 0
        while position < length:
            end = self._frame_end(data, position, length)
            if end > length:
                if self._is_stream:
                    self._rest = data[position:]
                    return frames
                end = 0
            if end:
                frame = self._checked(data, position, end) or self._foreign(data, position, end, length)
                if frame is not None:
                    frames.append(frame)
                    position = end
                    continue
            self.malformed += 1
            false_starts += 1
            if false_starts > _MAX_FALSE_STARTS:
                return frames
            position = _next_magic(data, position + 1)
        return frames

    @staticmethod
    def _frame_end(data: bytes, start: int, length: int) -> int:
        """Where a frame that begins at `start` ends, beyond `length` if it is not all there; 0 if none begins."""
        magic = data[start]
        if magic == MAGIC_V2:
            if start + 3 > length:
                return length + 1
            flags = data[start + 2]
            if flags & ~_SIGNED:
                return 0  # incompatibility flags nobody has defined: must not be parsed
            return start + 12 + data[start + 1] + (_SIGNATURE if flags else 0)
        if magic == MAGIC_V1:
            return length + 1 if start + 2 > length else start + 8 + data[start + 1]
        return 0

    def _checked(self, data: bytes, start: int, end: int) -> Frame | None:
        """The frame from `start` to `end`, if its message is known and its checksum right."""
        message, sender, payload = _places(data, start)
        extra = self._extras.get(message)
        if extra is None:
            return None
        checksum = payload + data[start + 1]
        if mcrf4xx(data[start + 1 : checksum] + extra) != data[checksum] | data[checksum + 1] << 8:
            return None
        return Frame(message, data[sender], data[sender + 1], data[payload:checksum], data[start:end])

    def _foreign(self, data: bytes, start: int, end: int, length: int) -> Frame | None:
        """A frame of an unknown message, believed only if another frame or nothing follows it."""
        message, sender, payload = _places(data, start)
        if message in self._extras or not (end == length or data[end] in (MAGIC_V1, MAGIC_V2)):
            return None
        whole = data[payload : payload + data[start + 1]]
        return Frame(message, data[sender], data[sender + 1], whole, data[start:end], is_known=False)


def sequence_of(raw: bytes) -> int:
    """Sequence number of a whole frame."""
    return raw[4] if raw[0] == MAGIC_V2 else raw[2]


def _places(data: bytes, start: int) -> tuple[int, int, int]:
    """Message id of the frame at `start`, and where its sender's ids and its payload begin."""
    if data[start] == MAGIC_V2:
        return data[start + 7] | data[start + 8] << 8 | data[start + 9] << 16, start + 5, start + 10
    return data[start + 5], start + 3, start + 6


def _next_magic(data: bytes, start: int) -> int:
    """Next place where a frame could begin, or the end."""
    places = [place for place in (data.find(MAGIC_V2, start), data.find(MAGIC_V1, start)) if place >= 0]
    return min(places, default=len(data))
