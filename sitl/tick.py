"""The whole vehicle's tick, compiled: wind, estimate, control laws, motors and servos, physics, battery."""

import numpy as np

from sitl.control.laws import control_step
from vehicle_model.atmosphere import air_density
from vehicle_model.battery import battery_step
from vehicle_model.compiled import compiled, compiled_loop
from vehicle_model.earth import height_above_ellipsoid, local_axes
from vehicle_model.integrate import runge_kutta
from vehicle_model.records import OUTPUTS
from vehicle_model.rotation import body_to_ned, euler_from_quaternion, quaternion_multiply
from vehicle_model.state import POSITION, QUATERNION, RATES, ROTOR_SPEED, STATE_COUNT, TILT, VELOCITY
from vehicle_model.wind import wind_step

__all__ = ["BEYOND", "fly", "true_estimate"]

# No state of an aircraft is larger in its SI unit; the equations' products of such states are still finite, so every
# state that is shown has finite forces.
BEYOND = 1e9


@compiled
def true_estimate(state, environment, estimates) -> None:
    """Fill an ESTIMATE array with the truth: the seam where sensors and a filter will stand."""
    estimate, world = estimates[0], environment[0]
    north, east, down = state[POSITION], state[POSITION + 1], state[POSITION + 2]
    height = height_above_ellipsoid(north, east, down, world)
    l0, l1, l2, l3 = local_axes(north, east, down, world)
    q0, q1, q2, q3 = quaternion_multiply(
        l0, l1, l2, l3, state[QUATERNION], state[QUATERNION + 1], state[QUATERNION + 2], state[QUATERNION + 3]
    )
    velocity = body_to_ned(q0, q1, q2, q3, state[VELOCITY], state[VELOCITY + 1], state[VELOCITY + 2])
    wind = body_to_ned(l0, l1, l2, l3, world.wind_ned[0], world.wind_ned[1], world.wind_ned[2])
    euler = euler_from_quaternion(q0, q1, q2, q3)
    estimate.position_ned[0] = north
    estimate.position_ned[1] = east
    estimate.position_ned[2] = world.height_ellipsoid - height
    estimate.quaternion[0] = q0
    estimate.quaternion[1] = q1
    estimate.quaternion[2] = q2
    estimate.quaternion[3] = q3
    square = 0.0
    for k in range(3):
        estimate.velocity_ned[k] = velocity[k]
        estimate.wind_ned[k] = wind[k]
        estimate.euler[k] = euler[k]
        estimate.rates[k] = state[RATES + k]
        estimate.rotor_speed[k] = state[ROTOR_SPEED + k]
        square += (velocity[k] - wind[k]) ** 2
    for k in range(4):
        estimate.servo[k] = state[TILT + k]
    estimate.airspeed = square**0.5
    estimate.density = air_density(height)


@compiled_loop
def fly(state, controls, following, vehicle, environment, wind, battery, drains, estimates, setpoints, gains, table,
        axes, schedule, believed, memories, statuses, controlled, time, dt, steps) -> bool:  # fmt: skip
    """Fly so many ticks of `dt` seconds from `time` [s]; False if a state has left all bounds.

    With `controlled` the laws see each tick's estimate and their commands act from the next tick on, as those of a
    flight computer do: `controls` (7,) are in force, `following` (7,) come next. Else `controls` stay.
    With `drains` the battery is a battery, otherwise an ideal source.
    """
    outputs = np.zeros(1, OUTPUTS)
    work = np.empty((3, STATE_COUNT))
    estimate, world = estimates[0], environment[0]
    for tick in range(steps):
        true_estimate(state, environment, estimates)
        above_ground = world.height_ellipsoid - estimate.position_ned[2] - world.ground_height
        wind_step(wind, time + tick * dt, above_ground, estimate.airspeed, dt, environment)
        if controlled:
            for k in range(7):
                controls[k] = following[k]
            control_step(
                estimates, setpoints, gains, table, axes, schedule, believed, memories, statuses, following, dt
            )
        runge_kutta(state, controls, vehicle, environment, dt, outputs, work)
        if drains:
            battery_step(battery, vehicle, outputs, dt)
    finite = True
    for k in range(STATE_COUNT):
        finite = finite and abs(state[k]) <= BEYOND  # not a number is not either
    return finite
