"""MAVSDK's Telemetry and Info plugins: every kind of telemetry arrives, is true, and comes as often as asked for."""

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import pytest
from mavsdk.plugins.action import ActionError
from mavsdk.plugins.info import Info
from mavsdk.plugins.param import Param
from mavsdk.plugins.telemetry import FixType, FlightMode, LandedState, Telemetry, TelemetryError, VtolState

from tests.clients.mavsdk_station import MavsdkStation
from tests.clients.vehicle import HOME, until

HEADING = 40.0  # on the ground [deg]
WIND = (3.0, -2.0)  # [m/s]
RATE = 20.0  # that is asked for [Hz], simulated
KINDS = sorted(name.removeprefix("subscribe_") for name in dir(Telemetry) if name.startswith("subscribe_"))
NOT_STREAMED = "actuator_control_target"  # by no flight controller of today
# With simulated time in them, so that the interval can be read.
STAMPED = [
    "altitude", "attitude_euler", "attitude_quaternion", "ground_truth", "home", "imu", "raw_gps", "raw_imu",
    "scaled_imu",
]  # fmt: skip


@pytest.fixture(scope="module")
def vehicle_options() -> dict[str, Any]:
    return {"wind": WIND, "home": (*HOME, HEADING)}


@pytest.fixture
def flying(station: MavsdkStation) -> MavsdkStation:
    """Station, and a vehicle circling at 20 m/s, 100 m above home."""
    station.begin("trim:20")
    return station


def collected(telemetry: Any, kind: str, enough: Callable[[list[Any]], Any]) -> list[Any]:
    """What comes of one kind until it is enough."""
    got: list[Any] = []
    heard = getattr(telemetry, f"subscribe_{kind}")(lambda value, _: got.append(value))
    until(lambda: enough(got))
    getattr(telemetry, f"unsubscribe_{kind}")(heard)
    return got


def test_every_kind_of_telemetry_comes(flying: MavsdkStation) -> None:
    counts = dict.fromkeys(KINDS, 0)

    def counter(kind: str) -> Callable[[Any, Any], None]:
        def count(_value: Any, _user: Any) -> None:
            counts[kind] += 1

        return count

    for kind in KINDS:
        getattr(flying.telemetry, f"subscribe_{kind}")(counter(kind))
    flying.action.transition_to_multicopter()  # says something to the pilot
    flying.telemetry.set_rate_raw_imu(1.0)
    until(lambda: all(counts[kind] for kind in KINDS if kind != NOT_STREAMED))


def test_what_is_told_on_the_ground_is_what_the_vehicle_was_started_with(station: MavsdkStation) -> None:
    telemetry = station.telemetry
    position, home = telemetry.position(), telemetry.home()
    assert (position.latitude_deg, position.longitude_deg) == pytest.approx(HOME[:2], abs=1e-6)
    assert (home.latitude_deg, home.longitude_deg, home.absolute_altitude_m) == pytest.approx(HOME, abs=1e-3)
    assert position.absolute_altitude_m - position.relative_altitude_m == pytest.approx(HOME[2], abs=0.01)
    assert position.relative_altitude_m < 0.5  # stands on its gear
    # The wind turns it a little on its gear.
    assert telemetry.heading().heading_deg == pytest.approx(HEADING, abs=2.0)
    assert telemetry.attitude_euler().yaw_deg == pytest.approx(HEADING, abs=2.0)
    assert telemetry.gps_info().fix_type == FixType.FIX_3D
    assert telemetry.battery().remaining_percent == pytest.approx(100.0, abs=1.0)
    assert telemetry.imu().acceleration_frd.down_m_s2 == pytest.approx(-9.81, abs=0.02)
    assert telemetry.distance_sensor().current_distance_m == pytest.approx(position.relative_altitude_m, abs=0.02)
    assert telemetry.vtol_state() == VtolState.MC
    assert telemetry.landed_state() == LandedState.ON_GROUND
    assert telemetry.flight_mode() == FlightMode.HOLD
    origin = telemetry.get_gps_global_origin()
    assert (origin.latitude_deg, origin.longitude_deg, origin.altitude_m) == pytest.approx(HOME, abs=1e-3)


def test_what_is_told_in_flight_fits_together(flying: MavsdkStation) -> None:
    telemetry = flying.telemetry
    until(lambda: telemetry.fixedwing_metrics().airspeed_m_s > 15.0 and telemetry.landed_state() == LandedState.IN_AIR)
    velocity, metrics = telemetry.velocity_ned(), telemetry.fixedwing_metrics()
    assert math.hypot(velocity.north_m_s, velocity.east_m_s) == pytest.approx(metrics.groundspeed_m_s, abs=2.0)
    assert metrics.airspeed_m_s == pytest.approx(20.0, abs=2.0)
    air = (velocity.north_m_s - WIND[0], velocity.east_m_s - WIND[1])
    assert math.hypot(*air) == pytest.approx(metrics.airspeed_m_s, abs=2.0)
    wind = telemetry.wind()
    assert (wind.wind_x_ned_m_s, wind.wind_y_ned_m_s) == pytest.approx(WIND, abs=0.5)
    assert flying.height == pytest.approx(100.0, abs=3.0)
    assert telemetry.altitude().altitude_relative_m == pytest.approx(100.0, abs=3.0)
    assert telemetry.vtol_state() == VtolState.FW
    until(lambda: telemetry.battery().current_battery_a > 1.0)


