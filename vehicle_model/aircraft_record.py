"""From the tables of an aircraft file to the VEHICLE record that the compiled equations read.

Positions move to the centre of mass here, and everything given for one side is mirrored.
"""

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from vehicle_model.aircraft_tables import (
    AircraftTables,
    Contact,
    Rotor,
    Section,
    Servo,
    Strip,
    Wing,
)  # fmt: skip
from vehicle_model.records import CONTACT, ROTOR, SERVO, SURFACE, VEHICLE
from vehicle_model.surface import max_lift_angle

__all__ = ["ROTOR_NAMES", "surface_names", "vehicle_record"]

ROTOR_NAMES = ("left", "right", "tail")

_LEFT, _RIGHT = -1, 1
_NONE = -1  # no rotor, no servo
_ROTOR = {_LEFT: 0, _RIGHT: 1}
_AILERON = {_LEFT: 1, _RIGHT: 2}  # servos in the order of VEHICLE
_ELEVATOR = 3

_Vector = tuple[float, float, float]


def surface_names(tables: AircraftTables) -> tuple[str, ...]:
    """Names of the surfaces in the order of VEHICLE: left wing from the root out, right wing, tailplane, fin."""
    sides = [f"{side} {strip.name}" for side in ("left", "right") for strip in tables.wing.strips]
    return (*sides, "horizontal tail", "vertical tail")


