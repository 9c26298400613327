"""Lift and drag of a strip of wing, tailplane or fin at any angle of attack, from hover to cruise.

Attached flow is potential flow about a thin section, CL = lift_slope sin alpha (2 pi sin alpha in two dimensions), with
a parabolic drag polar. Separated flow is a plate: CL = plate_lift sin 2 alpha, CD = zero_lift_drag + plate_drag
sin^2 alpha. A smooth step around the stall angle blends the two, so lift has a maximum but, as in Figs 7-8 of Hong et
al. (2013), does not vanish beyond it. Everything is algebraic in the flow's components: no angle is needed.
"""

import math

from vehicle_model.compiled import compiled

__all__ = ["coefficients", "max_lift_angle", "strip_force"]


@compiled
def coefficients(surface, sine: float, cosine: float, flap: float) -> tuple[float, float]:
    """Lift and drag coefficient of a SURFACE record at the angle of attack with this sine and cosine.

    `flap` is the flap angle [rad], trailing edge down positive; it turns the attached flow's zero-lift line only,
    separated flow does not feel it. Between `stall_sine` and `stall_sine + stall_sine_span` one passes into the other.
    """
    attached_lift = surface.lift_slope * (sine + surface.flap_effectiveness * flap * cosine)
    attached_drag = surface.induced_drag * attached_lift * attached_lift
    beyond = abs(sine) - surface.stall_sine
    if cosine > 0.0 and beyond <= 0.0:
        return attached_lift, surface.zero_lift_drag + attached_drag
    plate_lift = 2.0 * surface.plate_lift * sine * cosine
    plate_drag = surface.plate_drag * sine * sine
    if cosine <= 0.0 or beyond >= surface.stall_sine_span:
        return plate_lift, surface.zero_lift_drag + plate_drag
    progress = beyond / surface.stall_sine_span
    # A step whose value, slope and curvature match at both ends.
    blend = progress * progress * progress * (10.0 + progress * (6.0 * progress - 15.0))
    lift = attached_lift + blend * (plate_lift - attached_lift)
    drag = attached_drag + blend * (plate_drag - attached_drag)
    return lift, surface.zero_lift_drag + drag


@compiled
def max_lift_angle(surface) -> float:
    """Angle of attack [rad] of the greatest lift of a SURFACE record up to 50 deg, flap neutral."""
    best = 0.0
    best_lift = 0.0
    step = math.radians(0.5)
    for _ in range(3):  # ever finer steps around the best so far
        start = max(best - 50.0 * step, 0.0)
        for i in range(101):
            angle = start + i * step
            lift, _ = coefficients(surface, math.sin(angle), math.cos(angle), 0.0)
            if lift > best_lift:
                best_lift = lift
                best = angle
        step *= 0.1
    return best


@compiled
def strip_force(surface, along: float, across: float, flap: float, density: float) -> tuple[float, float, float]:
    """Force of a strip moving through the air at `along` (the chord, forward) and `across` (the normal) [m/s].

    Returns the force along the chord axis and along the normal [N] and how far behind the quarter point it acts [m].
    The centre of pressure moves from the quarter chord to the
    middle at 90 deg and to the three-quarter point in reversed flow: (1 - cos alpha)/4 of the chord.
    """
    speed = math.sqrt(along * along + across * across)
    if speed < 1e-9:
        return 0.0, 0.0, 0.0
    inverse = 1.0 / speed
    sine = across * inverse
    cosine = along * inverse
    lift, drag = coefficients(surface, sine, cosine, flap)
    scale = 0.5 * density * speed * surface.area
    force_along = scale * (lift * across - drag * along)
    force_across = -scale * (lift * along + drag * across)
    return force_along, force_across, 0.25 * (1.0 - cosine) * surface.chord
