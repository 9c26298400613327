"""Tables of the page, as Markdown: targets, Table 1, holds, flying qualities, moments, parameters, control in hover."""

import math
import tomllib
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from vehicle_model.aircraft import Aircraft
from vehicle_model.identify import RANGES
from vehicle_model.linearise import HOLDS, LinearModel, Mode
from vehicle_model.paper.flying_qualities import CATEGORIES, level
from vehicle_model.paper.loads_by_part import PARTS
from vehicle_model.paper.printed import (
    CALIBRATED_HOLD,
    PRINTED_DAMPING,
    PRINTED_FREQUENCY,
    Q_AXIS,
    TABLE_1,
    THETA_AXIS,
    U_AXIS,
    W_AXIS,
)
from vehicle_model.paper.results import Results
from vehicle_model.paper.targets import Target
from vehicle_model.units import UNITS

__all__ = [
    "at_their_limits",
    "authority_table",
    "flying_qualities_table",
    "hold_table",
    "markdown",
    "mode_text",
    "moment_table",
    "parameter_table",
    "speed_stability",
    "step_table",
    "table_1",
    "target_table",
]


def markdown(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table; the first column is left-aligned, the others right-aligned."""
    lines = [head, ["---", *["---:"] * (len(head) - 1)], *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def mode_text(mode: Mode | None) -> str:
    """An eigenvalue as the paper writes it."""
    if mode is None:
        return "none"
    return f"{mode.real:.4f} ± {mode.imag:.4f}i" if mode.imag else f"{mode.real:.4f}"


def target_table(found: Sequence[Target]) -> str:
    """What is asked, what was found, met or not."""
    return markdown(
        ("target", "asked", "found", "met"),
        [(target.name, target.asked, target.found, "yes" if target.met else "**no**") for target in found],
    )


def table_1(results: Results) -> str:
    """Table 1 of the paper beside ours, with errors."""
    rows: list[Sequence[str]] = []
    for name, pole in TABLE_1.items():
        mode = results.mode(name)
        printed = (
            ("real part (1/s)", "real", pole.real, f"{pole.real:.4f}"),
            ("imaginary part (rad/s)", "imag", pole.imag, f"{pole.imag:.4f}"),
            ("frequency (rad/s)", "omega", abs(pole), f"{PRINTED_FREQUENCY[name]:g}"),
            ("damping", "damping", -pole.real / abs(pole), f"{PRINTED_DAMPING[name]:g}"),
        )
        for label, field, wanted, shown in printed:
            ours = math.nan if mode is None else getattr(mode, field)
            rows.append(
                (
                    f"{name.replace('_', ' ')}, {label}",
                    shown,
                    f"{wanted:.4f}",
                    f"{ours:.4f}",
                    f"{round(100 * (ours / wanted - 1), 2) + 0.0:+.2f} %",
                )
            )
    return markdown(("", "printed", "from the printed eigenvalue", "ours", "error"), rows)


def step_table(results: Results) -> str:
    """Extremes of the response to the elevator step beside the axes of Fig. 12."""
    found = results.step_summary
    rows = (
        ("change of u (m/s)", found.u, 1.0, U_AXIS),
        ("change of w (m/s)", found.w, 1.0, W_AXIS),
        ("q (deg/s)", found.q, math.degrees(1.0), Q_AXIS),
        ("theta (deg)", found.theta, math.degrees(1.0), THETA_AXIS),
    )
    return markdown(
        ("", "ours, lowest", "ours, highest", "axis of Fig. 12"),
        [
            (name, *(f"{round(value * unit, 3) + 0.0:.3f}" for value in extremes), f"{axis[0]:g} to {axis[1]:g}")
            for name, extremes, unit, axis in rows
        ],
    )


def speed_stability(model: LinearModel) -> float:
    """X_u [1/s]: forward acceleration per forward speed, the rotors given time to settle where they are states."""
    longitudinal = model.longitudinal()
    a = longitudinal.a
    settled = a[:4, :4] - a[:4, 4:] @ np.linalg.solve(a[4:, 4:], a[4:, :4]) if len(a) > 4 else a
    return float(settled[0, 0])


def hold_table(results: Results) -> str:
    """Longitudinal poles for everything the propellers may keep."""
    rows: list[Sequence[str]] = []
    for hold in HOLDS:
        modes = {name: results.mode(name, hold) for name in TABLE_1}
        errors = [
            abs(getattr(mode, part) / getattr(TABLE_1[name], part) - 1.0)
            for name, mode in modes.items()
            for part in ("real", "imag")
            if mode is not None
        ]
        rows.append(
            (
                f"**{hold}**, calibrated" if hold == CALIBRATED_HOLD else hold,
                *(mode_text(mode) for mode in modes.values()),
                *(f"{mode.damping:.3f}" if mode else "" for mode in modes.values()),
                f"{speed_stability(results.linear[hold]):.4f}",
                f"{100 * max(errors):.1f} %" if len(errors) == 4 else "",
            )
        )
    return markdown(
        (
            "held",
            "short period",
            "phugoid",
            "damping, short period",
            "damping, phugoid",
            "X_u (1/s)",
            "worst of Table 1",
        ),
        rows,
    )


def flying_qualities_table(results: Results) -> str:
    """Levels of MIL-F-8785C, categories A, B and C, for the paper's poles and all our modes."""

    def row(label: str, mode: Mode) -> tuple[str, ...]:
        constant = f"{mode.damping:.3f}" if mode.imag else ""
        known = mode.name in {"short_period", "phugoid", "dutch_roll", "roll", "spiral"}
        levels = [str(level(mode, category)).replace("4", "beyond 3") if known else "" for category in CATEGORIES]
        return label, mode_text(mode), constant, *levels

    paper = [
        row(f"{name.replace('_', ' ')}, paper", Mode(name, pole.real, pole.imag)) for name, pole in TABLE_1.items()
    ]
    ours = [
        row(f"{mode.name.replace('_', ' ')}, ours", mode)
        for mode in results.modes[CALIBRATED_HOLD]
        if mode.name != "rotor"
    ]
    return markdown(
        ("mode", "eigenvalue (1/s)", "damping", *(f"level, {each}" for each in CATEGORIES)), [*paper, *ours]
    )


def moment_table(results: Results) -> str:
    """Pitching moment of each part: slope out of hover, and along the trims without elevator."""
    trims = results.trim_moments
    shown = [int(np.searchsorted(trims.airspeed, speed)) for speed in (0.0, 5.0, 10.0, 15.0, 20.0, 30.0)]
    rows = [
        (part, f"{slope:+.3f}", *(f"{values[i]:+.2f}" for i in shown))
        for part, slope, values in zip(PARTS, results.hover_slopes, trims.parts, strict=True)
    ]
    total = ("**sum**", f"**{results.hover_slopes.sum():+.3f}**", *(f"**{trims.total[i]:+.2f}**" for i in shown))
    head = (
        "part",
        "dM/dV at hover's controls (N m per m/s)",
        *(f"M at {trims.airspeed[i]:g} m/s (N m)" for i in shown),
    )
    return markdown(head, [*rows, total])


def authority_table(results: Results) -> str:
    """Control left in hover over the bearing of the wind."""
    return markdown(
        ("wind from (deg right of the nose)", "roll", "pitch", "yaw"),
        [
            (f"{math.degrees(bearing):.0f}", *(f"{100 * value:.0f} %" for value in (left.roll, left.pitch, left.yaw)))
            for bearing, left in results.margins
        ],
    )


def _share(aircraft: Aircraft, path: str) -> tuple[float, float]:
    """Value of a calibrated parameter (SI) and its place in its range, 0 at the lower end and 1 at the upper."""
    value: Any = aircraft
    for key in path.split("."):
        value = value["xyz".index(key)] if isinstance(value, tuple) else getattr(value, key)
    low, high = RANGES[path]
    return float(value), (float(value) - low) / (high - low)


def at_their_limits(aircraft: Aircraft, within: float = 0.02) -> list[str]:
    """Calibrated parameters that lie within a share of their range of one of its ends, or beyond."""
    shares = {path: _share(aircraft, path)[1] for path in RANGES}
    return [path for path, share in shares.items() if not within <= share <= 1.0 - within]


def parameter_table(aircraft: Aircraft) -> str:
    """The calibrated parameters in the units of the aircraft's file, with their ranges."""
    with aircraft.source_file.open("rb") as file:
        tables = tomllib.load(file)
    rows: list[Sequence[str]] = []
    for path, (low, high) in RANGES.items():
        entry: Any = tables
        for key in path.split("."):
            entry = entry if "unit" in entry else entry[key]
        unit = entry["unit"]
        factor = UNITS[unit].factor
        value, share = _share(aircraft, path)
        rows.append(
            (
                f"`{path}`",
                f"{value / factor:.4g}",
                "" if unit == "1" else unit,
                f"{low / factor:.4g} to {high / factor:.4g}",
                f"{100 * share:.0f} %",
            )
        )
    return markdown(("parameter", "value", "unit", "range searched", "share of range"), rows)