def vehicle_record(tables: AircraftTables) -> npt.NDArray[np.void]:
    """VEHICLE array of shape (1,), read-only, of the aircraft in `tables`."""
    origin = tables.mass_properties.centre_of_mass
    array = np.zeros(1, VEHICLE)
    vehicle = array[0]
    inertia = _inertia(tables)
    contacts = [
        _contact(contact, side, origin)
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
    array.flags.writeable = False
    return array


def _less(position: _Vector, origin: _Vector) -> _Vector:
    return position[0] - origin[0], position[1] - origin[1], position[2] - origin[2]


def _on_side(position: _Vector, side: int) -> _Vector:
    return position[0], side * position[1], position[2]


def _inertia(tables: AircraftTables) -> npt.NDArray[np.float64]:
    m = tables.mass_properties
    return np.array([[m.ixx, 0.0, -m.ixz], [0.0, m.iyy, 0.0], [-m.ixz, 0.0, m.izz]])


def _row(record: np.dtype[np.void], **values: Any) -> tuple[Any, ...]:
    """The values in the order of the record's fields; KeyError if one is missing, so that none is silently zero."""
    row = tuple(values.pop(name) for name in record.names or ())
    if values:
        raise KeyError(f"no such fields: {', '.join(values)}")
    return row


def _servo(servo: Servo) -> tuple[Any, ...]:
    return _row(
        SERVO,
        time_constant=servo.time_constant,
        rate_limit=servo.rate_limit,
        minimum=servo.minimum,
        maximum=servo.maximum,
    )


def _contact(contact: Contact, side: int, origin: _Vector) -> tuple[Any, ...]:
    return _row(
        CONTACT,
        position=_less(_on_side(contact.position, side), origin),
        stiffness=contact.stiffness,
        damping=contact.damping,
        friction=contact.friction,
    )


def _rotors(tables: AircraftTables, origin: _Vector) -> list[tuple[Any, ...]]:
    wing, tail, voltage = tables.rotors.wing, tables.rotors.tail, tables.battery.voltage
    pair = [
        _rotor(wing, voltage, side, position=_on_side(wing.hub, side), axis=(1.0, 0.0, 0.0), tilts=1)
        for side in (_LEFT, _RIGHT)
    ]
    return [*pair, _rotor(tail, voltage, _RIGHT, position=_less(tail.hub, origin), axis=(0.0, 0.0, -1.0), tilts=0)]


def _rotor(rotor: Rotor, voltage: float, side: int, **mounting: Any) -> tuple[Any, ...]:
    motor = rotor.motor
    return _row(
        ROTOR,
        **mounting,
        spin=side * (1.0 if rotor.spin == "right-handed" else -1.0),
        radius=rotor.radius,
        twist=rotor.twist,
        lift_slope=rotor.lift_slope,
        blades=rotor.blades,
        blade_chord=rotor.blade_chord,
        profile_drag=rotor.profile_drag,
        induced_power_factor=rotor.induced_power_factor,
        thrust_factor=1.0,
        inertia=rotor.inertia,
        torque_constant=1.0 / motor.velocity_constant,
        resistance=motor.resistance,
        no_load_current=motor.no_load_current,
        battery_voltage=voltage,
        max_current=motor.max_current,
        max_power=motor.max_power,
        throttle_sets_power=motor.throttle == "power",
        min_throttle=-1.0 if motor.reversible else 0.0,
    )


def _surfaces(tables: AircraftTables, origin: _Vector) -> list[tuple[Any, ...]]:
    wing, horizontal, vertical = tables.wing, tables.tail.horizontal, tables.tail.vertical
    wing_peak = _max_lift_angle(wing)
    strips = [_strip(wing, strip, side, wing_peak) for side in (_LEFT, _RIGHT) for strip in wing.strips]
    tail = _surface(
        horizontal,
        position=_less(horizontal.position, origin),
        area=horizontal.area,
        chord=horizontal.area / horizontal.span,
        incidence=horizontal.incidence,
        servo=_ELEVATOR,
        flap_effectiveness=horizontal.elevator_effectiveness,
        downwash_factor=horizontal.downwash_factor,
    )
    # A normal to the right: flow from the right gives lift to the left, as flow from below lifts a wing.
    fin = _surface(
        vertical,
        position=_less(vertical.position, origin),
        down=(0.0, 1.0, 0.0),
        area=vertical.area,
        chord=vertical.area / vertical.height,
    )
    return [*strips, tail, fin]


def _strip(wing: Wing, strip: Strip, side: int, peak: float) -> tuple[Any, ...]:
    """One side's strip of the wing, in wing axes from the pivot."""
    chord = wing.chord_at(strip.y)
    literal = strip.wetted and wing.slipstream == "paper"  # eqs (9)-(11): the wake alone, and no induced drag
    return _surface(
        wing,
        position=(wing.quarter_chord_x, side * strip.y, wing.quarter_chord_z - strip.y * math.tan(wing.dihedral)),
        down=(0.0, side * math.sin(wing.dihedral), math.cos(wing.dihedral)),
        tilts=1,
        area=chord * strip.width,
        chord=chord,
        incidence=wing.incidence,
        max_lift_angle=peak,
        lift_slope=_paper_lift_slope(wing.incidence) if literal else wing.lift_slope,
        induced_drag=0.0 if literal else wing.induced_drag,
        rotor=_ROTOR[side] if strip.wetted else _NONE,
        wake_factor=(1.0 if literal else wing.wake_factor) if strip.wetted else 0.0,
        freestream_factor=0.0 if literal else 1.0,
        servo=_AILERON[side] if strip.aileron else _NONE,
        flap_effectiveness=wing.aileron_effectiveness if strip.aileron else 0.0,
    )


def _paper_lift_slope(incidence: float) -> float:
    """Slope with which CL = slope sin(incidence) is eq. (9), CL = 0.1 per degree times the incidence [1/rad]."""
    slope = 0.1 * math.degrees(1.0)
    return slope * incidence / math.sin(incidence) if incidence else slope


def _surface(
    section: Section,
    *,
    position: _Vector,
    area: float,
    chord: float,
    down: _Vector = (0.0, 0.0, 1.0),  # out of the lower side at zero incidence, square to x
    incidence: float = 0.0,
    max_lift_angle: float | None = None,
    **values: Any,
) -> tuple[Any, ...]:
    """A lifting surface: a rigid one of the body in the free stream, but for the `values` that say otherwise."""
    sine, cosine = math.sin(incidence), math.cos(incidence)
    fixed: dict[str, Any] = {
        "tilts": 0,
        "lift_slope": section.lift_slope,
        "induced_drag": section.induced_drag,
        "rotor": _NONE,
        "wake_factor": 0.0,
        "freestream_factor": 1.0,
        "servo": _NONE,
        "flap_effectiveness": 0.0,
        "downwash_factor": 0.0,
    }
    return _row(
        SURFACE,
        position=position,
        chord_axis=(cosine, -sine * down[1], -sine * down[2]),
        normal=(sine, cosine * down[1], cosine * down[2]),
        area=area,
        chord=chord,
        **_stall(section),
        max_lift_angle=_max_lift_angle(section) if max_lift_angle is None else max_lift_angle,
        plate_lift=section.plate_lift,
        plate_drag=section.plate_drag,
        zero_lift_drag=section.zero_lift_drag,
        **(fixed | values),
    )


def _stall(section: Section) -> dict[str, float]:
    """Where flow separates: from `stall_width` below the stall angle to as much above it, as sines."""
    first = math.sin(section.stall_angle - section.stall_width)
    last = math.sin(min(section.stall_angle + section.stall_width, math.pi / 2.0))
    return {"stall_sine": first, "stall_sine_span": last - first}


def _max_lift_angle(section: Section) -> float:
    curve = np.zeros(1, SURFACE)
    curve["lift_slope"], curve["plate_lift"] = section.lift_slope, section.plate_lift
    for name, value in _stall(section).items():
        curve[name] = value
    return max_lift_angle(curve[0])
