"""Find numbers for the aircraft file with which the model flies as the paper's aircraft does.

The paper prints no parameters, only results: eigenvalues at 30 m/s (Table 1), the shape of the trim curves (Fig. 10)
and the axes of the step response (Fig. 12). This program searches, inside ranges an electric UAV of 5 to 15 kg can
have, for parameters that meet them together: many random starts, then bounded least squares from the best. What it
finds is calibrated to the paper, not validated by it: dozens of sets fit.

    python -m vehicle_model.identify --seed 1 --write vehicle_model/hong2013.toml
"""

import math
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from scipy.linalg import expm
from scipy.optimize import least_squares

from vehicle_model.aircraft import Aircraft, load_aircraft, write_values
from vehicle_model.earth import STANDARD_GRAVITY
from vehicle_model.linearise import Hold, LinearModel, linearise, participation
from vehicle_model.trim import LevelProblem, Trim, still_air

__all__ = ["RANGES", "TABLE_1", "Figures", "blade_lift", "figures_of", "identify", "misfit"]

TABLE_1 = {"short_period": complex(-2.6766, 10.7711), "phugoid": complex(-0.0626, 0.4481)}
AIRSPEEDS = np.arange(31.0)
CRUISE = 30.0
PULL = 0.03  # towards the middle of the ranges: picks the least extreme of the sets that fit

# What may be varied, and within which limits (SI). A blade's lift slope is an effective one, below 2 pi.
RANGES: dict[str, tuple[float, float]] = {
    "mass_properties.mass": (8.0, 14.0),
    "mass_properties.iyy": (0.75, 2.0),
    "wing.chord": (0.18, 0.32),
    "wing.pivot.x": (-0.10, 0.10),
    "wing.pivot.z": (-0.15, 0.05),
    "wing.quarter_chord_x": (-0.06, 0.06),
    "wing.quarter_chord_z": (-0.05, 0.05),
    "wing.lift_slope": (4.0, 5.8),
    "wing.stall_angle": (math.radians(17.0), math.radians(27.0)),
    "wing.stall_width": (math.radians(4.0), math.radians(10.0)),
    "wing.plate_lift": (0.7, 1.1),
    "wing.plate_drag": (1.2, 1.95),
    "wing.zero_lift_drag": (0.012, 0.05),
    "wing.induced_drag": (0.03, 0.09),
    "wing.wake_factor": (1.2, 2.0),
    "rotors.wing.hub.x": (0.10, 0.25),
    "rotors.wing.hub.z": (-0.05, 0.05),
    "rotors.wing.radius": (0.20, 0.32),
    "rotors.wing.twist": (0.35, 0.80),
    "rotors.wing.lift_slope": (3.5, 6.2),
    "rotors.wing.blade_chord": (0.012, 0.040),
    "tail.horizontal.area": (0.06, 0.16),
    "tail.horizontal.position.x": (-1.15, -0.75),
    "tail.horizontal.position.z": (-0.30, 0.05),
    "tail.horizontal.incidence": (math.radians(-4.0), math.radians(6.0)),
    "tail.horizontal.lift_slope": (3.2, 4.8),
    "tail.horizontal.elevator_effectiveness": (0.12, 0.6),
    "tail.horizontal.downwash_factor": (0.4, 1.4),
    "elevator.tail_gain": (1.0e6, 1.2e7),
    "fuselage.drag_area.x": (0.006, 0.03),
    "fuselage.drag_area.z": (0.08, 0.25),
}


@dataclass(frozen=True)
class Figures:
    """What the paper shows of its aircraft, for ours: trims at 0..30 m/s and the poles at 30 m/s."""

    rpm: np.ndarray  # (31,)
    tilt: np.ndarray  # (31,) [rad]
    elevator: np.ndarray  # (31,) [rad]
    unbalanced: np.ndarray  # (31,) trim residual as a fraction of the weight
    wetted_margin: np.ndarray  # (31,) angle to maximum lift of the wing in the slipstream [rad]
    unwetted_margin: np.ndarray  # (31,) and outside it [rad]
    max_lift_angle: float  # of the wing [rad]
    blade_lift: float  # mean lift coefficient of the wing rotors' blades in hover, 6 CT/solidity
    cruise: Trim
    model: LinearModel  # longitudinal, at 30 m/s
    short_period: complex
    phugoid: complex
    lift_to_drag: float
    theta_peak: float  # of the response to +1 deg of elevator within 50 s [rad]
    q_peak: float  # [rad/s]


