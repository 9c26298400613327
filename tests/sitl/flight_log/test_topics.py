"""What a log holds: pyulog reads it, and it agrees with what the simulation knows of the same moments."""

import math
import re
from collections.abc import Callable

import numpy as np
import pytest

from sitl import Simulation
from sitl.control.records import Level
from sitl.flight_log.flight_log import AFTER, BEFORE, FlightLog
from tests.sitl.flight_log.reading import array_of, hop, only_log, roll_pitch_yaw, texts_of

SINGLE = 3e-7  # of a float, relative


def test_the_log_agrees_with_the_history_in_everything_that_both_hold(
    logged: Callable[..., tuple[Simulation, FlightLog]],
) -> None:
    simulation, log = logged(start="trim:20", wind=(3.0, -4.0, 0.0))
    history = simulation.record(0.1)
    simulation.advance(4.0)
    simulation.flight.transition(cruise=False)
    simulation.advance(16.0)
    file = only_log(log)
    topics = {data.name: data.data for data in file.data_list}

    def matched(name: str) -> tuple[dict[str, np.ndarray], np.ndarray]:
        """A topic, and the rows of the history at the same times; each of its times is one of them."""
        times = topics[name]["timestamp"]
        by_time = {round(time * 1e6): i for i, time in enumerate(history.rows["time"])}
        return topics[name], history.rows[[by_time[int(time)] for time in times]]

    def same(logged: np.ndarray, kept: np.ndarray, scale: float = 1.0) -> None:
        np.testing.assert_allclose(logged, kept, rtol=SINGLE, atol=SINGLE * scale)

    topic, rows = matched("vehicle_attitude")
    assert len(rows) == 201
    same(roll_pitch_yaw(array_of(topic, "q", 4).astype(float)), rows["euler"], 4.0)
    topic, rows = matched("vehicle_angular_velocity")
    same(array_of(topic, "xyz", 3), rows["state"][:, 10:13])
    topic, rows = matched("vehicle_local_position")
    same(np.stack([topic["x"], topic["y"], topic["z"]]).T, rows["position_ned"], 100.0)
    same(np.stack([topic["vx"], topic["vy"], topic["vz"]]).T, rows["velocity_ned"])
    same(topic["heading"], rows["euler"][:, 2])
    topic, rows = matched("airspeed_validated")
    same(topic["true_airspeed_m_s"], rows["airspeed"])
    topic, rows = matched("tilt_status")
    same(topic["tilt"], rows["tilt"])
    same(topic["tilt_command"], rows["tilt_command"])
    topic, rows = matched("actuator_motors")
    same(array_of(topic, "control", 3), rows["controls"][:, :3])
    assert np.isnan(topic["control[3]"]).all()  # what there is not, PX4 calls not a number
    topic, rows = matched("airflow")
    air = array_of(topic, "velocity_body", 3).astype(float)
    same(np.linalg.norm(air, axis=1), rows["airspeed"])
    same(topic["angle_of_attack"], np.arctan2(air[:, 2], air[:, 0]))
    topic, rows = matched("wind")
    assert len(rows) >= 20
    same(topic["windspeed_north"], rows["wind_ned"][:, 0])
    same(topic["windspeed_east"], rows["wind_ned"][:, 1])
    topic, rows = matched("battery_status")
    same(topic["voltage_v"], rows["voltage"])
    same(topic["current_a"], rows["current"])
    same(topic["remaining"], rows["battery_remaining"])
    topic, rows = matched("esc_status")
    rotors = rows["state"][:, 13:16] * 30.0 / math.pi
    assert np.abs(np.stack([topic[f"esc[{i}].esc_rpm"] for i in range(3)]).T - rotors).max() <= 0.5
    topic, rows = matched("vehicle_local_position_setpoint")
    held = (rows["level"] == Level.VELOCITY) & (rows["vertical"] == 0)
    assert held.any()
    same(topic["z"][held], rows["target_ned"][held, 2], 100.0)
    assert (rows["regime"] != rows["regime"][0]).any()
    topic, rows = matched("vtol_vehicle_status")
    names = {0: 3, 1: 1, 2: 4, 3: 2}  # hover, to cruise, cruise, to hover in the numbers of MAV_VTOL_STATE
    assert topic["vehicle_vtol_state"].tolist() == [names[regime] for regime in rows["regime"]]


