"""Loop shaping: the ratios that set each loop against the one inside it, and the gains of an aircraft that follow.

From the inside out: what an actuator's loop leaves of lag and delay sets the crossover of the rate loop around it,
this that of the attitude loop, and so on. The ratios below suit the paper's aircraft; `sitl.control.tuning` measures
the margins they leave on the aircraft at hand and changes them where they fall short.
"""

import math
from dataclasses import dataclass

import numpy as np

from sitl.control.design_names import COLUMNS as SCHEDULE_COLUMNS
from sitl.control.records import GAINS
from vehicle_model.aircraft import Aircraft
from vehicle_model.authority import shaft_excess, speed_at
from vehicle_model.compiled import compiled
from vehicle_model.earth import STANDARD_GRAVITY
from vehicle_model.force_columns import COLUMNS
from vehicle_model.force_map import SEA_LEVEL_DENSITY, STALL_MARGIN, stall_speed
from vehicle_model.rotor import rotor_loads

__all__ = ["DEFAULT_SHAPE", "PLANNED_BRAKING", "STALL_TOLERANCE", "Shape", "shaped"]

ROTOR_LAG = 0.04  # of the wing rotors' closed speed loops, at least [s]
ROTOR_STEP = 0.08  # of hover's rotor speed, that the motors' torque in reserve makes within the lag
TICK = 1.0 / 400.0  # [s]
DELAY = 1.5 * TICK  # a tick to compute, and half of one held [s]
AIRFLOW_FILTER = 0.05  # [s]
WING_BORNE = (0.64, 0.88)  # forward airspeed at which wing-borne flight begins and is complete, over the stall speed
UPWASH_SHARE = 0.75  # of the airflow down the body that the map may answer: the rest stays heave damping
BRAKING_SHARE = 0.6  # of the corridor's braking that guidance plans with
STALL_TOLERANCE = math.radians(0.5)  # below the margin that the map keeps softly
IDLE_POWER = 0.015  # of a wing rotor, over that in hover: with less, its motor is at its lower end
PLANNED_BRAKING = (0.3, 1.5)  # [m/s^2]


@dataclass(frozen=True)
class Shape:
    """Where each loop's crossover lies against what is inside it; those of `wing_borne` and below apply in cruise.

    Between hover and cruise, at airspeeds WING_BORNE, gains go over from one to the other. Wing-borne the bank turns
    the path and the nose follows with a lag of its own, and the map, whose tilt comes late, takes away part of the
    heave damping: more so, the faster. The velocity loops keep away from both.
    """

    rate: float = 0.42  # of the rate loops, over 1/(lag + delay) of the slowest actuator
    yaw: float = 0.6  # yaw rate over the other rates: nothing is in a hurry to yaw
    attitude: float = 0.32  # attitude over rate
    lateral: float = 0.36  # lateral velocity over attitude
    position: float = 0.35  # position over lateral velocity
    forward: float = 0.234  # forward velocity, over 1/(tilt lag + filter + delay)
    vertical: float = 0.20  # vertical velocity, over 1/(twice the rotor lag + delay)
    integral: float = 0.15  # integral gain of the velocity loops over the square of the proportional one
    rate_integral: float = 0.15  # the same of the rate loops
    wing_borne_rate: float = 1.0  # of the rate loops' gains
    wing_borne_roll: float = 1.0  # roll rate over pitch rate
    wing_borne_attitude: float = 0.32  # attitude over rate
    wing_borne_lateral: float = 0.5  # of the lateral gain
    wing_borne_integral: float = 0.33  # of the velocity loops' integral
    wing_borne_vertical: float = 0.24  # over 1/(tilt lag + filter + delay), at the speed where cruise begins
    heave_growth: float = 0.5  # of the vertical gain, for each doubling of that speed
    attitude_growth: float = 0.0  # of attitude over rate, the same way
    rate_integral_growth: float = 0.0  # of the rate loops' integral, the same way
    upwash_filter: float = 0.5  # of the airflow down the body, which the wing gives way to [s]
    path: float = 0.25  # of the position across a leg or circle [1/s]
    altitude: float = 0.6  # [1/s]


