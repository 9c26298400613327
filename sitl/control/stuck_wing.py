"""What an aircraft can still fly with its wing stuck at an angle: level flight from where to where, or how it sinks.

The fuselage inclines a stuck wing, within the pitch that the laws give it. All else that the vehicle has is free: both
wing rotors, ailerons, elevator and tail rotor each by itself, bank. A trim found shows that a flight exists. That none
does is what many searches together say: the certificate is how much of the weight the best of them leaves unbalanced.
"""

import itertools
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from sitl.control.laws import STUCK_PITCH
from vehicle_model.aircraft import Aircraft
from vehicle_model.authority import speed_at
from vehicle_model.earth import STANDARD_GRAVITY
from vehicle_model.faults import lose_thrust, stick_servo
from vehicle_model.force_map import FLAP_SHARE
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
from vehicle_model.trim import balance_motors, no_load_speed, still_air

__all__ = [
    "BALANCED",
    "CASES",
    "StuckCase",
    "StuckFlight",
    "StuckWing",
    "stuck_wing",
    "stuck_wing_section",
    "stuck_wings",
]

BALANCED = 1e-7  # of the weight (moments: of the weight times one metre): less is a trim
REARWARD, FORWARD = -10.0, 30.0  # speeds looked at [m/s]
DEEPEST_SINK = 15.0  # [m/s]
STEEPEST_BANK = math.radians(20.0)
LEFT = 0
ANGLE_STEP = 15  # between two angles of the report [deg]

# Unknowns, and where in them they stand.
ROTORS, DROOP, AILERON, ELEVATOR_ANGLE, TAIL, ROLL, PITCH, AHEAD, SINK = slice(0, 2), 2, 3, 4, 5, 6, 7, 8, 9
STARTS = tuple(itertools.product((-2.0, 1.0, 6.0, 12.0, 20.0), (-0.7, 0.7), (-0.1, 0.1)))  # ahead, of pitch, tail
FIRST_STEP, LAST_STEP = 1.0, 0.01  # of what is driven to its furthest [m/s]
TORQUE_SCALE = 0.1  # motor torque short, as a part of the weight times this length [m]


@dataclass(frozen=True)
class StuckCase:
    """What else is the matter: share of the left wing motor's thrust lost, and whether both ailerons may droop."""

    name: str
    lost_thrust: float = 0.0
    droop: bool = False


CASES = (
    StuckCase("ailerons not drooped"),
    StuckCase("nor, and a wing motor at 80 %", lost_thrust=0.2),
    StuckCase("ailerons may droop", droop=True),
)


@dataclass(frozen=True)
class StuckFlight:
    """One steady flight in still air, forward speed negative rearward; m/s, radians, W, `residual` of the weight."""

    ahead: float
    sink: float
    pitch: float
    roll: float
    power: float  # shafts of all rotors
    stall_margin: float  # least of the wing's strips in the slipstream
    residual: float


@dataclass(frozen=True)
class StuckWing:
    """What a wing stuck at `angle` [rad] leaves: slowest and fastest level flight, or the one that sinks least.

    `unbalanced` is what the best search for level flight leaves: the largest of the forces as a part of the weight, of
    the moments as a part of the weight times 1 m, and of the torques that motors lack as a part of the weight times
    TORQUE_SCALE. Below BALANCED there is level flight, and `least_sink` is None. All three flights are None only where
    not even one that sinks was found.
    """

    angle: float
    case: StuckCase
    slowest: StuckFlight | None
    fastest: StuckFlight | None
    least_sink: StuckFlight | None
    unbalanced: float


