"""Commands of MAVLink become what the flight does; every number means what MAV_CMD says it means."""

import math
from collections.abc import Iterator

import pytest

from sitl.flight.mission_items import Command as Item
from sitl.flight.mission_items import MissionItem
from sitl.flight.mode import Mode
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.identity import IDENTITIES
from sitl.simulation import Simulation
from tests.sitl.mavlink.in_memory import Desk

NAN = math.nan
ACCEPTED, DENIED, LATER = mav.MAV_RESULT_ACCEPTED, mav.MAV_RESULT_DENIED, mav.MAV_RESULT_TEMPORARILY_REJECTED


@pytest.fixture
def hovering() -> Iterator[Desk]:
    """A vehicle that hovers 100 m above home."""
    desk = Desk(Simulation(start="trim:0"))
    desk.advance(0.1)
    yield desk
    desk.close()


@pytest.fixture
def cruising() -> Iterator[Desk]:
    desk = Desk(Simulation(start="trim:20"))
    desk.advance(0.1)
    yield desk
    desk.close()


def int_command(desk: Desk, command: int, frame: int, *params: float, place: tuple[int, int, float]) -> int:
    numbered = {f"param{n}": value for n, value in enumerate([*params, *[NAN] * 4][:4], start=1)}
    desk.send("COMMAND_INT", command=command, frame=frame, x=place[0], y=place[1], z=place[2], **numbered)
    return desk.of("COMMAND_ACK")[-1].result


def test_arm_take_off_and_land(desk: Desk) -> None:
    desk.advance(0.5)
    flight = desk.simulation.flight
    assert desk.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1, 0).result == ACCEPTED
    assert flight.armed
    assert desk.command(mav.MAV_CMD_NAV_TAKEOFF, NAN, NAN, NAN, NAN, NAN, NAN, NAN).result == ACCEPTED
    desk.until(lambda: flight.mode == Mode.HOLD and flight.flying, 60.0)
    assert flight.height == pytest.approx(flight.parameters["MIS_TAKEOFF_ALT"], abs=0.6)
    assert desk.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 0, 0).result == LATER  # in the air
    assert desk.command(mav.MAV_CMD_NAV_LAND, NAN, NAN, NAN, NAN, 0, 0, 0).result == ACCEPTED
    desk.until(lambda: not flight.armed, 90.0)


@pytest.mark.parametrize(
    ("identity", "frame", "altitude"),
    [("px4", None, 518.0), ("ardupilot", None, 30.0), ("px4", 0, 518.0), ("px4", 3, 30.0), ("ardupilot", 6, 30.0)],
)
def test_a_take_off_goes_to_the_altitude_of_its_frame(identity: str, frame: int | None, altitude: float) -> None:
    desk = Desk(identity=IDENTITIES[identity])  # home is 488 m above sea level
    desk.advance(0.5)
    desk.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1)
    if frame is None:
        assert desk.command(mav.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, NAN, NAN, NAN, altitude).result == ACCEPTED
    else:
        place = (2**31 - 1, 2**31 - 1, altitude)
        assert int_command(desk, mav.MAV_CMD_NAV_TAKEOFF, frame, place=place) == ACCEPTED
    desk.until(lambda: desk.simulation.flight.mode == Mode.HOLD, 60.0)
    desk.advance(3.0)
    assert desk.simulation.flight.height == pytest.approx(30.0, abs=0.4)
    desk.close()


def test_arming_is_refused_with_the_reason_and_forced_by_its_number(desk: Desk) -> None:
    desk.advance(0.5)
    desk.simulation.flight.parameters.set("COM_ARM_BAT_MIN", 1.0)
    desk.simulation.airframe.craft["battery"]["charge"] *= 0.5
    desk.advance(0.1)
    assert desk.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1, 0).result == LATER
    assert "battery at 49.9 %" in desk.of("STATUSTEXT")[0].text
    assert desk.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1, 21196).result == ACCEPTED


def test_transitions_both_ways(hovering: Desk) -> None:
    assert hovering.command(mav.MAV_CMD_DO_VTOL_TRANSITION, 4).result == ACCEPTED
    hovering.until(lambda: hovering.simulation.flight.regime.name == "CRUISE", 30.0)
    assert hovering.command(mav.MAV_CMD_DO_VTOL_TRANSITION, 3).result == ACCEPTED
    hovering.until(lambda: hovering.simulation.flight.regime.name == "HOVER", 60.0)
    for wrong in (0, 5, NAN):
        assert hovering.command(mav.MAV_CMD_DO_VTOL_TRANSITION, wrong).result == DENIED


