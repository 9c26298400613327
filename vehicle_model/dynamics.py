"""The right-hand side of the equations of motion: what the state does next, everything included."""

import math

from vehicle_model.atmosphere import air_density
from vehicle_model.compiled import compiled
from vehicle_model.earth import height_above_ellipsoid
from vehicle_model.ground import contact_force
from vehicle_model.loads import vehicle_loads
from vehicle_model.motor import servo_rate
from vehicle_model.rigid_body import rates_relative_to_earth, rigid_body_derivative
from vehicle_model.rotation import body_to_ned, ned_to_body
from vehicle_model.state import POSITION, QUATERNION, ROTOR_SPEED, TILT, VELOCITY

__all__ = ["derivative", "gear_loads"]

Loads = tuple[float, float, float, float, float, float]

# No part of the vehicle reaches further from its centre of mass than this [m]: higher up the gear is not looked at.
GEAR_REACH = 10.0


@compiled
def gear_loads(state, craft, height_above_ground: float, turn_rates, out) -> Loads:
    """Force [N] and moment [N m] of all contact points about the centre of mass, body axes."""
    q0, q1, q2, q3 = state[QUATERNION], state[QUATERNION + 1], state[QUATERNION + 2], state[QUATERNION + 3]
    p, q, r = turn_rates
    fx = fy = fz = mx = my = mz = 0.0
    for i in range(craft.contact_count):
        contact = craft.contacts[i]
        x, y, z = contact.position[0], contact.position[1], contact.position[2]
        _, _, below = body_to_ned(q0, q1, q2, q3, x, y, z)
        north, east, sinking = body_to_ned(
            q0, q1, q2, q3,
            state[VELOCITY] + q * z - r * y,
            state[VELOCITY + 1] + r * x - p * z,
            state[VELOCITY + 2] + p * y - q * x,
        )  # fmt: skip
        push = contact_force(contact, below - height_above_ground, sinking, north, east)
        body = ned_to_body(q0, q1, q2, q3, push[0], push[1], push[2])
        for k in range(3):
            out.contact_force_body[i, k] = body[k]
        fx += body[0]
        fy += body[1]
        fz += body[2]
        mx += y * body[2] - z * body[1]
        my += z * body[0] - x * body[2]
        mz += x * body[1] - y * body[0]
    return fx, fy, fz, mx, my, mz


@compiled
def derivative(state, controls, vehicle, environment, outputs, rate) -> None:
    """Time derivative of the state (20,) under controls (7,); writes `rate` (20,) and the OUTPUTS array (1,).

    `vehicle` and `environment` are VEHICLE and ENVIRONMENT arrays of length one; the state is laid out in
    `vehicle_model.state`. Eq. (1) of Hong et al. with the sums of eq. (2), motors and servos.
    """
    craft = vehicle[0]
    world = environment[0]
    out = outputs[0]
    q0, q1, q2, q3 = state[QUATERNION], state[QUATERNION + 1], state[QUATERNION + 2], state[QUATERNION + 3]
    height = height_above_ellipsoid(state[POSITION], state[POSITION + 1], state[POSITION + 2], world)
    density = air_density(height)
    wind = ned_to_body(q0, q1, q2, q3, world.wind_ned[0], world.wind_ned[1], world.wind_ned[2])
    air = (state[VELOCITY] - wind[0], state[VELOCITY + 1] - wind[1], state[VELOCITY + 2] - wind[2])
    turn_rates = rates_relative_to_earth(state, world)

    for i in range(4):
        rate[TILT + i] = servo_rate(craft.servos[i], state[TILT + i], controls[3 + i])
    fx, fy, fz, mx, my, mz = vehicle_loads(state, controls, craft, air, turn_rates, rate[TILT], density, out)
    above_ground = height - world.ground_height
    if above_ground < GEAR_REACH:
        gear = gear_loads(state, craft, above_ground, turn_rates, out)
        fx += gear[0]
        fy += gear[1]
        fz += gear[2]
        mx += gear[3]
        my += gear[4]
        mz += gear[5]
    rigid_body_derivative(state, fx, fy, fz, mx, my, mz, craft, world, rate)
    for i in range(3):
        rate[ROTOR_SPEED + i] = 0.0
    for i in range(craft.rotor_count):
        rate[ROTOR_SPEED + i] = (out.motor_torque[i] - out.shaft_torque[i]) / craft.rotors[i].inertia

    out.airspeed = math.sqrt(air[0] * air[0] + air[1] * air[1] + air[2] * air[2])
    out.height_ellipsoid = height
    out.height_above_ground = above_ground
    out.density = density
    for k in range(3):
        out.velocity_air_body[k] = air[k]
    out.force_body[0] = fx
    out.force_body[1] = fy
    out.force_body[2] = fz
    out.moment_body[0] = mx
    out.moment_body[1] = my
    out.moment_body[2] = mz
