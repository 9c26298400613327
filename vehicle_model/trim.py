"""Steady flight: the paper's trim (17)-(20) in RPM, tilt and elevator with the fuselage level, and general trims."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from vehicle_model.aircraft import Aircraft
from vehicle_model.compiled import compiled
from vehicle_model.dynamics import derivative
from vehicle_model.earth import STANDARD_GRAVITY, make_environment
from vehicle_model.equivalent_elevator import tail_speed
from vehicle_model.integrate import observe
from vehicle_model.motor import throttle_for
from vehicle_model.records import OUTPUTS
from vehicle_model.state import CONTROL_COUNT, ELEVATOR, QUATERNION, RATES, ROTOR_SPEED, STATE_COUNT, TILT, VELOCITY

__all__ = ["LevelProblem", "Trim", "TrimError", "no_load_speed", "still_air", "trim_each", "trim_level", "trim_sweep"]

RESIDUAL_GOAL = 1e-9  # of the weight (and of weight times one metre)
# Where searches start: rotor speed as a share of the no-load speed, tilt and elevator [deg].
GUESSES = ((0.51, 8.0, 0.0), (0.46, 20.0, -1.0), (0.51, 45.0, -2.0), (0.58, 75.0, -1.0), (0.61, 88.0, 0.0))


class TrimError(ValueError):
    """No steady flight was found; the message says for what and how near the search came."""


@dataclass(frozen=True)
class Trim:
    """One steady flight condition; angles in radians, speeds in rad/s, `residual` as a fraction of the weight."""

    airspeed: float
    rotor_speed: float  # of the wing rotors
    tilt: float
    elevator: float  # equivalent elevator command
    residual: float
    state: np.ndarray  # (20,)
    controls: np.ndarray  # (7,)
    outputs: np.void  # OUTPUTS record

    @property
    def rpm(self) -> float:
        """Speed of the wing rotors [1/min]."""
        return self.rotor_speed * 30.0 / math.pi

    @property
    def tail_rpm(self) -> float:
        """Speed of the tail rotor [1/min], negative backwards."""
        return float(self.state[ROTOR_SPEED + 2]) * 30.0 / math.pi

    @property
    def power(self) -> float:
        """Shaft power of all rotors [W]."""
        return float(self.outputs["shaft_power"].sum())


def still_air(altitude: float = 0.0) -> np.ndarray:
    """The paper's world: flat Earth, no wind; flight begins at an altitude [m] and never meets the ground."""
    return make_environment("flat", latitude=0.0, longitude=0.0, height_ellipsoid=altitude, ground_height=-1e6)


@compiled
def balance_motors(state, controls, vehicle, environment, outputs, rate) -> None:
    """Set the throttles to what keeps each rotor at its speed, and evaluate the derivative with them."""
    derivative(state, controls, vehicle, environment, outputs, rate)
    craft = vehicle[0]
    for i in range(craft.rotor_count):
        controls[i] = throttle_for(craft.rotors[i], state[ROTOR_SPEED + i], outputs[0].shaft_torque[i])
    derivative(state, controls, vehicle, environment, outputs, rate)


def motor_shortfall(trimmed: np.void) -> str | None:
    """What a motor cannot hold in the balance of an OUTPUTS record, or None.

    A wing rotor has to keep its speed either way. The tail rotor may be driven a little by the flow at idle, which
    the trim's balance does not feel, but must not ask its motor for more than that has.
    """
    excess = trimmed["motor_torque"] - trimmed["shaft_torque"]
    driven = np.sign(trimmed["shaft_power"]) * excess >= 0.0
    off = np.abs(excess) > 1e-6 * (np.abs(trimmed["shaft_torque"]) + 1e-3)
    off[2] &= not driven[2]
    if not off.any():
        return None
    worst = int(np.argmax(np.where(off, np.abs(excess), 0.0)))
    name = ("left", "right", "tail")[worst]
    return (
        f"the {name} rotor takes {trimmed['shaft_torque'][worst]:.3g} N m, of which its motor gives "
        f"{trimmed['motor_torque'][worst]:.3g} N m within its limits"
    )


