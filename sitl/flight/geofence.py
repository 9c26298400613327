"""The geofence: where the vehicle may be. Polygons and circles to stay in or out of, distance and height from home."""

import math
from dataclasses import dataclass

import numpy as np

from sitl.flight.parameters import Parameters
from sitl.flight.places import LocalFrame

__all__ = ["Fence", "FenceCircle", "FencePolygon"]

LARGEST_RADIUS = 1e6  # [m]

Point = tuple[float, float]


@dataclass(frozen=True, slots=True)
class FencePolygon:
    """An area by its corners (latitude, longitude) [deg]: the vehicle stays inside, or outside."""

    points: tuple[Point, ...]
    inclusion: bool


@dataclass(frozen=True, slots=True)
class FenceCircle:
    """An area by its centre [deg] and radius [m]: the vehicle stays inside, or outside."""

    latitude: float
    longitude: float
    radius: float
    inclusion: bool


class Fence:
    """The areas that a ground station has loaded, and the limits GF_MAX_HOR_DIST and GF_MAX_VER_DIST about home.

    The vehicle must be inside at least one of the areas to stay in, if there are any, and outside all others.

    Attributes:
        enabled: False lets the vehicle be anywhere.
    """

    def __init__(self, parameters: Parameters, places: LocalFrame) -> None:
        self._parameters, self._places = parameters, places
        self.enabled = True
        self.load()

    def load(self, polygons: tuple[FencePolygon, ...] = (), circles: tuple[FenceCircle, ...] = ()) -> None:
        """Replace all areas.

        Raises ValueError, and keeps the old ones, for places off the map, a polygon of less than three corners or one
        that crosses itself, and for radii that are not positive.
        """
        for number, polygon in enumerate(polygons):
            _check_polygon(f"polygon {number}", polygon)
        for number, circle in enumerate(circles):
            _check_point(f"circle {number}", (circle.latitude, circle.longitude))
            if not 0.0 < circle.radius <= LARGEST_RADIUS:
                msg = f"circle {number}: radius: expected more than 0 m and at most 1000 km, got {circle.radius:g} m"
                raise ValueError(msg)
        self.polygons, self.circles = polygons, circles
        self._polygons = [(self._corners(polygon), polygon.inclusion) for polygon in polygons]
        self._circles = [
            (*self._places.to_ned(circle.latitude, circle.longitude, self._places.altitude)[:2], circle.radius,
             circle.inclusion)
            for circle in circles
        ]  # fmt: skip
        self._included = any(area.inclusion for area in (*polygons, *circles))

    def _corners(self, polygon: FencePolygon) -> list[Point]:
        return [self._places.to_ned(*point, self._places.altitude)[:2] for point in polygon.points]

    def breach(self, north: float, east: float, down: float) -> str | None:
        """What does not allow a place at a height [m], or None; some microseconds: call it at a few hertz."""
        return self.breach_above(down) or self.breach_at(north, east)

    def breach_above(self, down: float) -> str | None:
        """What does not allow a height [m, NED down], or None."""
        highest = self._parameters["GF_MAX_VER_DIST"] if self.enabled else 0.0
        height = self._places.home.down - down
        if 0.0 < highest < height:
            return f"{height:.0f} m above home, {highest:.0f} m allowed"
        return None

    def breach_at(self, north: float, east: float) -> str | None:
        """What does not allow a place [m] at any height, or None: the areas, or the largest distance from home."""
        if not self.enabled:
            return None
        farthest = self._parameters["GF_MAX_HOR_DIST"]
        if farthest > 0.0:
            distance = math.hypot(north - self._places.home.north, east - self._places.home.east)
            if distance > farthest:
                return f"{distance:.0f} m from home, {farthest:.0f} m allowed"
        included = not self._included
        for number, (centre_north, centre_east, radius, inclusion) in enumerate(self._circles):
            if (north - centre_north) ** 2 + (east - centre_east) ** 2 <= radius * radius:
                if not inclusion:
                    return f"inside circle {number} to stay out of"
                included = True
        for number, (corners, inclusion) in enumerate(self._polygons):
            if _inside(corners, north, east):
                if not inclusion:
                    return f"inside polygon {number} to stay out of"
                included = True
        return None if included else "outside every area to stay in"


def _inside(corners: list[Point], north: float, east: float) -> bool:
    """Whether a ray to the east crosses an odd number of sides."""
    inside = False
    last_north, last_east = corners[-1]
    for corner_north, corner_east in corners:
        if (corner_north > north) != (last_north > north):
            share = (north - corner_north) / (last_north - corner_north)
            if east < corner_east + share * (last_east - corner_east):
                inside = not inside
        last_north, last_east = corner_north, corner_east
    return inside


def _check_point(what: str, point: Point) -> None:
    latitude, longitude = point
    if not (abs(latitude) <= 90.0 and abs(longitude) <= 180.0):
        msg = (
            f"{what}: expected a latitude within +-90 deg and a longitude within +-180 deg, got {latitude}, {longitude}"
        )
        raise ValueError(msg)


def _check_polygon(what: str, polygon: FencePolygon) -> None:
    points = polygon.points
    if len(points) < 3:
        msg = f"{what}: expected at least 3 corners, got {len(points)}"
        raise ValueError(msg)
    for point in points:
        _check_point(what, point)
    crossing = _first_crossing(np.array(points))
    if crossing is not None:
        msg = f"{what}: expected sides that do not cross, got sides {crossing[0]} and {crossing[1]} crossing"
        raise ValueError(msg)


def _first_crossing(corners: np.ndarray) -> tuple[int, int] | None:
    """Two sides of a polygon with corners (n, 2) that have a point in common but are no neighbours, None without.

    Sides are numbered by the corners at which they begin.
    """
    count = len(corners)
    ends = np.roll(corners, -1, axis=0)
    lowest, highest = np.minimum(corners, ends), np.maximum(corners, ends)
    for side in range(count - 2):
        others = slice(side + 2, count - 1 if side == 0 else count)
        near = ((lowest[others] <= highest[side]) & (highest[others] >= lowest[side])).all(axis=1)
        candidates = np.flatnonzero(near) + side + 2
        if candidates.size:
            crossing = _cross(corners[side], ends[side], corners[candidates], ends[candidates])
            if crossing.any():
                return side, int(candidates[crossing.argmax()])
    return None


def _cross(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Whether the segment from a to b (2) and those from c to d (n, 2) have a point in common, for each of these."""

    def side(p: np.ndarray, q: np.ndarray, r: np.ndarray) -> np.ndarray:
        p, q, r = p.T, q.T, r.T
        return (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])

    def between(p: np.ndarray, q: np.ndarray, r: np.ndarray) -> np.ndarray:
        return np.all((np.minimum(p, q) <= r) & (r <= np.maximum(p, q)), axis=-1)

    sides = side(a, b, c), side(a, b, d), side(c, d, a), side(c, d, b)
    through = (sides[0] * sides[1] < 0.0) & (sides[2] * sides[3] < 0.0)
    ends = ((sides[0], a, b, c), (sides[1], a, b, d), (sides[2], c, d, a), (sides[3], c, d, b))
    touching = [(value == 0.0) & between(p, q, r) for value, p, q, r in ends]
    return np.any([through, *touching], axis=0)