def blade_lift(aircraft: Aircraft, hover: Trim) -> float:
    """Mean lift coefficient of the blades: thrust = solidity/6 CL times rho A (w r)^2."""
    rotor = aircraft.rotors.wing
    blade_area = rotor.blades * rotor.blade_chord * rotor.radius
    dynamic = 0.5 * float(hover.outputs["density"]) * (hover.rotor_speed * rotor.radius) ** 2
    return 3.0 * float(hover.outputs["thrust"][0]) / (dynamic * blade_area)


def _oscillations(model: LinearModel) -> tuple[complex, complex]:
    """Fastest and slowest oscillation that path and attitude take part in; no imaginary part if it has split."""
    values, share = participation(model.a)
    share = share[:4].sum(axis=0)
    flight = values[np.argsort(-share, kind="stable")[:4]]
    flight = flight[np.argsort(-np.abs(flight), kind="stable")]
    fast, slow = flight[:2], flight[2:]
    return _pair(fast), _pair(slow)


def _pair(values: np.ndarray) -> complex:
    """The upper one of a complex pair, or the middle of two real values."""
    return complex(float(np.real(values).mean()), float(np.abs(np.imag(values)).mean()))


def _step_peaks(model: LinearModel) -> tuple[float, float]:
    """Largest |theta| [rad] and |q| [rad/s] within 49 s of a +1 deg elevator step, linear."""
    n = model.a.shape[0]
    dt = 0.05
    block = np.zeros((n + 1, n + 1))
    block[:n, :n], block[:n, n] = model.a, model.b * math.radians(1.0)
    turn = expm(block * dt)
    x = np.zeros(n + 1)
    x[n] = 1.0
    peaks = np.zeros(n + 1)
    for _ in range(round(49.0 / dt)):
        x = turn @ x
        peaks = np.maximum(peaks, np.abs(x))
    return float(peaks[3]), float(peaks[2])


def figures_of(aircraft: Aircraft, hold: Hold = "throttle") -> Figures:
    """Trim curves, poles and step peaks of an aircraft; where no trim exists the nearest point is given."""
    world = still_air()
    rows = []
    x = np.array([480.0, 0.15, 0.0])
    trims: list[Trim] = []
    surfaces = aircraft.vehicle["surfaces"][0][: aircraft.vehicle["surface_count"][0]]
    wetted, unwetted = aircraft.wing_strips
    for airspeed in AIRSPEEDS[::-1]:
        problem = LevelProblem(aircraft, float(airspeed), world)
        scaled, unbalanced = problem.newton(x / problem.scale)
        x = scaled * problem.scale
        margin = problem.observe(scaled)["stall_margin"][: len(surfaces)]
        least = (margin[strips].min(initial=math.pi) for strips in (wetted, unwetted))
        rows.append((*x, unbalanced, *least))
        if airspeed in {CRUISE, 0.0}:
            trims.append(problem.finish(scaled))
    speed, tilt, elevator, unbalanced, wetted_margin, unwetted_margin = np.array(rows[::-1]).T
    cruise = trims[0]
    model = linearise(aircraft, cruise, hold, world).longitudinal()
    short_period, phugoid = _oscillations(model)
    theta_peak, q_peak = _step_peaks(model)
    thrust = cruise.outputs["rotor_force_body"][:, 0].sum()
    return Figures(
        speed * 30.0 / math.pi, tilt, elevator, unbalanced, wetted_margin, unwetted_margin,
        float(surfaces["max_lift_angle"][0]), blade_lift(aircraft, trims[-1]), cruise, model, short_period, phugoid,
        float(aircraft.vehicle["mass"][0] * STANDARD_GRAVITY / thrust), theta_peak, q_peak,
    )  # fmt: skip


def _beyond(values: np.ndarray | float, low: float, high: float) -> np.ndarray:
    """How far values lie outside low..high."""
    return np.maximum(np.atleast_1d(low - values), 0.0) + np.maximum(np.atleast_1d(values - high), 0.0)


