"""The elevator step as a figure: the paper's four quantities (Figs 11-12), flown over computed, deviations below."""

from pathlib import Path
from typing import Any

import numpy as np

from gcs_scripts.step_response import Reference, Response

__all__ = ["draw"]

PANELS = (("u", "u [m/s]"), ("w", "w [m/s]"), ("q", "q [deg/s]"), ("theta", "θ [deg]"))
MODEL, FLOWN = "#b8bec8", "#c2410c"


def draw(path: Path, flown: Response, reference: Reference, how: str) -> None:
    """Write the figure in the format of the path's ending; `how` says how it was flown."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 6.4), layout="constrained")
    FigureCanvasAgg(figure)  # draws without a display
    halves: Any = figure.subfigures(2, 1, height_ratios=(2.0, 1.0))
    upper: Any = halves[0].subplots(2, 2, sharex=True)
    lower: Any = halves[1].subplots(1, 4, sharex=True)
    for (name, label), axes, below in zip(PANELS, upper.flat, lower.flat, strict=True):
        computed = getattr(reference, name)
        axes.plot(reference.time, computed, color=MODEL, linewidth=4.0, label="model")
        axes.plot(flown.time, getattr(flown, name), color=FLOWN, linewidth=0.9, label=f"flown over MAVLink, {how}")
        axes.set_ylabel(label)
        deviation = getattr(flown, name) - np.interp(flown.time, reference.time, computed)
        below.plot(flown.time, deviation, color=FLOWN, linewidth=0.5)
        below.set_title(f"flown - model, {label}", fontsize="small")
        below.ticklabel_format(axis="y", scilimits=(-2, 3))
        below.tick_params(labelsize="small")
        below.set_xlabel("time [s]", fontsize="small")
        for each in (axes, below):
            each.grid(visible=True, alpha=0.3)
            each.set_xlim(reference.time[0], reference.time[-1])
    for axes in upper[1]:
        axes.set_xlabel("time [s]")
    upper[0, 0].legend(loc="best", fontsize="small", frameon=False)
    figure.savefig(path, dpi=80)
