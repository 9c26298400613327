"""The paper's experiment (Figs 11-12): trimmed flight, an elevator step, and what the aircraft does."""

import math
from dataclasses import dataclass

import numpy as np

from vehicle_model.aircraft import Aircraft
from vehicle_model.equivalent_elevator import tail_speed
from vehicle_model.integrate import time_history
from vehicle_model.motor import throttle_for
from vehicle_model.records import OUTPUTS
from vehicle_model.rotation import body_to_ned, euler_from_quaternion
from vehicle_model.state import QUATERNION, RATES, ROTOR_SPEED, STATE_COUNT, TILT, VELOCITY
from vehicle_model.trim import Trim, balance_motors, still_air, trim_level

__all__ = ["ElevatorStep", "elevator_step", "stepped_controls"]


@dataclass(frozen=True)
class ElevatorStep:
    """Response to a step of the equivalent elevator; all arrays (n,), SI and radians, at `time` [s]."""

    trim: Trim
    controls_before: np.ndarray  # (7,)
    controls_after: np.ndarray  # (7,)
    step_time: float
    time: np.ndarray
    u: np.ndarray
    w: np.ndarray
    q: np.ndarray
    theta: np.ndarray
    velocity_ned: np.ndarray  # (n, 3)
    states: np.ndarray  # (n, 20)


def stepped_controls(aircraft: Aircraft, trim: Trim, step: float, environment: np.ndarray | None = None) -> np.ndarray:
    """Controls (7,) of a trim with the equivalent elevator moved by `step` [rad] and the other throttles held.

    The tail motor gets the throttle that holds the tail speed the equivalent elevator asks for in the trimmed flow.
    """
    controls = trim.controls.copy()
    controls[6] += step
    craft = aircraft.vehicle[0]
    state = trim.state.copy()
    state[ROTOR_SPEED + 2] = tail_speed(craft, trim.elevator + step, state[TILT])
    outputs, rate = np.zeros(1, OUTPUTS), np.empty(STATE_COUNT)
    world = still_air() if environment is None else environment
    balance_motors(state, controls.copy(), aircraft.vehicle, world, outputs, rate)
    torque = outputs["shaft_torque"][0, 2]
    controls[2] = throttle_for(craft["rotors"][2], state[ROTOR_SPEED + 2], torque)
    return controls


def elevator_step(
    aircraft: Aircraft, airspeed: float = 30.0, step: float = math.radians(1.0), *,
    at: float = 1.0, duration: float = 50.0, rate: int = 400, every: int = 1, altitude: float = 0.0,
) -> ElevatorStep:  # fmt: skip
    """Trim level at `airspeed` [m/s] and `altitude` [m], move the equivalent elevator by `step` [rad] and fly on.

    The step comes at time `at` [s]. The throttles are held, as an outside controller that only moves the elevator
    would; `rate` steps a second of the same compiled RK4 as in real time, every `every`-th kept. Raises TrimError when
    there is no such trim.
    """
    world = still_air(altitude)
    trim = trim_level(aircraft, airspeed, world)
    after = stepped_controls(aircraft, trim, step, world)
    count = round(duration * rate)
    schedule = np.tile(trim.controls, (count + 1, 1))
    schedule[round(at * rate) :] = after
    states = np.empty((count // every + 1, STATE_COUNT))
    time_history(trim.state.copy(), schedule, aircraft.vehicle, world, 1.0 / rate, every, states)
    theta = np.array([euler_from_quaternion(*row[QUATERNION : QUATERNION + 4])[1] for row in states])
    u, w = states[:, VELOCITY], states[:, VELOCITY + 2]
    over_ground = np.array([
        body_to_ned(*row[QUATERNION : QUATERNION + 4], *row[VELOCITY : VELOCITY + 3]) for row in states
    ])  # fmt: skip
    return ElevatorStep(
        trim, trim.controls, after, at, np.arange(states.shape[0]) * every / rate, u, w, states[:, RATES + 1], theta,
        over_ground, states,
    )  # fmt: skip
