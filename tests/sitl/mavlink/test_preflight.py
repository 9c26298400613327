"""What is done on the ground: checks, calibration as ground stations parse it, reboot, and a start anywhere."""

import math
import re

import pytest

from sitl.flight.mode import Mode
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.preflight import RESTART
from sitl.simulation import Simulation
from tests.sitl.mavlink.in_memory import Desk

ACCEPTED, DENIED, LATER = mav.MAV_RESULT_ACCEPTED, mav.MAV_RESULT_DENIED, mav.MAV_RESULT_TEMPORARILY_REJECTED
CALIBRATE = mav.MAV_CMD_PREFLIGHT_CALIBRATION


def test_the_checks_tell_everything_that_speaks_against_arming(desk: Desk) -> None:
    desk.advance(0.5)
    assert desk.command(mav.MAV_CMD_RUN_PREARM_CHECKS).result == ACCEPTED
    assert desk.texts == ["Preflight: ready to arm"]
    desk.simulation.flight.parameters.set("COM_ARM_BAT_MIN", 1.0)
    desk.simulation.airframe.craft["battery"]["charge"] *= 0.5
    desk.advance(0.1)
    desk.received.clear()
    assert desk.command(mav.MAV_CMD_RUN_PREARM_CHECKS).result == ACCEPTED
    assert desk.texts == ["Preflight: battery at 49.9 %, at least 100 %"]
    desk.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1, 21196)
    assert desk.command(mav.MAV_CMD_RUN_PREARM_CHECKS).result == LATER


@pytest.mark.parametrize(
    ("place", "value", "sensor"),
    [(0, 1, "gyro"), (1, 1, "mag"), (2, 1, "baro"), (4, 1, "accel"), (4, 2, "level"), (5, 1, "airspeed")],
)
def test_a_calibration_says_what_ground_stations_of_px4_parse(desk: Desk, place: int, value: int, sensor: str) -> None:
    params = [0.0] * 7
    params[place] = value
    assert desk.command(CALIBRATE, *params).result == ACCEPTED
    desk.wait(10.0)
    texts = desk.texts
    assert texts[0] == f"[cal] calibration started: 2 {sensor}"
    assert texts[-1] == f"[cal] calibration done: {sensor}"
    progress = [int(found[1]) for text in texts if (found := re.fullmatch(r"\[cal\] progress <(\d+)>", text))]
    assert progress == sorted(progress)
    assert (progress[0], progress[-1]) == (0, 100)
    assert max(map(len, texts)) <= 50  # what is parsed must be in one message
    sides = [text for text in texts if text.endswith("side done, rotate to a different side")]
    assert len(sides) == (6 if sensor in ("accel", "mag") else 0)
    assert len(desk.of("COMMAND_ACK")) == 1


def test_a_calibration_is_stopped_by_whoever_began_it_and_by_others(desk: Desk) -> None:
    for stopper in (desk.station, desk.join(250)):
        desk.command(CALIBRATE, 1, 0, 0, 0, 0, 0, 0)
        desk.wait(0.5)
        desk.received.clear()
        assert stopper.command(CALIBRATE, *[0] * 7).result == ACCEPTED
        desk.wait(5.0)
        assert desk.texts == ["[cal] calibration cancelled"]


def test_whoever_stops_a_calibration_is_answered_before_it_is_told_as_mavsdk_needs_it(desk: Desk) -> None:
    desk.command(CALIBRATE, 1, 0, 0, 0, 0, 0, 0)
    desk.received.clear()
    desk.command(CALIBRATE, *[0] * 7)
    desk.wait(1.0)
    kinds = [message.get_type() for message in desk.received]
    assert [kind for kind in kinds if kind in ("COMMAND_ACK", "STATUSTEXT")] == ["COMMAND_ACK", "STATUSTEXT"]


def test_one_calibration_at_a_time_and_none_while_armed(desk: Desk) -> None:
    desk.advance(0.5)
    desk.command(CALIBRATE, 1, 0, 0, 0, 0, 0, 0)
    assert desk.join(250, 190).command(CALIBRATE, 0, 1, 0, 0, 0, 0, 0).result == LATER
    desk.wait(5.0)
    desk.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1)
    assert desk.command(CALIBRATE, 0, 1, 0, 0, 0, 0, 0).result == LATER
    assert desk.join(251, 190).command(CALIBRATE, 1, 1, 0, 0, 0, 0, 0).result == DENIED
    assert desk.join(252, 190).command(CALIBRATE, 0, 0, 0, 0, 9, 0, 0).result == DENIED


