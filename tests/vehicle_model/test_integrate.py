"""The integrators: order of convergence, and the same bits however the same flight is stepped."""

import hashlib
import math
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from vehicle_model.aircraft import load_aircraft
from vehicle_model.earth import make_environment
from vehicle_model.integrate import advance, advance_ab2, advance_batch, observe, rk4_step, time_history
from vehicle_model.records import OUTPUTS
from vehicle_model.state import QUATERNION, RATES, STATE_COUNT, TILT, VELOCITY
from vehicle_model.trim import Trim, still_air, trim_level

AIRCRAFT = load_aircraft()
WORLD = still_air()
CRUISE: Trim = trim_level(AIRCRAFT, 30.0)


def disturbed() -> tuple[np.ndarray, np.ndarray]:
    """A smooth piece of flight: small rates and a small servo command, away from stall, stops and rate limits."""
    state, controls = CRUISE.state.copy(), CRUISE.controls.copy()
    state[VELOCITY + 2] += 0.3
    state[RATES : RATES + 3] = 0.1, 0.05, -0.05
    controls[4:6] += 0.02, -0.02
    controls[0] += 0.02
    return state, controls


def distance(a: np.ndarray, b: np.ndarray) -> float:
    """Largest difference, each state weighed by what is large for it."""
    scale = np.array([1.0] * 3 + [1.0] * 3 + [0.05] * 4 + [0.1] * 3 + [30.0] * 3 + [0.1] * 4)
    return float(np.abs((a - b) / scale).max())


def order(method: Callable[..., None], steps: tuple[int, ...]) -> float:
    """Least slope of log error over log dt, for a flight of 0.4 s; the reference is RK4 at a far smaller step."""
    exact, controls = disturbed()
    advance(exact, controls, AIRCRAFT.vehicle, WORLD, 0.4 / 20000, 20000)
    errors = []
    for count in steps:
        state, _ = disturbed()
        method(state, controls, AIRCRAFT.vehicle, WORLD, 0.4 / count, count)
        errors.append(distance(state, exact))
    slopes = np.diff(np.log(errors)) / -np.diff(np.log(steps))
    return float(slopes.min())


def test_runge_kutta_4_converges_with_the_fourth_power_of_the_step() -> None:
    assert order(advance, (80, 160, 320)) > 3.8


def test_adams_bashforth_2_converges_with_the_square_of_the_step() -> None:
    assert order(advance_ab2, (200, 400, 800)) > 1.9


def test_one_call_of_n_steps_is_n_calls_of_one_to_the_last_bit() -> None:
    together, controls = disturbed()
    apart, _ = disturbed()
    stepped, _ = disturbed()
    advance(together, controls, AIRCRAFT.vehicle, WORLD, 0.0025, 300)
    for _ in range(300):
        advance(apart, controls, AIRCRAFT.vehicle, WORLD, 0.0025, 1)
        rk4_step(stepped, controls, AIRCRAFT.vehicle, WORLD, 0.0025)
    assert together.tobytes() == apart.tobytes() == stepped.tobytes()


def test_each_vehicle_of_a_batch_flies_as_alone_to_the_last_bit() -> None:
    rng = np.random.default_rng(7)
    state, controls = disturbed()
    states = state + 0.01 * rng.standard_normal((5, STATE_COUNT))
    commands = controls + 0.01 * rng.standard_normal((5, len(controls)))
    alone = states.copy()
    advance_batch(states, commands, AIRCRAFT.vehicle, WORLD, 0.0025, 200)
    for each, command in zip(alone, commands, strict=True):
        advance(each, command, AIRCRAFT.vehicle, WORLD, 0.0025, 200)
    assert states.tobytes() == alone.tobytes()


