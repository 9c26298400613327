"""File transfer protocol (FTP): files read, written and listed over FILE_TRANSFER_PROTOCOL.

https://mavlink.io/en/services/ftp.html. What is served, and that nobody gets out of it, is the business of
`sitl.mavlink.ftp_files`; who has which session open and what is a retransmission that of `sitl.mavlink.ftp_sessions`;
burst reads are in `sitl.mavlink.ftp_burst`.
"""

from collections import deque
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final, NamedTuple

from sitl.mavlink.codec import codec
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.ftp_burst import Bursts
from sitl.mavlink.ftp_files import Entry, FileTree, Mount
from sitl.mavlink.ftp_messages import (
    MOST_DATA,
    SEQUENCES,
    FtpError,
    Request,
    acknowledgement,
    crc32,
    refusal,
    taken,
)
from sitl.mavlink.ftp_open_files import OpenFile
from sitl.mavlink.ftp_sessions import Client, Clients, Conversation
from sitl.mavlink.service import Exchange, Handler, Sender, Service

__all__ = ["FtpService"]

PIECE: Final = 1 << 20  # of a file whose checksum is made [bytes]: less than 1 ms
MOST_WORK: Final = 32  # checksums under way
LISTING_LASTS: Final = 30.0  # in which a client comes for the next page of a directory [s], wall time


class _Call(NamedTuple):
    """A request and all that belongs to it."""

    request: Request
    conversation: Conversation
    client: Client
    sender: Sender


class _Answer(NamedTuple):
    """What an ACK brings: data, and the session if it is another than that of the request."""

    data: bytes = b""
    session: int | None = None


