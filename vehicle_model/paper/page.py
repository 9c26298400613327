"""The page docs/paper/README.md: what is reproduced, what was calibrated, what the paper cannot have meant.

Every number in it is computed. What depends on a sign or on a target met is said by what was found.
"""

import math

import numpy as np

from vehicle_model.paper.discussion import (
    descents,
    elevator,
    eq_11,
    hover_tilt,
    literal_slipstream,
    pitching_moment,
    propeller,
    step,
)
from vehicle_model.paper.printed import CALIBRATED_HOLD, PRINTED_DAMPING, TABLE_1
from vehicle_model.paper.results import WIND, Results
from vehicle_model.paper.tables import (
    at_their_limits,
    authority_table,
    flying_qualities_table,
    hold_table,
    moment_table,
    parameter_table,
    speed_stability,
    table_1,
    target_table,
)
from vehicle_model.paper.targets import targets

__all__ = ["FIGURES", "page"]

FIGURES = {  # with their captions, in the order they are drawn
    "fig08_coefficients.png": "Fig. 8. Lift and drag coefficient of a wing strip. Grey bands: flow passes from "
    "attached to separated.",
    "fig10_trim.png": "Fig. 10. Level trims with the fuselage level (left) and their second differences (right). "
    "Dashed: lowest and highest tick of the paper's axes.",
    "fig11_12_elevator_step.png": "Figs 11-12. Response to +1° of elevator at 1 s, throttle held. Dashed red: ends "
    "of the paper's axes. Dashed grey: the linear model, eq. (21), behind its elevator servo.",
    "fig13_poles.png": "Fig. 13. Left: longitudinal poles on the paper's damping grid. Right: where the phugoid "
    "lies for each quantity the propellers may keep.",
    "power_and_stall.png": "Level trims: shaft power of all rotors (left) and angle of attack left to maximum lift "
    "(right).",
    "pitching_moment.png": "Pitching moment about the centre of mass by part, nose up positive. Left: airspeed "
    "rises, everything else stays as trimmed in hover. Right: at the level trims, elevator and tail propeller at rest: "
    "what the equivalent elevator has to balance.",
    "descent.png": "Steady descents with the fuselage level: stall margin of the wing in the slipstream, and power "
    "against that of level flight at the same airspeed.",
    "slipstream.png": "Level trims with the vector slipstream and with eqs (9)-(11) taken literally, same aircraft.",
}


def page(results: Results) -> str:
    """The page as Markdown, figures by their names in FIGURES beside it."""
    sections = (
        _head,
        _reproduced,
        _coefficients,
        _trim,
        _step,
        _poles,
        _holds,
        _calibrated,
        _cannot_mean,
        _moment,
        _stall,
        _slipstream,
        _authority,
        _qualities,
    )
    return "\n\n".join(section(results).strip() for section in sections) + "\n"


def _figure(name: str) -> str:
    alternative = name.removesuffix(".png").replace("_", " ")
    return f"![{alternative}]({name})\n\n*{FIGURES[name]}*"


def _head(results: Results) -> str:
    return f"""
# The paper, reproduced

Hong, Jeong, Kim, Suk, Jung, "Longitudinal Flight Dynamics of a Single Tilt-wing UAV", IFAC ACA 2013, pp. 60-65, [doi
10.3182/20130902-5-DE-2040.00081](https://doi.org/10.3182/20130902-5-DE-2040.00081), flown by the aircraft
`{results.aircraft.source_file.name}` of this repository. `make paper` writes this page and its figures; every number
on it is computed then. All flights here are over a flat Earth, in still air at sea level, with the vector slipstream
unless said otherwise.

The paper prints no mass, inertia, dimension or coefficient of its aircraft, apart from a lift slope and an incidence.
It prints results: the axes of its figures, the words beside them and two pairs of eigenvalues. So the aircraft's
parameters were fitted to those results. Agreement below is **calibration, not validation**: other parameter sets fit
as well.
"""