def misfit(found: Figures) -> np.ndarray:
    """Weighted distances from the paper, zero where it is met; large ones are compressed lest they drown the rest."""
    poles = []
    for ours, paper in ((found.short_period, TABLE_1["short_period"]), (found.phugoid, TABLE_1["phugoid"])):
        poles += [(ours.real / paper.real - 1.0) / 0.01, (ours.imag / paper.imag - 1.0) / 0.01]
    tilt, elevator = np.degrees(found.tilt), np.degrees(found.elevator)
    parts = [
        np.array(poles),
        np.array([(found.rpm[0] - 6000.0) / 30.0]),
        _beyond(found.rpm[30], 4250.0, 4900.0) / 20.0,
        _beyond(found.rpm, 3200.0, 6300.0) / 50.0,
        _beyond(np.diff(found.rpm, 2), -150.0, 150.0) / 30.0,
        _beyond(tilt[0], 80.0, 88.0) / 0.5,
        _beyond(tilt[30], 4.0, 13.0) / 0.3,
        _beyond(np.diff(tilt), -6.5, -0.25) / 0.2,
        _beyond(np.diff(tilt, 2), -1.0, 1.0) / 0.2,
        _beyond(elevator, -8.5, 1.0) / 0.3,
        _beyond(np.diff(elevator, 2), -0.8, 0.8) / 0.2,
        np.minimum(found.unbalanced * 200.0, 20.0),
        # Not the paper's but ours: blades as real propellers have them; a wing that does stall, yet not in level flight
        # at any speed where the slipstream wets it, nor in a gust in cruise.
        _beyond(found.blade_lift, 0.3, 1.1) / 0.03,
        _beyond(math.degrees(found.max_lift_angle), 15.0, 24.0) / 0.5,
        _beyond(np.degrees(found.wetted_margin), 3.0, 90.0) / 0.5,
        _beyond(np.degrees(found.unwetted_margin[20:]), 8.0, 90.0) / 0.5,
        _beyond(found.lift_to_drag, 5.0, 10.0) / 0.2,
        _beyond(math.degrees(found.theta_peak), 0.0, 0.9) / 0.05,
        _beyond(math.degrees(found.q_peak), 0.0, 3.5) / 0.1,
    ]
    return np.arcsinh(np.concatenate(parts))


def _candidate(base: Aircraft, fractions: np.ndarray) -> Aircraft:
    low, high = np.array(list(RANGES.values())).T
    return base.with_values(dict(zip(RANGES, (low + fractions * (high - low)).tolist(), strict=True)))


def _distance(base: Aircraft, fractions: np.ndarray, hold: Hold) -> np.ndarray:
    """Misfit and the pull to the middle of the ranges."""
    error = misfit(figures_of(_candidate(base, fractions), hold))
    return np.concatenate([np.nan_to_num(error, nan=10.0), PULL * (fractions - 0.5)])


def identify(
    base: Aircraft, hold: Hold, starts: int, polished: int, seed: int
) -> tuple[Aircraft, dict[str, float], float]:
    """Rank `starts` random points, polish the best of them; returns the best aircraft, its values and its cost."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(0.05, 0.95, (starts, len(RANGES)))
    ranked = sorted(points, key=lambda point: float(np.sum(_distance(base, point, hold) ** 2)))
    best, best_cost = ranked[0], math.inf
    for point in ranked[:polished]:
        found = least_squares(
            lambda x: _distance(base, x, hold), point, bounds=(0.0, 1.0), diff_step=1e-5, max_nfev=80, x_scale=1.0
        )
        if found.cost < best_cost:
            best, best_cost = found.x, float(found.cost)
            shown = figures_of(_candidate(base, best), hold)
            print(f"cost {best_cost:.4g}: {shown.short_period:.4f} {shown.phugoid:.4f} rpm {shown.rpm[0]:.0f} -> "
                  f"{shown.rpm[30]:.0f}, L/D {shown.lift_to_drag:.1f}", flush=True)  # fmt: skip
    low, high = np.array(list(RANGES.values())).T
    values = dict(zip(RANGES, (low + best * (high - low)).tolist(), strict=True))
    return base.with_values(values), values, best_cost


def main(
    starts: Annotated[int, typer.Option(help="Random points to rank.")] = 400,
    polished: Annotated[int, typer.Option(help="How many of the best to polish by least squares.")] = 12,
    seed: Annotated[int, typer.Option()] = 1,
    aircraft: Annotated[Path | None, typer.Option(help="Where the fixed numbers come from.")] = None,
    write: Annotated[Path | None, typer.Option(help="Aircraft file to put the found values into.")] = None,
) -> None:
    """Identify the aircraft's unpublished parameters from the paper's results."""
    if write is not None and not write.is_file():
        sys.exit(f"error: --write {write}: expected an aircraft file that is there")
    found, values, cost = identify(load_aircraft(aircraft), "throttle", starts, polished, seed)
    shown = figures_of(found)
    for path, value in values.items():
        low, high = RANGES[path]
        print(f"{path:42s} {value:12.5g}   {100 * (value - low) / (high - low):5.1f} % of {low:g} .. {high:g}")
    print(f"cost {cost:.4g}, short period {shown.short_period:.4f}, phugoid {shown.phugoid:.4f}")
    if write is not None:
        write_values(write, values, "calibrated to the paper")


if __name__ == "__main__":
    typer.run(main)
