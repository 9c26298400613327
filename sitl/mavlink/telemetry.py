"""Where the vehicle is and how it moves: one function per message, from a snapshot to field values.

Values come in the order of the message definition and in the message's own units and frames.
"""

import math
from typing import Any

from sitl.hil.air_data import equivalent_airspeed, pressure_altitude
from sitl.mavlink.context import Context, boot_ms, boot_us
from sitl.snapshot import Snapshot

__all__ = [
    "altitude", "attitude", "attitude_quaternion", "global_position_int", "local_position_ned", "vfr_hud",
]  # fmt: skip

_DEGREES_E7 = math.degrees(1.0) * 1e7


def attitude(snapshot: Snapshot, _: Context) -> tuple[Any, ...]:
    """ATTITUDE: roll, pitch, yaw [rad] and body rates [rad/s]."""
    return (boot_ms(snapshot), snapshot.roll, snapshot.pitch, snapshot.yaw, *snapshot.rates)


def attitude_quaternion(snapshot: Snapshot, _: Context) -> tuple[Any, ...]:
    """ATTITUDE_QUATERNION: scalar first, body to NED; body rates [rad/s]; no representation offset."""
    return (boot_ms(snapshot), *snapshot.quaternion, *snapshot.rates, 0.0, 0.0, 0.0, 0.0)


def local_position_ned(snapshot: Snapshot, _: Context) -> tuple[Any, ...]:
    """LOCAL_POSITION_NED: position from home [m] and velocity [m/s]."""
    return (boot_ms(snapshot), *snapshot.position_ned, *snapshot.velocity_ned)


def global_position_int(snapshot: Snapshot, context: Context) -> tuple[Any, ...]:
    """GLOBAL_POSITION_INT: degE7, mm above mean sea level and above home, cm/s north, east, down, heading in cdeg."""
    north, east, down = snapshot.velocity_ned
    return (
        boot_ms(snapshot),
        round(snapshot.latitude * _DEGREES_E7),
        round(snapshot.longitude * _DEGREES_E7),
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
        -snapshot.position_ned[2],
        _above_home(snapshot, context),
        above_ground,
        above_ground,
    )


def _above_home(snapshot: Snapshot, context: Context) -> float:
    # On a curved Earth not the same as local "up": the tangent plane leaves the ground.
    home = context.home_altitude_msl
    return -snapshot.position_ned[2] if home is None else snapshot.altitude_msl - home
