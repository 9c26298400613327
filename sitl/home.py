"""The place a flight is measured from, as people type it: degrees and metres above mean sea level."""

import math
from collections.abc import Sequence
from typing import NamedTuple

__all__ = ["PX4_HOME", "Home", "home_from"]


class Home(NamedTuple):
    """Origin of the flight: geodetic degrees, metres above mean sea level, degrees from north."""

    latitude: float
    longitude: float
    altitude: float
    heading: float


LIMITS = Home(89.9, 180.0, 20000.0, 360.0)
PX4_HOME = Home(47.397742, 8.545594, 488.0, 0.0)  # where PX4's simulators start, Zurich


def home_from(values: Sequence[float]) -> Home:
    """Home of four numbers. Raises ValueError for another count, or a number that is no such coordinate."""
    if len(values) != 4:
        msg = f"expected latitude, longitude, altitude and heading in degrees and metres, got {len(values)} numbers"
        raise ValueError(msg)
    home = Home(*map(float, values))
    for name, value, limit in zip(Home._fields, home, LIMITS, strict=True):
        if not math.isfinite(value) or abs(value) > limit:
            msg = f"expected a {name} within +-{limit:g}, got {value:g}"
            raise ValueError(msg)
    return home
