"""Ping: https://mavlink.io/en/services/ping.html."""

import pytest

from sitl.mavlink.dialect import tiltwing as mav
from tests.sitl.mavlink.in_memory import Desk


def test_a_question_to_everybody_is_answered_to_its_asker_with_his_own_numbers(desk: Desk) -> None:
    other = desk.join(system=200)
    largest = {"time_usec": (1 << 64) - 1, "seq": (1 << 32) - 1}
    desk.send("PING", **largest, target_system=0, target_component=0)
    (answer,) = desk.of("PING")
    assert {"time_usec": answer.time_usec, "seq": answer.seq} == largest
    assert (answer.target_system, answer.target_component) == (255, 190)
    assert [message.target_system for message in other.of("PING")] == [0]  # the question, passed on


@pytest.mark.parametrize("target", [(1, 1), (1, 0), (0, 1)])
def test_an_answer_is_never_answered(desk: Desk, target: tuple[int, int]) -> None:
    desk.send("PING", time_usec=1, seq=1, target_system=target[0], target_component=target[1])
    assert desk.of("PING") == []


def test_streamed_it_asks_everybody_with_rising_numbers(desk: Desk) -> None:
    desk.command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, mav.MAVLINK_MSG_ID_PING, 1_000_000)
    desk.advance(0.5)  # the first one comes at once
    desk.received.clear()
    desk.advance(5.0)
    asked = desk.of("PING")
    assert [each.time_usec for each in asked] == [1_000_000 * number for number in range(1, 6)]
    assert [each.seq - asked[0].seq for each in asked] == [0, 1, 2, 3, 4]
    assert {(each.target_system, each.target_component) for each in asked} == {(0, 0)}