@compiled
def level_residual(
    x, airspeed: float, state, controls, vehicle, environment, outputs, rate
) -> tuple[float, float, float]:
    """Residuals (18) [N, N, N m] of level flight with the fuselage level; x = (rotor speed, tilt, elevator command)."""
    craft = vehicle[0]
    state[VELOCITY] = airspeed
    state[ROTOR_SPEED] = x[0]
    state[ROTOR_SPEED + 1] = x[0]
    state[ROTOR_SPEED + 2] = tail_speed(craft, x[2], x[1])
    state[TILT] = x[1]
    state[ELEVATOR] = x[2]
    controls[3] = x[1]
    controls[6] = x[2]
    derivative(state, controls, vehicle, environment, outputs, rate)
    return craft.mass * rate[VELOCITY], craft.mass * rate[VELOCITY + 2], craft.inertia[1, 1] * rate[RATES + 1]


def no_load_speed(vehicle: np.ndarray) -> float:
    """Speed [rad/s] at which a wing motor's back EMF is the battery's voltage: it cannot drive a rotor faster."""
    rotor = vehicle["rotors"][0, 0]
    return float(rotor["battery_voltage"] / rotor["torque_constant"])


class LevelProblem:
    """Level flight at one airspeed as a function of three unknowns; `scale` brings them to order one."""

    def __init__(self, aircraft: Aircraft, airspeed: float, environment: np.ndarray) -> None:
        self.vehicle = aircraft.vehicle
        self.environment = environment
        self.airspeed = airspeed
        self.weight = float(self.vehicle["mass"][0]) * STANDARD_GRAVITY
        self.state = np.zeros(STATE_COUNT)
        self.state[QUATERNION] = 1.0
        self.controls = np.zeros(CONTROL_COUNT)
        self.outputs = np.zeros(1, OUTPUTS)
        self.rate = np.empty(STATE_COUNT)
        servos = self.vehicle["servos"][0]
        fastest = no_load_speed(self.vehicle)
        self.scale = np.array([0.6 * fastest, 1.0, 0.2])
        self.lower = np.array([0.03 * fastest, servos["minimum"][0], servos["minimum"][3]]) / self.scale
        self.upper = np.array([fastest, servos["maximum"][0], servos["maximum"][3]]) / self.scale

    def residual(self, x: np.ndarray) -> np.ndarray:
        """Residuals as fractions of the weight (the moment: of the weight times one metre)."""
        balance = level_residual(
            x * self.scale, self.airspeed, self.state, self.controls, self.vehicle, self.environment,
            self.outputs, self.rate,
        )  # fmt: skip
        return np.array(balance) / self.weight

    def jacobian(self, x: np.ndarray) -> np.ndarray:
        """Eq. (19) by central differences."""
        columns = []
        for j in range(3):
            step = np.zeros(3)
            step[j] = 1e-6
            columns.append((self.residual(x + step) - self.residual(x - step)) / 2e-6)
        return np.column_stack(columns)

    def newton(self, x: np.ndarray) -> tuple[np.ndarray, float]:
        """Relaxed Newton iteration, eq. (20): X <- X - k J^-1 R, with k halved until the residual falls."""
        x = np.clip(x, self.lower, self.upper)
        residual = self.residual(x)
        size = float(np.abs(residual).max())
        for _ in range(40):
            if size < 1e-13:
                break
            try:
                step = np.linalg.solve(self.jacobian(x), residual)
            except np.linalg.LinAlgError:
                break
            relax = 1.0
            while relax > 1e-4:
                trial = np.clip(x - relax * step, self.lower, self.upper)
                trial_residual = self.residual(trial)
                trial_size = float(np.abs(trial_residual).max())
                if trial_size < size:
                    break
                relax *= 0.5
            else:
                break
            x, residual, size = trial, trial_residual, trial_size
        return x, size

    def least_squares(self, x: np.ndarray) -> tuple[np.ndarray, float]:
        """Robust fallback: bounded least squares, polished by Newton."""
        from scipy.optimize import least_squares  # slow to import, needed rarely

        inside = np.clip(x, self.lower + 1e-9, self.upper - 1e-9)
        return self.newton(least_squares(self.residual, inside, bounds=(self.lower, self.upper), x_scale="jac").x)

    def observe(self, x: np.ndarray) -> np.void:
        """All outputs at a point (an OUTPUTS record, overwritten by the next call), motors balanced."""
        self.residual(x)
        balance_motors(self.state, self.controls, self.vehicle, self.environment, self.outputs, self.rate)
        observe(self.state, self.controls, self.vehicle, self.environment, self.outputs, self.rate)
        return self.outputs[0]

    def finish(self, x: np.ndarray) -> Trim:
        """The trim at a point, with the throttles that hold the rotors' speeds."""
        size = float(np.abs(self.residual(x)).max())
        outputs = self.observe(x).copy()
        speed, tilt, elevator = (float(v) for v in x * self.scale)
        return Trim(self.airspeed, speed, tilt, elevator, size, self.state.copy(), self.controls.copy(), outputs)


