"""Writes log files from a thread of its own, for a disk can be slow, full or gone and the flight must not notice."""

import contextlib
import queue
import threading
from collections.abc import Callable
from io import FileIO
from pathlib import Path

__all__ = ["LogWriter"]

ROOM = 8 << 20  # that may wait for the disk [bytes]
PATIENCE = 5.0  # with a disk that does not answer, at the end [s], wall time


class LogWriter:
    """Writes one file after the other. Nothing here waits for the disk but `close`.

    Attributes:
        failure: why nothing is written any more, in the system's words; None while all is well. What is given
            afterwards is thrown away.
    """

    def __init__(self) -> None:
        self.failure: str | None = None
        self._orders: queue.SimpleQueue[Callable[[], None] | None] = queue.SimpleQueue()
        self._given = self._taken = 0  # bytes; each number is changed by one thread alone
        self._file: FileIO | None = None
        self._thread: threading.Thread | None = None

    def begin(self, path: Path, prepare: Callable[[], None]) -> None:
        """Make a file to write to from now on, once `prepare` has been called there (it may raise OSError)."""
        if self._thread is None:
            self._thread = threading.Thread(target=self._work, name="flight log", daemon=True)
            self._thread.start()

        def order() -> None:
            prepare()
            self._file = path.open("xb", buffering=0)

        self._orders.put(order)

    def write(self, data: bytes) -> bool:
        """Add to the file; False if there is no room for it, because the disk is slower than the flight."""
        if self._given - self._taken + len(data) > ROOM:
            return False
        self._given += len(data)

        def order() -> None:
            self._taken += len(data)
            rest = memoryview(data)
            while self._file is not None and rest:
                rest = rest[self._file.write(rest) :]

        self._orders.put(order)
        return True

    def end(self) -> None:
        """The file is complete."""
        self._orders.put(self._close_file)

    def close(self) -> None:
        """Finish what has been ordered; waits for that, but not for ever."""
        if self._thread is not None:
            self._orders.put(self._close_file)
            self._orders.put(None)
            self._thread.join(PATIENCE)
            self._thread = None

    def _work(self) -> None:
        while (order := self._orders.get()) is not None:
            try:
                order()
            except OSError as error:
                self.failure = error.strerror or str(error)
                with contextlib.suppress(OSError):
                    self._close_file()

    def _close_file(self) -> None:
        file, self._file = self._file, None
        if file is not None:
            file.close()
