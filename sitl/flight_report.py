"""One page about one flight: map, height, speeds, tilt, power and stall margin over time, as a PNG."""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import matplotlib.style
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from sitl.control.records import Level, Vertical
from sitl.flight.mode import Mode
from sitl.flight.regime import Regime
from sitl.flight_summary import FlightSummary, summarise
from sitl.report_page import Page

__all__ = ["flight_report"]

A4 = (8.27, 11.69)  # [inches]
DPI = 150
MANY_POINTS = 4000  # more than the page has pixels
OUTER_AIRSPEED = 8.0  # [m/s] below which the outer wing's angle of attack says nothing

INK, FAINT, GRID = "#222222", "#8a8a8a", "#e2e2e2"
BLUE, ORANGE, GREEN, PURPLE, RED = "#1f4e8c", "#c8501e", "#3a8f5c", "#8a5fb0", "#b3261e"
REGIME_COLOURS = {Regime.HOVER: ORANGE, Regime.TO_CRUISE: PURPLE, Regime.CRUISE: BLUE, Regime.TO_HOVER: GREEN}
REGIME_NAMES = {
    Regime.HOVER: "hover", Regime.TO_CRUISE: "to cruise", Regime.CRUISE: "cruise", Regime.TO_HOVER: "to hover"
}  # fmt: skip
MODE_COLOURS = (
    "#6b6b6b", "#8c8c8c", "#a9a9a9", "#5f8aa8", "#c9a227", "#d9822b", "#9c6b30", "#a83f5f", "#2f6f8f", "#5b8f3a",
    "#7a5195", "#b3261e",
)  # fmt: skip
STYLE = {
    "font.family": "DejaVu Sans",
    "font.size": 8,
    "axes.labelsize": 8,
    "axes.edgecolor": FAINT,
    "axes.linewidth": 0.6,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": GRID,
    "grid.linewidth": 0.6,
    "xtick.color": INK,
    "ytick.color": INK,
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "legend.fontsize": 7,
    "legend.frameon": False,
    "lines.linewidth": 1.2,
}


