"""`python -m vehicle_model`: trim, modes, elevator step, check cases and the paper's figures from the shell."""

import json
import math
import sys
import time
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from vehicle_model.aircraft import Aircraft, AircraftFileError, load_aircraft
from vehicle_model.check_case_file import CaseFileError
from vehicle_model.command_line import run
from vehicle_model.linearise import HOLDS, Hold, Mode, linearise
from vehicle_model.linearise import modes as natural_modes
from vehicle_model.trim import Trim, TrimError, still_air, trim_each, trim_level

app = typer.Typer(
    name="vehicle_model", add_completion=False, pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="Flight dynamics of a single tilt-wing UAV (Hong et al., IFAC ACA 2013).",
)  # fmt: skip

AircraftFile = Annotated[Path | None, typer.Option("--aircraft", help="Aircraft file; default: the paper's aircraft.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")]


MOST_SPEEDS = 10_000
MOST_STEPS = 2_000_000  # kept in memory at once


def parse_range(text: str) -> list[float]:
    """`30`, `0,5,10` or `0:30:1` (ends included) as a list of numbers; raises typer.BadParameter."""
    try:
        if ":" not in text:
            values = [float(part) for part in text.split(",")]
        else:
            start, stop, *step = (float(part) for part in text.split(":"))
            (stride,) = step or (1.0,)
            count = math.floor((stop - start) / stride + 1e-9) + 1
            values = [start + i * stride for i in range(min(count, MOST_SPEEDS + 1))]
    except (ValueError, ZeroDivisionError, OverflowError):
        values = []
    if not 0 < len(values) <= MOST_SPEEDS or not all(math.isfinite(value) for value in values):
        raise typer.BadParameter(
            f"expected a number, a list 0,5,10 or a range start:stop:step of at most {MOST_SPEEDS}, got {text!r}",
            param_hint="'--airspeed'",
        )
    return values


def finite(value: float) -> float:
    """Option callback: the value, unless it is infinite or not a number."""
    if not math.isfinite(value):
        raise typer.BadParameter(f"expected a finite number, got {value}")
    return value


Altitude = Annotated[float, typer.Option(help="Above mean sea level [m]; the air gets thinner.", callback=finite)]


def trim_row(aircraft: Aircraft, trim: Trim) -> dict[str, Any]:
    """One trim with units in its keys, for people and scripts; a stall margin where no air moves is null."""
    margins = np.degrees(trim.outputs["stall_margin"])
    wetted, unwetted = (margins[strips] for strips in aircraft.wing_strips)
    return {
        "airspeed_m_s": trim.airspeed,
        "rpm": trim.rpm,
        "tilt_deg": math.degrees(trim.tilt),
        "elevator_deg": math.degrees(trim.elevator),
        "tail_rpm": trim.tail_rpm,
        "throttle": float(trim.controls[0]),
        "shaft_power_w": trim.power,
        "stall_margin_wetted_deg": float(wetted.min()) if wetted.size else None,
        "stall_margin_unwetted_deg": float(unwetted.min()) if unwetted.size and trim.airspeed else None,
        "residual": trim.residual,
    }


def stall_margins(aircraft: Aircraft, trim: Trim) -> dict[str, float]:
    """Angle left to maximum lift [deg], by the name of the strip or tail surface."""
    margins = np.degrees(trim.outputs["stall_margin"]).tolist()
    return dict(zip(aircraft.surface_names, margins, strict=False))


def mode_row(mode: Mode) -> dict[str, Any]:
    """One mode with units in its keys; what is infinite is null in JSON."""
    row: dict[str, Any] = {
        "name": mode.name,
        "real": mode.real,
        "imag": mode.imag,
        "omega_rad_s": mode.omega,
        "damping": mode.damping,
        "period_s": mode.period,
        "time_to_half_s": mode.time_to_half,
    }
    return {key: None if isinstance(value, float) and math.isinf(value) else value for key, value in row.items()}


def table(rows: list[dict[str, Any]]) -> str:
    """Rows with the same keys as aligned text."""
    keys = list(rows[0])
    cells = [keys] + [[_cell(row[key]) for key in keys] for row in rows]
    widths = [max(len(line[i]) for line in cells) for i in range(len(keys))]
    return "\n".join("  ".join(text.rjust(width) for text, width in zip(line, widths, strict=True)) for line in cells)