DEFAULT_SHAPE = Shape()  # the paper's aircraft flies by it


def shaped(aircraft: Aircraft, table: np.ndarray, axes: np.ndarray, shape: Shape) -> tuple[np.ndarray, np.ndarray]:
    """GAINS (1,) and schedule (n_u, columns) of an aircraft with its force map and the map's axes (4, 3)."""
    hover = _hover(table, axes)
    gains = _gains(aircraft, _rotor_lag(aircraft, hover), shape)
    return gains, _schedule(aircraft, table, axes, gains, hover, shape)


@compiled
def _static(vehicle, index: int, speed: float) -> tuple[float, float]:
    """Thrust [N] and torque [N m] of a rotor at a speed [rad/s], at rest at sea level."""
    thrust, torque, _ = rotor_loads(vehicle[0].rotors[index], speed, 0.0, 0.0, SEA_LEVEL_DENSITY)
    return thrust, torque


def _hover(table: np.ndarray, axes: np.ndarray) -> dict[str, float]:
    """The node of the map nearest to hover, by the names of its columns."""
    near = zip((0.0, 0.0, 0.0, -STANDARD_GRAVITY), axes, strict=True)
    node = table[tuple(round((value - first) / step) for value, (first, step, _) in near)]
    return dict(zip(COLUMNS, node.tolist(), strict=True))


def _rotor_lag(aircraft: Aircraft, hover: dict[str, float]) -> float:
    """Lag [s] that the wing motors' torque in reserve allows their speed loops, about hover."""
    speed = hover["rotor_speed"]
    reserve = shaft_excess(aircraft.vehicle, 0, 1.0, speed, 0.0, 0.0, SEA_LEVEL_DENSITY)
    inertia = float(aircraft.vehicle[0]["rotors"]["inertia"][0])
    return max(ROTOR_LAG, inertia * ROTOR_STEP * speed / max(reserve, 1e-9))


def _rate_gain(aircraft: Aircraft, lag: float, shape: Shape) -> float:
    """Gain of the rate loops [1/s]: what the slowest of rotors, ailerons and elevator bears."""
    servos = aircraft.vehicle[0]["servos"]
    return shape.rate / (max(lag, *(float(servo["time_constant"]) for servo in servos[1:])) + DELAY)


def _gains(aircraft: Aircraft, lag: float, shape: Shape) -> np.ndarray:
    """The GAINS record, with speed loops of the wing rotors of this lag [s]."""
    vehicle = aircraft.vehicle
    craft = vehicle[0]
    top = speed_at(aircraft, 0, 1.0)
    _, top_torque = _static(vehicle, 0, top)
    tail_top = speed_at(aircraft, 2, 0.9)
    tail_thrust, tail_torque = _static(vehicle, 2, tail_top)
    stall = stall_speed(aircraft)
    gains = np.zeros(1, GAINS)
    record = gains[0]
    values = {
        "position": shape.position * shape.lateral * shape.attitude * _rate_gain(aircraft, lag, shape),
        "path": shape.path,
        "altitude": shape.altitude,
        "reference": 1.2,
        "heading": 1.6,
        "sideslip": 1.0,
        "max_yaw_rate": math.radians(50.0),
        "max_roll_rate": math.radians(60.0),
        "lateral_acceleration": 2.0,
        "forward_acceleration": 2.0,
        "vertical_acceleration": 2.5,
        "wing_borne_from": WING_BORNE[0] * stall,
        "wing_borne_at": WING_BORNE[1] * stall,
        "rotor_lag": lag,
        "elevator_preference": 100.0,
        "airflow_filter": AIRFLOW_FILTER,
        "upwash_filter": shape.upwash_filter,
        "upwash_share": UPWASH_SHARE,
        "idle_speed": 0.15 * top,
        "top_speed": top,
        "torque_factor": top_torque / top**2,
        "tail_thrust_factor": tail_thrust / tail_top**2,
        "tail_torque_factor": tail_torque / tail_top**2,
        "tail_top_thrust": tail_thrust,
        "tail_arm": -float(craft["rotors"]["position"][2, 0]),
        "hover_tilt": min(math.radians(90.0), float(craft["servos"]["maximum"][0])),
    }
    for name, value in values.items():
        record[name] = value
    return gains


