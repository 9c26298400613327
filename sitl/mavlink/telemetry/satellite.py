"""The satellite receiver: GPS_RAW_INT, GNSS_INTEGRITY. It is ideal: open sky, no interference, no error."""

from typing import Any

from sitl.hil.hil_messages import hil_gps
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.telemetry.context import Context
from sitl.snapshot import Snapshot

__all__ = ["gnss_integrity", "gps_raw_int"]

FIRST = 0  # of the receivers
FINEST = 1  # uncertainty that the fields can say; 0 is no statement
UNKNOWN_DISTANCE, UNKNOWN_QUALITY = 0xFFFF, 0xFF
BEST = 10  # of qualities 0..10


def gps_raw_int(snapshot: Snapshot, context: Context) -> tuple[Any, ...]:
    """GPS_RAW_INT: what HIL_GPS says; altitude above mean sea level and ellipsoid [mm], uncertainties, yaw [cdeg]."""
    time, fix, lat, lon, alt, eph, epv, speed, _, _, _, course, satellites, _, yaw = hil_gps(snapshot, context)
    height = round(snapshot.height_ellipsoid * 1e3)
    accuracies = (FINEST, FINEST, FINEST, FINEST)
    return (time, fix, lat, lon, alt, eph, epv, speed, course, satellites, height, *accuracies, yaw)


def gnss_integrity(_: Snapshot, __: Context) -> tuple[Any, ...]:
    """GNSS_INTEGRITY: no errors, nobody jams or spoofs; signals are not authenticated, nor is there any RAIM."""
    return (
        FIRST,
        0,
        mav.GPS_AUTHENTICATION_STATE_DISABLED,
        mav.GPS_JAMMING_STATE_NOT_JAMMED,
        mav.GPS_SPOOFING_STATE_NOT_SPOOFED,
        mav.GPS_RAIM_STATE_DISABLED,
        UNKNOWN_DISTANCE,
        UNKNOWN_DISTANCE,
        UNKNOWN_QUALITY,
        BEST,
        BEST,
        UNKNOWN_QUALITY,
    )
