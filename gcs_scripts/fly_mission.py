"""Flies a QGroundControl plan: uploads it, arms, starts it, follows it until the vehicle has landed and disarmed."""

import math
import sys
import time
from collections.abc import Sequence
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer
from rich.progress import MofNCompleteColumn, TextColumn

from gcs_scripts.command_line import CONTEXT, Connect, Reach, System, Timeout, application, progress_bar, run, tell
from gcs_scripts.errors import ExitCode
from gcs_scripts.mission_flight import MissionFlight, check
from gcs_scripts.plan_file import read_plan

__all__ = ["main"]

PROGRAM = "fly_mission"
SHOWN = ("altitude_m", "airspeed_m_s", "vtol_state")

_application = application()


class Until(StrEnum):
    """When the flight is over."""

    LANDED = "landed"
    FINISHED = "finished"


@_application.command(name=PROGRAM, context_settings=CONTEXT)
def _command(
    file: Annotated[Path, typer.Argument(metavar="FILE.plan", help="As QGroundControl saves it.")],
    until: Annotated[
        Until, typer.Option(help="Over when landed and disarmed, or when the last item is done.")
    ] = Until.LANDED,
    within: Annotated[
        float, typer.Option(metavar="S", min=1.0, help="Longest duration of the flight.", show_default="any")
    ] = math.inf,
    ready_within: Annotated[
        float, typer.Option(metavar="S", min=0.0, help="How long the vehicle may take to get ready to arm.")
    ] = 60.0,
    upload_only: Annotated[bool, typer.Option("--upload-only", help="Upload, do not fly.")] = False,
    link: Connect = None,
    timeout: Timeout = None,
    system: System = None,
) -> int:
    """Fly a plan: mission, geofence and rally points are uploaded and replace those in the vehicle.

    Exit codes: 0 the vehicle has landed and disarmed, 2 wrong option or plan, 3 the vehicle refused, 4 no vehicle or
    link lost, 5 no answer in time or the flight took too long, 6 the flight ended before its landing item.
    """
    plan = read_plan(file)
    to_landing = until == Until.LANDED
    check(plan, to_landing=to_landing and not upload_only)
    with Reach().but(link, timeout, system).open() as vehicle:
        flight = MissionFlight(vehicle, plan, lambda line: print(line, flush=True))
        print(f"system {vehicle.system}: {flight.modes.name(vehicle.heartbeat)}", flush=True)
        with progress_bar(MofNCompleteColumn()) as bar:
            task = bar.add_task("uploading")
            flight.upload(lambda name, sent, total: bar.update(task, description=name, completed=sent, total=total))
        if upload_only:
            return ExitCode.DONE
        begin = time.monotonic()
        try:
            flight.start(ready_within)
            _follow(flight, within, to_landing=to_landing)
        except KeyboardInterrupt:
            tell(f"{PROGRAM}: left: the vehicle flies on, {flight.where()}")
            return ExitCode.INTERRUPTED
        how = "landed and disarmed" if flight.has_landed else f"finished, {flight.where()}"
        print(f"{how} after {time.monotonic() - begin:.0f} s")
    return ExitCode.DONE


def _follow(flight: MissionFlight, within: float, *, to_landing: bool) -> None:
    with progress_bar(MofNCompleteColumn(), TextColumn("{task.fields[shown]}")) as bar:
        task = bar.add_task("flying", total=flight.total, shown="")
        for _ in flight.follow(within, to_landing=to_landing):
            known = {k: v for part in flight.state.sections(time.monotonic()).values() for k, v in part.items()}
            shown = "  ".join(f"{name} {known[name]}" for name in SHOWN if name in known)
            bar.update(task, description=known["mode"], completed=flight.item + 1, shown=shown)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code."""
    return run(_application, PROGRAM, arguments)


if __name__ == "__main__":
    sys.exit(main())
