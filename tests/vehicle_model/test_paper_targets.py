"""The shipped aircraft flies as the paper's: Table 1, Fig. 10, Figs 11-12, and the control a flyable machine needs."""

import math

import numpy as np
import pytest

from vehicle_model.aircraft import Aircraft, load_aircraft
from vehicle_model.authority import hover_margins, thrust_to_weight
from vehicle_model.dynamics import derivative
from vehicle_model.elevator_step import ElevatorStep, elevator_step
from vehicle_model.integrate import observe
from vehicle_model.linearise import linearise, modes
from vehicle_model.records import OUTPUTS
from vehicle_model.state import RATES, STATE_COUNT, VELOCITY
from vehicle_model.steady_flight import trim_steady
from vehicle_model.trim import Trim, still_air, trim_sweep

TABLE_1 = {"short_period": complex(-2.6766, 10.7711), "phugoid": complex(-0.0626, 0.4481)}


@pytest.fixture(scope="module")
def aircraft() -> Aircraft:
    return load_aircraft()


@pytest.fixture(scope="module")
def trims(aircraft: Aircraft) -> list[Trim]:
    return trim_sweep(aircraft, range(31))


@pytest.fixture(scope="module")
def step(aircraft: Aircraft) -> ElevatorStep:
    return elevator_step(aircraft, 30.0, math.radians(1.0))


@pytest.mark.parametrize("name", TABLE_1)
@pytest.mark.parametrize("part", ["real", "imag"])
def test_each_part_of_the_poles_is_within_2_percent_of_table_1(
    aircraft: Aircraft, trims: list[Trim], name: str, part: str
) -> None:
    (found,) = (mode for mode in modes(linearise(aircraft, trims[30])) if mode.name == name)
    assert getattr(found, part) == pytest.approx(getattr(TABLE_1[name], part), rel=0.02)


def test_every_trim_balances_to_1e_9_of_the_weight_in_the_equations_of_motion(
    aircraft: Aircraft, trims: list[Trim]
) -> None:
    outputs, rate = np.zeros(1, OUTPUTS), np.empty(STATE_COUNT)
    for trim in trims:
        assert trim.residual < 1e-9
        derivative(trim.state, trim.controls, aircraft.vehicle, still_air(), outputs, rate)
        assert np.abs(rate[VELOCITY : VELOCITY + 3]).max() < 1e-9 * 9.80665
        moment = aircraft.mass_properties.iyy * abs(rate[RATES + 1])
        assert moment < 1e-9 * 9.80665 * aircraft.mass_properties.mass


def test_rpm_is_6000_in_hover_and_between_4000_and_5000_at_30_m_s(trims: list[Trim]) -> None:
    assert trims[0].rpm == pytest.approx(6000.0, rel=0.02)
    assert 4000.0 <= trims[30].rpm <= 5000.0
    assert all(2000.0 <= trim.rpm <= 7000.0 for trim in trims)  # the axis of Fig. 10


def test_tilt_falls_all_the_way_from_hover_to_cruise(trims: list[Trim]) -> None:
    tilt = np.degrees([trim.tilt for trim in trims])
    assert 78.0 <= tilt[0] <= 90.0
    assert tilt[30] < 15.0
    assert np.all(np.diff(tilt) < 0.0)


def test_elevator_stays_within_10_deg(trims: list[Trim]) -> None:
    assert max(abs(math.degrees(trim.elevator)) for trim in trims) <= 10.0


def test_no_trim_curve_jumps(aircraft: Aircraft, trims: list[Trim]) -> None:
    # A jump's second difference stays as the airspeed step is halved, a kink's halves, a smooth curve's quarters.
    half = trim_sweep(aircraft, np.arange(0.0, 30.1, 0.5))
    coarse, fine = (
        np.abs(np.diff([[trim.rpm, trim.tilt, trim.elevator] for trim in each], 2, axis=0)).max(axis=0)
        for each in (trims, half)
    )
    assert np.all(fine < 0.6 * coarse)


def test_the_phugoid_after_the_elevator_step_takes_14_s(step: ElevatorStep) -> None:
    late = step.time > 5.0
    u, time = step.u[late], step.time[late]
    peaks = time[1:-1][(u[1:-1] > u[:-2]) & (u[1:-1] >= u[2:])]
    assert len(peaks) >= 3
    assert np.diff(peaks).mean() == pytest.approx(14.02, rel=0.02)


def test_the_short_period_is_gone_two_seconds_after_the_step(step: ElevatorStep) -> None:
    # Table 1: half in 0.26 s. Its part of q is what is left when the slow phugoid's is smoothed away.
    q = step.q - np.convolve(step.q, np.ones(233) / 233.0, mode="same")  # 0.583 s, one period
    first = np.abs(q[(step.time > 1.0) & (step.time < 1.6)]).max()
    later = np.abs(q[(step.time > 3.0) & (step.time < 3.6)]).max()
    assert later < 0.05 * first


def test_q_and_theta_stay_inside_the_axes_of_fig_12(step: ElevatorStep) -> None:
    assert np.abs(np.degrees(step.q)).max() <= 4.0
    assert np.abs(np.degrees(step.theta)).max() <= 1.0
    assert np.degrees(step.theta).min() < -0.1  # positive elevator is nose down, and not a negligible one


def test_static_thrust_is_at_least_one_and_a_half_times_the_weight(aircraft: Aircraft) -> None:
    assert thrust_to_weight(aircraft) >= 1.5


def test_30_percent_control_is_left_about_each_axis_hovering_in_8_m_s_wind_from_anywhere(aircraft: Aircraft) -> None:
    rows = hover_margins(aircraft, wind=8.0, directions=12)
    assert len(rows) == 12
    for bearing, _, left in rows:
        assert min(left.roll, left.pitch, left.yaw) >= 0.3, f"wind from {math.degrees(bearing):.0f} deg"


def test_forward_speed_at_the_controls_of_hover_raises_the_nose(aircraft: Aircraft, trims: list[Trim]) -> None:
    # NASA TN D-1389: tilt-wings pitch up as they leave hover.
    outputs, rate = np.zeros(1, OUTPUTS), np.empty(STATE_COUNT)
    for speed in (0.5, 2.0, 5.0):
        state = trims[0].state.copy()
        state[VELOCITY] = speed
        derivative(state, trims[0].controls, aircraft.vehicle, still_air(), outputs, rate)
        assert outputs["moment_body"][0, 1] > 0.0


def test_a_descent_at_partial_power_and_mid_tilt_costs_stall_margin(aircraft: Aircraft, trims: list[Trim]) -> None:
    # The VZ-2's trouble: at 25 to 30 deg of incidence, worse in descents at partial power.
    wetted = [i for i, name in enumerate(aircraft.surface_names) if name.endswith("wetted")]
    level = min(trims, key=lambda trim: abs(math.degrees(trim.tilt) - 30.0))
    outputs, rate = np.zeros(1, OUTPUTS), np.empty(STATE_COUNT)
    observe(level.state, level.controls, aircraft.vehicle, still_air(), outputs, rate)
    margin, power = [outputs["stall_margin"][0, wetted].min()], [level.power]
    for angle in (4.0, 8.0):
        descent = trim_steady(aircraft, level.airspeed, climb_angle=-math.radians(angle))
        margin.append(descent.outputs["stall_margin"][wetted].min())
        power.append(descent.outputs["shaft_power"].sum())
    assert np.all(np.diff(power) < 0.0)
    assert np.all(np.degrees(np.diff(margin)) < -1.0)