def _reproduced(results: Results) -> str:
    found = targets(results)
    missed = [target.name for target in found if not target.met]
    verdict = (
        f"Not met: {'; '.join(missed)}."
        if missed
        else f"All {len(found)} are met: one aircraft can have these trims, poles and step response together."
    )
    return f"""
## What is reproduced

Poles, trims and step are the paper's results, the tolerances ours. Thrust to weight and control in hover are what a
machine that can be flown needs. {verdict}

{target_table(found)}
"""


def _coefficients(results: Results) -> str:
    wing = results.aircraft.vehicle[0]["surfaces"][0]
    plate = float(wing["zero_lift_drag"] + wing["plate_drag"])
    return f"""
## Fig. 8: lift and drag over the full circle

{_figure("fig08_coefficients.png")}

The curves join those of attached flow, with a lift slope of {wing["lift_slope"]:.2f} per radian and a parabolic
polar, to those of a flat plate. "Stall-less" is taken as the paper's Fig. 7 shows it: lift has a maximum, at
{math.degrees(wing["max_lift_angle"]):.1f}°, and does not vanish beyond it. At 90° the drag coefficient is
{plate:.2f}, and the plate's greatest lift coefficient {wing["plate_lift"]:.2f}; published values for plates at these
angles run from 1.2 to 2.0 and from 0.7 to 1.1. The paper gives its curves as a figure only, without values to compare
with.
"""


def _trim(results: Results) -> str:
    rpm, _, angle = results.curves
    lowest = int(np.argmin(rpm))
    dip = (
        f" to {rpm[lowest]:.0f} at {lowest} m/s and rises again to {rpm[-1]:.0f}: in fast flight a propeller of "
        "fixed pitch must turn faster to pull at all"
        if lowest < len(rpm) - 1
        else f" to {rpm[-1]:.0f}"
    )
    largest = np.abs(np.diff(results.curves, 2)).max(axis=1)
    return f"""
## Fig. 10: level trim from hover to 30 m/s

{_figure("fig10_trim.png")}

Unknowns are RPM, tilt and equivalent elevator, eqs (17)-(20), with the fuselage level. RPM falls from
{rpm[0]:.0f}{dip}. The elevator runs from {angle.min():.1f}° to {angle.max():.1f}°. Largest second differences between
speeds 1 m/s apart are {largest[0]:.0f} RPM, {largest[1]:.2f}° of tilt and {largest[2]:.2f}° of elevator. At half the
step they shrink to {", ".join(f"{ratio:.2f}" for ratio in results.jump_ratios)} of that; they would shrink to 0.25 on
a smooth curve, to 0.5 at a kink and not at all at a jump.

**Hover.** {hover_tilt(results)}

**Elevator.** {elevator(results)}

**Cruise.** At 30 m/s the lift-to-drag ratio is {results.lift_to_drag:.1f} and the shafts take
{results.cruise.power:.0f} W.
"""


def _step(results: Results) -> str:
    return f"""
## Figs 11-12: elevator step at 30 m/s

{_figure("fig11_12_elevator_step.png")}

{step(results)}
"""


def _poles(results: Results) -> str:
    return f"""
## Table 1 and Fig. 13: poles at 30 m/s

{_figure("fig13_poles.png")}

{table_1(results)}

The error is against the printed eigenvalue. The paper's own frequency and damping are shown as printed.
"""


def _holds(results: Results) -> str:
    stability = {hold: speed_stability(results.linear[hold]) for hold in ("throttle", "rpm")}
    sets_power = results.aircraft.rotors.wing.motor.throttle == "power"
    throttle = "electrical power that the motor's controller regulates to" if sets_power else "voltage at the motor"
    beside = " Throttle differs from power held by motor losses and rotor inertia." if sets_power else ""
    return f"""
## What the propellers keep while the aircraft is disturbed

The phugoid's damping hangs on how thrust changes with airspeed, and that on what is held. The paper does not say. We
calibrate with **{CALIBRATED_HOLD} held**: it is what stick-fixed means to an electric aircraft. Throttle here is the
{throttle}. Rotor speeds are free, so they are states of the linear model, and the time the propellers take to follow
is included. The others are given for the same trim.

{hold_table(results)}

X_u is the change of forward acceleration with forward speed, drag and thrust together. With RPM held, thrust falls
steeply as the propeller advances, so X_u is {stability["rpm"]:.3f} 1/s against {stability["throttle"]:.3f} and the
phugoid is damped more.{beside}
"""


