"""The vehicle as one object: aircraft, Earth, state and controls, advanced in whole steps.

It knows no clock and no socket: whoever owns it decides when to advance, and reads immutable snapshots.
"""

import math
from typing import TYPE_CHECKING

import numpy as np

from sitl.snapshot import Snapshot
from vehicle_model.atmosphere import atmosphere
from vehicle_model.compiled import compiled
from vehicle_model.earth import geodetic, local_axes
from vehicle_model.integrate import advance, observe
from vehicle_model.records import OUTPUTS
from vehicle_model.rotation import body_to_ned, euler_from_quaternion, quaternion_multiply, quaternion_normalise
from vehicle_model.state import (
    CONTROL_COUNT,
    CONTROL_NAMES,
    POSITION,
    QUATERNION,
    RATES,
    STATE_COUNT,
    STATE_NAMES,
    TILT,
    VELOCITY,
)

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from vehicle_model.aircraft import Aircraft

__all__ = ["FlightDivergedError", "Simulation"]


# No state of an aircraft is larger in its SI unit; the equations' products of such states are still finite, so every
# state that is shown has finite forces.
BEYOND = 1e9


class FlightDivergedError(ArithmeticError):
    """The equations of motion gave a number that is not finite or beyond all bounds; the flight cannot go on."""


class Simulation:
    """One tilt-wing in flight, or on its gear.

    Args:
        aircraft: what flies (`vehicle_model.aircraft.load_aircraft`).
        environment: Earth and wind (`vehicle_model.earth.make_environment`), one ENVIRONMENT record.
        state: initial state (20,), laid out as in `vehicle_model.state`; copied.
        controls: initial controls (7,), as there; copied.
        seed: from which random streams spawn, one per source. Nothing in the flight itself is random.
        rate: integration steps per simulated second [Hz].

    The same arguments and the same controls at the same ticks give the same bits, however the steps are grouped.
    """

    def __init__(
        self,
        aircraft: "Aircraft",
        environment: np.ndarray,
        state: "ArrayLike",
        controls: "ArrayLike",
        *,
        seed: int = 0,
        rate: int = 400,
    ) -> None:
        if rate < 1:
            msg = f"rate: expected at least 1 step per second, got {rate}"
            raise ValueError(msg)
        self.aircraft = aircraft
        self.environment = environment
        self.seed = seed
        self.rate = rate
        self.tick = 0
        self._step = 1.0 / rate
        self._vehicle = aircraft.vehicle
        self._state = np.empty(STATE_COUNT)
        self._before = np.empty(STATE_COUNT)
        self._controls = np.empty(CONTROL_COUNT)
        self._rate_of_change = np.empty(STATE_COUNT)
        self.reset(state)
        self.set_controls(controls)

    @property
    def time(self) -> float:
        """Simulated seconds since the start: steps over rate, so nothing accumulates."""
        return self.tick / self.rate

    @property
    def state(self) -> np.ndarray:
        """Copy of the state, shape (20,)."""
        return self._state.copy()

    @property
    def controls(self) -> np.ndarray:
        """Copy of the controls, shape (7,)."""
        return self._controls.copy()

    def set_controls(self, controls: "ArrayLike") -> None:
        """Hold these controls (7,) from the next step on.

        Raises ValueError for a wrong shape or a value that is not finite, and then changes nothing.
        """
        self._controls[:] = _finite(controls, CONTROL_NAMES, "controls")

    def reset(self, state: "ArrayLike") -> None:
        """Put the vehicle into this state (20,); time and controls go on. Raises ValueError as `set_controls` does."""
        values = _finite(state, STATE_NAMES, "state")
        attitude = values[QUATERNION : QUATERNION + 4]
        length = float(np.sqrt(attitude @ attitude))
        if not 0.5 < length < 2.0:
            msg = f"state: expected a unit quaternion, got one of length {length:.3g}"
            raise ValueError(msg)
        self._state[:] = values
        self._state[QUATERNION : QUATERNION + 4] /= length

    def advance(self, steps: int = 1) -> None:
        """Fly so many steps of 1/rate with the present controls.

        Raises FlightDivergedError when the state stops being finite or leaves all bounds (1e9 in its SI unit); it is
        then left as before the call.
        """
        state, before = self._state, self._before
        if not _fly(state, before, self._controls, self._vehicle, self.environment, self._step, steps):
            broken = ", ".join(name for name, value in zip(STATE_NAMES, state, strict=True) if not abs(value) <= BEYOND)
            state[:] = before
            msg = f"flight diverged after t = {self.time:.4f} s: {broken} beyond {BEYOND:g} or not finite"
            raise FlightDivergedError(msg)
        self.tick += steps

    def snapshot(self) -> Snapshot:
        """All there is to see of the vehicle now."""
        outputs = np.zeros(1, OUTPUTS)
        view = np.empty(VIEW_COUNT)
        state, controls = self._state.copy(), self._controls.copy()
        observe(state, controls, self._vehicle, self.environment, outputs, self._rate_of_change)
        _look(state, self._vehicle, self.environment, outputs, view)
        for array in (state, controls, outputs):
            array.flags.writeable = False
        v = view.tolist()
        return Snapshot(
            time=self.tick / self.rate,
            state=state,
            controls=controls,
            outputs=outputs[0],
            latitude=v[0],
            longitude=v[1],
            height_ellipsoid=v[2],
            altitude_msl=v[2],
            position_ned=(v[3], v[4], v[5]),
            velocity_ned=(v[6], v[7], v[8]),
            quaternion=(v[9], v[10], v[11], v[12]),
            roll=v[13],
            pitch=v[14],
            yaw=v[15],
            rates=(v[16], v[17], v[18]),
            specific_force=(v[19], v[20], v[21]),
            airspeed=v[22],
            pressure=v[23],
            temperature=v[24],
            density=v[25],
            wind_ned=(v[26], v[27], v[28]),
            tilt=v[29],
            on_ground=v[30] != 0.0,
        )


