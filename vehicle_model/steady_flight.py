"""General trim: steady flight in any direction through the air, climbing, turning, with pitch or tilt free or given.

Six balances (three forces, three moments) against six unknowns: the two wing rotors' speeds, tilt, differential
aileron, equivalent elevator and bank; a free pitch angle is a seventh, of which the solution nearest to level is taken.
"""

import itertools
import math
from dataclasses import dataclass

import numpy as np

from vehicle_model.aircraft import Aircraft
from vehicle_model.earth import STANDARD_GRAVITY
from vehicle_model.equivalent_elevator import tail_speed
from vehicle_model.integrate import observe
from vehicle_model.records import OUTPUTS
from vehicle_model.rotation import ned_to_body, quaternion_from_euler
from vehicle_model.state import (
    AILERON_LEFT,
    AILERON_RIGHT,
    CONTROL_COUNT,
    ELEVATOR,
    QUATERNION,
    RATES,
    ROTOR_SPEED,
    STATE_COUNT,
    TILT,
    VELOCITY,
)  # fmt: skip
from vehicle_model.trim import TrimError, balance_motors, motor_shortfall, no_load_speed, still_air

__all__ = ["SteadyFlight", "trim_steady"]

RESIDUAL_GOAL = 1e-8  # of the weight (moments: of the weight times one metre)


@dataclass(frozen=True)
class SteadyFlight:
    """A steady flight condition; angles in radians, speeds in rad/s, `residual` as a fraction of the weight."""

    rotor_speeds: tuple[float, float, float]
    tilt: float
    aileron: float  # differential: right wing's trailing edge up positive, rolls right in cruise
    elevator: float  # equivalent elevator command
    roll: float
    pitch: float
    residual: float
    state: np.ndarray  # (20,)
    controls: np.ndarray  # (7,)
    outputs: np.void  # OUTPUTS record


@dataclass(frozen=True)
class _Condition:
    airspeed: float
    climb_angle: float
    direction: float
    turn_rate: float
    pitch: float | None
    tilt: float | None


class _Problem:
    """Balance of a steady flight condition as a function of scaled unknowns."""

    def __init__(self, aircraft: Aircraft, condition: _Condition, environment: np.ndarray) -> None:
        self.condition, self.vehicle, self.environment = condition, aircraft.vehicle, environment
        craft = self.vehicle[0]
        self.weight = float(craft["mass"]) * STANDARD_GRAVITY
        self.inertia = craft["inertia"]
        self.state = np.zeros(STATE_COUNT)
        self.controls = np.zeros(CONTROL_COUNT)
        self.outputs = np.zeros(1, OUTPUTS)
        self.rate = np.empty(STATE_COUNT)
        servos = craft["servos"]
        fastest = no_load_speed(self.vehicle)
        self.scale = np.array([0.6 * fastest, 0.6 * fastest, 1.0, 0.3, 0.2, 0.5, 0.5])
        low = [
            0.03 * fastest,
            0.03 * fastest,
            servos["minimum"][0],
            servos["minimum"][1],
            servos["minimum"][3],
            -1.2,
            -1.2,
        ]
        high = [fastest, fastest, servos["maximum"][0], servos["maximum"][1], servos["maximum"][3], 1.2, 1.2]
        self.lower, self.upper = np.array(low) / self.scale, np.array(high) / self.scale
        for index, given in ((2, condition.tilt), (6, condition.pitch)):
            if given is not None:
                self.lower[index] = given / self.scale[index] - 1e-12
                self.upper[index] = given / self.scale[index] + 1e-12

    def balance(self, x: np.ndarray) -> np.ndarray:
        """Six residuals as fractions of the weight; leaves state, controls and outputs at the point."""
        left, right, tilt, aileron, elevator, roll, pitch = x * self.scale
        at = self.condition
        quaternion = quaternion_from_euler(roll, pitch, 0.0)
        level = at.airspeed * math.cos(at.climb_angle)
        down = -at.airspeed * math.sin(at.climb_angle)
        velocity = (level * math.cos(at.direction), level * math.sin(at.direction), down)
        wind = self.environment[0]["wind_ned"]
        state = self.state
        state[VELOCITY : VELOCITY + 3] = ned_to_body(*quaternion, *(v + w for v, w in zip(velocity, wind, strict=True)))
        state[QUATERNION : QUATERNION + 4] = quaternion
        state[RATES : RATES + 3] = ned_to_body(*quaternion, 0.0, 0.0, at.turn_rate)
        state[ROTOR_SPEED : ROTOR_SPEED + 3] = left, right, tail_speed(self.vehicle[0], elevator, tilt)
        state[TILT], state[AILERON_LEFT], state[AILERON_RIGHT], state[ELEVATOR] = tilt, aileron, -aileron, elevator
        self.controls[3:] = state[TILT : TILT + 4]
        balance_motors(state, self.controls, self.vehicle, self.environment, self.outputs, self.rate)
        # Steady is the velocity through the air; in a turn the wind's own components turn through the body axes.
        turn = state[RATES : RATES + 3]
        drift = np.cross(turn, ned_to_body(*quaternion, *wind))
        force = (self.rate[VELOCITY : VELOCITY + 3] + drift) * self.weight / STANDARD_GRAVITY
        moment = self.inertia @ self.rate[RATES : RATES + 3]
        return np.concatenate([force, moment]) / self.weight

    def solve(self, guess: np.ndarray) -> tuple[np.ndarray, float]:
        from scipy.optimize import least_squares  # slow to import, needed where a trim is sought and nowhere in flight

        start = np.clip(guess / self.scale, self.lower + 1e-13, self.upper - 1e-13)
        pull = 1e-3 if self.condition.pitch is None else 0.0
        # A first pass with a light pull of pitch to level picks one of many; the second meets the balance exactly.
        for weight in (pull, 0.0):
            found = least_squares(
                lambda x, weight=weight: np.append(self.balance(x), weight * x[6]),
                start, bounds=(self.lower, self.upper), xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=60,
            )  # fmt: skip
            start = np.clip(found.x, self.lower + 1e-13, self.upper - 1e-13)
        return found.x, float(np.abs(self.balance(found.x)).max())


