"""The regime follows from what is asked for and from how the vehicle flies."""

import math

import pytest

from sitl.flight.parameters import Parameters
from sitl.flight.regime import Regime, RegimeWatch, wing_borne
from sitl.flight.view import View


@pytest.fixture
def watch():
    return RegimeWatch(Parameters())


def moment(airspeed, tilt_deg, ground_speed=None):
    return View(airspeed=airspeed, tilt=math.radians(tilt_deg), vn=airspeed if ground_speed is None else ground_speed)


def test_front_transition_ends_near_the_lowest_airspeed(watch):
    assert watch.update(True, moment(0.0, 90.0)) == Regime.TO_CRUISE
    assert watch.update(True, moment(13.4, 20.0)) == Regime.TO_CRUISE
    assert watch.update(True, moment(13.6, 18.0)) == Regime.CRUISE


def test_back_transition_ends_once_the_rotors_carry(watch):
    watch.begin(cruise=True)
    assert watch.update(False, moment(20.0, 60.0)) == Regime.TO_HOVER  # tilt alone, at speed, is no hover
    assert watch.update(False, moment(12.0, 50.0)) == Regime.TO_HOVER
    assert watch.update(False, moment(12.0, 56.0)) == Regime.HOVER


def test_hover_in_a_strong_wind_stays_hover(watch):
    assert watch.update(False, moment(14.0, 40.0)) == Regime.HOVER


def test_back_transition_in_a_strong_headwind_ends_with_the_motion_over_the_ground(watch):
    watch.begin(cruise=True)
    assert watch.update(False, moment(16.0, 22.0, ground_speed=4.0)) == Regime.TO_HOVER
    assert watch.update(False, moment(12.0, 31.0, ground_speed=0.5)) == Regime.HOVER
    assert watch.update(False, moment(14.0, 27.0, ground_speed=2.0)) == Regime.HOVER  # a gust


def test_wing_borne_approach_that_slows_down_to_its_point_shows_as_transition_to_hover(watch):
    watch.begin(cruise=True)
    assert watch.update(True, moment(12.0, 15.0)) == Regime.CRUISE  # a gust is no transition
    assert watch.update(True, moment(11.0, 25.0)) == Regime.TO_HOVER
    assert watch.update(True, moment(2.0, 85.0)) == Regime.TO_HOVER
    assert watch.update(False, moment(2.0, 85.0)) == Regime.HOVER


def test_new_demand_for_cruise_turns_a_back_transition_round(watch):
    watch.begin(cruise=True)
    watch.update(False, moment(12.0, 40.0))
    assert watch.update(True, moment(12.0, 40.0)) == Regime.TO_CRUISE


def test_wing_borne_needs_speed_and_a_lowered_wing():
    parameters = Parameters()
    assert wing_borne(moment(15.0, 10.0), parameters)
    assert not wing_borne(moment(15.0, 60.0), parameters)
    assert not wing_borne(moment(10.0, 10.0), parameters)