class FtpService(Service):
    """Answers FILE_TRANSFER_PROTOCOL.

    Attributes:
        tree: what is served.
    """

    def __init__(self, exchange: Exchange, mounts: Mapping[str, Mount] | None = None) -> None:
        """Serve the files of the state folder, and the mounts among them."""
        super().__init__(exchange)
        self.tree = FileTree(exchange.state.files, mounts or {})
        self._codec = codec("FILE_TRANSFER_PROTOCOL")
        self._clients = Clients()
        self._bursts = Bursts(exchange)
        self._work: deque[Iterator[None]] = deque()
        self._scanned: tuple[float, str, list[Entry]] | None = None
        self._serving: Mapping[int, Callable[[_Call], _Answer | None]] = {
            mav.MAV_FTP_OPCODE_NONE: lambda _: _Answer(),
            mav.MAV_FTP_OPCODE_TERMINATESESSION: self._terminate,
            mav.MAV_FTP_OPCODE_RESETSESSION: self._reset,
            mav.MAV_FTP_OPCODE_LISTDIRECTORY: self._list,
            mav.MAV_FTP_OPCODE_LISTDIRECTORYWITHTIME: self._list,
            mav.MAV_FTP_OPCODE_OPENFILERO: self._open,
            mav.MAV_FTP_OPCODE_OPENFILEWO: self._open,
            mav.MAV_FTP_OPCODE_CREATEFILE: self._open,
            mav.MAV_FTP_OPCODE_READFILE: _read,
            mav.MAV_FTP_OPCODE_WRITEFILE: _write,
            mav.MAV_FTP_OPCODE_BURSTREADFILE: self._burst_read,
            mav.MAV_FTP_OPCODE_CALCFILECRC: self._checksum,
            mav.MAV_FTP_OPCODE_REMOVEFILE: self._at_path(self.tree.remove),
            mav.MAV_FTP_OPCODE_CREATEDIRECTORY: self._at_path(self.tree.make_directory),
            mav.MAV_FTP_OPCODE_REMOVEDIRECTORY: self._at_path(self.tree.remove_directory),
            mav.MAV_FTP_OPCODE_TRUNCATEFILE: self._truncate,
            mav.MAV_FTP_OPCODE_RENAME: self._rename,
        }

    def messages(self) -> Mapping[str, Handler]:
        """See Service."""
        return {"FILE_TRANSFER_PROTOCOL": self._on_message}

    def restarted(self) -> None:
        """See Service: files stay, nobody has one open any more."""
        self._clients.close()
        self._work.clear()

    def close(self) -> None:
        """See Service."""
        self._clients.close()
        self.tree.close()

    # -- requests and answers ------------------------------------------------------------------------------------

    def _on_message(self, message: Any, sender: Sender) -> None:
        request = taken(message)
        if request is None:
            return
        now = self.exchange.wall_time
        client = self._clients.of(sender)
        conversation = client.conversation(request.session)
        again = conversation.answer_again(request, now)
        if again is not None:
            self._send(request, sender, again)
        else:
            self._serve(_Call(request, conversation, client, sender))
        conversation.hear(request, now)

    def _serve(self, call: _Call) -> None:
        request = call.request
        serve = self._serving.get(request.opcode)
        if serve != self._list:
            self._scanned = None
        if request.size > MOST_DATA:
            self._refuse(call, FtpError(mav.MAV_FTP_ERR_INVALIDDATASIZE))
        elif serve is None:
            self._refuse(call, FtpError(mav.MAV_FTP_ERR_UNKNOWNCOMMAND))
        else:
            try:
                answer = serve(call)
            except (FtpError, OSError) as error:
                self._refuse(call, error)
            else:
                if answer is not None:
                    self._acknowledge(call, answer)

    def _acknowledge(self, call: _Call, answer: _Answer) -> None:
        session = call.request.session if answer.session is None else answer.session
        self._answer(call, acknowledgement(call.request, answer.data, session))

    def _refuse(self, call: _Call, error: FtpError | OSError) -> None:
        self._answer(call, refusal(call.request, error))

    def _answer(self, call: _Call, body: bytes) -> None:
        call.conversation.remember(call.request, body, self.exchange.wall_time)
        self._send(call.request, call.sender, body)

    def _send(self, request: Request, sender: Sender, body: bytes) -> None:
        to = bytes((0, sender.system, sender.component))
        sequence = ((request.sequence + 1) % SEQUENCES).to_bytes(2, "little")
        sender.link.send(sender.peer, [(self._codec, (to + sequence + body).rstrip(b"\0"))])

    # -- sessions ------------------------------------------------------------------------------------------------

    def _open(self, call: _Call) -> _Answer:
        request, conversation, client, _ = call
        now = self.exchange.wall_time
        if conversation.file is not None:
            if conversation.is_asked_again(request, now):
                return _Answer(_length(request, conversation.file), conversation.number)
            if conversation.is_given_up(request, now):
                conversation.end(now, complete=False)
        self._clients.make_room(client, now)
        if request.opcode == mav.MAV_FTP_OPCODE_OPENFILERO:
            file = self.tree.open(request.path)
        else:
            file = self.tree.create(request.path, truncate=request.opcode == mav.MAV_FTP_OPCODE_CREATEFILE)
        number = client.free_number(request.session)
        client.conversation(number).begin(file, request, now)
        return _Answer(_length(request, file), number)

    def _terminate(self, call: _Call) -> _Answer:
        conversation = call.conversation
        if conversation.file is not None:
            self._end(conversation, call.sender)
        elif not conversation.has_just_ended(self.exchange.wall_time):
            raise FtpError(mav.MAV_FTP_ERR_INVALIDSESSION)
        return _Answer()

    def _reset(self, call: _Call) -> _Answer:
        """End all sessions of the client, and forget what it has asked for: it may count from zero again."""
        now = self.exchange.wall_time
        error: FtpError | None = None
        for conversation in list(call.client.conversations.values()):
            conversation.forget()
            if conversation.file is not None and not conversation.was_opened_after(call.request, now):
                try:
                    self._end(conversation, call.sender)
                except FtpError as one:
                    error = one
        if error is not None:
            raise error
        return _Answer()

    def _end(self, conversation: Conversation, sender: Sender) -> None:
        try:
            conversation.end(self.exchange.wall_time, complete=True)
        except ValueError as error:  # what was uploaded will not do
            self.exchange.tell(sender, mav.MAV_SEVERITY_WARNING, str(error))
            raise FtpError(mav.MAV_FTP_ERR_FAIL) from None

    def _burst_read(self, call: _Call) -> None:
        request, conversation, _, sender = call
        self._bursts.start(request, conversation, _opened(call), sender)

    # -- directories and whole files -----------------------------------------------------------------------------

    def _list(self, call: _Call) -> _Answer:
        """As many entries as fit; the pages of one listing are of one moment."""
        request, conversation = call.request, call.conversation
        path, now = request.path, self.exchange.wall_time
        listed = conversation.listing
        if request.offset > 0 and listed is not None and listed[0] == path and now - listed[1] < LISTING_LASTS:
            entries = listed[2]
        else:
            entries = self._entries(path)
        conversation.listing = (path, now, entries)
        if request.offset >= len(entries):
            raise FtpError(mav.MAV_FTP_ERR_EOF)
        with_time = request.opcode == mav.MAV_FTP_OPCODE_LISTDIRECTORYWITHTIME
        data = b""
        for entry in entries[request.offset :]:
            text = _entry_text(entry, with_time=with_time)
            if len(data) + len(text) > MOST_DATA:
                break
            data += text
        return _Answer(data)

    def _entries(self, path: str) -> list[Entry]:
        """A directory's entries, looked up once a turn however often they are asked for."""
        now = self.exchange.wall_time
        if self._scanned is None or self._scanned[:2] != (now, path):
            self._scanned = (now, path, self.tree.listing(path))
        return self._scanned[2]

    def _at_path(self, change: Callable[[str], None]) -> Callable[[_Call], _Answer]:
        """Answer requests by changing what is at their path."""

        def serve(call: _Call) -> _Answer:
            change(call.request.path)
            return _Answer()

        return serve

    def _truncate(self, call: _Call) -> _Answer:
        self.tree.truncate(call.request.path, call.request.offset)
        return _Answer()

    def _rename(self, call: _Call) -> _Answer:
        paths = call.request.paths
        if len(paths) != 2:
            raise FtpError(mav.MAV_FTP_ERR_INVALIDDATASIZE)
        self.tree.rename(*paths)
        return _Answer()

    def _checksum(self, call: _Call) -> _Answer | None:
        """The checksum of a large file is made piece by piece, one each turn, and the answer comes later."""
        file = self.tree.open(call.request.path)
        if file.size > PIECE and len(self._work) < MOST_WORK:
            self._work.append(self._checksum_later(file, call))
            if len(self._work) == 1:
                self.exchange.after(0.0, self._go_on)
            return None
        try:
            if file.size > PIECE:
                raise FtpError(mav.MAV_FTP_ERR_FAIL)
            return _Answer(crc32(file.read(0, PIECE)).to_bytes(4, "little"))
        finally:
            file.close(complete=False)

    def _checksum_later(self, file: OpenFile, call: _Call) -> Iterator[None]:
        checksum = offset = 0
        try:
            while piece := file.read(offset, PIECE):
                checksum = crc32(piece, checksum)
                offset += len(piece)
                yield
        except OSError as error:
            self._refuse(call, error)
        else:
            self._acknowledge(call, _Answer(checksum.to_bytes(4, "little")))
        finally:
            file.close(complete=False)

    def _go_on(self) -> None:
        """One piece of the work that waits."""
        if self._work:
            work = self._work.popleft()
            if next(work, self) is None:
                self._work.append(work)
        if self._work:
            self.exchange.after(0.0, self._go_on)


