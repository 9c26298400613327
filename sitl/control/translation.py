"""Velocity: a reference that the aircraft can follow, and the force that keeps to it."""

import math

from sitl.control.design_names import (
    BRAKE,
    FORWARD_GAIN,
    INTEGRAL_SHARE,
    LATERAL_GAIN,
    LOWEST_FORCE,
    VERTICAL_GAIN,
)  # fmt: skip
from sitl.control.guidance import horizontal_demand, vertical_demand
from sitl.control.records import Horizontal
from vehicle_model.compiled import compiled
from vehicle_model.earth import STANDARD_GRAVITY

__all__ = ["acceleration_demand", "advance_reference", "integrate_velocity", "limited"]

ACCELERATION = int(Horizontal.ACCELERATION)
BANK = int(Horizontal.BANK)
TOO_FAST = 1.5  # ahead of the velocity reference: nothing is left for sinking [m/s]
SINKING = 0.8  # faster than asked for before it counts as a stall, and from there until it wholly does [m/s]
FURTHEST = 2.5  # that a velocity reference runs ahead of the velocity [m/s]
CORRIDOR_FROM = 0.7  # of where the wing begins to carry: from there sinking and braking share the force at hand
INTEGRAL_LIMIT = 6.0  # [m/s^2]
FADING = 3.0  # of the horizontal integral where it has nothing to do [s]
LEAST_LACK = 0.1  # of force per mass that counts as falling short [m/s^2]


@compiled
def limited(value: float, low: float, high: float) -> float:
    """Value within limits."""
    return min(max(value, low), high)


@compiled
def advance_reference(estimate, setpoint, gains, row, braking, first, step, u: float, memory, dt: float):
    """Move the velocity reference towards what guidance asks for; returns its acceleration in NED [m/s^2].

    Forward and lateral (of the heading) it changes no faster than the corridor, the bank limit and comfort allow;
    `row` is the schedule at the forward airflow `u` [m/s].
    """
    reference = memory.velocity_reference_ned
    velocity = estimate.velocity_ned
    cosine, sine = math.cos(estimate.euler[2]), math.sin(estimate.euler[2])
    down_wanted = vertical_demand(estimate, setpoint, gains)
    if setpoint.horizontal == ACCELERATION:
        forward, right = setpoint.acceleration[0], setpoint.acceleration[1]
        reference[0], reference[1] = velocity[0], velocity[1]
        memory.velocity_demand_ned[0], memory.velocity_demand_ned[1] = velocity[0], velocity[1]
    else:
        vn, ve, an, ae = horizontal_demand(estimate, setpoint, gains, braking, first, step)
        memory.velocity_demand_ned[0], memory.velocity_demand_ned[1] = vn, ve
        error_n, error_e = vn - reference[0], ve - reference[1]
        forward = gains.reference * (cosine * error_n + sine * error_e) + cosine * an + sine * ae
        right = gains.reference * (cosine * error_e - sine * error_n) + cosine * ae - sine * an
        if setpoint.horizontal == BANK:
            right = STANDARD_GRAVITY * math.tan(setpoint.bank)
    strongest = gains.forward_acceleration
    forward = limited(forward, -limited(-row[LOWEST_FORCE], row[BRAKE], strongest), strongest)
    behind = FURTHEST
    # Wing-borne, the force left before the wing stalls is spent on braking and on sinking alike: braking as planned
    # comes first, what is left is for sinking.
    # A wing stuck too flat to slow down has no such choice.
    if u > CORRIDOR_FROM * gains.wing_borne_from and memory.stuck_relief == 0.0:
        sinking = STANDARD_GRAVITY * limited(reference[2], 0.0, setpoint.sink_rate) / u
        forward = max(forward, -max(row[BRAKE], -row[LOWEST_FORCE] - sinking))
        down_wanted = min(down_wanted, max(forward - row[LOWEST_FORCE], 0.0) * u / STANDARD_GRAVITY)
        # An aircraft that is not quite the one believed in may have less of it: who runs ahead stops sinking.
        ahead = cosine * (velocity[0] - reference[0]) + sine * (velocity[1] - reference[1])
        down_wanted = min(down_wanted, setpoint.sink_rate * limited((TOO_FAST - ahead) / TOO_FAST, 0.0, 1.0))
        # And who sinks more than he should has stalled: more tilt would not carry him, speed does.
        stalled = limited((velocity[2] - max(reference[2], down_wanted) - SINKING) / SINKING, 0.0, 1.0)
        forward += stalled * (gains.forward_acceleration - forward)
        behind *= 1.0 - stalled
    widest = STANDARD_GRAVITY * math.tan(setpoint.max_bank)
    blend = limited((u - gains.wing_borne_from) / (gains.wing_borne_at - gains.wing_borne_from), 0.0, 1.0)
    widest = min(widest, gains.lateral_acceleration + blend * widest)
    right = limited(right, -widest, widest)
    down = 2.0 * gains.reference * (down_wanted - reference[2])
    down = limited(down, -gains.vertical_acceleration, gains.vertical_acceleration)
    north, east = cosine * forward - sine * right, sine * forward + cosine * right
    reference[0] = limited(reference[0] + dt * north, velocity[0] - behind, velocity[0] + behind)
    reference[1] = limited(reference[1] + dt * east, velocity[1] - behind, velocity[1] + behind)
    reference[2] = limited(reference[2] + dt * down, velocity[2] - FURTHEST, velocity[2] + FURTHEST)
    return north, east, down