def _calibrated(results: Results) -> str:
    edge = at_their_limits(results.aircraft)
    limits = (
        f"{len(edge)} lie at an end of their range: {', '.join(f'`{path}`' for path in edge)}. There the targets "
        "pull against what we take for plausible."
        if edge
        else "None lies at an end of its range."
    )
    return f"""
## What was calibrated

`python -m vehicle_model.identify` searches these parameters, within ranges that an electric UAV of this kind can
have: many random starts, then bounded least squares from the best. All other numbers of the aircraft's file were
chosen beforehand. {limits}

{parameter_table(results.aircraft)}

**Lift slope.** The paper's 0.1 per degree (5.73 per radian) is a section's. Ours is that of strips of a finite wing;
the fit moves it on, to {results.aircraft.wing.lift_slope:.2f}.

**Propeller.** {propeller(results)}
"""


def _cannot_mean(results: Results) -> str:
    pole = TABLE_1["short_period"]
    damping = -pole.real / abs(pole)
    return f"""
## What the paper cannot have meant

- **Short-period damping {PRINTED_DAMPING["short_period"]}** (Table 1). The printed eigenvalue gives
  {-pole.real:.4f}/{abs(pole):.4f} = {damping:.4f}. An oscillation has a damping ratio below 1; a factor of ten was
  lost. "Well-damped" rests on the misprint: see flying qualities below.
- **Slipstream pressure from the induced velocity alone** (eq. 11). {eq_11(results)}
- **The root in eq. (7)** lacks a plus sign and a square: the terms under it have different dimensions. Eq. (5) has
  both, and is what we use.
- **"Rolling moment"** before eq. (14). The equations are those of the pitching moment; the rolling ones are not
  printed. Ours follow from (13) by cross products.
- **The u axis of Fig. 12**, 0 to 0.1 m/s, with a theta axis of ±1°: see Figs 11-12 above.
"""


def _moment(results: Results) -> str:
    return f"""
## Pitching moment from hover to forward flight

NASA TN D-1389 (1962) reports a large nose-up moment of tilt-wings as they leave hover. The paper's Fig. 10 needs
mostly negative elevator, which is against a nose-*down* moment.

{_figure("pitching_moment.png")}

{moment_table(results)}

{pitching_moment(results)}
"""


def _stall(results: Results) -> str:
    least = int(np.argmin(results.wetted_margin))
    power = np.array([trim.power for trim in results.trims])
    free = np.flatnonzero(results.unwetted_margin > 0.0)
    attached = f"from {free[0]} m/s on" if len(free) else "at no speed"
    return f"""
## Power and stall

{_figure("power_and_stall.png")}

Hover takes {power[0]:.0f} W at the shafts, {power[0] / power.min():.1f} times the least, at {int(np.argmin(power))}
m/s. The wing in the slipstream keeps {math.degrees(results.wetted_margin[least]):.1f}° to maximum lift where it is
closest, at {least} m/s. The wing outside is stalled in slow flight and has its flow attached {attached}.

{_figure("descent.png")}

{descents(results)}
"""


def _slipstream(results: Results) -> str:
    return f"""
## The slipstream to the letter

{_figure("slipstream.png")}

{literal_slipstream(results)}
"""


def _authority(results: Results) -> str:
    return f"""
## Control in hover

Static thrust at full throttle is {results.thrust_to_weight:.2f} times the weight. The table holds what is left about
each axis when trimmed in a wind of {WIND:g} m/s: the smaller of the moments to either side, over half of both
together. 100 % is a trim in the middle of its authority.

{authority_table(results)}
"""


def _qualities(results: Results) -> str:
    return f"""
## Flying qualities

Levels of MIL-F-8785C for a class I aircraft in its flight phase categories. The specification is for manned aircraft;
it is noted here because the paper calls its short period well-damped. Frequencies scale with size: for a small
aircraft read the damping.

{flying_qualities_table(results)}
"""