def test_a_reboot_begins_anew_and_keeps_what_was_uploaded(desk: Desk) -> None:
    desk.simulation.load_plan("docs/examples/survey_3km.plan")
    desk.simulation.flight.parameters.set("MIS_TAKEOFF_ALT", 33.0)
    desk.advance(3.0)
    before = desk.simulation.flight
    items = before.mission.items
    assert desk.command(mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1).result == ACCEPTED
    flight = desk.simulation.flight
    assert flight is not before
    assert desk.simulation.time == 0.0
    assert flight.mission.items == items
    assert flight.parameters["MIS_TAKEOFF_ALT"] == 33.0
    desk.received.clear()
    desk.advance(1.0)
    assert desk.of("ATTITUDE")[-1].time_boot_ms <= 1000
    assert len(desk.of("ATTITUDE")) == 50
    assert desk.face.internal_errors == 0


def test_no_reboot_in_flight_but_by_force() -> None:
    desk = Desk(Simulation(start="trim:20"))
    desk.advance(1.0)
    assert desk.command(mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1).result == LATER
    assert desk.command(mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1, 0, 0, 0, 0, 20190226).result == ACCEPTED
    assert desk.simulation.time == 0.0
    assert desk.command(mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 7, 0, 0, 0, 0, 20190226).result == DENIED
    desk.close()


def test_a_shutdown_is_for_the_process_to_carry_out(desk: Desk) -> None:
    assert desk.command(mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 2).result == ACCEPTED
    assert desk.face.stop_wanted


def test_the_vehicle_can_be_put_anywhere(desk: Desk) -> None:
    desk.advance(5.0)
    latitude, longitude, _ = desk.simulation.flight.places.to_geodetic(300.0, -200.0, 0.0)
    assert desk.command(RESTART, 2, 25.0, 90.0, math.nan, latitude, longitude, 150.0).result == ACCEPTED
    flight, view = desk.simulation.flight, desk.simulation.flight.view
    assert desk.simulation.time == 0.0
    assert (flight.mode, flight.armed) == (Mode.HOLD, True)
    assert (view.north, view.east) == pytest.approx((300.0, -200.0), abs=3.0)
    assert flight.height == pytest.approx(150.0, abs=0.1)
    assert view.airspeed == pytest.approx(25.0, abs=0.1)
    assert view.yaw == pytest.approx(math.pi / 2, abs=0.02)
    assert desk.command(RESTART, 1, math.nan, 45.0, math.nan, latitude, longitude).result == ACCEPTED
    flight, view = desk.simulation.flight, desk.simulation.flight.view
    assert not flight.armed
    assert (view.north, view.east) == pytest.approx((300.0, -200.0), abs=3.0)
    assert view.yaw == pytest.approx(math.radians(45.0), abs=0.02)
    assert desk.command(RESTART, 0).result == ACCEPTED
    assert math.hypot(desk.simulation.flight.view.north, desk.simulation.flight.view.east) < 0.1


@pytest.mark.parametrize(
    "params", [(3,), (math.nan,), (2,), (2, -5.0), (2, math.inf), (1, math.nan, math.inf)]
)  # fmt: skip
def test_a_start_that_is_none_is_denied(desk: Desk, params: tuple[float, ...]) -> None:
    desk.advance(0.5)
    assert desk.command(RESTART, *params).result == DENIED
    assert desk.simulation.time == 0.5


def test_a_start_that_cannot_be_flown_fails_with_the_reason_and_changes_nothing(desk: Desk) -> None:
    desk.advance(0.5)
    flight = desk.simulation.flight
    assert desk.command(RESTART, 2, 99.0).result == mav.MAV_RESULT_FAILED
    assert desk.texts[-1].startswith("not restarted: ")
    assert desk.simulation.flight is flight
    desk.advance(0.5)
    assert desk.simulation.time == 1.0
