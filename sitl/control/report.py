"""The control report: how far every loop is from instability over the whole transition, as a page with figures.

Every number in it is measured on the compiled laws and equations that fly (`sitl.control.corridor`).
"""

import math
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np

from sitl.control.corridor import CLIMBS, DELAY, RATE, PointAnalysis, airspeeds, analyse
from sitl.control.design import Design, design_for
from sitl.control.design_names import COLUMNS as SCHEDULE_COLUMNS
from sitl.control.figures import (
    Loop,
    MarginTable,
    effectiveness,
    gains,
    margin_maps,
    nichols,
    sinking,
    trim_map,
)
from sitl.control.lookup import schedule_lookup
from sitl.control.margins import GAIN_GOAL, PHASE_GOAL, frequency_grid
from sitl.control.sinking import sink_rates, sinking_words
from sitl.control.stuck_wing import StuckWing, stuck_wing_section, stuck_wings
from vehicle_model.aircraft import Aircraft
from vehicle_model.paper.style import paper_style, save

__all__ = ["margin_table", "page", "write_report"]

TIGHTEST = 8  # loops in the Nichols chart
CAPTIONS = {
    "margins.png": "Least margins of each loop at each airspeed, over the climb rates. Bold, orange: below the goal; "
    "empty: as good as infinite.",
    "nichols.png": "The tightest loops, each at its worst point. Grey: what 6 dB and 45° keep free.",
    "effectiveness.png": "Who makes roll and yaw. Above: what rotors apart and ailerons apart do in level flight. "
    "Below: rotors that roll in hover yaw in cruise, and ailerons the other way round.",
    "trim_map.png": "The aircraft's force map with the fuselage level: steady flight is the white line. Blank where "
    "the force cannot be had with the stall margin that is kept.",
    "sinking.png": "Steady sink rates that the wing in the slipstream bears with its stall margin kept: as the laws "
    "allow themselves, and by searches that know nothing of the force map. Grey: what the points below ask for.",
    "gains.png": "The schedule of gains.",
}


def write_report(
    aircraft: Aircraft,
    out: Path,
    watch: Callable[[list[tuple[float, float]]], Iterable[tuple[float, float]]] = iter,
    watch_stuck: Callable[[list[float]], Iterable[float]] = iter,
) -> list[Path]:
    """Analyse the design of an aircraft and write README.md with its figures into a folder; returns what was written.

    `watch` passes the points of the corridor on, `watch_stuck` the angles [rad] of a stuck wing; both may show
    progress. Raises OSError where nothing can be written.
    """
    out.mkdir(parents=True, exist_ok=True)
    design = design_for(aircraft)
    points = analyse(aircraft, design, watch)
    speeds, sinks = sink_rates(aircraft, design)
    stuck = stuck_wings(aircraft, watch_stuck)
    with paper_style():
        figures = {
            "margins.png": margin_maps(margin_table(points)),
            "nichols.png": nichols(_tightest_loops(points)),
            "effectiveness.png": effectiveness(
                aircraft, design.table, design.axes, float(design.gains["top_speed"][0])
            ),
            "trim_map.png": trim_map(design.table, design.axes),
            "sinking.png": sinking(speeds, sinks, -CLIMBS[0]),
            "gains.png": gains(airspeeds(aircraft), _schedule(design, airspeeds(aircraft))),
        }
        written = [save(figure, out / name) for name, figure in figures.items()]
    file = out / "README.md"
    notes = (design.summary, sinking_words(speeds, sinks))
    file.write_text(page(aircraft.source_file.name, points, stuck, notes), encoding="utf-8")
    return [file, *written]


def margin_table(points: Sequence[PointAnalysis]) -> MarginTable:
    """Least margins over the climb rates that are held; none where unstable, not a number where a loop is not used."""
    points = [point for point in points if point.held]
    names = dict.fromkeys(name for point in points for name in point.margins)
    loops = tuple(name for name in points[0].loop.signals if name in names)
    loops += tuple(name for name in names if name not in loops)
    speeds = tuple(dict.fromkeys(point.airspeed for point in points))
    table = np.full((3, len(loops), len(speeds)), math.nan)
    for point in points:
        for name, margins in point.margins.items():
            values = (margins.gain_db, margins.phase, margins.disk) if point.stable else (0.0, 0.0, 0.0)
            cell = table[:, loops.index(name), speeds.index(point.airspeed)]
            cell[:] = np.fmin(cell, values)
    return MarginTable(loops, speeds, *table)


