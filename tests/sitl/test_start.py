"""Starts are what they say: at rest on the gear, in steady flight, or as the file has it."""

import math
from pathlib import Path

import numpy as np
import pytest

from sitl.airframe import Airframe
from sitl.start import Start, StartError, start_at
from vehicle_model.aircraft import Aircraft, load_aircraft
from vehicle_model.earth import make_environment
from vehicle_model.state import POSITION, RATES, TILT

HEADING = math.radians(120.0)


@pytest.fixture(scope="module")
def aircraft() -> Aircraft:
    return load_aircraft()


def world(earth: str = "flat", wind: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> np.ndarray:
    return make_environment(
        earth,  # type: ignore[arg-type]
        latitude=0.8,
        longitude=0.15,
        height_ellipsoid=488.0,
        wind_ned=wind,
    )


def flown(aircraft: Aircraft, environment: np.ndarray, start: Start, seconds: float) -> Airframe:
    airframe = Airframe(aircraft, environment, start.state, start.controls, drains=False)
    airframe.advance(round(seconds * airframe.rate))
    return airframe


@pytest.mark.parametrize("earth", ["flat", "round", "wgs84"])
def test_on_the_ground_it_stands_still_wing_up_with_the_ground_bearing_its_weight(
    aircraft: Aircraft, earth: str
) -> None:
    environment = world(earth)
    start = start_at("ground", aircraft, environment, HEADING)
    seen = Airframe(aircraft, environment, start.state, start.controls, drains=False).snapshot()
    later = flown(aircraft, environment, start, 5.0).snapshot()
    # On a rotating sphere the centrifugal force pulls towards the equator; a spheroid is the shape that yields to it.
    assert later.position_ned == pytest.approx(seen.position_ned, abs=1e-3 if earth == "round" else 1e-5)
    assert (later.roll, later.pitch) == pytest.approx((seen.roll, seen.pitch), abs=1e-5)
    assert later.yaw == pytest.approx(HEADING, abs=1e-4)
    assert math.degrees(seen.tilt) == pytest.approx(90.0)
    assert seen.on_ground
    assert seen.position_ned[:2] == (0.0, 0.0)
    lift = -seen.outputs["contact_force_body"][:, 2].sum()
    gravity = {"flat": 9.80665, "round": 9.803, "wgs84": 9.808}[earth]
    assert lift == pytest.approx(float(aircraft.vehicle["mass"][0]) * gravity, rel=1e-3)


def test_on_the_ground_in_a_breeze_it_stays_where_it_is(aircraft: Aircraft) -> None:
    environment = world(wind=(0.0, 6.0, 0.0))
    start = start_at("ground", aircraft, environment, HEADING)
    later = flown(aircraft, environment, start, 5.0).snapshot()
    assert later.on_ground
    assert max(map(abs, later.velocity_ned)) < 0.02


def test_a_gale_that_it_cannot_stand_in_is_said_at_once(aircraft: Aircraft) -> None:
    with pytest.raises(StartError, match="does not come to rest"):
        start_at("ground", aircraft, world(wind=(0.0, 45.0, 0.0)), 0.0)


@pytest.mark.parametrize("airspeed", [0.0, 10.0, 20.0, 30.0])
@pytest.mark.parametrize("wind", [(0.0, 0.0, 0.0), (-4.0, 3.0, 0.0)])
def test_trimmed_it_begins_unaccelerated_at_the_airspeed_and_height_asked_for(
    aircraft: Aircraft, airspeed: float, wind: tuple[float, float, float]
) -> None:
    environment = world(wind=wind)
    start = start_at(f"trim:{airspeed:g}", aircraft, environment, HEADING)
    seen = Airframe(aircraft, environment, start.state, start.controls, drains=False).snapshot()
    assert seen.airspeed == pytest.approx(airspeed, abs=1e-9)
    assert seen.position_ned == (0.0, 0.0, -100.0)
    assert seen.yaw == pytest.approx(HEADING, abs=1e-12)
    assert seen.pitch == pytest.approx(0.0, abs=1e-12)
    along = (airspeed * math.cos(HEADING) + wind[0], airspeed * math.sin(HEADING) + wind[1], 0.0)
    assert seen.velocity_ned == pytest.approx(along, abs=1e-9)
    # Level and unaccelerated: in the plane of symmetry the accelerometer reads gravity alone.
    assert seen.specific_force[0] == pytest.approx(0.0, abs=1e-7)
    assert seen.specific_force[2] == pytest.approx(-9.80665, abs=1e-7)


def test_trimmed_on_the_ellipsoid_it_stays_near_its_height_and_speed(aircraft: Aircraft) -> None:
    environment = world("wgs84")
    later = flown(aircraft, environment, start_at("trim:25", aircraft, environment, HEADING), 2.0).snapshot()
    assert -later.position_ned[2] == pytest.approx(100.0, abs=0.05)
    assert later.airspeed == pytest.approx(25.0, abs=0.05)


def test_a_start_file_puts_every_value_where_it_says_in_si_units(aircraft: Aircraft, tmp_path: Path) -> None:
    file = tmp_path / "start.toml"
    file.write_text(
        """
        position_ned = [10, -20, -150]
        velocity_body = [18.0, 0.5, 1.5]
        attitude_deg = [5.0, 4.0, 90.0]
        rates_deg_s = [1.0, 2.0, 3.0]
        rotor_rpm = [4700, 4800, -600]
        tilt_deg = 15
        aileron_deg = [2.0, -2.0]
        elevator_deg = -1.0
        throttle = [0.35, 0.36, -0.1]
        """
    )
    start = start_at(str(file), aircraft, world(), HEADING)
    seen = Airframe(aircraft, world(), start.state, start.controls, drains=False).snapshot()
    assert seen.position_ned == (10.0, -20.0, -150.0)
    assert list(start.state[3:6]) == [18.0, 0.5, 1.5]
    assert np.degrees([seen.roll, seen.pitch, seen.yaw]) == pytest.approx([5.0, 4.0, 90.0])
    assert np.degrees(start.state[RATES : RATES + 3]) == pytest.approx([1.0, 2.0, 3.0])
    assert start.state[13:16] * 60.0 / (2.0 * math.pi) == pytest.approx([4700.0, 4800.0, -600.0])
    assert np.degrees(start.state[TILT:]) == pytest.approx([15.0, 2.0, -2.0, -1.0])
    assert start.controls[:3] == pytest.approx([0.35, 0.36, -0.1])
    assert np.degrees(start.controls[3:]) == pytest.approx([15.0, 2.0, -2.0, -1.0])


def test_an_empty_start_file_begins_level_above_home_with_its_heading(aircraft: Aircraft, tmp_path: Path) -> None:
    file = tmp_path / "start.toml"
    file.write_text("")
    start = start_at(str(file), aircraft, world(), HEADING)
    assert list(start.state[POSITION : POSITION + 3]) == [0.0, 0.0, -100.0]
    assert Airframe(aircraft, world(), start.state, start.controls, drains=False).snapshot().yaw == pytest.approx(
        HEADING
    )


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("tilt = 3", "tilt: unknown key, expected one of position_ned, velocity_body"),
        ("tilt_deg = 'up'", "tilt_deg: expected `float`, got `str`"),
        ("tilt_deg = true", "tilt_deg: expected `float`, got `bool`"),
        ("attitude_deg = [0, 0, 1000]", "attitude_deg[2]: expected `float` <= 360"),
        ("throttle = [0.1, 0.2]", "throttle: expected `array` of length 3, got 2"),
        ("throttle = [0.1, 'full', 0]", "throttle[1]: expected `float`, got `str`"),
        ("rotor_rpm = [0, nan, 0]", "rotor_rpm[1]: expected a number within +-1e+06, got nan"),
        ("elevator_deg = inf", "elevator_deg: expected a number within +-1e+06, got inf"),
        ("tilt_deg = 1" + "0" * 400, "tilt_deg: expected a number within +-1e+06, got more"),
        ("velocity_body = [0, 0, 1e80]", "velocity_body[2]: expected a number within +-1e+06, got 1e+80"),
        ("position_ned = [0, 0, 0.5]", "position_ned: expected a place above the ground, got one 0.5 m below it"),
        ("tilt_deg = = 3", "cannot be read as TOML"),
    ],
)
def test_a_wrong_start_file_is_one_line_with_the_file_and_the_key(
    aircraft: Aircraft, tmp_path: Path, text: str, expected: str
) -> None:
    file = tmp_path / "wrong.toml"
    file.write_text(text)
    with pytest.raises(StartError) as refusal:
        start_at(str(file), aircraft, world(), HEADING)
    message = str(refusal.value)
    assert expected in message
    assert str(file) in message
    assert "\n" not in message