def test_a_time_history_is_the_flight_and_keeps_the_state_before_every_nth_step() -> None:
    state, controls = disturbed()
    schedule = np.tile(controls, (101, 1))
    schedule[40:, 6] += 0.01
    history = np.empty((math.ceil(101 / 10), STATE_COUNT))
    flown, _ = disturbed()
    time_history(state, schedule, AIRCRAFT.vehicle, WORLD, 0.0025, 10, history)
    for step in range(101):
        if step % 10 == 0:
            assert history[step // 10].tobytes() == flown.tobytes()
        rk4_step(flown, schedule[step], AIRCRAFT.vehicle, WORLD, 0.0025)
    assert state.tobytes() == flown.tobytes()


FLIGHT = """
import hashlib, sys
sys.path.insert(0, sys.argv[1])
import test_integrate
print(test_integrate.fingerprint())
"""


def fingerprint() -> str:
    """Hash of a flight's end, of its outputs and of the aircraft."""
    state, controls = disturbed()
    advance(state, controls, AIRCRAFT.vehicle, WORLD, 0.0025, 2000)
    outputs, rate = np.zeros(1, OUTPUTS), np.empty(STATE_COUNT)
    observe(state, controls, AIRCRAFT.vehicle, WORLD, outputs, rate)
    return hashlib.sha256(state.tobytes() + rate.tobytes() + outputs.tobytes()).hexdigest()


def test_another_process_gets_the_same_bits() -> None:
    folder = str(Path(__file__).parent)
    other = subprocess.run(
        [sys.executable, "-c", FLIGHT, folder], capture_output=True, text=True, check=True, timeout=120
    )
    assert other.stdout.strip() == fingerprint()


def test_attitude_keeps_unit_length() -> None:
    for method in (advance, advance_ab2):
        state, controls = disturbed()
        state[RATES : RATES + 3] = 6.0, -4.0, 5.0
        method(state, controls, AIRCRAFT.vehicle, WORLD, 0.0025, 400)
        assert np.linalg.norm(state[QUATERNION : QUATERNION + 4]) == pytest.approx(1.0, abs=1e-14)


def test_a_trim_is_an_equilibrium_of_the_stepped_vehicle() -> None:
    state = CRUISE.state.copy()
    advance(state, CRUISE.controls, AIRCRAFT.vehicle, WORLD, 0.0025, 400)
    assert state[0] == pytest.approx(30.0, rel=1e-9)
    # The paper's trim is of longitudinal motion; the tail propeller's torque, tiny in cruise, is left to turn it, and
    # feeds back by its square.
    drift = state - CRUISE.state
    longitudinal = [2, VELOCITY, VELOCITY + 2, QUATERNION, QUATERNION + 2, RATES + 1, *range(TILT, TILT + 4)]
    assert np.abs(drift[longitudinal]).max() < 1e-7
    assert np.abs(drift[1:]).max() < 1e-2


@pytest.mark.parametrize("index", [0, VELOCITY, QUATERNION, RATES, TILT])
def test_a_bad_number_spreads_but_neither_raises_nor_hangs(index: int) -> None:
    for bad in (math.nan, math.inf):
        state, controls = disturbed()
        state[index] = bad
        advance(state, controls, AIRCRAFT.vehicle, WORLD, 0.0025, 5)
        assert not np.isfinite(state).all()


def test_any_state_and_command_can_be_flown_without_an_exception() -> None:
    rng = np.random.default_rng(3)
    ground = make_environment("flat", latitude=0.0, longitude=0.0, height_ellipsoid=0.0)
    for _ in range(200):
        state = rng.standard_normal(STATE_COUNT) * np.array(
            [50.0] * 3 + [30.0] * 3 + [1.0] * 4 + [5.0] * 3 + [800.0] * 3 + [1.5] * 4
        )
        state[QUATERNION : QUATERNION + 4] /= np.linalg.norm(state[QUATERNION : QUATERNION + 4])
        state[2] = -abs(state[2])
        advance(state, rng.uniform(-1.5, 1.5, 7), AIRCRAFT.vehicle, ground, 0.0025, 20)
        assert np.isfinite(state).all()
