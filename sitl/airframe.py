"""One aircraft in its world, advanced in whole ticks: dynamics, wind, battery, faults, and the control laws on board.

It knows no clock, no socket and no event: whoever owns it decides when to advance, tells the laws what to do through a
setpoint, and reads immutable snapshots.
"""

import math
from typing import TYPE_CHECKING

import numpy as np

from sitl.control.design import Design
from sitl.control.records import NO_LEVEL, SETPOINT
from sitl.control.truth import true_estimate
from sitl.snapshot import Snapshot
from sitl.tick import BEYOND, CRAFT, fly
from vehicle_model.atmosphere import atmosphere
from vehicle_model.battery import make_battery
from vehicle_model.compiled import compiled
from vehicle_model.earth import geodetic, local_axes
from vehicle_model.faults import free_servo, lose_thrust, restore, stick_servo
from vehicle_model.integrate import observe
from vehicle_model.records import OUTPUTS
from vehicle_model.rotation import body_to_ned, euler_from_quaternion, quaternion_multiply, quaternion_normalise
from vehicle_model.state import (
    CONTROL_NAMES,
    POSITION,
    QUATERNION,
    RATES,
    STATE_COUNT,
    STATE_NAMES,
    TILT,
    TILT_COMMAND,
    VELOCITY,
)
from vehicle_model.wind import make_wind

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sitl.flight.view import View
    from vehicle_model.aircraft import Aircraft

__all__ = ["Airframe", "FlightDivergedError"]


class FlightDivergedError(ArithmeticError):
    """The equations of motion gave a number that is not finite or beyond all bounds; the flight cannot go on."""


