"""Forces and moments of the whole vehicle but gravity: eqs (2) and (13)-(16) of Hong et al. (2013) in vector form.

The paper's sums of l sin(xi), l cos(xi) are the cross products of signed position vectors that turn with the wing.
Parts that tilt are summed in the wing's axes about its pivot, the others in body axes about the centre of mass;
each sum sees the local air velocity of each part, so P, Q, R and wind act on every strip.
"""

import math

from vehicle_model.compiled import compiled
from vehicle_model.motor import electrical_power, motor_current, motor_torque
from vehicle_model.rotation import Vector, cross
from vehicle_model.rotor import rotor_loads
from vehicle_model.state import ROTOR_SPEED, TILT
from vehicle_model.surface import strip_force

__all__ = ["add_parts", "describe_parts", "downwash_angle", "fuselage_loads", "vehicle_loads"]

Loads = tuple[float, float, float, float, float, float]


@compiled
def to_body(vector: Vector, cosine: float, sine: float) -> Vector:
    """Turn a vector from wing into body axes; `cosine` and `sine` are those of the tilt (thrust up is -z)."""
    return cosine * vector[0] + sine * vector[2], vector[1], cosine * vector[2] - sine * vector[0]


@compiled
def to_wing(vector: Vector, cosine: float, sine: float) -> Vector:
    """Turn a vector from body into wing axes."""
    return cosine * vector[0] - sine * vector[2], vector[1], sine * vector[0] + cosine * vector[2]


@compiled
def rotor_part(rotor, index: int, air: Vector, rates: Vector, throttle: float, speed: float, density: float, out):
    """Force and moment of one rotor about its frame's origin, in that frame: thrust, motor reaction, gyroscopic moment.

    `air` is the velocity of the frame's origin through the air [m/s]. Writes the rotor's outputs.
    """
    point = (rotor.position[0], rotor.position[1], rotor.position[2])
    axis = (rotor.axis[0], rotor.axis[1], rotor.axis[2])
    swing = cross(rates, point)
    local = (air[0] + swing[0], air[1] + swing[1], air[2] + swing[2])
    along = local[0] * axis[0] + local[1] * axis[1] + local[2] * axis[2]
    square = local[0] * local[0] + local[1] * local[1] + local[2] * local[2] - along * along
    edgewise = math.sqrt(max(square, 0.0))
    thrust, resisting, induced = rotor_loads(rotor, speed, -along, edgewise, density)
    current = motor_current(rotor, throttle, speed)
    driving = motor_torque(rotor, current, speed)

    force = (thrust * axis[0], thrust * axis[1], thrust * axis[2])
    lever = cross(point, force)
    # The airframe feels what the motor gives the shaft (it accelerates the propeller and overcomes its drag) and
    # turns the propeller's angular momentum h = J w: -rates x h.
    momentum = rotor.spin * rotor.inertia * speed
    gyro = cross(rates, (momentum * axis[0], momentum * axis[1], momentum * axis[2]))
    reaction = -rotor.spin * driving

    out.thrust[index] = thrust
    out.induced_velocity[index] = induced
    out.shaft_torque[index] = resisting
    out.shaft_power[index] = resisting * speed
    out.current[index] = current
    out.electrical_power[index] = electrical_power(rotor, current, speed)
    out.motor_torque[index] = driving
    return force, (
        lever[0] + reaction * axis[0] - gyro[0],
        lever[1] + reaction * axis[1] - gyro[1],
        lever[2] + reaction * axis[2] - gyro[2],
    )


@compiled
def surface_part(surface, index: int, air: Vector, rates: Vector, rotor, flap: float, density: float, out):
    """Force and moment of one strip about its frame's origin, in that frame.

    Slipstream: V_wing = V + k v_i n, the vector sum of free stream and propeller wake; `rotor` is the strip's own.
    """
    point = (surface.position[0], surface.position[1], surface.position[2])
    swing = cross(rates, point)
    keep = surface.freestream_factor
    u = keep * (air[0] + swing[0])
    v = keep * (air[1] + swing[1])
    w = keep * (air[2] + swing[2])
    if surface.rotor >= 0:
        wake = surface.wake_factor * out.induced_velocity[surface.rotor]
        u += wake * rotor.axis[0]
        v += wake * rotor.axis[1]
        w += wake * rotor.axis[2]
    chord = surface.chord_axis
    normal = surface.normal
    flow_along = u * chord[0] + v * chord[1] + w * chord[2]
    flow_across = u * normal[0] + v * normal[1] + w * normal[2]
    along, across, behind = strip_force(surface, flow_along, flow_across, flap, density)
    force = (
        along * chord[0] + across * normal[0],
        along * chord[1] + across * normal[1],
        along * chord[2] + across * normal[2],
    )
    acts = (point[0] - behind * chord[0], point[1] - behind * chord[1], point[2] - behind * chord[2])
    load = out.surface_load[index]
    load[0] = along
    load[1] = across
    load[2] = behind
    load[3] = flow_along
    load[4] = flow_across
    return force, cross(acts, force)