@pytest.mark.parametrize(("frame", "altitude"), [(0, 578.0), (5, 578.0), (3, 90.0), (6, 90.0), (10, 90.0), (11, 90.0)])
def test_reposition_goes_to_the_place_in_its_frame(hovering: Desk, frame: int, altitude: float) -> None:
    flight = hovering.simulation.flight
    latitude, longitude, _ = flight.places.to_geodetic(12.0, -9.0, 0.0)
    place = (round(latitude * 1e7), round(longitude * 1e7), altitude)
    assert int_command(hovering, mav.MAV_CMD_DO_REPOSITION, frame, -1, 1, NAN, math.pi / 2, place=place) == ACCEPTED
    hovering.advance(25.0)
    view = flight.view
    assert (view.north, view.east) == pytest.approx((12.0, -9.0), abs=0.6)
    assert flight.height == pytest.approx(90.0, abs=0.6)
    assert view.yaw == pytest.approx(math.pi / 2, abs=0.1)


def test_reposition_in_the_local_frame(hovering: Desk) -> None:
    place = (50000, -80000, -95.0)  # 1e-4 m
    assert int_command(hovering, mav.MAV_CMD_DO_REPOSITION, 1, -1, 1, place=place) == ACCEPTED
    hovering.advance(20.0)
    view = hovering.simulation.flight.view
    assert (view.north, view.east, view.down) == pytest.approx((5.0, -8.0, -95.0), abs=0.6)


def test_reposition_out_of_another_mode_needs_its_flag(hovering: Desk) -> None:
    hovering.command(mav.MAV_CMD_NAV_RETURN_TO_LAUNCH)
    place = (473978000, 85457000, 560.0)
    assert int_command(hovering, mav.MAV_CMD_DO_REPOSITION, 0, -1, 0, place=place) == LATER
    assert hovering.simulation.flight.mode == Mode.RETURN
    assert int_command(hovering, mav.MAV_CMD_DO_REPOSITION, 0, -1, 1, place=place) == ACCEPTED
    assert hovering.simulation.flight.mode == Mode.HOLD


def test_an_orbit_has_its_centre_radius_and_sense(cruising: Desk) -> None:
    flight = cruising.simulation.flight
    latitude, longitude, _ = flight.places.to_geodetic(150.0, 50.0, 0.0)
    place = (round(latitude * 1e7), round(longitude * 1e7), 590.0)
    assert int_command(cruising, mav.MAV_CMD_DO_ORBIT, 5, -120.0, 20.0, 3.0, place=place) == ACCEPTED
    assert flight.mode == Mode.ORBIT
    cruising.advance(60.0)
    view = flight.view
    assert math.hypot(view.north - 150.0, view.east - 50.0) == pytest.approx(120.0, abs=3.0)
    turning = (view.north - 150.0) * view.ve - (view.east - 50.0) * view.vn
    assert turning < 0.0  # counter-clockwise seen from above
    assert int_command(cruising, mav.MAV_CMD_DO_ORBIT, 5, 100.0, 20.0, 9.0, place=place) == DENIED


def test_speeds_and_heights_are_changed(cruising: Desk) -> None:
    assert cruising.command(mav.MAV_CMD_DO_CHANGE_SPEED, 0, 25.0, -1).result == ACCEPTED
    assert cruising.command(mav.MAV_CMD_DO_CHANGE_ALTITUDE, 120.0, 3).result == ACCEPTED
    cruising.advance(40.0)
    flight = cruising.simulation.flight
    assert flight.view.airspeed == pytest.approx(25.0, abs=0.5)
    assert flight.height == pytest.approx(120.0, abs=1.0)
    assert cruising.command(mav.MAV_CMD_DO_CHANGE_SPEED, 0, -1.0).result == ACCEPTED
    assert cruising.command(mav.MAV_CMD_DO_CHANGE_SPEED, 0, -2.0).result == ACCEPTED
    cruising.advance(20.0)
    assert flight.view.airspeed == pytest.approx(flight.parameters["FW_AIRSPD_TRIM"], abs=0.5)
    for kind, speed in ((2, 3.0), (0, 99.0), (0, NAN), (NAN, 20.0)):
        assert cruising.command(mav.MAV_CMD_DO_CHANGE_SPEED, kind, speed).result == DENIED


