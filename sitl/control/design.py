"""Designs the control laws for an aircraft: its force map, and gains over the corridor; kept on disk once made.

Loop shaping, from the inside out. What an actuator's loop leaves of lag and delay sets the crossover of the rate loop
around it, this that of the attitude loop, and so on; each ratio is a number below, and the margins they leave are what
`python -m sitl.control report` measures on the code that flies.
"""

import hashlib
import math
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sitl.control.design_names import COLUMNS as SCHEDULE_COLUMNS
from sitl.control.records import GAINS
from vehicle_model.aircraft import Aircraft
from vehicle_model.authority import shaft_excess, speed_at
from vehicle_model.compiled import CACHE_FOLDER, compiled
from vehicle_model.earth import STANDARD_GRAVITY
from vehicle_model.force_map import COLUMNS, SEA_LEVEL_DENSITY, STALL_MARGIN, force_grid, force_map, stall_speed
from vehicle_model.records import VEHICLE
from vehicle_model.rotor import rotor_loads

__all__ = ["Design", "design_for"]

ROTOR_LAG = 0.04  # of the wing rotors' closed speed loops, at least [s]
ROTOR_STEP = 0.08  # of hover's rotor speed, that the motors' torque in reserve makes within the lag
TICK = 1.0 / 400.0  # [s]
DELAY = 1.5 * TICK  # a tick to compute, and half of one held [s]
RATE_CROSSOVER = 0.42  # of the rate loops, over 1/(lag + delay)
YAW_SHARE = 0.6  # of the yaw rate's crossover: nothing is in a hurry to yaw
ATTITUDE_RATIO = 0.32  # attitude crossover over that of the rate loop
LATERAL_RATIO = 0.36  # lateral velocity over attitude
FORWARD_CROSSOVER = 0.234  # forward velocity, over 1/(tilt lag + filter + delay)
VERTICAL_CROSSOVER = 0.20  # vertical velocity, over 1/(twice the rotor lag + delay), in hover
WING_BORNE_VERTICAL = 0.24  # the same wing-borne, over 1/(tilt lag + filter + delay), at the speed it begins
POSITION_RATIO = 0.35  # position over lateral velocity
INTEGRAL = 0.15  # integral gain over the square of the proportional one
# Wing-borne the bank turns the path and the nose follows with a lag of its own, and the map, whose tilt comes late,
# takes away part of the heave damping: more so, the faster. The velocity loops keep away from both.
WING_BORNE_LATERAL = 0.5  # of the lateral gain
WING_BORNE_INTEGRAL = 0.33  # of the integral
HEAVE_GROWTH = 0.5  # of the vertical gain, for each doubling of the speed wing-borne
WING_BORNE = (0.64, 0.88)  # forward airspeed at which this begins and is complete, over the stall speed
UPWASH_SHARE = 0.75  # of the airflow down the body that the map may answer: the rest stays heave damping
BRAKING_SHARE = 0.6  # of the corridor's braking that guidance plans with
STALL_TOLERANCE = math.radians(0.5)  # below the margin that the map keeps softly
IDLE_POWER = 0.015  # of a wing rotor, over that in hover: with less, its motor is at its lower end
PLANNED_BRAKING = (0.3, 1.5)  # [m/s^2]


@dataclass(frozen=True)
class Design:
    """What the laws need: GAINS (1,), force map and its axes (4, 3), schedule (n_u, columns), VEHICLE (1,)."""

    gains: np.ndarray
    table: np.ndarray
    axes: np.ndarray
    schedule: np.ndarray
    vehicle: np.ndarray

    @staticmethod
    def none() -> "Design":
        """Arrays of the right kinds that hold nothing, where compiled code wants a design and there are no laws."""
        axes = np.array([[0.0, 1.0, 2.0]] * 4)
        table = np.zeros((2, 2, 2, 2, len(COLUMNS)))
        return Design(np.zeros(1, GAINS), table, axes, np.zeros((2, len(SCHEDULE_COLUMNS))), np.zeros(1, VEHICLE))


