"""Where the local frame of MAVLink's messages begins: at the home of the start, or where a ground station puts it.

The flight works in a frame of its own that never moves (`sitl.flight.places`). Messages with local coordinates count
from this origin instead, which is a point of that frame: so it can be put elsewhere, and nothing in flight changes.
"""

import math

from sitl.flight.places import LocalFrame
from sitl.home import Home

__all__ = ["LocalOrigin"]

Ned = tuple[float, float, float]

# Farther off single precision leaves of local coordinates no more than decimetres [m].
FARTHEST = 1e6


class LocalOrigin:
    """The origin of LOCAL_POSITION_NED and its like.

    Attributes:
        north, east, down: of the origin in the flight's frame [m].
        geodetic: latitude and longitude [degE7] and altitude above mean sea level [mm], exactly as they were given.
        moves: how often it has been put elsewhere.
    """

    def __init__(self, home: Home) -> None:
        """Begin at the home of the start."""
        self._home = home
        self.moves = 0
        self.restarted()

    def restarted(self) -> None:
        """The vehicle has begun anew, and so has its frame."""
        home = self._home
        self.north = self.east = self.down = 0.0
        self.geodetic = (round(home.latitude * 1e7), round(home.longitude * 1e7), round(home.altitude * 1e3))

    def put(self, latitude: int, longitude: int, altitude: int, places: LocalFrame) -> None:
        """Let local coordinates count from here [degE7, mm] on.

        Raises ValueError, and then changes nothing, for a place that is none, or too far away.
        """
        degrees_north, degrees_east = latitude * 1e-7, longitude * 1e-7
        if not (abs(degrees_north) <= 90.0 and abs(degrees_east) <= 180.0):
            msg = f"origin: expected latitude and longitude [deg], got {degrees_north:g}, {degrees_east:g}"
            raise ValueError(msg)
        north, east, down = places.to_ned(degrees_north, degrees_east, altitude * 1e-3)
        if not math.hypot(north, east, down) <= FARTHEST:
            distance = math.hypot(north, east, down)
            msg = f"origin: expected one within {FARTHEST / 1e3:g} km of the start, got {distance / 1e3:.0f} km"
            raise ValueError(msg)
        if (latitude, longitude, altitude) != self.geodetic:
            self.moves += 1
        self.north, self.east, self.down = north, east, down
        self.geodetic = (latitude, longitude, altitude)

    def seen(self, north: float, east: float, down: float) -> Ned:
        """A place of the flight's frame, counted from here [m]."""
        return north - self.north, east - self.east, down - self.down

    def meant(self, x: float, y: float, z: float) -> Ned:
        """The place in the flight's frame of one that is counted from here [m]."""
        return x + self.north, y + self.east, z + self.down
