"""Log streaming: a ULog file sent to a ground station as it is made, in flight or not.

MAV_CMD_LOGGING_START and _STOP; https://docs.px4.io/main/en/middleware/mavlink.html and the messages LOGGING_DATA,
LOGGING_DATA_ACKED and LOGGING_ACK of https://mavlink.io/en/messages/common.html. What a reader cannot do without, all
before the first data, goes in LOGGING_DATA_ACKED: one at a time, again and again until its LOGGING_ACK comes. The rest
goes in LOGGING_DATA as it comes; what a slow link leaves no room for is dropped, counted, and marked in the log.
"""

import struct
from collections.abc import Mapping
from typing import Any

from sitl.flight.refused import Refused
from sitl.flight_log.flight_log import FlightLog
from sitl.flight_log.ulog import FILE_HEADER_SIZE, dropout, message_starts
from sitl.mavlink.codec import codec
from sitl.mavlink.command import Command, CommandHandler, whole_number
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.links import Link, Messages
from sitl.mavlink.service import Exchange, Handler, Sender, Service

__all__ = ["LoggingStreamService"]

ULOG = 0  # the one format there is, parameter 1 of LOGGING_START
CONTENT = 249  # bytes of the log in one message
NO_START = 255  # no message of the log begins in this one
PERIOD = 0.02  # between turns while anybody is streamed to [s], wall time
ACK_TIMEOUT = 0.05  # after which a message is sent again [s]
MOST_TRIES = 50
ROOM = 256 << 10  # of what waits to be streamed to one client [bytes]
FASTEST = 2e6  # that a client is sent [bytes/s]
BATCH = 5  # messages that share a datagram
MOST_STREAMS = 8

_WIRE = struct.Struct(f"<HBBBB{CONTENT}s")  # sequence, target, length, first message, content: both messages are alike