def design_for(aircraft: Aircraft) -> Design:
    """The design for an aircraft, from the user's cache if it has been made before.

    The map takes some seconds; it depends on nothing but the aircraft and the sources that make it.
    """
    vehicle = aircraft.vehicle
    axes = force_grid(aircraft)
    digest = hashlib.sha256(vehicle.tobytes() + axes.tobytes()).hexdigest()[:24]
    file = None if CACHE_FOLDER is None else CACHE_FOLDER / f"force_map-{digest}.npy"
    table = _kept(file)
    if table is None:
        table = force_map(aircraft, axes)
        if file is not None:
            _keep(file, table)
    hover = _hover(table, axes)
    lag = _rotor_lag(aircraft, hover)
    gains = _gains(aircraft, lag)
    return Design(gains, table, axes, _schedule(aircraft, table, axes, gains, hover), vehicle.copy())


def _kept(file: Path | None) -> np.ndarray | None:
    """A table made before, or None where there is none that can be read."""
    if file is None:
        return None
    try:
        table = np.load(file)
    except (OSError, ValueError, EOFError):
        return None
    return table if table.shape[-1:] == (len(COLUMNS),) else None


def _keep(file: Path, table: np.ndarray) -> None:
    """Write a table so that another process sees all of it or nothing."""
    try:
        with tempfile.NamedTemporaryFile(dir=file.parent, suffix=".partial", delete=False) as stream:
            np.save(stream, table)
        Path(stream.name).replace(file)
    except OSError:  # a full disk, or a folder that is gone: the next process makes it again
        return


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


def _rate_gain(aircraft: Aircraft, lag: float) -> float:
    """Gain of the rate loops [1/s]: what the slowest of rotors, ailerons and elevator bears."""
    servos = aircraft.vehicle[0]["servos"]
    return RATE_CROSSOVER / (max(lag, *(float(servo["time_constant"]) for servo in servos[1:])) + DELAY)


def _gains(aircraft: Aircraft, lag: float) -> np.ndarray:
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
        "position": POSITION_RATIO * LATERAL_RATIO * ATTITUDE_RATIO * _rate_gain(aircraft, lag),
        "path": 0.25,
        "altitude": 0.6,
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
        "airflow_filter": 0.05,
        "upwash_filter": 0.5,
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
    aircraft: Aircraft, table: np.ndarray, axes: np.ndarray, gains: np.ndarray, hover: dict[str, float]
) -> np.ndarray:
    """Gains over the first axis of the map."""
    lag, begins, complete = (float(gains[name][0]) for name in ("rotor_lag", "wing_borne_from", "wing_borne_at"))
    count = int(axes[0, 2])
    airflow = axes[0, 0] + axes[0, 1] * np.arange(count)
    blend = np.clip((airflow - begins) / (complete - begins), 0.0, 1.0)
    rate = _rate_gain(aircraft, lag)
    tilt_lag = float(aircraft.vehicle[0]["servos"]["time_constant"][0]) + DELAY + float(gains["airflow_filter"][0])
    faster = 1.0 + HEAVE_GROWTH * np.maximum(airflow / complete - 1.0, 0.0)
    hovering = VERTICAL_CROSSOVER / (2.0 * lag + DELAY)
    lateral = LATERAL_RATIO * ATTITUDE_RATIO * rate
    still = round(-axes[1, 0] / axes[1, 1])
    weight = round((-10.0 - axes[3, 0]) / axes[3, 1])
    idle = IDLE_POWER * hover["shaft_torque"] * hover["rotor_speed"]
    lowest = _lowest_force(table[:, still, : round(-axes[2, 0] / axes[2, 1]) + 1, weight], idle)
    rows = {
        "roll_gain": ATTITUDE_RATIO * rate,
        "pitch_gain": ATTITUDE_RATIO * rate,
        "roll_rate_gain": rate,
        "pitch_rate_gain": rate,
        "yaw_rate_gain": YAW_SHARE * rate,
        "rate_integral_share": INTEGRAL,
        "forward_gain": FORWARD_CROSSOVER / tilt_lag,
        "lateral_gain": lateral * (1.0 + blend * (WING_BORNE_LATERAL - 1.0)),
        "vertical_gain": hovering + blend * (WING_BORNE_VERTICAL / tilt_lag * faster - hovering),
        "integral_share": INTEGRAL * (1.0 + blend * (WING_BORNE_INTEGRAL - 1.0)),
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
