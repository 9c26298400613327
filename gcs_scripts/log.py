"""Lists, downloads and erases a vehicle's logs."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer
from rich.progress import DownloadColumn, TimeRemainingColumn, TransferSpeedColumn

from gcs_scripts.command_line import Connect, Reach, System, Timeout, application, progress_bar, run
from gcs_scripts.errors import ExitCode, GroundError
from gcs_scripts.log_transfer import LogEntry, download, erase, list_logs

__all__ = ["main"]

PROGRAM = "log"

_application = application()


@_application.callback()
def _every(context: typer.Context, link: Connect = None, timeout: Timeout = None, system: System = None) -> None:
    """A vehicle's logs.

    Exit codes: 0 done, 2 wrong option, 3 the vehicle refused, 4 no vehicle or link lost, 5 no answer in time.
    """
    context.obj = Reach().but(link, timeout, system)


@_application.command("list")
def _list(context: typer.Context, link: Connect = None, timeout: Timeout = None, system: System = None) -> int:
    """List logs: id, when they were begun (UTC), size in bytes."""
    with context.obj.but(link, timeout, system).open() as vehicle:
        logs = list_logs(vehicle)
    for entry in logs:
        print(f"{entry.id:5} {entry.date:19} {entry.size:12}")
    return ExitCode.DONE


@_application.command("download")
def _download(
    context: typer.Context,
    ids: Annotated[list[int] | None, typer.Argument(metavar="[ID...]", help="Which ones.")] = None,
    everything: Annotated[bool, typer.Option("--all", help="All logs.")] = False,
    newest: Annotated[bool, typer.Option("--last", help="The last log. [default without ID]")] = False,
    output: Annotated[Path, typer.Option(metavar="DIR", help="Where to put them.", show_default=False)] = Path(),
    link: Connect = None,
    timeout: Timeout = None,
    system: System = None,
) -> int:
    """Download logs. One that was begun before goes on where it ended; one that is there is left alone."""
    if bool(ids) + everything + newest > 1:
        raise GroundError("expected IDs or --all or --last, got more than one of them")
    with context.obj.but(link, timeout, system).open() as vehicle:
        chosen = _chosen(list_logs(vehicle), ids or [], everything=everything)
        with progress_bar(DownloadColumn(), TransferSpeedColumn(), TimeRemainingColumn()) as bar:
            for entry in chosen:
                task = bar.add_task(f"log {entry.id}", total=entry.size)
                path = download(vehicle, entry, output, lambda there, task=task: bar.update(task, completed=there))
                print(path)
    return ExitCode.DONE


@_application.command("erase")
def _erase(
    context: typer.Context,
    sure: Annotated[bool, typer.Option("--yes", help="Do not ask.")] = False,
    link: Connect = None,
    timeout: Timeout = None,
    system: System = None,
) -> int:
    """Erase all logs on the vehicle."""
    if not sure:
        typer.confirm("Erase all logs on the vehicle?", abort=True, err=True)
    with context.obj.but(link, timeout, system).open() as vehicle:
        before, left = erase(vehicle)
    print(f"{before} logs erased, {left} there now")
    return ExitCode.DONE


def _chosen(logs: list[LogEntry], ids: list[int], *, everything: bool) -> list[LogEntry]:
    by_id = {entry.id: entry for entry in logs}
    missing = [i for i in ids if i not in by_id]
    if missing or not logs:
        there = f"{min(by_id)} to {max(by_id)}" if logs else "none"
        raise GroundError(f"no log {', '.join(map(str, missing)) or 'to download'}; there are {there}")
    if ids:
        return [by_id[i] for i in ids]
    return logs if everything else [logs[-1]]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code."""
    return run(_application, PROGRAM, arguments)


if __name__ == "__main__":
    sys.exit(main())
