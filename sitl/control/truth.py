"""The estimate of a vehicle whose every sensor tells the truth: the seam where sensors and a filter will stand."""

from vehicle_model.atmosphere import air_density
from vehicle_model.compiled import compiled
from vehicle_model.earth import height_above_ellipsoid, local_axes
from vehicle_model.rotation import body_to_ned, euler_from_quaternion, quaternion_multiply
from vehicle_model.state import POSITION, QUATERNION, RATES, ROTOR_SPEED, TILT, VELOCITY

__all__ = ["true_estimate"]


@compiled
def true_estimate(state, vehicle, environment, estimates) -> None:
    """Fill an ESTIMATE array (1,) from a state (20,), a VEHICLE and an ENVIRONMENT array (1,)."""
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
    estimate.battery_voltage = vehicle[0].rotors[0].battery_voltage
