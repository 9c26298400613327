"""Where guidance leads and what the laws fly on the way: position, velocity and attitude targets, navigation, orbits.

A target is told as it is: what is not controlled at a moment is masked out. So a vehicle that stands disarmed tells
targets that ask for nothing, which says more than silence.
"""

import math
from typing import Any

from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.telemetry.context import Context, boot_ms, boot_us
from sitl.mavlink.telemetry.guidance import Guidance
from sitl.snapshot import Snapshot
from vehicle_model.rotation import quaternion_from_euler

__all__ = [
    "attitude_target",
    "nav_controller_output",
    "orbit_execution_status",
    "position_target_global_int",
    "position_target_local_ned",
]

NO_PLACE = mav.POSITION_TARGET_TYPEMASK_X_IGNORE | mav.POSITION_TARGET_TYPEMASK_Y_IGNORE
NO_HEIGHT = mav.POSITION_TARGET_TYPEMASK_Z_IGNORE
NO_VELOCITY = (
    mav.POSITION_TARGET_TYPEMASK_VX_IGNORE
    | mav.POSITION_TARGET_TYPEMASK_VY_IGNORE
    | mav.POSITION_TARGET_TYPEMASK_VZ_IGNORE
)
NO_ACCELERATION_DOWN = mav.POSITION_TARGET_TYPEMASK_AZ_IGNORE
NO_ACCELERATION = mav.POSITION_TARGET_TYPEMASK_AX_IGNORE | mav.POSITION_TARGET_TYPEMASK_AY_IGNORE | NO_ACCELERATION_DOWN
NO_YAW, NO_YAW_RATE = mav.POSITION_TARGET_TYPEMASK_YAW_IGNORE, mav.POSITION_TARGET_TYPEMASK_YAW_RATE_IGNORE
NOTHING = NO_PLACE | NO_HEIGHT | NO_VELOCITY | NO_ACCELERATION | NO_YAW | NO_YAW_RATE

NO_YAW_TURN = mav.ATTITUDE_TARGET_TYPEMASK_BODY_YAW_RATE_IGNORE
NO_TURNS = (
    mav.ATTITUDE_TARGET_TYPEMASK_BODY_ROLL_RATE_IGNORE
    | mav.ATTITUDE_TARGET_TYPEMASK_BODY_PITCH_RATE_IGNORE
    | NO_YAW_TURN
)
NO_ATTITUDE = mav.ATTITUDE_TARGET_TYPEMASK_ATTITUDE_IGNORE | mav.ATTITUDE_TARGET_TYPEMASK_THROTTLE_IGNORE | NO_TURNS
LARGEST_16 = 0xFFFF


def position_target_local_ned(snapshot: Snapshot, context: Context) -> tuple[Any, ...]:
    """POSITION_TARGET_LOCAL_NED: the place that guidance leads to [m], velocity, acceleration, yaw of the moment."""
    guidance = context.guidance
    guidance.look()
    mask, motion = _motion(guidance, snapshot)
    x, y, z = context.origin.seen(*_place(guidance))
    place = (x, y) if guidance.has_place else (0.0, 0.0)
    height = z if guidance.holds_altitude else 0.0
    return (boot_ms(snapshot), mav.MAV_FRAME_LOCAL_NED, mask, *place, height, *motion)


def position_target_global_int(snapshot: Snapshot, context: Context) -> tuple[Any, ...]:
    """POSITION_TARGET_GLOBAL_INT: the same with the place on the map [degE7, m above mean sea level]."""
    guidance = context.guidance
    guidance.look()
    mask, motion = _motion(guidance, snapshot)
    latitude = longitude = 0
    altitude = 0.0
    flight = context.flight
    if flight is not None:
        north, east, down = _place(guidance)
        if guidance.has_place:
            degrees_north, degrees_east, altitude = flight.places.to_geodetic(north, east, down)
            latitude, longitude = round(degrees_north * 1e7), round(degrees_east * 1e7)
        elif guidance.holds_altitude:
            altitude = flight.places.altitude - down
    return (boot_ms(snapshot), mav.MAV_FRAME_GLOBAL, mask, latitude, longitude, altitude, *motion)