class Airframe:
    """One tilt-wing in flight, or on its gear.

    Args:
        aircraft: what flies (`vehicle_model.aircraft.load_aircraft`).
        environment: the Earth (`vehicle_model.earth.make_environment`), one ENVIRONMENT record; its wind is that of
            the start, later `wind` sets it. Copied.
        state: initial state (20,), laid out as in `vehicle_model.state`; copied.
        controls: initial controls (7,), as there; copied.
        wind: steady wind, shear and gusts (`vehicle_model.wind.make_wind`); by default the environment's, steady.
        design: the control laws' gains and maps; None leaves them out and the controls to `set_controls`.
        drains: whether the battery is one; otherwise an ideal source, as the paper's.
        rate: ticks per simulated second [Hz].

    The same arguments and the same setpoints and controls at the same ticks give the same bits, however the ticks are
    grouped.

    Attributes:
        craft: CRAFT array (1,), all that changes in flight; `vehicle`, `environment` and `status` are parts of it.
        controls_from_outside: True while `set_controls` and not the laws move the actuators.
        setpoint: SETPOINT array (1,) that the laws follow; replace it by that of a `sitl.flight.demand.Demand`.
        status: STATUS array (1,), what the laws say of themselves.
        vehicle: VEHICLE array (1,), with its faults and its battery's voltage.
    """

    def __init__(
        self,
        aircraft: "Aircraft",
        environment: np.ndarray,
        state: "ArrayLike",
        controls: "ArrayLike",
        *,
        wind: np.ndarray | None = None,
        design: Design | None = None,
        drains: bool = True,
        rate: int = 400,
    ) -> None:
        if rate < 1:
            msg = f"rate: expected at least 1 step per second, got {rate}"
            raise ValueError(msg)
        self.aircraft = aircraft
        self.rate = rate
        self.tick = 0
        self.craft = np.zeros(1, CRAFT)
        craft = self.craft[0]
        self.vehicle, self.environment, self.status = craft["vehicle"], craft["environment"], craft["status"]
        self._state, self._controls, self._following = craft["state"], craft["controls"], craft["following"]
        self._wind, self._battery = craft["wind"], craft["battery"]
        self._estimate, self._memory = craft["estimate"], craft["memory"]
        self.vehicle[:] = aircraft.vehicle
        self.environment[:] = environment
        self._wind[:] = make_wind(environment[0]["wind_ned"]) if wind is None else wind
        self.controls_from_outside = design is None
        self.setpoint = np.zeros(1, SETPOINT)
        # Without laws the compiled loop still wants their records: those of no design, never looked at.
        self._design = design or Design.none()
        self._drains = drains
        self._rate_of_change = np.empty(STATE_COUNT)
        self._seen = np.empty(SEEN_COUNT)
        self.reset(state, controls)

    @property
    def time(self) -> float:
        """Simulated seconds since the start: ticks over rate, so nothing accumulates."""
        return self.tick / self.rate

    @property
    def state(self) -> np.ndarray:
        """Copy of the state, shape (20,)."""
        return self._state.copy()

    @property
    def controls(self) -> np.ndarray:
        """Copy of the controls in force, shape (7,)."""
        return self._controls.copy()

    @property
    def battery(self) -> tuple[float, float, float | None]:
        """Voltage under load [V], current [A] and the share of the charge left 0..1, None if it never empties."""
        pack = self._battery[0]
        remaining = float(pack["charge"] / pack["capacity"]) if self._drains else None
        return float(pack["voltage"]), float(pack["current"]), remaining

    def set_controls(self, controls: "ArrayLike") -> None:
        """Hold these controls (7,) from the next tick on; the laws overwrite them unless `controls_from_outside`.

        Raises ValueError for a wrong shape or a value that is not finite, and then changes nothing.
        """
        self._controls[:] = _finite(controls, CONTROL_NAMES, "controls")
        self._following[:] = self._controls
        # Whatever the laws remember is of another flight; what the servos were told last is this.
        self._memory["level"] = NO_LEVEL
        self.status["servo_command"][0] = self._controls[TILT_COMMAND:]

    def reset(self, state: "ArrayLike", controls: "ArrayLike") -> None:
        """Put the vehicle into this state (20,) with these controls (7,), its battery full; time goes on.

        Raises ValueError as `set_controls` does, or for a quaternion far from unit length.
        """
        values = _finite(state, STATE_NAMES, "state")
        attitude = values[QUATERNION : QUATERNION + 4]
        length = float(np.sqrt(attitude @ attitude))
        if not 0.5 < length < 2.0:
            msg = f"state: expected a unit quaternion, got one of length {length:.3g}"
            raise ValueError(msg)
        commands = _finite(controls, CONTROL_NAMES, "controls")
        self._state[:] = values
        self.set_controls(commands)
        self._state[QUATERNION : QUATERNION + 4] /= length
        self._battery[:] = make_battery(self.aircraft.battery)
        true_estimate(self._state, self.vehicle, self.environment, self._estimate)

    def advance(self, ticks: int = 1) -> None:
        """Fly so many ticks of 1/rate.

        Raises FlightDivergedError when the state stops being finite or leaves all bounds (1e9 in its SI unit); it is
        then left as before the call.
        """
        design = self._design
        if not fly(
            self.craft, self.setpoint, design.gains, design.table, design.axes, design.schedule, design.vehicle,
            not self.controls_from_outside, self._drains, self.tick, self.rate, ticks,
        ):  # fmt: skip
            values = zip(STATE_NAMES, self._state, strict=True)
            broken = ", ".join(name for name, value in values if not abs(value) <= BEYOND)
            self._state[:] = self.craft["before"][0]
            msg = f"flight diverged after t = {self.time:.4f} s: {broken} beyond {BEYOND:g} or not finite"
            raise FlightDivergedError(msg)
        self.tick += ticks

    def set_wind(self, steady_ned: "ArrayLike") -> None:
        """Let this be the steady wind from now on (NED, blowing to) [m/s]; shear and gusts stay."""
        self._wind["steady_ned"][0] = _finite(steady_ned, ("north", "east", "down"), "wind")

    def lose_thrust(self, rotor: int, fraction: float) -> None:
        """See `vehicle_model.faults.lose_thrust`."""
        lose_thrust(self.vehicle, rotor, fraction)

    def stick_servo(self, servo: int, angle: float | None = None) -> None:
        """See `vehicle_model.faults.stick_servo`."""
        stick_servo(self.vehicle, servo, angle)

    def repair_servo(self, servo: int) -> None:
        """See `vehicle_model.faults.free_servo`."""
        free_servo(self.vehicle, self.aircraft.vehicle, servo)

    def repair(self) -> None:
        """End all faults."""
        restore(self.vehicle, self.aircraft.vehicle)

    def look(self, view: "View") -> None:
        """Refill what the flight's events see."""
        _see(self.craft, self._seen)
        v = self._seen.tolist()
        view.time = self.tick / self.rate
        view.north, view.east, view.down, view.vn, view.ve, view.vd = v[0:6]
        view.roll, view.pitch, view.yaw, view.p, view.q, view.r = v[6:12]
        view.airspeed, view.wind_north, view.wind_east, view.tilt = v[12:16]
        view.tilt_command, view.thrust = v[16:18]
        view.rotor_speeds = (v[18], v[19], v[20])
        view.rotor_speed_commands = (v[21], v[22], v[23])
        view.battery_voltage, view.battery_current = v[24:26]
        view.battery_remaining = v[26] if self._drains else 1.0
        view.tilt_fault = v[27]

    def snapshot(self) -> Snapshot:
        """All there is to see of the vehicle now."""
        outputs = np.zeros(1, OUTPUTS)
        view = np.empty(VIEW_COUNT)
        state, controls = self._state.copy(), self._controls.copy()
        observe(state, controls, self.vehicle, self.environment, outputs, self._rate_of_change)
        _look(state, self.vehicle, self.environment, outputs, view)
        for array in (state, controls, outputs):
            array.flags.writeable = False
        v = view.tolist()
        voltage, current, remaining = self.battery
        if remaining is None:  # the ideal source gives what is asked
            voltage = float(self.vehicle["rotors"]["battery_voltage"][0, 0])
            current = float(outputs[0]["electrical_power"].sum()) / voltage
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
            battery_voltage=voltage,
            battery_current=current,
            battery_remaining=remaining,
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


SEEN_COUNT = 28


@compiled
def _see(crafts, seen) -> None:
    """Write into `seen` (28,) what the flight's events see: estimate, status and battery of a CRAFT array (1,)."""
    craft = crafts[0]
    true_estimate(craft.state, craft.vehicle, craft.environment, craft.estimate)
    estimate, status, pack = craft.estimate[0], craft.status[0], craft.battery[0]
    for k in range(3):
        seen[k] = estimate.position_ned[k]
        seen[3 + k] = estimate.velocity_ned[k]
        seen[6 + k] = estimate.euler[k]
        seen[9 + k] = estimate.rates[k]
        seen[18 + k] = estimate.rotor_speed[k]
        seen[21 + k] = status.rotor_speed_command[k]
    seen[12] = estimate.airspeed
    seen[13], seen[14] = estimate.wind_ned[0], estimate.wind_ned[1]
    seen[15], seen[16] = estimate.servo[0], status.servo_command[0]
    seen[17], seen[27] = status.thrust, status.tilt_fault
    seen[24], seen[25], seen[26] = pack.voltage, pack.current, pack.charge / pack.capacity
