"""What a campaign draws: repeatable, independent, within its bounds, and really in the aircraft that flies."""

import math
from dataclasses import replace

import numpy as np
import pytest

from sitl.campaign.cases import AERODYNAMICS, Scatter, draw_case, scattered_aircraft
from vehicle_model.aircraft import load_aircraft

NOMINAL = load_aircraft()
SCATTER = Scatter()


def test_a_case_is_the_same_whenever_it_is_drawn_and_differs_from_the_others() -> None:
    assert draw_case(3, 17, SCATTER) == draw_case(3, 17, SCATTER)
    assert draw_case(3, 17, SCATTER) != draw_case(3, 18, SCATTER)
    assert draw_case(3, 17, SCATTER).wind_ned != draw_case(4, 17, SCATTER).wind_ned


def test_one_source_of_chance_does_not_touch_the_others() -> None:
    calm = draw_case(0, 5, Scatter(wind=0.0, aerodynamics=0.0))
    windy = draw_case(0, 5, SCATTER)
    assert calm.wind_ned == (0.0, 0.0, 0.0)
    assert (calm.mass, calm.centre_of_mass, calm.heading) == (windy.mass, windy.centre_of_mass, windy.heading)


def test_deviations_fill_their_ranges_and_stay_inside() -> None:
    cases = [draw_case(0, number, SCATTER) for number in range(200)]
    speeds = np.array([math.hypot(*case.wind_ned) for case in cases])
    assert 0.0 <= speeds.min() < 0.5
    assert 9.5 < speeds.max() <= 10.0
    masses = np.array([case.mass for case in cases])
    assert 0.90 <= masses.min() < 0.91
    assert 1.09 < masses.max() <= 1.10
    shifts = np.array([case.centre_of_mass for case in cases])
    assert np.abs(shifts).max() <= 0.02
    assert (np.abs(shifts).max(axis=0) > 0.019).all()
    factors = np.array([list(case.aerodynamics.values()) for case in cases])
    assert factors.shape == (200, len(AERODYNAMICS))
    assert np.abs(factors - 1.0).max() <= 0.15
    assert (factors.max(axis=0) - factors.min(axis=0) > 0.25).all()
    from_where = {math.floor(math.atan2(case.wind_ned[1], case.wind_ned[0]) / (0.25 * math.pi)) for case in cases}
    assert len(from_where) == 8


def test_the_scattered_aircraft_has_the_case_s_mass_centre_and_coefficients() -> None:
    case = draw_case(0, 1, SCATTER)
    aircraft = scattered_aircraft(NOMINAL, case)
    record, nominal = aircraft.vehicle[0], NOMINAL.vehicle[0]
    assert record["mass"] == pytest.approx(nominal["mass"] * case.mass)
    assert record["inertia"] == pytest.approx(nominal["inertia"] * case.mass)
    assert record["pivot"] == pytest.approx(nominal["pivot"] - case.centre_of_mass)
    expected = nominal["surfaces"]["lift_slope"][0] * case.aerodynamics["wing.lift_slope"]
    assert record["surfaces"]["lift_slope"][0] == pytest.approx(expected)
    drag = [case.aerodynamics[f"fuselage.drag_area.{axis}"] for axis in "xyz"]
    assert record["fuselage_drag_area"] == pytest.approx(nominal["fuselage_drag_area"] * drag)


def test_every_coefficient_changes_what_flies() -> None:
    for path in AERODYNAMICS:
        case = draw_case(0, 0, Scatter(mass=0.0, centre_of_mass=0.0, aerodynamics=0.0))
        changed = scattered_aircraft(NOMINAL, replace(case, aerodynamics={path: 0.9}))
        assert changed.vehicle.tobytes() != NOMINAL.vehicle.tobytes(), path


def test_no_draw_of_the_shipped_aircraft_is_implausible() -> None:
    for number in range(100):
        aircraft = scattered_aircraft(NOMINAL, draw_case(1, number, SCATTER))
        assert aircraft.wing.wake_factor <= 2.0
        assert aircraft.rotors.wing.induced_power_factor >= 1.0


def test_without_scatter_the_aircraft_is_the_nominal_one() -> None:
    case = draw_case(0, 0, Scatter(wind=0.0, mass=0.0, centre_of_mass=0.0, aerodynamics=0.0))
    assert scattered_aircraft(NOMINAL, case).vehicle.tobytes() == NOMINAL.vehicle.tobytes()