class _Problem:
    """Balance of flight with a stuck wing as a function of scaled unknowns (10,)."""

    def __init__(self, aircraft: Aircraft, angle: float, case: StuckCase) -> None:
        self.vehicle = aircraft.vehicle.copy()
        stick_servo(self.vehicle, 0, angle)
        lose_thrust(self.vehicle, LEFT, case.lost_thrust)
        craft = self.vehicle[0]
        self.angle, self.inertia, self.world = angle, craft["inertia"], still_air()
        self.weight = float(craft["mass"]) * STANDARD_GRAVITY
        self.tail_top = speed_at(aircraft, 2, 1.0)
        self.wetted = aircraft.wing_strips[0]
        self.state, self.controls = np.zeros(STATE_COUNT), np.zeros(CONTROL_COUNT)
        self.outputs, self.rate = np.zeros(1, OUTPUTS), np.empty(STATE_COUNT)
        self.fastest = no_load_speed(self.vehicle)
        servos = craft["servos"]
        self.aileron_limit = float(servos["maximum"][1])
        droop = FLAP_SHARE * self.aileron_limit if case.droop else 0.0
        self.scale = np.array(
            [0.6 * self.fastest, 0.6 * self.fastest, 0.3, 0.3, 0.3, 0.5, 0.3, 0.3, 10.0, 10.0]
        )  # fmt: skip
        low = [0.03 * self.fastest] * 2 + [
            0.0, -self.aileron_limit, float(servos["minimum"][3]), -1.0, -STEEPEST_BANK, -STUCK_PITCH, REARWARD, 0.0
        ]  # fmt: skip
        high = [self.fastest] * 2 + [
            droop, self.aileron_limit, float(servos["maximum"][3]), 1.0, STEEPEST_BANK, STUCK_PITCH, FORWARD,
            DEEPEST_SINK,
        ]  # fmt: skip
        self.lower, self.upper = np.array(low) / self.scale, np.array(high) / self.scale

    def balance(self, x: np.ndarray) -> np.ndarray:
        """Residuals (9,): forces and moments as parts of the weight, then what torque each motor lacks (negative)."""
        left, right, droop, aileron, elevator, tail, roll, pitch, ahead, sink = (float(v) for v in x * self.scale)
        quaternion = quaternion_from_euler(roll, pitch, 0.0)
        state, limit = self.state, self.aileron_limit
        state[VELOCITY : VELOCITY + 3] = ned_to_body(*quaternion, ahead, 0.0, sink)
        state[QUATERNION : QUATERNION + 4] = quaternion
        # Thrust goes with the square of the speed: as a share of the thrust the tail rotor is nearly linear.
        state[ROTOR_SPEED : ROTOR_SPEED + 3] = left, right, math.copysign(math.sqrt(abs(tail)), tail) * self.tail_top
        state[TILT], state[ELEVATOR] = self.angle, elevator
        state[AILERON_LEFT] = min(max(droop + aileron, -limit), limit)
        state[AILERON_RIGHT] = min(max(droop - aileron, -limit), limit)
        self.controls[3:] = state[TILT : TILT + 4]
        balance_motors(state, self.controls, self.vehicle, self.world, self.outputs, self.rate)
        out = self.outputs[0]
        excess = out["motor_torque"] - out["shaft_torque"]
        # As in `vehicle_model.trim.motor_shortfall`: wing rotors keep their speed either way, the tail's may be driven.
        short = -np.abs(excess)
        short[2] = min(float(np.sign(out["shaft_power"][2]) * excess[2]), 0.0)
        force = self.rate[VELOCITY : VELOCITY + 3] / STANDARD_GRAVITY
        moment = self.inertia @ self.rate[RATES : RATES + 3] / self.weight
        return np.concatenate([force, moment, short / (TORQUE_SCALE * self.weight)])

    def search(self, start: np.ndarray, fixed: dict[int, float], pull: float = 0.0) -> tuple[float, np.ndarray]:
        """Bounded least squares with some unknowns fixed: what is left unbalanced, and where.

        A light `pull` lets the tail rotor do little, where the elevator can do the same.
        """
        from scipy.optimize import least_squares  # slow to import, needed rarely

        x = np.clip(start, self.lower, self.upper)
        for index, value in fixed.items():
            x[index] = value
        free = [index for index in range(len(x)) if index not in fixed and self.upper[index] > self.lower[index]]

        def residuals(values: np.ndarray) -> np.ndarray:
            x[free] = values
            return np.append(self.balance(x), pull * x[TAIL])

        low, high = self.lower[free], self.upper[free]
        # The answers lie at limits; steps to the inside only, as of the method "trf", end before them.
        found = least_squares(
            residuals, np.clip(x[free], low + 1e-9, high - 1e-9), bounds=(low, high), method="dogbox",
            xtol=1e-14, ftol=1e-14, gtol=1e-14, max_nfev=60,
        )  # fmt: skip
        residuals(found.x)
        return float(np.abs(self.balance(x)).max()), x

    def searches(self, fixed: dict[int, float]) -> list[tuple[float, np.ndarray]]:
        """Searches from every start."""
        speed = (0.48 + 0.16 * math.sin(self.angle) ** 2) * self.fastest
        found: list[tuple[float, np.ndarray]] = []
        for ahead, share, tail in STARTS:
            x = np.zeros(len(self.scale))
            x[ROTORS], x[TAIL], x[PITCH], x[AHEAD], x[SINK] = speed, tail, share * STUCK_PITCH, ahead, 2.0
            found.append(self.search(x / self.scale, fixed))
        return found

    def furthest(self, points: Sequence[np.ndarray], index: int, sign: float, fixed: dict[int, float]) -> StuckFlight:
        """From the balanced flight with the most `sign` times one unknown, go on in steps as long as one balances."""
        best = max(points, key=lambda x: sign * x[index])
        step, end = FIRST_STEP / self.scale[index], self.upper[index] if sign > 0.0 else self.lower[index]
        while step > LAST_STEP / self.scale[index] and sign * (end - best[index]) > 1e-9:
            value = best[index] + sign * min(step, abs(end - best[index]))
            for start in (best, np.append(best[:ROLL], [0.0, 0.0, *best[AHEAD:]])):
                left, x = self.search(start, {**fixed, index: value})
                if left < BALANCED:
                    best = x
                    break
            else:
                step *= 0.4
        fixed = {**fixed, index: float(best[index])}
        _, rested = self.search(best, fixed, pull=1e-3)
        left, rested = self.search(rested, fixed)
        return self.flight(rested if left < BALANCED else best)

    def flight(self, x: np.ndarray) -> StuckFlight:
        residual = float(np.abs(self.balance(x)).max())
        observe(self.state, self.controls, self.vehicle, self.world, self.outputs, self.rate)
        values, out = x * self.scale, self.outputs[0]
        return StuckFlight(
            float(values[AHEAD]), float(values[SINK]), float(values[PITCH]), float(values[ROLL]),
            float(out["shaft_power"].sum()), float(out["stall_margin"][self.wetted].min()), residual,
        )  # fmt: skip


