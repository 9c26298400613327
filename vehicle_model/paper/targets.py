"""What our aircraft has to meet, each with the value found: the paper's results, and what a flyable machine needs."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from vehicle_model.paper.printed import Q_AXIS, TABLE_1, THETA_AXIS
from vehicle_model.paper.results import WIND, Results

__all__ = ["POLE_TOLERANCE", "Target", "targets"]

POLE_TOLERANCE = 0.02  # of each real and imaginary part of Table 1
PHUGOID_PERIOD = 2.0 * math.pi / TABLE_1["phugoid"].imag  # [s]


@dataclass(frozen=True)
class Target:
    """One thing asked for, what was found, and whether that meets it."""

    name: str
    asked: str
    found: str
    met: bool


def targets(results: Results) -> list[Target]:
    """All targets with the values of one aircraft."""
    return [*_poles(results), *_trims(results), *_step(results), *_authority(results)]


def _poles(results: Results) -> Iterator[Target]:
    for name, printed in TABLE_1.items():
        mode = results.mode(name)
        for part, wanted in (("real", printed.real), ("imag", printed.imag)):
            found = math.nan if mode is None else getattr(mode, part)
            error = found / wanted - 1.0
            yield Target(
                f"{name.replace('_', ' ')}, {'real' if part == 'real' else 'imaginary'} part",
                f"{wanted:.4f} ± {100 * POLE_TOLERANCE:.0f} %",
                f"{found:.4f} ({round(100 * error, 2) + 0.0:+.2f} %)",
                abs(error) <= POLE_TOLERANCE,
            )


def _trims(results: Results) -> Iterator[Target]:
    rpm, tilt, elevator = results.curves
    residual = max(trim.residual for trim in results.trims)
    yield Target(
        "trim residual, 0 to 30 m/s", "below 1e-9 of the weight", f"below {_power_of_ten(residual)}", residual < 1e-9
    )
    yield Target("RPM in hover", "6000 ± 2 %", f"{rpm[0]:.0f}", bool(abs(rpm[0] / 6000.0 - 1.0) <= 0.02))
    yield Target("RPM at 30 m/s", "4000 to 5000", f"{rpm[-1]:.0f}", bool(4000.0 <= rpm[-1] <= 5000.0))
    yield Target("tilt in hover", "78° to 90°", f"{tilt[0]:.1f}°", bool(78.0 <= tilt[0] <= 90.0))
    yield Target("tilt at 30 m/s", "below 15°", f"{tilt[-1]:.1f}°", bool(tilt[-1] < 15.0))
    steps = np.diff(tilt)
    yield Target(
        "tilt over airspeed",
        "falls all the way",
        f"{steps.max():+.2f}° to {steps.min():+.2f}° per m/s",
        bool(np.all(steps < 0.0)),
    )
    largest = float(np.abs(elevator).max())
    yield Target(
        "equivalent elevator", "within 10°", f"{elevator.min():.1f}° to {elevator.max():.1f}°", largest <= 10.0
    )
    yield Target(
        "jumps: largest second difference of RPM, tilt, elevator at half the airspeed step, over that at the whole",
        "below 0.75 each (smooth 0.25, kink 0.5, jump 1)",
        ", ".join(f"{ratio:.2f}" for ratio in results.jump_ratios),
        bool(np.all(results.jump_ratios < 0.75)),
    )


def _step(results: Results) -> Iterator[Target]:
    summary = results.step_summary
    period = summary.phugoid.period
    yield Target(
        "phugoid period in the flight after the step",
        f"{PHUGOID_PERIOD:.1f} s ± 2 %",
        f"{period:.2f} s",
        abs(period / PHUGOID_PERIOD - 1.0) <= 0.02,
    )
    for name, unit, (low, high), axis in (
        ("q", "°/s", np.degrees(summary.q), Q_AXIS),
        ("theta", "°", np.degrees(summary.theta), THETA_AXIS),
    ):
        yield Target(
            f"{name} after the step, inside the axis of Fig. 12",
            f"{axis[0]:g} to {axis[1]:g}{unit}",
            f"{low:.2f} to {high:.2f}{unit}",
            bool(axis[0] <= low and high <= axis[1]),
        )


def _authority(results: Results) -> Iterator[Target]:
    ratio = results.thrust_to_weight
    yield Target("thrust to weight in hover", "at least 1.5", f"{ratio:.2f}", ratio >= 1.5)
    for axis in ("roll", "pitch", "yaw"):
        bearing, margin = min(((b, getattr(left, axis)) for b, left in results.margins), key=lambda row: row[1])
        yield Target(
            f"{axis} control left hovering in {WIND:g} m/s wind",
            "at least 30 %",
            f"{100 * margin:.0f} % (wind from {math.degrees(bearing):.0f}°)",
            margin >= 0.3,
        )


def _power_of_ten(value: float) -> str:
    """The next power of ten above a value: its digits are rounding errors and differ between machines."""
    return f"1e{math.floor(math.log10(max(value, 1e-13))) + 1}"
