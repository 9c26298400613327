"""How a program on the command line ends: errors of the user's making are one line, and the exit code tells which."""

import sys

import typer
from typer.exceptions import TyperException

__all__ = ["run"]


def run(app: typer.Typer, name: str, errors: tuple[type[Exception], ...], exit_code: int) -> None:
    """Run a command line and exit with what it returns.

    A wrong option exits with 2, one of `errors` with `exit_code`, each with one line after `name`; Ctrl-C with 130.
    """
    try:
        sys.exit(app(standalone_mode=False))
    except TyperException as error:
        print(f"{name}: {error.format_message()} (see --help)", file=sys.stderr)
        sys.exit(2)
    except errors as error:
        print(f"{name}: {error}", file=sys.stderr)
        sys.exit(exit_code)
    except KeyboardInterrupt:
        sys.exit(130)
