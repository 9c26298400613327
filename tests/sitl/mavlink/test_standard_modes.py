"""Modes on the wire, in all three identities: what is told is what can be asked for, and what others call it."""

from collections.abc import Iterator

import pytest
from pymavlink import mavutil

from sitl.flight.mode import Mode
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.identity import IDENTITIES
from sitl.simulation import Simulation
from tests.sitl.mavlink.in_memory import Desk

SELECTABLE = [mode for mode in Mode if mode not in (Mode.TERMINATION, Mode.MISSION, Mode.OFFBOARD, Mode.TAKEOFF)]


@pytest.fixture(params=IDENTITIES)
def flying(request: pytest.FixtureRequest) -> Iterator[Desk]:
    """A vehicle in cruise, with a pilot's sticks, for every identity."""
    desk = Desk(Simulation(start="trim:20"), identity=IDENTITIES[request.param])
    desk.send("MANUAL_CONTROL", target=1, z=500)
    desk.advance(0.1)
    yield desk
    desk.close()


def modes_of(desk: Desk) -> dict[int, str]:
    desk.received.clear()
    assert desk.command(mav.MAV_CMD_REQUEST_MESSAGE, mav.MAVLINK_MSG_ID_AVAILABLE_MODES, 0).result == 0
    return {message.custom_mode: message.mode_name for message in desk.of("AVAILABLE_MODES")}


def test_available_modes_come_all_at_once_or_one_by_one(flying: Desk) -> None:
    count = len(modes_of(flying))
    messages = flying.of("AVAILABLE_MODES")
    assert [message.mode_index for message in messages] == list(range(1, count + 1))
    assert {message.number_modes for message in messages} == {count}
    assert len({message.custom_mode for message in messages}) == count
    for message in messages:
        assert bool(message.mode_name) == (message.standard_mode == 0)  # a standard mode needs no name
    flying.received.clear()
    flying.command(mav.MAV_CMD_REQUEST_MESSAGE, mav.MAVLINK_MSG_ID_AVAILABLE_MODES, 3)
    assert [message.mode_index for message in flying.of("AVAILABLE_MODES")] == [3]
    answer = flying.command(mav.MAV_CMD_REQUEST_MESSAGE, mav.MAVLINK_MSG_ID_AVAILABLE_MODES, count + 1)
    assert answer.result == mav.MAV_RESULT_DENIED


def test_every_flight_mode_is_told_and_what_is_asked_for_is_told_next(flying: Desk) -> None:
    identity = flying.face.identity
    numbers = modes_of(flying)
    told = {identity.told(mode, wing_borne=cruise, asked=None).number for mode in Mode for cruise in (True, False)}
    assert told <= numbers.keys()
    for mode in SELECTABLE:
        number = identity.told(mode, wing_borne=True, asked=None).number
        params = (1, number >> 16 & 0xFF, number >> 24) if identity.packs_mode else (1, number)
        flying.command(mav.MAV_CMD_USER_2, 2, 20.0)
        flying.send("MANUAL_CONTROL", target=1, z=500)
        flying.advance(0.04)
        assert flying.command(mav.MAV_CMD_DO_SET_MODE, *params).result == mav.MAV_RESULT_ACCEPTED, mode
        assert flying.simulation.flight.mode == mode
        flying.received.clear()
        for _ in range(11):
            flying.send("MANUAL_CONTROL", target=1, z=500)
            flying.advance(0.2)
        flying.advance(0.1)
        heartbeat = flying.of("HEARTBEAT")[-1]
        assert heartbeat.custom_mode == number
        assert heartbeat.base_mode & mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
        assert heartbeat.base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED
        flying.command(mav.MAV_CMD_REQUEST_MESSAGE, mav.MAVLINK_MSG_ID_CURRENT_MODE)
        current = flying.of("CURRENT_MODE")[-1]
        assert (current.custom_mode, current.intended_custom_mode) == (number, number)


def test_standard_modes_can_be_asked_for_and_others_fail(flying: Desk) -> None:
    assert flying.command(mav.MAV_CMD_DO_SET_STANDARD_MODE, mav.MAV_STANDARD_MODE_ORBIT).result == 0
    assert flying.simulation.flight.mode == Mode.ORBIT
    assert flying.command(mav.MAV_CMD_DO_SET_STANDARD_MODE, mav.MAV_STANDARD_MODE_SAFE_RECOVERY).result == 0
    assert flying.simulation.flight.mode == Mode.RETURN
    for unknown in (0, 99, float("nan")):
        assert flying.command(mav.MAV_CMD_DO_SET_STANDARD_MODE, unknown).result == mav.MAV_RESULT_FAILED


def test_an_unknown_mode_is_denied_with_the_ones_there_are(flying: Desk) -> None:
    assert flying.command(mav.MAV_CMD_DO_SET_MODE, 1, 77).result == mav.MAV_RESULT_DENIED
    assert "there is none of number" in flying.texts[0]
    assert flying.command(mav.MAV_CMD_DO_SET_MODE, 64, 4).result == mav.MAV_RESULT_DENIED  # not a custom mode
    assert flying.simulation.flight.mode == Mode.HOLD