def _cell(value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


@app.command()
def trim(
    airspeed: Annotated[str, typer.Option(help="m/s: 30, 0,5,10 or start:stop:step.")] = "0:30:1",
    altitude: Altitude = 0.0,
    aircraft: AircraftFile = None,
    as_json: AsJson = False,
) -> None:
    """Level trim with the fuselage level: RPM, tilt and equivalent elevator over airspeed (the paper's Fig. 10)."""
    speeds = parse_range(airspeed)
    model = load_aircraft(aircraft)
    found = trim_each(model, speeds, still_air(altitude))
    trims = [each for each in found if isinstance(each, Trim)]
    if as_json:
        rows = [trim_row(model, each) | {"stall_margins_deg": stall_margins(model, each)} for each in trims]
        print(json.dumps(rows, indent=1))
    elif trims:
        print(table([trim_row(model, each) for each in trims]))
    for each in found:
        if isinstance(each, TrimError):
            print(f"error: {each}", file=sys.stderr)
    if len(trims) < len(found):
        raise typer.Exit(1)


@app.command()
def modes(
    airspeed: Annotated[float, typer.Option(help="m/s", callback=finite)] = 30.0,
    hold: Annotated[Hold, typer.Option(help="What the rotors keep while disturbed.")] = "throttle",
    altitude: Altitude = 0.0,
    aircraft: AircraftFile = None,
    as_json: AsJson = False,
) -> None:
    """Natural modes about the level trim (the paper's Table 1 and Fig. 13); the other holds are shown beside."""
    model = load_aircraft(aircraft)
    world = still_air(altitude)
    point = trim_level(model, airspeed, world)
    found = {each: [mode_row(mode) for mode in natural_modes(linearise(model, point, each, world))] for each in HOLDS}
    if as_json:
        others = {each: rows for each, rows in found.items() if each != hold}
        head = {"airspeed_m_s": airspeed, "hold": hold, "trim": trim_row(model, point)}
        print(json.dumps({**head, "modes": found[hold], "other_holds": others}, indent=1))
        return
    for each in (hold, *(other for other in HOLDS if other != hold)):
        print(f"\n{each} held" + (" (chosen)" if each == hold else ""))
        print(table(found[each]))


@app.command()
def step(
    airspeed: Annotated[float, typer.Option(help="m/s", callback=finite)] = 30.0,
    elevator: Annotated[float, typer.Option(help="Step of the equivalent elevator [deg].", callback=finite)] = 1.0,
    at: Annotated[float, typer.Option(help="Time of the step [s].", min=0.0, callback=finite)] = 1.0,
    duration: Annotated[float, typer.Option(help="[s]", min=0.0, max=3600.0, callback=finite)] = 50.0,
    rate: Annotated[int, typer.Option(help="Integration steps a second.", min=50, max=10_000)] = 400,
    altitude: Altitude = 0.0,
    aircraft: AircraftFile = None,
    as_json: AsJson = False,
) -> None:
    """Response to an elevator step from level trim (the paper's Figs 11-12), throttle held."""
    from vehicle_model.elevator_step import elevator_step

    if duration * rate > MOST_STEPS:
        raise typer.BadParameter(f"expected at most {MOST_STEPS} steps, got {duration:g} s at {rate} a second")
    model = load_aircraft(aircraft)
    flown = elevator_step(
        model, airspeed, math.radians(elevator), at=at, duration=duration, rate=rate, altitude=altitude
    )
    columns = {
        "time_s": flown.time,
        "u_m_s": flown.u,
        "w_m_s": flown.w,
        "q_deg_s": np.degrees(flown.q),
        "theta_deg": np.degrees(flown.theta),
        "velocity_north_m_s": flown.velocity_ned[:, 0],
        "velocity_east_m_s": flown.velocity_ned[:, 1],
        "velocity_down_m_s": flown.velocity_ned[:, 2],
    }
    if as_json:
        head = {
            "airspeed_m_s": airspeed,
            "elevator_step_deg": elevator,
            "step_time_s": at,
            "rate_hz": rate,
            "altitude_msl_m": altitude,
            "trim": trim_row(model, flown.trim),
            "servo_outputs_before": model.normalised_outputs(flown.controls_before),
            "servo_outputs_after": model.normalised_outputs(flown.controls_after),
        }
        print(json.dumps(head | {key: values.tolist() for key, values in columns.items()}))
        return
    every = max(1, len(flown.time) // 50)
    shown = {key: values[::every].tolist() for key, values in columns.items()}
    print(table([dict(zip(shown, row, strict=True)) for row in zip(*shown.values(), strict=True)]))


@app.command()
def bench(as_json: AsJson = False) -> None:
    """Time one RK4 step of the whole vehicle, called from Python and inside the compiled loop."""
    from vehicle_model.integrate import advance, rk4_step

    model: Aircraft = load_aircraft()
    point = trim_level(model, 30.0)
    world = still_air()

    def best(call: Any, count: int) -> float:
        call()
        times = []
        for _ in range(7):
            start = time.perf_counter()
            call()
            times.append((time.perf_counter() - start) / count)
        return min(times) * 1e6

    state = point.state.copy()

    def from_python() -> None:
        state[:] = point.state
        for _ in range(20_000):
            rk4_step(state, point.controls, model.vehicle, world, 0.0025)

    result = {
        "rk4_step_from_python_us": best(from_python, 20_000),
        "rk4_step_in_loop_us": best(
            lambda: advance(state, point.controls, model.vehicle, world, 0.0025, 20_000), 20_000
        ),
    }
    print(json.dumps(result) if as_json else table([result]))


@app.command()
def paper(out: Annotated[Path, typer.Option(help="Folder for the figures and the page.")] = Path("docs/paper")) -> None:
    """Draw the paper's figures beside its printed values, and the page that discusses them."""
    from vehicle_model.paper import reproduce

    for written in reproduce(load_aircraft(), out):
        print(written)


@app.command()
def case(file: Annotated[Path, typer.Argument(help="Check case, TOML.")]) -> None:
    """Fly a check case and compare it with the values it expects."""
    from vehicle_model.check_case import run_case

    result = run_case(file)
    print(result)
    if not result.passed:
        raise typer.Exit(1)


def main() -> None:
    """Entry point: errors of the user's making are one line; exit status 2 for a wrong command line, otherwise 1."""
    run(app, "error", (AircraftFileError, CaseFileError, TrimError, OSError), 1)


if __name__ == "__main__":
    main()
