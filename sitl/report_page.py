"""What the report on a mission says beside the history: words, its route and fences, and where it is to land."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sitl.flight.mission_items import PLACED, Command, place_of

if TYPE_CHECKING:
    from sitl.flight.flight import Flight

__all__ = ["Landing", "Page", "landing_of", "mission_page"]

LANDINGS = (Command.LAND, Command.VTOL_LAND)
CIRCLE_CORNERS = 72


@dataclass(frozen=True)
class Page:
    """What the page says beside the history: words, and what to draw on the map as (north, east) of home [m]."""

    title: str
    lines: Sequence[str] = ()  # below the title: aircraft, wind, seed
    route: Sequence[tuple[float, float]] = ()  # the mission's items in their order
    fences: Sequence[np.ndarray] = field(default_factory=tuple)  # outlines, each (k, 2)
    landing_point: tuple[float, float] = (0.0, 0.0)


class Landing(NamedTuple):
    """The mission's last landing: number of its item, north and east of home [m]."""

    item: int
    point: tuple[float, float]


def landing_of(flight: "Flight") -> Landing:
    """Where the loaded mission lands. Raises ValueError for one that does not."""
    for number, item in reversed(list(enumerate(flight.mission.items))):
        if item.command in LANDINGS:
            north, east, _ = place_of(item, flight.places, (flight.home.north, flight.home.east, flight.home.down))
            return Landing(number, (north, east))
    msg = "mission: expected one that lands, got none of the items LAND and VTOL_LAND"
    raise ValueError(msg)


def mission_page(flight: "Flight", title: str, lines: Sequence[str]) -> Page:
    """Page about the loaded mission, with its route and the fences that are in force."""
    here = flight.home.north, flight.home.east, flight.home.down
    placed = [item for item in flight.mission.items if item.command in PLACED and not item.here]
    return Page(
        title=title,
        lines=lines,
        route=tuple(place_of(item, flight.places, here)[:2] for item in placed),
        fences=tuple(_fences(flight)),
        landing_point=landing_of(flight).point,
    )


def _fences(flight: "Flight") -> list[np.ndarray]:
    """Outlines (k, 2) of areas and of the greatest distance from home."""
    places, sea = flight.places, flight.places.altitude
    outlines = [
        np.array([places.to_ned(*corner, sea)[:2] for corner in polygon.points]) for polygon in flight.fence.polygons
    ]
    circles = [
        (*places.to_ned(circle.latitude, circle.longitude, sea)[:2], circle.radius) for circle in flight.fence.circles
    ]
    farthest = flight.parameters["GF_MAX_HOR_DIST"]
    if farthest > 0.0:
        circles.append((flight.home.north, flight.home.east, farthest))
    around = np.linspace(0.0, 2.0 * math.pi, CIRCLE_CORNERS, endpoint=False)
    turn = np.column_stack([np.cos(around), np.sin(around)])
    return outlines + [np.array([north, east]) + radius * turn for north, east, radius in circles]
