"""Requests and answers of MAVLink FTP as they lie in the payload of FILE_TRANSFER_PROTOCOL, and its checksum.

https://mavlink.io/en/services/ftp.html#payload. A header of twelve bytes, little-endian (sequence number, session,
opcode, size of the data, opcode that is answered, whether a burst is complete, padding, offset), then up to 239 bytes.
"""

import errno
import struct
import zlib
from typing import Any, Final, NamedTuple

from sitl.mavlink.dialect import tiltwing as mav

__all__ = [
    "FRAME", "MOST_DATA", "SEQUENCES", "FtpError", "Request",
    "acknowledgement", "burst_part", "crc32", "refusal", "taken",
]  # fmt: skip

HEADER: Final = struct.Struct("<HBBBBBBI")
MOST_DATA: Final = 239  # bytes in one message
FRAME: Final = 12 + 3 + HEADER.size  # bytes of a MAVLink 2 frame around the data
SEQUENCES: Final = 1 << 16

SAME_ERRORS: Final = {
    errno.ENOENT: mav.MAV_FTP_ERR_FILENOTFOUND,
    errno.EEXIST: mav.MAV_FTP_ERR_FILEEXISTS,
    errno.EACCES: mav.MAV_FTP_ERR_FILEPROTECTED,
    errno.EPERM: mav.MAV_FTP_ERR_FILEPROTECTED,
    errno.EROFS: mav.MAV_FTP_ERR_FILEPROTECTED,
}


class FtpError(Exception):
    """A request is refused. `code` is of MAV_FTP_ERR, `number` the errno that goes with FailErrno."""

    def __init__(self, code: int, number: int = 0) -> None:
        super().__init__(f"FTP error {code}, {number}")
        self.code = code
        self.number = number


class Request(NamedTuple):
    """One request, taken apart; `text` is all of it but its sequence number."""

    sequence: int
    session: int
    opcode: int
    size: int
    offset: int
    data: bytes
    text: bytes

    @property
    def path(self) -> str:
        """The path in it, up to its first zero."""
        return _decoded(self.data.partition(b"\0")[0])

    @property
    def paths(self) -> tuple[str, ...]:
        """The paths in it, between zeros."""
        return tuple(_decoded(path) for path in self.data.split(b"\0") if path)


def taken(message: Any) -> Request | None:
    """The request in a FILE_TRANSFER_PROTOCOL message; None for an answer, for answering answers would never end."""
    raw = bytes(message.payload)
    sequence, session, opcode, size, _, _, _, offset = HEADER.unpack_from(raw)
    if opcode in (mav.MAV_FTP_OPCODE_ACK, mav.MAV_FTP_OPCODE_NAK):
        return None
    end = HEADER.size + min(size, MOST_DATA)
    return Request(sequence, session, opcode, size, offset, raw[HEADER.size : end], raw[2:end])


def acknowledgement(request: Request, data: bytes, session: int) -> bytes:
    """An ACK but for its sequence number."""
    return _body(request, mav.MAV_FTP_OPCODE_ACK, data, session)


def refusal(request: Request, error: FtpError | OSError) -> bytes:
    """A NAK but for its sequence number: with the error's own code, or else with its errno."""
    if isinstance(error, OSError):
        number = error.errno or errno.EIO
        code = SAME_ERRORS.get(number)
        error = FtpError(mav.MAV_FTP_ERR_FAILERRNO, number & 0xFF) if code is None else FtpError(code)
    reason = bytes((error.code, error.number) if error.code == mav.MAV_FTP_ERR_FAILERRNO else (error.code,))
    return _body(request, mav.MAV_FTP_OPCODE_NAK, reason, request.session)


def burst_part(request: Request, sequence: int, offset: int, data: bytes, *, is_last: bool) -> bytes:
    """One part of the answer to a burst read."""
    header = HEADER.pack(
        sequence % SEQUENCES, request.session, mav.MAV_FTP_OPCODE_ACK, len(data), request.opcode, is_last, 0, offset
    )
    return header + data


def crc32(data: bytes, before: int = 0) -> int:
    """MAVLink's CRC32 of data, going on from that of what came before.

    https://mavlink.io/en/guide/crc.html: the usual polynomial without the usual inversions at the beginning and end.
    """
    return zlib.crc32(data, before ^ 0xFFFFFFFF) ^ 0xFFFFFFFF


def _body(request: Request, opcode: int, data: bytes, session: int) -> bytes:
    return HEADER.pack(0, session, opcode, len(data), request.opcode, 0, 0, request.offset)[2:] + data


def _decoded(path: bytes) -> str:
    return path.decode("utf-8", errors="surrogateescape")
