"""Status text: what the pilot should read, cut into as many messages as it needs."""

from itertools import count

from sitl.mavlink.codec import MessageCodec, codec

__all__ = ["StatusText"]

_CHUNK = 50  # bytes of text in one message


class StatusText:
    """Makes STATUSTEXT messages."""

    def __init__(self) -> None:
        """Number the long texts from 1."""
        self._codec = codec("STATUSTEXT")
        self._ids = count(1)

    def messages(self, severity: int, text: str) -> list[tuple[MessageCodec, bytes]]:
        """The messages that carry a text; more than one share an id and are numbered."""
        data = text.encode("utf-8", errors="replace")
        if len(data) <= _CHUNK:
            return [(self._codec, self._codec.payload((severity, data, 0, 0)))]
        text_id = (next(self._ids) - 1) % 0xFFFF + 1  # 1 to 65535; 0 is for short texts
        # A last piece that fills its message leaves no zero byte to end the text, so an empty one follows.
        starts = range(0, len(data) + (len(data) % _CHUNK == 0), _CHUNK)
        return [
            (self._codec, self._codec.payload((severity, data[start : start + _CHUNK], text_id, number)))
            for number, start in enumerate(starts)
        ]
