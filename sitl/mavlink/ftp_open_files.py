"""Open files of MAVLink FTP: on disk, made of bytes, or being uploaded to a virtual file."""

import errno
import os
import stat
from collections.abc import Callable
from typing import Final, Protocol

__all__ = ["Content", "DiskFile", "OpenFile", "Upload", "open_regular"]

LARGEST_UPLOAD: Final = 1 << 20  # to a virtual file, which is kept in memory [bytes]

# Not blocking: whoever puts a pipe into the directory must not make the vehicle wait for its other end.
FILE = os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC


class OpenFile(Protocol):
    """A file that a session holds open. Its methods raise OSError."""

    @property
    def size(self) -> int:
        """Length now [bytes]."""
        ...

    def read(self, offset: int, count: int) -> bytes:
        """At most so many bytes; none beyond the end."""
        ...

    def write(self, offset: int, data: bytes) -> None:
        """Put these bytes there; the file grows as needed."""
        ...

    def close(self, *, complete: bool) -> None:
        """Let go of it. `complete`: all was written that should be; raises ValueError if that will not do."""
        ...


def open_regular(name: str, how: int, directory: int) -> int:
    """Open what must be a file, not a directory, link, pipe or device."""
    _check_regular(os.stat(name, dir_fd=directory, follow_symlinks=False))
    descriptor = os.open(name, how | FILE, dir_fd=directory)
    try:
        _check_regular(os.fstat(descriptor))  # it may be another one by now
    except OSError:
        os.close(descriptor)
        raise
    return descriptor


def _check_regular(status: os.stat_result) -> None:
    if stat.S_ISDIR(status.st_mode):
        raise IsADirectoryError(errno.EISDIR, "a directory")
    if not stat.S_ISREG(status.st_mode):
        raise PermissionError(errno.EACCES, "no file")


class Content:
    """Bytes as a file."""

    def __init__(self, content: bytes) -> None:
        self._content = content

    @property
    def size(self) -> int:
        """See OpenFile."""
        return len(self._content)

    def read(self, offset: int, count: int) -> bytes:
        """See OpenFile."""
        return self._content[offset : offset + count]

    def write(self, offset: int, data: bytes) -> None:  # noqa: ARG002  (no bytes can be written anywhere)
        """See OpenFile."""
        raise OSError(errno.EBADF, "opened for reading")

    def close(self, *, complete: bool) -> None:
        """Nothing is held."""


class DiskFile:
    """A file of a directory. `grow` is asked before it is written: with its descriptor and the length it will have.

    Without `grow` it is for reading.
    """

    def __init__(self, descriptor: int, grow: Callable[[int, int], None] | None = None) -> None:
        self._descriptor = descriptor
        self._grow = grow

    @property
    def size(self) -> int:
        """See OpenFile."""
        return os.fstat(self._descriptor).st_size

    def read(self, offset: int, count: int) -> bytes:
        """See OpenFile."""
        return os.pread(self._descriptor, count, offset)

    def write(self, offset: int, data: bytes) -> None:
        """See OpenFile."""
        if self._grow is None:
            raise OSError(errno.EBADF, "opened for reading")
        self._grow(self._descriptor, offset + len(data))
        if os.pwrite(self._descriptor, data, offset) < len(data):
            raise OSError(errno.ENOSPC, "no space")

    def close(self, *, complete: bool) -> None:  # noqa: ARG002  (what is written is written)
        """See OpenFile."""
        os.close(self._descriptor)


class Upload:
    """What is being written to a virtual file."""

    def __init__(self, store: Callable[[bytes], None]) -> None:
        self._store = store
        self._content = bytearray()

    @property
    def size(self) -> int:
        """See OpenFile."""
        return 0

    def read(self, offset: int, count: int) -> bytes:  # noqa: ARG002  (nor read)
        """See OpenFile."""
        raise OSError(errno.EBADF, "opened for writing")

    def write(self, offset: int, data: bytes) -> None:
        """See OpenFile."""
        end = offset + len(data)
        if end > LARGEST_UPLOAD:
            raise OSError(errno.EFBIG, "too large")
        self._content.extend(bytes(max(0, end - len(self._content))))
        self._content[offset:end] = data

    def close(self, *, complete: bool) -> None:
        """See OpenFile."""
        if complete:
            self._store(bytes(self._content))
