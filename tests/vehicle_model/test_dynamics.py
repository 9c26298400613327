"""The equations of motion as a whole: conservation without air, actuators, gravity, and what each state's rate is."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vehicle_model.aircraft import load_aircraft
from vehicle_model.earth import make_environment
from vehicle_model.integrate import advance, observe
from vehicle_model.records import OUTPUTS
from vehicle_model.rotation import body_to_ned, quaternion_from_euler
from vehicle_model.state import (
    POSITION,
    QUATERNION,
    RATES,
    ROTOR_SPEED,
    STATE_COUNT,
    TILT,
    VELOCITY,
    blank_controls,
    blank_state,
)

G = 9.80665
AIRCRAFT = load_aircraft()
CRAFT = AIRCRAFT.vehicle[0]
SEA_LEVEL = make_environment("flat", latitude=0.0, longitude=0.0, height_ellipsoid=0.0, ground_height=-1e6)


def rate_of(state: np.ndarray, controls: np.ndarray, environment: np.ndarray = SEA_LEVEL) -> tuple[np.void, np.ndarray]:
    outputs, rate = np.zeros(1, OUTPUTS), np.empty(STATE_COUNT)
    observe(state, controls, AIRCRAFT.vehicle, environment, outputs, rate)
    return outputs[0], rate


def coasting() -> np.ndarray:
    """Tumbling with spinning propellers."""
    state = blank_state()
    state[VELOCITY : VELOCITY + 3] = 20.0, -3.0, 2.0
    state[RATES : RATES + 3] = 0.8, -0.5, 1.1
    state[QUATERNION : QUATERNION + 4] = quaternion_from_euler(0.4, -0.2, 1.0)
    state[ROTOR_SPEED : ROTOR_SPEED + 3] = 500.0, 420.0, -700.0
    state[TILT] = 0.6
    return state


def held(state: np.ndarray) -> np.ndarray:
    """Controls that leave the motors off and the servos where they are."""
    controls = blank_controls()
    controls[3:] = state[TILT : TILT + 4]
    return controls


def airless(*, friction: bool) -> np.ndarray:
    """The aircraft as in a vacuum: nothing that the air could push on."""
    vehicle = AIRCRAFT.vehicle.copy()
    vehicle["surface_count"], vehicle["fuselage_drag_area"] = 0, 0.0
    vehicle["rotors"]["lift_slope"], vehicle["rotors"]["profile_drag"] = 0.0, 0.0
    if not friction:
        vehicle["rotors"]["no_load_current"] = 0.0
        vehicle["rotors"]["throttle_sets_power"] = 1  # without power such a motor coasts; on voltage it brakes
    return vehicle


def energy(state: np.ndarray) -> float:
    rates = state[RATES : RATES + 3]
    kinetic = 0.5 * CRAFT["mass"] * float(np.sum(state[VELOCITY : VELOCITY + 3] ** 2))
    turning = 0.5 * float(rates @ CRAFT["inertia"] @ rates)
    spinning = 0.5 * float(CRAFT["rotors"]["inertia"] @ state[ROTOR_SPEED : ROTOR_SPEED + 3] ** 2)
    return kinetic + turning + spinning - CRAFT["mass"] * G * float(state[POSITION + 2])


def angular_momentum(state: np.ndarray) -> np.ndarray:
    """About the centre of mass, propellers included, NED."""
    axes = np.array([(math.cos(state[TILT]), 0.0, -math.sin(state[TILT]))] * 2 + [(0.0, 0.0, -1.0)])
    spin = CRAFT["rotors"]["spin"] * CRAFT["rotors"]["inertia"] * state[ROTOR_SPEED : ROTOR_SPEED + 3]
    momentum = CRAFT["inertia"] @ state[RATES : RATES + 3] + spin @ axes
    return np.array(body_to_ned(*state[QUATERNION : QUATERNION + 4], *momentum))


def test_without_air_energy_and_angular_momentum_are_conserved() -> None:
    state = coasting()
    # A propeller that the motor does not brake keeps its own energy.
    vehicle = airless(friction=False)
    before, momentum = energy(state), angular_momentum(state)
    advance(state, held(state), vehicle, SEA_LEVEL, 0.0025, 800)
    assert np.abs(state[RATES : RATES + 3] - coasting()[RATES : RATES + 3]).max() > 0.1  # it does tumble
    assert energy(state) == pytest.approx(before, rel=1e-9)
    assert angular_momentum(state) == pytest.approx(momentum, abs=1e-8)


def test_a_motor_exchanges_angular_momentum_with_the_airframe_and_makes_none() -> None:
    state = coasting()
    controls = held(state)
    controls[:3] = 0.4, 0.1, 0.0
    momentum = angular_momentum(state)
    speeds = state[ROTOR_SPEED : ROTOR_SPEED + 3].copy()
    advance(state, controls, airless(friction=True), SEA_LEVEL, 0.0025, 100)
    assert np.abs(state[ROTOR_SPEED : ROTOR_SPEED + 3] - speeds).min() > 5.0
    assert angular_momentum(state) == pytest.approx(momentum, abs=1e-8)


def test_without_air_and_power_the_centre_of_mass_falls_freely() -> None:
    state = coasting()
    start = np.array(body_to_ned(*state[QUATERNION : QUATERNION + 4], *state[VELOCITY : VELOCITY + 3]))
    advance(state, held(state), airless(friction=True), SEA_LEVEL, 0.0025, 800)
    expected = start * 2.0 + np.array([0.0, 0.0, 0.5 * G * 2.0**2])
    assert state[POSITION : POSITION + 3] == pytest.approx(expected, abs=1e-8)


@given(st.floats(0.0, 1.0), st.floats(0.0, 900.0), st.floats(-1.0, 1.0))
def test_a_rotor_accelerates_with_the_excess_of_motor_over_propeller_torque(
    throttle: float, speed: float, tail: float
) -> None:
    state, controls = coasting(), held(coasting())
    state[ROTOR_SPEED] = speed
    controls[0], controls[2] = throttle, tail
    out, rate = rate_of(state, controls)
    for i in range(3):
        excess = float(out["motor_torque"][i] - out["shaft_torque"][i])
        assert rate[ROTOR_SPEED + i] == pytest.approx(excess / CRAFT["rotors"]["inertia"][i], rel=1e-12)


def test_newtons_law_with_gravity_and_the_rotating_axes() -> None:
    state = coasting()
    out, rate = rate_of(state, held(state))
    q = state[QUATERNION : QUATERNION + 4]
    gravity = np.array(body_to_ned(q[0], -q[1], -q[2], -q[3], 0.0, 0.0, G))
    turning = np.cross(state[RATES : RATES + 3], state[VELOCITY : VELOCITY + 3])
    expected = out["force_body"] / CRAFT["mass"] + gravity - turning
    assert rate[VELOCITY : VELOCITY + 3] == pytest.approx(expected, rel=1e-9)
    euler = CRAFT["inertia"] @ rate[RATES : RATES + 3] + np.cross(
        state[RATES : RATES + 3], CRAFT["inertia"] @ state[RATES : RATES + 3]
    )
    assert euler == pytest.approx(out["moment_body"], rel=1e-9, abs=1e-9)


def test_servos_move_at_no_more_than_their_rate_and_stop_at_their_ends() -> None:
    state = blank_state()
    controls = blank_controls()
    controls[3:] = 10.0
    for i in range(4):
        servo = CRAFT["servos"][i]
        _, rate = rate_of(state, controls)
        assert rate[TILT + i] == pytest.approx(float(servo["rate_limit"]))
    advance(state, controls, airless(friction=True), SEA_LEVEL, 0.0025, 2000)
    assert state[TILT : TILT + 4] == pytest.approx(CRAFT["servos"]["maximum"], abs=1e-6)


def test_outputs_describe_the_moment() -> None:
    wind = make_environment(
        "flat", latitude=0.0, longitude=0.0, height_ellipsoid=120.0, ground_height=100.0, wind_ned=(3.0, 0.0, 0.0)
    )
    state = blank_state()
    state[VELOCITY] = 15.0
    state[POSITION + 2] = -30.0
    out, _ = rate_of(state, blank_controls(), wind)
    assert float(out["airspeed"]) == pytest.approx(12.0)
    assert out["velocity_air_body"] == pytest.approx([12.0, 0.0, 0.0])
    assert float(out["height_ellipsoid"]) == pytest.approx(150.0)
    assert float(out["height_above_ground"]) == pytest.approx(50.0)
    assert float(out["density"]) == pytest.approx(1.2073, rel=1e-3)  # US Standard Atmosphere 1976 at 150 m
    assert out["shaft_power"] == pytest.approx(out["shaft_torque"] * state[ROTOR_SPEED : ROTOR_SPEED + 3])


def test_a_tilting_wing_feels_the_air_as_one_that_pitches_about_its_pivot() -> None:
    speed = float(CRAFT["servos"][0]["rate_limit"])
    tilting = coasting()
    tilting[RATES : RATES + 3] = 0.0
    moving = held(tilting)
    moving[3] = 2.0  # far away, so that the servo runs at its limit
    pitching = tilting.copy()
    pitching[RATES + 1] = speed
    # The pivot of a body that pitches about its centre of mass moves by (q z, 0, -q x): take that out again.
    x, _, z = CRAFT["pivot"]
    pitching[VELOCITY : VELOCITY + 3] -= speed * np.array([z, 0.0, -x])
    wing = slice(0, 6)
    expected = rate_of(pitching, held(pitching))[0]["surface_load"][wing]
    assert rate_of(tilting, moving)[0]["surface_load"][wing] == pytest.approx(expected, rel=1e-9, abs=1e-9)
    assert rate_of(tilting, held(tilting))[0]["surface_load"][wing] != pytest.approx(expected, rel=1e-3)
