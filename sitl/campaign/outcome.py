"""How a case of a campaign ended: the flight's summary, and whether and why it counts as lost."""

import math
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from operator import itemgetter
from typing import Any

import numpy as np

from sitl.campaign.cases import Case
from sitl.flight_summary import FlightSummary, airborne

__all__ = ["Outcome", "as_table", "losses"]

MOST_BANK = math.radians(90.0)
# Beyond these the end of a flight is a crash, wherever it happens.
LANDING_SINK = 2.0  # [m/s]
LANDING_LEAN = math.radians(30.0)  # of the fuselage against the vertical
LANDING_RANGE = 10.0  # from the landing point [m]
FENCE_STRIDE = 10  # rows between looks at the fence: 0.2 s, or 8 m in the fastest flight


@dataclass(frozen=True)
class Outcome:
    """One case flown."""

    case: Case
    lost: tuple[str, ...]  # each reason in words with its time; none: flew the mission and landed
    end: float  # of the flight, simulated [s]
    summary: FlightSummary


def losses(
    rows: np.ndarray,
    *,
    landing_item: int,
    landing_point: tuple[float, float],
    inside: Callable[[float, float, float], bool],
    finished: bool,
) -> tuple[str, ...]:
    """Why the flight of this history (n,) counts as lost, in the order in which it was.

    Args:
        rows: history of `sitl.history.ROW`.
        landing_item: index of the mission's item that lands; contact before it is a crash.
        landing_point: north and east of home [m].
        inside: whether a place (north, east, down from home [m]) is inside the geofence.
        finished: the mission was flown to its end and the vehicle disarmed itself.
    """
    found = sorted(_found(rows, landing_item, landing_point, inside), key=itemgetter(0))
    reasons = tuple(f"{reason} at t = {time:.1f} s" for time, reason in found)
    return reasons if finished else (*reasons, "mission not finished")


def _found(
    rows: np.ndarray,
    landing_item: int,
    landing_point: tuple[float, float],
    inside: Callable[[float, float, float], bool],
) -> Iterator[tuple[float, str]]:
    """Time and kind of each first loss."""
    span = airborne(rows)
    flight = rows[span]
    over = np.flatnonzero(np.abs(flight["euler"][:, 0]) > MOST_BANK)
    if len(over):
        yield float(flight["time"][over[0]]), "bank beyond 90 deg"
    for row in flight[::FENCE_STRIDE]:
        if not inside(*row["position_ned"].tolist()):
            yield float(row["time"]), "fence left"
            break
    if 0 < span.stop < len(rows):
        before, touch = rows[span.stop - 1], rows[span.stop]
        time = float(touch["time"])
        if touch["mission_item"] < landing_item:
            yield time, f"ground touched in mission item {int(touch['mission_item'])}"
        roll, pitch, _ = touch["euler"].tolist()
        if math.cos(roll) * math.cos(pitch) < math.cos(LANDING_LEAN):
            yield time, f"touched down leaning {math.degrees(math.acos(math.cos(roll) * math.cos(pitch))):.0f} deg"
        if before["velocity_ned"][2] > LANDING_SINK:
            yield time, f"touched down with {before['velocity_ned'][2]:.1f} m/s"
        north, east, _ = touch["position_ned"].tolist()
        away = math.hypot(north - landing_point[0], east - landing_point[1])
        if away > LANDING_RANGE:
            yield time, f"touched down {away:.0f} m from the landing point"


def as_table(outcome: Outcome) -> dict[str, Any]:
    """The outcome as JSON takes it: SI and radians, null for what never was."""
    table = asdict(outcome)
    table["summary"] = {name: None if math.isnan(value) else value for name, value in table["summary"].items()}
    return table
