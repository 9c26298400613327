"""The curves beside the scene: which numbers of the snapshots they show, in the units people read."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from vehicle_model.state import CONTROL_NAMES, ROTOR_SPEED, TILT

__all__ = ["PLOTS", "Plot"]

RPM = 30.0 / np.pi  # per rad/s

RED, GREEN, BLUE, ORANGE, GREY = (230, 84, 78), (76, 175, 104), (82, 148, 226), (255, 149, 20), (150, 158, 168)


class Plot(NamedTuple):
    """One plot: entity path, title, names and colours of its curves, and their values.

    `values(rows, tilting)` gives (rows, curves) from an array of ROW; `tilting` (surfaces,) marks the wing's strips.
    """

    path: str
    title: str
    names: tuple[str, ...]
    colors: tuple[tuple[int, int, int], ...]
    values: Callable[[np.ndarray, np.ndarray], np.ndarray]


def _columns(*columns: np.ndarray) -> np.ndarray:
    return np.column_stack(columns)


def _attitude(rows: np.ndarray, _: np.ndarray) -> np.ndarray:
    return np.degrees(_columns(rows["roll"], rows["pitch"], rows["yaw"]))


def _rates(rows: np.ndarray, _: np.ndarray) -> np.ndarray:
    return np.degrees(rows["rates"])


def _speeds(rows: np.ndarray, _: np.ndarray) -> np.ndarray:
    north, east, down = rows["velocity_ned"].T
    return _columns(rows["airspeed"], np.hypot(north, east), -down)


def _heights(rows: np.ndarray, _: np.ndarray) -> np.ndarray:
    return _columns(rows["outputs"]["height_above_ground"], -rows["position_ned"][:, 2])


def _incidence(rows: np.ndarray, tilting: np.ndarray) -> np.ndarray:
    margins = rows["outputs"]["stall_margin"][:, : len(tilting)][:, tilting]
    lowest = margins.min(axis=1) if margins.shape[1] else np.full(len(rows), np.nan)
    u, v, w = rows["outputs"]["velocity_air_body"].T
    return np.degrees(_columns(np.arctan2(w, u), np.arctan2(v, np.hypot(u, w)), lowest))


def _tilt(rows: np.ndarray, _: np.ndarray) -> np.ndarray:
    return np.degrees(_columns(rows["tilt"], rows["controls"][:, CONTROL_NAMES.index("tilt")]))


def _rotor_speeds(rows: np.ndarray, _: np.ndarray) -> np.ndarray:
    return rows["state"][:, ROTOR_SPEED : ROTOR_SPEED + 3] * RPM


def _thrusts(rows: np.ndarray, _: np.ndarray) -> np.ndarray:
    return rows["outputs"]["thrust"]


def _flaps(rows: np.ndarray, _: np.ndarray) -> np.ndarray:
    return np.degrees(rows["state"][:, TILT + 1 : TILT + 4])


def _power(rows: np.ndarray, _: np.ndarray) -> np.ndarray:
    power = rows["outputs"]["shaft_power"]
    return _columns(power, power.sum(axis=1))


SIDES = ("left", "right", "tail")
SIDE_COLORS = (RED, GREEN, BLUE)

PLOTS = (
    Plot("plots/attitude", "Attitude [deg]", ("roll", "pitch", "heading"), SIDE_COLORS, _attitude),
    Plot("plots/rates", "Rates [deg/s]", ("roll rate p", "pitch rate q", "yaw rate r"), SIDE_COLORS, _rates),
    Plot("plots/speed", "Speed [m/s]", ("airspeed", "ground speed", "climb"), (BLUE, GREY, ORANGE), _speeds),
    Plot("plots/height", "Height [m]", ("above ground", "above home"), (BLUE, GREY), _heights),
    Plot(
        "plots/incidence", "Angle of attack [deg]", ("alpha of fuselage", "sideslip", "least stall margin of wing"),
        (BLUE, GREY, RED), _incidence,
    ),
    Plot("plots/tilt", "Wing tilt [deg]", ("tilt", "commanded"), (ORANGE, GREY), _tilt),
    Plot("plots/rotor_speed", "Rotor speed [RPM]", SIDES, SIDE_COLORS, _rotor_speeds),
    Plot("plots/thrust", "Thrust [N]", SIDES, SIDE_COLORS, _thrusts),
    Plot("plots/servos", "Servos [deg]", ("left aileron", "right aileron", "elevator"), SIDE_COLORS, _flaps),
    Plot("plots/power", "Shaft power [W]", (*SIDES, "total"), (*SIDE_COLORS, ORANGE), _power),
)  # fmt: skip
