"""Lift and drag of a strip of wing, tailplane or fin at any angle of attack, from hover to cruise.

Attached flow has a linear lift slope and a parabolic drag polar. Separated flow is a plate: CL = plate_lift
sin 2 alpha, CD = zero_lift_drag + plate_drag sin^2 alpha. A smooth step around the stall angle blends the two, so lift
has a maximum but, as in Figs 7-8 of Hong et al. (2013), does not vanish beyond it.
"""

import math

from vehicle_model.compiled import compiled

__all__ = ["coefficients", "max_lift_angle", "strip_force"]


@compiled
def coefficients(surface, angle: float, sine: float, cosine: float, flap: float) -> tuple[float, float]:
    """Lift and drag coefficient of a SURFACE record at an angle of attack in -pi..pi [rad].

    `sine` and `cosine` are those of the angle (the caller has them at hand), `flap` the flap angle [rad], trailing
    edge down positive. A flap shifts the attached lift curve only: separated flow does not feel it.
    """
    attached_lift = surface.lift_slope * (angle + surface.flap_effectiveness * flap)
    attached_drag = surface.induced_drag * attached_lift * attached_lift
    progress = (abs(angle) - surface.stall_angle) / surface.stall_width
    if progress <= -1.0:
        return attached_lift, surface.zero_lift_drag + attached_drag
    plate_lift = 2.0 * surface.plate_lift * sine * cosine
    plate_drag = surface.plate_drag * sine * sine
    if progress >= 1.0:
        return plate_lift, surface.zero_lift_drag + plate_drag
    t = 0.5 * (progress + 1.0)
    blend = t * t * t * (10.0 + t * (6.0 * t - 15.0))  # value, slope and curvature match at both ends
    lift = attached_lift + blend * (plate_lift - attached_lift)
    drag = attached_drag + blend * (plate_drag - attached_drag)
    return lift, surface.zero_lift_drag + drag


@compiled
def max_lift_angle(surface) -> float:
    """Angle of attack [rad] of the greatest lift of a SURFACE record up to 50 deg, flap neutral."""
    best = 0.0
    best_lift = 0.0
    step = math.radians(0.5)
    for refinement in range(3):
        start = max(best - 50.0 * step, 0.0)
        for i in range(101):
            angle = start + i * step
            lift, _ = coefficients(surface, angle, math.sin(angle), math.cos(angle), 0.0)
            if lift > best_lift:
                best_lift = lift
                best = angle
        step *= 0.1
    return best


@compiled
def strip_force(surface, along: float, across: float, flap: float, density: float) -> tuple[float, float, float, float]:
    """Force of a strip moving through the air at `along` (the chord, forward) and `across` (the normal) [m/s].

    Returns the force along the chord axis and along the normal [N], the angle of attack [rad] and how far behind the
    quarter point the force acts [m]. The centre of pressure moves from the quarter chord to the
    middle at 90 deg and to the three-quarter point in reversed flow: (1 - cos alpha)/4 of the chord.
    """
    speed = math.sqrt(along * along + across * across)
    if speed < 1e-9:
        return 0.0, 0.0, 0.0, 0.0
    sine = across / speed
    cosine = along / speed
    angle = math.atan2(across, along)
    lift, drag = coefficients(surface, angle, sine, cosine, flap)
    pressure_area = 0.5 * density * speed * speed * surface.area
    force_along = pressure_area * (lift * sine - drag * cosine)
    force_across = -pressure_area * (lift * cosine + drag * sine)
    return force_along, force_across, angle, 0.25 * (1.0 - cosine) * surface.chord
