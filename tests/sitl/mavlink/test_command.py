"""The command protocol: one answer for each command, retransmissions, what takes time, what is unknown."""

import math
import random
import struct

import pytest

from sitl.mavlink.command import NEXT_TRY, Command, CommandService, Running
from sitl.mavlink.dialect import tiltwing as mav
from tests.sitl.mavlink.in_memory import Desk

ARM, CHECK, CALIBRATE = (
    mav.MAV_CMD_COMPONENT_ARM_DISARM, mav.MAV_CMD_RUN_PREARM_CHECKS, mav.MAV_CMD_PREFLIGHT_CALIBRATION,
)  # fmt: skip
OURS = 31500  # a number that no command has


@pytest.fixture
def commands(desk: Desk) -> list[Command]:
    """Commands of a number of the test's own that were carried out."""
    carried_out: list[Command] = []
    desk.face.service(CommandService).handlers[OURS] = carried_out.append
    return carried_out


def test_every_command_there_is_gets_one_answer_whatever_its_parameters(desk: Desk) -> None:
    known = [command for command in mav.enums["MAV_CMD"] if command <= 0xFFFF]
    skipped = {mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN}
    for command in sorted({*known, OURS} - skipped):
        for value in (math.nan, math.inf, -1.0, 1e30):
            desk.received.clear()
            desk.command(command, *[value] * 7)
            [answer] = desk.of("COMMAND_ACK")
            assert (answer.command, answer.target_system, answer.target_component) == (command, 255, 190)
            desk.received.clear()
            desk.send(
                "COMMAND_INT", command=command, frame=int(min(abs(value), 255.0)) if not math.isnan(value) else 0,
                param1=value, param2=value, param3=value, param4=value, x=-(2**31), y=2**31 - 1, z=value,
            )  # fmt: skip
            assert len(desk.of("COMMAND_ACK")) == 1, command
    assert desk.face.internal_errors == 0
    assert not desk.simulation.flight.armed


def test_random_bits_as_parameters_get_answers_too(desk: Desk) -> None:
    numbers = random.Random(24)
    served = sorted(
        set(desk.face.service(CommandService).handlers) - {mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, mav.MAV_CMD_USER_2}
    )
    for _ in range(3000):
        values = [numbers.choice((value, round(value) if abs(value) < 1e6 else 1.0)) for value in _floats(numbers)]
        desk.received.clear()
        desk.command(numbers.choice(served), *values)
        assert len(desk.of("COMMAND_ACK")) == 1
    assert desk.face.internal_errors == 0


def _floats(numbers: random.Random) -> tuple[float, ...]:
    return tuple(3.0 if math.isnan(value) else value for value in struct.unpack("<7f", numbers.randbytes(28)))


def test_an_unknown_command_is_unsupported(desk: Desk) -> None:
    assert desk.command(OURS).result == mav.MAV_RESULT_UNSUPPORTED


def test_a_wrong_value_is_denied_with_a_text_that_says_why_to_the_sender_alone(desk: Desk) -> None:
    other = desk.join(250, 190)
    assert desk.command(ARM, 7.0).result == mav.MAV_RESULT_DENIED
    assert desk.of("STATUSTEXT")[-1].text == "arm: expected 0 or 1, got 7"
    assert other.of("STATUSTEXT") == []


def test_what_cannot_be_done_now_is_rejected_for_the_time_being(desk: Desk) -> None:
    assert desk.command(mav.MAV_CMD_DO_VTOL_TRANSITION, 4).result == mav.MAV_RESULT_TEMPORARILY_REJECTED
    assert "on the ground" in desk.of("STATUSTEXT")[-1].text


def test_a_retransmission_is_acknowledged_again_and_not_carried_out_again(desk: Desk, commands: list[Command]) -> None:
    for confirmation in range(4):
        assert desk.command(OURS, 1.0, confirmation=confirmation).result == mav.MAV_RESULT_ACCEPTED
    assert len(commands) == 1


