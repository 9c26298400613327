"""How the figures look, and how one is saved: the same bytes for the same aircraft, whatever the user's settings."""

from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

import matplotlib.style
from matplotlib.axes import Axes
from matplotlib.figure import Figure

__all__ = ["OURS", "PALETTE", "PAPER", "mark_axis_limits", "new_figure", "paper_style", "save"]

OURS = "#1f4e8c"
PAPER = "#c8501e"
PALETTE = (OURS, "#c8501e", "#3a8f5c", "#8a5fb0", "#b8902a", "#7a7a7a")  # distinct in the usual colour blindness too

_SETTINGS = {
    "font.family": "DejaVu Serif",
    "mathtext.fontset": "dejavuserif",
    "font.size": 8.5,
    "axes.titlesize": 9,
    "axes.labelsize": 8.5,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "grid.color": "#dddddd",
    "grid.linewidth": 0.5,
    "legend.frameon": False,
    "legend.fontsize": 7.5,
    "lines.linewidth": 1.4,
    "xtick.direction": "out",
    "ytick.direction": "out",
}


@contextmanager
def paper_style() -> Generator[None]:
    """Matplotlib's own defaults and ours on top, whatever the user has set."""
    with matplotlib.style.context(["default", _SETTINGS]):
        yield


def new_figure(width: float, height: float) -> Figure:
    """An empty figure [inches] whose parts find their own room."""
    return Figure(figsize=(width, height), layout="constrained")


def save(figure: Figure, path: Path) -> Path:
    """Write a PNG without metadata."""
    figure.savefig(path, dpi=130, format="png", metadata={"Software": None})
    return path


def mark_axis_limits(axes: Axes, limits: tuple[float, float], label: str | None = None) -> None:
    """Draw the ends of an axis of the paper, and let ours reach a little beyond them."""
    for i, limit in enumerate(limits):
        axes.axhline(limit, color=PAPER, linewidth=0.9, linestyle=(0, (4, 3)), label=label if i == 0 else None)
    low, high = axes.get_ylim()
    room = 0.04 * (max(high, limits[1]) - min(low, limits[0]))
    axes.set_ylim(min(low, limits[0] - room), max(high, limits[1] + room))
