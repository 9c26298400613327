"""Who the vehicle says it is."""

import pytest

from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.identity import IDENTITIES
from tests.sitl.mavlink.in_memory import Desk

CAPABILITY = "MAV_PROTOCOL_CAPABILITY_"


@pytest.mark.parametrize("name", ["px4", "ardupilot", "generic"])
def test_every_capability_that_is_claimed_is_there_and_no_other(name: str) -> None:
    desk = Desk(identity=IDENTITIES[name])
    desk.command(mav.MAV_CMD_REQUEST_MESSAGE, mav.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
    [version] = desk.of("AUTOPILOT_VERSION")
    names = {
        entry.name.removeprefix(CAPABILITY)
        for bit, entry in mav.enums["MAV_PROTOCOL_CAPABILITY"].items()
        if version.capabilities & bit and not entry.name.endswith("_ENUM_END")
    }
    assert names == {
        "MISSION_FLOAT", "PARAM_FLOAT", "MISSION_INT", "COMMAND_INT", "FTP", "SET_ATTITUDE_TARGET",
        "SET_POSITION_TARGET_LOCAL_NED", "SET_POSITION_TARGET_GLOBAL_INT", "FLIGHT_TERMINATION", "MAVLINK2",
        "MISSION_FENCE", "MISSION_RALLY", "PARAM_ENCODE_C_CAST" if name == "ardupilot" else "PARAM_ENCODE_BYTEWISE",
    }  # fmt: skip
    desk.close()


def test_ardupilots_older_request_is_answered_to_its_sender(desk: Desk) -> None:
    other = desk.join(250, 190)
    desk.send("AUTOPILOT_VERSION_REQUEST")
    assert len(desk.of("AUTOPILOT_VERSION")) == 1
    assert other.of("AUTOPILOT_VERSION") == []


def test_the_banner_says_it_in_words(desk: Desk) -> None:
    assert desk.command(mav.MAV_CMD_DO_SEND_BANNER).result == mav.MAV_RESULT_ACCEPTED
    assert desk.texts[0].startswith("tiltwing-sitl V")
    assert desk.texts[1] == f"Frame: {desk.simulation.aircraft.name}"