def flight_report(rows: np.ndarray, page: Page, path: Path) -> Path:
    """Draw the page of a history (n,) of `sitl.history.ROW` and write it as PNG, A4 at 150 dpi.

    Raises ValueError for fewer than two rows.
    """
    if len(rows) < 2:
        msg = f"history: expected at least 2 rows to draw, got {len(rows)}"
        raise ValueError(msg)
    summary = summarise(rows, page.landing_point)
    some = rows[:: max(1, len(rows) // MANY_POINTS)]
    with matplotlib.style.context(["default", STYLE]):
        figure = Figure(figsize=A4)
        grid = figure.add_gridspec(
            8, 1, left=0.085, right=0.925, top=0.9, bottom=0.04, hspace=0.22,
            height_ratios=[3.5, 0.28, 0.42, 1.0, 1.0, 1.0, 1.0, 1.0],
        )  # fmt: skip
        _head(figure, page)
        upper = grid[0].subgridspec(1, 2, width_ratios=[1.75, 1.0], wspace=0.06)
        _map(figure.add_subplot(upper[0]), some, page)
        _numbers(figure.add_subplot(upper[1]), summary)
        band = figure.add_subplot(grid[2])
        _bands(band, rows)
        panels = [figure.add_subplot(grid[number], sharex=band) for number in range(3, 8)]
        for draw, axes in zip((_height, _speeds, _tilt, _power, _margins), panels, strict=True):
            draw(axes, some)
            _tint(axes, rows)
            axes.yaxis.set_major_locator(MaxNLocator(5))
            axes.tick_params(labelbottom=axes is panels[-1])
        band.set_xlim(float(rows["time"][0]), float(rows["time"][-1]))
        panels[-1].set_xlabel("time [s]", labelpad=1)
        figure.align_ylabels(panels)
        figure.savefig(path, dpi=DPI, format="png", metadata={"Software": None})
    return path


def _head(figure: Figure, page: Page) -> None:
    figure.text(0.085, 0.968, page.title, fontsize=15, fontweight="bold", color=INK, va="center")
    figure.text(0.085, 0.951, "\n".join(page.lines), fontsize=8, color="#555555", va="top", linespacing=1.45)


def _map(axes: Axes, rows: np.ndarray, page: Page) -> None:
    """North up, both axes in metres from home; the track in the colours of the regimes."""
    for number, outline in enumerate(page.fences):
        closed = np.vstack([outline, outline[:1]])
        axes.plot(closed[:, 1], closed[:, 0], color=RED, linewidth=0.9, linestyle=(0, (6, 3)),
                  label="geofence" if number == 0 else None)  # fmt: skip
    if len(page.route):
        north, east = np.array(page.route).T
        axes.plot(east, north, color=FAINT, linewidth=0.8, linestyle=(0, (3, 2)), marker="o", markersize=3.5,
                  markerfacecolor="white", label="mission")  # fmt: skip
    for first, last, regime in _runs(rows["regime"]):
        part = rows["position_ned"][first : last + 1]
        axes.plot(part[:, 1], part[:, 0], color=REGIME_COLOURS[Regime(regime)], linewidth=1.7, zorder=3)
    axes.plot(0.0, 0.0, marker="*", markersize=10, color=INK, linestyle="none", label="home", zorder=4)
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.06)
    axes.set_xlabel("east [m]", labelpad=1)
    axes.set_ylabel("north [m]", labelpad=1)
    handles, _ = axes.get_legend_handles_labels()
    flown = [Regime(int(regime)) for regime in np.unique(rows["regime"])]
    handles += [Line2D([], [], color=REGIME_COLOURS[regime], label=REGIME_NAMES[regime]) for regime in flown]
    axes.legend(handles=handles, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=len(handles),
                columnspacing=0.9, handlelength=1.4, handletextpad=0.5, borderaxespad=0.2, borderpad=0.0)  # fmt: skip
    _wind_arrow(axes, rows)


def _wind_arrow(axes: Axes, rows: np.ndarray) -> None:
    """Mean wind in a corner, pointing where it blows to."""
    north, east = (float(rows["wind_ned"][:, axis].mean()) for axis in (0, 1))
    speed = math.hypot(north, east)
    inset: Any = axes.inset_axes((0.865, 0.815, 0.125, 0.175))
    inset.set_xlim(-1.25, 1.25)
    inset.set_ylim(-1.75, 1.25)
    inset.set_aspect("equal")
    inset.set_xticks([])
    inset.set_yticks([])
    inset.patch.set_alpha(0.85)
    for spine in inset.spines.values():
        spine.set_visible(False)
    if speed > 0.05:
        tip = np.array([east, north]) / speed
        arrow = {"arrowstyle": "-|>", "color": BLUE, "linewidth": 1.4, "shrinkA": 0, "shrinkB": 0}
        inset.annotate("", xy=tip, xytext=-tip, arrowprops=arrow)
        source = math.degrees(math.atan2(-east, -north)) % 360.0
        text = f"{speed:.1f} m/s\nfrom {source:03.0f}°"
    else:
        text = "no wind"
    inset.text(0.0, -1.2, text, fontsize=6.5, ha="center", va="top", color=BLUE)


def _numbers(axes: Axes, summary: FlightSummary) -> None:
    """The summary as a table, rather wide than exact."""
    axes.axis("off")
    minutes, seconds = divmod(round(summary.duration), 60)
    lines = (
        ("Time in the air", f"{minutes}:{seconds:02d} min"),
        ("Distance flown", f"{summary.distance / 1000.0:.2f} km"),
        ("Greatest height", _with_unit(summary.height, "m", 1)),
        ("Greatest airspeed", _with_unit(summary.airspeed, "m/s", 1)),
        ("Greatest bank", _with_unit(math.degrees(summary.bank), "°", 1)),
        ("Off the track, on legs", _with_unit(summary.cross_track, "m", 2)),
        ("Off the height, once reached", _with_unit(summary.altitude_error, "m", 2)),
        ("Least margin to stall, slipstream", _with_unit(math.degrees(summary.margin_wetted), "°", 1)),
        ("and outside it, above 15 m/s", _with_unit(math.degrees(summary.margin_outer), "°", 1)),
        ("Touch-down, sink rate", _with_unit(summary.touchdown_speed, "m/s", 2)),
        ("Touch-down, from the point", _with_unit(summary.touchdown_distance, "m", 2)),
        ("Peak power", _with_unit(summary.peak_power / 1000.0, "kW", 2)),
        ("Energy", _with_unit(summary.energy / 3600.0, "Wh", 1)),
        ("Battery used", _with_unit(100.0 * summary.battery_used, "%", 1)),
    )
    for number, (name, value) in enumerate(lines):
        y = 0.985 - number * (1.0 / len(lines))
        axes.text(0.06, y, name, transform=axes.transAxes, fontsize=7.8, va="top", color="#444444")
        axes.text(1.0, y, value, transform=axes.transAxes, fontsize=8.2, va="top", ha="right", fontweight="bold")
        axes.plot([0.06, 1.0], [y - 0.052, y - 0.052], transform=axes.transAxes, color=GRID, linewidth=0.6)


def _with_unit(value: float, unit: str, digits: int) -> str:
    if math.isnan(value):
        return "–"
    return f"{value:.{digits}f}{'' if unit == '°' else ' '}{unit}"


def _runs(values: np.ndarray) -> Iterator[tuple[int, int, int]]:
    """Each stretch of equal values: its first index, the one after its last (of the last stretch its last), value."""
    edges = [0, *(np.flatnonzero(np.diff(values)) + 1).tolist(), len(values) - 1]
    for first, last in pairwise(edges):
        yield first, last, int(values[first])


def _stretches(rows: np.ndarray, name: str) -> Iterator[tuple[float, float, int]]:
    """Begin, end [s] and value of each stretch in which a field of the history does not change."""
    for first, last, value in _runs(rows[name]):
        yield float(rows["time"][first]), float(rows["time"][last]), value


def _bands(axes: Axes, rows: np.ndarray) -> None:
    """Modes above, regimes below, each with its name where there is room."""
    whole = float(rows["time"][-1] - rows["time"][0])
    modes = [(*run, Mode(run[2]).title, MODE_COLOURS[run[2]]) for run in _stretches(rows, "mode")]
    regimes = [
        (*run, REGIME_NAMES[Regime(run[2])], REGIME_COLOURS[Regime(run[2])]) for run in _stretches(rows, "regime")
    ]
    for bottom, stretches in ((1.05, modes), (0.0, regimes)):
        for begin, end, _, name, colour in stretches:
            axes.broken_barh([(begin, end - begin)], (bottom, 0.95), facecolors=colour, edgecolor="white")
            if end - begin > 0.0105 * len(name) * whole:
                axes.text(0.5 * (begin + end), bottom + 0.45, name, fontsize=6.8, color="white", ha="center",
                          va="center")  # fmt: skip
    axes.set_ylim(0.0, 2.0)
    key = {name: Patch(facecolor=colour, label=name) for _, _, _, name, colour in modes}
    axes.legend(handles=list(key.values()), loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=len(key),
                columnspacing=1.1, handlelength=1.0, handleheight=0.7, borderaxespad=0.3, borderpad=0.0)  # fmt: skip
    axes.set_yticks([0.48, 1.52], ["regime", "mode"])
    axes.tick_params(length=0, labelbottom=False)
    axes.grid(visible=False)
    for spine in axes.spines.values():
        spine.set_visible(False)


def _tint(axes: Axes, rows: np.ndarray) -> None:
    """The regimes behind a panel, faintly."""
    for begin, end, regime in _stretches(rows, "regime"):
        axes.axvspan(begin, end, facecolor=REGIME_COLOURS[Regime(regime)], alpha=0.07, linewidth=0, zorder=0)


def _height(axes: Axes, rows: np.ndarray) -> None:
    asked = (rows["level"] == Level.VELOCITY) & (rows["vertical"] == Vertical.ALTITUDE)
    target = np.where(asked, -rows["target_ned"][:, 2], np.nan)
    axes.plot(rows["time"], target, color=ORANGE, linestyle=(0, (4, 2)), linewidth=1.0, label="asked for")
    axes.plot(rows["time"], -rows["position_ned"][:, 2], color=BLUE, label="flown")
    _finish(axes, "height above\nhome [m]")


def _speeds(axes: Axes, rows: np.ndarray) -> None:
    ground = np.hypot(rows["velocity_ned"][:, 0], rows["velocity_ned"][:, 1])
    axes.plot(rows["time"], ground, color=GREEN, linewidth=1.0, label="over the ground")
    axes.plot(rows["time"], rows["airspeed"], color=BLUE, label="true airspeed")
    axes.set_ylim(bottom=0.0)
    _finish(axes, "speed [m/s]")


def _tilt(axes: Axes, rows: np.ndarray) -> None:
    axes.plot(rows["time"], np.degrees(rows["tilt_command"]), color=ORANGE, linewidth=1.0, linestyle=(0, (4, 2)),
              label="commanded")  # fmt: skip
    axes.plot(rows["time"], np.degrees(rows["tilt"]), color=BLUE, label="tilt")
    _finish(axes, "wing tilt [°]")


def _power(axes: Axes, rows: np.ndarray) -> None:
    """Power as an area, current as a line on an axis of its own."""
    power = rows["power"] / 1000.0
    axes.fill_between(rows["time"], power, color=BLUE, alpha=0.22, linewidth=0)
    axes.plot(rows["time"], power, color=BLUE, linewidth=0.9, label="power")
    axes.set_ylim(min(0.0, 1.1 * float(power.min())), 1.05 * float(power.max()) or 1.0)
    right: Any = axes.twinx()
    right.plot(rows["time"], rows["current"], color=ORANGE, linewidth=0.9, label="current")
    right.set_ylim(axes.get_ylim()[0] * 32.0, axes.get_ylim()[1] * 32.0)  # at 31 V the two would coincide
    right.set_ylabel("current [A]", color=ORANGE)
    right.tick_params(axis="y", colors=ORANGE)
    right.spines["right"].set_visible(True)
    right.grid(visible=False)
    _finish(axes, "electrical\npower [kW]", [*axes.lines, *right.lines])


def _margins(axes: Axes, rows: np.ndarray) -> None:
    """Margins of the wing; of its outer parts only at speeds where they carry."""
    outer = np.where(rows["airspeed"] > OUTER_AIRSPEED, np.degrees(rows["stall_margin_outer"]), np.nan)
    flying = rows["contact"] == 0
    wetted = np.where(flying, np.degrees(rows["stall_margin_wetted"]), np.nan)
    axes.plot(rows["time"], wetted, color=BLUE, label="in the slipstream")
    axes.plot(rows["time"], outer, color=PURPLE, linewidth=1.0, label=f"outside it, above {OUTER_AIRSPEED:g} m/s")
    both = np.concatenate([outer, wetted])
    lowest = float(np.nanmin(both)) if not np.all(np.isnan(both)) else 0.0
    highest = float(np.nanmax(both)) if not np.all(np.isnan(both)) else 1.0
    bottom = max(min(-3.0, lowest - 2.0), -30.0)
    axes.set_ylim(bottom, max(highest, 10.0) * 1.05)
    axes.axhspan(bottom, 0.0, facecolor=RED, alpha=0.12, linewidth=0)
    axes.axhline(0.0, color=RED, linewidth=0.9)
    _finish(axes, "margin to\nstall [°]")


def _finish(axes: Axes, label: str, lines: Sequence[Any] | None = None) -> None:
    axes.set_ylabel(label)
    axes.legend(handles=axes.lines[:2] if lines is None else lines, loc="lower right", bbox_to_anchor=(1.0, 1.0),
                ncols=2, columnspacing=1.2, handlelength=1.8, borderaxespad=0.2, borderpad=0.0)  # fmt: skip
