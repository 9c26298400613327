"""What outlives a run: one folder (`--state DIR`) with the vehicle's storage, files and logs; without it nothing does.

A file is replaced in one step or not at all, whenever the power goes: the new one is written beside it and flushed,
takes its name, and then the folder is flushed, too. One process uses a folder at a time.
"""

import os
import shutil
import tempfile
import weakref
from contextlib import suppress
from pathlib import Path
from typing import IO, Self

__all__ = ["StateError", "StateFolder"]

LOCK = "lock"
NEW, DAMAGED = ".new", ".bad"  # endings of a file not yet in place, and of one that was of no use


class StateError(Exception):
    """The folder, or a file in it, cannot be used; one line that says which and why."""


class StateFolder:
    """Storage by name, and two folders for files.

    Attributes:
        folder: what was given; None: what is stored lasts as long as this object.
        files: what the vehicle's file system shows.
        logs: where logs go.

    A temporary folder takes the place of one that was not given, and goes with `close` or the end of the process.
    """

    def __init__(self, folder: Path | str | None = None) -> None:
        """Open the folder, made where there is none; raises StateError if it cannot be had or is in use."""
        self.folder = None if folder is None else Path(folder)
        self._root = Path(tempfile.mkdtemp(prefix="tiltwing-")) if self.folder is None else self.folder
        self._lock: IO[str] | None = None
        if self.folder is None:
            self._delete = weakref.finalize(self, shutil.rmtree, self._root, ignore_errors=True)
        self.files = self._root / "files"
        self.logs = self._root / "logs"
        try:
            self._root.mkdir(parents=True, exist_ok=True)
            if self.folder is not None:
                self._take_lock()
            self.files.mkdir(exist_ok=True)
            self.logs.mkdir(exist_ok=True)
            for left in self._root.glob(f"*{NEW}"):  # the power went before it took its name
                left.unlink()
        except OSError as error:
            self.close()
            msg = f"state folder {self._root}: expected a folder to write to, got {error.strerror or error}"
            raise StateError(msg) from None

    def __enter__(self) -> Self:
        """Close at the end of a with block."""
        return self

    def __exit__(self, *_: object) -> None:
        """See __enter__."""
        self.close()

    def read(self, name: str) -> bytes | None:
        """What is stored under a name; None if nothing is. Raises StateError if it cannot be read."""
        try:
            return self._path(name).read_bytes()
        except FileNotFoundError:
            return None
        except OSError as error:
            raise self._error(name, error) from None

    def write(self, name: str, data: bytes) -> None:
        """Store something under a name, in place of what was there, for its owner's eyes only.

        Raises StateError if it cannot be stored; what was there is then still there.
        """
        path = self._path(name)
        new = path.with_name(name + NEW)
        try:
            with os.fdopen(os.open(new, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), "wb") as file:
                file.write(data)
                if self.folder is not None:
                    file.flush()
                    os.fsync(file.fileno())
            new.replace(path)
            self._flush_folder()
        except OSError as error:
            with suppress(OSError):
                new.unlink(missing_ok=True)
            raise self._error(name, error) from None

    def remove(self, name: str) -> None:
        """Store nothing under a name any more. Raises StateError if that fails."""
        try:
            self._path(name).unlink(missing_ok=True)
            self._flush_folder()
        except OSError as error:
            raise self._error(name, error) from None

    def set_aside(self, name: str) -> str:
        """Keep what is stored under a name, damaged as it is, where nobody reads it again; returns the file's new name.

        Raises StateError if that fails.
        """
        path = self._path(name)
        try:
            path.replace(path.with_name(name + DAMAGED))
            self._flush_folder()
        except OSError as error:
            raise self._error(name, error) from None
        return name + DAMAGED

    def close(self) -> None:
        """Let another process have the folder; a temporary one is deleted."""
        if self._lock is not None:
            self._lock.close()
            self._lock = None
        if self.folder is None:
            self._delete()

    def _path(self, name: str) -> Path:
        if Path(name).name != name or name in {"", "..", LOCK}:
            msg = f"expected a plain file name, got {name!r}"
            raise ValueError(msg)
        return self._root / name

    def _error(self, name: str, error: OSError) -> StateError:
        return StateError(f"{self._root / name}: {error.strerror or error}")

    def _flush_folder(self) -> None:
        """Let a new name outlive a loss of power."""
        if self.folder is None:
            return
        descriptor = os.open(self._root, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)

    def _take_lock(self) -> None:
        """Hold the lock of the folder until `close`, or the end of the process however it ends; raises StateError."""
        import fcntl  # not on every system, and needed for --state only

        lock = (self._root / LOCK).open("a+", encoding="utf-8")
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            lock.seek(0)
            holder = lock.read().strip()
            lock.close()
            by = f"process {holder}" if holder else "another process"
            msg = f"state folder {self._root}: expected one for this vehicle alone, got one that {by} uses"
            raise StateError(msg) from None
        self._lock = lock
        lock.truncate(0)
        lock.write(str(os.getpid()))
        lock.flush()
