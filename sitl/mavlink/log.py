"""Log transfer: lists the vehicle's flight logs and sends them in pieces of 90 bytes.

LOG_* of https://mavlink.io/en/messages/common.html; the guide has no page for them. Logs are numbered by age, from 0,
or from 1 where we look like ArduPilot, because ground stations take the numbers for places in their list. Each client's
numbers mean what it was listed at last, so that a new log or a deleted one never makes it fetch another one's data.

A request for data replaces the one that is being served, except one for other parts of the same log: some clients ask
for all the gaps that a link has left in one go. There is no feedback but those gaps, so who comes back for them is sent
less per second. Data go out in bursts that a usual socket buffer holds: a client too slow for them then misses the ends
of bursts, few large gaps instead of thousands of small ones.
"""

import struct
from collections import deque
from collections.abc import Mapping
from io import FileIO
from typing import Any

from sitl.flight.refused import Refused
from sitl.flight_log.flight_log import FlightLog
from sitl.flight_log.folder import LogFile
from sitl.mavlink.codec import codec
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.links import Link, Messages
from sitl.mavlink.service import Exchange, Handler, Sender, Service

__all__ = ["FASTEST", "PATIENCE", "LogService", "data_payload"]

PIECE = 90  # bytes of the log in one message
FULL_FRAME = 122  # of such a message, signed [bytes]
PERIOD = 0.0015  # between turns while there is something to send [s], wall time
SHARE = 16_000  # that all clients together are sent in one turn: a millisecond's work [bytes]
BURST = 64_000  # [bytes]
FASTEST, SLOWEST = 9e6, 0.25e6  # that a client is sent [bytes/s]
UNKNOWN = 4e6  # as long as nothing is known of it [bytes/s]; a stream holds up who is too fast by itself
USUAL_LOSS = 0.03  # share of what was sent that says nothing about the rate
SLOWER, FASTER = 0.5, 1.2  # times as fast, after gaps and after each QUIET time without any
QUIET = 0.5  # [s]
GAPS = 4 << 20  # that may wait behind each other [bytes]
MOST_RANGES = 256
MOST_CLIENTS = 32  # remembered
RESPITE = 0.01  # for a socket that is full [s]
PATIENCE = 10.0  # with one that takes nothing [s]

_DATA = struct.Struct(f"<IHB{PIECE}s")  # LOG_DATA on the wire: offset, id, count, data


def data_payload(log: int, offset: int, data: bytes) -> bytes:
    """Payload of a LOG_DATA, as its codec would make it of 90 numbers at many times the cost."""
    return _DATA.pack(offset, log, len(data), data).rstrip(b"\0") or b"\0"


class _Range:
    """A part of a log that is to be sent, [offset, end) [bytes].

    `is_bounded`: so much was asked for, not all there is from there on. `closes`: an empty message follows.
    """

    __slots__ = ("closes", "end", "is_bounded", "offset")

    def __init__(self, offset: int, end: int, *, is_bounded: bool, closes: bool) -> None:
        self.offset, self.end, self.is_bounded, self.closes = offset, end, is_bounded, closes


class _Client:
    """Who wants logs, and what is still to be sent there."""

    def __init__(self, sender: Sender) -> None:
        self.sender = sender
        self.listing: list[LogFile] | None = None
        self.entries: Messages = []
        self.ranges: deque[_Range] = deque()
        self.file: FileIO | None = None
        self.log = -1  # id of the log that the ranges are of
        self.asked: deque[tuple[int, int]] = deque(maxlen=MOST_RANGES)  # parts of it, [begin, end), at the present rate
        self.rate = FASTEST if sender.link.spec.kind.startswith("tcp") else UNKNOWN
        self.credit = float(BURST)  # that may be sent now [bytes]
        self.sent = self.lost = 0  # and asked for again, at the present rate [bytes]
        self.is_flowing = False  # in a burst
        self.earned = 0.0  # when credit was given [s]
        self.resumes = 0.0  # when its socket is tried again [s]
        self.taken = 0.0  # when its socket took something, or it asked for something [s]
        self.rated = 0.0  # when its rate changed [s]

    @property
    def is_busy(self) -> bool:
        return bool(self.entries or self.ranges)

    def earn(self, now: float) -> None:
        """Credit for the time since the last call. A burst begins when there is enough for it, or for what is left."""
        self.credit = min(self.credit + self.rate * (now - self.earned), BURST)
        self.earned = now
        left = sum(each.end - each.offset for each in self.ranges)
        self.is_flowing = self.is_flowing or self.credit >= min(BURST, max(left, 1))

    def note_request(self, wanted: _Range, now: float) -> None:
        """Slower from now on if it was sent much of this already, at the present rate, and has not got it.

        A little is always lost on some links, at any rate. From the beginning it is another download.
        """
        begin, end = wanted.offset, wanted.end
        if begin == 0:
            self.asked.clear()
        elif any(begin < asked_end and asked_begin < end for asked_begin, asked_end in self.asked):
            self.lost += end - begin
            if self.lost > USUAL_LOSS * self.sent:
                self.asked.clear()
                self.rate = max(SLOWER * self.rate, SLOWEST)
                self.rated = now
                self.sent = self.lost = 0
        self.asked.append((begin, end))

    def spend(self, size: int) -> None:
        """So many bytes are sent; the burst ends when there is no credit left."""
        self.credit -= size
        self.sent += size
        self.is_flowing = self.credit > 0.0

    def stop(self) -> None:
        """Send nothing more."""
        self.entries = []
        self.stop_data()

    def stop_data(self) -> None:
        self.ranges.clear()
        if self.file is not None:
            self.file.close()
            self.file = None


