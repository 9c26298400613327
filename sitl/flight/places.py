"""Where things are: between latitude, longitude and altitude of maps and the local frame that the flight works in."""

import math

import numpy as np

from vehicle_model.earth import geodetic, height_above_ellipsoid, ned_from_geodetic

__all__ = ["Home", "LocalFrame", "Ned"]

Ned = tuple[float, float, float]

STRAIGHT_DOWN = 2  # corrections of a height on a curved Earth: the first already leaves less than a millimetre


class LocalFrame:
    """North, east and down [m] about the origin of an ENVIRONMENT record, and the home that lives in it.

    North and east are those of the plane tangent at the origin. Down is how much lower a place is than the origin, by
    its geodetic height, so that level flight keeps its down on a curved Earth too. Mean sea level and the ellipsoid
    are one surface here.
    """

    def __init__(self, environment: np.ndarray) -> None:
        self._origin = environment[0]
        self.altitude = float(self._origin["height_ellipsoid"])  # of the origin, above mean sea level [m]
        self.home = Home(self)

    def to_ned(self, latitude_deg: float, longitude_deg: float, altitude_msl: float) -> Ned:
        """North, east, down [m] of a place on the map [deg, deg, m]."""
        latitude, longitude = math.radians(latitude_deg), math.radians(longitude_deg)
        north, east, _ = ned_from_geodetic(latitude, longitude, altitude_msl, self._origin)
        return north, east, self.altitude - altitude_msl

    def to_geodetic(self, north: float, east: float, down: float) -> tuple[float, float, float]:
        """Latitude and longitude [deg] and altitude above mean sea level [m] of a place in the frame [m]."""
        wanted = self.altitude - down
        below_plane = down
        for _ in range(STRAIGHT_DOWN):
            below_plane += height_above_ellipsoid(north, east, below_plane, self._origin) - wanted
        latitude, longitude, _ = geodetic(north, east, below_plane, self._origin)
        return math.degrees(latitude), math.degrees(longitude), wanted


class Home:
    """Where relative altitudes count from and where Return leads to. It begins at the frame's origin and may move.

    `north`, `east`, `down` are those of the frame [m]; the frame itself stays where it is when home moves.
    """

    def __init__(self, frame: LocalFrame) -> None:
        self._frame = frame
        self.north = self.east = self.down = 0.0

    def move(self, north: float, east: float, down: float) -> None:
        """Home is here from now on [m]."""
        self.north, self.east, self.down = north, east, down

    def move_to(self, latitude_deg: float, longitude_deg: float, altitude_msl: float) -> None:
        """Home is at this place of the map from now on [deg, deg, m]."""
        self.move(*self._frame.to_ned(latitude_deg, longitude_deg, altitude_msl))

    @property
    def altitude(self) -> float:
        """Above mean sea level [m]."""
        return self._frame.altitude - self.down

    @property
    def geodetic(self) -> tuple[float, float, float]:
        """Latitude and longitude [deg], altitude above mean sea level [m]."""
        return self._frame.to_geodetic(self.north, self.east, self.down)