def test_the_older_message_sets_modes_too(flying: Desk) -> None:
    number = flying.face.identity.told(Mode.RETURN, wing_borne=True, asked=None).number
    flying.send("SET_MODE", base_mode=1, custom_mode=number)
    assert flying.simulation.flight.mode == Mode.RETURN
    assert flying.of("COMMAND_ACK")[-1].command == mav.MAV_CMD_DO_SET_MODE


@pytest.mark.parametrize("name", ["px4", "ardupilot"])
def test_pymavlink_knows_the_modes_by_the_names_we_give_them(name: str) -> None:
    identity = IDENTITIES[name]
    for entry in identity.modes:
        heartbeat = mav.MAVLink_heartbeat_message(
            identity.vehicle_type, identity.autopilot, mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED, entry.number, 0, 3
        )
        theirs = mavutil.mode_string_v10(heartbeat)
        ours = {"Hold": "LOITER", "Return": "RTL", "Position": "POSCTL", "Altitude": "ALTCTL", "FLY BY WIRE B": "FBWB"}
        if entry.name not in ("Orbit", "Termination"):  # which it does not know
            assert theirs == ours.get(entry.name, entry.name.upper())


def test_guided_stays_guided_through_take_off_and_setpoints() -> None:
    desk = Desk(identity=IDENTITIES["ardupilot"])
    desk.advance(0.5)
    assert desk.command(mav.MAV_CMD_DO_SET_MODE, 1, 15).result == 0
    desk.received.clear()
    assert desk.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1).result == 0
    assert desk.command(mav.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, 8).result == 0
    heard: set[int] = set()
    for _ in range(120):
        desk.advance(0.1)
        heard |= {message.custom_mode for message in desk.of("HEARTBEAT")}
        desk.received.clear()
    assert heard == {15}
    assert desk.simulation.flight.height == pytest.approx(8.0, abs=0.5)
    for _ in range(100):
        desk.send("SET_POSITION_TARGET_LOCAL_NED", coordinate_frame=1, type_mask=0xDF8, x=6.0, y=3.0, z=-9.0)
        desk.advance(0.1)
    assert desk.simulation.flight.view.north == pytest.approx(6.0, abs=0.5)
    for _ in range(20):
        desk.send("SET_POSITION_TARGET_LOCAL_NED", coordinate_frame=1, type_mask=0xDC7, vx=1.0)
        desk.advance(0.1)
    assert desk.simulation.flight.mode == Mode.OFFBOARD
    assert {message.custom_mode for message in desk.of("HEARTBEAT")} == {15}
    desk.close()


def test_the_heartbeat_says_what_we_look_like() -> None:
    for name, (autopilot, kind) in {"px4": (12, 24), "ardupilot": (3, 21), "generic": (0, 24)}.items():
        desk = Desk(identity=IDENTITIES[name])
        heartbeat = desk.of("HEARTBEAT")[0]
        assert (heartbeat.autopilot, heartbeat.type) == (autopilot, kind)
        assert heartbeat.system_status == mav.MAV_STATE_STANDBY
        desk.close()


def test_a_mode_that_changes_by_itself_is_told_at_once(flying: Desk) -> None:
    flying.advance(0.1)
    flying.received.clear()
    flying.simulation.flight.return_home()
    flying.advance(0.04)
    assert len(flying.of("CURRENT_MODE")) == 1


def test_the_heartbeat_tells_arming_by_the_motors_while_no_autopilot_flies() -> None:
    desk = Desk(Simulation(start="trim:20", autopilot=False))
    heartbeat = desk.of("HEARTBEAT")[0]
    assert heartbeat.base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED
    assert heartbeat.system_status == mav.MAV_STATE_ACTIVE
    assert heartbeat.custom_mode == 1 << 16  # PX4's Manual
    desk.close()


def test_a_terminated_flight_is_told_as_such(flying: Desk) -> None:
    flying.simulation.flight.terminate()
    flying.received.clear()
    flying.advance(1.1)
    assert flying.of("HEARTBEAT")[-1].system_status == mav.MAV_STATE_FLIGHT_TERMINATION


def test_a_ground_stations_heartbeat_is_heard_and_its_silence_is_noticed() -> None:
    flying = Desk(Simulation(start="trim:20"))
    flight = flying.simulation.flight
    flight.parameters.set("NAV_DLL_ACT", 2)
    flying.send("HEARTBEAT", type=mav.MAV_TYPE_ONBOARD_CONTROLLER)
    flying.advance(0.1)
    assert flight.links.ground_station is None
    flying.send("HEARTBEAT", type=mav.MAV_TYPE_GCS)
    flying.advance(9.0)
    assert flight.links.ground_station == pytest.approx(9.0, abs=0.1)
    assert flight.mode == Mode.HOLD
    flying.advance(8.0)
    assert flight.mode == Mode.RETURN
    flying.close()


