"""Failed motors and a stuck tilt servo are noticed; what a sound actuator does never is."""

import dataclasses
import math

import numpy as np
import pytest

from sitl.control.records import Level
from sitl.flight.actuator_watch import ActuatorWatch
from sitl.flight.view import View
from vehicle_model.aircraft import load_aircraft

PERIOD = 0.02
HOVER = (560.0, 560.0, 300.0)


@pytest.fixture
def vehicle() -> np.ndarray:
    return load_aircraft().vehicle


def watch_for(watch: ActuatorWatch, view: View, seconds: float, level: int = Level.VELOCITY) -> tuple[str, ...]:
    for _ in range(round(seconds / PERIOD)):
        view.time += PERIOD
        watch.update(view, level)
    return watch.faults


@pytest.mark.parametrize(("number", "name"), [(0, "left motor"), (1, "right motor"), (2, "tail motor")])
def test_a_rotor_far_below_its_command_has_failed_after_half_a_second(
    vehicle: np.ndarray, number: int, name: str
) -> None:
    speeds = list(HOVER)
    speeds[number] = 0.0
    view = View(rotor_speeds=(speeds[0], speeds[1], speeds[2]), rotor_speed_commands=HOVER)
    watch = ActuatorWatch(vehicle)
    assert watch_for(watch, view, 0.4) == ()
    assert watch_for(watch, view, 0.3) == (f"{name} failed",)


def test_a_reversed_tail_rotor_is_judged_in_its_own_direction(vehicle: np.ndarray) -> None:
    watch = ActuatorWatch(vehicle)
    view = View(rotor_speeds=(560.0, 560.0, -300.0), rotor_speed_commands=(560.0, 560.0, -300.0))
    assert watch_for(watch, view, 2.0) == ()
    view.rotor_speeds = (560.0, 560.0, 300.0)
    assert watch_for(watch, view, 2.0) == ("tail motor failed",)


def test_neither_a_sagging_battery_nor_driven_nor_stopping_rotors_are_faults(vehicle: np.ndarray) -> None:
    watch = ActuatorWatch(vehicle)
    sagging = View(rotor_speeds=(480.0, 480.0, 250.0), rotor_speed_commands=HOVER)
    driven = View(rotor_speeds=(700.0, 700.0, 400.0), rotor_speed_commands=HOVER)
    stopping = View(rotor_speeds=HOVER, rotor_speed_commands=(0.0, 0.0, 0.0))
    for view in (sagging, driven, stopping):
        watch.reset()
        assert watch_for(watch, view, 3.0) == ()


def test_direct_throttles_say_nothing_of_speeds(vehicle: np.ndarray) -> None:
    assert watch_for(ActuatorWatch(vehicle), View(rotor_speed_commands=HOVER), 3.0, Level.DIRECT) == ()


def test_a_spin_up_is_no_fault(vehicle: np.ndarray) -> None:
    watch = ActuatorWatch(vehicle)
    view = View(rotor_speed_commands=HOVER)
    watch_for(watch, view, 0.4)
    view.rotor_speeds = HOVER
    assert watch_for(watch, view, 3.0) == ()


def test_a_wing_that_the_laws_judge_stuck_is_told_with_its_angle(vehicle: np.ndarray) -> None:
    watch = ActuatorWatch(vehicle)
    view = View(tilt=math.radians(45.0), tilt_fault=0.9)
    assert watch_for(watch, view, 3.0) == ()
    assert not watch.tilt_stuck
    view.tilt_fault = 1.0
    assert watch_for(watch, view, PERIOD) == ("tilt servo stuck at 45 deg",)
    assert watch.tilt_stuck


def test_faults_stay_until_repaired_and_add_up(vehicle: np.ndarray) -> None:
    watch = ActuatorWatch(vehicle)
    view = View(tilt=0.5, rotor_speed_commands=HOVER, rotor_speeds=(0.0, 560.0, 300.0))
    watch_for(watch, view, 1.0)
    view.tilt_fault = 1.0
    watch_for(watch, view, 3.0)
    sound = dataclasses.replace(view, tilt=1.5, tilt_fault=0.0, rotor_speeds=HOVER)
    assert watch_for(watch, sound, 3.0) == ("left motor failed", "tilt servo stuck at 29 deg")
    watch.reset()
    assert watch_for(watch, sound, 3.0) == ()


def test_a_repaired_actuator_is_judged_anew_and_not_by_what_was_seen_before(vehicle: np.ndarray) -> None:
    watch = ActuatorWatch(vehicle)
    view = View(tilt=0.5, rotor_speed_commands=HOVER, rotor_speeds=(0.0, 560.0, 300.0))
    watch_for(watch, view, 1.0)
    view.tilt_fault = 1.0
    assert len(watch_for(watch, view, 1.0)) == 2
    watch.reset()
    assert watch_for(watch, view, 0.4) == (), "the rotor is given its time, the laws wait for the wing to move"
    view.rotor_speeds, view.tilt_fault = HOVER, 0.5
    assert watch_for(watch, view, 1.0) == ()
    view.tilt_fault = 1.0
    assert watch_for(watch, view, 1.0) == ("tilt servo stuck at 29 deg",)
