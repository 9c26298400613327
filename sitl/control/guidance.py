"""Horizontal and vertical guidance: from points, legs and circles to the velocity that follows them, in any wind."""

import math

from sitl.control.records import Horizontal, Vertical
from vehicle_model.compiled import compiled

__all__ = ["course_speed", "horizontal_demand", "stopping_speed", "vertical_demand"]

Demand = tuple[float, float, float, float]  # velocity north, east [m/s], acceleration north, east [m/s^2]

POINT = int(Horizontal.POINT)
LEG = int(Horizontal.LEG)
CIRCLE = int(Horizontal.CIRCLE)
BANK = int(Horizontal.BANK)
ALTITUDE = int(Vertical.ALTITUDE)

SPEED_STEP = 0.5  # of the braking distance's sum [m/s]
CREEPING = 3.0  # ground speed away from a point at which it is gone back to at once [m/s]
STEEPEST_INTERCEPT = 0.7  # speed across a path over the speed along it, at most
SLOWEST = 0.5  # ground speed asked for when the wind is stronger than the aircraft [m/s]


@compiled
def course_speed(north: float, east: float, wind, airspeed: float) -> float:
    """Ground speed [m/s] along a unit direction when flying at an airspeed in a wind: the wind triangle."""
    along = wind[0] * north + wind[1] * east
    across = wind[1] * north - wind[0] * east
    return max(along + math.sqrt(max(airspeed * airspeed - across * across, 0.0)), SLOWEST)


@compiled
def stopping_speed(
    distance: float, headwind: float, crosswind: float, braking, first: float, step: float, fastest: float
) -> float:
    """Ground speed [m/s] from which braking as planned stops within a distance [m] in a wind [m/s].

    `braking` (n,) is the planned deceleration [m/s^2] over airspeeds first, first + step, ...
    """
    speed = 0.0
    covered = 0.0
    last = braking.shape[0] - 1
    while speed < fastest:
        along = speed + 0.5 * SPEED_STEP + headwind
        airspeed = math.copysign(math.sqrt(along * along + crosswind * crosswind), along)
        x = min(max((airspeed - first) / step, 0.0), float(last))
        cell = min(int(x), last - 1)
        deceleration = braking[cell] + (x - cell) * (braking[cell + 1] - braking[cell])
        needed = (speed + 0.5 * SPEED_STEP) * SPEED_STEP / deceleration
        if covered + needed >= distance:
            return min(math.sqrt(speed * speed + 2.0 * deceleration * (distance - covered)), fastest)
        covered += needed
        speed += SPEED_STEP
    return fastest


