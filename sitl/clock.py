"""Simulated time against wall time: how many steps are due now, and how long to sleep until the next.

The simulation knows no clock; this is the only place that reads one. Like trio's MockClock it is three numbers, a
wall time, the tick that belongs to it and a rate, so nothing accumulates and nothing drifts; the wall clock is an
argument, so tests run it on invented time.
"""

import math
import time
from collections.abc import Callable

__all__ = ["Clock"]

# A tick number computed from a time that lies exactly on the tick must not fall short by a rounding error.
_ROUNDING = 1e-6


class Clock:
    """Turns wall time into due simulation steps ("ticks"), for real time, N times real time, or as fast as possible.

    Behind schedule it asks for all the ticks that are due, so simulated time catches up. A host that stalls for longer
    than `stall_limit` is not caught up with: the backlog is dropped and counted, for running it off would only be
    late again.

    Attributes:
        speed: simulated seconds per wall second; `math.inf` never waits.
        rate: ticks per simulated second [Hz].
        late_ticks: ticks that were not begun before the wake-up after their own.
        dropped_ticks: ticks given up after stalls; simulated time is late by so many for good.
        worst_lateness: longest time between a wake-up's deadline and its coming [s].
    """

    def __init__(
        self,
        speed: float = 1.0,
        rate: int = 400,
        *,
        stall_limit: float = 1.0,
        monotonic: Callable[[], float] = time.monotonic,
    ) -> None:
        """See the class; `stall_limit` in wall seconds. Raises ValueError for a speed or rate that is not positive."""
        if not speed > 0.0:
            msg = f"speed: expected a positive number or inf, got {speed}"
            raise ValueError(msg)
        if rate < 1:
            msg = f"rate: expected at least 1 Hz, got {rate}"
            raise ValueError(msg)
        self.speed = speed
        self.rate = rate
        self.now = monotonic
        self.late_ticks = 0
        self.dropped_ticks = 0
        self.worst_lateness = 0.0
        self._ticks_per_second = rate * speed
        # Above real time several ticks share a wake-up: a sleep cannot be much shorter than one period at 400 Hz.
        self._ticks_per_wake = 1 if speed == math.inf else max(1, round(speed))
        self._stall_ticks = stall_limit * self._ticks_per_second
        self.start(0)

    def start(self, tick: int) -> None:
        """Let `tick` be due now and count on from there, as after a pause."""
        self._anchor(tick, self.now())

    def deadline(self, tick: int) -> float:
        """Wall time [s, of the monotonic clock] at which `tick` is due."""
        return self._anchor_wall + (tick - self._anchor_tick) / self._ticks_per_second

    def due(self, tick: int, now: float, limit: int) -> int:
        """Tick to advance to at wall time `now`, having reached `tick`; never more than `limit` ahead."""
        if self.speed == math.inf:
            return tick + limit
        due = self._anchor_tick + math.floor((now - self._anchor_wall) * self._ticks_per_second + _ROUNDING)
        if due <= tick:
            return tick
        self.worst_lateness = max(self.worst_lateness, now - self.deadline(tick + self._ticks_per_wake))
        if due - tick > self._stall_ticks:
            self.dropped_ticks += due - tick - self._ticks_per_wake
            due = tick + self._ticks_per_wake
            self._anchor(due, now)
        # In time are the ticks of this wake-up; each earlier one is judged once, if catching up takes several turns.
        late_to = due - self._ticks_per_wake
        judged = max(tick, self._judged)
        if late_to > judged:
            self.late_ticks += late_to - judged
            self._judged = late_to
        return min(due, tick + limit)

    def remaining(self, tick: int) -> float:
        """Wall time until the wake-up that follows `tick` is due [s]; nothing, or less, if that has passed."""
        if self.speed == math.inf:
            return 0.0
        return self.deadline(tick + self._ticks_per_wake) - self.now()

    def _anchor(self, tick: int, wall: float) -> None:
        self._anchor_tick = tick
        self._anchor_wall = wall
        self._judged = tick
