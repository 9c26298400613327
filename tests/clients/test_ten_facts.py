"""Ten facts about ground tools that decide how the vehicle speaks, one test or more for each.

They were found by running the tools against a stub; what each demands is played here by a station in memory.
"""

import math
import struct
from collections.abc import Callable, Iterator
from typing import Any

import psutil
import pytest
from pymavlink import mavutil
from pymavlink.dialects.v20 import ardupilotmega as shipped

from sitl.flight.mode import Mode
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.identity import IDENTITIES
from sitl.testing import SitlVehicle
from tests.sitl.mavlink.in_memory import Desk, Station

ACCEPTED, DENIED, UNSUPPORTED = mav.MAV_RESULT_ACCEPTED, mav.MAV_RESULT_DENIED, mav.MAV_RESULT_UNSUPPORTED
NAN = math.nan
LATITUDE, LONGITUDE = 47.397742, 8.545594
# System and component of MAVSDK, MAVProxy, dronekit, mavctl, libmav, Hawkeye.
TOOLS = ((245, 190), (255, 230), (255, 0), (254, 190), (250, 194), (255, 1))


@pytest.fixture
def seen_as() -> Iterator[Callable[[str], Desk]]:
    """Makes a vehicle of an identity."""
    made: list[Desk] = []

    def make(identity: str) -> Desk:
        made.append(Desk(identity=IDENTITIES[identity]))
        return made[-1]

    yield make
    for desk in made:
        desk.close()


@pytest.fixture
def desk(seen_as: Callable[[str], Desk]) -> Desk:
    return seen_as("px4")


# -- 1: identity -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("identity", "kind"), [("px4", 24), ("ardupilot", 21)])
def test_1_pymavlink_reads_the_mode_of_each_identity_from_its_heartbeat(
    seen_as: Callable[[str], Desk], identity: str, kind: int
) -> None:
    desk = seen_as(identity)
    desk.advance(1.0)
    heartbeat = desk.of("HEARTBEAT")[-1]
    assert heartbeat.type == kind
    assert mavutil.mode_string_v10(heartbeat) == "LOITER"


# -- 2: MAVProxy cannot ask PX4 for a mode by its name, only by numbers -----------------------------------------------


def test_2_a_mode_is_set_by_the_numbers_of_px4_with_nothing_else_given(desk: Desk) -> None:
    assert desk.command(mav.MAV_CMD_DO_SET_MODE, 1, 4, 2).result == ACCEPTED
    assert desk.simulation.flight.mode == Mode.TAKEOFF


# -- 3: pymavlink's definitions lag behind ----------------------------------------------------------------------------


def test_3_a_client_with_older_definitions_reads_what_it_knows_and_loses_nothing(desk: Desk) -> None:
    old: Any = desk.join(254)
    old.mav = shipped.MAVLink(None)
    old.mav.robust_parsing = True
    desk.advance(3.0)
    kinds = {message.get_type() for message in old.received}
    assert "BAD_DATA" not in kinds
    assert {"HEARTBEAT", "ATTITUDE", "SYS_STATUS"} <= kinds
    assert any(kind.startswith("UNKNOWN") for kind in kinds)