def stuck_wing(aircraft: Aircraft, angle: float, case: StuckCase = CASES[0]) -> StuckWing:
    """Steady flight straight ahead in still air at sea level with the wing stuck at an angle [rad].

    Raises ValueError for an angle outside the travel of the tilt servo, and a share of thrust that is none.
    """
    problem = _Problem(aircraft, angle, case)
    level = {SINK: 0.0}
    searches = problem.searches(level)
    unbalanced = min(left for left, _ in searches)
    points = [x for left, x in searches if left < BALANCED]
    if points:
        slowest = problem.furthest(points, AHEAD, -1.0, level)
        fastest = problem.furthest(points, AHEAD, 1.0, level)
        return StuckWing(angle, case, slowest, fastest, None, unbalanced)
    points = [x for left, x in problem.searches({}) if left < BALANCED]
    least = problem.furthest(points, SINK, -1.0, {}) if points else None
    return StuckWing(angle, case, None, None, least, unbalanced)


def stuck_wings(aircraft: Aircraft, watch: Callable[[list[float]], Iterable[float]] = iter) -> list[StuckWing]:
    """All CASES at every ANGLE_STEP of the tilt's travel, angle by angle; about 1 s for each.

    `watch` passes the angles [rad] on and may show progress.
    """
    tilt = aircraft.vehicle[0]["servos"][0]
    first = math.ceil(math.degrees(tilt["minimum"]) / ANGLE_STEP)
    last = math.floor(math.degrees(tilt["maximum"]) / ANGLE_STEP)
    angles = [math.radians(ANGLE_STEP * k) for k in range(first, last + 1)]
    return [stuck_wing(aircraft, angle, case) for angle in watch(angles) for case in CASES]


def stuck_wing_section(wings: Sequence[StuckWing]) -> str:
    """What was found for every angle and case, as Markdown."""
    cases = list(dict.fromkeys(wing.case for wing in wings))
    angles = list(dict.fromkeys(wing.angle for wing in wings))
    found = {(wing.angle, wing.case): wing for wing in wings}
    none = [wing for wing in wings if wing.unbalanced >= BALANCED]
    verdict = (
        f"Not every angle leaves level flight: {len(none)} of {len(wings)} have none, with what the best of "
        f"{len(STARTS)} searches leaves unbalanced as the certificate."
        if none
        else f"Level flight exists at every one of these angles (unbalanced: below {BALANCED:g} of the weight), so no "
        "descent is forced by the trim."
    )
    text = (
        f"The laws incline a stuck wing by the fuselage, within ±{math.degrees(STUCK_PITCH):.0f}° of pitch. Slowest "
        "and fastest level flight straight ahead in still air, all six balances met and every motor within its limits; "
        "behind it pitch and shaft power. Negative speed is rearward: into a wind from behind. "
        "The laws droop the ailerons as far as the force map says, between the first column and the last. "
        f"The search ends at {REARWARD:g} and {FORWARD:g} m/s (≤, ≥). {verdict}"
    )
    rows = ["| stuck at | " + " | ".join(case.name for case in cases) + " |", "|--:" + "|---" * len(cases) + "|"]
    for angle in angles:
        cells = [_cell(found[angle, case]) for case in cases]
        rows.append(f"| {math.degrees(angle):.0f}° | " + " | ".join(cells) + " |")
    return text + "\n\n" + "\n".join(rows)


def _cell(wing: StuckWing) -> str:
    slow, fast, least = wing.slowest, wing.fastest, wing.least_sink
    if slow is not None and fast is not None:
        # A hair inside the ends counts as at them.
        below = "≤ " if slow.ahead < REARWARD + LAST_STEP else ""
        above = "≥ " if fast.ahead > FORWARD - LAST_STEP else ""
        return f"{below}{_ahead(slow)} to {above}{_ahead(fast)}"
    certificate = f"level flight leaves {wing.unbalanced:.2g} of the weight"
    if least is None:
        return f"none, nor a descent to {DEEPEST_SINK:g} m/s; {certificate}"
    return f"none: least sink {least.sink:.2f} m/s at {_ahead(least)}; {certificate}"


def _ahead(flight: StuckFlight) -> str:
    return f"{flight.ahead:.1f} m/s ({math.degrees(flight.pitch):+.0f}°, {flight.power:.0f} W)"
