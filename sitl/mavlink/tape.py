"""Recording of all traffic in a .tlog file, as ground stations keep it: each frame after its wall time.

A message sent to several peers is recorded once, in a sequence of the tape's own, so that tools which count what was
lost find nothing missing. Signatures and keys are left out. The disk is written by a thread; what it does not take in
time is dropped and counted, so that it can never stall the flight.
"""

import queue
import threading
import time
from pathlib import Path

from sitl.mavlink.frames import Frame
from sitl.mavlink.links import Messages
from sitl.mavlink.signing import for_log

__all__ = ["Tape", "TapeError"]

MOST_WAITING = 4096  # pieces
PIECE = 1 << 14  # [bytes]: what is collected before the thread gets it
LONGEST_WAIT = 1.0  # before it gets what there is [s]


class TapeError(ValueError):
    """A recording that cannot begin; the text says where and why."""


class Tape:
    """A .tlog file being written.

    Attributes:
        system, component: ids that our frames have on it.
        dropped: pieces that the disk did not take in time, or at all.
    """

    def __init__(self, path: Path) -> None:
        """Begin a new file; raises TapeError if it cannot be made."""
        self.dropped = 0
        self.system = self.component = 1
        self._sequence = 0
        try:
            self._file = path.open("wb")
        except OSError as error:
            msg = f"recording {path}: expected a file to write to, got {error.strerror}"
            raise TapeError(msg) from None
        self._piece = bytearray()
        self._begun = time.monotonic()
        self._queue: queue.Queue[bytes | None] = queue.Queue(MOST_WAITING)
        self._thread = threading.Thread(target=self._write, name="tape", daemon=True)
        self._thread.start()

    def received(self, frame: Frame) -> None:
        """Record a frame that has come."""
        raw = for_log(frame.raw, frame.message)
        if raw is not None:
            self._keep(raw)

    def sent(self, messages: Messages) -> None:
        """Record messages of ours."""
        for codec, payload in messages:
            self._keep(codec.frame(payload, self._sequence, self.system, self.component))
            self._sequence = (self._sequence + 1) & 0xFF

    def close(self) -> None:
        """Write what is left and close the file."""
        self._hand_over()
        self._queue.put(None)
        self._thread.join()
        self._file.close()

    def _keep(self, frame: bytes) -> None:
        self._piece += (time.time_ns() // 1000).to_bytes(8, "big") + frame
        if len(self._piece) >= PIECE or time.monotonic() - self._begun > LONGEST_WAIT:
            self._hand_over()

    def _hand_over(self) -> None:
        try:
            self._queue.put_nowait(bytes(self._piece))
        except queue.Full:
            self.dropped += 1
        self._piece.clear()
        self._begun = time.monotonic()

    def _write(self) -> None:
        while (piece := self._queue.get()) is not None:
            try:
                self._file.write(piece)
                self._file.flush()
            except OSError:
                self.dropped += 1
