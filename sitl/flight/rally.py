"""Rally points: other places than home where a Return may end, chosen by ground stations."""

import math
from dataclasses import dataclass

from sitl.flight.places import LocalFrame, Ned

__all__ = ["Rally", "RallyPoint"]


@dataclass(frozen=True, slots=True)
class RallyPoint:
    """A place [deg] and its height [m], above home or above mean sea level.

    The height is kept for ground stations to read back: the ground is flat, as high as home, and Return comes at
    RTL_RETURN_ALT above it.
    """

    latitude: float
    longitude: float
    altitude: float
    above_home: bool = True


class Rally:
    """The rally points that a ground station has loaded."""

    def __init__(self, places: LocalFrame) -> None:
        self._places = places
        self.points: tuple[RallyPoint, ...] = ()

    def load(self, points: tuple[RallyPoint, ...]) -> None:
        """Replace all points; raises ValueError, and keeps the old ones, for a place off the map."""
        for number, point in enumerate(points):
            on_map = abs(point.latitude) <= 90.0 and abs(point.longitude) <= 180.0
            if not (on_map and math.isfinite(point.altitude)):
                msg = (
                    f"rally point {number}: expected a latitude within +-90 deg, a longitude within +-180 deg and an "
                    f"altitude, got {point.latitude}, {point.longitude}, {point.altitude}"
                )
                raise ValueError(msg)
        self.points = points

    def nearest(self, north: float, east: float) -> Ned:
        """Home or the rally point, whichever is nearest to a place [m]; its down is that of the ground there."""
        home = self._places.home
        best: Ned = (home.north, home.east, home.down)
        nearest = math.hypot(home.north - north, home.east - east)
        for point in self.points:
            place = self._places.to_ned(point.latitude, point.longitude, home.altitude)
            distance = math.hypot(place[0] - north, place[1] - east)
            if distance < nearest:
                best, nearest = place, distance
        return best