def page(
    source: str, points: Sequence[PointAnalysis], stuck: Sequence[StuckWing] = (), notes: Sequence[str] = ()
) -> str:
    """The page as Markdown, its figures beside it; `notes` are paragraphs that follow the summary."""
    table = margin_table(points)
    held = [point for point in points if point.held]
    measured = [(point, margins) for point in held for margins in point.margins.values()]
    met = sum(
        point.stable and margins.gain_db >= GAIN_GOAL and margins.phase >= PHASE_GOAL for point, margins in measured
    )
    summary = (
        f"{len(points)} points, {points[0].airspeed:g} to {points[-1].airspeed:g} m/s and {CLIMBS[0]:+g} to "
        f"{CLIMBS[-1]:+g} m/s of climb in still air; the loop opened at every actuator command and at every signal "
        "that the laws read, the "
        f"others closed. **{met} of {len(measured)}** loops have {GAIN_GOAL:g} dB and {math.degrees(PHASE_GOAL):g}°."
    )
    unstable = [_place(point) for point in held if not point.stable]
    if unstable:
        summary += f" **Unstable: {'; '.join(unstable)}.**"
    lost = [
        f"{_place(point)} (flown: {point.flown[0]:.1f} m/s, {point.flown[1]:+.1f} m/s, "
        + (f"least {min(each.gain_db for each in point.margins.values()):.1f} dB)" if point.stable else "unstable)")
        for point in points
        if not point.held
    ]
    if lost:
        summary += (
            " Asked for but not held, because the force for it would stall the wing or is not there, and left out of "
            f"the tables: {'; '.join(lost)}."
        )
    method = (
        f"At each point the compiled laws fly the compiled equations of motion at {RATE} Hz until they have settled. "
        "There one tick of each is differentiated by central differences: the vehicle in 19 coordinates with motors "
        "and servos, the laws with all they remember. "
        f"A command acts {DELAY} tick after the estimate it is made of, and is held for one. "
        "Below the airspeed from which the wing alone may carry, a leg is flown at a ground speed, from there on at an "
        "airspeed; level points hold altitude, the others a climb rate. "
        "With T the closed loop's response from a disturbance on a signal to that signal before it, the opened loop is "
        "L = 1/(1 + T) - 1. The disk margin is the symmetric one of Seiler, Packard and Gahinet "
        "(IEEE CSM 2020, doi:10.1109/MCS.2020.3005277); that of all actuators at once is a lower bound."
    )
    parts = [
        f"# Control report: {source}",
        summary,
        *notes,
        "## Worst of each loop",
        _worst(held, table.loops),
        "## Gain margin [dB] / phase margin [deg] over airspeed [m/s]",
        _cells(table),
        _together(held, table.airspeeds),
        *(f"![{name.removesuffix('.png')}]({name})\n\n*{caption}*" for name, caption in CAPTIONS.items()),
        *(("## A wing that is stuck", stuck_wing_section(stuck)) if stuck else ()),
        "## How it is measured",
        method,
        "## The points",
        _points(points),
    ]
    return "\n\n".join(parts) + "\n"


def _worst(points: Sequence[PointAnalysis], loops: Sequence[str]) -> str:
    """Markdown table: least gain, phase, delay and disk margin of each loop, and where."""
    rows = [
        "| loop | gain [dB] | at | phase [deg] | at | delay [ms] | disk | at |",
        "|---|--:|---|--:|---|--:|--:|---|",
    ]
    for name in loops:
        found = [(point, point.margins[name]) for point in points if point.stable and name in point.margins]
        if not found:
            continue
        gain = min(found, key=lambda each: each[1].gain_db)
        phase = min(found, key=lambda each: each[1].phase)
        disk = min(found, key=lambda each: each[1].disk)
        delay = min(margins.delay for _, margins in found)
        rows.append(
            f"| {name} | {_number(gain[1].gain_db, GAIN_GOAL)} | {_place(gain[0])} "
            f"| {_number(math.degrees(phase[1].phase), math.degrees(PHASE_GOAL))} | {_place(phase[0])} "
            f"| {_number(1000.0 * delay, 0.0)} | {disk[1].disk:.2f} | {_place(disk[0])} |"
        )
    return "\n".join(rows)


