"""Places in commands: latitude, longitude and altitude of the fifth to seventh parameter, in the frame that is named.

https://mavlink.io/en/services/command.html: a COMMAND_LONG has global coordinates above mean sea level, a COMMAND_INT
names its frame. What is not given is NaN.
"""

import math
from typing import NamedTuple

from sitl.flight.flight import Flight
from sitl.flight.mission_items import Frame
from sitl.mavlink.command import Command
from sitl.mavlink.local_origin import LocalOrigin

__all__ = ["FrameError", "MapPlace", "altitude_above_sea", "place_in"]


class FrameError(ValueError):
    """A command in a frame that it cannot be given in."""


class MapPlace(NamedTuple):
    """Latitude, longitude [deg] and altitude above mean sea level [m]; NaN where not given."""

    latitude: float
    longitude: float
    altitude: float

    @property
    def is_here(self) -> bool:
        """No place on the map is named: wherever the vehicle is."""
        return math.isnan(self.latitude) or math.isnan(self.longitude)


def place_in(command: Command, flight: Flight, origin: LocalOrigin) -> MapPlace:
    """The place of a command; zeros are none on the map, as most ground stations send it.

    Local coordinates count from `origin`. Raises FrameError.
    """
    x, y, z = command.params[4:7]
    frame = _frame(command)
    if frame == Frame.LOCAL_NED:
        north, east, down = origin.meant(x, y, z)
        if math.isnan(x) or math.isnan(y):
            return MapPlace(math.nan, math.nan, flight.places.altitude - down)
        return MapPlace(*flight.places.to_geodetic(north, east, flight.view.down if math.isnan(z) else down))
    altitude = altitude_above_sea(z, frame, flight)
    if x == 0.0 and y == 0.0:
        return MapPlace(math.nan, math.nan, math.nan if z == 0.0 else altitude)
    return MapPlace(x, y, altitude)


def altitude_above_sea(altitude: float, frame: int, flight: Flight) -> float:
    """An altitude [m] of a global frame, above mean sea level. Raises FrameError for another frame."""
    try:
        known = Frame(frame)
    except ValueError:
        known = None
    if known is not None and known.above_sea:
        return altitude
    if known is not None and known.above_home:  # the ground is flat and as high as home
        return flight.home.altitude + altitude
    msg = f"frame: expected a global one, got {frame}"
    raise FrameError(msg)


def _frame(command: Command) -> int:
    return Frame.GLOBAL if command.frame is None else command.frame
