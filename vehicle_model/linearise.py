"""Linear models about a trim, eq. (21), by central differences, and the natural modes in them."""

import math
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from vehicle_model.aircraft import Aircraft
from vehicle_model.dynamics import derivative
from vehicle_model.elevator_step import stepped_controls
from vehicle_model.equivalent_elevator import tail_speed
from vehicle_model.records import OUTPUTS
from vehicle_model.rotation import euler_from_quaternion, quaternion_from_euler
from vehicle_model.state import ELEVATOR, QUATERNION, RATES, ROTOR_SPEED, STATE_COUNT, TILT, VELOCITY
from vehicle_model.trim import Trim, balance_motors, still_air

__all__ = ["HOLDS", "Hold", "LinearModel", "Mode", "linearise", "modes", "participation"]

Hold = Literal["throttle", "rpm", "power", "thrust"]
HOLDS: tuple[Hold, ...] = get_args(Hold)

RIGID_STATES = ("u", "v", "w", "p", "q", "r", "phi", "theta")
ROTOR_STATES = ("rotor_left", "rotor_right", "rotor_tail")
SLOWEST_DUTCH_ROLL = 0.05  # [rad/s]
LONGITUDINAL = ("u", "w", "q", "theta")


@dataclass(frozen=True)
class LinearModel:
    """x' = A x + B delta_E about a trim: A (n, n) and B (n,) in SI and radians, named states.

    With `hold` "throttle" the rotor speeds are states; otherwise they follow from the others without delay.
    """

    state_names: tuple[str, ...]
    a: np.ndarray
    b: np.ndarray
    hold: Hold
    tilt: float  # of the wing in the trim [rad]

    def longitudinal(self) -> "LinearModel":
        """The part in x = [u, w, q, theta] (and the rotors' common speeds, where they are states)."""
        names = list(LONGITUDINAL)
        basis = [np.eye(len(self.state_names))[self.state_names.index(name)] for name in names]
        if "rotor_left" in self.state_names:
            left, right, tail = (np.eye(len(self.state_names))[self.state_names.index(name)] for name in ROTOR_STATES)
            basis += [(left + right) / math.sqrt(2.0), tail]
            names += ["rotor_wing", "rotor_tail"]
        turn = np.array(basis)
        return LinearModel(tuple(names), turn @ self.a @ turn.T, turn @ self.b, self.hold, self.tilt)


@dataclass(frozen=True)
class Mode:
    """One natural mode; a complex pair is one mode, with the positive imaginary part."""

    name: str
    real: float  # [1/s]
    imag: float  # [rad/s]

    @property
    def omega(self) -> float:
        """Undamped natural frequency [rad/s]."""
        return math.hypot(self.real, self.imag)

    @property
    def damping(self) -> float:
        """Damping ratio; negative when the mode grows."""
        return -self.real / self.omega if self.omega else 0.0

    @property
    def period(self) -> float:
        """Of the damped oscillation [s]; infinite without one."""
        return 2.0 * math.pi / self.imag if self.imag else math.inf

    @property
    def time_to_half(self) -> float:
        """Time to half amplitude [s]; negative: minus the time to double."""
        return math.log(2.0) / -self.real if self.real else math.inf


