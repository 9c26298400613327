"""Who talks to MAVLink FTP: clients, their sessions, and which request is a repetition of an earlier one.

https://mavlink.io/en/services/ftp.html. A request with the sequence number of the latest one is a retransmission: its
answer was lost and is given again. Clients differ in the rest. MAVProxy names its sessions itself and counts each from
zero; pymavlink counts through all of them; MAVSDK uses session 0 for everything, whatever it is given, and repeats with
a new sequence number. So every session number of a client has a memory of its own, a session gets the number that its
client asks for whenever that is free, and a network that delays or doubles requests finds those that change something
remembered for a while.
"""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final, NamedTuple

from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.ftp_files import Entry
from sitl.mavlink.ftp_messages import SEQUENCES, FtpError, Request
from sitl.mavlink.ftp_open_files import OpenFile
from sitl.mavlink.service import Sender

__all__ = ["Client", "Clients", "Conversation"]

SESSIONS_EACH: Final = 8  # open at a time, of one client
SESSIONS: Final = 32  # of all together
CLIENTS: Final = 64
MEMORIES: Final = 64  # session numbers of one client that are remembered
LONG_SILENT: Final = 30.0  # a session nobody asks anything of for so long may be given to another [s], wall time
RETRANSMITTED: Final = 5.0  # a retransmission of the latest request comes within this time of the last one [s]
DELAYED: Final = 1.5  # and what the network delays or doubles within this [s]
OVERTAKEN: Final = 64  # most requests that can overtake another
PATIENCE: Final = 0.3  # who asks again for the same thing after so long has not heard the answer [s]
STALLED: Final = 2.0  # a session at which nothing new is asked for so long has been given up [s]
JUST_ENDED: Final = 10.0  # in which a client may ask again to terminate a session [s]

# Requests that are not to be carried out twice.
CHANGES: Final = frozenset({
    mav.MAV_FTP_OPCODE_TERMINATESESSION, mav.MAV_FTP_OPCODE_OPENFILERO, mav.MAV_FTP_OPCODE_CREATEFILE,
    mav.MAV_FTP_OPCODE_REMOVEFILE, mav.MAV_FTP_OPCODE_CREATEDIRECTORY, mav.MAV_FTP_OPCODE_REMOVEDIRECTORY,
    mav.MAV_FTP_OPCODE_OPENFILEWO, mav.MAV_FTP_OPCODE_TRUNCATEFILE, mav.MAV_FTP_OPCODE_RENAME,
})  # fmt: skip


class _Answered(NamedTuple):
    """A request that was answered, and how: the answer without its sequence number."""

    request: Request
    time: float
    answer: bytes


class _Opened(NamedTuple):
    """The request that opened a session."""

    request: Request
    time: float


@dataclass(slots=True)
class Conversation:
    """What was said under one session number of a client, and the file that is open under it.

    Attributes:
        number: of the session.
        file: that is open, None: the session is not.
        opened: the request that opened it.
        used: something has been asked of the open file.
        renumbers: the client that opened it repeats requests with new sequence numbers.
        ended: when it was terminated [s].
        heard: when the latest request came [s].
        progressed: when the latest one came that is not the one before again [s].
        burst: the burst under way, for whoever sends it.
        listing: the directory listed last, its path and when.
    """

    number: int
    file: OpenFile | None = None
    opened: _Opened | None = None
    used: bool = False
    renumbers: bool = False
    ended: float = -1e9
    heard: float = 0.0
    progressed: float = 0.0
    burst: object = None
    listing: tuple[str, float, list[Entry]] | None = None
    _answered: deque[_Answered] = field(default_factory=lambda: deque[_Answered](maxlen=16))
    _latest: bytes = b""

    def hear(self, request: Request, now: float) -> None:
        """Take note of a request."""
        if request.text != self._latest:
            self.progressed = now
            self._latest = request.text
        self.heard = now

    def answer_again(self, request: Request, now: float) -> bytes | None:
        """The answer to give again, if this request or its effect has been answered already."""
        if not self._answered:
            return None
        latest = self._answered[-1]
        if latest.request == request and now - latest.time < RETRANSMITTED:
            self._answered[-1] = latest._replace(time=now)
            return latest.answer
        if request.opcode in CHANGES:
            for request_before, time, answer in reversed(self._answered):
                ahead = (request_before.sequence - request.sequence) % SEQUENCES
                if request_before.text == request.text and ahead <= OVERTAKEN and now - time < DELAYED:
                    return answer
        return None

    def remember(self, request: Request, answer: bytes, now: float) -> None:
        """Keep an answer."""
        self._answered.append(_Answered(request, now, answer))

    def forget(self) -> None:
        """Keep no answers."""
        self._answered.clear()

    def begin(self, file: OpenFile, request: Request, now: float) -> None:
        """A file is open under this number."""
        self.file, self.opened, self.used = file, _Opened(request, now), False
        self.renumbers = _renumbers(request)
        self.heard = self.progressed = now

    def end(self, now: float, *, complete: bool) -> None:
        """Close what is open; raises OSError or ValueError as the file does, which is closed all the same."""
        file, self.file, self.opened, self.burst = self.file, None, None, None
        self.ended = now
        if file is not None:
            file.close(complete=complete)

    def has_just_ended(self, now: float) -> bool:
        """Whether the session was terminated a while ago, and who asks again has not heard the answer.

        Who repeats with new numbers may be late with the first and quick with the second.
        """
        return (0.0 if self.renumbers else PATIENCE) <= now - self.ended <= JUST_ENDED

    def is_asked_again(self, request: Request, now: float) -> bool:
        """Whether this asks to open what stands open and unused, because the answer was lost."""
        opened = self.opened
        return (
            opened is not None
            and not self.used
            and opened.request.text == request.text
            and now - opened.time >= PATIENCE
        )

    def is_given_up(self, request: Request, now: float) -> bool:
        """Whether the client has given up this session and opens another file under its number.

        Only who uses one number for everything does; others listen to the number they get.
        """
        return _renumbers(request) and now - self.progressed >= STALLED

    def was_opened_after(self, request: Request, now: float) -> bool:
        """Whether the session was opened by a later request than this, which the network has delayed."""
        opened = self.opened
        if opened is None or now - opened.time >= DELAYED:
            return False
        return 0 < (opened.request.sequence - request.sequence) % SEQUENCES <= OVERTAKEN