def trim_level(
    aircraft: Aircraft, airspeed: float, environment: np.ndarray | None = None, *, near: Trim | None = None
) -> Trim:
    """Trim level flight at an airspeed [m/s] with the fuselage level (theta = 0), as the paper does.

    Unknowns are rotor speed, tilt and equivalent elevator, eqs (17)-(20). `near` is a neighbouring trim to start
    from. Raises TrimError when no combination within the limits of servos and motors balances weight, drag and moment,
    and ValueError for an environment with wind, for which there is `trim_steady`.
    """
    if not math.isfinite(airspeed):
        raise TrimError(f"no level trim at {airspeed:g} m/s: expected a finite airspeed")
    world = still_air() if environment is None else environment
    if world["wind_ned"].any():
        raise ValueError(f"environment: expected still air, got a wind of {world['wind_ned'][0]} m/s (see trim_steady)")
    problem = LevelProblem(aircraft, airspeed, world)
    fastest = no_load_speed(problem.vehicle)
    starts = [np.array([share * fastest, math.radians(tilt), math.radians(down)]) for share, tilt, down in GUESSES]
    starts.sort(key=lambda start: abs(math.degrees(start[1]) - max(8.0, 90.0 - 4.0 * airspeed)))
    if near is not None:
        starts.insert(0, np.array([near.rotor_speed, near.tilt, near.elevator]))
    best_x, best = starts[0] / problem.scale, math.inf
    for solve in (problem.newton, problem.least_squares):
        for start in starts:
            x, size = solve(start / problem.scale)
            if size < best:
                best_x, best = x, size
            if size < RESIDUAL_GOAL:
                found = problem.finish(x)
                shortfall = motor_shortfall(found.outputs)
                if shortfall is not None:
                    raise TrimError(f"no level trim at {airspeed:g} m/s: at {found.rpm:.0f} rpm {shortfall}")
                return found
    rpm, tilt, elevator = best_x * problem.scale
    raise TrimError(
        f"no level trim at {airspeed:g} m/s: the best of {2 * len(starts)} searches leaves {best:.2g} of the weight "
        f"unbalanced, at {rpm * 30 / math.pi:.0f} rpm, tilt {math.degrees(tilt):.1f} deg, "
        f"elevator {math.degrees(elevator):.1f} deg"
    )


def trim_each(
    aircraft: Aircraft, airspeeds: Iterable[float], environment: np.ndarray | None = None
) -> list[Trim | TrimError]:
    """Trims at several airspeeds [m/s], in the order given, or why there is none.

    Each is found from its neighbour, from fast to slow.
    """
    speeds = list(airspeeds)
    found: dict[float, Trim | TrimError] = {}
    near = None
    for airspeed in sorted(set(speeds), reverse=True):
        try:
            near = found[airspeed] = trim_level(aircraft, airspeed, environment, near=near)
        except TrimError as error:
            found[airspeed] = error
    return [found[airspeed] for airspeed in speeds]


def trim_sweep(aircraft: Aircraft, airspeeds: Iterable[float], environment: np.ndarray | None = None) -> list[Trim]:
    """Trims at several airspeeds [m/s] as `trim_each` finds them. Raises TrimError where there is none."""
    trims: list[Trim] = []
    for each in trim_each(aircraft, airspeeds, environment):
        if isinstance(each, TrimError):
            raise each
        trims.append(each)
    return trims