def _schedule(
    aircraft: Aircraft, table: np.ndarray, axes: np.ndarray, gains: np.ndarray, hover: dict[str, float], shape: Shape
) -> np.ndarray:
    """Gains over the first axis of the map."""
    lag, begins, complete = (float(gains[name][0]) for name in ("rotor_lag", "wing_borne_from", "wing_borne_at"))
    count = int(axes[0, 2])
    airflow = axes[0, 0] + axes[0, 1] * np.arange(count)
    blend = np.clip((airflow - begins) / (complete - begins), 0.0, 1.0)
    hover_rate = _rate_gain(aircraft, lag, shape)
    rate = hover_rate * (1.0 + blend * (shape.wing_borne_rate - 1.0))
    beyond = np.maximum(airflow / complete - 1.0, 0.0)
    attitude = (shape.attitude + blend * (shape.wing_borne_attitude - shape.attitude)) * rate
    attitude *= 1.0 + shape.attitude_growth * beyond
    tilt_lag = float(aircraft.vehicle[0]["servos"]["time_constant"][0]) + DELAY + float(gains["airflow_filter"][0])
    faster = 1.0 + shape.heave_growth * beyond
    hovering = shape.vertical / (2.0 * lag + DELAY)
    lateral = shape.lateral * shape.attitude * hover_rate
    still = round(-axes[1, 0] / axes[1, 1])
    weight = round((-10.0 - axes[3, 0]) / axes[3, 1])
    idle = IDLE_POWER * hover["shaft_torque"] * hover["rotor_speed"]
    lowest = _lowest_force(table[:, still, : round(-axes[2, 0] / axes[2, 1]) + 1, weight], idle)
    rows = {
        "roll_gain": attitude,
        "pitch_gain": attitude,
        "roll_rate_gain": rate * (1.0 + blend * (shape.wing_borne_roll - 1.0)),
        "pitch_rate_gain": rate,
        "yaw_rate_gain": shape.yaw * rate,
        "rate_integral_share": shape.rate_integral * (1.0 + shape.rate_integral_growth * beyond),
        "forward_gain": shape.forward / tilt_lag,
        "lateral_gain": lateral * (1.0 + blend * (shape.wing_borne_lateral - 1.0)),
        "vertical_gain": hovering + blend * (shape.wing_borne_vertical / tilt_lag * faster - hovering),
        "integral_share": shape.integral * (1.0 + blend * (shape.wing_borne_integral - 1.0)),
        "brake": np.clip(-BRAKING_SHARE * lowest, *PLANNED_BRAKING),
        "lowest_force": lowest,
    }
    return np.column_stack([np.broadcast_to(rows[name], count) for name in SCHEDULE_COLUMNS]).astype(float)


def _lowest_force(level: np.ndarray, idle: float) -> np.ndarray:
    """Lowest force forward per mass [m/s^2] that level flight keeps without stall or idling motors, by airflow.

    `level` is the map's part (n_u, n_fx, columns) for the weight to be carried, the force forward from its lowest to
    none; `idle` is the shaft power of one rotor [W] that counts as idling. The force is interpolated to where the first
    of the conditions ends.
    """
    reached, down, margin, torque, speed = (
        level[..., COLUMNS.index(name)]
        for name in ("force_forward", "force_down", "stall_margin", "shaft_torque", "rotor_speed")
    )
    # Each condition as room that is left; each ends where it crosses zero, the first to end counts.
    conditions = (margin - STALL_MARGIN + STALL_TOLERANCE, 0.3 - np.abs(down + 10.0), torque * speed - idle)
    lowest = np.full(len(level), -math.inf)
    for room in conditions:
        for i in range(len(level)):
            k = level.shape[1] - 1
            while k > 0 and room[i, k] > 0.0 and room[i, k - 1] > 0.0:
                k -= 1
            ends = reached[i, k]
            if k > 0 and room[i, k] > 0.0:
                ends += room[i, k] / (room[i, k] - room[i, k - 1]) * (reached[i, k - 1] - reached[i, k])
            lowest[i] = max(lowest[i], ends)
    return np.minimum(lowest, 0.0)