class _Perturbed:
    """State derivative of a trimmed vehicle as a function of [u v w p q r phi theta (rotors)] and the elevator."""

    def __init__(self, aircraft: Aircraft, trim: Trim, hold: Hold, environment: np.ndarray) -> None:
        self.aircraft, self.vehicle, self.environment = aircraft, aircraft.vehicle, environment
        self.trim, self.hold = trim, hold
        self.outputs = np.zeros(1, OUTPUTS)
        self.rate = np.empty(STATE_COUNT)
        self.controls = trim.controls.copy()
        quaternion = trim.state[QUATERNION : QUATERNION + 4]
        roll, pitch, self.yaw = euler_from_quaternion(*quaternion)
        self.centre = np.concatenate(
            [trim.state[VELOCITY : VELOCITY + 3], trim.state[RATES : RATES + 3], [roll, pitch]]
        )
        self.names = RIGID_STATES
        if hold == "throttle":
            self.names = RIGID_STATES + ROTOR_STATES
            self.centre = np.concatenate([self.centre, trim.state[ROTOR_SPEED : ROTOR_SPEED + 3]])

    def __call__(self, x: np.ndarray, elevator_change: float = 0.0) -> np.ndarray:
        state = self.trim.state.copy()
        state[VELOCITY : VELOCITY + 3] = x[0:3]
        state[RATES : RATES + 3] = x[3:6]
        roll, pitch = x[6], x[7]
        state[QUATERNION : QUATERNION + 4] = quaternion_from_euler(roll, pitch, self.yaw)
        state[ELEVATOR] += elevator_change
        if self.hold == "throttle":
            state[ROTOR_SPEED : ROTOR_SPEED + 3] = x[8:11]
            controls = self.controls
            if elevator_change:  # the equivalent elevator also moves the tail motor's throttle
                controls = stepped_controls(self.aircraft, self.trim, elevator_change, self.environment)
            derivative(state, controls, self.vehicle, self.environment, self.outputs, self.rate)
        else:
            if elevator_change:
                craft = self.vehicle[0]
                state[ROTOR_SPEED + 2] = tail_speed(craft, state[ELEVATOR], state[TILT])
            self._follow(state)
            balance_motors(state, self.controls, self.vehicle, self.environment, self.outputs, self.rate)
        p, q, r = x[3:6]
        turn = q * math.sin(roll) + r * math.cos(roll)
        euler_rate = (p + turn * math.tan(pitch), q * math.cos(roll) - r * math.sin(roll))
        rates = [self.rate[VELOCITY : VELOCITY + 3], self.rate[RATES : RATES + 3], euler_rate]
        if self.hold == "throttle":
            rates.append(self.rate[ROTOR_SPEED : ROTOR_SPEED + 3])
        return np.concatenate(rates)

    def _follow(self, state: np.ndarray) -> None:
        """Set the wing rotors' speeds to what keeps their power or thrust; the tail rotor keeps its speed."""
        if self.hold == "rpm":
            return
        field = {"power": "shaft_power", "thrust": "thrust"}[self.hold]
        goal = self.trim.outputs[field][:2]
        for _ in range(20):
            derivative(state, self.controls, self.vehicle, self.environment, self.outputs, self.rate)
            error = self.outputs[0][field][:2] - goal
            if np.all(np.abs(error) <= 1e-11 * np.abs(goal)):
                return
            speeds = state[ROTOR_SPEED : ROTOR_SPEED + 2].copy()
            step = 1e-6 * speeds
            state[ROTOR_SPEED : ROTOR_SPEED + 2] = speeds + step
            derivative(state, self.controls, self.vehicle, self.environment, self.outputs, self.rate)
            slope = (self.outputs[0][field][:2] - goal - error) / step
            state[ROTOR_SPEED : ROTOR_SPEED + 2] = speeds - error / slope


def linearise(
    aircraft: Aircraft, trim: Trim, hold: Hold = "throttle", environment: np.ndarray | None = None
) -> LinearModel:
    """Linear model of the full six degrees of freedom about a trim, eq. (21), by central differences.

    `hold` says what the wing rotors keep while the aircraft is disturbed: the throttle (rotor speeds become states),
    the speed, the shaft power or the thrust. Position and heading are left out: nothing depends on them.
    B is that of the equivalent elevator with the tail rotor's part, whose speed goes with the root of the command: near
    a trim at zero command, B of the tail rotor's speed grows without bound.
    """
    function = _Perturbed(aircraft, trim, hold, still_air() if environment is None else environment)
    columns = []
    for j in range(function.centre.size):
        step = np.zeros(function.centre.size)
        step[j] = 1e-4 * max(1.0, abs(function.centre[j]) / 30.0)
        columns.append((function(function.centre + step) - function(function.centre - step)) / (2.0 * step[j]))
    step = 1e-4
    b = (function(function.centre, step) - function(function.centre, -step)) / (2.0 * step)
    return LinearModel(function.names, np.column_stack(columns), b, hold, trim.tilt)


def participation(a: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues (n,) of a matrix (n, n), and by state and mode the share (n, n) that a state has in a mode.

    The shares are the participation factors |right eigenvector times left eigenvector|, each column's sum being 1.
    """
    values, right = np.linalg.eig(a)
    share = np.abs(right * np.linalg.inv(right).T)
    return values, share / share.sum(axis=0)


def modes(model: LinearModel) -> list[Mode]:
    """Natural modes of a linear model, fastest first, named by the states that take part in them.

    short_period and phugoid, dutch_roll, roll and spiral while the wing is below 45 deg, where the usual picture holds;
    rotor for a mode of the rotor speeds; otherwise longitudinal or lateral.
    """
    usual = model.tilt < math.pi / 4.0
    values, share = participation(model.a)
    index = {name: i for i, name in enumerate(model.state_names)}

    def part(mode: int, *names: str) -> float:
        return float(sum(share[index[name], mode] for name in names if name in index))

    found: list[Mode] = []
    for mode in np.argsort(-np.abs(values), kind="stable"):
        value = complex(values[mode])
        if value.imag < 0.0:
            continue
        fast, slow = part(mode, "w", "q"), part(mode, "u", "theta")
        swing, roll, bank = part(mode, "v", "r"), part(mode, "p"), part(mode, "phi")
        if part(mode, *ROTOR_STATES, "rotor_wing") > 0.5:
            name = "rotor"
        elif fast + slow > swing + roll + bank:
            oscillates = usual and value.imag > 0.0
            name = "longitudinal" if not oscillates else "short_period" if fast > slow else "phugoid"
        elif not usual or 0.0 < value.imag < SLOWEST_DUTCH_ROLL:
            name = "lateral"
        elif value.imag > 0.0:
            name = "dutch_roll"
        else:
            name = "roll" if roll > max(swing, bank) else "spiral" if abs(value) < 1.0 else "lateral"
        found.append(Mode(name, value.real, value.imag))
    return found
