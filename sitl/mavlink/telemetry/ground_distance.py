"""How far the ground is: DISTANCE_SENSOR, ArduPilot's RANGEFINDER, TERRAIN_REPORT.

The rangefinder looks down the body from the centre of mass; the ground is flat and known everywhere.
"""

from typing import Any

from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.telemetry.context import Context, boot_ms
from sitl.mavlink.telemetry.motion import DEGREES_E7
from sitl.snapshot import Snapshot

__all__ = ["distance_sensor", "rangefinder", "terrain_report"]

FIRST = 0  # of the rangefinders
NEAREST, FARTHEST = 0.1, 100.0  # that it can measure [m]
LEAST_DOWNWARD = 0.1  # cosine of its angle to the vertical below which it meets no ground
INVALID, PERFECT = 1, 100  # signal quality [%]
GRID_SPACING = 100  # of the points of the terrain [m]


def distance_sensor(snapshot: Snapshot, _: Context) -> tuple[Any, ...]:
    """DISTANCE_SENSOR: range and reading [cm]; beyond the range the largest reading, as no valid signal."""
    distance = _distance(snapshot)
    quality = PERFECT if NEAREST <= distance <= FARTHEST else INVALID
    return (
        boot_ms(snapshot),
        round(NEAREST * 100.0),
        round(FARTHEST * 100.0),
        round(min(distance, FARTHEST) * 100.0),
        mav.MAV_DISTANCE_SENSOR_LASER,
        FIRST,
        mav.MAV_SENSOR_ROTATION_PITCH_270,
        0,
        *(0.0, 0.0),
        *(0.0, 0.0, 0.0, 0.0),
        quality,
    )


def rangefinder(snapshot: Snapshot, _: Context) -> tuple[Any, ...]:
    """RANGEFINDER: the same reading [m]; it gives a number, no voltage."""
    return (min(_distance(snapshot), FARTHEST), 0.0)


def terrain_report(snapshot: Snapshot, _: Context) -> tuple[Any, ...]:
    """TERRAIN_REPORT: degE7, height of the ground above mean sea level and of the vehicle above it [m]."""
    height = float(snapshot.outputs["height_above_ground"])
    return (
        round(snapshot.latitude * DEGREES_E7),
        round(snapshot.longitude * DEGREES_E7),
        GRID_SPACING,
        snapshot.altitude_msl - height,
        height,
        0,
        0,
    )


def _distance(snapshot: Snapshot) -> float:
    """To the ground along the body's z axis [m], FARTHEST and more where that does not meet it."""
    _, x, y, _ = snapshot.quaternion
    downward = 1.0 - 2.0 * (x * x + y * y)
    height = max(float(snapshot.outputs["height_above_ground"]), 0.0)
    return height / downward if downward > LEAST_DOWNWARD else 10.0 * FARTHEST