def test_a_start_file_may_ask_for_what_the_aircraft_can_do_and_no_more(aircraft: Aircraft, tmp_path: Path) -> None:
    tilt, aileron, _, elevator = aircraft.vehicle["servos"][0]
    wing, _, tail = aircraft.vehicle["rotors"][0]
    no_load_rpm = wing["battery_voltage"] / wing["torque_constant"] * 30.0 / math.pi
    file = tmp_path / "edge.toml"
    for form, place, limit in (
        ("tilt_deg = {}", "tilt_deg", math.degrees(tilt["maximum"])),
        ("tilt_deg = {}", "tilt_deg", math.degrees(tilt["minimum"])),
        ("aileron_deg = [0, {}]", "aileron_deg[1]", math.degrees(aileron["minimum"])),
        ("elevator_deg = {}", "elevator_deg", math.degrees(elevator["maximum"])),
        ("rotor_rpm = [{}, 0, 0]", "rotor_rpm[0]", no_load_rpm),
        ("throttle = [0, 0, {}]", "throttle[2]", float(tail["min_throttle"])),
    ):
        file.write_text(form.format(limit))
        start_at(str(file), aircraft, world(), HEADING)
        beyond = limit + math.copysign(1e-3, limit)
        file.write_text(form.format(beyond))
        with pytest.raises(StartError) as refusal:
            start_at(str(file), aircraft, world(), HEADING)
        message = str(refusal.value)
        assert message.startswith(f"{file}: {place}: expected ")
        assert f"{limit:.6g}" in message


def test_a_folder_is_no_start_file_and_said_to_be_one(aircraft: Aircraft, tmp_path: Path) -> None:
    with pytest.raises(StartError, match="a start file, and this is a folder"):
        start_at(str(tmp_path), aircraft, world(), HEADING)


@pytest.mark.parametrize("option", ["trim:fast", "trim:", "trim:-3", "trim:nan", "nowhere.toml", "air"])
def test_an_unknown_start_says_what_was_expected(aircraft: Aircraft, option: str) -> None:
    with pytest.raises(StartError, match="expected"):
        start_at(option, aircraft, world(), HEADING)


def test_a_speed_without_a_trim_is_said_with_the_speed(aircraft: Aircraft) -> None:
    with pytest.raises(StartError, match="no level trim at 300 m/s"):
        start_at("trim:300", aircraft, world(), HEADING)
