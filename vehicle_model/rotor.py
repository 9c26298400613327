"""A propeller in any inflow: blade-element thrust and momentum theory, eqs (3)-(8) of Hong et al. (2013).

Air velocities are those of the disk through the air, split as the paper does: `axial` (v_z) is positive when the
disk moves against its own thrust (descent), so in forward flight it is negative; `edgewise` lies in the disk.

Momentum theory holds in climb and in the windmill brake state. Between them (0 < v_z < 2 v_i: vortex ring and
turbulent wake) the flow through the disk is not |v_z - v_i|; there `disk_flow` follows measured induced velocities
(Leishman, Principles of Helicopter Aerodynamics, 2nd ed., eq. 2.96) and joins momentum theory smoothly at both ends.

Not modelled: in-plane force and hub moment of an inclined disk, the gain of thrust with edgewise speed in blade-element
theory (mu^2), blade stall, flapping, change of blade lift with Reynolds number.
"""

import math

from vehicle_model.compiled import compiled

__all__ = ["disk_flow", "induced_by_share", "induced_velocity", "rotor_loads"]


@compiled
def disk_flow(axial: float, induced: float) -> tuple[float, float]:
    """Flow through the disk [m/s] for an induced velocity >= 0, and its derivative by the induced velocity.

    With s = axial/induced: 1 - s for s <= 0, s - 1 for s >= 2 (momentum theory, eq. 5) and between them
    1 - s + s^2/2 + s^2 (2 - s)^2 (0.537 s - 0.711), all times `induced`. The polynomial has momentum theory's value and
    slope at both ends, was fitted to Leishman's curve (rms 0.04) and keeps induced * flow rising with
    `induced`, so that the induced velocity stays unique.
    """
    if axial <= 0.0:
        return induced - axial, 1.0
    if axial >= 2.0 * induced:
        return axial - induced, -1.0
    s = axial / induced
    rest = 2.0 - s
    hump = s * s * rest * rest
    slope = 0.537 * s - 0.711
    g = 1.0 - s + 0.5 * s * s + hump * slope
    dg = -1.0 + s + 2.0 * s * rest * (rest - s) * slope + hump * 0.537
    return induced * g, g - s * dg


@compiled
def induced_velocity(axial: float, edgewise: float, blade: float, coupling: float) -> float:
    """Induced velocity [m/s] where blade-element and momentum thrust agree, eqs (4)-(7).

    `blade` is v_b of eq. (3) [m/s], `coupling` is w a0 b c_r / (8 pi) [m/s]. Solves
    v_i v' = coupling (v_b - v_i), which is eq. (7) without its singularity at v' = 0, by Newton-Raphson from the
    closed solution for axial flow at the same speed (in hover: the hover value), inside the bracket [0, v_b], bisecting
    where Newton would leave it. Negative thrust is the mirror image: all signs change.
    """
    if blade < 0.0:
        return -induced_velocity(-axial, edgewise, -blade, coupling)
    if blade * coupling <= 1e-12:
        return 0.0
    speed = math.sqrt(axial * axial + edgewise * edgewise) if axial <= 0.0 else edgewise
    half = 0.5 * (speed + coupling)
    guess = math.sqrt(half * half + coupling * blade) - half
    low = 0.0
    high = blade
    for _ in range(60):
        flow, flow_slope = disk_flow(axial, guess)
        total = math.sqrt(edgewise * edgewise + flow * flow)
        residual = guess * total - coupling * (blade - guess)
        if residual > 0.0:
            high = guess
        else:
            low = guess
        step = residual * total / (total * (total + coupling) + guess * flow * flow_slope)
        following = guess - step
        if not (low <= following <= high):
            following = 0.5 * (low + high)
            step = guess - following
        guess = following
        # Newton's error is of the order of the square of its last step.
        if abs(step) <= 1e-6 * blade:
            break
    return guess


@compiled
def induced_by_share(axial: float, edgewise: float, induced: float, share: float) -> float:
    """Induced velocity [m/s] when a disk makes a `share` (0..1) of the thrust with which it had `induced` [m/s].

    By momentum theory T = 2 rho A v_i v', so v_i v' is that share of what it was. It rises with v_i from zero: one root
    in [0, `induced`], found as in `induced_velocity`, from what it is in hover.
    """
    if induced < 0.0:
        return -induced_by_share(-axial, edgewise, -induced, share)
    flow, _ = disk_flow(axial, induced)
    goal = share * induced * math.sqrt(edgewise * edgewise + flow * flow)
    if goal <= 0.0:
        return 0.0
    low = 0.0
    high = induced
    guess = math.sqrt(share) * induced
    for _ in range(60):
        flow, flow_slope = disk_flow(axial, guess)
        total = math.sqrt(edgewise * edgewise + flow * flow)
        residual = guess * total - goal
        if residual > 0.0:
            high = guess
        else:
            low = guess
        step = residual * total / (total * total + guess * flow * flow_slope)
        following = guess - step
        if not (low <= following <= high):
            following = 0.5 * (low + high)
            step = guess - following
        guess = following
        if abs(step) <= 1e-6 * induced:
            break
    return guess


@compiled
def rotor_loads(rotor, speed: float, axial: float, edgewise: float, density: float) -> tuple[float, float, float]:
    """Thrust [N], shaft torque that resists the motor [N m] and induced velocity [m/s] of one rotor.

    `rotor` is a ROTOR record, `speed` the rotor speed [rad/s] (negative: a reversible rotor running backwards,
    thrust reversed), `axial` and `edgewise` as in the module's head [m/s]. Torque is induced and climb power,
    T (kappa v_i - v_z), plus blade profile power, rho b c_r r (w r)^3 cd/8 sqrt(1 + 9.3 mu^2) (the usual 1 + 4.65 mu^2
    for small advance ratios mu), divided by the speed. Near standstill, where the blades' tips move slower than
    the air along the axis, blade-element theory ends and the first part fades to zero.

    A damaged propeller makes `thrust_factor` of that thrust, and its wake is as much weaker. Its torque stays: what a
    chipped or iced blade loses in lift it gains in drag, so that neither speed nor power betrays the fault.
    """
    lift = rotor.lift_slope * rotor.blades * rotor.blade_chord
    tip_speed = speed * rotor.radius
    blade = axial + 0.5 * tip_speed * rotor.twist  # eq. (3): 2/3 * 3/4
    induced = induced_velocity(axial, edgewise, blade, abs(speed) * lift / (8.0 * math.pi))
    thrust_per_speed = 0.25 * (blade - induced) * rotor.radius * rotor.radius * density * lift
    thrust = thrust_per_speed * abs(speed)
    profile = 0.125 * density * rotor.blades * rotor.blade_chord * rotor.radius * rotor.radius * rotor.profile_drag
    profile_torque = profile * tip_speed * math.sqrt(tip_speed * tip_speed + 9.3 * edgewise * edgewise)
    turning = math.copysign(1.0, tip_speed) if abs(tip_speed) >= abs(axial) else tip_speed / abs(axial)
    torque = turning * thrust_per_speed * (rotor.induced_power_factor * induced - axial) + profile_torque
    if rotor.thrust_factor != 1.0:
        thrust *= rotor.thrust_factor
        induced = induced_by_share(axial, edgewise, induced, rotor.thrust_factor)
    return thrust, torque, induced