def attitude_target(snapshot: Snapshot, context: Context) -> tuple[Any, ...]:
    """ATTITUDE_TARGET: attitude of the fuselage, yaw rate if that is what was asked for, thrust 0..1."""
    guidance = context.guidance
    guidance.look()
    if not guidance.holds_attitude:
        return (boot_ms(snapshot), NO_ATTITUDE, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    mask, yaw_rate = NO_TURNS, guidance.yaw_rate
    if yaw_rate is None:
        yaw_rate = 0.0
    else:
        mask &= ~NO_YAW_TURN
    return (boot_ms(snapshot), mask, *quaternion_from_euler(*guidance.attitude), 0.0, 0.0, yaw_rate, guidance.thrust)


def nav_controller_output(snapshot: Snapshot, context: Context) -> tuple[Any, ...]:
    """NAV_CONTROLLER_OUTPUT: attitude and track wanted, bearing and distance of the place [deg, m], errors [m, m/s].

    Errors are what is wanted less what is; that across the track is positive right of it, or outside a circle.
    """
    guidance = context.guidance
    guidance.look()
    roll = pitch = 0.0
    course = bearing = snapshot.yaw
    distance = altitude_error = airspeed_error = across = 0.0
    north, east, down = snapshot.position_ned
    if guidance.holds_attitude:
        roll, pitch, course = guidance.attitude
    if guidance.holds_velocity:
        vn, ve, _ = guidance.velocity
        if vn or ve:
            course = math.atan2(ve, vn)
        if guidance.cruise:
            airspeed_error = guidance.speed - snapshot.airspeed
    if guidance.holds_altitude:
        altitude_error = down - guidance.place[2]
    if guidance.has_place:
        to_north, to_east = guidance.place[0] - north, guidance.place[1] - east
        distance = math.hypot(to_north, to_east)
        bearing = math.atan2(to_east, to_north)
        across = _across(guidance, north, east, distance)
    return (
        math.degrees(roll),
        math.degrees(pitch),
        round(math.degrees(course)),
        round(math.degrees(bearing)),
        round(min(distance, LARGEST_16)),
        altitude_error,
        airspeed_error,
        across,
    )


def orbit_execution_status(snapshot: Snapshot, context: Context) -> tuple[Any, ...] | None:
    """ORBIT_EXECUTION_STATUS: centre [degE7, m above mean sea level] and radius [m]; None while there is no circle."""
    guidance, flight = context.guidance, context.flight
    guidance.look()
    if flight is None or not guidance.is_circle:
        return None
    north, east, down = guidance.place
    latitude, longitude, altitude = flight.places.to_geodetic(north, east, down)
    centre = (round(latitude * 1e7), round(longitude * 1e7), altitude)
    return (boot_us(snapshot), guidance.radius, mav.MAV_FRAME_GLOBAL, *centre)


def _place(guidance: Guidance) -> tuple[float, float, float]:
    """North, east and down that guidance leads to [m], zero for what it leaves open."""
    north, east, down = guidance.place
    if not guidance.has_place:
        north = east = 0.0
    return north, east, down if guidance.holds_altitude else 0.0


def _motion(guidance: Guidance, snapshot: Snapshot) -> tuple[int, tuple[float, ...]]:
    """Mask of a position target; velocity, acceleration NED, yaw and yaw rate."""
    if not guidance.holds_velocity:
        return NOTHING, (0.0,) * 8
    mask = NO_ACCELERATION | NO_YAW_RATE
    if not guidance.has_place:
        mask |= NO_PLACE
    if not guidance.holds_altitude:
        mask |= NO_HEIGHT
    north = east = 0.0
    acceleration = guidance.acceleration
    if acceleration is not None:
        mask ^= NO_ACCELERATION ^ NO_ACCELERATION_DOWN
        forward, right = acceleration
        sine, cosine = math.sin(snapshot.yaw), math.cos(snapshot.yaw)
        north, east = forward * cosine - right * sine, forward * sine + right * cosine
    yaw_rate = guidance.yaw_rate
    if yaw_rate is not None:
        mask ^= NO_YAW_RATE
    return mask, (*guidance.velocity, north, east, 0.0, guidance.attitude[2], yaw_rate or 0.0)


def _across(guidance: Guidance, north: float, east: float, distance: float) -> float:
    """How far a place [m] is right of the leg, or outside of the circle."""
    if guidance.is_circle:
        return distance - abs(guidance.radius)
    if not guidance.is_leg:
        return 0.0
    (from_north, from_east, _), (to_north, to_east, _) = guidance.start, guidance.place
    along_north, along_east = to_north - from_north, to_east - from_east
    length = math.hypot(along_north, along_east)
    if length == 0.0:
        return 0.0
    return (along_north * (east - from_east) - along_east * (north - from_north)) / length
