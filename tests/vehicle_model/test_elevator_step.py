"""The paper's experiment: a step of the elevator from trimmed flight, Figs 11-12."""

import math

import numpy as np
import pytest

from vehicle_model.aircraft import load_aircraft
from vehicle_model.elevator_step import elevator_step, stepped_controls
from vehicle_model.integrate import advance
from vehicle_model.rotation import body_to_ned
from vehicle_model.state import ELEVATOR, POSITION, QUATERNION, ROTOR_SPEED, VELOCITY
from vehicle_model.trim import TrimError, still_air, trim_level

AIRCRAFT = load_aircraft()
PAPERS = elevator_step(AIRCRAFT, 30.0, math.radians(1.0))


def test_nothing_happens_before_the_step() -> None:
    before = PAPERS.time < 1.0
    assert before.sum() == 400
    assert np.abs(PAPERS.q[before]).max() < 1e-8
    assert np.abs(PAPERS.theta[before]).max() < 1e-8
    assert PAPERS.u[before] == pytest.approx(30.0, abs=1e-6)
    assert np.abs(PAPERS.q[~before]).max() > 1e-3


def test_time_and_arrays_are_as_asked_for() -> None:
    assert PAPERS.time[0] == 0.0
    assert PAPERS.time[-1] == pytest.approx(50.0)
    assert len(PAPERS.time) == len(PAPERS.u) == len(PAPERS.states) == 20001
    coarse = elevator_step(AIRCRAFT, 30.0, math.radians(1.0), duration=2.0, every=10)
    assert coarse.time[1] == pytest.approx(0.025)
    assert coarse.states.tobytes() == PAPERS.states[:801:10].tobytes()


def test_history_is_the_flight_with_the_controls_stepped_at_that_moment() -> None:
    state = PAPERS.trim.state.copy()
    advance(state, PAPERS.controls_before, AIRCRAFT.vehicle, still_air(), 0.0025, 400)
    assert PAPERS.states[400].tobytes() == state.tobytes()
    advance(state, PAPERS.controls_after, AIRCRAFT.vehicle, still_air(), 0.0025, 600)
    assert PAPERS.states[1000].tobytes() == state.tobytes()


def test_velocity_over_ground_is_that_of_the_states() -> None:
    for index in (0, 1000, 9000):
        state = PAPERS.states[index]
        ned = body_to_ned(*state[QUATERNION : QUATERNION + 4], *state[VELOCITY : VELOCITY + 3])
        assert PAPERS.velocity_ned[index] == pytest.approx(ned, rel=1e-12)
    flown = np.trapezoid(PAPERS.velocity_ned, PAPERS.time, axis=0)
    assert flown == pytest.approx(PAPERS.states[-1, POSITION : POSITION + 3], abs=1e-3)


def test_the_step_moves_the_elevator_and_the_tail_motor_and_holds_the_rest() -> None:
    change = PAPERS.controls_after - PAPERS.controls_before
    assert change[6] == pytest.approx(math.radians(1.0))
    assert not change[[0, 1, 3, 4, 5]].any()
    assert PAPERS.states[-1, ELEVATOR] - PAPERS.trim.state[ELEVATOR] == pytest.approx(math.radians(1.0), rel=1e-6)
    hover = trim_level(AIRCRAFT, 0.0)
    tail_up = stepped_controls(AIRCRAFT, hover, math.radians(1.0))[2] - hover.controls[2]
    assert tail_up > 0.0  # positive elevator is tail thrust up
    state = hover.state.copy()
    state[POSITION + 2] = -1000.0
    advance(state, stepped_controls(AIRCRAFT, hover, math.radians(1.0)), AIRCRAFT.vehicle, still_air(), 0.0025, 120)
    assert state[ROTOR_SPEED + 2] > hover.state[ROTOR_SPEED + 2] + 1.0


def test_trailing_edge_down_pitches_the_nose_down_first() -> None:
    soon = (PAPERS.time > 1.0) & (PAPERS.time < 1.3)
    assert PAPERS.q[soon].min() < -math.radians(0.3)
    assert PAPERS.q[soon].max() < math.radians(0.05)


def test_pitch_rate_and_attitude_stay_inside_the_axes_of_fig_12() -> None:
    assert np.abs(np.degrees(PAPERS.q)).max() < 4.0
    assert np.abs(np.degrees(PAPERS.theta)).max() < 1.0


def test_the_short_period_is_over_in_seconds_and_the_phugoid_takes_14() -> None:
    late = PAPERS.time > 6.0
    u = PAPERS.u[late] - PAPERS.u[late].mean()
    slope = np.diff(u)
    turns = PAPERS.time[late][1:-1][(slope[:-1] > 0.0) & (slope[1:] <= 0.0)]  # maxima
    assert len(turns) >= 2
    assert np.diff(turns) == pytest.approx(14.02, rel=0.03)
    # What remains of the short period after 3 s, 11 of its half lives, is lost beside the phugoid.
    calm = (PAPERS.time > 4.0) & (PAPERS.time < 6.0)
    assert np.abs(np.diff(PAPERS.q[calm], 2)).max() * 400.0**2 < 0.02 * np.abs(np.diff(PAPERS.q, 2)).max() * 400.0**2


def test_no_step_is_flown_from_a_speed_without_trim() -> None:
    with pytest.raises(TrimError, match="no level trim at 150 m/s"):
        elevator_step(AIRCRAFT, 150.0)