def _opened(call: _Call) -> OpenFile:
    """The open file of a session; raises FtpError."""
    if call.conversation.file is None:
        raise FtpError(mav.MAV_FTP_ERR_INVALIDSESSION)
    call.conversation.used = True
    return call.conversation.file


def _read(call: _Call) -> _Answer:
    file, request = _opened(call), call.request
    data = file.read(request.offset, request.size)
    if not data and request.offset >= file.size:
        raise FtpError(mav.MAV_FTP_ERR_EOF)
    return _Answer(data)


def _write(call: _Call) -> _Answer:
    _opened(call).write(call.request.offset, call.request.data)
    return _Answer()


def _length(request: Request, file: OpenFile) -> bytes:
    """What the answer to an opening says: the file's length, but for a file that is new."""
    return b"" if request.opcode == mav.MAV_FTP_OPCODE_CREATEFILE else min(file.size, 0xFFFFFFFF).to_bytes(4, "little")


def _entry_text(entry: Entry, *, with_time: bool) -> bytes:
    """An entry as it is listed; what cannot be told (a tab in it, too long) is one to pass over."""
    text = entry.kind.encode() + entry.name
    if with_time:
        text += f"\t{entry.size}\t{entry.modified}".encode()
    elif entry.kind == "F":
        text += f"\t{entry.size}".encode()
    if entry.kind == "S" or b"\t" in entry.name or len(text) >= MOST_DATA:
        text = b"S"
    return text + b"\0"
