"""Manual and Stabilized: sticks reach the actuators with the right sign, hovering and on the wing."""

import math

import numpy as np
import pytest

from sitl.control.records import Level
from sitl.flight.demand import Demand
from sitl.flight.direct_modes import Manual
from sitl.flight.landed import LandedState
from sitl.flight.manual_input import ManualInput, Sticks
from sitl.flight.mode import Mode
from sitl.flight.parameters import Parameters
from sitl.flight.view import View
from vehicle_model.aircraft import load_aircraft
from vehicle_model.integrate import advance
from vehicle_model.state import RATES, STATE_COUNT
from vehicle_model.steady_flight import trim_steady
from vehicle_model.trim import still_air

ROLL, PITCH, YAW = 0, 1, 2


@pytest.fixture(scope="module")
def trims():
    return {speed: trim_steady(load_aircraft(), speed) for speed in (0.0, 20.0)}


def manual_controls(stick, tilt):
    aircraft, demand, sticks = load_aircraft(), Demand(), Sticks()
    mode = Manual(Parameters(), demand, sticks, aircraft)
    view = View(tilt=tilt)
    mode.start(view, cruise=tilt < 0.5)
    sticks.now = stick
    mode.update(view, LandedState.IN_AIR)
    return demand.record[0]["direct"].copy()


@pytest.mark.parametrize(
    ("stick", "axis", "sign"),
    [
        (ManualInput(right=0.3), ROLL, 1.0),
        (ManualInput(forward=0.3), PITCH, -1.0),
        (ManualInput(turn=0.3), YAW, 1.0),
    ],
)
@pytest.mark.parametrize("airspeed", [0.0, 20.0])
def test_each_stick_turns_the_real_aircraft_its_way_in_hover_and_cruise(trims, airspeed, stick, axis, sign):
    aircraft, trim = load_aircraft(), trims[airspeed]
    tilt = float(trim.state[16])
    change = manual_controls(stick, tilt) - manual_controls(ManualInput(), tilt)
    rates = []
    for controls in (trim.controls, trim.controls + change):
        state = np.array(trim.state, dtype=float)
        assert state.shape == (STATE_COUNT,)
        advance(state, np.array(controls), aircraft.vehicle, still_air(), 1.0 / 400.0, 80)
        rates.append(state[RATES : RATES + 3])
    turned = rates[1] - rates[0]
    assert turned[axis] * sign > math.radians(2.0)
    assert abs(turned[axis]) == max(abs(turned))


def test_full_sticks_stay_within_throttles_and_servos():
    aircraft = load_aircraft()
    servos = aircraft.vehicle[0]["servos"]
    for tilt in (0.0, 0.7, math.pi / 2):
        for forward in (-1.0, 1.0):
            for right in (-1.0, 1.0):
                for turn in (-1.0, 1.0):
                    controls = manual_controls(ManualInput(forward, right, 1.0, turn), tilt)
                    assert (np.abs(controls[:3]) <= 1.0).all()
                    assert (controls[:2] >= 0.0).all()
                    assert (controls[3:] >= servos["minimum"] - 1e-12).all()
                    assert (controls[3:] <= servos["maximum"] + 1e-12).all()


def test_transition_swings_the_wing_in_manual(vehicle):
    vehicle.begin(height=50.0)
    vehicle.flight.manual(ManualInput(throttle=0.5))
    vehicle.flight.set_mode(Mode.MANUAL)
    vehicle.run(0.1)
    assert vehicle.record["level"] == Level.DIRECT
    assert vehicle.record["direct"][3] == pytest.approx(math.pi / 2)
    vehicle.flight.transition(cruise=True)
    vehicle.run(3.0)
    assert vehicle.record["direct"][3] == pytest.approx(math.radians(90.0 - 36.0), abs=0.01)
    vehicle.run(6.0)
    assert vehicle.record["direct"][3] == 0.0


def test_a_tilt_stick_sets_the_wing_directly(vehicle):
    vehicle.begin(height=50.0)
    vehicle.flight.manual(ManualInput(tilt=0.5))
    vehicle.flight.set_mode(Mode.MANUAL)
    vehicle.run(0.1)
    assert vehicle.record["direct"][3] == pytest.approx(math.radians(45.0))


def test_stabilized_turns_sticks_into_attitude_and_thrust(vehicle):
    vehicle.begin(height=50.0)
    vehicle.flight.manual(ManualInput(forward=0.5, right=-1.0, throttle=0.6, turn=0.5))
    vehicle.flight.set_mode(Mode.STABILIZED)
    vehicle.run(0.1)
    record = vehicle.record
    assert record["level"] == Level.ATTITUDE
    assert record["roll"] == pytest.approx(-math.radians(20.0))
    assert record["pitch"] == pytest.approx(-math.radians(10.0))
    assert record["yaw_rate"] == pytest.approx(math.radians(22.5))
    assert record["thrust"] == 0.6
    assert record["tilt"] == pytest.approx(math.pi / 2)


def test_stabilized_leaves_the_tilt_to_the_laws_once_in_cruise(vehicle):
    vehicle.begin(height=50.0, airspeed=20.0)
    vehicle.flight.manual(ManualInput())
    vehicle.flight.set_mode(Mode.STABILIZED)
    vehicle.run(2.0)
    assert math.isnan(vehicle.record["tilt"])


def test_standing_vehicle_idles_until_the_throttle_stick_is_raised(vehicle):
    vehicle.flight.manual(ManualInput(throttle=0.0))
    vehicle.flight.set_mode(Mode.STABILIZED)
    vehicle.flight.arm()
    vehicle.run(0.5)
    assert vehicle.record["level"] == Level.IDLE
    vehicle.flight.manual(ManualInput(throttle=0.7))
    vehicle.run(0.1)
    assert vehicle.record["level"] == Level.ATTITUDE