def test_two_messages_of_one_moment_tell_the_same_attitude(flying: MavsdkStation) -> None:
    telemetry = flying.telemetry
    telemetry.set_rate_attitude_euler(RATE)
    telemetry.set_rate_attitude_quaternion(RATE)
    quaternions: dict[int, Any] = {}
    heard = telemetry.subscribe_attitude_quaternion(lambda q, _: quaternions.__setitem__(q.timestamp_us, q))
    angles = collected(telemetry, "attitude_euler", lambda got: len(got) > 20)
    telemetry.unsubscribe_attitude_quaternion(heard)
    pairs = [(angle, quaternions[angle.timestamp_us]) for angle in angles if angle.timestamp_us in quaternions]
    assert len(pairs) > 10
    for angle, q in pairs:
        yaw = math.atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z))
        assert math.remainder(math.degrees(yaw) - angle.yaw_deg, 360.0) == pytest.approx(0.0, abs=0.01)
        roll = math.atan2(2.0 * (q.w * q.x + q.y * q.z), 1.0 - 2.0 * (q.x * q.x + q.y * q.y))
        assert math.degrees(roll) == pytest.approx(angle.roll_deg, abs=0.01)


@pytest.mark.parametrize("kind", STAMPED)
def test_a_rate_that_is_asked_for_is_exact_in_simulated_time(station: MavsdkStation, kind: str) -> None:
    getattr(station.telemetry, f"set_rate_{kind}")(RATE)
    stamps = [value.timestamp_us for value in collected(station.telemetry, kind, lambda got: len(got) > 20)][-15:]
    steps = [after - before for before, after in pairwise(stamps)]
    assert steps == pytest.approx([1e6 / RATE] * len(steps), abs=1000.0)  # some are stamped in milliseconds
    getattr(station.telemetry, f"set_rate_{kind}")(0.0)


@pytest.mark.parametrize(
    "kind", sorted({name[9:] for name in dir(Telemetry) if name.startswith("set_rate_") and name[-6:] != "_async"})
)
def test_every_rate_can_be_asked_for(station: MavsdkStation, kind: str) -> None:
    ask = getattr(station.telemetry, f"set_rate_{kind}")
    if kind == NOT_STREAMED:
        with pytest.raises(TelemetryError, match="COMMAND_DENIED"):
            ask(5.0)
    else:
        ask(5.0)


def test_health_is_good_on_the_ground_and_not_when_something_speaks_against_arming(station: MavsdkStation) -> None:
    health = station.telemetry.health()
    assert all(value for name, value in vars(health).items() if name.startswith("is_")), str(health)
    parameters = station.plugin(Param)
    usual = parameters.get_param_float("FW_AIRSPD_TRIM")
    parameters.set_param_float("FW_AIRSPD_TRIM", 12.0)  # less than FW_AIRSPD_MIN
    until(lambda: not station.telemetry.health().is_armable)
    with pytest.raises(ActionError, match="DENIED"):
        station.action.arm()
    parameters.set_param_float("FW_AIRSPD_TRIM", usual)
    until(station.telemetry.health_all_ok)


def test_info_says_whose_software_it_is_and_how_fast_it_flies(station: MavsdkStation) -> None:
    info = station.plugin(Info)
    version, identification = info.get_version(), info.get_identification()
    assert (version.flight_sw_major, version.flight_sw_minor) == (0, 1)
    assert len(identification.hardware_uid) == 36
    flights: list[Any] = []
    heard = info.subscribe_flight_information(lambda flight, _: flights.append(flight))
    station.take_off(5.0)
    until(lambda: flights and flights[-1].duration_since_takeoff_ms > 0)
    info.unsubscribe_flight_information(heard)
    until(lambda: info.get_speed_factor() == pytest.approx(8.0, rel=0.1))


def test_the_origin_of_the_local_frame_is_moved(station: MavsdkStation) -> None:
    moved = (HOME[0] + 0.001, *HOME[1:])
    station.action.set_gps_global_origin(*moved)
    origin = station.telemetry.get_gps_global_origin()
    assert (origin.latitude_deg, origin.longitude_deg, origin.altitude_m) == pytest.approx(moved, abs=1e-3)
    until(lambda: station.telemetry.position_velocity_ned().position.north_m == pytest.approx(-111.2, abs=0.2))
    station.action.set_gps_global_origin(*HOME)
