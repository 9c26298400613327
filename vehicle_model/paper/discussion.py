"""What the results mean, in sentences whose numbers and signs are those that were computed."""

import math

import numpy as np

from vehicle_model.earth import STANDARD_GRAVITY
from vehicle_model.identify import blade_lift
from vehicle_model.linearise import Mode
from vehicle_model.paper.loads_by_part import PARTS
from vehicle_model.paper.printed import (
    CRUISE_AIRSPEED,
    LITERAL_LIFT_COEFFICIENT,
    TABLE_1,
    THETA_AXIS,
    TILT_AXIS,
    U_AXIS,
    W_AXIS,
)
from vehicle_model.paper.results import Results
from vehicle_model.paper.tables import mode_text, step_table

__all__ = ["descents", "elevator", "eq_11", "hover_tilt", "literal_slipstream", "pitching_moment", "step"]


def hover_tilt(results: Results) -> str:
    """Tilt in hover against what eq. (13) says of thrust and slipstream lift."""
    hover = results.hover
    wing = results.aircraft.wing
    area = sum(wing.chord_at(strip.y) * strip.width for strip in wing.strips if strip.wetted)
    ratio = area / (math.pi * results.aircraft.rotors.wing.radius**2)
    tilt = math.degrees(results.trims[0].tilt)
    beyond = (
        f" The tilt axis of Fig. 10 ends at {TILT_AXIS[1]:g}°. If that end is automatic, the paper's hover tilt is "
        "lower than ours: it has more lift in its slipstream."
        if tilt > TILT_AXIS[1]
        else ""
    )
    return (
        "With FX = 0 and the fuselage level, eq. (13) sets the tilt by tan ξ = T/L_wet, drag left out. Thrust is "
        f"{hover.thrust:.1f} N, lift in the slipstream {hover.lift:.1f} N and drag {hover.drag:.1f} N: arctan(T/L) = "
        f"{math.degrees(hover.tilt_without_drag):.2f}°, arctan((T - D)/L) = "
        f"{math.degrees(hover.tilt_with_drag):.2f}°, and the trim has {tilt:.2f}°. Lift is "
        f"{hover.lift / hover.thrust:.3f} of thrust. Eqs (9)-(11) with the paper's lift slope give "
        f"{LITERAL_LIFT_COEFFICIENT / 4.0 * ratio:.3f} for our wetted area of {ratio:.2f} disk areas, and four times "
        f"that in a fully contracted wake.{beyond}"
    )


def elevator(results: Results) -> str:
    """The sign of the equivalent elevator and what it does in hover."""
    hover, cruise = results.trims[0], results.trims[-1]
    gain = results.linear["throttle"].b[results.linear["throttle"].state_names.index("q")] * math.radians(1.0)
    tail = float(hover.outputs["thrust"][2])
    arm = 1000.0 * results.trim_moments.parts[0, 0] / results.hover.thrust
    pushes = "up" if tail > 0.0 else "down"
    return (
        f"Positive is trailing edge down and tail propeller up; both lower the nose ({math.degrees(gain):.1f} deg/s² "
        "per degree of the surface at 30 m/s). In hover the surface meets no air and the tail propeller does the "
        f"work: at {math.degrees(hover.elevator):.1f}° it pushes {pushes} with {abs(tail):.1f} N, because the wing "
        f"propellers' thrust passes {abs(arm):.0f} mm {'ahead of' if arm > 0.0 else 'behind'} the centre of mass. At "
        f"30 m/s the tail propeller turns at {abs(cruise.tail_rpm):.0f} RPM: its share fades with sin² of the tilt."
    )


def step(results: Results) -> str:
    """The elevator step in words, and why the axes of Fig. 12 do not belong together (M17)."""
    found = results.step_summary
    short_period, phugoid = results.mode("short_period"), TABLE_1["phugoid"]
    half = "" if short_period is None else f"The short period halves in {short_period.time_to_half:.2f} s. "
    closed = math.radians(STANDARD_GRAVITY / abs(phugoid))
    theta = math.degrees(max(abs(value) for value in found.theta))
    low, _ = found.w
    factor = W_AXIS[0] / low if low < 0.0 else math.inf
    clash = (
        f"To fill an axis that reaches {W_AXIS[0]:g} m/s it would take a step {factor:.1f} times as large, and theta "
        f"would reach {theta * factor:.1f}°. So in our aircraft w and theta cannot both fill their axes. The paper's "
        "may have less lift per angle of attack, or the axes may not be tight; its elevator power cannot be told "
        "from the figure. We keep theta inside."
        if factor * theta > THETA_AXIS[1]
        else "It fits its axis together with theta."
    )
    ours, printed = found.phugoid, Mode("phugoid", phugoid.real, phugoid.imag)
    return f"""
The nose goes down, as positive elevator asks. {half}A damped oscillation fitted to u and theta after it has gone
({mode_text(ours)}) has a period of {ours.period:.2f} s and a damping ratio of {ours.damping:.3f}. The paper's phugoid
has {printed.period:.2f} s and {printed.damping:.3f}. The linear model follows the flight within
{100 * found.linear_error:.1f} % of its peaks.

{step_table(results)}

**The axes of u and theta do not belong together, for any aircraft with this phugoid.** In a phugoid speed and height
trade places, so u swings by g/ω per radian of theta: {closed:.3f} m/s per degree at the paper's own frequency. Ours
has {math.radians(found.linear_u_per_theta):.3f} in the eigenvector and {math.radians(found.u_per_theta):.3f} in the
flight. Inside u <= {U_AXIS[1]:g} m/s theta could swing by ±{0.5 * U_AXIS[1] / closed:.2f}° at most and would hardly
show on an axis of ±{THETA_AXIS[1]:g}°. Ours ends {found.final_u:.2f} m/s faster, where lift balances the weight at
the smaller angle of attack. Either the u axis is mislabelled (a factor of ten would do) or theta stayed far inside
its axis.

**w** jumps with the short period and then stays, as angle of attack does in a phugoid. Ours stays at
{found.final_w:.3f} m/s, {math.degrees(found.final_w / CRUISE_AIRSPEED):.2f}° of angle of attack. {clash}""".strip()