@compiled
def acceleration_demand(estimate, row, memory, feed_north: float, feed_east: float, feed_down: float):
    """Acceleration forward, right (of the heading) and down [m/s^2] that brings the velocity to its reference."""
    cosine, sine = math.cos(estimate.euler[2]), math.sin(estimate.euler[2])
    reference, velocity, integral = memory.velocity_reference_ned, estimate.velocity_ned, memory.velocity_integral_ned
    error_n, error_e = reference[0] - velocity[0], reference[1] - velocity[1]
    north, east = feed_north + integral[0], feed_east + integral[1]
    forward = cosine * north + sine * east + row[FORWARD_GAIN] * (cosine * error_n + sine * error_e)
    right = cosine * east - sine * north + row[LATERAL_GAIN] * (cosine * error_e - sine * error_n)
    down = feed_down + integral[2] + row[VERTICAL_GAIN] * (reference[2] - velocity[2])
    return forward, right, down


@compiled
def held(error: float, lack: float) -> float:
    """The error to integrate: none while the force falls short of what already is asked for because of it."""
    return 0.0 if error * lack < 0.0 and abs(lack) > LEAST_LACK else error


@compiled
def integrate_velocity(
    estimate, setpoint, row, memory, lack_forward: float, lack_right: float, lack_down: float, dt: float
) -> None:
    """Advance the velocity loop's integral; `lack` is acceleration reached less that asked for [m/s^2]."""
    cosine, sine = math.cos(estimate.euler[2]), math.sin(estimate.euler[2])
    reference, velocity, integral = memory.velocity_reference_ned, estimate.velocity_ned, memory.velocity_integral_ned
    share = row[INTEGRAL_SHARE]
    if setpoint.horizontal == ACCELERATION:
        # No velocity is asked for: what held one against wind and error fades away.
        integral[0] -= dt / FADING * integral[0]
        integral[1] -= dt / FADING * integral[1]
    else:
        error_n, error_e = reference[0] - velocity[0], reference[1] - velocity[1]
        forward = share * row[FORWARD_GAIN] ** 2 * held(cosine * error_n + sine * error_e, lack_forward)
        right = share * row[LATERAL_GAIN] ** 2 * held(cosine * error_e - sine * error_n, lack_right)
        north, east = cosine * forward - sine * right, sine * forward + cosine * right
        integral[0] = limited(integral[0] + dt * north, -INTEGRAL_LIMIT, INTEGRAL_LIMIT)
        integral[1] = limited(integral[1] + dt * east, -INTEGRAL_LIMIT, INTEGRAL_LIMIT)
    down = share * row[VERTICAL_GAIN] ** 2 * held(reference[2] - velocity[2], lack_down)
    integral[2] = limited(integral[2] + dt * down, -INTEGRAL_LIMIT, INTEGRAL_LIMIT)