def test_the_log_agrees_with_the_snapshot_in_what_histories_do_not_hold(
    logged: Callable[..., tuple[Simulation, FlightLog]],
) -> None:
    simulation, log = logged(start="trim:25", home=(-33.5, 151.25, 700.0, 90.0), earth="wgs84")
    simulation.advance(12.0)
    now, servos = simulation.snapshot(), simulation.aircraft.vehicle[0]["servos"]
    file = only_log(log)
    last = {data.name: {key: value[-1] for key, value in data.data.items()} for data in file.data_list}
    position = last["vehicle_global_position"]
    assert position["timestamp"] == 12_000_000
    assert position["lat"] == pytest.approx(math.degrees(now.latitude), abs=1e-12)
    assert position["lon"] == pytest.approx(math.degrees(now.longitude), abs=1e-12)
    assert position["alt"] == pytest.approx(now.altitude_msl, rel=SINGLE)
    assert last["vehicle_local_position"]["ref_lat"] == pytest.approx(-33.5, abs=1e-12)
    force = [last["vehicle_acceleration"][f"xyz[{i}]"] for i in range(3)]
    assert force == pytest.approx(now.specific_force, abs=2e-3)  # that of the end of the last step, before it was taken
    air, gps = last["vehicle_air_data"], last["vehicle_gps_position"]
    assert gps["time_utc_usec"] - gps["timestamp"] == 1_800_000_000_000_000
    assert air["timestamp"] == 12_000_000
    assert air["baro_pressure_pa"] == pytest.approx(now.pressure, rel=SINGLE)
    assert air["ambient_temperature"] == pytest.approx(now.temperature - 273.15, abs=1e-5)
    assert air["rho"] == pytest.approx(now.density, rel=SINGLE)
    for k, servo in enumerate(servos):
        angle = servo["minimum"] + (last["actuator_servos"][f"control[{k}]"] + 1) / 2 * (
            servo["maximum"] - servo["minimum"]
        )
        assert angle == pytest.approx(now.controls[3 + k], abs=1e-6)


def test_a_log_goes_from_a_little_before_arming_to_a_little_after_disarming(
    logged: Callable[..., tuple[Simulation, FlightLog]],
) -> None:
    simulation, log = logged()
    simulation.advance(5.0)
    assert log.folder.logs() == []
    hop(simulation)
    disarmed = simulation.time
    simulation.advance(5.0)
    file = only_log(log)
    times = file.get_dataset("vehicle_attitude").data["timestamp"] * 1e-6
    assert times[0] == pytest.approx(5.0 - BEFORE, abs=0.1)
    assert file.start_timestamp * 1e-6 == pytest.approx(times[0])
    assert times[-1] == pytest.approx(disarmed + AFTER, abs=0.2)
    assert np.diff(times) == pytest.approx(0.1)
    status = file.get_dataset("vehicle_status")
    assert [state for _, state in status.list_value_changes("arming_state")] == [1, 2, 1]
    assert [state for _, state in status.list_value_changes("nav_state")] == [4, 17, 4, 18, 4]
    assert [landed for _, landed in file.get_dataset("vehicle_land_detected").list_value_changes("landed")] == [1, 0, 1]
    assert status.data["system_id"].tolist() == [7] * len(status.data["system_id"])


