"""Faults as data: a propeller that has lost thrust, a servo that is stuck. They change a writable copy of a vehicle.

vehicle = aircraft.vehicle.copy()
lose_thrust(vehicle, 0, 0.2)                          # the left rotor makes 80 % of its thrust
stick_servo(vehicle, 0, math.radians(45.0))           # the tilt goes to 45 deg and stays there
restore(vehicle, aircraft.vehicle)
"""

import math

import numpy as np

__all__ = ["free_servo", "lose_thrust", "restore", "stick_servo"]


def lose_thrust(vehicle: np.ndarray, rotor: int, fraction: float) -> None:
    """Let a rotor (0 left, 1 right, 2 tail) lose a fraction 0..1 of its healthy thrust; 0 heals it.

    `vehicle` is a writable VEHICLE array of shape (1,). Raises ValueError for a vehicle that is read-only, a rotor it
    has not, or another fraction.
    """
    _check_writable(vehicle)
    _check_index("rotor", rotor, int(vehicle["rotor_count"][0]))
    if not 0.0 <= fraction <= 1.0:
        raise ValueError(f"fraction: expected the lost share of the thrust, 0 to 1, got {fraction}")
    vehicle["rotors"]["thrust_factor"][0, rotor] = 1.0 - fraction


def stick_servo(vehicle: np.ndarray, servo: int, angle: float | None = None) -> None:
    """Stop a servo (0 tilt, 1 left and 2 right aileron, 3 elevator) where it stands, or at an angle [rad].

    It goes to that angle as fast as it can, whatever it is told, and stays; one that stands still already cannot.
    `vehicle` is a writable VEHICLE array of shape (1,). Raises ValueError for a vehicle that is read-only, a servo it
    has not, or an angle outside the servo's travel.
    """
    _check_writable(vehicle)
    servos = vehicle["servos"][0]
    _check_index("servo", servo, len(servos))
    if angle is None:
        servos["rate_limit"][servo] = 0.0
        return
    low, high = float(servos["minimum"][servo]), float(servos["maximum"][servo])
    if not low <= angle <= high:
        travel = f"{math.degrees(low):.6g} to {math.degrees(high):.6g} deg"
        raise ValueError(f"angle: expected one of the servo's travel, {travel}, got {math.degrees(angle):.6g} deg")
    servos["minimum"][servo] = servos["maximum"][servo] = angle


def free_servo(vehicle: np.ndarray, healthy: np.ndarray, servo: int) -> None:
    """Let one servo (as in `stick_servo`) move again, as that of the `healthy` vehicle.

    Raises ValueError for a vehicle that is read-only or a servo it has not.
    """
    _check_writable(vehicle)
    _check_index("servo", servo, len(vehicle["servos"][0]))
    vehicle["servos"][0, servo] = healthy["servos"][0, servo]


def restore(vehicle: np.ndarray, healthy: np.ndarray) -> None:
    """Undo all faults of a writable VEHICLE array by what the `healthy` one says; the battery's voltage stays.

    Raises ValueError for a vehicle that is read-only.
    """
    _check_writable(vehicle)
    vehicle["rotors"]["thrust_factor"] = healthy["rotors"]["thrust_factor"]
    vehicle["servos"] = healthy["servos"]


def _check_writable(vehicle: np.ndarray) -> None:
    if not vehicle.flags.writeable:
        raise ValueError("vehicle: expected a writable copy, as of aircraft.vehicle.copy(), got a read-only record")


def _check_index(name: str, index: int, count: int) -> None:
    if not 0 <= index < count:
        raise ValueError(f"{name}: expected an index from 0 to {count - 1}, got {index}")