# -- 4: addressing ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("tool", TOOLS)
def test_4_every_answer_names_who_has_asked(desk: Desk, tool: tuple[int, int]) -> None:
    station = desk.join(*tool)
    station.received.clear()
    station.command(mav.MAV_CMD_REQUEST_MESSAGE, mav.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
    station.send("MISSION_REQUEST_LIST")
    station.send("MISSION_REQUEST_INT", seq=99)
    station.send("FILE_TRANSFER_PROTOCOL", payload=[0, 0, 0, 2])  # reset sessions
    station.send("TIMESYNC", ts1=12345)
    desk.wait(0.2)
    for kind in ("COMMAND_ACK", "MISSION_COUNT", "FILE_TRANSFER_PROTOCOL", "TIMESYNC"):
        (answer,) = station.of(kind)
        assert (answer.target_system, answer.target_component) == tool
    (version,) = station.of("AUTOPILOT_VERSION")
    assert version.get_srcComponent() == mav.MAV_COMP_ID_AUTOPILOT1


def test_4_values_of_parameters_are_for_everybody(desk: Desk) -> None:
    other = desk.join(254)
    desk.send("PARAM_SET", param_id="RTL_RETURN_ALT", param_value=50.0, param_type=mav.MAV_PARAM_TYPE_REAL32)
    assert other.of("PARAM_VALUE")[-1].param_value == 50.0


@pytest.mark.parametrize("target", [(1, 169), (1, 154), (2, 1)])  # a winch, a gimbal, another vehicle
def test_4_what_is_for_others_is_theirs_to_answer(desk: Desk, target: tuple[int, int]) -> None:
    system, component = target
    answer = desk.command(mav.MAV_CMD_RUN_PREARM_CHECKS, target_system=system, target_component=component)
    assert answer is None


# -- 5: three kinds of mission clients --------------------------------------------------------------------------------


def upload(desk: Desk, station: Station, count: int, understands: set[str]) -> list[str]:
    """Send a mission as a client does that only knows these requests; gives the requests that it heard."""
    station.received.clear()
    station.send("MISSION_COUNT", count=count)
    requests: list[str] = []
    handled = 0
    for _ in range(200):
        if station.of("MISSION_ACK"):
            return requests
        asked = [m for m in station.received if m.get_type() in ("MISSION_REQUEST", "MISSION_REQUEST_INT")]
        for request in asked[handled:]:
            requests.append(request.get_type())
            if request.get_type() in understands:
                send_item(station, request)
        handled = len(asked)
        desk.wait(0.05)
    msg = "the upload never ended"
    raise AssertionError(msg)


def send_item(station: Station, request: Any) -> None:
    """A waypoint, in the kind of item that was asked for."""
    as_int = request.get_type() == "MISSION_REQUEST_INT"
    latitude = LATITUDE + 1e-3 * (request.seq + 1)
    station.send(
        "MISSION_ITEM_INT" if as_int else "MISSION_ITEM",
        seq=request.seq,
        frame=mav.MAV_FRAME_GLOBAL_RELATIVE_ALT,
        command=mav.MAV_CMD_NAV_WAYPOINT,
        autocontinue=1,
        param4=NAN,
        x=round(latitude * 1e7) if as_int else latitude,
        y=round(LONGITUDE * 1e7) if as_int else LONGITUDE,
        z=30.0,
    )


@pytest.mark.parametrize(
    "understands", [{"MISSION_REQUEST_INT"}, {"MISSION_REQUEST"}, {"MISSION_REQUEST", "MISSION_REQUEST_INT"}]
)
def test_5_clients_that_know_one_kind_of_request_or_both_can_send_a_mission(desk: Desk, understands: set[str]) -> None:
    requests = upload(desk, desk.station, 3, understands)
    assert desk.of("MISSION_ACK")[-1].type == mav.MAV_MISSION_ACCEPTED
    assert requests[0] == "MISSION_REQUEST_INT"
    for seq in range(3):
        desk.send("MISSION_REQUEST_INT", seq=seq)
    latitudes = [item.x * 1e-7 for item in desk.of("MISSION_ITEM_INT")]
    assert latitudes == pytest.approx([LATITUDE + 1e-3 * n for n in (1, 2, 3)], abs=1e-5)


def test_5_each_download_gets_the_kind_of_item_it_has_asked_for(desk: Desk) -> None:
    upload(desk, desk.station, 2, {"MISSION_REQUEST_INT"})
    desk.send("MISSION_REQUEST_LIST")
    desk.send("MISSION_REQUEST", seq=1)
    desk.send("MISSION_REQUEST_INT", seq=1)
    (as_float,), (as_int,) = desk.of("MISSION_ITEM"), desk.of("MISSION_ITEM_INT")
    assert as_float.x == pytest.approx(LATITUDE + 2e-3, abs=1e-5)
    assert as_int.x == round((LATITUDE + 2e-3) * 1e7)


def test_5_the_vehicle_asks_again_for_an_item_that_is_lost(desk: Desk) -> None:
    desk.send("MISSION_COUNT", count=2)
    desk.wait(0.9)  # nothing comes
    requests = [m for m in desk.received if m.get_type() in ("MISSION_REQUEST", "MISSION_REQUEST_INT")]
    assert len(requests) >= 3
    assert {request.seq for request in requests} == {0}
    for seq in (0, 1):
        send_item(desk.station, mav.MAVLink_mission_request_int_message(255, 190, seq))
    assert desk.of("MISSION_ACK")[-1].type == mav.MAV_MISSION_ACCEPTED


# -- 6: retransmissions, unknown commands, parameters that are not given ----------------------------------------------


def test_6_a_command_that_comes_again_is_acknowledged_again_and_carried_out_once(desk: Desk) -> None:
    results = [desk.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1, 0, confirmation=n).result for n in range(3)]
    assert results == [ACCEPTED] * 3
    assert desk.texts.count("Armed") == 1


def test_6_a_command_that_there_is_not_is_unsupported_at_once(desk: Desk) -> None:
    assert desk.command(31999).result == UNSUPPORTED


