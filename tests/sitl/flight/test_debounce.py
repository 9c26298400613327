"""Timing of a condition."""

from sitl.flight.debounce import Debounce


def test_counts_from_where_the_condition_began() -> None:
    timer = Debounce()
    assert [timer.held(t >= 2.0, t) for t in (1.0, 2.0, 3.0, 5.0)] == [-1.0, 0.0, 1.0, 3.0]


def test_a_break_begins_anew() -> None:
    timer = Debounce()
    timer.held(True, 0.0)
    assert timer.held(False, 1.0) == -1.0
    assert timer.held(True, 2.0) == 0.0


def test_a_time_before_the_beginning_begins_anew() -> None:
    timer = Debounce()
    timer.held(True, 100.0)
    assert timer.held(True, 0.0) == 0.0
    assert timer.held(True, 1.0) == 1.0
