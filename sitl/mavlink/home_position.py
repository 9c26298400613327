"""Places on the map that others count from: HOME_POSITION and GPS_GLOBAL_ORIGIN.

https://mavlink.io/en/services/home.html and the guide's words on GPS_GLOBAL_ORIGIN there.
"""

import math
from typing import Any

from sitl.mavlink.context import Context, boot_us
from sitl.snapshot import Snapshot

__all__ = ["gps_global_origin", "home_position"]

NO_APPROACH = (math.nan, math.nan, math.nan)


def home_position(snapshot: Snapshot, context: Context) -> tuple[Any, ...]:
    """HOME_POSITION: degE7, mm above mean sea level, local NED [m]; level ground and the heading of the start.

    With the autopilot off home is where the local frame begins.
    """
    flight = context.flight
    origin = context.simulation.scenario.home
    latitude, longitude, altitude = origin.latitude, origin.longitude, origin.altitude
    north = east = down = 0.0
    if flight is not None:
        home = flight.home
        north, east, down = home.north, home.east, home.down
        if north or east or down:
            latitude, longitude, altitude = home.geodetic
    half = 0.5 * math.radians(origin.heading)
    return (
        round(latitude * 1e7),
        round(longitude * 1e7),
        round(altitude * 1e3),
        *(north, east, down),
        *(math.cos(half), 0.0, 0.0, math.sin(half)),
        *NO_APPROACH,
        boot_us(snapshot),
    )


def gps_global_origin(snapshot: Snapshot, context: Context) -> tuple[Any, ...]:
    """GPS_GLOBAL_ORIGIN: where the local frame begins [degE7, mm above mean sea level]."""
    origin = context.simulation.scenario.home
    return (
        round(origin.latitude * 1e7),
        round(origin.longitude * 1e7),
        round(origin.altitude * 1e3),
        boot_us(snapshot),
    )