def test_a_log_holds_what_the_pilot_was_told_and_the_parameters_with_their_changes(
    logged: Callable[..., tuple[Simulation, FlightLog]],
) -> None:
    simulation, log = logged(parameters={"RTL_RETURN_ALT": 55.0, "RTL_TYPE": 2})
    heard = texts_of(simulation)
    hop(simulation)
    simulation.flight.parameters.set("RTL_RETURN_ALT", 60.0)
    log.text(3, "said twice")
    log.text(3, "said twice")
    file = only_log(log)
    texts = [text.message for text in file.logged_messages]
    assert texts == [*heard, "said twice"]
    assert "Armed" in heard
    armed = next(text for text in file.logged_messages if text.message == "Armed")
    assert (armed.log_level_str(), armed.timestamp) == ("NOTICE", 0)
    parameters = simulation.flight.parameters
    assert set(file.initial_parameters) == set(parameters.names())
    assert file.initial_parameters["RTL_RETURN_ALT"] == 55.0
    assert file.initial_parameters["RTL_TYPE"] == 2
    assert isinstance(file.initial_parameters["RTL_TYPE"], int)
    assert file.get_default_parameters(0) == {"RTL_RETURN_ALT": 40.0, "RTL_TYPE": 0}
    ((changed, name, value),) = file.changed_parameters
    assert (name, value) == ("RTL_RETURN_ALT", 60.0)
    assert changed * 1e-6 == pytest.approx(simulation.time, abs=0.2)
    assert file.msg_info_dict["sys_name"] == "tiltwing-sitl"
    assert file.msg_info_dict["time_ref_utc"] == 0


# Types and names of PX4's topics, from https://docs.px4.io/main/en/msg_docs/.
PX4 = {
    "vehicle_attitude": "uint64_t timestamp, uint64_t timestamp_sample, float[4] q",
    "vehicle_angular_velocity": "uint64_t timestamp, uint64_t timestamp_sample, float[3] xyz",
    "vehicle_local_position": "bool xy_valid, bool z_valid, float x, float y, float z, float vx, float vy, float vz, "
    "float heading, double ref_lat, double ref_lon, float ref_alt, bool xy_global",
    "vehicle_global_position": "double lat, double lon, float alt, float alt_ellipsoid",
    "vehicle_attitude_setpoint": "float yaw_sp_move_rate, float[4] q_d, float[3] thrust_body",
    "vehicle_local_position_setpoint": "float x, float y, float z, float yaw, float yawspeed, float vx, float vy",
    "actuator_motors": "uint16_t reversible_flags, float[12] control",
    "actuator_servos": "float[8] control",
    "airspeed_validated": "float indicated_airspeed_m_s, float calibrated_airspeed_m_s, float true_airspeed_m_s",
    "battery_status": "uint8_t id, bool connected, float voltage_v, float current_a, float discharged_mah, "
    "float remaining, uint8_t cell_count",
    "wind": "float windspeed_north, float windspeed_east, float variance_north",
    "vehicle_air_data": "float baro_alt_meter, float baro_pressure_pa, float ambient_temperature, float rho",
    "vehicle_gps_position": "double latitude_deg, double longitude_deg, double altitude_msl_m, uint8_t fix_type, "
    "float vel_n_m_s, float cog_rad, uint64_t time_utc_usec, uint8_t satellites_used",
    "vehicle_status": "uint64_t armed_time, uint64_t takeoff_time, uint8_t arming_state, uint8_t nav_state, "
    "uint8_t vehicle_type, bool is_vtol, bool in_transition_mode, bool in_transition_to_fw, bool failsafe",
    "vtol_vehicle_status": "uint8_t vehicle_vtol_state, bool fixed_wing_system_failure",
    "vehicle_land_detected": "bool freefall, bool ground_contact, bool maybe_landed, bool landed",
    "home_position": "double lat, double lon, float alt, float x, float y, float z, bool valid_alt",
    "mission_result": "int32_t seq_reached, uint16_t seq_current, uint16_t seq_total, bool finished",
    "esc_status": "uint8_t esc_count, uint8_t esc_online_flags, uint8_t esc_armed_flags, esc_report[3] esc",
    "esc_report": "int32_t esc_rpm, float esc_voltage, float esc_current, uint8_t actuator_function",
}  # fmt: skip


def test_topics_have_the_names_and_types_of_px4s(logged: Callable[..., tuple[Simulation, FlightLog]]) -> None:
    simulation, log = logged(start="trim:20")
    simulation.advance(1.0)
    formats = only_log(log).message_formats
    for topic, fields in PX4.items():
        ours = {name: (kind, count) for kind, count, name in formats[topic].fields}
        assert next(iter(ours)) == "timestamp"
        for field in fields.split(", "):
            matched = re.fullmatch(r"(\w+?)(?:\[(\d+)\])? (\w+)", field)
            assert matched is not None
            kind, count, name = matched.groups()
            assert ours[name] == (kind, int(count or 0)), f"{topic}.{name}"
