"""Lists, reads, sets, saves, loads and compares a vehicle's parameters."""

import fnmatch
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer
from rich.progress import MofNCompleteColumn

from gcs_scripts.command_line import CONTEXT, Connect, Reach, System, Timeout, application, progress_bar, run, tell
from gcs_scripts.connection import Vehicle, enum_name
from gcs_scripts.errors import ExitCode, GroundError, RefusedError
from gcs_scripts.parameter_encoding import Parameter
from gcs_scripts.parameter_file import compare, read_file, text_of, write_file
from gcs_scripts.parameter_transfer import ParameterLink

__all__ = ["main"]

PROGRAM = "param"
File = Annotated[Path, typer.Argument(metavar="FILE", help="QGroundControl's .params, or MAVProxy's .parm.")]

_application = application()


@_application.callback()
def _every(context: typer.Context, link: Connect = None, timeout: Timeout = None, system: System = None) -> None:
    """A vehicle's parameters.

    Exit codes: 0 done, 1 `diff` found differences, 2 wrong option or file, 3 the vehicle refused, 4 no vehicle or link
    lost, 5 no answer in time.
    """
    context.obj = Reach().but(link, timeout, system)


@_application.command("list")
def _list(
    context: typer.Context,
    pattern: Annotated[str, typer.Argument(metavar="[PATTERN]", help="Only names like this, as MPC_*.")] = "*",
    link: Connect = None,
    timeout: Timeout = None,
    system: System = None,
) -> int:
    """List parameters: name, value, type."""
    with context.obj.but(link, timeout, system).open() as vehicle:
        parameters = _read_all(vehicle)
    chosen = [p for name, p in parameters.items() if fnmatch.fnmatchcase(name, pattern.upper())]
    if not chosen:
        raise GroundError(f"none of {len(parameters)} parameters has a name like {pattern}")
    for parameter in chosen:
        print(f"{parameter.name:16} {text_of(parameter):>16} {_type_name(parameter)}")
    return ExitCode.DONE


@_application.command("get")
def _get(
    context: typer.Context,
    names: Annotated[list[str], typer.Argument(metavar="NAME...", help="Names of parameters.")],
    link: Connect = None,
    timeout: Timeout = None,
    system: System = None,
) -> int:
    """Print the value of one parameter, or names and values of several."""
    with context.obj.but(link, timeout, system).open() as vehicle:
        parameters = ParameterLink(vehicle)
        for name in names:
            parameter = parameters.read(name.upper())
            print(text_of(parameter) if len(names) == 1 else f"{parameter.name:16} {text_of(parameter)}")
    return ExitCode.DONE


@_application.command("set", context_settings={**CONTEXT, "ignore_unknown_options": True})  # NAME -1
def _set(
    context: typer.Context,
    words: Annotated[list[str], typer.Argument(metavar="NAME=VALUE...", help="Or one NAME VALUE.")],
    link: Connect = None,
    timeout: Timeout = None,
    system: System = None,
) -> int:
    """Set parameters; each is checked by what the vehicle tells back."""
    wanted = [_assignment(text) for text in (["=".join(words)] if len(words) == 2 and "=" not in words[0] else words)]
    with context.obj.but(link, timeout, system).open() as vehicle:
        parameters = ParameterLink(vehicle)
        for name, value in wanted:
            parameter = parameters.write(name, value)
            print(f"{parameter.name:16} {text_of(parameter)}")
    return ExitCode.DONE


@_application.command("save")
def _save(
    context: typer.Context, file: File, link: Connect = None, timeout: Timeout = None, system: System = None
) -> int:
    """Save all parameters to a file."""
    with context.obj.but(link, timeout, system).open() as vehicle:
        parameters = _read_all(vehicle)
        write_file(file, parameters.values(), vehicle)
    print(f"{len(parameters)} parameters saved to {file}")
    return ExitCode.DONE


@_application.command("load")
def _load(
    context: typer.Context, file: File, link: Connect = None, timeout: Timeout = None, system: System = None
) -> int:
    """Set what differs from a file. What the vehicle refuses or lacks is named; the rest is set."""
    given = read_file(file)
    refused = 0
    with context.obj.but(link, timeout, system).open() as vehicle:
        differing = [d for d in compare(given, _read_all(vehicle)) if d.in_file is not None]
        parameters = ParameterLink(vehicle)
        with progress_bar(MofNCompleteColumn()) as bar:
            for name, value, present in bar.track(differing, description="setting"):
                if value is None:
                    continue
                if present is None:
                    tell(f"{PROGRAM}: {name}: the vehicle has no such parameter")
                    refused += 1
                    continue
                try:
                    parameter = parameters.write(name, value, present.type)
                except RefusedError as error:
                    tell(f"{PROGRAM}: {error}")
                    refused += 1
                else:
                    print(f"{name:16} {text_of(present)} -> {text_of(parameter)}")
    print(f"{len(given)} parameters in {file}: {len(differing) - refused} set, {refused} not, the others were equal")
    return ExitCode.REFUSED if refused else ExitCode.DONE


@_application.command("diff")
def _diff(
    context: typer.Context,
    file: File,
    everything: Annotated[bool, typer.Option("--all", help="Also parameters that the file lacks.")] = False,
    link: Connect = None,
    timeout: Timeout = None,
    system: System = None,
) -> int:
    """Show what differs from a file: name, value in the file, value in the vehicle (- where it is missing)."""
    given = read_file(file)
    with context.obj.but(link, timeout, system).open() as vehicle:
        differing = [d for d in compare(given, _read_all(vehicle)) if everything or d.in_file is not None]
    for name, value, present in differing:
        in_file = "-" if value is None else f"{value:.9g}"
        print(f"{name:16} {in_file:>16} {'-' if present is None else text_of(present):>16}")
    return ExitCode.DIFFERS if differing else ExitCode.DONE


def _read_all(vehicle: Vehicle) -> dict[str, Parameter]:
    with progress_bar(MofNCompleteColumn()) as bar:
        task = bar.add_task("reading", total=None)
        return ParameterLink(vehicle).read_all(lambda done, total: bar.update(task, completed=done, total=total))


def _assignment(text: str) -> tuple[str, float]:
    name, _, value = text.partition("=")
    try:
        return name.strip().upper(), float(value)
    except ValueError:
        raise GroundError(f"expected NAME=VALUE with a number, got {text!r}") from None


def _type_name(parameter: Parameter) -> str:
    return enum_name("MAV_PARAM_TYPE", parameter.type)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code."""
    return run(_application, PROGRAM, arguments)


if __name__ == "__main__":
    sys.exit(main())
