"""A script's order of events, on invented time: what waits for what, and what a refusal does."""

from collections.abc import Sequence
from typing import Any, cast

import pytest

from sitl.flight.refused import Refused
from sitl.scenario import Script, Step
from sitl.scenario.stage import Action, Stage, Trigger


class Play:
    """Steps that note when they are carried out, and a switch for them to wait for."""

    def __init__(self) -> None:
        self.notes: list[str] = []
        self.said: list[tuple[int, str]] = []
        self.switch = False

    def say(self, severity: int, text: str) -> None:
        self.said.append((severity, text))

    def note(self, text: str) -> Action:
        return lambda _: self.notes.append(text)

    def switched(self) -> Trigger:
        return lambda _: lambda: self.switch

    def script(self, steps: Sequence[Step]) -> Script:
        return Script(steps, cast("Stage", self))


@pytest.fixture
def play() -> Play:
    return Play()


def step(play: Play, text: str, **when: Any) -> Step:
    return Step(text, play.note(text), **when)


def test_steps_with_a_time_happen_at_it_in_time_even_if_the_file_has_them_the_other_way_round(play: Play) -> None:
    script = play.script([step(play, "late", at=2.0), step(play, "early", at=1.0)])
    for tick in range(101):
        script.update(tick / 50)
        assert play.notes == ([] if tick < 50 else ["early"] if tick < 100 else ["early", "late"])
    assert script.finished


def test_a_step_without_a_time_follows_the_one_before_it_at_once(play: Play) -> None:
    script = play.script([step(play, "first", at=1.0), step(play, "second"), step(play, "third")])
    script.update(0.98)
    assert play.notes == []
    script.update(1.0)
    assert play.notes == ["first", "second", "third"]


def test_an_event_counts_only_from_the_steps_turn_and_its_delay_from_the_event(play: Play) -> None:
    waiting = step(play, "then", trigger=play.switched(), after=0.5)
    script = play.script([step(play, "first", at=1.0), waiting])
    play.switch = True
    script.update(0.0)
    play.switch = False
    script.update(1.0)
    script.update(2.0)
    assert play.notes == ["first"]
    play.switch = True
    script.update(3.0)
    play.switch = False  # an event that has been stays one
    script.update(3.48)
    assert play.notes == ["first"]
    script.update(3.5)
    assert play.notes == ["first", "then"]


def test_a_step_that_is_refused_is_told_with_its_reason_and_the_next_one_goes_on(play: Play) -> None:
    def refuse(_: Stage) -> None:
        raise Refused("not level")

    def cannot(_: Stage) -> None:
        raise ValueError("angle: expected one of the servo's travel")

    script = play.script([Step("arm", refuse), Step("fail tilt 400", cannot), step(play, "next")])
    script.update(0.0)
    assert play.notes == ["next"]
    assert play.said == [
        (4, "Scenario: 'arm' refused: not level"),
        (4, "Scenario: 'fail tilt 400' refused: angle: expected one of the servo's travel"),
    ]
    assert script.finished