def _finite(values: "ArrayLike", names: tuple[str, ...], what: str) -> np.ndarray:
    """Copy as floats, one for each name; raises ValueError naming what is wrong."""
    array = np.array(values, dtype=np.float64)
    if array.shape != (len(names),):
        msg = f"{what}: expected {len(names)} numbers, got an array of shape {array.shape}"
        raise ValueError(msg)
    broken = _not_finite(array, names)
    if broken:
        values = ", ".join(f"{name} = {array[names.index(name)]}" for name in broken)
        msg = f"{what}: expected finite numbers, got {values}"
        raise ValueError(msg)
    return array


def _not_finite(array: np.ndarray, names: tuple[str, ...]) -> list[str]:
    """Names of the values that are nan or inf."""
    return [name for name, value in zip(names, array, strict=True) if not math.isfinite(value)]


@compiled
def _fly(state, before, controls, vehicle, environment, dt: float, steps: int) -> bool:
    """Advance the state (20,) and keep the one before; False if a value has left all bounds."""
    for k in range(STATE_COUNT):
        before[k] = state[k]
    advance(state, controls, vehicle, environment, dt, steps)
    finite = True
    for k in range(STATE_COUNT):
        finite = finite and abs(state[k]) <= BEYOND  # not a number is not either
    return finite


VIEW_COUNT = 31


@compiled
def _look(state, vehicle, environment, outputs, view) -> None:
    """Write into `view` (31,) what the equations of motion need not know: place, local axes, air, accelerometer."""
    out, world = outputs[0], environment[0]
    north, east, down = state[POSITION], state[POSITION + 1], state[POSITION + 2]
    q0, q1, q2, q3 = state[QUATERNION], state[QUATERNION + 1], state[QUATERNION + 2], state[QUATERNION + 3]
    latitude, longitude, height = geodetic(north, east, down, world)
    temperature, pressure, density, _ = atmosphere(height)

    l0, l1, l2, l3 = local_axes(north, east, down, world)
    a0, a1, a2, a3 = quaternion_normalise(*quaternion_multiply(l0, l1, l2, l3, q0, q1, q2, q3))
    if a0 < 0.0:  # of the two quaternions of an attitude, the one with the smaller turn
        a0, a1, a2, a3 = -a0, -a1, -a2, -a3
    roll, pitch, yaw = euler_from_quaternion(a0, a1, a2, a3)
    velocity = body_to_ned(a0, a1, a2, a3, state[VELOCITY], state[VELOCITY + 1], state[VELOCITY + 2])
    wind = body_to_ned(l0, l1, l2, l3, world.wind_ned[0], world.wind_ned[1], world.wind_ned[2])

    view[0], view[1], view[2] = latitude, longitude, height
    view[3], view[4], view[5] = north, east, down
    view[9], view[10], view[11], view[12] = a0, a1, a2, a3
    view[13], view[14], view[15] = roll, pitch, yaw
    for k in range(3):
        view[6 + k] = velocity[k]
        view[16 + k] = state[RATES + k]
        view[19 + k] = out.force_body[k] / vehicle[0].mass
        view[26 + k] = wind[k]
    view[22] = out.airspeed
    view[23], view[24], view[25] = pressure, temperature, density
    view[29] = state[TILT]
    touching = 0.0
    for i in range(vehicle[0].contact_count):
        if out.contact_force_body[i, 2] != 0.0:
            touching = 1.0
    view[30] = touching