def trim_steady(
    aircraft: Aircraft, airspeed: float, *, climb_angle: float = 0.0, direction: float = 0.0, turn_rate: float = 0.0,
    pitch: float | None = 0.0, tilt: float | None = None, environment: np.ndarray | None = None,
) -> SteadyFlight:  # fmt: skip
    """Trim steady flight at an airspeed [m/s] in all six degrees of freedom.

    `climb_angle` [rad] is that of the velocity through the air; `direction` [rad] where it points level, from the
    nose to the right: 0 forward, pi/2 right, pi rearward (hovering in a wind from the nose is flight forward through
    the air). `turn_rate` [rad/s] is the heading's. `pitch` None lets the pitch angle follow; `tilt` fixes the wing.
    Heading is north. Raises TrimError when no combination within the limits of servos and motors balances.
    """
    if not all(map(math.isfinite, (airspeed, climb_angle, direction, turn_rate, pitch or 0.0, tilt or 0.0))):
        raise TrimError("no steady flight: expected finite airspeed, angles and turn rate")
    world = still_air() if environment is None else environment
    problem = _Problem(aircraft, _Condition(airspeed, climb_angle, direction, turn_rate, pitch, tilt), world)
    flight = (
        f"{airspeed:g} m/s, climb angle {math.degrees(climb_angle):g} deg, direction {math.degrees(direction):g} deg, "
        f"turn rate {math.degrees(turn_rate):g} deg/s"
    )
    likely = max(4.0, 88.0 - 5.0 * airspeed * math.cos(direction))
    bank = math.atan(airspeed * turn_rate / STANDARD_GRAVITY)
    best_x, best = problem.lower, math.inf
    tilts = sorted((4.0, 12.0, 30.0, 55.0, 80.0, 100.0, likely), key=lambda each: abs(each - likely))
    # The tail rotor's speed goes with the root of the elevator command: no search crosses zero, so start on both sides.
    for degrees, command in itertools.product(tilts, (-0.02, 0.02)):
        speed = (0.48 + 0.16 * math.sin(math.radians(degrees)) ** 2) * no_load_speed(problem.vehicle)
        guess = np.array([speed, speed, math.radians(degrees), 0.0, command, bank, pitch or 0.0])
        x, residual = problem.solve(guess)
        if residual < best:
            best_x, best = x, residual
        if best < RESIDUAL_GOAL:
            break
    else:
        raise TrimError(f"no steady flight at {flight}: the best search leaves {best:.2g} of the weight unbalanced")
    problem.balance(best_x)
    observe(problem.state, problem.controls, problem.vehicle, world, problem.outputs, problem.rate)
    shortfall = motor_shortfall(problem.outputs[0])
    if shortfall is not None:
        raise TrimError(f"no steady flight at {flight}: {shortfall}")
    _, _, tilt_angle, aileron, elevator, roll, pitch_angle = (float(v) for v in best_x * problem.scale)
    speeds = problem.state[ROTOR_SPEED : ROTOR_SPEED + 3]
    return SteadyFlight(
        (float(speeds[0]), float(speeds[1]), float(speeds[2])), tilt_angle, aileron, elevator, roll, pitch_angle, best,
        problem.state.copy(), problem.controls.copy(), problem.outputs[0].copy(),
    )  # fmt: skip
