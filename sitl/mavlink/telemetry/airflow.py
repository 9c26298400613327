"""The air around the vehicle: WIND_COV, and ArduPilot's WIND and AOA_SSA."""

import math
from typing import Any

from sitl.mavlink.telemetry.context import Context, boot_us
from sitl.snapshot import Snapshot

__all__ = ["aoa_ssa", "wind", "wind_cov"]

LEAST_AIRSPEED = 0.1  # below it the air comes from nowhere in particular [m/s]
ACCURACY_UNKNOWN = 0.0  # what the fields cannot say apart from none at all


def wind_cov(snapshot: Snapshot, _: Context) -> tuple[Any, ...]:
    """WIND_COV: wind in NED, blowing to [m/s], at this altitude above mean sea level [m]; how it varies is not told."""
    return (
        boot_us(snapshot),
        *snapshot.wind_ned,
        math.nan,
        math.nan,
        snapshot.altitude_msl,
        ACCURACY_UNKNOWN,
        ACCURACY_UNKNOWN,
    )


def wind(snapshot: Snapshot, _: Context) -> tuple[Any, ...]:
    """WIND: where it comes from [deg], how fast over the ground and downwards [m/s]."""
    north, east, down = snapshot.wind_ned
    # The sign of a zero would give a calm a direction of its own.
    direction = math.degrees(math.atan2(-east, -north)) % 360.0 if north or east else 0.0
    return (direction, math.hypot(north, east), down)


def aoa_ssa(snapshot: Snapshot, _: Context) -> tuple[Any, ...]:
    """AOA_SSA: angle of attack and sideslip of the fuselage [deg], zero while there is no air to feel."""
    forward, right, down = snapshot.outputs["velocity_air_body"].tolist()
    speed = math.sqrt(forward * forward + right * right + down * down)
    if speed < LEAST_AIRSPEED:
        return (boot_us(snapshot), 0.0, 0.0)
    return (boot_us(snapshot), math.degrees(math.atan2(down, forward)), math.degrees(math.asin(right / speed)))