def _cells(table: MarginTable) -> str:
    """Markdown table: gain / phase by loop and airspeed."""
    rows = ["| loop | " + " | ".join(f"{speed:g}" for speed in table.airspeeds) + " |"]
    rows.append("|---" * (1 + len(table.airspeeds)) + "|")
    for i, name in enumerate(table.loops):
        cells: list[str] = []
        for gain, phase in zip(table.gain[i], np.degrees(table.phase[i]), strict=True):
            text = "" if math.isnan(gain) else f"{_short(gain)}/{_short(phase)}"
            good = math.isnan(gain) or (gain >= GAIN_GOAL and phase >= math.degrees(PHASE_GOAL))
            cells.append(text if good else f"**{text}**")
        rows.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(rows)


def _together(points: Sequence[PointAnalysis], speeds: Sequence[float]) -> str:
    """Markdown table: disk margin of all actuators at once."""
    least = [min(point.actuators_disk if point.stable else 0.0 for point in points if point.airspeed == speed)
             for speed in speeds]  # fmt: skip
    return "\n".join(
        [
            "| airspeed [m/s] | " + " | ".join(f"{speed:g}" for speed in speeds) + " |",
            "|---" * (1 + len(speeds)) + "|",
            "| disk margin, all actuators at once | " + " | ".join(f"{value:.2f}" for value in least) + " |",
        ]
    )


def _points(points: Sequence[PointAnalysis]) -> str:
    """Markdown table: what each point was, and how well it was one."""
    head = (
        "Largest acceleration left when differentiated, in m/s² or rad/s²; slowest pole; how far the laws are from "
        "straight within the differences' steps (0: smooth; towards 1: a node of the force map lies at the point, and "
        "the difference is the mean of both sides)."
    )
    rows = [
        "| asked: speed [m/s] | climb [m/s] | flown: speed | climb | unsettled | slowest pole [1/s] | deviation |",
        "|--:|--:|--:|--:|--:|--:|--:|",
    ]
    rows += [
        f"| {point.airspeed:g} | {point.climb:+g} | {point.flown[0]:.2f} | {point.flown[1]:+.2f} "
        f"| {point.unsettled:.1g} | {point.loop.growth:.3f} | {point.deviation:.2f} |"
        for point in points
    ]
    return head + "\n\n" + "\n".join(rows)


def _tightest_loops(points: Sequence[PointAnalysis]) -> list[Loop]:
    """The loops with the least disk margins, each at its worst stable point."""
    worst: dict[str, PointAnalysis] = {}
    for point in points:
        for name, margins in point.margins.items():
            if point.held and point.stable and (name not in worst or margins.disk < worst[name].margins[name].disk):
                worst[name] = point
    chosen = sorted(worst, key=lambda name: worst[name].margins[name].disk)[:TIGHTEST]
    loops: list[Loop] = []
    for name in chosen:
        point = worst[name]
        omega = frequency_grid(point.loop.dt, point.loop.poles)
        response = 1.0 / point.loop.sensitivity(omega, [name])[:, 0, 0] - 1.0
        margins = point.margins[name]
        loops.append(Loop(f"{name}, {_place(point)}", omega, response, margins.phase, margins.gain_db))
    return loops


def _schedule(design: Design, speeds: Sequence[float]) -> list[tuple[str, list[float]]]:
    """Columns of the schedule over the airspeeds of the corridor."""
    row = np.empty(len(SCHEDULE_COLUMNS))
    rows: list[np.ndarray] = []
    for speed in speeds:
        schedule_lookup(design.schedule, design.axes, speed, row)
        rows.append(row.copy())
    return [(name, [float(each[k]) for each in rows]) for k, name in enumerate(SCHEDULE_COLUMNS)]


def _place(point: PointAnalysis) -> str:
    return f"{point.airspeed:g} m/s {point.climb:+g}" if point.climb else f"{point.airspeed:g} m/s"


def _number(value: float, goal: float) -> str:
    if math.isinf(value):
        return "∞"
    return f"**{value:.1f}**" if value < goal else f"{value:.1f}"


def _short(value: float) -> str:
    return "∞" if value > 999.0 else f"{value:.1f}" if value < 9.95 else f"{value:.0f}"
