"""Timers: in order, once, and not after they are cancelled."""

import math

from sitl.mavlink.timers import Timers


def test_calls_are_made_in_the_order_in_which_they_are_due() -> None:
    timers, made = Timers(), list[str]()
    timers.at(2.0, lambda: made.append("late"))
    timers.at(1.0, lambda: made.append("early"))
    timers.at(1.0, lambda: made.append("as early, set later"))
    assert timers.next_due == 1.0
    timers.run(0.9)
    assert made == []
    timers.run(1.0)
    assert made == ["early", "as early, set later"]
    timers.run(5.0)
    timers.run(6.0)
    assert made == ["early", "as early, set later", "late"]
    assert timers.next_due == math.inf


def test_a_cancelled_call_is_not_made() -> None:
    timers, made = Timers(), list[str]()
    timer = timers.at(1.0, lambda: made.append("never"))
    timer.cancel()
    timer.cancel()
    timers.run(2.0)
    assert made == []


def test_a_call_may_set_another_and_cancel_one_that_is_due_with_it() -> None:
    timers, made = Timers(), list[str]()
    second = None

    def first() -> None:
        assert second is not None
        second.cancel()
        timers.at(0.0, lambda: made.append("next run"))

    timers.at(1.0, first)
    second = timers.at(1.0, lambda: made.append("never"))
    timers.run(1.0)
    assert made == []
    timers.run(1.0)
    assert made == ["next run"]
