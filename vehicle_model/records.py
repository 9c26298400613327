"""What the compiled equations read and write: the vehicle, its battery, its environment and wind, its outputs.

Parameters travel as numpy structured arrays of length one: named fields as in a dataclass, yet one pointer
to pass into compiled code. `vehicle_model.aircraft` fills a VEHICLE from a file, `vehicle_model.earth` an
ENVIRONMENT. Everything is SI and radians. Mounting axes are body axes (forward, right, down) with the origin at
the centre of mass, or, where `tilts` is 1, the wing's own axes with the origin at the wing pivot; at tilt 0 both
have the same directions.
"""

import numpy as np

__all__ = [
    "BATTERY", "CONTACT", "ENVIRONMENT", "GUST", "MAX_CONTACTS", "MAX_GUSTS", "MAX_ROTORS", "MAX_SURFACES", "OUTPUTS",
    "ROTOR", "SERVO", "SURFACE", "VEHICLE", "WIND",
]  # fmt: skip

MAX_ROTORS = 3  # left, right, tail: as many as the state has rotor speeds
MAX_SURFACES = 16
MAX_CONTACTS = 8
MAX_GUSTS = 8

_f = np.float64
_i = np.int64

ROTOR = np.dtype(
    [
        ("position", _f, (3,)),  # hub, mounting axes [m]
        ("axis", _f, (3,)),  # unit thrust direction, mounting axes
        ("tilts", _i),  # 1: turns with the wing
        ("spin", _f),  # +1 turns right-handed about the thrust direction, -1 left-handed
        ("radius", _f),  # r of eq. (3) [m]
        ("twist", _f),  # K_twist of eq. (3) [rad]
        ("lift_slope", _f),  # a0 of eq. (3) [1/rad]
        ("blades", _f),  # b of eq. (3)
        ("blade_chord", _f),  # c_r of eq. (3) [m]
        ("profile_drag", _f),  # mean blade section drag coefficient
        ("induced_power_factor", _f),  # power of uneven inflow, tip loss and swirl over that of momentum theory
        ("thrust_factor", _f),  # 1; less on a damaged propeller: share of the thrust at the same speed and inflow
        ("inertia", _f),  # propeller and motor about the shaft [kg m^2]
        ("torque_constant", _f),  # torque per current, and back EMF per speed: 1/Kv [N m/A = V s/rad]
        ("resistance", _f),  # winding, controller and cables [ohm]
        ("no_load_current", _f),  # [A]
        ("battery_voltage", _f),  # at the speed controller; `battery.battery_step` lets it sag [V]
        ("max_current", _f),  # limit of the controller [A]
        ("max_power", _f),  # electrical power at full throttle, where throttle sets power [W]
        ("throttle_sets_power", _i),  # 1: throttle is a fraction of max_power; 0: of battery voltage
        ("min_throttle", _f),  # 0, or -1 for a reversible motor
    ],
    align=True,
)

SURFACE = np.dtype(
    [
        ("position", _f, (3,)),  # quarter-chord point at mid-span, mounting axes [m]
        ("chord_axis", _f, (3,)),  # unit vector forward along the chord (incidence included), mounting axes
        ("normal", _f, (3,)),  # unit vector out of the lower side, square to the chord (lift acts against it)
        ("tilts", _i),  # 1: strip of the tilting wing
        ("area", _f),  # [m^2]
        ("chord", _f),  # [m]
        ("lift_slope", _f),  # attached flow: CL = lift_slope sin alpha [1/rad]
        ("stall_sine", _f),  # sine of the angle of attack where flow begins to separate
        ("stall_sine_span", _f),  # increase of that sine until it is fully separated
        ("max_lift_angle", _f),  # where lift peaks; follows from the curve (surface.max_lift_angle) [rad]
        ("plate_lift", _f),  # separated flow: CL = plate_lift sin 2 alpha
        ("plate_drag", _f),  # separated flow: CD = zero_lift_drag + plate_drag sin^2 alpha
        ("zero_lift_drag", _f),
        ("induced_drag", _f),  # attached flow: CD = zero_lift_drag + induced_drag CL^2
        ("rotor", _i),  # index of the rotor whose slipstream wets the strip, or -1
        ("wake_factor", _f),  # k in V_wing = V + k v_i n: 1 at the disk, 2 in the far wake
        ("freestream_factor", _f),  # 1; 0 drops the free stream from V_wing as eqs (9)-(11) do
        ("servo", _i),  # index of the servo that moves its flap, or -1
        ("flap_effectiveness", _f),  # change of angle of attack per flap angle
        ("downwash_factor", _f),  # times the wing's momentum downwash, 0 for the wing itself
    ],
    align=True,
)

CONTACT = np.dtype(
    [
        ("position", _f, (3,)),  # body axes [m]
        ("stiffness", _f),  # [N/m]
        ("damping", _f),  # [N s/m]
        ("friction", _f),  # Coulomb coefficient
    ],
    align=True,
)

SERVO = np.dtype(
    [
        ("time_constant", _f),  # first-order lag [s]
        ("rate_limit", _f),  # [rad/s]
        ("minimum", _f),  # [rad]
        ("maximum", _f),  # [rad]
    ],
    align=True,
)