def test_home_moves_here_or_to_a_place_and_is_told(cruising: Desk) -> None:
    flight = cruising.simulation.flight
    cruising.advance(5.0)
    assert cruising.command(mav.MAV_CMD_DO_SET_HOME, 1).result == ACCEPTED
    assert flight.home.north == pytest.approx(flight.view.north, abs=3.0)
    assert int_command(cruising, mav.MAV_CMD_DO_SET_HOME, 0, 0, place=(473977420, 85455940, 490.0)) == ACCEPTED
    assert flight.home.geodetic == pytest.approx((47.397742, 8.545594, 490.0))
    cruising.received.clear()
    assert cruising.command(mav.MAV_CMD_GET_HOME_POSITION).result == ACCEPTED
    home = cruising.of("HOME_POSITION")[-1]
    assert (home.latitude, home.longitude, home.altitude) == (473977420, 85455940, 490000)
    assert cruising.command(mav.MAV_CMD_DO_SET_HOME, 0, 0, 0, 0, 0, 0, 0).result == DENIED


def test_termination_stops_the_motors_for_good(cruising: Desk) -> None:
    assert cruising.command(mav.MAV_CMD_DO_FLIGHTTERMINATION, 1).result == ACCEPTED
    cruising.advance(0.5)
    assert cruising.simulation.flight.mode == Mode.TERMINATION
    assert max(abs(cruising.simulation.controls[:3])) == 0.0
    assert cruising.command(mav.MAV_CMD_DO_FLIGHTTERMINATION, 0).result == LATER
    assert cruising.of("HEARTBEAT")[-1] is not None


def test_the_fence_can_be_switched_off_and_on(cruising: Desk) -> None:
    flight = cruising.simulation.flight
    flight.parameters.set("GF_MAX_VER_DIST", 50.0)
    assert cruising.command(mav.MAV_CMD_DO_FENCE_ENABLE, 0).result == ACCEPTED
    cruising.advance(1.0)
    assert flight.breach is None
    assert cruising.command(mav.MAV_CMD_DO_FENCE_ENABLE, 1).result == ACCEPTED
    cruising.advance(1.0)
    assert flight.mode == Mode.RETURN


def test_a_mission_is_started_paused_continued_and_brought_to_its_landing(desk: Desk) -> None:
    desk.simulation.load_plan("docs/examples/survey_3km.plan")
    desk.advance(0.5)
    flight = desk.simulation.flight
    assert desk.command(mav.MAV_CMD_MISSION_START, 0, 0).result == ACCEPTED
    assert flight.armed
    assert flight.mode == Mode.MISSION
    desk.advance(30.0)
    assert desk.command(mav.MAV_CMD_DO_PAUSE_CONTINUE, 0).result == ACCEPTED
    assert flight.mode == Mode.HOLD
    assert desk.command(mav.MAV_CMD_DO_PAUSE_CONTINUE, 1).result == ACCEPTED
    assert flight.mode == Mode.MISSION
    has_landing = flight.mission.land_start_index() is not None
    assert desk.command(mav.MAV_CMD_DO_LAND_START).result == (ACCEPTED if has_landing else DENIED)


def test_without_a_mission_there_is_none_to_start(desk: Desk) -> None:
    desk.advance(0.5)
    assert desk.command(mav.MAV_CMD_MISSION_START, 0, 0).result == DENIED
    assert "no mission" in desk.of("STATUSTEXT")[-1].text
    assert not desk.simulation.flight.armed


def test_with_the_autopilot_off_commands_are_denied() -> None:
    desk = Desk(Simulation(autopilot=False))
    for command in (mav.MAV_CMD_COMPONENT_ARM_DISARM, mav.MAV_CMD_NAV_TAKEOFF, mav.MAV_CMD_DO_REPOSITION):
        assert desk.command(command, 1).result == DENIED
        assert desk.of("STATUSTEXT")[-1].text == "the autopilot is off"
    desk.advance(0.5)
    assert desk.face.internal_errors == 0
    desk.close()


@pytest.mark.parametrize(("name", "number"), [("px4", 21196.0), ("ardupilot", 2989.0)])
def test_arming_is_forced_by_the_number_of_each_autopilots_clients(name: str, number: float) -> None:
    desk = Desk(Simulation(parameters={"COM_ARM_BAT_MIN": 1.0}), identity=IDENTITIES[name])
    desk.simulation.airframe.craft["battery"]["charge"] *= 0.5
    desk.advance(0.5)
    assert desk.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1, 24185.0 - number).result == LATER
    assert desk.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1, number).result == ACCEPTED
    assert desk.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 0, 21196.0).result == ACCEPTED
    desk.close()


