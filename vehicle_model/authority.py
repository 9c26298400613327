"""How much control an aircraft has left: thrust to weight in hover, and moments beyond what a trim needs."""

import math
from dataclasses import dataclass

import numpy as np

from vehicle_model.aircraft import Aircraft
from vehicle_model.compiled import compiled
from vehicle_model.dynamics import derivative
from vehicle_model.earth import STANDARD_GRAVITY
from vehicle_model.motor import motor_current, motor_torque
from vehicle_model.records import OUTPUTS
from vehicle_model.rotor import rotor_loads
from vehicle_model.state import AILERON_LEFT, AILERON_RIGHT, ELEVATOR, ROTOR_SPEED, STATE_COUNT
from vehicle_model.steady_flight import SteadyFlight, trim_steady
from vehicle_model.trim import still_air

__all__ = ["Margins", "hover_margins", "margins", "speed_at", "thrust_to_weight"]


@dataclass(frozen=True)
class Margins:
    """Control left about each axis: the smaller of the moments to either side, over half of both together.

    1 is a trim in the middle of its authority, 0 one at its end. `moments` (3, 2): most negative and most positive
    change of roll, pitch and yaw moment [N m] that the actuators can make from the trim.
    """

    roll: float
    pitch: float
    yaw: float
    moments: np.ndarray


@compiled
def shaft_excess(
    vehicle, index: int, throttle: float, speed: float, axial: float, edgewise: float, density: float
) -> float:
    """Motor torque less what the propeller takes [N m] at a speed [rad/s]."""
    rotor = vehicle[0].rotors[index]
    _, resisting, _ = rotor_loads(rotor, speed, axial, edgewise, density)
    return motor_torque(rotor, motor_current(rotor, throttle, speed), speed) - resisting


def speed_at(
    aircraft: Aircraft, index: int, throttle: float, axial: float = 0.0, edgewise: float = 0.0, density: float = 1.225
) -> float:
    """Steady speed [rad/s] of a rotor at a throttle in a given inflow (as in `vehicle_model.rotor`) [m/s]."""
    if throttle == 0.0:
        return 0.0

    from scipy.optimize import brentq

    rotor = aircraft.vehicle["rotors"][0, index]

    def excess(size: float) -> float:
        speed = math.copysign(size, throttle)
        return math.copysign(1.0, throttle) * shaft_excess(
            aircraft.vehicle, index, throttle, speed, axial, edgewise, density
        )

    root, _ = brentq(excess, 1.0, 3.0 * float(rotor["battery_voltage"] / rotor["torque_constant"]), full_output=True)
    return math.copysign(root, throttle)


def thrust_to_weight(aircraft: Aircraft, density: float = 1.225) -> float:
    """Static thrust of both wing rotors at full throttle over the weight."""
    outputs, rate, state = np.zeros(1, OUTPUTS), np.empty(STATE_COUNT), np.zeros(STATE_COUNT)
    state[6] = 1.0
    for index in (0, 1):
        state[ROTOR_SPEED + index] = speed_at(aircraft, index, 1.0, density=density)
    derivative(state, np.zeros(7), aircraft.vehicle, still_air(), outputs, rate)
    return float(outputs["thrust"][0, :2].sum() / (aircraft.vehicle["mass"][0] * STANDARD_GRAVITY))


def margins(aircraft: Aircraft, flight: SteadyFlight) -> Margins:
    """Control margins at a steady flight near hover.

    Roll moves the two wing thrusts apart with their sum kept, until one reaches full or no throttle; pitch moves tail
    rotor and elevator, yaw the ailerons, to their limits. Rotors at full throttle are taken at their static speeds.
    """
    vehicle, world = aircraft.vehicle, still_air()
    outputs, rate = np.zeros(1, OUTPUTS), np.empty(STATE_COUNT)
    servos = vehicle[0]["servos"]

    def moment(**change: float) -> np.ndarray:
        state = flight.state.copy()
        for name, value in change.items():
            state[PLACES[name]] = value
        derivative(state, flight.controls, vehicle, world, outputs, rate)
        return outputs[0]["moment_body"].copy()

    def thrusts() -> np.ndarray:
        return outputs[0]["thrust"][:2].copy()

    neutral = moment()
    trimmed = thrusts()
    top = [speed_at(aircraft, index, 1.0) for index in (0, 1)]
    moment(left=top[0], right=top[1])
    room = np.minimum(thrusts() - trimmed, trimmed[::-1])
    left, right = flight.rotor_speeds[:2]

    def parted(up: int) -> np.ndarray:
        # Thrust goes with the square of the speed: near enough to find speeds whose thrusts keep their sum.
        change = np.array([room[up], -room[up]]) * (1.0 if up == 0 else -1.0)
        factors = np.sqrt((trimmed + change) / trimmed)
        return moment(left=left * factors[0], right=right * factors[1])

    tail = [speed_at(aircraft, 2, throttle) for throttle in (-1.0, 1.0)]
    low, high = servos["minimum"], servos["maximum"]
    ends = np.array(
        [
            [parted(1)[0], parted(0)[0]],
            [moment(tail=tail[1], elevator=high[3])[1], moment(tail=tail[0], elevator=low[3])[1]],
            [
                moment(aileron_left=high[1], aileron_right=low[2])[2],
                moment(aileron_left=low[1], aileron_right=high[2])[2],
            ],
        ]
    )
    changes = np.sort(ends - neutral[:, None], axis=1)
    size = np.abs(changes)
    left_over = np.where((changes[:, 0] < 0.0) & (changes[:, 1] > 0.0), 2.0 * size.min(axis=1) / size.sum(axis=1), 0.0)
    return Margins(float(left_over[0]), float(left_over[1]), float(left_over[2]), changes)


PLACES = {
    "left": ROTOR_SPEED, "right": ROTOR_SPEED + 1, "tail": ROTOR_SPEED + 2,
    "aileron_left": AILERON_LEFT, "aileron_right": AILERON_RIGHT, "elevator": ELEVATOR,
}  # fmt: skip


def hover_margins(
    aircraft: Aircraft, wind: float = 8.0, directions: int = 12
) -> list[tuple[float, SteadyFlight, Margins]]:
    """Trims and margins hovering in a wind [m/s] from evenly spaced directions; fuselage pitch level, bank free.

    Returns (direction the wind comes from, from the nose to the right [rad], trim, margins). Raises TrimError where
    the aircraft cannot hover.
    """
    rows = []
    for i in range(directions):
        bearing = 2.0 * math.pi * i / directions
        flight = trim_steady(aircraft, wind, direction=bearing)
        rows.append((bearing, flight, margins(aircraft, flight)))
    return rows