class LogService(Service):
    """LOG_REQUEST_LIST, LOG_REQUEST_DATA, LOG_REQUEST_END and LOG_ERASE."""

    def __init__(self, exchange: Exchange, log: FlightLog) -> None:
        """Serve the logs of `log` through `exchange`."""
        super().__init__(exchange)
        self._log = log
        self._entry, self._data = codec("LOG_ENTRY"), codec("LOG_DATA")
        self._clients: dict[tuple[int, int, Link, object], _Client] = {}
        self._is_awake = False

    def messages(self) -> Mapping[str, Handler]:
        """See Service."""
        return {
            "LOG_REQUEST_LIST": self._on_request_list,
            "LOG_REQUEST_DATA": self._on_request_data,
            "LOG_REQUEST_END": self._on_request_end,
            "LOG_ERASE": self._on_erase,
        }

    def close(self) -> None:
        """See Service."""
        for client in self._clients.values():
            client.stop()

    @property
    def _first_id(self) -> int:
        return 1 if self.exchange.identity.autopilot == mav.MAV_AUTOPILOT_ARDUPILOTMEGA else 0

    # -- requests --------------------------------------------------------------------------------------------------

    def _on_request_list(self, message: Any, sender: Sender) -> None:
        client = self._client(sender)
        if message.start <= self._first_id or client.listing is None:
            self._list(client)
        logs, first = client.listing or [], self._first_id
        last = first + len(logs) - 1
        entry = self._entry
        if logs:
            begin = min(max(message.start, first), last)
            end = min(max(message.end, begin), last)
            client.entries = [
                (entry, entry.payload_of(id=i, num_logs=len(logs), last_log_num=last, time_utc=log.utc, size=log.size))
                for i, log in enumerate(logs[begin - first : end - first + 1], begin)
            ]
        else:
            client.entries = [(entry, entry.payload_of())]
        self._wake(client)

    def _on_request_data(self, message: Any, sender: Sender) -> None:
        client = self._client(sender)
        if client.listing is None:
            self._list(client)
        offset, count = message.ofs, message.count
        size = self._open(client, message.id)
        end = min(offset + count, size)
        # Whoever asks for more than there is learns where the log ends from a message that is not full.
        is_bounded = offset + count <= size
        closes = offset >= size or count == 0 or not (is_bounded or (size - offset) % PIECE)
        wanted = _Range(offset, max(end, offset), is_bounded=is_bounded, closes=closes)
        if not self._may_wait(client, wanted):
            client.ranges.clear()
        client.note_request(wanted, self.exchange.wall_time)
        client.ranges.append(wanted)
        self._wake(client)

    def _on_request_end(self, _: Any, sender: Sender) -> None:
        self._client(sender).stop()

    def _on_erase(self, _: Any, sender: Sender) -> None:
        try:
            self._log.erase()
        except Refused as refused:
            self.exchange.tell(sender, mav.MAV_SEVERITY_WARNING, refused.reason[:1].upper() + refused.reason[1:])
            return
        for client in self._clients.values():
            client.stop()
            client.listing = None
        self.exchange.tell(sender, mav.MAV_SEVERITY_INFO, "Logs erased")

    # -- inside ----------------------------------------------------------------------------------------------------

    def _client(self, sender: Sender) -> _Client:
        key = (sender.system, sender.component, sender.link, sender.peer.address)
        client = self._clients.pop(key, None) or _Client(sender)
        client.sender = sender  # a peer that was forgotten comes back as another object
        while len(self._clients) >= MOST_CLIENTS:
            self._clients.pop(next(iter(self._clients))).stop()  # the one that has been silent longest
        self._clients[key] = client
        return client

    def _list(self, client: _Client) -> None:
        """Take down what logs there are now; the one being written counts with what is on the disk of it."""
        self._log.flush()
        client.listing = self._log.folder.logs()

    def _open(self, client: _Client, number: int) -> int:
        """Have the client's file be that of a log; returns its size now, 0 if there is no such log."""
        if client.log == number and client.file is not None:
            return client.file.seek(0, 2)
        client.stop_data()
        client.log = number
        client.asked.clear()
        logs, first = client.listing or [], self._first_id
        if not first <= number < first + len(logs):
            known = f"one of {len(logs)}, from {first}" if logs else "none, there are no logs"
            self.exchange.tell(client.sender, mav.MAV_SEVERITY_WARNING, f"Log {number}: expected {known}")
            return 0
        try:
            client.file = FileIO(logs[number - first].path)
            return client.file.seek(0, 2)
        except OSError as error:
            reason = error.strerror or str(error)
            self.exchange.tell(client.sender, mav.MAV_SEVERITY_WARNING, f"Log {number}: {reason}")
            return 0

    def _may_wait(self, client: _Client, wanted: _Range) -> bool:
        """Whether a range is one more gap to be filled, beside those that wait already."""
        ranges = client.ranges
        return (
            len(ranges) < MOST_RANGES
            and sum(each.end - each.offset for each in (*ranges, wanted)) <= GAPS
            and all(each.is_bounded for each in (*ranges, wanted))
            and all(wanted.end <= each.offset or each.end <= wanted.offset for each in ranges)
        )

    def _wake(self, client: _Client) -> None:
        """Something is to be sent: begin at once."""
        now = self.exchange.wall_time
        client.taken = now
        if not self._is_awake:
            self._is_awake = True
            self._work()

    def _work(self) -> None:
        """One turn: everybody gets a share."""
        now = self.exchange.wall_time
        busy = [client for client in self._clients.values() if client.is_busy]
        for client in busy:
            if now - client.rated >= QUIET:
                client.rate, client.rated = min(FASTER * client.rate, FASTEST), now
            client.earn(now)
            if now < client.resumes:
                continue
            if self._serve(client, SHARE // len(busy)):
                client.taken = now
            elif now - client.taken > PATIENCE:
                client.stop()
            else:
                client.resumes = now + RESPITE
        self._is_awake = any(client.is_busy for client in busy)
        if self._is_awake:
            self.exchange.after(PERIOD, self._work)

    def _serve(self, client: _Client, share: int) -> bool:
        """Send a client its share [bytes] of this turn; False if its socket does not take it."""
        link, peer = client.sender.link, client.sender.peer
        if client.entries:
            if not link.send(peer, client.entries):
                return False
            client.entries = []
        pieces = max(1, link.max_datagram // FULL_FRAME)
        while client.ranges and client.is_flowing and share > 0:
            wanted = client.ranges[0]
            data = self._read(client, wanted, pieces * PIECE)
            messages = self._messages(client.log, wanted.offset, data)
            if len(data) < min(pieces * PIECE, wanted.end - wanted.offset):  # the file has become shorter
                wanted.end, wanted.closes = wanted.offset + len(data), True
            if wanted.offset + len(data) >= wanted.end and wanted.closes:
                messages.append((self._data, data_payload(client.log, wanted.end, b"")))
            if not link.send(peer, messages):
                return False
            wanted.offset += len(data)
            share -= len(data) + PIECE
            client.spend(len(data) + PIECE)
            if wanted.offset >= wanted.end:
                client.ranges.popleft()
        return True

    def _read(self, client: _Client, wanted: _Range, most: int) -> bytes:
        if client.file is None or wanted.offset >= wanted.end:
            return b""
        try:
            client.file.seek(wanted.offset)
            return client.file.read(min(most, wanted.end - wanted.offset))
        except OSError:
            return b""

    def _messages(self, log: int, offset: int, data: bytes) -> Messages:
        packer = self._data
        return [(packer, data_payload(log, offset + i, data[i : i + PIECE])) for i in range(0, len(data), PIECE)]
