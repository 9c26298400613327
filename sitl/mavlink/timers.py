"""Calls to be made later, by wall time: retries and timeouts of protocols, whose other ends live in wall time."""

import heapq
import math
from collections.abc import Callable
from itertools import count

__all__ = ["Timer", "Timers"]


class Timer:
    """One call to come, unless it is cancelled."""

    __slots__ = ("call",)

    def __init__(self, call: Callable[[], None]) -> None:
        self.call: Callable[[], None] | None = call

    def cancel(self) -> None:
        """Let it not happen; harmless afterwards."""
        self.call = None


class Timers:
    """Timers in the order in which they are due; equal times in the order in which they were set."""

    def __init__(self) -> None:
        self._heap: list[tuple[float, int, Timer]] = []
        self._numbers = count()

    @property
    def next_due(self) -> float:
        """Wall time of the next call [s], inf if there is none."""
        return self._heap[0][0] if self._heap else math.inf

    def at(self, time: float, call: Callable[[], None]) -> Timer:
        """Call something at this wall time [s]."""
        timer = Timer(call)
        heapq.heappush(self._heap, (time, next(self._numbers), timer))
        return timer

    def run(self, now: float) -> None:
        """Make the calls due at `now` [s]; those which they set in turn wait for the next run."""
        due: list[Timer] = []
        while self._heap and self._heap[0][0] <= now:
            due.append(heapq.heappop(self._heap)[2])
        for timer in due:
            if timer.call is not None:
                call, timer.call = timer.call, None
                call()