def eq_11(results: Results) -> str:
    """How little dynamic pressure eq. (11) leaves in cruise."""
    cruise = results.cruise
    share = (float(cruise.outputs["induced_velocity"][0]) / CRUISE_AIRSPEED) ** 2
    wetted, _ = results.aircraft.wing_strips
    ours = -float(cruise.outputs["surface_force_body"][wetted, 2].sum()) / results.weight
    literal = results.literal[-1]
    if literal is None:
        then = "With it there is no level trim at 30 m/s."
    else:
        lift = -float(literal.outputs["surface_force_body"][wetted, 2].sum()) / results.weight
        then = f"With it the wing in the slipstream carries {100 * lift:.2f} % of the weight at 30 m/s."
    return (
        f"At 30 m/s our disks induce {cruise.outputs['induced_velocity'][0]:.2f} m/s, so it would be {share:.1e} of "
        f"the free stream's. {then} Yet the text has wetted and unwetted areas act as lift in cruise. The vector sum "
        f"of free stream and wake gives {100 * ours:.0f} %."
    )


_WHY_NOSE_UP = {
    "wing in the slipstream": (
        "Forward speed bends the slipstream back over the upright wing and gives it an angle of attack. Its lift "
        "then points aft, and acts above the centre of mass."
    ),
    "tailplane": "The tailplane meets the wing's downwash and is pressed down.",
    "propellers": "Forward speed changes the propellers' thrust, which does not pass through the centre of mass.",
}


def pitching_moment(results: Results) -> str:
    """Which part makes the moment out of hover, and what that says of NASA TN D-1389 and of Fig. 10."""
    slope = float(results.hover_slopes.sum())
    largest = int(np.argmax(np.sign(slope) * results.hover_slopes))
    moments = results.hover_moments
    trims = results.trim_moments
    start, end = trims.total[0], trims.total[-1]
    negative = np.flatnonzero(np.array([trim.elevator for trim in results.trims]) < 0.0)
    arm = 1000.0 * trims.parts[0, 0] / results.hover.thrust
    middle = int(np.argmax(np.abs(trims.total)))
    slow = int(np.searchsorted(trims.airspeed, 10.0))
    change = trims.parts[:, slow] - trims.parts[:, 0]
    changes = ", ".join(f"{PARTS[i]} {change[i]:+.1f}" for i in np.argsort(-np.abs(change), kind="stable")[:3])
    why = _WHY_NOSE_UP.get(PARTS[largest], "") if slope > 0.0 else ""
    agrees = "as the NASA report says" if slope > 0.0 else "against the NASA report"
    margin = 1000.0 * abs(moments.total[-1]) / results.weight
    wing = PARTS.index("wing in the slipstream")
    upright = moments.parts[wing, -1]
    lowered = float(np.interp(moments.airspeed[-1], trims.airspeed, trims.parts[wing]))
    return f"""
**At fixed controls our aircraft pitches {_nose(slope)}**, {agrees}: dM/dV = {slope:+.2f} N m per m/s in hover, and
{moments.total[-1]:+.1f} N m at {moments.airspeed[-1]:g} m/s, the moment of moving the centre of mass by {margin:.0f}
mm. The {PARTS[largest]} makes {results.hover_slopes[largest]:+.2f} of the slope. {why}

**Along the trims it is another matter**, for wing and propellers turn while the speed rises. Without elevator the
moment is {start:+.1f} N m in hover, largest at {trims.airspeed[middle]:g} m/s with {trims.total[middle]:+.1f} N m,
and {end:+.1f} N m at 30 m/s. In hover the propellers make {trims.parts[0, 0]:+.1f} N m of it: their thrust passes
{abs(arm):.0f} mm {"ahead of" if arm > 0.0 else "behind"} the centre of mass, where the fit puts them. From hover to
{trims.airspeed[slow]:g} m/s the sum changes by {change.sum():+.1f} N m ({changes}): as the wing comes down its lift
turns upward and the thrust forward, and the tailplane meets the downwash. The elevator is negative at {len(negative)}
of the {len(results.trims)} speeds, as in Fig. 10.

So the two do not contradict each other: the first is for a wing that stays upright, and the trims lower it as speed
rises. At {moments.airspeed[-1]:g} m/s the wing in the slipstream makes {upright:+.1f} N m upright and {lowered:+.1f}
N m at its trimmed tilt. Real propellers have more nose-up moment than ours: in edgewise flow the disk makes a force
in its plane, pointing aft at the hub, and a hub moment. As in the paper, neither is modelled.""".strip()


