"""The control report's figures: margins over the corridor, the tightest loops, who controls what, the trim map."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import TwoSlopeNorm
from matplotlib.figure import Figure

from sitl.control.lookup import map_lookup
from sitl.control.margins import GAIN_GOAL, PHASE_GOAL
from vehicle_model.aircraft import Aircraft
from vehicle_model.earth import STANDARD_GRAVITY
from vehicle_model.force_map import COLUMNS
from vehicle_model.paper.style import PALETTE, new_figure

__all__ = ["Loop", "MarginTable", "effectiveness", "gains", "margin_maps", "nichols", "sinking", "trim_map"]

SHOWN_GAIN, SHOWN_PHASE = 30.0, math.radians(120.0)  # beyond these a margin is as good as any
ROTORS_APART = 0.05  # of the fastest speed


@dataclass(frozen=True)
class MarginTable:
    """Least margins by loop and airspeed: gain [dB], phase [rad], disk margin, each (loops, airspeeds)."""

    loops: tuple[str, ...]
    airspeeds: tuple[float, ...]
    gain: np.ndarray
    phase: np.ndarray
    disk: np.ndarray


@dataclass(frozen=True)
class Loop:
    """Response of one opened loop, for a Nichols chart."""

    label: str
    omega: np.ndarray  # [rad/s]
    response: np.ndarray  # L
    phase: float  # margin, for the legend [rad]
    gain: float  # [dB]


def margin_maps(table: MarginTable) -> Figure:
    """Three maps, loop by airspeed: gain, phase and disk margin, in warm colours where the goal is missed."""
    figure = new_figure(2.0 + 0.62 * len(table.airspeeds), 1.2 + 0.24 * len(table.loops))
    panels = figure.subplots(1, 3, sharey=True)
    goals = (
        ("gain margin [dB]", table.gain, GAIN_GOAL, SHOWN_GAIN, "{:.0f}"),
        ("phase margin [deg]", np.degrees(table.phase), math.degrees(PHASE_GOAL), math.degrees(SHOWN_PHASE), "{:.0f}"),
        ("disk margin", table.disk, 2.0 / 3.0, 2.0, "{:.1f}"),  # 2/3: 6 dB of gain and 37 deg of phase at once
    )
    for axes, (title, values, goal, shown, form) in zip(panels, goals, strict=True):
        _heat(axes, values, goal, shown, form)
        axes.set_title(title)
        axes.set_xticks(range(len(table.airspeeds)), [f"{speed:g}" for speed in table.airspeeds], fontsize=6.5)
        axes.set_xlabel("airspeed [m/s]")
    panels[0].set_yticks(range(len(table.loops)), table.loops)
    return figure


def _heat(axes: Axes, values: np.ndarray, goal: float, shown: float, form: str) -> None:
    """One map: the paler the nearer to the goal, orange below it; a margin as good as infinite has no number."""
    above = np.clip((values - goal) / (shown - goal), 0.0, 1.0)
    below = np.clip((goal - values) / goal, 0.0, 1.0)
    axes.imshow(
        above - below, cmap="PuOr", norm=TwoSlopeNorm(0.0, -1.2, 3.0), aspect="auto"
    )  # text stays readable on both ends
    axes.grid(visible=False)
    for (i, j), value in np.ndenumerate(values):
        if value < shown:
            axes.text(j, i, form.format(value), ha="center", va="center", fontsize=6.0,
                      fontweight="bold" if value < goal else "normal")  # fmt: skip


def nichols(loops: Sequence[Loop]) -> Figure:
    """Nichols chart of opened loops, with the region about -1 that gain and phase margins keep free."""
    figure = new_figure(7.0, 5.0)
    axes = figure.subplots()
    goal = math.degrees(PHASE_GOAL)
    corners = np.array([(-180.0 - goal, 0.0), (-180.0, GAIN_GOAL), (-180.0 + goal, 0.0), (-180.0, -GAIN_GOAL)])
    axes.fill(corners[:, 0], corners[:, 1], color="#e4e4e4", zorder=0)
    axes.plot(-180.0, 0.0, "+", color="#555555", markersize=8)
    for k, loop in enumerate(loops):
        size = 20.0 * np.log10(np.maximum(np.abs(loop.response), 1e-12))
        phase = np.degrees(np.unwrap(np.angle(loop.response)))
        near = np.abs(size) < 45.0
        middle = float(phase[np.argmin(np.abs(size))])
        phase -= 360.0 * math.floor((middle + 360.0) / 360.0)  # about -180
        margin = f"{loop.gain:.1f} dB" + ("" if math.isinf(loop.phase) else f", {math.degrees(loop.phase):.0f}°")
        style = ("-", "--")[k // len(PALETTE) % 2]
        axes.plot(phase[near], size[near], style, color=PALETTE[k % len(PALETTE)], label=f"{loop.label}: {margin}")
    axes.set(xlim=(-360.0, 90.0), ylim=(-40.0, 40.0), xlabel="phase [deg]", ylabel="gain [dB]")
    axes.set_xticks(range(-360, 91, 45))
    axes.legend(loc="upper right", fontsize=6.5)
    return figure


def effectiveness(aircraft: Aircraft, table: np.ndarray, axes_of_table: np.ndarray, fastest: float) -> Figure:
    """Roll and yaw exchange roles: what rotors apart and ailerons apart do over the airspeed of level flight.

    `fastest` is the wing rotors' greatest speed [rad/s]; rotors are parted by 5 % of it, ailerons by their travel.
    """
    inertia = aircraft.vehicle[0]["inertia"]
    speeds = np.arange(0.0, 30.1, 0.25)
    rows = np.array([_node(table, axes_of_table, speed, 0.0) for speed in speeds])
    column = {name: rows[:, k] for k, name in enumerate(COLUMNS)}
    travel = float(aircraft.vehicle[0]["servos"]["maximum"][1])
    pairs = (("rotors apart by 5 %", "rotor", ROTORS_APART * fastest), ("ailerons at full travel", "aileron", travel))
    figure = new_figure(8.5, 5.6)
    panels = figure.subplots(2, 2, sharex=True)
    for k, (axis, index) in enumerate((("roll", 0), ("yaw", 2))):
        for (label, pair, size), colour in zip(pairs, PALETTE, strict=False):
            turned = np.degrees(column[f"{axis}_per_{pair}"]) * size / inertia[index, index]
            panels[0, k].plot(speeds, turned, color=colour, label=label)
        panels[0, k].axhline(0.0, color="#999999", linewidth=0.7)
        panels[0, k].set_title(f"{axis}: angular acceleration [deg/s²]")
    for k, (label, pair, _) in enumerate(pairs):
        roll, yaw = column[f"roll_per_{pair}"], column[f"yaw_per_{pair}"]
        share = 100.0 * roll**2 / (roll**2 + yaw**2)
        panels[1, k].fill_between(speeds, 0.0, share, color=PALETTE[2], alpha=0.35, linewidth=0.0, label="roll")
        panels[1, k].fill_between(speeds, share, 100.0, color=PALETTE[3], alpha=0.35, linewidth=0.0, label="yaw")
        panels[1, k].plot(speeds, np.degrees(column["tilt"]), color="#333333", linewidth=1.0, label="tilt [deg]")
        panels[1, k].set(ylim=(0.0, 100.0), xlim=(0.0, 30.0), xlabel="airspeed [m/s]")
        panels[1, k].set_title(f"{label}: square shares of its moment [%]")
    panels[0, 1].legend()
    panels[1, 0].legend(loc="upper right")
    return figure


def trim_map(table: np.ndarray, axes_of_table: np.ndarray) -> Figure:
    """Tilt, shaft power and stall margin over airspeed and acceleration along the level fuselage.

    Blank where the force cannot be had; the line is steady flight.
    """
    speeds, accelerations = np.arange(0.0, 30.1, 0.5), np.arange(-4.0, 4.01, 0.2)
    nodes = np.array([[_node(table, axes_of_table, u, a) for u in speeds] for a in accelerations])
    column = {name: nodes[:, :, k] for k, name in enumerate(COLUMNS)}
    reached = np.abs(column["force_forward"] - accelerations[:, None]) < 0.3
    reached &= np.abs(column["force_down"] + STANDARD_GRAVITY) < 0.3
    power = 2.0 * column["shaft_torque"] * column["rotor_speed"] / 1000.0
    panels = (
        ("tilt [deg]", np.degrees(column["tilt"]), np.arange(0, 101, 10), "viridis"),
        (
            "shaft power of the wing rotors [kW]",
            power,
            _round_levels(power[reached]),
            "magma",
        ),
        ("stall margin in the slipstream [deg]", np.degrees(column["stall_margin"]), np.arange(-4, 25, 2), "cividis"),
    )
    figure = new_figure(11.0, 3.4)
    for axes, (title, values, levels, colours) in zip(figure.subplots(1, 3, sharey=True), panels, strict=True):
        shown = axes.contourf(
            speeds, accelerations, np.where(reached, values, np.nan), levels=levels, cmap=colours, extend="both"
        )
        figure.colorbar(shown, ax=axes)
        axes.axhline(0.0, color="white", linewidth=1.0)
        axes.set(title=title, xlabel="airspeed [m/s]")
        axes.set_facecolor("#f4f4f4")
    figure.axes[0].set_ylabel("acceleration forward [m/s²]")
    return figure


def _round_levels(values: np.ndarray) -> np.ndarray:
    """Contour levels at quarters, halves or whole units, a dozen or so over the values."""
    low, high = float(values.min()), float(values.max())
    step = next((size for size in (0.25, 0.5, 1.0, 2.0) if (high - low) / size < 15.0), 5.0)
    return np.arange(math.floor(low / step), math.ceil(high / step) + 1) * step


def _node(table: np.ndarray, axes: np.ndarray, airspeed: float, forward: float) -> np.ndarray:
    """The force map at a level airspeed [m/s] and acceleration [m/s^2] of the level fuselage."""
    node = np.empty(len(COLUMNS))
    map_lookup(table, axes, airspeed, 0.0, forward, -STANDARD_GRAVITY, node)
    return node


def gains(airspeeds: Sequence[float], columns: Sequence[tuple[str, Sequence[float]]]) -> Figure:
    """The gains of the schedule over airspeed, one small panel each."""
    across = 4
    down = math.ceil(len(columns) / across)
    figure = new_figure(10.0, 1.0 + 1.7 * down)
    panels = np.atleast_2d(figure.subplots(down, across, sharex=True)).ravel()
    for axes, (name, values) in zip(panels, columns, strict=False):
        axes.plot(airspeeds, values, color=PALETTE[0])
        axes.set_title(name)
        axes.set_ylim(min(0.0, 1.1 * min(values)), max(0.0, 1.1 * max(values)))
    for axes in panels[len(columns) :]:
        axes.set_axis_off()
    for axes in panels[max(len(columns) - across, 0) : len(columns)]:
        axes.set_xlabel("airspeed [m/s]")
    return figure


def sinking(airspeeds: np.ndarray, curves: Sequence[tuple[str, np.ndarray]], asked: float) -> Figure:
    """Steady sink rates [m/s] that the corridor bears over airspeed, and the one `asked` for."""
    figure = new_figure(6.0, 3.2)
    axes = figure.subplots()
    for (label, values), colour, style in zip(curves, PALETTE, ("-", "--", ":", "-."), strict=False):
        axes.plot(airspeeds, values, style, color=colour, label=label)
    axes.axhline(asked, color="#999999", linewidth=0.7)
    axes.set(xlabel="airspeed [m/s]", ylabel="steady sink rate [m/s]", ylim=(0.0, None))
    axes.legend()
    return figure
