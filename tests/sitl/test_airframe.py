"""The airframe as an object: time, determinism, what a snapshot says, and how it ends when numbers go bad."""

import math

import numpy as np
import pytest

from sitl.airframe import Airframe, FlightDivergedError
from sitl.start import standing, trimmed
from vehicle_model.aircraft import Aircraft, load_aircraft
from vehicle_model.earth import make_environment
from vehicle_model.state import POSITION, QUATERNION, RATES, STATE_NAMES, TILT, VELOCITY, blank_controls, blank_state

LATITUDE, LONGITUDE, HEIGHT = math.radians(47.397742), math.radians(8.545594), 488.0


@pytest.fixture(scope="module")
def aircraft() -> Aircraft:
    return load_aircraft()


def environment(earth: str = "flat", wind: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> np.ndarray:
    return make_environment(
        earth,  # type: ignore[arg-type]
        latitude=LATITUDE,
        longitude=LONGITUDE,
        height_ellipsoid=HEIGHT,
        wind_ned=wind,
    )


def cruise(aircraft: Aircraft, earth: str = "flat", rate: int = 400) -> Airframe:
    world = environment(earth, wind=(3.0, -2.0, 0.5))
    start = trimmed(aircraft, world, airspeed=25.0, heading=0.7)
    airframe = Airframe(aircraft, world, start.state, start.controls, drains=False, rate=rate)
    airframe.set_controls(start.controls + [0.05, -0.02, 0.0, 0.03, 0.02, -0.01, 0.04])
    return airframe


def test_the_same_flight_gives_the_same_bytes(aircraft: Aircraft) -> None:
    first, second = cruise(aircraft), cruise(aircraft)
    first.advance(2000)
    second.advance(2000)
    assert first.state.tobytes() == second.state.tobytes()


@pytest.mark.parametrize("earth", ["flat", "wgs84"])
def test_single_steps_with_snapshots_between_give_the_bytes_of_one_long_advance(aircraft: Aircraft, earth: str) -> None:
    one_by_one, at_once = cruise(aircraft, earth), cruise(aircraft, earth)
    for _ in range(1000):
        one_by_one.advance(1)
        one_by_one.snapshot()
    at_once.advance(1000)
    assert one_by_one.state.tobytes() == at_once.state.tobytes()
    assert one_by_one.time == at_once.time


def test_time_is_steps_over_rate_exactly(aircraft: Aircraft) -> None:
    airframe = cruise(aircraft, rate=300)
    for _ in range(10):
        airframe.advance(7)
    assert airframe.tick == 70
    assert airframe.time == 70 / 300
    assert airframe.snapshot().time == 70 / 300


def test_a_snapshot_stays_as_it_was_while_the_flight_goes_on_and_cannot_be_written(aircraft: Aircraft) -> None:
    airframe = cruise(aircraft)
    airframe.advance(100)
    moment = airframe.snapshot()
    before = moment.state.tobytes(), moment.controls.tobytes(), moment.outputs.tobytes()
    airframe.set_controls(blank_controls())
    airframe.advance(100)
    airframe.snapshot()
    assert (moment.state.tobytes(), moment.controls.tobytes(), moment.outputs.tobytes()) == before
    with pytest.raises(ValueError, match="read-only"):
        moment.state[0] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        moment.outputs["airspeed"] = 1.0


def test_at_rest_on_the_ground_the_accelerometer_reads_minus_one_g_and_the_place_is_home(aircraft: Aircraft) -> None:
    world = environment()
    start = standing(aircraft, world, heading=math.radians(30.0))
    seen = Airframe(aircraft, world, start.state, start.controls, drains=False).snapshot()
    assert seen.on_ground
    assert seen.specific_force == pytest.approx((0.0, 0.0, -9.80665), abs=1e-6)
    assert (seen.latitude, seen.longitude) == pytest.approx((LATITUDE, LONGITUDE), abs=1e-15)
    assert math.degrees(seen.yaw) == pytest.approx(30.0, abs=1e-5)
    assert math.degrees(seen.tilt) == pytest.approx(90.0)
    # US Standard Atmosphere 1976 at 488.27 m: 95.596 kPa, 284.977 K (barometric formula, h = 488.23 m geopotential)
    geopotential = 6356766.0 * seen.altitude_msl / (6356766.0 + seen.altitude_msl)
    temperature = 288.15 - 0.0065 * geopotential
    assert seen.temperature == pytest.approx(temperature, abs=1e-9)
    assert seen.pressure == pytest.approx(101325.0 * (temperature / 288.15) ** 5.25588, rel=1e-6)
    assert seen.density == pytest.approx(seen.pressure / (287.053 * temperature), rel=1e-5)


def test_attitude_velocity_and_airspeed_of_a_snapshot_are_those_of_the_rotation_matrix(aircraft: Aircraft) -> None:
    roll, pitch, yaw = 0.3, -0.4, 2.1
    cr, sr, cp, sp, cy, sy = *_cs(roll), *_cs(pitch), *_cs(yaw)
    body_to_ned = (
        np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
        @ np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
        @ np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    )
    wind = (3.0, -2.0, 0.5)
    state = blank_state()
    state[POSITION : POSITION + 3] = 120.0, -40.0, -300.0
    state[VELOCITY : VELOCITY + 3] = 18.0, -3.0, 4.0
    state[RATES : RATES + 3] = 0.1, 0.2, -0.3
    state[TILT] = 0.5
    half = np.array([roll, pitch, yaw]) / 2.0
    (cr, cp, cy), (sr, sp, sy) = np.cos(half), np.sin(half)
    state[QUATERNION : QUATERNION + 4] = (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )
    seen = Airframe(aircraft, environment(wind=wind), state, blank_controls()).snapshot()
    velocity_ned = body_to_ned @ state[VELOCITY : VELOCITY + 3]
    assert seen.velocity_ned == pytest.approx(tuple(velocity_ned), abs=1e-12)
    assert (seen.roll, seen.pitch, seen.yaw) == pytest.approx((roll, pitch, yaw), abs=1e-12)
    assert seen.airspeed == pytest.approx(np.linalg.norm(velocity_ned - wind), abs=1e-12)
    assert seen.rates == (0.1, 0.2, -0.3)
    assert seen.position_ned == (120.0, -40.0, -300.0)
    assert seen.height_ellipsoid == pytest.approx(HEIGHT + 300.0, abs=1e-9)
    assert seen.wind_ned == wind
    assert not seen.on_ground


def _cs(angle: float) -> tuple[float, float]:
    return math.cos(angle), math.sin(angle)


def test_on_the_ellipsoid_attitude_and_velocity_are_given_in_the_local_axes_of_the_vehicle(aircraft: Aircraft) -> None:
    """200 km north of home the local horizon has turned by the change of latitude."""
    world = environment("wgs84")
    state = blank_state()
    state[POSITION : POSITION + 3] = 200e3, 0.0, 0.0
    state[VELOCITY] = 20.0
    seen = Airframe(aircraft, world, state, blank_controls()).snapshot()
    turned = seen.latitude - LATITUDE
    assert turned == pytest.approx(200e3 / 6372e3, rel=5e-3)
    # Level at home and heading north is nose up against the horizon further north, which has dipped.
    assert seen.pitch == pytest.approx(turned, abs=1e-9)
    assert seen.velocity_ned == pytest.approx((20.0 * math.cos(turned), 0.0, -20.0 * math.sin(turned)), abs=1e-9)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_controls_that_are_not_finite_are_refused_by_name_and_change_nothing(aircraft: Aircraft, bad: float) -> None:
    airframe = cruise(aircraft)
    held = airframe.controls
    wrong = held.copy()
    wrong[6] = bad
    with pytest.raises(ValueError, match="controls: expected finite numbers, got elevator"):
        airframe.set_controls(wrong)
    assert airframe.controls.tobytes() == held.tobytes()
    with pytest.raises(ValueError, match="expected 7 numbers"):
        airframe.set_controls([0.0] * 6)


def test_a_flight_that_diverges_says_what_broke_and_keeps_its_last_finite_state(aircraft: Aircraft) -> None:
    airframe = cruise(aircraft)
    airframe.advance(10)
    state = airframe.state
    state[RATES] = 1e80  # finite, yet its products overflow within a step
    airframe.reset(state, airframe.controls)
    with pytest.raises(FlightDivergedError, match=r"diverged after t = 0\.0250 s: .*\bq0\b.*not finite"):
        airframe.advance(4)
    assert airframe.tick == 10
    assert np.isfinite(airframe.state).all()
    assert math.isfinite(airframe.snapshot().altitude_msl)


def test_reset_moves_the_vehicle_and_lets_time_go_on(aircraft: Aircraft) -> None:
    airframe = cruise(aircraft)
    begin = airframe.state
    airframe.advance(100)
    airframe.reset(begin, airframe.controls)
    assert airframe.state == pytest.approx(begin, abs=1e-15)
    assert airframe.time == 0.25
    begin[STATE_NAMES.index("rotor_left")] = math.nan
    with pytest.raises(ValueError, match="state: expected finite numbers, got rotor_left = nan"):
        airframe.reset(begin, airframe.controls)
    with pytest.raises(ValueError, match="unit quaternion"):
        airframe.reset(np.zeros(20), airframe.controls)