@compiled
def add_parts(state, controls, craft, tilts: int, air: Vector, rates: Vector, density: float, out) -> Loads:
    """Sum of all rotors and surfaces of one frame (`tilts` 1: wing, 0: body), about its origin and in its axes."""
    fx = fy = fz = mx = my = mz = 0.0
    for i in range(craft.rotor_count):
        rotor = craft.rotors[i]
        if rotor.tilts == tilts:
            force, moment = rotor_part(rotor, i, air, rates, controls[i], state[ROTOR_SPEED + i], density, out)
            fx += force[0]
            fy += force[1]
            fz += force[2]
            mx += moment[0]
            my += moment[1]
            mz += moment[2]
    downwash = 0.0 if tilts == 1 else out.downwash_angle
    for i in range(craft.surface_count):
        surface = craft.surfaces[i]
        if surface.tilts == tilts:
            # Downwash crosses the flight path downwards in the plane of symmetry, so the surface meets less from below.
            turned = surface.downwash_factor * downwash
            meets = (air[0] + turned * air[2], air[1], air[2] - turned * air[0])
            flap = 0.0 if surface.servo < 0 else state[TILT + surface.servo]
            force, moment = surface_part(
                surface, i, meets, rates, craft.rotors[max(surface.rotor, 0)], flap, density, out
            )
            fx += force[0]
            fy += force[1]
            fz += force[2]
            mx += moment[0]
            my += moment[1]
            mz += moment[2]
    return fx, fy, fz, mx, my, mz


@compiled
def downwash_angle(force: Vector, air: Vector, area: float, density: float) -> float:
    """Downwash velocity [of the airspeed] that the wing and its rotors leave at the tail; small, it is an angle [rad].

    Momentum theory of a wing with stream tube `area` [m^2]: far behind, L/(rho area V'^2), with L the `force` across
    the free stream in the plane of symmetry and V'^2 = V^2 + |F|/(rho area), which lets the downwash velocity, this
    times V, vanish in hover, where the wake leaves downwards and passes the tail by.
    """
    if area <= 0.0:
        return 0.0
    square = air[0] * air[0] + air[2] * air[2]
    if square < 1e-12:
        return 0.0
    lift_times_speed = force[0] * air[2] - force[2] * air[0]
    flow = density * area * square + math.sqrt(force[0] * force[0] + force[2] * force[2])
    # Times the cosine of the angle of attack, none backwards: there the tail flies ahead of the wing.
    return lift_times_speed * max(air[0], 0.0) / (square * flow)


@compiled
def fuselage_loads(craft, air: Vector, rates: Vector, density: float, out) -> Loads:
    """Drag of the fuselage along each axis, and damping of a bare body; body axes, about the centre of mass.

    Drag: -rho/2 |V| V_i (CD S)_i, isotropic when the three areas are equal. Damping: (b^2 Clp p, c^2 Cmq q, b^2 Cnr r)
    rho V S/4, the usual derivatives with p b/2V.
    """
    position = (craft.fuselage_position[0], craft.fuselage_position[1], craft.fuselage_position[2])
    swing = cross(rates, position)
    u = air[0] + swing[0]
    v = air[1] + swing[1]
    w = air[2] + swing[2]
    scale = -0.5 * density * math.sqrt(u * u + v * v + w * w)
    area = craft.fuselage_drag_area
    force = (scale * area[0] * u, scale * area[1] * v, scale * area[2] * w)
    moment = cross(position, force)
    for k in range(3):
        out.fuselage_force_body[k] = force[k]
    damping = 0.0
    if craft.damping_area > 0.0:
        speed = math.sqrt(air[0] * air[0] + air[1] * air[1] + air[2] * air[2])
        damping = 0.25 * density * speed * craft.damping_area
    span = craft.damping_span * craft.damping_span
    chord = craft.damping_chord * craft.damping_chord
    return (
        force[0],
        force[1],
        force[2],
        moment[0] + damping * span * craft.roll_damping * rates[0],
        moment[1] + damping * chord * craft.pitch_damping * rates[1],
        moment[2] + damping * span * craft.yaw_damping * rates[2],
    )


