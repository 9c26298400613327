"""The paper's own figures drawn from our aircraft: Figs 8, 10, 11-12 and 13."""

import math
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from vehicle_model.linearise import HOLDS
from vehicle_model.paper.printed import (
    CALIBRATED_HOLD,
    DAMPING_GRID,
    ELEVATOR_AXIS,
    FREQUENCY_GRID,
    Q_AXIS,
    RPM_AXIS,
    TABLE_1,
    THETA_AXIS,
    TILT_AXIS,
    U_AXIS,
    W_AXIS,
)
from vehicle_model.paper.results import AIRSPEEDS, Results
from vehicle_model.paper.style import OURS, PALETTE, PAPER, mark_axis_limits, new_figure, save
from vehicle_model.surface import coefficients

__all__ = ["draw_coefficients", "draw_poles", "draw_step", "draw_trim"]

_GREY = "#8a8a8a"
_THIN: dict[str, Any] = {"color": _GREY, "linewidth": 0.9, "linestyle": (0, (5, 2))}


def draw_coefficients(results: Results, path: Path) -> Path:
    """Fig. 8: lift and drag coefficient of the wing over the whole circle, with the two flows it blends."""
    wing = results.aircraft.vehicle[0]["surfaces"][0]
    angles = np.radians(np.linspace(-180.0, 180.0, 1441))
    lift, drag = np.array([coefficients(wing, math.sin(a), math.cos(a), 0.0) for a in angles]).T
    inner, outer = np.degrees(np.arcsin([wing["stall_sine"], wing["stall_sine"] + wing["stall_sine_span"]]))
    degrees = np.degrees(angles)
    attached = np.abs(degrees) <= 0.5 * (inner + outer)
    figure = new_figure(7.0, 3.0)
    left, right = figure.subplots(1, 2)
    for axes in (left, right):
        for sign in (-1.0, 1.0):
            axes.axvspan(sign * inner, sign * outer, color="#eeeeee", linewidth=0)
        axes.set_xlim(-180, 180)
        axes.set_xticks(range(-180, 181, 60))
        axes.set_xlabel("angle of attack (deg)")
    slope = wing["lift_slope"] * np.sin(angles)
    left.plot(degrees[attached], slope[attached], label="attached: $a\\,\\sin\\alpha$", **_THIN)
    left.plot(
        degrees,
        wing["plate_lift"] * np.sin(2 * angles),
        label="plate: $C_p \\sin 2\\alpha$",
        color=_GREY,
        linewidth=0.9,
        linestyle=":",
    )
    left.plot(degrees, lift, color=OURS, label="$C_L$")
    peak = math.degrees(wing["max_lift_angle"])
    top = float(lift.max())
    left.plot(peak, np.interp(peak, degrees, lift), "o", color=OURS, markersize=4)
    left.annotate(f"{top:.2f} at {peak:.1f}°", (peak, top), (peak + 12, top + 0.02), fontsize=7.5, color=OURS)
    left.set_ylim(-1.25 * top, 1.25 * top)
    left.set_ylabel("$C_L$")
    left.legend(loc="lower right")
    right.plot(
        degrees,
        wing["zero_lift_drag"] + wing["plate_drag"] * np.sin(angles) ** 2,
        color=_GREY,
        linewidth=0.9,
        linestyle=":",
        label="plate: $C_{D0} + C_d \\sin^2\\alpha$",
    )
    right.plot(
        degrees[attached],
        wing["zero_lift_drag"] + wing["induced_drag"] * slope[attached] ** 2,
        label="attached: $C_{D0} + K C_L^2$",
        **_THIN,
    )
    right.plot(degrees, drag, color=OURS, label="$C_D$")
    right.set_ylim(0, 1.4 * float(drag.max()))
    right.set_ylabel("$C_D$")
    right.legend(loc="upper center")
    return save(figure, path)


def draw_trim(results: Results, path: Path) -> Path:
    """Fig. 10: the three trim curves within the paper's axes, and their second differences."""
    figure = new_figure(7.0, 5.6)
    grid = figure.subplots(3, 2, sharex=True, width_ratios=(1.6, 1.0))
    names = ("RPM", "tilt (deg)", "elevator (deg)")
    limits = (RPM_AXIS, TILT_AXIS, ELEVATOR_AXIS)
    for i, (name, axis, values) in enumerate(zip(names, limits, results.curves, strict=True)):
        left, right = grid[i]
        left.plot(AIRSPEEDS, values, color=OURS, marker="o", markersize=2.5, label="ours")
        mark_axis_limits(left, axis, "axis of the paper's Fig. 10")
        left.set_ylabel(name)
        right.axhline(0.0, color="#999999", linewidth=0.6)
        right.plot(AIRSPEEDS[1:-1], np.diff(values, 2), color=OURS, marker="o", markersize=2.5)
        right.set_ylabel(f"$\\Delta^2$ {name}")
    hover, cruise = results.curves[0, 0], results.curves[0, -1]
    grid[0, 0].annotate(f"{hover:.0f}", (0, hover), (0.3, hover + 280), fontsize=7.5, color=OURS)
    grid[0, 0].annotate(f"{cruise:.0f}", (30, cruise), (28.0, cruise + 350), fontsize=7.5, color=OURS)
    grid[0, 0].legend(loc="lower left", bbox_to_anchor=(0.0, 0.08))
    grid[0, 1].set_title("second differences, 1 m/s apart")
    grid[0, 0].set_title("level trim, fuselage level")
    for axes in grid[-1]:
        axes.set_xlabel("airspeed (m/s)")
        axes.set_xlim(-0.5, 30.5)
    return save(figure, path)


