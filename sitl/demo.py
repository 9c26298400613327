"""`python -m sitl.demo`: a whole mission in one command, its recording and a page about it.

Vertical take-off, transition, waypoints, loiter, back transition, landing: nobody touches anything.
"""

import contextlib
import math
import sys
import threading
import time
from pathlib import Path
from typing import Annotated, Literal

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

from sitl import Simulation
from sitl.airframe import FlightDivergedError
from sitl.flight.plan_file import read_plan
from sitl.flight.refused import Refused
from sitl.flight_report import flight_report
from sitl.recording import Tape, save_recording, serve_recording
from sitl.report_page import mission_page
from vehicle_model.command_line import run

__all__ = ["demo", "fly_mission", "main"]

MISSION = Path(__file__).parents[1] / "docs" / "examples" / "survey_3km.plan"
LONGEST = 900.0  # simulated [s]
ROW_INTERVAL = 0.02  # of the history [s]: a touch-down speed is that of the row before it
PICTURES = 25  # snapshots per simulated second in the recording
TICKS_PER_LINE = 400  # from one look at the progress to the next
LEAST_GRAVE = 6  # MAV_SEVERITY up to which a message is shown: all but debugging


app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)


@app.command()
def demo(
    mission: Annotated[Path, typer.Option(metavar="PLAN", help="QGroundControl plan.")] = MISSION,
    aircraft: Annotated[Path | None, typer.Option(metavar="FILE", help="Aircraft file. [default: the paper's]")] = None,
    wind: Annotated[tuple[float, float], typer.Option(metavar="N E", help="Steady, m/s, blowing to.")] = (3.0, -4.0),
    out: Annotated[Path, typer.Option(metavar="DIR", help="Where recording and report go.")] = Path("build/demo"),
    rerun: Annotated[
        Literal["save", "web", "off"], typer.Option(help="Save the recording, show it in a browser, or neither.")
    ] = "save",
    no_map: Annotated[bool, typer.Option("--no-map", help="Leave out the viewer's map (tiles: internet).")] = False,
) -> None:
    """Fly a whole mission by itself; leave its recording and its report."""
    console = Console(highlight=False)
    home = read_plan(mission).home
    simulation = Simulation(aircraft=aircraft, wind=(*wind, 0.0), home=(*home, 0.0))
    simulation.load_plan(mission)
    page = mission_page(simulation.flight, mission.stem.replace("_", " "), _lines(simulation))
    out.mkdir(parents=True, exist_ok=True)
    history = simulation.record(ROW_INTERVAL)
    tape = Tape(simulation.aircraft, mission.stem)
    trouble = fly_mission(simulation, tape, console)
    console.print(f"report     {flight_report(history.rows, page, out / f'{mission.stem}.png')}", soft_wrap=True)
    if rerun == "save":
        recording = save_recording(tape, out / f"{mission.stem}.rrd", show_map=not no_map)
        console.print(f"recording  {recording}", soft_wrap=True)
    elif rerun == "web":
        with serve_recording(tape, show_map=not no_map) as address, contextlib.suppress(KeyboardInterrupt):
            console.print(f"watch      {address}  (Ctrl-C ends)", soft_wrap=True)
            threading.Event().wait()
    if trouble is not None:
        sys.exit(f"demo: {trouble}")


def fly_mission(simulation: Simulation, tape: Tape, console: Console) -> str | None:
    """Fly the loaded mission from arming to disarming, with a line that shows how far it is; fills the tape.

    Returns None, or why the mission was not flown to its end.
    """
    flight = simulation.flight
    count = len(flight.mission.items)
    began = time.perf_counter()
    next_picture = -1.0

    def is_over(simulation: Simulation) -> bool:
        nonlocal next_picture
        if simulation.time >= next_picture:
            next_picture = simulation.time + 1.0 / PICTURES
            tape.snapshots.append(simulation.snapshot())
        if simulation.tick % TICKS_PER_LINE == 0:
            faster = simulation.time / max(time.perf_counter() - began, 1e-6)
            line.update(task, completed=flight.mission.current, description=_described(simulation, faster))
        return not flight.armed

    with Progress(TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), console=console) as line:
        task = line.add_task("", total=count)

        def hear(severity: int, text: str) -> None:
            tape.messages.append((simulation.time, severity, text))
            if severity <= LEAST_GRAVE:
                line.print(f"{simulation.time:6.1f} s  {text}", markup=False)

        simulation.listener = hear
        try:
            flight.start_mission()
            flight.arm()
            simulation.run_until(is_over, timeout=LONGEST)
        except (Refused, FlightDivergedError) as error:
            return str(error)
        finally:
            simulation.listener = None
        tape.snapshots.append(simulation.snapshot())
        if flight.armed:
            return f"mission not finished after {LONGEST:g} s"
        if not flight.mission.finished:
            return f"disarmed in item {flight.mission.current} of {count}, before the mission's end"
        line.update(task, completed=count)
    return None


def _described(simulation: Simulation, faster: float) -> str:
    """Time, regime, height and speed in one line."""
    view, flight = simulation.flight.view, simulation.flight
    regime = flight.regime.name.replace("_", " ").lower()
    return f"{simulation.time:5.0f} s  {regime:9}  {-view.down:4.0f} m  {view.airspeed:4.1f} m/s  {faster:4.0f} x"


def _lines(simulation: Simulation) -> tuple[str, str]:
    """What was flown, where and in which wind."""
    home, wind = simulation.scenario.home, simulation.scenario.wind.steady_ned
    source = math.degrees(math.atan2(-wind[1], -wind[0])) % 360.0
    return (
        f"{simulation.aircraft.name} · home {home.latitude:g}, {home.longitude:g}, {home.altitude:g} m",
        f"wind {math.hypot(wind[0], wind[1]):.1f} m/s from {source:.0f}°",
    )


def main() -> None:
    """Entry point: exit status 0 after a whole mission, 1 otherwise, 2 for what cannot be flown, told in one line."""
    run(app, "demo", (ValueError, OSError), 2)


if __name__ == "__main__":
    main()