@compiled
def vehicle_loads(state, controls, craft, air: Vector, rates: Vector, tilt_rate: float, density: float, out) -> Loads:
    """Aerodynamic and propulsive force [N] and moment [N m] about the centre of mass, body axes.

    `air` is the velocity of the centre of mass through the air, body axes [m/s]; `rates` are relative to the Earth and
    its air, and the wing turns by `tilt_rate` more [rad/s] (for the gyroscopic moment the Earth's own turn is
    neglected). `craft` is a VEHICLE record; fills part of the OUTPUTS record `out`.
    """
    tilt = state[TILT]
    turn = (math.cos(tilt), math.sin(tilt))
    pivot = (craft.pivot[0], craft.pivot[1], craft.pivot[2])
    swing = cross(rates, pivot)
    air_pivot = (air[0] + swing[0], air[1] + swing[1], air[2] + swing[2])
    wing_rates = to_wing(rates, turn[0], turn[1])
    wing = add_parts(
        state, controls, craft, 1,
        to_wing(air_pivot, turn[0], turn[1]), (wing_rates[0], wing_rates[1] + tilt_rate, wing_rates[2]),
        density, out,
    )  # fmt: skip
    force = to_body((wing[0], wing[1], wing[2]), turn[0], turn[1])
    moment = to_body((wing[3], wing[4], wing[5]), turn[0], turn[1])
    lever = cross(pivot, force)
    out.downwash_angle = downwash_angle(force, air, craft.downwash_area, density)
    fixed = add_parts(state, controls, craft, 0, air, rates, density, out)
    hull = fuselage_loads(craft, air, rates, density, out)
    return (
        force[0] + fixed[0] + hull[0],
        force[1] + fixed[1] + hull[1],
        force[2] + fixed[2] + hull[2],
        moment[0] + lever[0] + fixed[3] + hull[3],
        moment[1] + lever[1] + fixed[4] + hull[4],
        moment[2] + lever[2] + fixed[5] + hull[5],
    )


@compiled
def describe_parts(state, craft, out) -> None:
    """Where each part's force acts, in body axes, and how near it is to stall; `vehicle_loads` has filled `out`."""
    for i in range(craft.rotor_count):
        rotor = craft.rotors[i]
        turn = (math.cos(state[TILT] * rotor.tilts), math.sin(state[TILT] * rotor.tilts))
        axis = to_body((rotor.axis[0], rotor.axis[1], rotor.axis[2]), turn[0], turn[1])
        point = to_body((rotor.position[0], rotor.position[1], rotor.position[2]), turn[0], turn[1])
        for k in range(3):
            out.rotor_force_body[i, k] = out.thrust[i] * axis[k]
            out.rotor_point_body[i, k] = point[k] + rotor.tilts * craft.pivot[k]
    for i in range(craft.surface_count):
        surface = craft.surfaces[i]
        turn = (math.cos(state[TILT] * surface.tilts), math.sin(state[TILT] * surface.tilts))
        chord = to_body((surface.chord_axis[0], surface.chord_axis[1], surface.chord_axis[2]), turn[0], turn[1])
        normal = to_body((surface.normal[0], surface.normal[1], surface.normal[2]), turn[0], turn[1])
        point = to_body((surface.position[0], surface.position[1], surface.position[2]), turn[0], turn[1])
        load = out.surface_load[i]
        for k in range(3):
            out.surface_force_body[i, k] = load[0] * chord[k] + load[1] * normal[k]
            out.surface_point_body[i, k] = point[k] + surface.tilts * craft.pivot[k] - load[2] * chord[k]
        angle = math.atan2(load[4], load[3])
        out.surface_angle_of_attack[i] = angle
        out.stall_margin[i] = surface.max_lift_angle - abs(angle)
    for i in range(craft.surface_count, out.stall_margin.shape[0]):
        out.stall_margin[i] = math.inf
