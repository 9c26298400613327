"""What is streamed: everything that PX4 and ArduPilot stream, at their rates, and builders that always work."""

from collections.abc import Iterator

import pytest

from sitl.mavlink.codec import codec
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.telemetry.streams import BUILDERS, DATA_STREAMS, DEFAULT_RATES
from tests.sitl.mavlink.telemetry.observed import Observed

# Messages of the services, made elsewhere.
OF_SERVICES = {
    "CURRENT_EVENT_SEQUENCE",
    "CURRENT_MODE",
    "MISSION_CURRENT",
    "OPEN_DRONE_ID_LOCATION",
    "OPEN_DRONE_ID_SYSTEM",
}
# PX4 1.17, simulated standard VTOL, wing-borne: messages per second on its ports 14550 and 14540, without those that
# are no streams (EVENT, PARAM_VALUE, STATUSTEXT) or are not for every peer (PING, TIMESYNC).
PX4_NORMAL = {
    "ALTITUDE": 1,
    "ATTITUDE": 50,
    "ATTITUDE_QUATERNION": 50,
    "ATTITUDE_TARGET": 50,
    "BATTERY_STATUS": 0.5,
    "CURRENT_EVENT_SEQUENCE": 0.3,
    "CURRENT_MODE": 0.5,
    "DISTANCE_SENSOR": 0.5,
    "ESTIMATOR_STATUS": 0.5,
    "EXTENDED_SYS_STATE": 1,
    "GLOBAL_POSITION_INT": 50,
    "GPS_RAW_INT": 5,
    "HOME_POSITION": 0.5,
    "LINK_NODE_STATUS": 1,
    "LOCAL_POSITION_NED": 50,
    "MISSION_CURRENT": 1,
    "OPEN_DRONE_ID_LOCATION": 1,
    "OPEN_DRONE_ID_SYSTEM": 1,
    "ORBIT_EXECUTION_STATUS": 2,
    "POSITION_TARGET_GLOBAL_INT": 1,
    "POSITION_TARGET_LOCAL_NED": 50,
    "SCALED_PRESSURE": 1,
    "SERVO_OUTPUT_RAW": 50,
    "SYS_STATUS": 1,
    "TIME_ESTIMATE_TO_TARGET": 0.5,
    "VFR_HUD": 4,
    "VIBRATION": 0.1,
    "WIND_COV": 0.5,
}
PX4_ONBOARD = {
    "ALTITUDE": 10,
    "ATTITUDE": 100,
    "ATTITUDE_QUATERNION": 50,
    "ATTITUDE_TARGET": 10,
    "BATTERY_STATUS": 0.5,
    "CURRENT_EVENT_SEQUENCE": 0.3,
    "CURRENT_MODE": 0.5,
    "DISTANCE_SENSOR": 10,
    "ESTIMATOR_STATUS": 1,
    "EXTENDED_SYS_STATE": 5,
    "GLOBAL_POSITION_INT": 50,
    "GPS_RAW_INT": 8,
    "HIGHRES_IMU": 50,
    "HOME_POSITION": 0.5,
    "LINK_NODE_STATUS": 1,
    "LOCAL_POSITION_NED": 30,
    "MISSION_CURRENT": 1,
    "ODOMETRY": 30,
    "OPEN_DRONE_ID_LOCATION": 1,
    "OPEN_DRONE_ID_SYSTEM": 1,
    "ORBIT_EXECUTION_STATUS": 5,
    "POSITION_TARGET_GLOBAL_INT": 10,
    "POSITION_TARGET_LOCAL_NED": 10,
    "SCALED_PRESSURE": 1,
    "SERVO_OUTPUT_RAW": 10,
    "SYSTEM_TIME": 1,
    "SYS_STATUS": 5,
    "TIME_ESTIMATE_TO_TARGET": 0.5,
    "VFR_HUD": 10,
    "VIBRATION": 0.5,
    "WIND_COV": 10,
}
# ArduPlane, simulated tilt-rotor, before anybody has asked: at 1 Hz, but for the last two.
ARDUPLANE = (
    *("AHRS", "AHRS2", "AIRSPEED", "AOA_SSA", "ATTITUDE", "EKF_STATUS_REPORT", "ESC_TELEMETRY_1_TO_4"),
    *("ESC_TELEMETRY_5_TO_8", "GLOBAL_POSITION_INT", "GPS_RAW_INT", "LOCAL_POSITION_NED", "MEMINFO"),
    *("MISSION_CURRENT", "NAV_CONTROLLER_OUTPUT", "POSITION_TARGET_GLOBAL_INT", "POWER_STATUS", "RAW_IMU"),
    *("RC_CHANNELS", "SCALED_IMU2", "SCALED_IMU3", "SCALED_PRESSURE", "SCALED_PRESSURE2", "SERVO_OUTPUT_RAW"),
    *("SIMSTATE", "SYSTEM_TIME", "SYS_STATUS", "TERRAIN_REPORT", "VFR_HUD", "VIBRATION", "WIND"),
    *("GPS_GLOBAL_ORIGIN", "HOME_POSITION"),
)
# What both answer on request besides, and what they refuse though they could know it.
REQUESTED = (
    *("ACTUATOR_OUTPUT_STATUS", "ALTITUDE", "ATTITUDE_QUATERNION", "AUTOPILOT_STATE_FOR_GIMBAL_DEVICE"),
    *("BATTERY_INFO", "ESC_INFO", "ESC_STATUS", "FENCE_STATUS", "FLIGHT_INFORMATION", "GNSS_INTEGRITY"),
    *("HIL_ACTUATOR_CONTROLS", "HIL_STATE_QUATERNION", "MCU_STATUS", "RANGEFINDER", "RAW_RPM", "RELAY_STATUS"),
    *("RPM", "SCALED_IMU", "SIM_STATE", "SMART_BATTERY_INFO", "STORAGE_INFORMATION", "UTM_GLOBAL_POSITION"),
)


