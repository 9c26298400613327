"""The flight's end of the viewer: a bounded queue in front of a process that may be slow, frozen or gone.

A viewer that stops reading makes Rerun's log calls block for good, so they happen in a process of their own. The flight
only writes to a pipe, without blocking; what does not fit waits in a queue that drops its oldest entry when full.
"""

import contextlib
import os
import subprocess
import sys
import time
from collections import deque
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Any

from sitl.viewer.frames import pack_setup, pack_snapshot, pack_text

if TYPE_CHECKING:
    from types import TracebackType

    from sitl.snapshot import Snapshot

__all__ = ["QUEUE_LENGTH", "Viewer"]

QUEUE_LENGTH = 500  # frames: 10 s at 50 Hz, about 1.2 MB
PIPE_BYTES = 1 << 20


class Viewer:
    """Hands snapshots and messages to the viewer process; no call ever waits for it, except `close`.

    Calls may come from several threads. `address` is what to tell the user: where to watch, or "" when there is
    nothing to say. `process` is None when the viewer is off, and then every call returns at once.
    """

    def __init__(self, address: str = "", setup: dict[str, Any] | None = None) -> None:
        self.address = address
        self.process: subprocess.Popen[bytes] | None = None
        self._dropped = 0
        self._lost = False
        self._sim_time = 0.0
        self._queue: deque[bytes] = deque()
        self._current = memoryview(b"")
        self._lock = Lock()
        if setup is not None:
            self._start(setup)

    def _start(self, setup: dict[str, Any]) -> None:
        package_root = str(Path(__file__).parents[2])
        paths = [package_root, *filter(None, [os.environ.get("PYTHONPATH")])]
        self.process = subprocess.Popen(
            [sys.executable, "-m", "sitl.viewer.process"],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
            bufsize=0,
            # Its own session: Ctrl-C is for the flight, which then closes the viewer with a deadline.
            start_new_session=True,
        )
        assert self.process.stdin is not None
        self._pipe = self.process.stdin.fileno()
        os.set_blocking(self._pipe, False)
        if sys.platform == "linux":
            import fcntl

            # The kernel's queue rides over a viewer that starts or pauses; a refusal leaves the default of 64 kB.
            with contextlib.suppress(OSError):
                fcntl.fcntl(self._pipe, fcntl.F_SETPIPE_SZ, PIPE_BYTES)
        self._current = memoryview(pack_setup(setup))  # not in the queue: it must not be dropped
        self._write()

    @property
    def dropped(self) -> int:
        """Snapshots and messages that the viewer never got, since the start."""
        return self._dropped

    @property
    def lost(self) -> bool:
        """True once the viewer process has died while the flight goes on."""
        return self._lost

    def offer(self, snapshot: "Snapshot") -> None:
        """Show this moment, if the viewer keeps up; at most 50 calls per second of wall time. Never blocks."""
        if self.process is None:
            return
        self._sim_time = snapshot.time
        self._put(pack_snapshot(snapshot))

    def text(self, severity: int, text: str) -> None:
        """Show a message under the time of the last snapshot; severity is a MAV_SEVERITY, 0 to 7. Never blocks."""
        if self.process is None:
            return
        self._put(pack_text(self._sim_time, min(max(int(severity), 0), 7), text))

    def close(self, deadline: float = 2.0) -> None:
        """Deliver what is queued, let the viewer finish its file and end it; all within `deadline` wall seconds.

        A viewer that does not manage is killed and what it had not shown is counted as dropped. Idempotent.
        """
        if self.process is None:
            return
        end = time.monotonic() + deadline
        process, self.process = self.process, None
        with self._lock:
            while self._write() and time.monotonic() < end:
                time.sleep(0.002)
            self._dropped += len(self._queue)
            self._queue.clear()
        assert process.stdin is not None
        process.stdin.close()
        try:
            process.wait(max(0.0, end - time.monotonic()))
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()

    def __enter__(self) -> "Viewer":
        """Return itself; leaving the block closes it."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: "TracebackType | None"
    ) -> None:
        """Close with the default deadline."""
        self.close()

    def _put(self, frame: bytes) -> None:
        with self._lock:
            if self._lost:
                self._dropped += 1
                return
            if len(self._queue) >= QUEUE_LENGTH:
                self._queue.popleft()
                self._dropped += 1
            self._queue.append(frame)
            self._write()

    def _write(self) -> bool:
        """Push what the pipe takes; True while something is left for later."""
        try:
            while self._current or self._queue:
                if not self._current:
                    self._current = memoryview(self._queue.popleft())
                self._current = self._current[os.write(self._pipe, self._current) :]
        except BlockingIOError:
            return True
        except OSError:  # the process has died
            self._lost = True
            self._dropped += len(self._queue) + bool(self._current)
            self._queue.clear()
            self._current = memoryview(b"")
        return False