def test_the_first_that_arrives_is_carried_out_though_it_is_a_retransmission(
    desk: Desk, commands: list[Command]
) -> None:
    desk.command(OURS, 1.0, confirmation=2)
    assert len(commands) == 1


def test_the_same_command_given_again_is_carried_out_again(desk: Desk, commands: list[Command]) -> None:
    desk.command(OURS, 1.0)
    desk.command(OURS, 1.0)
    desk.command(OURS, 2.0, confirmation=1)  # other parameters: another command
    assert len(commands) == 3


def test_two_stations_do_not_take_each_others_for_retransmissions(desk: Desk, commands: list[Command]) -> None:
    desk.command(OURS, 1.0)
    desk.join(250, 190).command(OURS, 1.0, confirmation=1)
    assert len(commands) == 2


@pytest.mark.parametrize(
    ("target", "is_ours"), [((0, 0), True), ((1, 0), True), ((0, 1), True), ((2, 1), False), ((1, 154), False)]
)
def test_only_commands_for_us_are_answered(desk: Desk, target: tuple[int, int], is_ours: bool) -> None:
    system, component = target
    answer = desk.command(CHECK, target_system=system, target_component=component)
    assert (answer is not None) is is_ours


def test_places_of_command_int_are_degrees_metres_or_unset(desk: Desk, commands: list[Command]) -> None:
    taken = desk.face.service(CommandService).handlers
    taken[mav.MAV_CMD_DO_REPOSITION] = taken[OURS]
    located = {"command": mav.MAV_CMD_DO_REPOSITION}
    desk.send("COMMAND_INT", **located, frame=mav.MAV_FRAME_GLOBAL_INT, x=473977420, y=-85455940, z=12.5)
    desk.send("COMMAND_INT", **located, frame=mav.MAV_FRAME_LOCAL_NED, x=12345, y=2**31 - 1)
    first, second = commands
    assert first.params[4:] == pytest.approx((47.397742, -8.545594, 12.5))
    assert (first.frame, second.frame) == (mav.MAV_FRAME_GLOBAL_INT, mav.MAV_FRAME_LOCAL_NED)
    assert second.params[4] == pytest.approx(1.2345)
    assert math.isnan(second.params[5])


def test_fifth_and_sixth_parameter_that_are_no_place_are_numbers_in_a_command_int_too(
    desk: Desk, commands: list[Command]
) -> None:
    desk.send("COMMAND_INT", command=OURS, frame=mav.MAV_FRAME_GLOBAL, x=201, y=-7, z=0.5)
    desk.send("COMMAND_INT", command=OURS, frame=mav.MAV_FRAME_LOCAL_NED, x=2**31 - 1, y=1)
    assert commands[0].params[4:] == (201.0, -7.0, 0.5)
    assert math.isnan(commands[1].params[4])
    assert commands[1].params[5] == 1.0


def test_what_takes_time_says_so_until_it_is_done(desk: Desk) -> None:
    running = Running()
    desk.face.service(CommandService).handlers[OURS] = lambda _: running
    assert desk.command(OURS).result == mav.MAV_RESULT_IN_PROGRESS
    running.progress(40.0)
    answer = desk.of("COMMAND_ACK")[-1]
    assert (answer.result, answer.progress) == (mav.MAV_RESULT_IN_PROGRESS, 40)
    desk.received.clear()
    desk.wait(3.5)
    assert [answer.result for answer in desk.of("COMMAND_ACK")] == [mav.MAV_RESULT_IN_PROGRESS] * 3
    running.finish(mav.MAV_RESULT_ACCEPTED)
    assert desk.of("COMMAND_ACK")[-1].result == mav.MAV_RESULT_ACCEPTED
    desk.received.clear()
    desk.wait(3.5)
    assert desk.of("COMMAND_ACK") == []
    assert desk.command(OURS, confirmation=1).result == mav.MAV_RESULT_ACCEPTED  # how it ended, once more