@pytest.mark.parametrize(("name", "theirs"), [("normal", PX4_NORMAL), ("onboard", PX4_ONBOARD)])
def test_px4s_streams_are_there_at_its_rates(name: str, theirs: dict[str, float]) -> None:
    ours = DEFAULT_RATES[name]
    assert {message: ours.get(message) for message in theirs} == theirs


def test_arduplanes_streams_are_there_at_its_rates() -> None:
    ours = DEFAULT_RATES["ardupilot"]
    slow = ("GPS_GLOBAL_ORIGIN", "HOME_POSITION")
    assert {name: ours.get(name) for name in ARDUPLANE} == {name: 0.15 if name in slow else 1.0 for name in ARDUPLANE}


@pytest.mark.parametrize("name", ["normal", "onboard"])
def test_what_only_some_autopilots_stream_is_streamed_too(name: str) -> None:
    for message in (
        *("ESC_STATUS", "ESC_INFO", "RC_CHANNELS", "WIND_COV", "NAV_CONTROLLER_OUTPUT", "ACTUATOR_OUTPUT_STATUS"),
        *("ODOMETRY", "HIGHRES_IMU", "SCALED_IMU", "SCALED_IMU2", "SCALED_IMU3", "BATTERY_STATUS", "FENCE_STATUS"),
        *("GPS_GLOBAL_ORIGIN", "SYSTEM_TIME", "NAMED_VALUE_FLOAT", "HIL_STATE_QUATERNION"),
    ):
        assert DEFAULT_RATES[name][message] > 0.0, message


@pytest.mark.parametrize("name", REQUESTED)
def test_what_they_answer_on_request_has_a_builder(name: str) -> None:
    assert name in BUILDERS


def test_every_stream_has_a_message_and_a_builder() -> None:
    streamed = {name for rates in DEFAULT_RATES.values() for name in rates} | {
        n for g in DATA_STREAMS.values() for n in g
    }
    for name in streamed:
        codec(name)
        assert name in BUILDERS or name in OF_SERVICES, name
    assert not OF_SERVICES & set(BUILDERS)


@pytest.mark.parametrize("name", DEFAULT_RATES)
def test_other_simulated_vehicles_learn_whose_servo_outputs_these_are(name: str) -> None:
    order = list(DEFAULT_RATES[name])
    if "SERVO_OUTPUT_RAW" in order:
        assert order.index("HIL_STATE_QUATERNION") < order.index("SERVO_OUTPUT_RAW")
    assert "HIL_ACTUATOR_CONTROLS" not in order  # which would be a claim to their servos


def test_a_viewer_gets_the_state_and_nothing_else() -> None:
    assert DEFAULT_RATES["viewer"] == {"HIL_STATE_QUATERNION": 50.0}


def test_data_streams_are_ardupilots_groups() -> None:
    groups = {number: names for number, names in DATA_STREAMS.items() if number != mav.MAV_DATA_STREAM_ALL}
    members = [name for names in groups.values() for name in names]
    assert sorted(members) == sorted(set(members))
    assert set(DATA_STREAMS[mav.MAV_DATA_STREAM_ALL]) == set(members)
    assert {number for number in mav.enums["MAV_DATA_STREAM"] if number <= mav.MAV_DATA_STREAM_EXTRA3} == set(
        DATA_STREAMS
    )
    # All that ArduPlane multiplies with REQUEST_DATA_STREAM ALL; home and origin it does not.
    assert set(ARDUPLANE) - set(members) == {"GPS_GLOBAL_ORIGIN", "HOME_POSITION"}
    assert "ATTITUDE" in DATA_STREAMS[mav.MAV_DATA_STREAM_EXTRA1]
    assert "GLOBAL_POSITION_INT" in DATA_STREAMS[mav.MAV_DATA_STREAM_POSITION]


def vehicles() -> Iterator[Observed]:
    """On the ground, in the air, without autopilot, flown from outside, begun anew, with an empty battery."""
    yield Observed()
    yield Observed(start="trim:20")
    yield Observed(autopilot=False)
    outside = Observed(start="trim:20")
    outside.simulation.set_controls(outside.simulation.controls)
    yield outside
    again = Observed(start="trim:20", earth="wgs84", home=(-70.0, 179.999, -20.0, 359.0))
    again.fly(1.0)
    again.simulation.restart("ground")
    again.context.restarted()
    yield again
    empty = Observed(start="trim:20")
    empty.simulation.airframe.craft["battery"]["charge"] = 0.0
    empty.fly(1.0)
    yield empty


def test_every_builder_gives_what_its_message_holds_whatever_the_vehicle_does() -> None:
    for observed in vehicles():
        for name in BUILDERS:
            values = observed.values(name)
            if values is None:
                assert name == "ORBIT_EXECUTION_STATUS"
                continue
            packer = codec(name)
            packer.unpack(packer.payload(values))
            assert len(values) == len(packer.unpack(b"")), name
            assert observed.sent(name).get_type() == name
