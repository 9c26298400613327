"""Faults change what they should in a copy of the vehicle, are felt by the equations of motion, and can be undone."""

import math

import numpy as np
import pytest

from vehicle_model.aircraft import load_aircraft
from vehicle_model.faults import lose_thrust, restore, stick_servo
from vehicle_model.integrate import advance, observe
from vehicle_model.records import OUTPUTS
from vehicle_model.state import STATE_COUNT, TILT
from vehicle_model.trim import still_air, trim_level

AIRCRAFT = load_aircraft()
HOVER = trim_level(AIRCRAFT, 0.0)


def observed(vehicle: np.ndarray) -> np.void:
    outputs = np.zeros(1, OUTPUTS)
    observe(HOVER.state.copy(), HOVER.controls, vehicle, still_air(), outputs, np.empty(STATE_COUNT))
    return outputs[0]


def flown(vehicle: np.ndarray, seconds: float, **servo: float) -> np.ndarray:
    """State after flying from the hover with some servos told an angle."""
    state, controls = HOVER.state.copy(), HOVER.controls.copy()
    for name, angle in servo.items():
        controls[{"tilt": 3, "elevator": 6}[name]] = angle
    advance(state, controls, vehicle, still_air(), 0.0025, round(seconds / 0.0025))
    return state


@pytest.mark.parametrize("rotor", [0, 1, 2])
def test_a_rotor_loses_the_stated_share_of_its_thrust_at_once_and_the_others_nothing(rotor: int) -> None:
    vehicle, healthy = AIRCRAFT.vehicle.copy(), observed(AIRCRAFT.vehicle)
    lose_thrust(vehicle, rotor, 0.2)
    damaged = observed(vehicle)
    expected = healthy["thrust"].copy()
    expected[rotor] *= 0.8
    np.testing.assert_allclose(damaged["thrust"], expected, rtol=1e-12)
    np.testing.assert_array_equal(damaged["shaft_torque"], healthy["shaft_torque"])
    np.testing.assert_array_equal(damaged["electrical_power"], healthy["electrical_power"])


def test_a_weak_left_rotor_rolls_the_aircraft_to_the_left_and_lets_it_sink() -> None:
    vehicle, healthy = AIRCRAFT.vehicle.copy(), observed(AIRCRAFT.vehicle)
    lose_thrust(vehicle, 0, 0.2)
    damaged = observed(vehicle)
    assert damaged["moment_body"][0] < healthy["moment_body"][0] - 1.0
    assert damaged["force_body"][2] > healthy["force_body"][2] + 5.0


def test_a_stuck_servo_stays_where_it_is_whatever_it_is_told() -> None:
    vehicle = AIRCRAFT.vehicle.copy()
    stick_servo(vehicle, 0)
    state = flown(vehicle, 0.5, tilt=0.0, elevator=0.2)
    assert state[TILT] == HOVER.state[TILT]
    assert state[TILT + 3] == pytest.approx(0.2, abs=0.01)  # the others still move


def test_a_servo_stuck_at_an_angle_goes_there_at_its_own_speed_and_stays() -> None:
    vehicle, goal = AIRCRAFT.vehicle.copy(), math.radians(45.0)
    stick_servo(vehicle, 0, goal)
    limit = AIRCRAFT.servos.tilt.rate_limit
    assert flown(vehicle, 0.2, tilt=0.0)[TILT] == pytest.approx(HOVER.state[TILT] - 0.2 * limit, abs=1e-6)
    assert flown(vehicle, 3.0, tilt=0.0)[TILT] == pytest.approx(goal, abs=1e-6)
    assert flown(vehicle, 3.0, tilt=math.radians(90.0))[TILT] == pytest.approx(goal, abs=1e-6)


def test_restoring_makes_the_vehicle_healthy_but_charges_no_battery() -> None:
    vehicle = AIRCRAFT.vehicle.copy()
    vehicle["rotors"]["battery_voltage"] = 40.0
    sagging = vehicle.tobytes()
    lose_thrust(vehicle, 1, 0.5)
    stick_servo(vehicle, 0, 0.5)
    stick_servo(vehicle, 3)
    assert vehicle.tobytes() != sagging
    restore(vehicle, AIRCRAFT.vehicle)
    assert vehicle.tobytes() == sagging


def test_a_fault_leaves_the_aircraft_itself_alone() -> None:
    before = AIRCRAFT.vehicle.tobytes()
    vehicle = AIRCRAFT.vehicle.copy()
    lose_thrust(vehicle, 0, 1.0)
    stick_servo(vehicle, 1, 0.1)
    assert AIRCRAFT.vehicle.tobytes() == before


@pytest.mark.parametrize("fraction", [-0.1, 1.5, math.nan])
def test_an_impossible_loss_is_refused(fraction: float) -> None:
    with pytest.raises(ValueError, match="fraction: expected the lost share of the thrust, 0 to 1, got"):
        lose_thrust(AIRCRAFT.vehicle.copy(), 0, fraction)


def test_wrong_parts_and_angles_are_named() -> None:
    vehicle = AIRCRAFT.vehicle.copy()
    for rotor in (-1, 3):
        with pytest.raises(ValueError, match=f"rotor: expected an index from 0 to 2, got {rotor}"):
            lose_thrust(vehicle, rotor, 0.2)
    with pytest.raises(ValueError, match="servo: expected an index from 0 to 3, got 4"):
        stick_servo(vehicle, 4)
    with pytest.raises(ValueError, match=r"angle: expected one of the servo's travel, -5 to 140 deg, got 150 deg"):
        stick_servo(vehicle, 0, math.radians(150.0))
    with pytest.raises(ValueError, match="got nan deg"):
        stick_servo(vehicle, 0, math.nan)
    assert vehicle.tobytes() == AIRCRAFT.vehicle.tobytes()


def test_a_read_only_vehicle_is_refused() -> None:
    with pytest.raises(ValueError, match="vehicle: expected a writable copy"):
        lose_thrust(AIRCRAFT.vehicle, 0, 0.2)
    with pytest.raises(ValueError, match="vehicle: expected a writable copy"):
        stick_servo(AIRCRAFT.vehicle, 0)
    with pytest.raises(ValueError, match="vehicle: expected a writable copy"):
        restore(AIRCRAFT.vehicle, AIRCRAFT.vehicle)
