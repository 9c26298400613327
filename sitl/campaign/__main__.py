"""`python -m sitl.campaign`: flies the cases on all cores, shows how far it is, writes tables and JSON."""

import json
import os
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer
from rich.box import SIMPLE
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table

from sitl.campaign.fly import Campaign, Flyer
from sitl.campaign.outcome import Outcome, as_table
from sitl.campaign.page import lost_table, markdown, short_table
from sitl.campaign.pool import fly_all
from vehicle_model.command_line import run

__all__ = ["campaign", "main", "save"]

MISSION = Path(__file__).parents[2] / "docs" / "examples" / "survey_3km.plan"


def save(campaign: Campaign, outcomes: list[Outcome], folder: Path) -> tuple[Path, Path]:
    """Write the page and the JSON of a campaign; returns their paths. The same campaign gives the same bytes."""
    folder.mkdir(parents=True, exist_ok=True)
    page, data = folder / "README.md", folder / "campaign.json"
    aircraft = Flyer(campaign).nominal.name
    page.write_text(
        markdown(
            outcomes, seed=campaign.seed, scatter=campaign.scatter, mission=campaign.mission.name, aircraft=aircraft
        ),
        encoding="utf-8",
    )
    table = {
        "seed": campaign.seed,
        "mission": campaign.mission.name,
        "aircraft": aircraft,
        "scatter": asdict(campaign.scatter),
        "lost": sum(bool(outcome.lost) for outcome in outcomes),
        "flights": [as_table(outcome) for outcome in outcomes],
    }
    data.write_text(json.dumps(table, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    return page, data


app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)


@app.command()
def campaign(
    cases: Annotated[int, typer.Option(metavar="N", min=1, help="Flights.")] = 300,
    seed: Annotated[int, typer.Option(metavar="S", min=0, help="Where chance begins.")] = 0,
    jobs: Annotated[int | None, typer.Option(metavar="N", min=1, help="Processes. [default: one per core]")] = None,
    only: Annotated[int | None, typer.Option(metavar="CASE", min=0, help="Fly this one and draw its report.")] = None,
    mission: Annotated[Path, typer.Option(metavar="PLAN", help="QGroundControl plan.")] = MISSION,
    aircraft: Annotated[Path | None, typer.Option(metavar="FILE", help="Aircraft file. [default: the paper's]")] = None,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Where page, JSON and reports go.")] = Path("build/campaign"),
) -> None:
    """Fly one mission many times, in winds and with aircraft that the control laws do not know."""
    wanted = Campaign(seed, mission, aircraft)
    console = Console()
    Flyer(wanted)  # a wrong file is told here, once, and not by each process
    lost = _fly_one(wanted, only, out, console) if only is not None else _fly_many(wanted, cases, jobs, out, console)
    if lost:
        sys.exit(1)


def _fly_many(campaign: Campaign, cases: int, jobs: int | None, out: Path, console: Console) -> int:
    """Fly all cases, show and save what came of them; returns how many were lost."""
    outcomes = _with_progress(campaign, cases, jobs or os.cpu_count() or 1, console)
    page, data = save(campaign, outcomes, out)
    lost = lost_table(outcomes)
    for title, table in (("Lost", lost), ("Flights that were not lost", short_table(outcomes))):
        if table[1]:
            console.print(_shown(title, *table))
    console.print(f"{len(outcomes)} flights, {len(lost[1])} lost; {page} and {data}", soft_wrap=True)
    return len(lost[1])


def _with_progress(campaign: Campaign, cases: int, jobs: int, console: Console) -> list[Outcome]:
    """All outcomes by number, while a bar shows how far it is."""
    bar = Progress(
        TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TimeRemainingColumn(),
        console=console,
    )  # fmt: skip
    outcomes: list[Outcome] = []
    with bar:
        task = bar.add_task("0 lost", total=cases)
        for outcome in fly_all(campaign, cases, min(jobs, cases)):
            outcomes.append(outcome)
            if outcome.lost:
                bar.print(f"case {outcome.case.number} lost: {'; '.join(outcome.lost)}", markup=False)
            bar.update(task, advance=1, description=f"{sum(bool(o.lost) for o in outcomes)} lost")
    return sorted(outcomes, key=lambda outcome: outcome.case.number)


def _fly_one(campaign: Campaign, number: int, out: Path, console: Console) -> int:
    """Fly one case again and leave its report; returns whether it was lost."""
    from sitl.flight_report import flight_report

    flown = Flyer(campaign).fly(number)
    out.mkdir(parents=True, exist_ok=True)
    path = flight_report(flown.rows, flown.page, out / f"case_{campaign.seed}_{number}.png")
    fate = "; ".join(flown.outcome.lost) or "landed"
    console.print(f"case {number}: {fate} after {flown.outcome.end:.0f} s; {path}", soft_wrap=True)
    return len(flown.outcome.lost) > 0


def _shown(title: str, head: tuple[str, ...], rows: list[tuple[str, ...]]) -> Table:
    """A table for the terminal."""
    table = Table(*head, title=title, box=SIMPLE, padding=(0, 1, 0, 0))
    table.columns[0].no_wrap = True
    for row in rows:
        table.add_row(*map(escape, row))  # a unit in brackets is no markup
    return table


def main() -> None:
    """Entry point: exit status 0 if none was lost, 1 if any was, 2 for what cannot be flown, told in one line."""
    run(app, "campaign", (ValueError, OSError), 2)


if __name__ == "__main__":
    main()