def draw_step(results: Results, path: Path) -> Path:
    """Figs 11-12: the elevator step and the answer of u, w (changes from trim), q and theta."""
    step = results.step
    elevator = np.where(step.time < step.step_time, step.controls_before[6], step.controls_after[6])
    flown = (
        np.degrees(elevator - step.controls_before[6]),
        step.u - step.u[0],
        step.w - step.w[0],
        np.degrees(step.q),
        np.degrees(step.theta),
    )
    linear = results.linear_step * np.array([1.0, 1.0, 180.0 / math.pi, 180.0 / math.pi])
    names = ("$\\Delta\\delta_e$ (deg)", "$\\Delta u$ (m/s)", "$\\Delta w$ (m/s)", "$q$ (deg/s)", "$\\theta$ (deg)")
    limits = (None, U_AXIS, W_AXIS, Q_AXIS, THETA_AXIS)
    figure = new_figure(7.0, 6.6)
    column = figure.subplots(5, 2, sharex="col", width_ratios=(2.2, 1.0), height_ratios=(0.55, 1, 1, 1, 1))
    for i, (name, axis, values) in enumerate(zip(names, limits, flown, strict=True)):
        for j, axes in enumerate(column[i]):
            axes.plot(step.time, values, color=OURS, label="ours")
            if i:
                axes.plot(step.time, linear[:, i - 1], label="ours, linear", **_THIN)
            if axis is not None and j == 0:
                mark_axis_limits(axes, axis, "axis of the paper's Fig. 12")
        column[i, 0].set_ylabel(name)
    column[0, 0].set_title("50 s")
    column[0, 1].set_title("the short period")
    figure.legend(*column[1, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    for axes, end in zip(column[-1], (50.0, 4.0), strict=True):
        axes.set_xlim(0, end)
        axes.set_xlabel("time (s)")
    figure.align_ylabels(column[:, 0])
    return save(figure, path)


def draw_poles(results: Results, path: Path) -> Path:
    """Fig. 13: poles beside the paper's on its damping grid, and a closer look at the phugoid for every hold."""
    figure = new_figure(7.0, 3.9)
    left, right = figure.subplots(1, 2)
    ours = [results.mode(name) for name in TABLE_1]
    low = min([-3.0, *(1.1 * mode.real for mode in ours if mode is not None)])
    top = max([15.0, *(1.1 * mode.imag for mode in ours if mode is not None)])
    _damping_grid(left, low, top)
    for pole in TABLE_1.values():
        for sign in (-1, 1):
            left.plot(pole.real, sign * pole.imag, "s", color=PAPER, markersize=8, fillstyle="none")
    for mode in ours:
        if mode is not None:
            left.plot([mode.real] * 2, [mode.imag, -mode.imag], "x", color=OURS, markersize=6)
    left.set_xlabel("real part (1/s)")
    left.set_ylabel("imaginary part (rad/s)")
    phugoid = TABLE_1["phugoid"]
    right.plot(phugoid.real, phugoid.imag, "s", color=PAPER, markersize=9, fillstyle="none", label="paper, Table 1")
    for color, hold in zip((OURS, *PALETTE[2:]), HOLDS, strict=False):
        mode = results.mode("phugoid", hold)
        if mode is not None:
            calibrated = " (calibrated)" if hold == CALIBRATED_HOLD else ""
            right.plot(
                mode.real,
                mode.imag,
                "x",
                color=color,
                markersize=7,
                markeredgewidth=1.6,
                label=f"ours, {hold} held{calibrated}",
            )
    right.axvline(0.0, color="#999999", linewidth=0.6)
    right.set_title("phugoid, by what the propellers keep")
    left.set_title("longitudinal poles at 30 m/s")
    right.set_xlabel("real part (1/s)")
    right.margins(0.2)
    right.locator_params(nbins=5)
    figure.legend(*right.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return save(figure, path)


def _damping_grid(axes: Axes, low: float, top: float) -> None:
    """Lines of constant damping and frequency over the left half plane, as the paper's Fig. 13 has them."""
    axes.grid(visible=False)
    style: dict[str, Any] = {"color": "#cccccc", "linewidth": 0.6, "zorder": 0}
    for i, damping in enumerate(DAMPING_GRID):
        slope = math.sqrt(1.0 - damping**2) / damping
        for sign in (-1.0, 1.0):
            axes.plot([0.0, -60.0], [0.0, sign * 60.0 * slope], **style)
        height = (0.96 - 0.07 * (i % 2)) * top
        x, y = (-height / slope, height) if height / slope < -0.95 * low else (0.95 * low, -0.95 * low * slope)
        axes.text(
            x,
            y,
            f"{damping:g}",
            fontsize=6,
            color="#888888",
            ha="center",
            va="center",
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6},
        )
    turn = np.linspace(math.pi / 2, 1.5 * math.pi, 181)
    for frequency in FREQUENCY_GRID:
        axes.plot(frequency * np.cos(turn), frequency * np.sin(turn), **style)
    axes.axhline(0.0, color="#999999", linewidth=0.6)
    axes.set_xlim(low, 0.12)
    axes.set_ylim(-top, top)
