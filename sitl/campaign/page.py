"""What came of a campaign, for people: the flights lost, the worst flights, how all of them spread."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from sitl.campaign.cases import AERODYNAMICS, Case, Scatter
from sitl.campaign.outcome import Outcome
from sitl.flight_summary import FlightSummary

__all__ = ["COLUMNS", "Column", "lost_table", "markdown", "short_table", "spread_table", "worst_table"]

Table = tuple[tuple[str, ...], list[tuple[str, ...]]]  # head and rows


@dataclass(frozen=True)
class Column:
    """One number of a flight as the tables show it; worse is greater where `factor` is positive."""

    title: str
    worst: str  # what the flight with the worst of it is called
    value: Callable[[FlightSummary], float]
    factor: float = 1.0  # into the unit of the title; negative: the smallest is the worst
    digits: int = 2

    def text(self, value: float) -> str:
        """The value [SI] in the column's unit."""
        return "–" if math.isnan(value) else f"{abs(self.factor) * value:.{self.digits}f}"


_DEGREES = math.degrees(1.0)
COLUMNS = (
    Column("cross-track [m]", "widest off its track", lambda s: s.cross_track),
    Column("altitude [m]", "farthest off its height", lambda s: s.altitude_error),
    Column("bank [°]", "steepest bank", lambda s: s.bank, _DEGREES, 1),
    Column("margin, slipstream [°]", "nearest to stall, in the slipstream", lambda s: s.margin_wetted, -_DEGREES, 1),
    Column("margin, outer wing [°]", "nearest to stall, outer wing", lambda s: s.margin_outer, -_DEGREES, 1),
    Column("touch-down [m/s]", "hardest touch-down", lambda s: s.touchdown_speed),
    Column("from the point [m]", "farthest from the point", lambda s: s.touchdown_distance),
    Column("battery [%]", "most from the battery", lambda s: s.battery_used, 100.0, 1),
    Column("time [s]", "longest", lambda s: s.duration, 1.0, 0),
)


def worst_table(outcomes: Sequence[Outcome]) -> Table:
    """For each number the flight where it is worst, of those that were not lost; that number marked with stars."""
    rows = []
    flown = [outcome for outcome in outcomes if not outcome.lost]
    for column in COLUMNS:
        measured = [outcome for outcome in flown if not math.isnan(column.value(outcome.summary))]
        if measured:
            worst = max(measured, key=lambda outcome: column.factor * column.value(outcome.summary))
            cells = [other.text(other.value(worst.summary)) for other in COLUMNS]
            cells[COLUMNS.index(column)] = f"**{cells[COLUMNS.index(column)]}**"
            rows.append((column.worst, *_who(worst.case), *cells))
    return ("", "case", "wind", "mass", *(column.title for column in COLUMNS)), rows


def spread_table(outcomes: Sequence[Outcome]) -> Table:
    """Median, 95 % (as many are better) and worst of each number, of the flights that were not lost."""
    rows = []
    flown = [outcome for outcome in outcomes if not outcome.lost]
    for title, share in (("median", 0.5), ("95 %", 0.95), ("worst", 1.0)):
        cells = []
        for column in COLUMNS:
            values = np.array([column.value(outcome.summary) for outcome in flown])
            values = np.sort(math.copysign(1.0, column.factor) * values[~np.isnan(values)])
            chosen = float(np.quantile(values, share)) if len(values) else math.nan
            cells.append(column.text(math.copysign(1.0, column.factor) * chosen))
        rows.append((title, *cells))
    return ("", *(column.title for column in COLUMNS)), rows


def short_table(outcomes: Sequence[Outcome]) -> Table:
    """Both in one, narrow enough for a terminal: each number's spread, and whose the worst is."""
    _, spread = spread_table(outcomes)
    _, worst = worst_table(outcomes)
    whose = {row[0]: row[1:4] for row in worst}
    rows = [
        (column.title, *(row[1 + number] for row in spread), *whose.get(column.worst, ("", "", "")))
        for number, column in enumerate(COLUMNS)
    ]
    return ("", *(row[0] for row in spread), "case", "wind", "mass"), rows


def lost_table(outcomes: Sequence[Outcome]) -> Table:
    """The flights that were lost, and why."""
    rows = [(*_who(outcome.case), "; ".join(outcome.lost)) for outcome in outcomes if outcome.lost]
    return ("case", "wind", "mass", "why"), rows


def markdown(outcomes: Sequence[Outcome], *, seed: int, scatter: Scatter, mission: str, aircraft: str) -> str:
    """The page: what was flown, what was lost, the worst, the spread."""
    lost = lost_table(outcomes)
    flown = (
        f"{len(outcomes)} flights of {mission} by {aircraft}, seed {seed}: **{len(lost[1])} lost**. Lost is a flight "
        "that touches the ground before its landing, banks beyond 90°, leaves the geofence, does not finish its "
        "mission, diverges, or comes down as no landing does (faster than 2 m/s, leaning more than 30°, more than 10 m "
        "from the point)."
    )
    varied = (
        f"Each flight has a steady wind of up to {scatter.wind:g} m/s from any direction, any heading at the start, a "
        f"mass within ±{100.0 * scatter.mass:g} % (moments of inertia with it), a centre of mass within "
        f"±{100.0 * scatter.centre_of_mass:g} cm along each axis, and each of {len(AERODYNAMICS)} aerodynamic "
        f"coefficients within ±{100.0 * scatter.aerodynamics:g} %, all drawn evenly and independently. The laws "
        "of control are those designed for the aircraft as its file has it."
    )
    meaning = (
        "Cross-track is the distance from a leg 10 s and more after it began and once it was joined within 0.5 m; "
        "altitude, that from the height asked for once it was reached within 0.1 m; margins are angles left to maximum "
        "lift in flight, outside the slipstream above 15 m/s airspeed. In the row of 95 % as many flights are better. "
        "`campaign.json` beside this page has every flight; "
        f"`python -m sitl.campaign --seed {seed} --only CASE` flies one again and draws its report."
    )
    names = f"Coefficients: {', '.join(f'`{path}`' for path in AERODYNAMICS)}."
    parts = ["# Campaign", flown, varied, names]
    if lost[1]:
        parts += ["## Lost", _markdown(lost)]
    parts += ["## Worst flights", _markdown(worst_table(outcomes))]
    parts += ["## All flights that were not lost", _markdown(spread_table(outcomes)), meaning]
    return "\n\n".join(parts) + "\n"


def _who(case: Case) -> tuple[str, str, str]:
    """Number, wind (speed and where from) and mass of a case."""
    north, east, _ = case.wind_ned
    source = math.degrees(math.atan2(-east, -north)) % 360.0
    return str(case.number), f"{math.hypot(north, east):.1f} m/s {source:03.0f}°", f"{100.0 * (case.mass - 1.0):+.0f} %"


def _markdown(table: Table) -> str:
    head, rows = table
    lines = [head, tuple("---" for _ in head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)
