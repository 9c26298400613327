"""A flight in a dozen numbers, from its recorded history: how far, how fast, how closely, how it touched down."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from sitl.control.records import Horizontal, Level, Vertical

__all__ = ["FlightSummary", "airborne", "summarise"]

LIFTED = 1.0  # above where it stood [m]: from here on it flies and what it touches counts
SETTLING = 10.0  # of a leg [s]: the turn onto it is no error of the leg
JOINED = 0.5  # from a leg [m]: until then it is still on its way there
CAPTURED = 0.1  # from the height asked for [m]: until then it climbs or descends
WING_BORNE = 15.0  # airspeed [m/s] from which the wing outside the slipstream is to carry, stalled or not below it


@dataclass(frozen=True)
class FlightSummary:
    """Extremes of one flight between lift-off and touch-down; SI and radians. What never was is nan."""

    duration: float  # from lift-off to touch-down [s]
    distance: float  # over the ground [m]
    height: float  # greatest above home [m]
    airspeed: float  # greatest, true [m/s]
    bank: float  # greatest either way [rad]
    cross_track: float  # greatest distance from a leg, 10 s and more after it began and once it was within 0.5 m [m]
    altitude_error: float  # greatest from the height asked for, once that has been reached within 0.1 m [m]
    margin_wetted: float  # smallest angle left to maximum lift, of the wing in the slipstream [rad]
    margin_outer: float  # and outside it, above 15 m/s airspeed [rad]
    touchdown_speed: float  # downwards, at the first contact [m/s]
    touchdown_distance: float  # from the landing point, horizontally [m]
    peak_power: float  # [W]
    energy: float  # from the battery [J]
    battery_used: float  # 0..1


def airborne(rows: np.ndarray) -> slice:
    """Rows between lift-off and the first contact after it; empty if it never rose by 1 m.

    A flight that begins in the air is airborne from its first row on.
    """
    contact = rows["contact"] != 0
    if len(rows) == 0:
        return slice(0, 0)
    if contact[0]:
        risen = np.flatnonzero(rows["height_above_ground"] > rows["height_above_ground"][0] + LIFTED)
        if len(risen) == 0:
            return slice(0, 0)
        first = int(np.flatnonzero(contact[: risen[0]])[-1]) + 1
        flying = int(risen[0])
    else:
        first = flying = 0
    touched = np.flatnonzero(contact[flying:])
    return slice(first, flying + int(touched[0]) if len(touched) else len(rows))


def summarise(rows: np.ndarray, landing_point: tuple[float, float]) -> FlightSummary:
    """Summary of a history (n,) of `sitl.history.ROW`; the landing point is (north, east) of home [m]."""
    span = airborne(rows)
    flight = rows[span]
    track, height = zip(*_leg_errors(flight), strict=True) if len(flight) else ((), ())
    position, time = flight["position_ned"], flight["time"]
    steps = np.diff(position[:, :2], axis=0)
    touchdown_speed = touchdown_distance = math.nan
    if 0 < span.stop < len(rows):
        touchdown_speed = float(rows["velocity_ned"][span.stop - 1, 2])
        north, east = rows["position_ned"][span.stop, :2]
        touchdown_distance = math.hypot(north - landing_point[0], east - landing_point[1])
    return FlightSummary(
        duration=float(time[-1] - time[0]) if len(time) else 0.0,
        distance=float(np.hypot(steps[:, 0], steps[:, 1]).sum()),
        height=_largest(-position[:, 2]),
        airspeed=_largest(flight["airspeed"]),
        bank=_largest(np.abs(flight["euler"][:, 0])),
        cross_track=_largest(np.array(track)),
        altitude_error=_largest(np.array(height)),
        margin_wetted=-_largest(-flight["stall_margin_wetted"]),
        margin_outer=-_largest(-flight["stall_margin_outer"][flight["airspeed"] > WING_BORNE]),
        touchdown_speed=touchdown_speed,
        touchdown_distance=touchdown_distance,
        peak_power=_largest(flight["power"]),
        energy=float(np.trapezoid(rows["power"], rows["time"])) if len(rows) else 0.0,
        battery_used=float(rows["battery_remaining"][0] - rows["battery_remaining"][-1]) if len(rows) else 0.0,
    )


def _leg_errors(rows: np.ndarray) -> Iterator[tuple[float, float]]:
    """Greatest cross-track and altitude error of each task of the laws; nan where the task has none."""
    asked = np.column_stack(
        [rows["level"], rows["horizontal"], rows["vertical"], rows["start_ned"][:, :2], rows["target_ned"]]
    )
    begins = np.flatnonzero(np.any(np.diff(asked, axis=0) != 0.0, axis=1)) + 1
    for task in np.split(rows, begins):
        first = task[0]
        track = height = math.nan
        if first["level"] == Level.VELOCITY and first["horizontal"] == Horizontal.LEG:
            track = _cross_track(task)
        if first["level"] == Level.VELOCITY and first["vertical"] == Vertical.ALTITUDE:
            error = np.abs(task["position_ned"][:, 2] - first["target_ned"][2])
            captured = np.flatnonzero(error < CAPTURED)
            height = _largest(error[captured[0] :]) if len(captured) else math.nan
        yield track, height


def _cross_track(leg: np.ndarray) -> float:
    """Greatest distance from the line between the ends of the leg since it was joined; nan if over before it settled.

    Of a leg that is never joined all counts.
    """
    start = leg["start_ned"][0, :2]
    along = leg["target_ned"][0, :2] - start
    length = math.hypot(*along)
    if length == 0.0:
        return math.nan
    way = leg["position_ned"][:, :2] - start
    off = np.abs(way[:, 0] * along[1] - way[:, 1] * along[0]) / length
    off = off[(leg["time"] > leg["time"][0] + SETTLING) & (way @ along < length * length)]
    joined = np.flatnonzero(off < JOINED)
    return _largest(off[joined[0] :] if len(joined) else off)


def _largest(values: np.ndarray) -> float:
    """Greatest value that is a number, or nan."""
    numbers = values[~np.isnan(values)]
    return float(numbers.max()) if len(numbers) else math.nan