def _nose(moment: float) -> str:
    return "nose up" if moment > 0.0 else "nose down"


def descents(results: Results) -> str:
    """The margin that a partial-power descent costs, after VZ-2."""
    head = (
        "The VZ-2 had its stall trouble at 25 to 30° of incidence, worse in descents at partial power. Less power "
        "means less slipstream, so the free stream from below counts for more in the angle of attack. Ours:"
    )
    lines = [head, ""]
    for descent in results.descents:
        if not len(descent.angle):
            lines.append(f"- At {descent.airspeed:.1f} m/s no descent with the fuselage level could be trimmed.")
            continue
        margin = np.degrees(descent.wetted_margin)
        stalls = np.flatnonzero(margin < 0.0)
        if margin[0] < 0.0:
            says = "it is stalled even in level flight"
        elif len(stalls):
            around = slice(stalls[0] - 1, stalls[0] + 1)
            crossing = math.degrees(float(np.interp(0.0, -margin[around], descent.angle[around])))
            says = f"it stalls at {crossing:.1f}°"
        else:
            says = f"it does not stall down to {math.degrees(descent.angle[-1]):.0f}°"
        least = int(np.argmin(descent.power))
        lines.append(
            f"- {descent.airspeed:.1f} m/s, level at {math.degrees(descent.tilt[0]):.0f}° of tilt: {margin[0]:.1f}° "
            f"left in level flight, {margin[-1]:.1f}° at {math.degrees(descent.angle[-1]):.0f}° of descent; {says}. "
            f"Least power {100 * descent.power[least]:.0f} %, at {math.degrees(descent.angle[least]):.0f}°."
        )
    return "\n".join(lines)


def literal_slipstream(results: Results) -> str:
    """What eqs (9)-(11) do to trims and poles of the same aircraft."""
    missing = [airspeed for airspeed, trim in enumerate(results.literal) if trim is None]
    exists = (
        "Level trims exist at all speeds."
        if not missing
        else f"There is no level trim at {', '.join(map(str, missing))} m/s."
    )
    tilts = np.array([math.nan if trim is None else math.degrees(trim.tilt) for trim in results.literal])
    falls = np.abs(np.diff(tilts))
    vector = float(np.abs(np.diff(results.curves[1])).max())
    jump = smooth = ""
    if np.isfinite(falls).any():
        steepest = int(np.nanargmax(falls))
        if falls[steepest] > 2.0 * vector:
            smooth = " The smooth transition of Fig. 10 is not what the printed equations give for this aircraft."
        jump = (
            f" The tilt changes most between {steepest} and {steepest + 1} m/s, by {falls[steepest]:.1f}°; with the "
            f"vector sum it never changes by more than {vector:.1f}° between neighbours."
        )
    named: dict[str, Mode] = {mode.name: mode for mode in results.literal_modes}
    poles = "; ".join(f"{name.replace('_', ' ')} {mode_text(named.get(name))}" for name in TABLE_1)
    then = f" Poles at 30 m/s: {poles}." if named else ""
    coefficient = 0.1 * math.degrees(results.aircraft.wing.incidence)
    return (
        f"The wing in the slipstream then has a constant lift coefficient, {coefficient:g}, and no free stream. It "
        "cannot unload the propellers as speed rises, so tilt and RPM stay high until the wing outside the slipstream "
        "can carry the aircraft. "
        f"{exists}{jump}{smooth}{then}"
    )


def propeller(results: Results) -> str:
    """How hard the calibrated propeller's blades work in hover, beside what real ones do."""
    rotor, hover = results.aircraft.rotors.wing, results.trims[0]
    thrust, power = float(hover.outputs["thrust"][0]), float(hover.outputs["shaft_power"][0])
    disk = math.pi * rotor.radius**2
    merit = thrust**1.5 / math.sqrt(2.0 * float(hover.outputs["density"]) * disk) / power
    return (
        f"In hover each propeller carries {thrust:.0f} N on {thrust / disk:.0f} N/m² of disk, at a figure of merit of "
        f"{merit:.2f}; the mean lift coefficient of its blades, 6 CT/solidity, is "
        f"{blade_lift(results.aircraft, hover):.2f}. Real propellers of this size reach 0.6 to 0.75 and about 1: the "
        "pitch that 30 m/s below 5000 RPM asks for loads the blades heavily at 6000 RPM in hover. Power follows from "
        f"two numbers, induced power factor {rotor.induced_power_factor:g} and mean blade drag {rotor.profile_drag:g}, "
        "with which the measured power coefficient of an APC 10x4.7 (UIUC) is met within 0.007."
    )
