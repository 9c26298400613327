"""Fixed-step integration of the equations of motion, for analysis and real time alike.

Runge-Kutta 4 is the one to fly with: four right-hand sides a step, error of order dt^4. Adams-Bashforth 2
takes one right-hand side a step, error of order dt^2: for large batches at small steps.
"""

import numpy as np

from vehicle_model.compiled import compiled, compiled_loop
from vehicle_model.dynamics import derivative
from vehicle_model.loads import describe_parts
from vehicle_model.records import OUTPUTS
from vehicle_model.rotation import quaternion_normalise
from vehicle_model.state import QUATERNION, STATE_COUNT

__all__ = ["advance", "advance_ab2", "advance_batch", "observe", "rk4_step", "time_history"]


@compiled
def normalise(state) -> None:
    """Bring the quaternion back to unit length (the integrators keep it there only to their own order)."""
    q = quaternion_normalise(state[QUATERNION], state[QUATERNION + 1], state[QUATERNION + 2], state[QUATERNION + 3])
    for k in range(4):
        state[QUATERNION + k] = q[k]


@compiled
def runge_kutta(state, controls, vehicle, environment, dt: float, outputs, work) -> None:
    """One RK4 step in place; `work` (3, 20) is scratch."""
    rate, total, trial = work[0], work[1], work[2]
    derivative(state, controls, vehicle, environment, outputs, rate)
    for k in range(STATE_COUNT):
        total[k] = rate[k]
        trial[k] = state[k] + 0.5 * dt * rate[k]
    derivative(trial, controls, vehicle, environment, outputs, rate)
    for k in range(STATE_COUNT):
        total[k] += 2.0 * rate[k]
        trial[k] = state[k] + 0.5 * dt * rate[k]
    derivative(trial, controls, vehicle, environment, outputs, rate)
    for k in range(STATE_COUNT):
        total[k] += 2.0 * rate[k]
        trial[k] = state[k] + dt * rate[k]
    derivative(trial, controls, vehicle, environment, outputs, rate)
    for k in range(STATE_COUNT):
        state[k] += dt / 6.0 * (total[k] + rate[k])
    normalise(state)


@compiled_loop
def advance(state, controls, vehicle, environment, dt: float, steps: int) -> None:
    """Fly `steps` RK4 steps of `dt` seconds in place with the controls held; state (20,), controls (7,)."""
    outputs = np.empty(1, OUTPUTS)
    work = np.empty((3, STATE_COUNT))
    for _ in range(steps):
        runge_kutta(state, controls, vehicle, environment, dt, outputs, work)


@compiled
def rk4_step(state, controls, vehicle, environment, dt: float) -> None:
    """One RK4 step of `dt` seconds in place."""
    outputs = np.empty(1, OUTPUTS)
    work = np.empty((3, STATE_COUNT))
    runge_kutta(state, controls, vehicle, environment, dt, outputs, work)


@compiled_loop
def advance_ab2(state, controls, vehicle, environment, dt: float, steps: int) -> None:
    """Fly `steps` Adams-Bashforth 2 steps in place, started by one step of Heun's method."""
    outputs = np.empty(1, OUTPUTS)
    before = np.empty(STATE_COUNT)
    now = np.empty(STATE_COUNT)
    trial = np.empty(STATE_COUNT)
    for step in range(steps):
        derivative(state, controls, vehicle, environment, outputs, now)
        if step == 0:
            for k in range(STATE_COUNT):
                trial[k] = state[k] + dt * now[k]
            derivative(trial, controls, vehicle, environment, outputs, before)
            for k in range(STATE_COUNT):
                state[k] += 0.5 * dt * (now[k] + before[k])
        else:
            for k in range(STATE_COUNT):
                state[k] += dt * (1.5 * now[k] - 0.5 * before[k])
        for k in range(STATE_COUNT):
            before[k] = now[k]
        normalise(state)


@compiled_loop
def advance_batch(states, controls, vehicle, environment, dt: float, steps: int) -> None:
    """Fly many vehicles of one kind in place: states (n, 20), controls (n, 7), RK4, each as `advance` would."""
    outputs = np.empty(1, OUTPUTS)
    work = np.empty((3, STATE_COUNT))
    for i in range(states.shape[0]):
        for _ in range(steps):
            runge_kutta(states[i], controls[i], vehicle, environment, dt, outputs, work)


@compiled
def observe(state, controls, vehicle, environment, outputs, rate) -> None:
    """All outputs and the state derivative of one moment.

    The equations of motion fill only what they need; here the rest is cleared or worked out.
    """
    out = outputs[0]
    for i in range(out.contact_force_body.shape[0]):
        for k in range(3):
            out.contact_force_body[i, k] = 0.0
    derivative(state, controls, vehicle, environment, outputs, rate)
    describe_parts(state, vehicle[0], out)


@compiled_loop
def time_history(state, schedule, vehicle, environment, dt: float, every: int, history) -> None:
    """Fly through a schedule of controls (n, 7), one row a step; store the state before every `every`-th step.

    `history` is (ceil(n / every), 20); the state ends after the last step.
    """
    outputs = np.empty(1, OUTPUTS)
    work = np.empty((3, STATE_COUNT))
    for step in range(schedule.shape[0]):
        if step % every == 0:
            history[step // every] = state
        runge_kutta(state, schedule[step], vehicle, environment, dt, outputs, work)
