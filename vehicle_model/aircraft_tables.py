"""The tables of an aircraft file: every value with its unit and plausible range.

Attributes are named as in the file and hold SI values and radians. Positions are in body axes (x forward, y right,
z down) from the datum of the file unless said otherwise; ranges fit unmanned tilt-wings from about 1 to 100 kg.
"""

from typing import Annotated, Literal

import msgspec

from vehicle_model.aircraft_schema import Quantity

__all__ = [
    "AircraftTables", "Battery", "Contact", "Elevator", "Fuselage", "HorizontalTail", "MassProperties", "Motor",
    "Rotor", "Rotors", "Section", "Servo", "ServoOutput", "Servos", "Shapes", "Strip", "Tail", "VerticalTail", "Wing",
]  # fmt: skip

Vector = tuple[float, float, float]
Position = Annotated[Vector, Quantity("m", -10, 10)]
Incidence = Annotated[float, Quantity("deg", -15, 15)]
LiftSlope = Annotated[float, Quantity("1/rad", 1, 8)]
StallAngle = Annotated[float, Quantity("deg", 5, 45)]
StallWidth = Annotated[float, Quantity("deg", 0.5, 20)]
PlateLift = Annotated[float, Quantity("1", 0.3, 1.5)]
PlateDrag = Annotated[float, Quantity("1", 0.8, 2.2)]
ZeroLiftDrag = Annotated[float, Quantity("1", 0.002, 0.2)]
InducedDrag = Annotated[float, Quantity("1", 0, 0.5)]
Effectiveness = Annotated[float, Quantity("1", 0, 1)]


class MassProperties(msgspec.Struct, frozen=True):
    """Mass and its distribution, fixed as in the paper ("constant mass distribution")."""

    mass: Annotated[float, Quantity("kg", 0.2, 500)]
    centre_of_mass: Position
    ixx: Annotated[float, Quantity("kg m^2", 0.001, 2000)]  # about the centre of mass, body axes
    iyy: Annotated[float, Quantity("kg m^2", 0.001, 2000)]
    izz: Annotated[float, Quantity("kg m^2", 0.001, 2000)]
    ixz: Annotated[float, Quantity("kg m^2", -1000, 1000)]  # integral of x z dm


class Strip(msgspec.Struct, frozen=True):
    """One spanwise strip of the right wing; the left wing has its mirror image."""

    name: str
    y: Annotated[float, Quantity("m", 0, 10)]  # of its middle, from the plane of symmetry
    width: Annotated[float, Quantity("m", 0.005, 10)]
    wetted: bool  # in the slipstream of the propeller of its side
    aileron: bool


class Section(msgspec.Struct, frozen=True):
    """Lift and drag curves of a wing or tail section, from attached to separated flow."""

    lift_slope: LiftSlope  # attached flow: CL = lift_slope sin alpha
    stall_angle: StallAngle  # middle of the blend from attached to separated flow
    stall_width: StallWidth  # half width of that blend
    plate_lift: PlateLift  # separated flow: CL = plate_lift sin 2 alpha
    plate_drag: PlateDrag  # separated flow: CD = zero_lift_drag + plate_drag sin^2 alpha
    zero_lift_drag: ZeroLiftDrag
    induced_drag: InducedDrag  # attached flow: CD = zero_lift_drag + induced_drag CL^2


class Wing(Section, frozen=True):
    """The tilting wing. Wing axes: origin at the pivot, x along the propeller axes, body axes at tilt 0."""

    span: Annotated[float, Quantity("m", 0.2, 20)]
    chord: Annotated[float, Quantity("m", 0.02, 3)]  # mean: half of root plus tip
    taper: Annotated[float, Quantity("1", 0.2, 1)]  # chord at the tip over chord in the plane of symmetry
    pivot: Position
    incidence: Incidence  # chord against the propeller axis, nose up
    quarter_chord_x: Annotated[float, Quantity("m", -1, 1)]  # quarter-chord line in wing axes, ahead of the pivot
    quarter_chord_z: Annotated[float, Quantity("m", -1, 1)]  # below the pivot
    dihedral: Annotated[float, Quantity("deg", -10, 10)]
    aileron_effectiveness: Effectiveness  # change of angle of attack per aileron angle
    slipstream: Literal["vector", "paper"]  # vector sum of free stream and wake, or eqs (9)-(11) to the letter
    wake_factor: Annotated[float, Quantity("1", 0, 2)]  # k in V + k v_i n: 1 at the disk, 2 in the far wake
    strips: tuple[Strip, ...]

    def chord_at(self, y: float) -> float:
        """Chord [m] at the distance `y` [m] from the plane of symmetry."""
        root = 2 * self.chord / (1 + self.taper)
        return root * (1 - (1 - self.taper) * abs(y) / (self.span / 2))


class Motor(msgspec.Struct, frozen=True):
    """An electric motor with its speed controller."""

    velocity_constant: Annotated[float, Quantity("rpm/V", 20, 10000)]
    resistance: Annotated[float, Quantity("ohm", 0.001, 2)]  # winding, controller and cables
    no_load_current: Annotated[float, Quantity("A", 0, 20)]
    max_current: Annotated[float, Quantity("A", 1, 1000)]
    max_power: Annotated[float, Quantity("W", 10, 100000)]  # electrical, at full throttle where throttle is "power"
    throttle: Literal["power", "voltage"]  # what full throttle is a fraction of: max_power or the battery's voltage
    reversible: bool


