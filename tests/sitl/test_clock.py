"""The clock on invented time: no test here sleeps or reads the real clock."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl.clock import Clock

UNLIMITED = 10**9


class Wall:
    """A wall clock that moves only when told, or when somebody sleeps on it."""

    def __init__(self, now: float = 1e6) -> None:
        self.now = now
        self.slept: list[float] = []

    def monotonic(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        if seconds > 0.0:
            self.slept.append(seconds)
            self.now += seconds


def clock_on(wall: Wall, speed: float = 1.0, rate: int = 400, stall_limit: float = 1.0) -> Clock:
    return Clock(speed, rate, stall_limit=stall_limit, monotonic=wall.monotonic)


def fly(clock: Clock, wall: Wall, seconds: float, cost: float = 0.0) -> int:
    """Run the pacing loop for so many wall seconds, each turn costing `cost`; return the tick reached."""
    tick, end = 0, wall.now + seconds
    while wall.now < end:
        tick = clock.due(tick, wall.now, UNLIMITED)
        wall.now += cost
        wall.sleep(clock.remaining(tick))
    return tick


@pytest.mark.parametrize("speed", [0.1, 0.5, 1.0, 3.0, 10.0, 123.0])
def test_simulated_time_does_not_drift_from_the_monotonic_clock_in_an_hour(speed: float) -> None:
    wall = Wall()
    clock = clock_on(wall, speed)
    tick = fly(clock, wall, 3600.0 / speed, cost=0.0003)
    assert abs(tick - 3600 * 400) <= max(1, round(speed))
    assert clock.late_ticks == 0
    assert clock.dropped_ticks == 0


@given(st.lists(st.floats(0.0, 0.2), min_size=1, max_size=200), st.sampled_from([0.5, 1.0, 4.0]))
def test_whatever_the_delays_every_tick_is_asked_for_once_and_none_before_its_time(
    delays: list[float], speed: float
) -> None:
    wall = Wall()
    clock = clock_on(wall, speed)
    begin, tick = wall.now, 0
    for delay in delays:
        wall.now += delay
        due = clock.due(tick, wall.now, UNLIMITED)
        assert due >= tick
        assert (
            due == math.floor((wall.now - begin) * 400 * speed + 1e-5)
            or abs((wall.now - begin) * 400 * speed - due) < 1e-5
        )
        tick = due
    assert clock.dropped_ticks == 0


def test_a_tick_is_due_exactly_at_its_deadline() -> None:
    wall = Wall(now=0.1)
    clock = clock_on(wall, rate=300)
    for tick in range(1, 2000):
        wall.now = clock.deadline(tick)
        assert clock.due(tick - 1, wall.now, UNLIMITED) == tick


def test_a_late_wake_up_is_caught_up_with_and_counted_once() -> None:
    wall = Wall()
    clock = clock_on(wall)
    wall.now += 10 / 400  # ticks 1 to 10 are due, only the tenth in time
    assert clock.due(0, wall.now, limit=4) == 4
    assert clock.due(4, wall.now, limit=4) == 8
    assert clock.due(8, wall.now, limit=4) == 10
    assert clock.late_ticks == 9
    assert clock.dropped_ticks == 0
    assert clock.worst_lateness == pytest.approx(9 / 400)
    wall.sleep(clock.remaining(10))
    assert wall.slept == [pytest.approx(1 / 400)]


def test_the_backlog_of_a_stalled_host_is_dropped_and_counted_not_run_off() -> None:
    wall = Wall()
    clock = clock_on(wall, speed=2.0, stall_limit=1.0)
    wall.now += 5.0
    assert clock.due(0, wall.now, UNLIMITED) == 2
    assert clock.dropped_ticks == 5 * 800 - 2
    assert clock.late_ticks == 0
    wall.sleep(clock.remaining(2))
    assert clock.due(2, wall.now, UNLIMITED) == 4


def test_a_stall_below_the_limit_is_caught_up_in_full() -> None:
    wall = Wall()
    clock = clock_on(wall, stall_limit=1.0)
    wall.now += 0.99
    assert clock.due(0, wall.now, UNLIMITED) == 396
    assert clock.dropped_ticks == 0


def test_a_host_too_slow_for_the_speed_drops_what_it_cannot_fly_and_says_so() -> None:
    wall = Wall()
    clock = clock_on(wall, speed=10.0)
    tick = 0
    while wall.now < 1e6 + 60.0:
        reached = clock.due(tick, wall.now, 100)
        wall.now += (reached - tick) * 0.5e-3  # 2000 ticks a second, 4000 are wanted
        wall.sleep(clock.remaining(reached))
        tick = reached
    assert tick == pytest.approx(60 * 2000, rel=0.01)
    assert clock.dropped_ticks + tick == pytest.approx(60 * 4000, rel=0.03)


def test_starting_again_after_a_hold_makes_no_tick_of_the_pause() -> None:
    wall = Wall()
    clock = clock_on(wall)
    wall.now += 100.0
    clock.start(7)
    assert clock.due(7, wall.now, UNLIMITED) == 7
    wall.now += 1 / 400
    assert clock.due(7, wall.now, UNLIMITED) == 8
    assert clock.late_ticks == clock.dropped_ticks == 0


def test_unlimited_speed_never_sleeps_and_is_never_late() -> None:
    wall = Wall()
    clock = clock_on(wall, math.inf)
    assert clock.due(5, wall.now + 99.0, limit=100) == 105
    wall.sleep(clock.remaining(105))
    assert wall.slept == []
    assert clock.late_ticks == clock.dropped_ticks == 0


@pytest.mark.parametrize("speed", [0.0, -1.0, math.nan])
def test_a_speed_that_is_not_positive_is_refused(speed: float) -> None:
    with pytest.raises(ValueError, match="speed: expected a positive number"):
        Clock(speed)
