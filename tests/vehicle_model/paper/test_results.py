"""What is computed for the figures, against closed forms and against other ways to the same number."""

import math

import numpy as np
import pytest

from vehicle_model.aircraft import load_aircraft
from vehicle_model.earth import STANDARD_GRAVITY
from vehicle_model.linearise import Mode
from vehicle_model.paper.results import Results, compute, fit_oscillation
from vehicle_model.paper.tables import speed_stability


@pytest.fixture(scope="module")
def results() -> Results:
    return compute(load_aircraft())


def test_a_damped_oscillation_is_found_in_signals_that_share_it() -> None:
    time = np.linspace(5.0, 50.0, 2000)
    eigenvalue = complex(-0.07, 0.52)
    wave = np.exp(eigenvalue * (time - 5.0))
    signals = np.column_stack([2.0 + 0.3 * np.real(wave), -0.01 + 0.04 * np.imag(wave)])
    found, amplitudes = fit_oscillation(time, signals, Mode("phugoid", -0.05, 0.45))
    assert found == pytest.approx(eigenvalue, rel=1e-6)
    assert amplitudes == pytest.approx([0.3, 0.04], rel=1e-6)


def test_the_linear_model_and_the_flight_agree_on_the_elevator_step(results: Results) -> None:
    assert results.step_summary.linear_error < 0.05
    assert results.step_summary.phugoid.omega == pytest.approx(abs(_phugoid(results)), rel=0.02)


def test_speed_swings_by_g_over_omega_per_pitch_in_the_phugoid(results: Results) -> None:
    closed = STANDARD_GRAVITY / abs(_phugoid(results))
    assert results.step_summary.u_per_theta == pytest.approx(closed, rel=0.05)
    assert results.step_summary.linear_u_per_theta == pytest.approx(closed, rel=0.05)


def _phugoid(results: Results) -> complex:
    mode = results.mode("phugoid")
    assert mode is not None
    return complex(mode.real, mode.imag)


def test_hover_tilt_balances_thrust_drag_and_slipstream_lift(results: Results) -> None:
    assert results.hover.tilt_with_drag == pytest.approx(results.trims[0].tilt, abs=math.radians(0.05))
    assert results.hover.lift > 0.0
    assert results.hover.drag > 0.0
    tilt = results.trims[0].tilt
    tail = float(results.trims[0].outputs["thrust"][2])
    upward = (results.hover.thrust - results.hover.drag) * math.sin(tilt) + results.hover.lift * math.cos(tilt) + tail
    assert upward == pytest.approx(results.weight, rel=1e-6)


def test_power_held_takes_thrust_away_as_thrust_over_speed_and_thrust_held_not_at_all(results: Results) -> None:
    # X_u of "thrust" is drag alone. With the shaft power held and a propeller of efficiency eta, T = eta P/V would fall
    # by T/V; a fixed-pitch propeller's efficiency changes with speed, so it is that within a factor of two.
    drag_only = speed_stability(results.linear["thrust"])
    thrust = float(results.cruise.outputs["rotor_force_body"][:, 0].sum())
    ideal = thrust / 30.0 / (results.weight / STANDARD_GRAVITY)
    lost = drag_only - speed_stability(results.linear["power"])
    assert 0.5 * ideal < lost < 2.0 * ideal
    assert speed_stability(results.linear["rpm"]) < speed_stability(results.linear["power"]) < drag_only < 0.0


def test_the_literal_slipstream_leaves_the_wetted_wing_without_lift_in_cruise(results: Results) -> None:
    cruise = results.literal[-1]
    assert cruise is not None
    names = results.aircraft.surface_names
    wetted = [i for i, name in enumerate(names) if name.endswith("wetted")]
    lift = -cruise.outputs["surface_force_body"][wetted, 2].sum()
    wing = results.aircraft.wing
    area = sum(wing.chord_at(strip.y) * strip.width for strip in wing.strips if strip.wetted)
    pressure = 0.5 * 1.225 * float(cruise.outputs["induced_velocity"][0]) ** 2
    closed = 2.0 * area * pressure * 0.1 * math.degrees(wing.incidence)
    assert lift == pytest.approx(closed, rel=0.15)  # tilted by a few degrees, and with some drag
    assert lift < 0.01 * results.weight