@pytest.mark.parametrize(
    ("name", "armed_on_ground"), [("px4", mav.MAV_STATE_ACTIVE), ("ardupilot", mav.MAV_STATE_STANDBY)]
)
def test_active_means_armed_but_with_ardupilots_clients_flying(name: str, armed_on_ground: int) -> None:
    """QGroundControl takes an armed ArduPilot that is active for one in the air."""
    desk = Desk(identity=IDENTITIES[name])
    desk.advance(0.5)
    assert desk.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1).result == 0
    desk.advance(1.1)
    assert desk.of("HEARTBEAT")[-1].system_status == armed_on_ground
    desk.simulation.flight.takeoff()
    desk.until(lambda: desk.simulation.flight.flying)
    desk.advance(1.1)
    assert desk.of("HEARTBEAT")[-1].system_status == mav.MAV_STATE_ACTIVE
    desk.close()


def test_a_failsafe_that_flies_is_a_critical_state_and_does_not_change_what_was_intended() -> None:
    desk = Desk(Simulation(start="trim:20", parameters={"NAV_DLL_ACT": 2, "COM_FAIL_ACT_T": 0}))
    desk.send("HEARTBEAT", type=mav.MAV_TYPE_GCS, autopilot=8)
    desk.advance(1.1)
    assert desk.of("HEARTBEAT")[-1].system_status == mav.MAV_STATE_ACTIVE
    hold = desk.of("HEARTBEAT")[-1].custom_mode
    desk.advance(12.0)
    assert desk.simulation.flight.mode == Mode.RETURN
    assert desk.of("HEARTBEAT")[-1].system_status == mav.MAV_STATE_CRITICAL
    told = desk.of("CURRENT_MODE")[-1]
    assert (told.custom_mode, told.intended_custom_mode) == (desk.of("HEARTBEAT")[-1].custom_mode, hold)
    desk.command(mav.MAV_CMD_NAV_LAND)  # the pilot wants something else
    desk.advance(2.1)
    told = desk.of("CURRENT_MODE")[-1]
    assert told.custom_mode == told.intended_custom_mode != hold
    desk.close()


def test_what_commands_lead_to_is_intended_too(flying: Desk) -> None:
    flying.command(mav.MAV_CMD_NAV_LAND)
    flying.advance(2.1)
    flying.received.clear()
    flying.command(mav.MAV_CMD_REQUEST_MESSAGE, mav.MAVLINK_MSG_ID_CURRENT_MODE)
    told = flying.of("CURRENT_MODE")[-1]
    assert told.standard_mode == mav.MAV_STANDARD_MODE_LAND
    assert told.custom_mode == told.intended_custom_mode


def test_ardupilots_modes_of_one_regime_bring_the_vehicle_into_it() -> None:
    desk = Desk(Simulation(start="trim:20"), identity=IDENTITIES["ardupilot"])
    desk.advance(0.1)
    flight = desk.simulation.flight
    assert desk.command(mav.MAV_CMD_DO_SET_MODE, 1, 19).result == 0  # QLOITER
    desk.until(lambda: flight.regime.name == "HOVER", 60.0)
    assert flight.mode == Mode.POSITION
    assert desk.command(mav.MAV_CMD_DO_SET_MODE, 1, 7).result == 0  # CRUISE
    desk.until(lambda: flight.regime.name == "CRUISE", 60.0)
    desk.close()


def test_no_mode_is_entered_while_an_outside_controller_flies() -> None:
    desk = Desk(Simulation(start="trim:20"))
    desk.advance(0.1)
    desk.simulation.set_controls(desk.simulation.controls)
    assert desk.command(mav.MAV_CMD_DO_SET_MODE, 1, 4, 5).result == mav.MAV_RESULT_TEMPORARILY_REJECTED
    assert desk.command(mav.MAV_CMD_NAV_RETURN_TO_LAUNCH).result == mav.MAV_RESULT_TEMPORARILY_REJECTED
    assert desk.command(mav.MAV_CMD_DO_SET_HOME, 1).result == mav.MAV_RESULT_ACCEPTED
    desk.simulation.take_over()
    assert desk.command(mav.MAV_CMD_NAV_RETURN_TO_LAUNCH).result == mav.MAV_RESULT_ACCEPTED
    desk.close()


def test_a_change_of_mode_or_arming_is_in_a_heartbeat_at_once(desk: Desk) -> None:
    """QGroundControl waits a second and a half for it, and then takes the command for failed."""
    desk.advance(0.5)
    desk.received.clear()
    desk.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1)
    desk.advance(0.04)
    [heartbeat] = desk.of("HEARTBEAT")
    assert heartbeat.base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED
    desk.simulation.flight.takeoff()
    desk.advance(0.04)
    assert desk.of("HEARTBEAT")[-1].custom_mode == 4 << 16 | 2 << 24