class Rotor(msgspec.Struct, frozen=True):
    """A propeller, eqs (3)-(8), and its motor."""

    hub: Position  # wing pair: right hub in wing axes, from the pivot; tail: body axes, from the datum
    spin: Literal["right-handed", "left-handed"]  # about the thrust direction; for the wing pair of the right one
    radius: Annotated[float, Quantity("m", 0.02, 3)]
    twist: Annotated[float, Quantity("rad", 0.05, 1.5)]  # K_twist
    lift_slope: Annotated[float, Quantity("1/rad", 1, 8)]  # a0
    blades: Annotated[int, Quantity("1", 1, 8)]  # b
    blade_chord: Annotated[float, Quantity("m", 0.002, 0.5)]  # c_r
    profile_drag: Annotated[float, Quantity("1", 0.002, 0.2)]  # mean drag coefficient of a blade section
    induced_power_factor: Annotated[float, Quantity("1", 1, 2)]  # over the induced power of momentum theory
    inertia: Annotated[float, Quantity("kg m^2", 1e-7, 5)]  # propeller and motor about the shaft
    motor: Motor


class Rotors(msgspec.Struct, frozen=True):
    """The wing's pair, left and right mirrored, and the one at the tail, which thrusts along body -z."""

    wing: Rotor
    tail: Rotor


class Battery(msgspec.Struct, frozen=True):
    """The lithium-polymer battery that all motors share."""

    voltage: Annotated[float, Quantity("V", 3, 1000)]  # nominal: what trim and the other analyses count with
    cells: Annotated[int, Quantity("1", 1, 250)]  # in series
    capacity: Annotated[float, Quantity("A h", 0.1, 2000)]
    internal_resistance: Annotated[float, Quantity("ohm", 0.0001, 2)]  # of the whole pack with its leads
    avionics_power: Annotated[float, Quantity("W", 0, 5000)]  # drawn besides the motors


class HorizontalTail(Section, frozen=True):
    """Tailplane with the elevator."""

    position: Position  # quarter point of its middle chord
    area: Annotated[float, Quantity("m^2", 0.001, 10)]
    span: Annotated[float, Quantity("m", 0.05, 10)]
    incidence: Incidence
    elevator_effectiveness: Effectiveness  # change of angle of attack per elevator angle
    downwash_factor: Annotated[float, Quantity("1", 0, 3)]  # times the wing's momentum downwash


class VerticalTail(Section, frozen=True):
    """Fin."""

    position: Position  # quarter point of its middle chord
    area: Annotated[float, Quantity("m^2", 0.001, 10)]
    height: Annotated[float, Quantity("m", 0.05, 5)]


class Tail(msgspec.Struct, frozen=True):
    """Tail surfaces, in the free stream."""

    horizontal: HorizontalTail
    vertical: VerticalTail


class Elevator(msgspec.Struct, frozen=True):
    """The paper's equivalent elevator: one angle that moves the surface and drives the tail rotor."""

    tail_gain: Annotated[float, Quantity("rad/s^2", 0, 1e9)]  # tail rotor: speed |speed| = tail_gain sin^2(tilt) angle


class Fuselage(msgspec.Struct, frozen=True):
    """Body without wing and tail."""

    position: Position  # where its drag acts
    drag_area: Annotated[Vector, Quantity("m^2", 0, 10)]  # CD S for flow along x, y and z
    nose: Position
    length: Annotated[float, Quantity("m", 0.1, 20)]
    width: Annotated[float, Quantity("m", 0.01, 5)]
    height: Annotated[float, Quantity("m", 0.01, 5)]


class Shapes(msgspec.Struct, frozen=True):
    """What is only drawn."""

    nacelle_length: Annotated[float, Quantity("m", 0.01, 3)]
    nacelle_diameter: Annotated[float, Quantity("m", 0.005, 1)]
    airfoil_thickness: Annotated[float, Quantity("1", 0.01, 0.3)]  # of the chord


class Servo(msgspec.Struct, frozen=True):
    """An actuator that turns the wing or a flap."""

    time_constant: Annotated[float, Quantity("s", 0.001, 2)]  # first-order lag
    rate_limit: Annotated[float, Quantity("deg/s", 1, 2000)]
    minimum: Annotated[float, Quantity("deg", -90, 90)]
    maximum: Annotated[float, Quantity("deg", 0, 180)]


class Servos(msgspec.Struct, frozen=True):
    """Actuators; the ailerons have one each, of the same kind."""

    tilt: Servo
    aileron: Servo
    elevator: Servo


class Contact(msgspec.Struct, frozen=True):
    """A point of the landing gear that touches the ground."""

    name: str
    position: Position
    mirrored: bool  # there is another one at -y
    stiffness: Annotated[float, Quantity("N/m", 10, 1e7)]
    damping: Annotated[float, Quantity("N s/m", 0, 1e6)]
    friction: Annotated[float, Quantity("1", 0, 2)]  # Coulomb coefficient


class ServoOutput(msgspec.Struct, frozen=True):
    """One output channel of the flight controller and what it drives."""

    control: Literal[
        "throttle_left", "throttle_right", "throttle_tail", "tilt", "aileron_left", "aileron_right", "elevator"
    ]
    channel: Annotated[int, Quantity("1", 1, 16)]
    pwm_minimum: Annotated[float, Quantity("us", 500, 2500)]
    pwm_trim: Annotated[float, Quantity("us", 500, 2500)]  # normalised 0: motor stopped, servo in mid-range
    pwm_maximum: Annotated[float, Quantity("us", 500, 2500)]


class AircraftTables(msgspec.Struct, frozen=True):
    """A whole aircraft file."""

    name: str
    mass_properties: MassProperties
    wing: Wing
    rotors: Rotors
    battery: Battery
    tail: Tail
    elevator: Elevator
    fuselage: Fuselage
    shapes: Shapes
    servos: Servos
    contacts: tuple[Contact, ...]
    servo_outputs: tuple[ServoOutput, ...]
