"""Where the vehicle is and how it moves: one function per message, from a snapshot to field values.

Values come in the order of the message definition and in the message's own units and frames.
"""

import math
from typing import Any

from sitl.hil.air_data import equivalent_airspeed, pressure_altitude
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.telemetry.context import Context, boot_ms, boot_us
from sitl.snapshot import Snapshot

__all__ = [
    "DEGREES_E7", "altitude", "attitude", "attitude_quaternion", "global_position_int", "local_position_ned",
    "utm_global_position", "vfr_hud",
]  # fmt: skip

DEGREES_E7 = math.degrees(1.0) * 1e7
MISSION, TERMINATION, ON_GROUND = "MISSION", "TERMINATION", "ON_GROUND"  # of the snapshot's mode and landed state
UTM_ID_SIZE = 18
UTM_AVAILABLE = (
    mav.UTM_DATA_AVAIL_FLAGS_TIME_VALID
    | mav.UTM_DATA_AVAIL_FLAGS_POSITION_AVAILABLE
    | mav.UTM_DATA_AVAIL_FLAGS_ALTITUDE_AVAILABLE
    | mav.UTM_DATA_AVAIL_FLAGS_RELATIVE_ALTITUDE_AVAILABLE
    | mav.UTM_DATA_AVAIL_FLAGS_HORIZONTAL_VELO_AVAILABLE
    | mav.UTM_DATA_AVAIL_FLAGS_VERTICAL_VELO_AVAILABLE
)


def attitude(snapshot: Snapshot, _: Context) -> tuple[Any, ...]:
    """ATTITUDE: roll, pitch, yaw [rad] and body rates [rad/s]."""
    return (boot_ms(snapshot), snapshot.roll, snapshot.pitch, snapshot.yaw, *snapshot.rates)


def attitude_quaternion(snapshot: Snapshot, _: Context) -> tuple[Any, ...]:
    """ATTITUDE_QUATERNION: scalar first, body to NED; body rates [rad/s]; no representation offset."""
    return (boot_ms(snapshot), *snapshot.quaternion, *snapshot.rates, 0.0, 0.0, 0.0, 0.0)


def local_position_ned(snapshot: Snapshot, context: Context) -> tuple[Any, ...]:
    """LOCAL_POSITION_NED: position from the local origin [m] and velocity [m/s]."""
    return (boot_ms(snapshot), *context.origin.seen(*snapshot.position_ned), *snapshot.velocity_ned)


def global_position_int(snapshot: Snapshot, context: Context) -> tuple[Any, ...]:
    """GLOBAL_POSITION_INT: degE7, mm above mean sea level and above home, cm/s north, east, down, heading in cdeg."""
    north, east, down = snapshot.velocity_ned
    return (
        boot_ms(snapshot),
        round(snapshot.latitude * DEGREES_E7),
        round(snapshot.longitude * DEGREES_E7),
        round(snapshot.altitude_msl * 1e3),
        round(_above_home(snapshot, context) * 1e3),
        round(north * 100.0),
        round(east * 100.0),
        round(down * 100.0),
        round(math.degrees(snapshot.yaw) * 100.0) % 36000,
    )


def vfr_hud(snapshot: Snapshot, _: Context) -> tuple[Any, ...]:
    """VFR_HUD: equivalent airspeed, ground speed [m/s], heading [deg], wing motors' throttle [%], m, m/s up."""
    north, east, down = snapshot.velocity_ned
    throttle = 0.5 * float(snapshot.controls[0] + snapshot.controls[1])
    return (
        equivalent_airspeed(snapshot.airspeed, snapshot.density),
        math.hypot(north, east),
        round(math.degrees(snapshot.yaw)) % 360,
        round(min(max(throttle, 0.0), 1.0) * 100.0),
        snapshot.altitude_msl,
        -down,
    )


def altitude(snapshot: Snapshot, context: Context) -> tuple[Any, ...]:
    """ALTITUDE [m]: by pressure, above mean sea level, up from the local origin, above home, above ground (twice)."""
    above_ground = float(snapshot.outputs["height_above_ground"])
    return (
        boot_us(snapshot),
        pressure_altitude(snapshot.pressure),
        snapshot.altitude_msl,
        context.origin.down - snapshot.position_ned[2],
        _above_home(snapshot, context),
        above_ground,
        above_ground,
    )


def utm_global_position(snapshot: Snapshot, context: Context) -> tuple[Any, ...]:
    """UTM_GLOBAL_POSITION: UTC [us], degE7, mm above ellipsoid and ground, cm/s; next place of a mission, if any.

    Uncertainties are the least that the fields can say. The vehicle has no id of its own for this service.
    """
    guidance, flight = context.guidance, context.flight
    guidance.look()
    north, east, down = snapshot.velocity_ned
    following = (0, 0, 0)
    available = UTM_AVAILABLE
    if flight is not None and snapshot.mode == MISSION and guidance.has_place:
        latitude, longitude, altitude = flight.places.to_geodetic(*guidance.place)
        following = (round(latitude * 1e7), round(longitude * 1e7), round(altitude * 1e3))
        available |= mav.UTM_DATA_AVAIL_FLAGS_NEXT_WAYPOINT_AVAILABLE
    return (
        round((context.unix_epoch + snapshot.time) * 1e6),
        *(0,) * UTM_ID_SIZE,
        round(snapshot.latitude * DEGREES_E7),
        round(snapshot.longitude * DEGREES_E7),
        round(snapshot.height_ellipsoid * 1e3),
        round(float(snapshot.outputs["height_above_ground"]) * 1e3),
        round(north * 100.0),
        round(east * 100.0),
        round(down * 100.0),
        *(1, 1, 1),
        *following,
        0,
        _utm_state(snapshot),
        available,
    )


def _utm_state(snapshot: Snapshot) -> int:
    if snapshot.mode == TERMINATION:
        return mav.UTM_FLIGHT_STATE_EMERGENCY
    on_ground = snapshot.on_ground if snapshot.landed is None else snapshot.landed == ON_GROUND
    return mav.UTM_FLIGHT_STATE_GROUND if on_ground else mav.UTM_FLIGHT_STATE_AIRBORNE


def _above_home(snapshot: Snapshot, context: Context) -> float:
    # On a curved Earth not the same as local "up": the tangent plane leaves the ground.
    home = context.home_altitude_msl
    return -snapshot.position_ned[2] if home is None else snapshot.altitude_msl - home
