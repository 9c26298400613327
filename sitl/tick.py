"""The whole vehicle's tick, compiled: wind, estimate, control laws, motors and servos, physics, battery."""

import numpy as np

from sitl.control.laws import control_step
from sitl.control.records import ESTIMATE, MEMORY, STATUS
from sitl.control.truth import true_estimate
from vehicle_model.battery import battery_step
from vehicle_model.compiled import compiled_loop
from vehicle_model.integrate import runge_kutta
from vehicle_model.records import BATTERY, ENVIRONMENT, OUTPUTS, VEHICLE, WIND
from vehicle_model.state import CONTROL_COUNT, STATE_COUNT
from vehicle_model.wind import wind_step

__all__ = ["BEYOND", "CRAFT", "fly"]

# No state of an aircraft is larger in its SI unit; the equations' products of such states are still finite, so every
# state that is shown has finite forces.
BEYOND = 1e9

# One aircraft in its world, all that changes while it flies. It is one record because each array that is handed to
# compiled code costs 0.1 us, in flight every 20 ms.
CRAFT = np.dtype(
    [
        ("state", np.float64, (STATE_COUNT,)),
        ("before", np.float64, (STATE_COUNT,)),  # the state when the latest call began
        ("controls", np.float64, (CONTROL_COUNT,)),  # in force
        ("following", np.float64, (CONTROL_COUNT,)),  # what the laws have decided: in force from the next tick on
        ("vehicle", VEHICLE, (1,)),  # with its faults and its battery's voltage
        ("environment", ENVIRONMENT, (1,)),  # with the wind of the moment
        ("wind", WIND, (1,)),
        ("battery", BATTERY, (1,)),
        ("estimate", ESTIMATE, (1,)),
        ("memory", MEMORY, (1,)),
        ("status", STATUS, (1,)),
        ("outputs", OUTPUTS, (1,)),  # of the latest right-hand side
        ("work", np.float64, (3, STATE_COUNT)),  # scratch
    ],
    align=True,
)


@compiled_loop
def fly(crafts, setpoints, gains, table, axes, schedule, believed, controlled, drains, first, rate, steps) -> bool:
    """Fly a CRAFT array (1,) so many `steps`, the ticks from number `first` on; False if its state has left all bounds.

    With `controlled` the laws see each tick's estimate and their commands act from the next tick on, as those of a
    flight computer do. Else the controls in force stay.
    With `drains` the battery is a battery, otherwise an ideal source. There are `rate` ticks a second.
    """
    craft = crafts[0]
    dt = 1.0 / rate
    state, controls, following = craft.state, craft.controls, craft.following
    vehicle, environment, battery, outputs = craft.vehicle, craft.environment, craft.battery, craft.outputs
    estimate, world = craft.estimate[0], environment[0]
    for k in range(STATE_COUNT):
        craft.before[k] = state[k]
    for tick in range(first, first + steps):
        true_estimate(state, vehicle, environment, craft.estimate)
        above_ground = world.height_ellipsoid - estimate.position_ned[2] - world.ground_height
        wind_step(craft.wind, tick / rate, above_ground, estimate.airspeed, dt, environment)
        if controlled:
            for k in range(CONTROL_COUNT):
                controls[k] = following[k]
            control_step(
                craft.estimate, setpoints, gains, table, axes, schedule, believed, craft.memory, craft.status,
                following, dt,
            )  # fmt: skip
        runge_kutta(state, controls, vehicle, environment, dt, outputs, craft.work)
        if drains:
            battery_step(battery, vehicle, outputs, dt)
    finite = True
    for k in range(STATE_COUNT):
        finite = finite and abs(state[k]) <= BEYOND  # not a number is not either
    return finite
