"""Figures beyond the paper's: power and stall, pitching moment by part, descents, and the literal slipstream."""

import math
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from vehicle_model.paper.loads_by_part import PARTS, PitchingMoments
from vehicle_model.paper.results import AIRSPEEDS, Results
from vehicle_model.paper.style import OURS, PALETTE, PAPER, new_figure, save
from vehicle_model.trim import Trim

__all__ = ["draw_descents", "draw_moments", "draw_power_and_stall", "draw_slipstreams"]


def draw_power_and_stall(results: Results, path: Path) -> Path:
    """Shaft power, and angle left to maximum lift, of the level trims."""
    figure = new_figure(7.0, 2.8)
    left, right = figure.subplots(1, 2)
    power = np.array([trim.power for trim in results.trims]) / 1000.0
    left.plot(AIRSPEEDS, power, color=OURS, marker="o", markersize=2.5)
    left.set_ylim(0, 1.1 * float(power.max()))
    left.set_ylabel("shaft power, all rotors (kW)")
    right.plot(
        AIRSPEEDS,
        np.degrees(results.wetted_margin),
        color=OURS,
        marker="o",
        markersize=2.5,
        label="wing in the slipstream",
    )
    right.plot(
        AIRSPEEDS, np.degrees(results.unwetted_margin), color=PAPER, marker="s", markersize=2.5, label="wing outside it"
    )
    right.axhline(0.0, color="#555555", linewidth=0.8)
    right.set_ylabel("angle left to maximum lift (deg)")
    right.annotate("stalled below", (0.5, 0.0), (0.5, -1.0), fontsize=7, color="#555555", va="top")
    right.legend(loc="lower right")
    for axes in (left, right):
        axes.set_xlabel("airspeed (m/s)")
    return save(figure, path)


def draw_moments(results: Results, path: Path) -> Path:
    """Pitching moment by part: at hover's controls, and along the trims with the elevator at rest."""
    figure = new_figure(7.0, 3.4)
    left, right = figure.subplots(1, 2)
    _moments(left, results.hover_moments)
    _moments(right, results.trim_moments)
    left.set_title("controls left as in hover")
    right.set_title("level trims, elevator and tail propeller at rest")
    left.set_ylabel("pitching moment (N m)")
    figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return save(figure, path)


def _moments(axes: Axes, moments: PitchingMoments) -> None:
    for name, color, values in zip(PARTS, PALETTE, moments.parts, strict=True):
        axes.plot(moments.airspeed, values, color=color, linewidth=1.1, label=name)
    axes.plot(moments.airspeed, moments.total, color="black", linewidth=2.0, label="sum")
    axes.axhline(0.0, color="#999999", linewidth=0.6)
    axes.set_xlabel("airspeed (m/s)")


def draw_descents(results: Results, path: Path) -> Path:
    """Stall margin of the wing in the slipstream, and power, in steady descents through mid tilt."""
    figure = new_figure(7.0, 2.8)
    left, right = figure.subplots(1, 2)
    for descent, color in zip(results.descents, PALETTE, strict=False):
        if len(descent.angle):
            label = f"{descent.airspeed:.1f} m/s (level at {math.degrees(descent.tilt[0]):.0f}° tilt)"
            left.plot(np.degrees(descent.angle), np.degrees(descent.wetted_margin), color=color, label=label)
            right.plot(np.degrees(descent.angle), 100.0 * descent.power, color=color, label=label)
    left.axhline(0.0, color="#555555", linewidth=0.8)
    left.set_ylabel("slipstream wing: angle left\nto maximum lift (deg)")
    right.set_ylabel("shaft power (% of level flight)")
    for axes in (left, right):
        axes.set_xlabel("descent angle (deg)")
    if any(len(descent.angle) for descent in results.descents):
        right.legend(loc="best")
    return save(figure, path)


def draw_slipstreams(results: Results, path: Path) -> Path:
    """Level trims with the vector slipstream and with eqs (9)-(11) to the letter."""
    figure = new_figure(7.0, 2.7)
    literal = np.array([_row(trim) for trim in results.literal]).T
    for axes, name, ours, other in zip(
        figure.subplots(1, 3), ("RPM", "tilt (deg)", "elevator (deg)"), results.curves, literal, strict=True
    ):
        axes.plot(AIRSPEEDS, ours, color=OURS, label="vector sum")
        axes.plot(
            AIRSPEEDS, other, color=PAPER, marker="o", markersize=2.5, linewidth=0.9, label="eqs (9)-(11) literally"
        )
        axes.set_title(name)
        axes.set_xlabel("airspeed (m/s)")
    figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return save(figure, path)


def _row(trim: Trim | None) -> tuple[float, float, float]:
    if trim is None:
        return math.nan, math.nan, math.nan
    return trim.rpm, math.degrees(trim.tilt), math.degrees(trim.elevator)