def test_wing_borne_the_yaw_of_a_reposition_is_the_sense_of_its_circle(cruising: Desk) -> None:
    place = (473980000, 85460000, 590.0)
    guidance = cruising.face.context.guidance
    for yaw, sense in ((0.0, 1.0), (1.0, -1.0), (NAN, 1.0)):
        assert int_command(cruising, mav.MAV_CMD_DO_REPOSITION, 0, -1, 1, 90.0, yaw, place=place) == ACCEPTED
        cruising.advance(0.1)
        assert guidance.radius == 90.0 * sense


def test_ardupilots_clients_never_turn_the_nose_by_a_reposition_and_are_in_guided_then() -> None:
    desk = Desk(Simulation(start="trim:0", home=(47.397742, 8.545594, 488.0, 90.0)), identity=IDENTITIES["ardupilot"])
    desk.advance(0.1)
    place = (473978000, 85457000, 100.0)
    assert int_command(desk, mav.MAV_CMD_DO_REPOSITION, 3, -1, 1, 0.0, 0.0, place=place) == ACCEPTED  # as MAVProxy does
    desk.advance(8.0)
    assert desk.simulation.flight.view.yaw == pytest.approx(math.pi / 2, abs=0.1)
    assert desk.of("HEARTBEAT")[-1].custom_mode == 15
    assert desk.command(mav.MAV_CMD_NAV_LOITER_UNLIM).result == ACCEPTED
    desk.advance(1.1)
    assert desk.of("HEARTBEAT")[-1].custom_mode == 12
    desk.close()


def test_a_mission_that_cannot_be_armed_for_leaves_the_mode_as_it_is(desk: Desk) -> None:
    flight = desk.simulation.flight
    latitude, longitude, _ = flight.places.to_geodetic(50.0, 0.0, 0.0)
    flight.load_mission(
        [MissionItem(command, x=latitude, y=longitude, z=20.0) for command in (Item.TAKEOFF, Item.WAYPOINT)]
    )
    flight.parameters.set("COM_ARM_BAT_MIN", 1.0)
    desk.simulation.airframe.craft["battery"]["charge"] *= 0.5
    desk.advance(0.5)
    assert desk.command(mav.MAV_CMD_MISSION_START, 0, 0).result == LATER
    assert "battery" in desk.texts[-1]
    assert flight.mode == Mode.HOLD


def test_ardupilots_commands_of_guided_change_speed_and_height(cruising: Desk) -> None:
    assert cruising.command(mav.MAV_CMD_GUIDED_CHANGE_SPEED, 0, 25.0, 0).result == ACCEPTED
    assert int_command(cruising, mav.MAV_CMD_GUIDED_CHANGE_ALTITUDE, 3, NAN, NAN, 0.0, place=(0, 0, 120.0)) == ACCEPTED
    cruising.advance(40.0)
    flight = cruising.simulation.flight
    assert flight.view.airspeed == pytest.approx(25.0, abs=0.5)
    assert flight.height == pytest.approx(120.0, abs=1.0)


def test_a_take_off_commanded_once_more_goes_on(desk: Desk) -> None:
    """https://mavlink.io/en/guide/redundancy_deduplication.html: commands that arrive twice change nothing."""
    desk.advance(0.5)
    flight = desk.simulation.flight
    desk.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1)
    desk.command(mav.MAV_CMD_NAV_TAKEOFF, NAN, NAN, NAN, NAN, NAN, NAN, 508.0)
    desk.until(lambda: flight.flying and flight.height > 3.0)
    for altitude in (508.0, 489.0, NAN):  # also one that would be too low from here
        assert desk.command(mav.MAV_CMD_NAV_TAKEOFF, NAN, NAN, NAN, NAN, NAN, NAN, altitude).result == ACCEPTED
        assert flight.mode == Mode.TAKEOFF
    assert desk.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1).result == ACCEPTED
    desk.until(lambda: flight.mode == Mode.HOLD)
    assert flight.height == pytest.approx(20.0, abs=0.9)


def test_a_transition_to_where_the_vehicle_is_leaves_its_circle_alone(cruising: Desk) -> None:
    cruising.advance(8.0)
    centre = cruising.face.context.guidance.place
    assert cruising.command(mav.MAV_CMD_DO_VTOL_TRANSITION, 4).result == ACCEPTED
    cruising.advance(0.1)
    assert cruising.face.context.guidance.place == centre