class Client:
    """One client: a component of a system, at one end of a link.

    Attributes:
        conversations: by session number.
    """

    def __init__(self) -> None:
        self.conversations: dict[int, Conversation] = {}

    @property
    def open(self) -> list[Conversation]:
        """Those with an open file."""
        return [one for one in self.conversations.values() if one.file is not None]

    @property
    def heard(self) -> float:
        """When it was last heard [s]."""
        return max((one.heard for one in self.conversations.values()), default=0.0)

    def conversation(self, number: int) -> Conversation:
        """The one of a session number."""
        found = self.conversations.get(number)
        if found is None:
            found = self.conversations[number] = Conversation(number)
            idle = [one for one in self.conversations.values() if one.file is None and one is not found]
            if len(self.conversations) > MEMORIES and idle:
                del self.conversations[min(idle, key=lambda one: one.heard).number]
        return found

    def free_number(self, wanted: int) -> int:
        """A session number that is free: the one wanted, or the next."""
        taken = {one.number for one in self.open}
        return next(number % 256 for number in range(wanted, wanted + 256) if number % 256 not in taken)


class Clients:
    """All clients."""

    def __init__(self) -> None:
        self._clients: dict[tuple[object, ...], Client] = {}

    def __iter__(self) -> Iterator[Client]:
        return iter(list(self._clients.values()))

    def of(self, sender: Sender) -> Client:
        """The client that sent something."""
        key = (sender.system, sender.component, sender.link, sender.peer.address)
        found = self._clients.get(key)
        if found is None:
            if len(self._clients) >= CLIENTS:
                silent = min(self._clients, key=lambda key: self._clients[key].heard)
                _close(self._clients.pop(silent).open)
            found = self._clients[key] = Client()
        return found

    def make_room(self, client: Client, now: float) -> None:
        """See to it that the client can open one more session, at the cost of a long silent one if need be.

        Raises FtpError: no sessions available.
        """
        mine = client.open
        everybody = [one for other in self for one in other.open]
        crowded = mine if len(mine) >= SESSIONS_EACH else everybody if len(everybody) >= SESSIONS else []
        if crowded:
            longest = min(crowded, key=lambda one: one.heard)
            if now - longest.heard < LONG_SILENT:
                raise FtpError(mav.MAV_FTP_ERR_NOSESSIONSAVAILABLE)
            _close([longest])

    def close(self) -> None:
        """Close all files, as they are, and forget everybody."""
        for client in self:
            _close(client.open)
        self._clients.clear()


def _renumbers(opening: Request) -> bool:
    """Whether an opening comes from MAVSDK, which alone counts a zero at the end of a path."""
    return opening.data.endswith(b"\0")


def _close(conversations: list[Conversation]) -> None:
    for conversation in conversations:
        try:
            conversation.end(-1e9, complete=False)
        except OSError:
            continue
