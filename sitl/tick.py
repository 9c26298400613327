"""The whole vehicle's tick, compiled: wind, estimate, control laws, motors and servos, physics, battery."""

import numpy as np

from sitl.control.laws import control_step
from sitl.control.truth import true_estimate
from vehicle_model.battery import battery_step
from vehicle_model.compiled import compiled_loop
from vehicle_model.integrate import runge_kutta
from vehicle_model.records import OUTPUTS
from vehicle_model.state import STATE_COUNT
from vehicle_model.wind import wind_step

__all__ = ["BEYOND", "fly"]

# No state of an aircraft is larger in its SI unit; the equations' products of such states are still finite, so every
# state that is shown has finite forces.
BEYOND = 1e9


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
        true_estimate(state, vehicle, environment, estimates)
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
