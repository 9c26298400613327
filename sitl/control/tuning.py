"""Gains tuned to margins: measures every loop over an aircraft's corridor and reshapes them where they fall short.

The goal is 6 dB and 45 deg in each loop, opened at each actuator and at each signal that the laws read with the others
closed, on the code that flies (`sitl.control.corridor`). The paper's shape is tried first, and kept where it does.
Otherwise scipy's least squares changes a few of its ratios: the residuals are what the loops lack, and a light pull
towards the ratios that were.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import OptimizeResult, least_squares

from sitl.control.corridor import SETTLED, CorridorFlight, PointAnalysis, analyse_point, corridor
from sitl.control.design import Design, design_with
from sitl.control.margins import GAIN_GOAL, PHASE_GOAL, Margins
from sitl.control.shape import DEFAULT_SHAPE, Shape
from vehicle_model.aircraft import Aircraft

__all__ = ["TUNED", "missed", "tuned"]

GAIN_AIM, PHASE_AIM = GAIN_GOAL + 0.3, PHASE_GOAL + math.radians(1.0)  # some reserve, where gains are changed at all
WATCHED_GAIN, WATCHED_PHASE = GAIN_GOAL + 1.5, PHASE_GOAL + math.radians(7.0)  # a point this tight is watched
WATCHED = 24  # points at most
# What may change of the shape, from where to where.
TUNED = {
    "rate": (0.25, 0.55),
    "attitude": (0.2, 0.42),
    "rate_integral": (0.03, 0.2),
    "forward": (0.15, 0.34),
    "wing_borne_rate": (0.7, 1.6),
    "wing_borne_roll": (0.8, 2.0),
    "wing_borne_attitude": (0.12, 0.45),
    "wing_borne_lateral": (0.15, 0.6),
    "wing_borne_integral": (0.1, 0.5),
    "wing_borne_vertical": (0.1, 0.32),
    "heave_growth": (0.0, 1.0),
    "attitude_growth": (-0.3, 1.0),
    "rate_integral_growth": (-0.3, 3.0),
    "upwash_filter": (0.25, 1.25),
}
CLOSER = 4  # in the transition a loop's margins come and go within a few m/s
WIDTH = 0.02  # over which a shortfall is rounded off, so that the search sees a loop's limit before it is there
PULL = 0.04  # of a ratio towards its default, over its range
STEP = 0.01  # of the differences
ROUNDS = 4
EVALUATIONS = 6  # of a round, each with its slopes
UNSTABLE = 1.0  # that each loop of a point lacks that is not stable


def lack(margins: Margins, gain: float, phase: float) -> float:
    """How far a loop falls short of a gain [dB] and a phase margin [rad], as a share; 0 where it does not."""
    return max(0.0, 1.0 - margins.gain_db / gain) + max(0.0, 1.0 - margins.phase / phase)


def counts(point: PointAnalysis) -> bool:
    """Whether a point has to have margins: it is held, or would be if it did not swing.

    Sinking and climbing at an airspeed may be beyond what the wing or the motors bear; there the laws settle elsewhere.
    """
    return point.held or (point.climb >= 0.0 and not point.stable)


def missed(points: Sequence[PointAnalysis], gain: float = GAIN_GOAL, phase: float = PHASE_GOAL) -> tuple[str, ...]:
    """The loops that fall short of a gain [dB] and a phase margin [rad], in words, worst first."""
    found: list[tuple[float, str]] = []
    for point in points:
        if not counts(point):
            continue
        place = f"{point.airspeed:g} m/s" + (f" {point.climb:+g}" if point.climb else "")
        if not point.stable:
            found.append((math.inf, f"unstable at {place}"))
            continue
        for name, margins in point.margins.items():
            short = lack(margins, gain, phase)
            if short > 0.0:
                degrees = "" if math.isinf(margins.phase) else f", {math.degrees(margins.phase):.0f} deg"
                found.append((short, f"{name} at {place}: {margins.gain_db:.1f} dB{degrees}"))
    return tuple(text for _, text in sorted(found, key=lambda each: -each[0]))


def shortfalls(point: PointAnalysis, loops: Sequence[str]) -> np.ndarray:
    """What the loops lack of the margins aimed at, as shares: gain and phase of each; negative where they have more."""
    if not point.stable:
        return np.full(2 * len(loops), UNSTABLE + min(point.loop.growth, 1.0))
    found = [point.margins.get(name) for name in loops]
    return np.array(
        [-1.0 if each is None else 1.0 - min(each.gain_db / GAIN_AIM, 2.0) for each in found]
        + [-1.0 if each is None else 1.0 - min(each.phase / PHASE_AIM, 2.0) for each in found]
    )


@dataclass(frozen=True)
class Survey:
    """A design at all points of the corridor: where it settled, and its loops there."""

    design: Design
    flights: list[CorridorFlight]
    points: list[PointAnalysis]

    def cost(self, needed: Sequence[bool]) -> float:
        """Sum of the squares of what the loops lack; a point that is needed and not held lacks all of it."""
        total = 0.0
        for point, need in zip(self.points, needed, strict=True):
            if counts(point):
                total += float((np.maximum(shortfalls(point, tuple(point.margins)), 0.0) ** 2).sum())
            elif need:
                total += len(point.margins)
        return total

    def tight(self) -> list[int]:
        """Points that fall short of some more than the goal, those that do by most: enough to find a shape by."""
        lacking = {
            i: sum(lack(each, WATCHED_GAIN, WATCHED_PHASE) for each in point.margins.values()) + (not point.stable)
            for i, point in enumerate(self.points)
            if counts(point)
        }
        worst = sorted((i for i, short in lacking.items() if short > 0.0), key=lambda i: -lacking[i])
        return sorted(worst[:WATCHED])


def survey(aircraft: Aircraft, design: Design, points: Sequence[tuple[float, float]]) -> Survey:
    """Fly a design at some points: airspeed and climb rate [m/s]."""
    flights = [CorridorFlight(aircraft, design, airspeed, climb) for airspeed, climb in points]
    return Survey(design, flights, [flight.analyse() for flight in flights])


def tuned(
    aircraft: Aircraft, table: np.ndarray, axes: np.ndarray, report: Callable[[str], None] | None = None,
    points: Sequence[tuple[float, float]] | None = None,
) -> Design:  # fmt: skip
    """The design of an aircraft with its force map (axes (4, 3)) whose loops have the margins, or come nearest to it.

    The same aircraft gets the same bits. `report` is given lines for a person who waits. `points` are airspeeds and
    climb rates [m/s], by default the corridor's.
    """
    say = report or (lambda _: None)
    points = points or corridor(aircraft, CLOSER)
    say("gains: measuring the margins over the corridor")
    best = survey(aircraft, design_with(aircraft, table, axes, DEFAULT_SHAPE), points)
    needed = [counts(point) for point in best.points]
    for _ in range(ROUNDS):
        short = missed(best.points)
        if not short:
            break
        say(f"gains: {len(short)} loops short, {short[0]}; reshaping")
        found = survey(aircraft, design_with(aircraft, table, axes, reshaped(aircraft, best)), points)
        if found.cost(needed) >= best.cost(needed):
            break
        best = found
    short = missed(best.points)
    say(f"gains: {len(short)} loops short, {short[0]}" if short else "gains: all loops have their margins")
    return replace(best.design, missed=short)


def reshaped(aircraft: Aircraft, start: Survey) -> Shape:
    """The shape found from a survey on, by least squares over its tight points."""
    watched = [(start.flights[i], start.points[i]) for i in start.tight()]
    low, high = np.array(list(TUNED.values())).T

    def place(shape: Shape) -> np.ndarray:
        """A shape's ratios, 1 to 2 over their ranges: away from zero, for differences are taken in shares of them."""
        return 1.0 + (np.array([getattr(shape, name) for name in TUNED]) - low) / (high - low)

    def shape_at(x: np.ndarray) -> Shape:
        return replace(start.design.shape, **dict(zip(TUNED, (low + (x - 1.0) * (high - low)).tolist(), strict=True)))

    default = place(DEFAULT_SHAPE)

    def residuals(x: np.ndarray) -> np.ndarray:
        trial = design_with(aircraft, start.design.table, start.design.axes, shape_at(x))
        lacks: list[np.ndarray] = []
        for flight, before in watched:
            if before.unsettled < SETTLED:
                point = flight.reopened(before, trial)
            else:
                point = analyse_point(aircraft, trial, before.airspeed, before.climb)
            lacks.append(shortfalls(point, tuple(before.margins)))
        return np.append(WIDTH * np.logaddexp(0.0, np.concatenate(lacks) / WIDTH), PULL * (x - default))

    def stop_where_nothing_lacks(intermediate_result: OptimizeResult) -> None:
        if intermediate_result.fun[: -len(TUNED)].max() <= WIDTH * math.log(2.0):
            raise StopIteration

    found = least_squares(
        residuals, place(start.design.shape), bounds=(1.0, 2.0), diff_step=STEP, ftol=1e-3, xtol=1e-3,
        max_nfev=EVALUATIONS, callback=stop_where_nothing_lacks,
    )  # fmt: skip
    return shape_at(found.x)