@compiled
def horizontal_demand(estimate, setpoint, gains, braking, first: float, step: float) -> Demand:
    """Velocity and acceleration [m/s, m/s^2] north and east that the setpoint's horizontal guidance asks for.

    For ACCELERATION and BANK, which ask for no velocity, the present one.
    """
    kind = setpoint.horizontal
    position, wind = estimate.position_ned, estimate.wind_ned
    to_north = setpoint.position_ned[0] - position[0]
    to_east = setpoint.position_ned[1] - position[1]
    if kind == POINT:
        distance = math.sqrt(to_north * to_north + to_east * to_east)
        if distance < 1e-6:
            return 0.0, 0.0, 0.0, 0.0
        north, east = to_north / distance, to_east / distance
        fastest = course_speed(north, east, wind, setpoint.speed) if setpoint.cruise == 1 else setpoint.speed
        headwind = -(wind[0] * north + wind[1] * east)
        crosswind = wind[0] * east - wind[1] * north
        braked = stopping_speed(distance, headwind, crosswind, braking, first, step, fastest)
        overshot = -(estimate.velocity_ned[0] * north + estimate.velocity_ned[1] * east) > CREEPING
        if setpoint.cruise == 1 and overshot and braked < fastest and estimate.airspeed > gains.wing_borne_from:
            # Past the point and too fast to turn on the spot: stop first, which turns the nose into the wind.
            return 0.0, 0.0, 0.0, 0.0
        speed = min(gains.position * distance, braked)
        return speed * north, speed * east, 0.0, 0.0
    if kind == LEG:
        north = setpoint.position_ned[0] - setpoint.start_ned[0]
        east = setpoint.position_ned[1] - setpoint.start_ned[1]
        length = math.sqrt(north * north + east * east)
        if length < 1e-3:
            length, north, east = 1.0, math.cos(estimate.euler[2]), math.sin(estimate.euler[2])
        north, east = north / length, east / length
        right = to_north * east - to_east * north  # of the line
        return along_path(estimate, setpoint, gains, north, east, right, STEEPEST_INTERCEPT)
    if kind == CIRCLE:
        distance = max(math.sqrt(to_north * to_north + to_east * to_east), 1e-3)
        inward_north, inward_east = to_north / distance, to_east / distance
        sense = 1.0 if setpoint.radius >= 0.0 else -1.0
        radius = max(abs(setpoint.radius), 1.0)
        north, east = sense * inward_east, -sense * inward_north
        # Right of the path is where the centre is in a clockwise turn.
        right = sense * (radius - distance)
        # From outside no steeper than the tangent, which meets the circle in its own direction.
        tangent = math.sqrt(max(distance * distance - radius * radius, 0.0)) / radius
        steepest = max(tangent, STEEPEST_INTERCEPT) if distance < 1.1 * radius else tangent
        vn, ve, _, _ = along_path(estimate, setpoint, gains, north, east, right, steepest)
        ground = math.sqrt(estimate.velocity_ned[0] ** 2 + estimate.velocity_ned[1] ** 2)
        # Far from the circle, where the tangent is flown, there is nothing to turn around yet.
        gain = gains.path if setpoint.cruise == 1 else gains.position
        way = gain * abs(radius - distance) / max(setpoint.speed, 1.0) / tangent if tangent > 0.0 else 0.0
        share = max(1.0 - max(way * way, (radius - distance) / radius), 0.0)
        pull = share * ground * ground / max(distance, radius)
        return vn, ve, pull * inward_north, pull * inward_east
    if kind == BANK:
        heading = estimate.euler[2]
        speed = course_speed(math.cos(heading), math.sin(heading), wind, setpoint.speed)
        return speed * math.cos(heading), speed * math.sin(heading), 0.0, 0.0
    return setpoint.velocity_ned[0], setpoint.velocity_ned[1], 0.0, 0.0


@compiled
def along_path(estimate, setpoint, gains, north: float, east: float, right: float, steepest: float) -> Demand:
    """Velocity along a unit direction, turned towards the path; `right` is how far right of it the vehicle is [m].

    `steepest` is the largest speed across the path over that along it.
    """
    wind = estimate.wind_ned
    speed = setpoint.speed
    if setpoint.cruise == 1:
        speed = course_speed(north, east, wind, setpoint.speed)
    across = -gains.path * right / max(speed, 1.0)
    if setpoint.cruise == 0:
        across = -gains.position * right / max(speed, 1.0)
    across = min(max(across, -steepest), steepest)
    scale = 1.0 / math.sqrt(1.0 + across * across)
    course_north = scale * (north - across * east)
    course_east = scale * (east + across * north)
    if setpoint.cruise == 1:
        speed = course_speed(course_north, course_east, wind, setpoint.speed)
    return speed * course_north, speed * course_east, 0.0, 0.0


@compiled
def vertical_demand(estimate, setpoint, gains) -> float:
    """Velocity down [m/s] that the setpoint's vertical guidance asks for, within its climb and sink rates."""
    if setpoint.vertical == ALTITUDE:
        down = gains.altitude * (setpoint.position_ned[2] - estimate.position_ned[2])
    else:
        down = setpoint.velocity_ned[2]
    return min(max(down, -setpoint.climb_rate), setpoint.sink_rate)