def test_while_it_runs_it_is_not_begun_anew(desk: Desk) -> None:
    begun: list[Running] = []
    desk.face.service(CommandService).handlers[OURS] = lambda _: begun.append(Running()) or begun[-1]
    desk.command(OURS, 1.0)
    assert desk.command(OURS, 1.0, confirmation=1).result == mav.MAV_RESULT_IN_PROGRESS
    assert desk.command(OURS, 2.0).result == mav.MAV_RESULT_TEMPORARILY_REJECTED
    assert desk.command(OURS, 1.0).result == mav.MAV_RESULT_TEMPORARILY_REJECTED  # no retransmission: wanted once more
    assert len(begun) == 1


def test_a_frame_that_the_network_brings_twice_is_one_command(desk: Desk, commands: list[Command]) -> None:
    desk.station.duplicates = 1.0
    desk.command(OURS, 1.0)
    assert len(commands) == 1
    running = Running()
    desk.face.service(CommandService).handlers[OURS] = lambda _: running
    desk.received.clear()
    desk.command(OURS, 2.0)
    assert {answer.result for answer in desk.of("COMMAND_ACK")} == {mav.MAV_RESULT_IN_PROGRESS}


def test_a_command_int_that_comes_again_while_it_runs_may_be_a_retransmission(desk: Desk) -> None:
    running = Running()
    desk.face.service(CommandService).handlers[OURS] = lambda _: running
    for _ in range(2):
        desk.send("COMMAND_INT", command=OURS, param1=1.0)
        assert desk.of("COMMAND_ACK")[-1].result == mav.MAV_RESULT_IN_PROGRESS


def test_what_runs_can_be_cancelled_and_what_does_not_is_left_alone(desk: Desk) -> None:
    ended: list[str] = []
    running = Running(on_cancel=lambda: ended.append("cancelled"))
    desk.face.service(CommandService).handlers[OURS] = lambda _: running
    desk.command(OURS)
    desk.send("COMMAND_CANCEL", command=OURS)
    assert desk.of("COMMAND_ACK")[-1].result == mav.MAV_RESULT_CANCELLED
    count = len(desk.of("COMMAND_ACK"))
    desk.send("COMMAND_CANCEL", command=OURS)
    desk.send("COMMAND_CANCEL", command=CALIBRATE)
    assert ended == ["cancelled"]
    assert len(desk.of("COMMAND_ACK")) == count


def test_answers_are_those_of_the_guide_for_frames_that_do_not_fit(desk: Desk) -> None:
    desk.simulation.reset("trim:20")
    desk.send("COMMAND_INT", command=mav.MAV_CMD_DO_REPOSITION, frame=mav.MAV_FRAME_MISSION, param2=1)
    assert desk.of("COMMAND_ACK")[-1].result == mav.MAV_RESULT_COMMAND_UNSUPPORTED_MAV_FRAME


def test_a_retransmission_whose_first_copy_was_lost_is_carried_out_though_it_was_once_before(
    desk: Desk, commands: list[Command]
) -> None:
    desk.command(OURS, 1.0)
    desk.wait(NEXT_TRY)
    desk.command(OURS, 1.0, confirmation=1)  # of a second one: a retransmission of the first would have come sooner
    assert len(commands) == 2
    desk.wait(NEXT_TRY)
    desk.command(OURS, 1.0, confirmation=3)  # the second one again, after a try that was lost
    assert len(commands) == 2


def test_a_message_asked_for_is_sent_again_to_who_has_not_got_it(desk: Desk) -> None:
    for confirmation in range(3):
        desk.command(mav.MAV_CMD_REQUEST_MESSAGE, mav.MAVLINK_MSG_ID_AUTOPILOT_VERSION, confirmation=confirmation)
    assert len(desk.of("AUTOPILOT_VERSION")) == 3


def test_a_restart_is_no_reason_to_begin_anew_for_its_retransmission(desk: Desk) -> None:
    assert desk.command(mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1).result == mav.MAV_RESULT_ACCEPTED
    flight = desk.simulation.flight
    again = desk.command(mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1, confirmation=1)
    assert again.result == mav.MAV_RESULT_ACCEPTED
    assert desk.simulation.flight is flight
