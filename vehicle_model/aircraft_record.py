"""From the tables of an aircraft file to the VEHICLE record that the compiled equations read.

Positions move to the centre of mass here, and everything given for one side is mirrored.
"""

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from vehicle_model.aircraft_tables import AircraftTables, HorizontalTail, Rotor, Servo, Strip, VerticalTail, Wing
from vehicle_model.records import VEHICLE
from vehicle_model.surface import max_lift_angle

__all__ = ["ROTOR_NAMES", "surface_names", "vehicle_record"]

ROTOR_NAMES = ("left", "right", "tail")

_LEFT, _RIGHT = -1, 1
_NONE = -1  # no rotor, no servo
_AILERON = {_LEFT: 1, _RIGHT: 2}  # servos in the order of VEHICLE
_ELEVATOR = 3

_Vector = tuple[float, float, float]


def surface_names(tables: AircraftTables) -> tuple[str, ...]:
    """Names of the surfaces in the order of VEHICLE: strips of the left wing from the root out, right wing, tail, fin."""
    sides = [f"{side} {strip.name}" for side in ("left", "right") for strip in tables.wing.strips]
    return (*sides, "horizontal tail", "vertical tail")


def vehicle_record(tables: AircraftTables) -> npt.NDArray[np.void]:
    """VEHICLE array of shape (1,), read-only, of the aircraft in `tables`."""
    origin = tables.mass_properties.centre_of_mass
    array = np.zeros(1, VEHICLE)
    vehicle = array[0]
    inertia = _inertia(tables)
    contacts = [
        (_less(_on_side(contact.position, side), origin), contact.stiffness, contact.damping, contact.friction)
        for contact in tables.contacts
        for side in ((_LEFT, _RIGHT) if contact.mirrored else (_RIGHT,))
    ]
    surfaces = _surfaces(tables, origin)
    values: dict[str, Any] = {
        "mass": tables.mass_properties.mass,
        "inertia": inertia,
        "inertia_inverse": np.linalg.inv(inertia),
        "pivot": _less(tables.wing.pivot, origin),
        "downwash_area": math.pi * tables.wing.span**2 / 4,
        "fuselage_position": _less(tables.fuselage.position, origin),
        "fuselage_drag_area": tables.fuselage.drag_area,
        # The strips, the tail and the propellers damp an aircraft by their local velocities.
        "damping_area": 0.0,
        "damping_span": 0.0,
        "damping_chord": 0.0,
        "roll_damping": 0.0,
        "pitch_damping": 0.0,
        "yaw_damping": 0.0,
        "tail_gain": tables.elevator.tail_gain,
        "rotor_count": len(ROTOR_NAMES),
        "surface_count": len(surfaces),
        "contact_count": len(contacts),
    }
    rows: dict[str, list[tuple[Any, ...]]] = {
        "servos": [_servo(tables.servos.tilt), *[_servo(tables.servos.aileron)] * 2, _servo(tables.servos.elevator)],
        "rotors": _rotors(tables, origin),
        "surfaces": surfaces,
        "contacts": contacts,
    }
    for name in VEHICLE.names or ():
        if name in rows:
            vehicle[name][: len(rows[name])] = rows[name]
        else:
            vehicle[name] = values[name]
    for surface in vehicle["surfaces"][: len(surfaces)]:
        surface["max_lift_angle"] = max_lift_angle(surface)
    array.flags.writeable = False
    return array


def _less(position: _Vector, origin: _Vector) -> _Vector:
    return position[0] - origin[0], position[1] - origin[1], position[2] - origin[2]


def _on_side(position: _Vector, side: int) -> _Vector:
    return position[0], side * position[1], position[2]


def _inertia(tables: AircraftTables) -> npt.NDArray[np.float64]:
    m = tables.mass_properties
    return np.array([[m.ixx, 0.0, -m.ixz], [0.0, m.iyy, 0.0], [-m.ixz, 0.0, m.izz]])


def _servo(servo: Servo) -> tuple[float, ...]:
    return servo.time_constant, servo.rate_limit, servo.minimum, servo.maximum


def _rotors(tables: AircraftTables, origin: _Vector) -> list[tuple[Any, ...]]:
    wing, tail, voltage = tables.rotors.wing, tables.rotors.tail, tables.battery.voltage
    hand = 1.0 if wing.spin == "right-handed" else -1.0
    pair = [
        _rotor(wing, _on_side(wing.hub, side), axis=(1.0, 0.0, 0.0), tilts=1, spin=side * hand, voltage=voltage)
        for side in (_LEFT, _RIGHT)
    ]
    hand = 1.0 if tail.spin == "right-handed" else -1.0
    return [*pair, _rotor(tail, _less(tail.hub, origin), axis=(0.0, 0.0, -1.0), tilts=0, spin=hand, voltage=voltage)]


