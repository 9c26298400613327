"""The vehicle's process: started, waited for, ended; and what it printed."""

import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from pathlib import Path

__all__ = ["SitlError", "VehicleProcess"]

GRACE = 5.0  # after SIGTERM, before it is killed [s]
LAST_LINES = 20  # of what it printed, in an error
_LOOK = 0.02  # how often to look whether it has ended, while waiting for a heartbeat [s]


class SitlError(RuntimeError):
    """The vehicle is not there, or did not do what was asked; the text says what, and what it printed last."""


class VehicleProcess:
    """`python -m sitl` with arguments, appending what it prints to a file."""

    def __init__(self, arguments: Sequence[str], log: Path) -> None:
        """Start it."""
        # -P: a folder of the user's called sitl must not stand in the way.
        self._command = [sys.executable, "-P", "-m", "sitl.testing.child", *arguments]
        self._arguments = arguments
        self._log = log
        self._was_stopped = False
        with log.open("ab") as output:
            # Its input: see sitl.testing.child.
            self._process = subprocess.Popen(
                self._command, stdin=subprocess.PIPE, stdout=output, stderr=subprocess.STDOUT
            )

    @property
    def pid(self) -> int:
        """Process id."""
        return self._process.pid

    @property
    def is_running(self) -> bool:
        """Whether it has not ended yet."""
        return self._process.poll() is None

    def wait_until(self, ready: threading.Event, timeout: float) -> None:
        """Wait for `ready`. Raises SitlError if the process ends first, or after `timeout` wall seconds."""
        __tracebackhide__ = True
        end = time.monotonic() + timeout
        while not ready.wait(_LOOK):
            code = self._process.poll()
            if code is not None:
                raise self._error(f"ended with exit code {code} before its first HEARTBEAT")
            if time.monotonic() > end:
                raise self._error(f"sent no HEARTBEAT within {timeout:g} s")

    def check(self) -> None:
        """Raise SitlError if it has ended by itself, other than as it should."""
        code = self._process.poll()
        if code and not self._was_stopped:
            raise self._error(f"ended by itself with exit code {code}")

    def stop(self) -> None:
        """End it, if need be by force."""
        if self._process.poll() is None:
            self._was_stopped = True
            self._process.terminate()
            try:
                self._process.wait(GRACE)
            except subprocess.TimeoutExpired:
                self._process.kill()
        self._process.wait()
        if self._process.stdin is not None:
            self._process.stdin.close()

    def _error(self, what: str) -> SitlError:
        lines = self._log.read_text("utf-8", "replace").splitlines()[-LAST_LINES:]
        said = "\n".join(f"  | {line}" for line in lines) or "  (nothing)"
        command = " ".join(["python -m sitl", *self._arguments])
        return SitlError(f"the vehicle {what}\n  started as: {command}\n  it printed last:\n{said}")