class _Stream:
    """One client's log.

    Attributes:
        dropped: pieces for which there was no room.
        unacknowledged: payload that waits for its LOGGING_ACK; None: there is none.
    """

    def __init__(self, sender: Sender) -> None:
        self.sender = sender
        self.dropped = 0
        self.sequence = 0
        self.head = bytearray()
        self.unacknowledged: bytes | None = None
        self.tries = 0
        self.sent = 0.0  # when the unacknowledged message was sent last [s]
        self.credit = 0.0  # [bytes]
        self._head_start = self._start = 0  # where in `head` and `waiting` the next message of the log begins
        self.waiting = bytearray()
        self.refused: Messages = []  # by the socket
        self._gap_us: int | None = None  # since when pieces are dropped
        self.time_us = 0

    def begin(self, definitions: bytes) -> None:
        """These go first."""
        self.head += definitions
        self._head_start = FILE_HEADER_SIZE

    def take(self, data: bytes) -> None:
        """Whole messages of the log to be streamed."""
        if len(self.waiting) + len(data) > ROOM:
            self.dropped += 1
            if self._gap_us is None:
                self._gap_us = self.time_us
            return
        if self._gap_us is not None:
            self.waiting += dropout((self.time_us - self._gap_us) // 1000)
            self._gap_us = None
        self.waiting += data

    def next_head(self) -> bytes | None:
        """Payload of the next LOGGING_DATA_ACKED, None when all is said."""
        if not self.head:
            return None
        first, self._head_start = _first_message(self.head, self._head_start)
        # The header of the file is no message, but what begins the first one for a reader of streams.
        return self._cut(self.head, 0 if self.sequence == 0 else first)

    def next_data(self) -> bytes:
        """Payload of the next LOGGING_DATA."""
        first, self._start = _first_message(self.waiting, self._start)
        return self._cut(self.waiting, first)

    def _cut(self, source: bytearray, first: int) -> bytes:
        content = bytes(source[:CONTENT])
        del source[:CONTENT]
        sender, sequence = self.sender, self.sequence
        self.sequence = (sequence + 1) & 0xFFFF
        payload = _WIRE.pack(sequence, sender.system, sender.component, len(content), first, content)
        return payload.rstrip(b"\0") or b"\0"


def _first_message(source: bytearray, start: int) -> tuple[int, int]:
    """Where a message of the log begins in the next piece of `source`, and where the first one after that piece does.

    `start` is where the next message begins, both places count from the beginning of the piece and of what follows.
    """
    size = min(len(source), CONTENT)
    if start >= size:
        return NO_START, start - size
    return start, message_starts(source, start, size) - size


class LoggingStreamService(Service):
    """Streams the log to everybody who has asked for it."""

    def __init__(self, exchange: Exchange, log: FlightLog) -> None:
        """Stream `log` through `exchange`."""
        super().__init__(exchange)
        self._log = log
        self._acked, self._data = codec("LOGGING_DATA_ACKED"), codec("LOGGING_DATA")
        self._streams: dict[tuple[int, int, Link, object], _Stream] = {}
        self._is_awake = False
        self._turn = 0.0

    def messages(self) -> Mapping[str, Handler]:
        """See Service."""
        return {"LOGGING_ACK": self._on_ack}

    def commands(self) -> Mapping[int, CommandHandler]:
        """See Service."""
        return {mav.MAV_CMD_LOGGING_START: self._start, mav.MAV_CMD_LOGGING_STOP: self._stop}

    def restarted(self) -> None:
        """See Service: time is zero again, which no log can hold."""
        self._end_all("Log stream ended: the vehicle begins anew")

    def close(self) -> None:
        """See Service."""
        for key in list(self._streams):
            self._end(key)

    # -- requests --------------------------------------------------------------------------------------------------

    def _start(self, command: Command) -> None:
        kind, sender = command.params[0], command.sender
        if kind == kind and whole_number(kind) != ULOG:  # noqa: PLR0124  (not a number: unset)
            raise Refused(f"log format: expected {ULOG} (ULog), got {kind:g}")
        key = _key(sender)
        self._end(key)
        if len(self._streams) >= MOST_STREAMS:
            raise Refused(f"log stream: expected at most {MOST_STREAMS} at once", temporary=True)
        stream = self._streams[key] = _Stream(sender)
        stream.time_us = self.exchange.time_us
        stream.begin(self._log.follow(stream.take))
        if not self._is_awake:
            self._is_awake = True
            self._turn = self.exchange.wall_time
            self.exchange.after(0.0, self._work)  # once the command is acknowledged

    def _stop(self, command: Command) -> None:
        self._end(_key(command.sender))

    def _on_ack(self, message: Any, sender: Sender) -> None:
        stream = self._streams.get(_key(sender))
        if stream is None or stream.unacknowledged is None:
            return
        if message.sequence == (stream.sequence - 1) & 0xFFFF:
            stream.unacknowledged = None
            self._go_on_reliably(stream)

    # -- inside ----------------------------------------------------------------------------------------------------

    def _end(self, key: tuple[int, int, Link, object]) -> None:
        stream = self._streams.pop(key, None)
        if stream is not None:
            self._log.leave(stream.take)

    def _end_all(self, text: str) -> None:
        for key, stream in list(self._streams.items()):
            self._end(key)
            self.exchange.tell(stream.sender, mav.MAV_SEVERITY_WARNING, text)

    def _work(self) -> None:
        """One turn for all streams."""
        now = self.exchange.wall_time
        elapsed, self._turn = now - self._turn, now
        for key, stream in list(self._streams.items()):
            stream.time_us = self.exchange.time_us
            if stream.sender.peer not in stream.sender.link.peers:
                self._end(key)  # gone without a word
            elif stream.unacknowledged is not None or stream.head:
                if stream.unacknowledged is None:
                    self._go_on_reliably(stream)
                elif now - stream.sent >= ACK_TIMEOUT and not self._repeat(stream):
                    self._end(key)
                    text = f"Log stream ended: {MOST_TRIES} times no LOGGING_ACK {(stream.sequence - 1) & 0xFFFF}"
                    self.exchange.tell(stream.sender, mav.MAV_SEVERITY_WARNING, text)
            else:
                stream.credit = min(stream.credit + FASTEST * elapsed, FASTEST * PERIOD)
                self._send_data(stream)
        self._is_awake = bool(self._streams)
        if self._is_awake:
            self.exchange.after(PERIOD, self._work)

    def _go_on_reliably(self, stream: _Stream) -> None:
        """Send the next message that wants to be acknowledged, if there is one."""
        stream.unacknowledged = stream.next_head()
        stream.tries = 0
        if stream.unacknowledged is not None:
            self._repeat(stream)

    def _repeat(self, stream: _Stream) -> bool:
        """Send the message that waits for its acknowledgement; False if that was done often enough."""
        if stream.unacknowledged is None or stream.tries >= MOST_TRIES:
            return False
        stream.tries += 1
        stream.sent = self.exchange.wall_time
        stream.sender.link.send(stream.sender.peer, [(self._acked, stream.unacknowledged)])
        return True

    def _send_data(self, stream: _Stream) -> None:
        link, peer = stream.sender.link, stream.sender.peer
        if stream.refused:
            if not link.send(peer, stream.refused):
                return
            stream.refused = []
        while stream.waiting and stream.credit > 0.0:
            batch: Messages = []
            while stream.waiting and len(batch) < BATCH:
                batch.append((self._data, stream.next_data()))
            stream.credit -= len(batch) * CONTENT
            if not link.send(peer, batch):
                stream.refused = batch
                return


def _key(sender: Sender) -> tuple[int, int, Link, object]:
    return (sender.system, sender.component, sender.link, sender.peer.address)