def _rotor(rotor: Rotor, hub: _Vector, *, axis: _Vector, tilts: int, spin: float, voltage: float) -> tuple[Any, ...]:
    """A row of ROTOR, in the order of its fields."""
    motor = rotor.motor
    return (
        hub,
        axis,
        tilts,
        spin,
        rotor.radius,
        rotor.twist,
        rotor.lift_slope,
        rotor.blades,
        rotor.blade_chord,
        rotor.profile_drag,
        rotor.inertia,
        motor.velocity_constant,
        motor.resistance,
        motor.no_load_current,
        voltage,
        motor.max_current,
        motor.max_power,
        motor.throttle == "power",
        -1.0 if motor.reversible else 0.0,
    )


def _surfaces(tables: AircraftTables, origin: _Vector) -> list[tuple[Any, ...]]:
    strips = [_strip(tables.wing, strip, side) for side in (_LEFT, _RIGHT) for strip in tables.wing.strips]
    horizontal, vertical = tables.tail.horizontal, tables.tail.vertical
    return [*strips, _horizontal(horizontal, origin), _vertical(vertical, origin)]


def _strip(wing: Wing, strip: Strip, side: int) -> tuple[Any, ...]:
    """A row of SURFACE, in the order of its fields, for one side's strip of the wing, in wing axes from the pivot."""
    chord = wing.chord_at(strip.y)
    slope = math.tan(wing.dihedral)
    literal = strip.wetted and wing.slipstream == "paper"  # eqs (9)-(11): the wake alone, and no induced drag
    return (
        (wing.quarter_chord_x, side * strip.y, wing.quarter_chord_z - strip.y * slope),
        *_chord_and_normal((0.0, side * math.sin(wing.dihedral), math.cos(wing.dihedral)), wing.incidence),
        1,
        chord * strip.width,
        chord,
        *_polar(wing, induced_drag=0.0 if literal else wing.induced_drag),
        max(side, 0) if strip.wetted else _NONE,  # rotors: 0 left, 1 right
        (1.0 if literal else wing.wake_factor) if strip.wetted else 0.0,
        0.0 if literal else 1.0,
        _AILERON[side] if strip.aileron else _NONE,
        wing.aileron_effectiveness if strip.aileron else 0.0,
        0.0,  # downwash: none on the wing itself
    )


def _horizontal(tail: HorizontalTail, origin: _Vector) -> tuple[Any, ...]:
    directions = _chord_and_normal((0.0, 0.0, 1.0), tail.incidence)
    fixed = (_less(tail.position, origin), *directions, 0, tail.area, tail.area / tail.span)
    flap = (_ELEVATOR, tail.elevator_effectiveness, tail.downwash_factor)
    return (*fixed, *_polar(tail, tail.induced_drag), _NONE, 0.0, 1.0, *flap)


def _vertical(tail: VerticalTail, origin: _Vector) -> tuple[Any, ...]:
    # Normal to the right: flow from the right gives lift to the left, as flow from below lifts a wing.
    directions = _chord_and_normal((0.0, 1.0, 0.0), 0.0)
    fixed = (_less(tail.position, origin), *directions, 0, tail.area, tail.area / tail.height)
    return (*fixed, *_polar(tail, tail.induced_drag), _NONE, 0.0, 1.0, _NONE, 0.0, 0.0)


def _chord_and_normal(normal: _Vector, incidence: float) -> tuple[_Vector, _Vector]:
    """Chord axis and normal of a surface whose normal at no incidence is given: nose up by `incidence` [rad]."""
    cosine, sine = math.cos(incidence), math.sin(incidence)
    x, y, z = normal
    return (cosine - sine * x, -sine * y, -sine * z), (sine + cosine * x, cosine * y, cosine * z)


def _polar(surface: Wing | HorizontalTail | VerticalTail, induced_drag: float) -> tuple[float, ...]:
    return (
        surface.lift_slope,
        surface.stall_angle,
        surface.stall_width,
        0.0,  # max_lift_angle follows from the row
        surface.plate_lift,
        surface.plate_drag,
        surface.zero_lift_drag,
        induced_drag,
    )