def test_6_no_command_minds_parameters_that_are_not_given_not_even_whole_numbers(desk: Desk) -> None:
    for number in mav.enums["MAV_CMD"]:
        if number not in (mav.MAV_CMD_ENUM_END, mav.MAV_CMD_USER_2):
            assert desk.command(number, *[NAN] * 7) is not None
    assert desk.face.internal_errors == 0


# -- 7: health --------------------------------------------------------------------------------------------------------


def test_7_what_mavsdk_calls_health_is_in_sys_status_and_home_comes_on_request(desk: Desk) -> None:
    desk.advance(1.0)
    status = desk.of("SYS_STATUS")[-1]
    for bit in (
        mav.MAV_SYS_STATUS_SENSOR_3D_GYRO, mav.MAV_SYS_STATUS_SENSOR_3D_ACCEL, mav.MAV_SYS_STATUS_SENSOR_3D_MAG,
        mav.MAV_SYS_STATUS_SENSOR_GPS, mav.MAV_SYS_STATUS_PREARM_CHECK,
    ):  # fmt: skip
        assert status.onboard_control_sensors_present & status.onboard_control_sensors_health & bit
    desk.command(mav.MAV_CMD_REQUEST_MESSAGE, mav.MAVLINK_MSG_ID_HOME_POSITION)
    assert desk.of("HOME_POSITION")
    desk.command(mav.MAV_CMD_REQUEST_MESSAGE, mav.MAVLINK_MSG_ID_EXTENDED_SYS_STATE)
    assert desk.of("EXTENDED_SYS_STATE")[-1].vtol_state == mav.MAV_VTOL_STATE_MC


def test_7_a_vehicle_that_cannot_be_armed_says_so_there(desk: Desk) -> None:
    desk.simulation.flight.parameters.set("FW_AIRSPD_TRIM", 12.0)  # less than FW_AIRSPD_MIN
    desk.advance(2.0)
    assert not desk.of("SYS_STATUS")[-1].onboard_control_sensors_health & mav.MAV_SYS_STATUS_PREARM_CHECK


# -- 8: PX4's custom modes --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("mode", "main", "sub"), [(Mode.HOLD, 4, 3), (Mode.TAKEOFF, 4, 2), (Mode.POSITION, 3, 0), (Mode.ALTITUDE, 2, 0)]
)
def test_8_a_mode_is_told_as_px4_tells_it(desk: Desk, mode: Mode, main: int, sub: int) -> None:
    desk.simulation.flight.set_mode(mode)
    desk.advance(1.1)
    heartbeat = desk.of("HEARTBEAT")[-1]
    assert heartbeat.custom_mode == main << 16 | sub << 24
    assert heartbeat.base_mode & mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED


# -- 9: whole numbers as parameters -----------------------------------------------------------------------------------


@pytest.mark.parametrize("identity", ["px4", "ardupilot"])
def test_9_whole_numbers_travel_as_clients_of_the_identity_expect_and_as_is_announced(
    seen_as: Callable[[str], Desk], identity: str
) -> None:
    desk = seen_as(identity)
    desk.send("PARAM_REQUEST_READ", param_id="NAV_RCL_ACT", param_index=-1)
    field = desk.of("PARAM_VALUE")[-1].param_value
    value = desk.simulation.flight.parameters["NAV_RCL_ACT"]
    desk.command(mav.MAV_CMD_REQUEST_MESSAGE, mav.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
    capabilities = desk.of("AUTOPILOT_VERSION")[-1].capabilities
    by_bits = mav.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE
    by_value = mav.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST
    if identity == "px4":
        assert struct.unpack("<i", struct.pack("<f", field)) == (value,)
        assert capabilities & (by_bits | by_value) == by_bits
    else:
        assert field == value
        assert capabilities & (by_bits | by_value) == by_value


# -- 10: nothing beyond this machine ----------------------------------------------------------------------------------


def test_10_nobody_beyond_this_machine_can_reach_the_vehicle() -> None:
    with SitlVehicle() as vehicle:
        sockets = psutil.Process(vehicle.pid).net_connections("inet")
        assert sockets
        assert {connection.laddr.ip for connection in sockets} == {"127.0.0.1"}


# -- and honest time --------------------------------------------------------------------------------------------------


def test_time_since_boot_is_the_vehicles_own_from_which_mavsdk_takes_how_fast_it_flies(desk: Desk) -> None:
    desk.advance(2.0)
    desk.wait(30.0)  # of which the vehicle knows nothing
    desk.advance(1.0)
    times = [message.time_boot_ms for message in desk.of("ATTITUDE")]
    assert times == list(range(0, 3001, 20))
