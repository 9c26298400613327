"""Burst reads of MAVLink FTP: much of a file for one request, as fast as the client takes it in.

UDP does not hold back a sender that is too fast, so a burst is no longer than what fits into the buffer of any client's
socket. The client asks for the next one once it has taken in this one, and so sets the pace itself. All bursts together
have a limit, so that files leave time for the flight; a TCP connection that takes no more for now is tried again.
"""

from collections import deque
from typing import Final

from sitl.mavlink.codec import codec
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.ftp_messages import FRAME, MOST_DATA, FtpError, Request, burst_part, refusal
from sitl.mavlink.ftp_open_files import OpenFile
from sitl.mavlink.ftp_sessions import Conversation
from sitl.mavlink.links import Messages
from sitl.mavlink.service import Exchange, Sender

__all__ = ["Bursts"]

LONGEST: Final = 64 << 10  # bytes of one burst on the wire: half of what a socket on Linux holds by default
RATE: Final = 32e6  # of all together [bytes per wall second]
PAUSE: Final = 0.002  # after which a socket that took nothing is tried again [s]
GIVEN_UP: Final = 2.0  # a burst of which no socket takes anything for so long is at its end [s]


class _Burst:
    """Part of an open file on its way to a client, from `offset` to `end`."""

    __slots__ = ("conversation", "end", "offset", "request", "sender", "sequence", "size", "taken")

    def __init__(self, request: Request, conversation: Conversation, sender: Sender, length: int, now: float) -> None:
        self.request = request
        self.conversation = conversation
        self.sender = sender
        self.size = request.size or MOST_DATA  # of the data in each message
        self.offset = request.offset
        self.end = min(request.offset + LONGEST // (FRAME + self.size) * self.size, length)
        self.sequence = request.sequence + 1
        self.taken = now  # when the socket took something last [s]

    @property
    def cost(self) -> int:
        """Bytes on the wire that are still to be sent."""
        return -(-(self.end - self.offset) // self.size) * (FRAME + self.size)

    def messages(self, data: bytes, offset: int, end: int) -> list[bytes]:
        """The payloads, without the fields before them, that bring data from an offset on."""
        sequence = self.sequence + (offset - self.offset) // self.size
        return [
            burst_part(
                self.request,
                sequence + number,
                offset + place,
                data[place : place + self.size],
                is_last=offset + place + self.size >= end,
            )
            for number, place in enumerate(range(0, len(data), self.size))
        ]


class Bursts:
    """Answers to burst reads, of all clients."""

    def __init__(self, exchange: Exchange) -> None:
        """Send through `exchange`."""
        self._exchange = exchange
        self._codec = codec("FILE_TRANSFER_PROTOCOL")
        self._allowance, self._allowance_at = float(LONGEST), exchange.wall_time
        self._waiting: deque[_Burst] = deque()

    def start(self, request: Request, conversation: Conversation, file: OpenFile, sender: Sender) -> None:
        """Answer a request; the very same one come again changes nothing while its burst is under way.

        Raises FtpError for an offset beyond the end, OSError for a file that cannot be read.
        """
        under_way = conversation.burst
        if isinstance(under_way, _Burst) and under_way.request == request:
            return
        conversation.burst = None
        file.read(request.offset, 0)
        if request.offset >= file.size:
            raise FtpError(mav.MAV_FTP_ERR_EOF)
        conversation.burst = burst = _Burst(request, conversation, sender, file.size, self._exchange.wall_time)
        self._wait_turn(burst)

    def _wait_turn(self, burst: _Burst) -> None:
        self._waiting.append(burst)
        if len(self._waiting) == 1:
            self._serve()

    def _serve(self) -> None:
        """Send the bursts that wait, in their order, as far as the allowance goes."""
        while self._waiting:
            wait = self._wait_for(self._waiting[0].cost)
            if wait > 0.0:
                self._exchange.after(wait, self._serve)
                return
            self._pour(self._waiting.popleft())

    def _pour(self, burst: _Burst) -> None:
        """Send a burst, or as much of it as the socket takes."""
        conversation, sender = burst.conversation, burst.sender
        if conversation.burst is not burst or conversation.file is None:
            return
        to = bytes((0, sender.system, sender.component))
        start = burst.offset
        try:
            data = conversation.file.read(start, burst.end - start)
        except OSError as error:
            conversation.burst = None
            body = burst.sequence.to_bytes(4, "little")[:2] + refusal(burst.request, error)
            sender.link.send(sender.peer, [(self._codec, to + body)])
            return
        end = start + len(data)
        at_once = max(1, sender.link.max_datagram // (FRAME + burst.size)) * burst.size
        for offset in range(start, end, at_once):
            some = data[offset - start : offset - start + at_once]
            frames: Messages = [(self._codec, (to + body).rstrip(b"\0")) for body in burst.messages(some, offset, end)]
            if not sender.link.send(sender.peer, frames):
                self._go_on_later(burst, offset)
                return
        conversation.burst = None

    def _go_on_later(self, burst: _Burst, offset: int) -> None:
        """The socket has taken what comes before this offset and no more."""
        now = self._exchange.wall_time
        if offset > burst.offset:
            burst.sequence += (offset - burst.offset) // burst.size
            burst.offset = offset
            burst.taken = now
        if now - burst.taken > GIVEN_UP:
            burst.conversation.burst = None
        else:
            self._exchange.after(PAUSE, lambda: self._wait_turn(burst))

    def _wait_for(self, cost: int) -> float:
        """Seconds until so many bytes may be sent; if that is at once they are taken from the allowance."""
        now = self._exchange.wall_time
        earned = (now - self._allowance_at) * RATE
        self._allowance, self._allowance_at = min(self._allowance + earned, float(LONGEST)), now
        if self._allowance < cost:
            return (cost - self._allowance) / RATE
        self._allowance -= cost
        return 0.0
