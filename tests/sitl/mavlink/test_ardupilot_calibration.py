"""Calibration with ArduPilot's ground stations: what MAVProxy, Mission Planner and QGroundControl wait for."""

from collections.abc import Iterator

import pytest

from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.identity import IDENTITIES
from tests.sitl.mavlink.in_memory import Desk

ACCEPTED, FAILED = mav.MAV_RESULT_ACCEPTED, mav.MAV_RESULT_FAILED
START, ACCEPT, CANCEL = mav.MAV_CMD_DO_START_MAG_CAL, mav.MAV_CMD_DO_ACCEPT_MAG_CAL, mav.MAV_CMD_DO_CANCEL_MAG_CAL
POSITION = mav.MAV_CMD_ACCELCAL_VEHICLE_POS
CALIBRATE = mav.MAV_CMD_PREFLIGHT_CALIBRATION
SIX_SIDES = (0, 0, 0, 0, 1, 0, 0)


@pytest.fixture
def ardupilot() -> Iterator[Desk]:
    desk = Desk(identity=IDENTITIES["ardupilot"])
    desk.advance(0.5)
    yield desk
    desk.close()


def asked(desk: Desk) -> list[int]:
    """Positions the vehicle has asked for, or told as the end."""
    return [int(message.param1) for message in desk.of("COMMAND_LONG") if message.command == POSITION]


def test_the_compass_tells_its_progress_and_then_reports_until_it_is_accepted(ardupilot: Desk) -> None:
    assert ardupilot.command(START, 0, 0, 1, 0, 0, 0, 0).result == ACCEPTED  # as MAVProxy does
    assert ardupilot.command(ACCEPT, 0).result == FAILED  # there is nothing yet
    ardupilot.wait(6.0)
    told = [message.completion_pct for message in ardupilot.of("MAG_CAL_PROGRESS")]
    assert told == sorted(told)
    assert told[-1] == 100
    report = ardupilot.of("MAG_CAL_REPORT")[0]
    assert (report.cal_status, report.cal_mask, report.autosaved) == (mav.MAG_CAL_SUCCESS, 1, 1)
    assert ardupilot.command(ACCEPT, 1).result == ACCEPTED
    ardupilot.received.clear()
    ardupilot.wait(2.0)
    assert ardupilot.of("MAG_CAL_REPORT") == []


def test_the_compass_can_be_cancelled_and_a_cancellation_alone_is_accepted(ardupilot: Desk) -> None:
    assert ardupilot.command(CANCEL).result == ACCEPTED  # QGroundControl asks so whether there is this service
    ardupilot.command(START, 1, 0, 1)
    ardupilot.wait(1.0)
    assert ardupilot.command(CANCEL).result == ACCEPTED
    ardupilot.received.clear()
    ardupilot.wait(2.0)
    assert ardupilot.of("MAG_CAL_PROGRESS") == []
    assert ardupilot.command(START, 6).result == mav.MAV_RESULT_DENIED


@pytest.mark.parametrize("by_command", [True, False])
def test_the_accelerometer_is_laid_on_its_six_sides(ardupilot: Desk, by_command: bool) -> None:
    other = ardupilot.join(250, 190)
    assert ardupilot.command(CALIBRATE, *SIX_SIDES).result == ACCEPTED
    for side in range(1, 7):
        ardupilot.wait(2.5)
        assert asked(ardupilot)[-1] == side
        assert ardupilot.texts[-1].startswith("Place vehicle ")
        other.send("COMMAND_ACK", command=1, result=0)  # of somebody else, who means something else
        assert ardupilot.command(POSITION, side % 6 + 1).result == FAILED
        if by_command:
            assert ardupilot.command(POSITION, side).result == ACCEPTED
        else:
            ardupilot.send("COMMAND_ACK", command=side, result=1)
    assert asked(ardupilot)[-1] == mav.ACCELCAL_VEHICLE_POS_SUCCESS
    assert ardupilot.texts[-1] == "Calibration successful"
    ardupilot.received.clear()
    ardupilot.wait(5.0)
    assert asked(ardupilot) == []
    assert ardupilot.command(POSITION, 1).result == FAILED
    assert asked(ardupilot) == []


def test_a_pilot_who_never_lays_it_down_fails_in_the_end(ardupilot: Desk) -> None:
    ardupilot.command(CALIBRATE, *SIX_SIDES)
    assert ardupilot.wait_until(lambda: mav.ACCELCAL_VEHICLE_POS_FAILED in asked(ardupilot), 400.0)


def test_all_zeros_and_a_restart_end_it(ardupilot: Desk) -> None:
    for end in ((CALIBRATE, *[0] * 7), (mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1)):
        ardupilot.command(CALIBRATE, *SIX_SIDES)
        assert ardupilot.command(*end).result == ACCEPTED
        ardupilot.received.clear()
        ardupilot.wait(5.0)
        assert asked(ardupilot) == []


def test_none_of_it_is_there_for_others(desk: Desk) -> None:
    assert desk.command(START, 0).result == mav.MAV_RESULT_UNSUPPORTED
    desk.command(CALIBRATE, *SIX_SIDES)
    assert desk.texts[0] == "[cal] calibration started: 2 accel"
