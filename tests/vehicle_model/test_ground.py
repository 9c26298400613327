"""The landing gear: a vehicle stands, slides, lands and tips as Coulomb and a spring would have it, never held down."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vehicle_model.aircraft import load_aircraft
from vehicle_model.earth import make_environment
from vehicle_model.ground import contact_force
from vehicle_model.integrate import advance, observe
from vehicle_model.records import CONTACT, OUTPUTS
from vehicle_model.rotation import body_to_ned, euler_from_quaternion, quaternion_from_euler
from vehicle_model.state import POSITION, QUATERNION, RATES, STATE_COUNT, VELOCITY, blank_controls, blank_state

G = 9.80665
AIRCRAFT = load_aircraft()
WORLD = make_environment("flat", latitude=0.0, longitude=0.0, height_ellipsoid=0.0)
CONTROLS = blank_controls()
CONTACTS = AIRCRAFT.vehicle[0]["contacts"][: AIRCRAFT.vehicle[0]["contact_count"]].copy()
WEIGHT = float(AIRCRAFT.vehicle["mass"][0]) * G
LEG = np.array([(np.zeros(3), 3000.0, 120.0, 0.6)], CONTACT)[0]


def bare() -> np.ndarray:
    """The aircraft without aerodynamic surfaces and propellers: what is left is mechanics."""
    vehicle = AIRCRAFT.vehicle.copy()
    vehicle["surface_count"], vehicle["rotor_count"], vehicle["fuselage_drag_area"] = 0, 0, 0.0
    return vehicle


BARE = bare()


def standing(above: float = 0.0, roll: float = 0.0) -> np.ndarray:
    """At rest with the lowest wheel `above` the ground [m], or, at 0, pressed in as far as the weight presses."""
    state = blank_state()
    state[QUATERNION : QUATERNION + 4] = quaternion_from_euler(roll, 0.0, 0.0)
    lowest = max(body_to_ned(*state[QUATERNION : QUATERNION + 4], *each)[2] for each in CONTACTS["position"])
    sag = 0.0 if above else WEIGHT / CONTACTS["stiffness"].sum()
    state[POSITION + 2] = sag - above - lowest
    return state


def flown_until(state: np.ndarray, vehicle: np.ndarray, done: Callable[[np.ndarray], bool], limit: float) -> float:
    """Simulated seconds until `done`, in steps of 2.5 ms; fails after `limit`."""
    steps = 0
    while not done(state):
        assert steps * 0.0025 < limit, "did not happen in time"
        advance(state, CONTROLS, vehicle, WORLD, 0.0025, 1)
        steps += 1
    return steps * 0.0025


def contact_forces(state: np.ndarray, vehicle: np.ndarray) -> np.ndarray:
    outputs, rate = np.zeros(1, OUTPUTS), np.empty(STATE_COUNT)
    observe(state, CONTROLS, vehicle, WORLD, outputs, rate)
    return outputs[0]["contact_force_body"].copy()


number = st.floats(-5.0, 5.0)


@given(st.floats(-0.1, 0.1), number, number, number)
def test_the_ground_pushes_and_never_pulls_and_friction_opposes_sliding_within_coulombs_cone(
    depth: float, sinking: float, north: float, east: float
) -> None:
    fn, fe, fd = contact_force(LEG, depth, sinking, north, east)
    assert fd <= 0.0
    if depth <= 0.0:
        assert (fn, fe, fd) == (0.0, 0.0, 0.0)
    assert fn * north + fe * east <= 0.0
    assert math.hypot(fn, fe) <= 0.6 * -fd * (1.0 + 1e-12)
    assert fn * east == pytest.approx(fe * north, abs=1e-9)
    if math.hypot(north, east) > 0.5:
        assert math.hypot(fn, fe) == pytest.approx(0.6 * -fd, rel=1e-3)


def test_a_pressed_leg_is_a_spring_and_a_damper() -> None:
    assert contact_force(LEG, 0.01, 0.0, 0.0, 0.0) == (0.0, 0.0, -30.0)
    assert contact_force(LEG, 0.01, 0.1, 0.0, 0.0)[2] == pytest.approx(-42.0)
    assert contact_force(LEG, 0.01, -1.0, 0.0, 0.0)[2] == 0.0  # leaving faster than the spring follows


def test_left_alone_it_stands_still_on_all_legs_with_its_weight_on_them() -> None:
    state = standing()
    advance(state, CONTROLS, AIRCRAFT.vehicle, WORLD, 0.0025, 4000)
    before = state.copy()
    assert np.linalg.norm(state[VELOCITY : VELOCITY + 3]) < 1e-3
    assert np.abs(state[RATES : RATES + 3]).max() < 1e-3
    advance(state, CONTROLS, AIRCRAFT.vehicle, WORLD, 0.0025, 4000)
    moved = np.linalg.norm((state - before)[POSITION : POSITION + 3])
    assert moved < 10.0 * 1e-3  # less than 1 mm/s over 10 s
    forces = contact_forces(state, AIRCRAFT.vehicle)[: len(CONTACTS)]
    down = np.array([body_to_ned(*state[QUATERNION : QUATERNION + 4], *each)[2] for each in forces])
    assert (down < 0.0).all()
    assert down.sum() == pytest.approx(-WEIGHT, rel=1e-3)


@pytest.mark.parametrize("heading", [0.0, 0.5 * math.pi])
def test_it_slides_to_a_stop_over_the_distance_of_coulomb_friction(heading: float) -> None:
    state = standing()
    friction = float(CONTACTS["friction"][0])
    speed = 1.0
    # The wheels carry all of the braking at a height below the mass: keep it low enough not to tip.
    vehicle = BARE.copy()
    vehicle["contacts"]["position"][0, :, 2] *= 0.3
    state[POSITION + 2] = -float(vehicle["contacts"]["position"][0, 0, 2]) + WEIGHT / CONTACTS["stiffness"].sum()
    state[VELOCITY], state[VELOCITY + 1] = speed * math.cos(heading), speed * math.sin(heading)
    taken = flown_until(state, vehicle, lambda s: bool(np.hypot(s[VELOCITY], s[VELOCITY + 1]) < 0.01), 3.0)
    slid = math.hypot(state[POSITION], state[POSITION + 1])
    assert slid == pytest.approx(speed**2 / (2.0 * friction * G), rel=0.05)
    # Friction fades below 2 cm/s of sliding, so the last centimetres a second take longer than Coulomb's v/(mu g).
    assert taken == pytest.approx(speed / (friction * G), rel=0.25)


def test_dropped_from_half_a_metre_it_hits_at_the_speed_of_free_fall_and_settles_on_its_legs() -> None:
    state = standing(above=0.5)
    flown_until(state, AIRCRAFT.vehicle, lambda s: bool(contact_forces(s, AIRCRAFT.vehicle).any()), 1.0)
    free_fall = math.sqrt(2.0 * G * 0.5)
    assert 0.9 * free_fall < state[VELOCITY + 2] < free_fall + 0.0025 * G  # less the drag of the wing lying flat

    def settled(s: np.ndarray) -> bool:
        return bool(np.abs(s[VELOCITY : VELOCITY + 3]).max() < 2e-3 and np.abs(s[RATES : RATES + 3]).max() < 2e-3)

    for _ in range(40):  # settled for good, not just at a turning point
        flown_until(state, AIRCRAFT.vehicle, settled, 6.0)
        advance(state, CONTROLS, AIRCRAFT.vehicle, WORLD, 0.0025, 10)
    assert settled(state)
    roll, pitch, _ = euler_from_quaternion(*state[QUATERNION : QUATERNION + 4])
    assert abs(roll) < 0.01
    assert abs(pitch) < 0.05
    assert state[POSITION + 2] == pytest.approx(standing()[POSITION + 2], abs=0.01)


def test_it_falls_back_on_its_legs_or_over_according_to_where_its_mass_is() -> None:
    track, height = abs(float(CONTACTS["position"][0, 1])), float(CONTACTS["position"][0, 2])
    balance = math.atan2(track, height)

    def roll(s: np.ndarray) -> float:
        return float(euler_from_quaternion(*s[QUATERNION : QUATERNION + 4])[0])

    back = standing(roll=balance - 0.15)
    flown_until(back, BARE, lambda s: abs(roll(s)) < 0.02, 4.0)
    over = standing(roll=balance + 0.15)
    flown_until(over, BARE, lambda s: roll(s) > 0.5 * math.pi, 4.0)


def test_up_in_the_air_the_gear_does_nothing() -> None:
    state = standing(above=0.01)
    assert not contact_forces(state, BARE).any()
    state[POSITION + 2] = -500.0
    assert not contact_forces(state, BARE).any()
