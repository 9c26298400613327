"""`python -m sitl.control`: the control laws looked at from the shell."""

from pathlib import Path
from typing import Annotated

import typer
from rich.progress import track

from vehicle_model.aircraft import AircraftFileError, load_aircraft
from vehicle_model.command_line import run

app = typer.Typer(
    name="sitl.control", add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None,
    help="Design and analysis of the flight controller.",
)  # fmt: skip


@app.command()
def report(
    out: Annotated[Path, typer.Option(help="Folder for the page and its figures.")] = Path("docs/control"),
    aircraft: Annotated[Path | None, typer.Option(help="Aircraft file; default: the paper's aircraft.")] = None,
) -> None:
    """Stability margins of every loop over the whole transition, effectiveness, trim map and gains, as a page."""
    from sitl.control.report import write_report

    for written in write_report(load_aircraft(aircraft), out, lambda points: track(points, "corridor")):
        print(written)


@app.command()
def design(
    aircraft: Annotated[Path | None, typer.Option(help="Aircraft file; default: the paper's aircraft.")] = None,
) -> None:
    """Design the control laws of an aircraft, keep them for its flights, and say what was found."""
    from sitl.control.design import design_for

    found = load_aircraft(aircraft)
    made = design_for(found, lambda text: print(text, flush=True))
    print(f"{found.source_file.name}: {made.summary}")


def main() -> None:
    """Entry point: errors of the user's making are one line; exit status 2 for a wrong command line, otherwise 1."""
    run(app, "error", (AircraftFileError, OSError), 1)


if __name__ == "__main__":
    main()
