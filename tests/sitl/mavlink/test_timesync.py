"""Time synchronisation: https://mavlink.io/en/services/timesync.html."""

import pytest

from sitl.mavlink.dialect import tiltwing as mav
from tests.sitl.mavlink.in_memory import Desk


@pytest.mark.parametrize("target", [{}, {"target_system": 0, "target_component": 0}])
def test_a_question_is_answered_to_its_asker_with_both_times(desk: Desk, target: dict[str, int]) -> None:
    other = desk.join(system=200)
    desk.advance(2.5)
    desk.send("TIMESYNC", tc1=0, ts1=123456789, **target)
    (answer,) = desk.of("TIMESYNC")
    assert (answer.tc1, answer.ts1) == (2_500_000_000, 123456789)
    assert (answer.target_system, answer.target_component) == (255, 190)
    assert all(message.tc1 == 0 for message in other.of("TIMESYNC"))  # questions are passed on, answers are not


def test_at_time_zero_the_answer_is_not_taken_for_a_question(desk: Desk) -> None:
    desk.send("TIMESYNC", tc1=0, ts1=5)
    assert desk.of("TIMESYNC")[0].tc1 > 0


@pytest.mark.parametrize(
    "fields", [{"tc1": 1}, {"tc1": -1}, {"tc1": 0, "target_system": 7}, {"tc1": 0, "target_component": 7}]
)
def test_answers_and_questions_to_others_are_not_answered(desk: Desk, fields: dict[str, int]) -> None:
    desk.send("TIMESYNC", ts1=5, **fields)
    assert desk.of("TIMESYNC") == []


def test_streamed_it_asks_everybody_for_the_time(desk: Desk) -> None:
    desk.command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, mav.MAVLINK_MSG_ID_TIMESYNC, 100_000)
    desk.advance(0.05)  # the first one comes at once
    desk.received.clear()
    desk.advance(2.0)
    asked = desk.of("TIMESYNC")
    assert len(asked) == 20
    assert {(each.tc1, each.target_system, each.target_component) for each in asked} == {(0, 0, 0)}
    assert [each.ts1 for each in asked] == [100_000_000 * number for number in range(1, 21)]
