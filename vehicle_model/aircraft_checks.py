"""What must hold between the entries of an aircraft file, beyond the range of each."""

import math
from collections.abc import Sequence

from vehicle_model.aircraft_schema import SchemaError
from vehicle_model.aircraft_tables import AircraftTables, Servo
from vehicle_model.records import MAX_CONTACTS, MAX_SURFACES
from vehicle_model.state import CONTROL_NAMES

__all__ = ["check_consistency"]

_JOINT = 1e-3  # strips may miss each other or the tip by this much [m]
_TAIL_SURFACES = 2
_CELL_VOLTAGE = (3.4, 4.2)  # nominal, of lithium-polymer cells and their high-voltage kind [V]


def check_consistency(tables: AircraftTables) -> None:
    """Raise SchemaError naming the first entry that contradicts another."""
    _check_inertia(tables)
    _check_strips(tables)
    _check_stall(tables)
    _check_rotors(tables)
    _check_battery(tables)
    _check_tail(tables)
    for name in ("tilt", "aileron", "elevator"):
        _check_servo(name, getattr(tables.servos, name))
    _check_contacts(tables)
    _check_outputs(tables)


def _check_inertia(tables: AircraftTables) -> None:
    m = tables.mass_properties
    for name, moment, others in (
        ("ixx", m.ixx, m.iyy + m.izz),
        ("iyy", m.iyy, m.ixx + m.izz),
        ("izz", m.izz, m.ixx + m.iyy),
    ):
        if moment > others:
            expected = f"expected at most the sum of the other two moments, {others:.6g} kg m^2"
            raise SchemaError(("mass_properties", name), f"{expected}, got {moment:.6g} kg m^2")
    if m.ixz**2 >= m.ixx * m.izz:
        expected = f"expected less than sqrt(ixx izz) = {(m.ixx * m.izz) ** 0.5:.6g} kg m^2 either way"
        raise SchemaError(("mass_properties", "ixz"), f"{expected}, got {m.ixz:.6g} kg m^2")


def _check_strips(tables: AircraftTables) -> None:
    wing = tables.wing
    _check_unique(("wing", "strips"), [strip.name for strip in wing.strips])
    count = 2 * len(wing.strips) + _TAIL_SURFACES
    if count > MAX_SURFACES:
        most = (MAX_SURFACES - _TAIL_SURFACES) // 2
        raise SchemaError(("wing", "strips"), f"expected at most {most} strips per side, got {len(wing.strips)}")
    edge = 0.0
    for index, strip in sorted(enumerate(wing.strips), key=lambda item: item[1].y):
        inner = strip.y - strip.width / 2
        if inner < edge - _JOINT:
            expected = f"expected {edge:.6g} m or more to its inner edge, where the strip before ends"
            raise SchemaError(("wing", "strips", index, "y"), f"{expected}, got {inner:.6g} m")
        edge = strip.y + strip.width / 2
    if abs(edge - wing.span / 2) > _JOINT:
        expected = f"expected {2 * edge:.6g} m, where the outermost strips end"
        raise SchemaError(("wing", "span"), f"{expected}, got {wing.span:.6g} m")


def _check_stall(tables: AircraftTables) -> None:
    """Flow is attached at no angle of attack, or lift would have a kink there."""
    for keys, section in (
        (("wing",), tables.wing),
        (("tail", "horizontal"), tables.tail.horizontal),
        (("tail", "vertical"), tables.tail.vertical),
    ):
        if section.stall_width >= section.stall_angle:
            expected = f"expected less than stall_angle, {math.degrees(section.stall_angle):.6g} deg"
            raise SchemaError((*keys, "stall_width"), f"{expected}, got {math.degrees(section.stall_width):.6g} deg")


def _check_tail(tables: AircraftTables) -> None:
    centre = tables.mass_properties.centre_of_mass[0]
    for name, surface in (("horizontal", tables.tail.horizontal), ("vertical", tables.tail.vertical)):
        if surface.position[0] >= centre:
            expected = f"expected x behind the centre of mass, below {centre:.6g} m"
            raise SchemaError(("tail", name, "position"), f"{expected}, got {surface.position[0]:.6g} m")


def _check_rotors(tables: AircraftTables) -> None:
    wing, tail = tables.rotors.wing, tables.rotors.tail
    if wing.hub[1] <= wing.radius:
        expected = f"expected y of the right hub beyond the radius {wing.radius:.6g} m"
        raise SchemaError(("rotors", "wing", "hub"), f"{expected}, got {wing.hub[1]:.6g} m")
    if tail.hub[0] >= tables.mass_properties.centre_of_mass[0]:
        raise SchemaError(("rotors", "tail", "hub"), f"expected x behind the centre of mass, got {tail.hub[0]:.6g} m")


def _check_battery(tables: AircraftTables) -> None:
    cells, voltage = tables.battery.cells, tables.battery.voltage
    low, high = (cells * each for each in _CELL_VOLTAGE)
    if not low <= voltage <= high:
        expected = f"expected {low:.6g} to {high:.6g} V for {cells} lithium-polymer cells"
        raise SchemaError(("battery", "voltage"), f"{expected}, got {voltage:.6g} V")


def _check_servo(name: str, servo: Servo) -> None:
    if not servo.minimum < servo.maximum:
        raise SchemaError(("servos", name, "minimum"), "expected an angle below maximum")


def _check_contacts(tables: AircraftTables) -> None:
    _check_unique(("contacts",), [contact.name for contact in tables.contacts])
    count = sum(2 if contact.mirrored else 1 for contact in tables.contacts)
    if count > MAX_CONTACTS:
        expected = f"expected at most {MAX_CONTACTS} points with their mirror images"
        raise SchemaError(("contacts",), f"{expected}, got {count}")
    centre = tables.mass_properties.centre_of_mass[2]
    for index, contact in enumerate(tables.contacts):
        if contact.position[2] <= centre:
            expected = f"expected z below the centre of mass, above {centre:.6g} m"
            raise SchemaError(("contacts", index, "position"), f"{expected}, got {contact.position[2]:.6g} m")


def _check_outputs(tables: AircraftTables) -> None:
    outputs = tables.servo_outputs
    _check_unique(("servo_outputs",), [output.control for output in outputs])
    _check_unique(("servo_outputs",), [str(output.channel) for output in outputs])
    missing = [name for name in CONTROL_NAMES if name not in {output.control for output in outputs}]
    if missing:
        raise SchemaError(("servo_outputs",), f"expected an output for every control, missing {', '.join(missing)}")
    for index, output in enumerate(outputs):
        if not output.pwm_minimum <= output.pwm_trim < output.pwm_maximum:
            keys = ("servo_outputs", index, "pwm_trim")
            raise SchemaError(keys, "expected a pulse from pwm_minimum to below pwm_maximum")


def _check_unique(keys: tuple[str, ...], names: Sequence[str]) -> None:
    for index, name in enumerate(names):
        if name in names[:index]:
            raise SchemaError((*keys, index), f'expected each to differ, got "{name}" twice')
