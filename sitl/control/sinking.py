"""How fast the corridor bears to sink, steadily: by the force map that the laws fly by, and by trims without it.

Sinking along a straight path, the fuselage along it, gravity pulls forward by g sin(angle) and the wing has to hold
back: at most as the wing in the slipstream does before it comes nearer to its stall than the margin that is kept. The
certificate tries tilts and flaps one by one with the rotor speed that carries the weight; `trim_steady` balances all
six axes, with the flaps at rest.
"""

import math
from collections.abc import Sequence

import numpy as np
from scipy.optimize import brentq

from sitl.control.design import Design
from sitl.control.design_names import LOWEST_FORCE
from sitl.control.lookup import schedule_lookup
from sitl.control.shape import STALL_TOLERANCE
from vehicle_model.aircraft import Aircraft
from vehicle_model.earth import STANDARD_GRAVITY
from vehicle_model.force_map import FLAP_SHARE, STALL_MARGIN, point_loads, stall_speed
from vehicle_model.records import OUTPUTS
from vehicle_model.state import CONTROL_COUNT, STATE_COUNT
from vehicle_model.steady_flight import trim_steady
from vehicle_model.trim import TrimError

__all__ = ["certified_sink", "planned_sink", "sink_rates", "sinking_words", "trimmed_sink"]

FROM, TO, STEP = 0.45, 1.05, 0.04  # airspeeds where the stall sets the limit, over the stall speed
KEPT = STALL_MARGIN - STALL_TOLERANCE  # margin to the stall, as the design counts it [rad]
TILT_STEP = math.radians(0.25)
FLAP_COUNT = 5
STEEPEST = 0.5  # sink over airspeed that is looked at
HALVINGS = 9


def planned_sink(design: Design, airspeeds: np.ndarray) -> np.ndarray:
    """Sink rate [m/s] that the laws allow themselves at each airspeed [m/s], braking aside."""
    row, sinks = np.empty(design.schedule.shape[1]), np.empty(airspeeds.size)
    for i, airspeed in enumerate(airspeeds):
        schedule_lookup(design.schedule, design.axes, airspeed, row)
        sinks[i] = -row[LOWEST_FORCE] * airspeed / STANDARD_GRAVITY
    return sinks


def certified_sink(aircraft: Aircraft, airspeeds: np.ndarray, *, flaps: bool) -> np.ndarray:
    """Fastest steady sink [m/s] at each airspeed [m/s] over all tilts and, if wanted, flaps, with the margin kept.

    From level flight the wing is tilted up until the margin is spent, each time with the rotor speed that carries the
    weight. Not a number where level flight itself does not keep the margin. The tail balances as in the force map.
    """
    craft = aircraft.vehicle[0]
    out, state, controls = np.zeros(1, OUTPUTS)[0], np.empty(STATE_COUNT), np.zeros(CONTROL_COUNT)
    mass, tail_arm = float(craft["mass"]), -float(craft["rotors"]["position"][2, 0])
    tilts = np.arange(float(craft["servos"]["minimum"][0]), math.radians(90.0), TILT_STEP)
    droop = np.linspace(0.0, FLAP_SHARE * float(craft["servos"]["maximum"][1]), FLAP_COUNT) if flaps else np.zeros(1)
    fastest = float(craft["rotors"]["battery_voltage"][0] / craft["rotors"]["torque_constant"][0])

    def hold(airspeed: float, tilt: float, flap: float) -> tuple[float, float]:
        """Force backward per weight, and stall margin [rad], with the weight carried."""

        def lift(speed: float) -> float:
            x = np.array([tilt, speed, flap])
            _, fz, my, _ = point_loads(craft, airspeed, 0.0, x, state, controls, out)
            return (my / tail_arm - fz) / mass - STANDARD_GRAVITY

        slowest = 0.05 * fastest
        if lift(slowest) > 0.0 or lift(fastest) < 0.0:
            return math.nan, math.nan
        speed, _ = brentq(lift, slowest, fastest, xtol=1e-3, full_output=True)
        x = np.array([tilt, speed, flap])
        fx, _, _, margin = point_loads(craft, airspeed, 0.0, x, state, controls, out)
        return -fx / mass / STANDARD_GRAVITY, margin

    def most(airspeed: float, flap: float) -> float:
        held = math.nan
        for tilt in tilts:
            share, margin = hold(airspeed, tilt, flap)
            if share < 0.0 or math.isnan(share):  # still accelerates
                continue
            if margin < KEPT:
                break
            held = float(np.fmax(held, share))
        return held * airspeed

    return np.array([np.fmax.reduce([most(airspeed, flap) for flap in droop]) for airspeed in airspeeds])


def trimmed_sink(aircraft: Aircraft, airspeeds: np.ndarray) -> np.ndarray:
    """The same with the flaps at rest, of trims in all six axes (`trim_steady`): by halving the angle of the path."""
    surfaces = aircraft.vehicle[0]["surfaces"]
    wetted = (surfaces["tilts"] == 1) & (surfaces["rotor"] >= 0)

    def kept(airspeed: float, share: float) -> bool:
        angle = -math.asin(share)
        try:
            trim = trim_steady(aircraft, airspeed, climb_angle=angle, pitch=angle)
        except TrimError:
            return False
        return float(trim.outputs["stall_margin"][wetted].min()) >= KEPT

    sinks: list[float] = []
    for airspeed in airspeeds:
        low, high = 0.0, STEEPEST
        if not kept(airspeed, low):
            sinks.append(math.nan)
            continue
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if kept(airspeed, middle) else (low, middle)
        sinks.append(low * airspeed)
    return np.array(sinks)


def sink_rates(aircraft: Aircraft, design: Design) -> tuple[np.ndarray, tuple[tuple[str, np.ndarray], ...]]:
    """Airspeeds [m/s], and steady sink rates [m/s] at them, each row with the name of how they were found."""
    speeds = np.arange(FROM, TO, STEP) * stall_speed(aircraft)
    return speeds, (
        ("laws, by the force map", planned_sink(design, speeds)),
        ("tilt and flaps searched", certified_sink(aircraft, speeds, flaps=True)),
        ("tilt searched, flaps at rest", certified_sink(aircraft, speeds, flaps=False)),
        ("trim in six axes, flaps at rest", trimmed_sink(aircraft, speeds)),
    )


def sinking_words(speeds: np.ndarray, rates: Sequence[tuple[str, np.ndarray]]) -> str:
    """Where the corridor bears least sinking, as one sentence."""
    least = [f"{np.nanmin(row):.1f} m/s ({name}, at {speeds[np.nanargmin(row)]:.1f} m/s)" for name, row in rates]
    return f"The wing bears this much steady sinking without coming nearer to its stall, at least: {', '.join(least)}."
