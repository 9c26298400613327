"""The simulator side of MAVLink HIL: true state and ideal sensor readings, field by field in the messages' own units.

Each function takes a snapshot and returns the values of one message in the order of its definition. `time_usec` is
simulated time since start. Accelerations are specific force, what an accelerometer at the centre of mass reads
(0, 0, -1000 mG at rest), for that is how autopilots have always taken them.
"""

import math
from typing import TYPE_CHECKING, Any

from sitl.hil.air_data import equivalent_airspeed, pressure_altitude
from sitl.hil.magnetic_field import in_body_axes

if TYPE_CHECKING:
    from sitl.mavlink.telemetry.context import Context
    from sitl.snapshot import Snapshot

__all__ = ["hil_gps", "hil_sensor", "hil_state", "hil_state_quaternion"]

MILLI_G = 9.80665e-3  # [m/s^2]
ZERO_CELSIUS = 273.15  # [K]
ALL_SENSORS = 0x1FFF  # HIL_SENSOR_UPDATED_FLAGS: accelerometer, gyro, magnetometer, pressures, altitude, temperature
FIX_3D = 3
DILUTION = 100  # of precision, 1.00: an ideal receiver under an open sky
SATELLITES = 16
LEAST_COURSE_SPEED = 0.1  # over ground [m/s]; below it there is no course to speak of
COURSE_UNKNOWN = 0xFFFF
_DEGREES_E7 = math.degrees(1.0) * 1e7


def hil_state_quaternion(snapshot: "Snapshot", _: "Context") -> tuple[Any, ...]:
    """HIL_STATE_QUATERNION: attitude, body rates [rad/s], degE7, mm above mean sea level, cm/s, mG."""
    north, east, down = snapshot.velocity_ned
    x, y, z = snapshot.specific_force
    return (
        round(snapshot.time * 1e6),
        *snapshot.quaternion,
        *snapshot.rates,
        round(snapshot.latitude * _DEGREES_E7),
        round(snapshot.longitude * _DEGREES_E7),
        round(snapshot.altitude_msl * 1e3),
        round(north * 100.0),
        round(east * 100.0),
        round(down * 100.0),
        round(equivalent_airspeed(snapshot.airspeed, snapshot.density) * 100.0),
        round(snapshot.airspeed * 100.0),
        round(x / MILLI_G),
        round(y / MILLI_G),
        round(z / MILLI_G),
    )


def hil_state(snapshot: "Snapshot", _: "Context") -> tuple[Any, ...]:
    """HIL_STATE, for older tools: as HIL_STATE_QUATERNION with roll, pitch, yaw [rad] and no airspeeds."""
    return (
        round(snapshot.time * 1e6),
        snapshot.roll,
        snapshot.pitch,
        snapshot.yaw,
        *snapshot.rates,
        round(snapshot.latitude * _DEGREES_E7),
        round(snapshot.longitude * _DEGREES_E7),
        round(snapshot.altitude_msl * 1e3),
        *(round(speed * 100.0) for speed in snapshot.velocity_ned),
        *(round(force / MILLI_G) for force in snapshot.specific_force),
    )


def hil_sensor(snapshot: "Snapshot", context: "Context") -> tuple[Any, ...]:
    """HIL_SENSOR without noise: m/s^2, rad/s, gauss (body axes), hPa, m, degrees Celsius.

    The differential pressure is that of a pitot tube along the body x axis, 1/2 rho u |u|, incompressible.
    """
    field_ned = context.magnetic_field.ned(
        math.degrees(snapshot.latitude), math.degrees(snapshot.longitude), snapshot.height_ellipsoid
    )
    along = float(snapshot.outputs["velocity_air_body"][0])
    return (
        round(snapshot.time * 1e6),
        *snapshot.specific_force,
        *snapshot.rates,
        *in_body_axes(field_ned, snapshot.quaternion),
        snapshot.pressure * 1e-2,
        0.5 * snapshot.density * along * abs(along) * 1e-2,
        pressure_altitude(snapshot.pressure),
        snapshot.temperature - ZERO_CELSIUS,
        ALL_SENSORS,
        0,
    )


def hil_gps(snapshot: "Snapshot", _: "Context") -> tuple[Any, ...]:
    """HIL_GPS of an ideal receiver: degE7, mm above mean sea level, cm/s, course and yaw in cdeg.

    A yaw of 36000 is north, a course of 65535 that of a vehicle that stands still.
    """
    north, east, down = snapshot.velocity_ned
    speed = math.hypot(north, east)
    course = round(math.degrees(math.atan2(east, north)) * 100.0) % 36000
    return (
        round(snapshot.time * 1e6),
        FIX_3D,
        round(snapshot.latitude * _DEGREES_E7),
        round(snapshot.longitude * _DEGREES_E7),
        round(snapshot.altitude_msl * 1e3),
        DILUTION,
        DILUTION,
        round(speed * 100.0),
        round(north * 100.0),
        round(east * 100.0),
        round(down * 100.0),
        course if speed >= LEAST_COURSE_SPEED else COURSE_UNKNOWN,
        SATELLITES,
        0,
        round(math.degrees(snapshot.yaw) * 100.0) % 36000 or 36000,
    )
