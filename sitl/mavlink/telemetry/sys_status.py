"""SYS_STATUS: which sensors and controllers there are, which are in use, which are well; battery, load, link errors.

Ground stations judge by its bits whether the vehicle may fly: PREARM_CHECK is what MAVSDK calls armable.
"""

from collections.abc import Mapping
from typing import Any

from sitl.flight.flight import Flight
from sitl.flight.mode import Mode
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.telemetry.context import Context
from sitl.mavlink.telemetry.rc_channels import has_sticks, hears_sticks
from sitl.snapshot import Snapshot

__all__ = ["sys_status"]

# What every flight has: ideal sensors (see `inertial`, `satellite`, `ground_distance`) and the estimate.
SENSORS = (
    mav.MAV_SYS_STATUS_SENSOR_3D_GYRO
    | mav.MAV_SYS_STATUS_SENSOR_3D_ACCEL
    | mav.MAV_SYS_STATUS_SENSOR_3D_MAG
    | mav.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE
    | mav.MAV_SYS_STATUS_SENSOR_DIFFERENTIAL_PRESSURE
    | mav.MAV_SYS_STATUS_SENSOR_GPS
    | mav.MAV_SYS_STATUS_SENSOR_LASER_POSITION
    | mav.MAV_SYS_STATUS_SENSOR_3D_GYRO2
    | mav.MAV_SYS_STATUS_SENSOR_3D_ACCEL2
    | mav.MAV_SYS_STATUS_SENSOR_3D_MAG2
    | mav.MAV_SYS_STATUS_AHRS
)
BATTERY = mav.MAV_SYS_STATUS_SENSOR_BATTERY
MOTOR_OUTPUTS = mav.MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS
PROPULSION = mav.MAV_SYS_STATUS_SENSOR_PROPULSION
STICKS = mav.MAV_SYS_STATUS_SENSOR_RC_RECEIVER
FENCE = mav.MAV_SYS_STATUS_GEOFENCE
PREARM = mav.MAV_SYS_STATUS_PREARM_CHECK
EXTENDED = mav.MAV_SYS_STATUS_EXTENSION_USED
EXTENDED_SENSORS = mav.MAV_SYS_STATUS_SENSOR_3D_GYRO3 | mav.MAV_SYS_STATUS_SENSOR_3D_ACCEL3

# Control loops, each with those inside it.
RATES = mav.MAV_SYS_STATUS_SENSOR_ANGULAR_RATE_CONTROL | mav.MAV_SYS_STATUS_SENSOR_ATTITUDE_STABILIZATION
HEIGHT = RATES | mav.MAV_SYS_STATUS_SENSOR_YAW_POSITION | mav.MAV_SYS_STATUS_SENSOR_Z_ALTITUDE_CONTROL
POSITION = HEIGHT | mav.MAV_SYS_STATUS_SENSOR_XY_POSITION_CONTROL
CLOSED: Mapping[Mode, int] = {Mode.MANUAL: 0, Mode.STABILIZED: RATES, Mode.ALTITUDE: HEIGHT, Mode.TERMINATION: 0}

NOT_MEASURED = -1
MOST_ERRORS = 0xFFFF  # that errors_comm can hold
MOST_LOAD = 1000
TILT_SERVO = "tilt servo"  # as the flight's faults name it


def sys_status(snapshot: Snapshot, context: Context) -> tuple[Any, ...]:
    """SYS_STATUS: bits, processor load [per mille of one core], battery [mV, cA, %], link errors."""
    present = enabled = healthy = SENSORS | BATTERY | MOTOR_OUTPUTS | PROPULSION | EXTENDED
    flight = context.flight
    if flight is not None:
        more = _of_flight(snapshot, context, flight)
        present, enabled, healthy = present | more[0], enabled | more[1], healthy & ~more[2] | more[3]
    remaining = snapshot.battery_remaining
    pieces = context.received + context.malformed
    return (
        present,
        enabled,
        healthy,
        min(round(context.load * MOST_LOAD), MOST_LOAD),
        round(snapshot.battery_voltage * 1e3),
        round(snapshot.battery_current * 100.0),
        NOT_MEASURED if remaining is None else round(remaining * 100.0),
        round(10000.0 * context.malformed / pieces) if pieces else 0,
        min(context.malformed, MOST_ERRORS),
        *(0, 0, 0, 0),
        *(EXTENDED_SENSORS,) * 3,
    )


def _of_flight(snapshot: Snapshot, context: Context, flight: Flight) -> tuple[int, int, int, int]:
    """What the flight controller adds: bits present, in use, ill, well."""
    present = enabled = ill = well = 0
    if not context.simulation.is_flown_from_outside:
        closed = CLOSED.get(flight.mode, POSITION) if flight.armed else 0
        present |= POSITION | PREARM
        enabled |= closed | PREARM
        well |= POSITION
        if flight.armed or context.ready_to_arm(snapshot, flight):
            well |= PREARM
    if has_sticks(flight):
        present |= STICKS
        enabled |= STICKS
        if hears_sticks(flight):
            well |= STICKS
    parameters, fence = flight.parameters, flight.fence
    limits = parameters["GF_MAX_HOR_DIST"] > 0.0 or parameters["GF_MAX_VER_DIST"] > 0.0
    if fence.polygons or fence.circles or limits:
        present |= FENCE
        enabled |= FENCE if parameters["GF_ACTION"] else 0
    well |= FENCE if flight.breach is None else 0  # also where there is none: MAVProxy would call it breached
    remaining = snapshot.battery_remaining
    if remaining is not None and remaining < parameters["BAT_CRIT_THR"]:
        ill |= BATTERY
    for fault in flight.actuators.faults:
        ill |= MOTOR_OUTPUTS if fault.startswith(TILT_SERVO) else PROPULSION
    return present, enabled, ill, well