VEHICLE = np.dtype(
    [
        ("mass", _f),  # [kg]
        ("inertia", _f, (3, 3)),  # about the centre of mass, body axes; fixed, as in the paper [kg m^2]
        ("inertia_inverse", _f, (3, 3)),
        ("pivot", _f, (3,)),  # wing pivot, body axes [m]
        ("downwash_area", _f),  # area of the stream tube the wing deflects, pi span^2/4 [m^2]
        ("fuselage_position", _f, (3,)),  # where fuselage drag acts, body axes [m]
        ("fuselage_drag_area", _f, (3,)),  # CD S for flow along x, y and z [m^2]
        ("damping_area", _f),  # S, b, c, Clp, Cmq, Cnr: damping of a bare body [m^2, m, m, 1/rad]
        ("damping_span", _f),
        ("damping_chord", _f),
        ("roll_damping", _f),
        ("pitch_damping", _f),
        ("yaw_damping", _f),
        ("tail_gain", _f),  # tail rotor: speed |speed| = tail_gain sin^2(tilt) equivalent elevator [rad/s^2]
        ("servos", SERVO, (4,)),  # tilt, aileron_left, aileron_right, elevator
        ("rotor_count", _i),
        ("surface_count", _i),
        ("contact_count", _i),
        ("rotors", ROTOR, (MAX_ROTORS,)),
        ("surfaces", SURFACE, (MAX_SURFACES,)),
        ("contacts", CONTACT, (MAX_CONTACTS,)),
    ],
    align=True,
)

BATTERY = np.dtype(
    [
        ("cells", _f),  # in series
        ("capacity", _f),  # [A s]
        ("internal_resistance", _f),  # of the whole pack with its leads [ohm]
        ("avionics_power", _f),  # drawn besides the motors [W]
        ("charge", _f),  # left [A s]
        ("voltage", _f),  # under load [V]
        ("current", _f),  # positive while it discharges [A]
    ],
    align=True,
)

ENVIRONMENT = np.dtype(
    [
        ("earth", _i),  # 0 flat, 1 round, 2 WGS-84 ellipsoid with J2
        ("gravity", _f),  # flat Earth only [m/s^2]
        ("gm", _f),  # [m^3/s^2]
        ("j2", _f),
        ("equatorial_radius", _f),  # [m]
        ("eccentricity_squared", _f),
        ("rotation_ned", _f, (3,)),  # Earth rotation in the origin's NED axes; zero for flat [rad/s]
        ("latitude", _f),  # of the NED origin, geodetic [rad]
        ("longitude", _f),  # [rad]
        ("height_ellipsoid", _f),  # of the NED origin [m]
        ("sin_latitude", _f),
        ("cos_latitude", _f),
        ("centre_ned", _f, (3,)),  # the Earth's centre in the origin's NED axes; zero for flat [m]
        ("wind_ned", _f, (3,)),  # blowing to [m/s]
        ("ground_height", _f),  # height of the ground above the ellipsoid [m]
    ],
    align=True,
)

# One-minus-cosine gust, in the NED axes of the environment's origin.
GUST = np.dtype(
    [
        ("start", _f),  # when the vehicle meets it [s]
        ("length", _f),  # along the path through the air [m]
        ("amplitude_ned", _f, (3,)),  # at its middle, blowing to [m/s]
        ("distance", _f),  # that the vehicle has gone into it [m]
    ],
    align=True,
)

WIND = np.dtype(
    [
        ("steady_ned", _f, (3,)),  # at the reference height, blowing to [m/s]
        ("reference_height", _f),  # above ground [m]
        ("roughness", _f),  # length z0 of the logarithmic profile [m]; 0: the same wind at every height
        ("gust_count", _i),
        ("gusts", GUST, (MAX_GUSTS,)),
    ],
    align=True,
)

OUTPUTS = np.dtype(
    [
        ("airspeed", _f),  # true [m/s]
        ("velocity_air_body", _f, (3,)),  # of the centre of mass through the air [m/s]
        ("height_ellipsoid", _f),  # [m]
        ("height_above_ground", _f),  # of the centre of mass [m]
        ("density", _f),  # [kg/m^3]
        ("force_body", _f, (3,)),  # all but gravity [N]
        ("moment_body", _f, (3,)),  # [N m]
        ("downwash_angle", _f),  # downwash velocity at the tail over airspeed [rad]
        ("thrust", _f, (MAX_ROTORS,)),  # [N]
        ("induced_velocity", _f, (MAX_ROTORS,)),  # [m/s]
        ("shaft_torque", _f, (MAX_ROTORS,)),  # [N m]
        ("shaft_power", _f, (MAX_ROTORS,)),  # [W]
        ("motor_torque", _f, (MAX_ROTORS,)),  # on the shaft [N m]
        ("current", _f, (MAX_ROTORS,)),  # motor current [A]
        ("electrical_power", _f, (MAX_ROTORS,)),  # from the battery, negative while the motor brakes [W]
        ("fuselage_force_body", _f, (3,)),  # [N]
        ("contact_force_body", _f, (MAX_CONTACTS, 3)),  # [N]
        # Force along chord and normal [N], how far behind the quarter point it acts [m], velocity of the strip through
        # the air along chord and normal [m/s].
        ("surface_load", _f, (MAX_SURFACES, 5)),
        # What follows only `observe` fills in.
        ("rotor_point_body", _f, (MAX_ROTORS, 3)),  # where the thrust acts [m]
        ("rotor_force_body", _f, (MAX_ROTORS, 3)),  # [N]
        ("surface_point_body", _f, (MAX_SURFACES, 3)),  # where the air load acts [m]
        ("surface_force_body", _f, (MAX_SURFACES, 3)),  # [N]
        ("surface_angle_of_attack", _f, (MAX_SURFACES,)),  # [rad]
        ("stall_margin", _f, (MAX_SURFACES,)),  # angle left to maximum lift, negative beyond it [rad]
    ],
    align=True,
)
