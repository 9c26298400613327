"""What the command lines of all ground programs share: options, progress bars, errors as one line with an exit code."""

import sys
from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from typing import Annotated, TypeAlias

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, ProgressColumn, TextColumn
from typer.exceptions import TyperException

from gcs_scripts.connection import DEFAULT_CONNECTION, Vehicle, connect
from gcs_scripts.errors import ExitCode, GroundError

__all__ = ["CONTEXT", "Connect", "Reach", "System", "Timeout", "application", "progress_bar", "run", "tell"]

CONTEXT = {"help_option_names": ["-h", "--help"]}

Connect: TypeAlias = Annotated[
    str | None,
    typer.Option(
        "--connect",
        metavar="LINK",
        help="Where the vehicle is, as pymavlink writes it: udpin:HOST:PORT, udpout:, tcp:, tcpin:, or"
        f" /dev/ttyACM0,57600. [default: {DEFAULT_CONNECTION}]",
        show_default=False,
    ),
]
Timeout: TypeAlias = Annotated[
    float | None,
    typer.Option(
        "--timeout", metavar="S", min=0.1, help="Longest silence of the vehicle. [default: 10]", show_default=False
    ),
]
System: TypeAlias = Annotated[
    int | None,
    typer.Option(
        "--system",
        metavar="ID",
        min=1,
        max=255,
        help="Its MAVLink system id. [default: the first that is heard]",
        show_default=False,
    ),
]


@dataclass(frozen=True)
class Reach:
    """Where the vehicle is: the options that every program has."""

    connection: str = DEFAULT_CONNECTION
    timeout: float = 10.0
    system: int | None = None

    def but(self, connection: str | None, timeout: float | None, system: int | None) -> "Reach":
        """The same with those options that were given."""
        given = {"connection": connection, "timeout": timeout, "system": system}
        return replace(self, **{name: value for name, value in given.items() if value is not None})

    def open(self) -> AbstractContextManager[Vehicle]:
        """Connect to the vehicle; errors as of `gcs_scripts.connection.connect`."""
        return connect(self.connection, timeout=self.timeout, system=self.system)


def application() -> typer.Typer:
    """An empty command line in the style of all ground programs."""
    return typer.Typer(
        add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False, context_settings=CONTEXT
    )


def run(commands: typer.Typer, program: str, arguments: Sequence[str] | None) -> int:
    """Run a command line; returns the exit code. Errors are one line on stderr."""
    try:
        return commands(arguments, prog_name=program, standalone_mode=False) or ExitCode.DONE
    except GroundError as error:
        tell(f"{program}: {error}")
        return error.exit_code
    except OSError as error:
        tell(f"{program}: {error}")
        return ExitCode.WRONG_INPUT
    except TyperException as error:
        tell(f"{program}: {error.format_message()} (see --help)")
        return ExitCode.WRONG_INPUT
    except (KeyboardInterrupt, typer.Abort):
        return ExitCode.INTERRUPTED


def tell(line: str) -> None:
    """One line to the user, beside what the program is asked for, which goes to stdout."""
    print(line, file=sys.stderr)


def progress_bar(*columns: ProgressColumn) -> Progress:
    """A bar on the terminal that vanishes when it is done; nothing where stderr is no terminal."""
    console = Console(stderr=True)
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        *columns,
        console=console,
        transient=True,
        disable=not console.is_terminal,
        redirect_stdout=sys.stdout.isatty(),  # else it would take our output from the pipe to the terminal
    )
