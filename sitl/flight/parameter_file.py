"""Files of parameters: QGroundControl's (.params) and MAVProxy's (.parm), read and written; NAME=VALUE as typed.

QGroundControl writes a line `VEHICLE COMPONENT NAME VALUE TYPE`, separated by tabs, for each parameter of each
component (https://docs.qgroundcontrol.com/master/en/qgc-dev-guide/file_formats/parameters.html). MAVProxy writes
`NAME VALUE`, where commas may stand for blanks and whole numbers may be hexadecimal (0x1F). In both # begins a comment.
A file may mix them.
"""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

from sitl.flight.parameter_table import DEFINITIONS
from sitl.flight.parameters import Parameters

__all__ = ["Entry", "ParameterFileError", "as_params", "as_parm", "entries", "parse_parameters", "read_parameters"]

AUTOPILOT = 1  # component whose parameters are ours; a file may hold those of others, too
HASH = "_HASH_CHECK"  # PX4's hash of its parameters, which MAVProxy saves as if it were one of them
_TYPES = {"int": 6, "float": 9}  # MAV_PARAM_TYPE_INT32, MAV_PARAM_TYPE_REAL32
_HEAD = """\
# Onboard parameters of a tilt-wing
#
# Vehicle-Id Component-Id Name Value Type
"""


class ParameterFileError(ValueError):
    """A file or an assignment that cannot be used; one line with where it stands and what was expected."""


class Entry(NamedTuple):
    """What one line of a file says."""

    line: int  # from 1
    name: str
    value: float


def entries(data: bytes, source: str) -> list[Entry]:
    """What the lines of a file say, whether or not there are such parameters.

    `source` is what errors call it. Raises ParameterFileError for a line that is neither empty nor of a format we know.
    """
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        msg = f"{source}: expected text, got {error.reason} at byte {error.start}"
        raise ParameterFileError(msg) from None
    found: list[Entry] = []
    for number, line in enumerate(text.splitlines(), 1):
        fields = line.partition("#")[0].replace(",", " ").split()
        try:
            entry = _entry(number, fields)
        except ValueError:
            expected = "expected NAME VALUE, or VEHICLE COMPONENT NAME VALUE TYPE"
            msg = f"{source}: line {number}: {expected}, got {line.strip()!r}"
            raise ParameterFileError(msg) from None
        if entry is not None and entry.name != HASH:
            found.append(entry)
    return found


def read_parameters(path: Path | str) -> dict[str, float]:
    """The parameters of a file; of those that it names twice the latter counts.

    Raises ParameterFileError, with file and line, for a file that cannot be read, a parameter that there is not, and a
    value that it cannot have.
    """
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        msg = f"{path}: cannot be read: {error.strerror}"
        raise ParameterFileError(msg) from None
    parameters = Parameters()
    values: dict[str, float] = {}
    for line, name, value in entries(data, str(path)):
        try:
            parameters.set(name, value)
        except ValueError as error:
            msg = f"{path}: line {line}: {error}"
            raise ParameterFileError(msg) from None
        values[name] = parameters[name]
    return values


def parse_parameters(assignments: Iterable[str] = (), files: Iterable[Path | str] = ()) -> dict[str, float]:
    """What a command line sets: files of parameters, then assignments `NAME=VALUE`; the latter go before the former.

    Raises ParameterFileError as `read_parameters` does, or with the assignment that is none.
    """
    values: dict[str, float] = {}
    for path in files:
        values |= read_parameters(path)
    parameters = Parameters()
    for text in assignments:
        name, _, value = text.partition("=")
        try:
            number = _number(value.strip())
        except ValueError:
            msg = f"parameter {text!r}: expected NAME=VALUE with a number"
            raise ParameterFileError(msg) from None
        try:
            parameters.set(name.strip(), number)
        except ValueError as error:
            raise ParameterFileError(str(error)) from None
        values[name.strip()] = parameters[name.strip()]
    return values


def as_params(values: Mapping[str, float], system: int) -> str:
    """A file of QGroundControl's format with these parameters of ours; `system` is the vehicle's MAVLink id."""
    types = {definition.name: _TYPES[definition.kind] for definition in DEFINITIONS}
    lines = (f"{system}\t{AUTOPILOT}\t{name}\t{value!r}\t{types[name]}\n" for name, value in sorted(values.items()))
    return _HEAD + "".join(lines)


def as_parm(values: Mapping[str, float]) -> str:
    """A file of MAVProxy's format with these parameters."""
    return "".join(f"{name:<16} {value!r}\n" for name, value in sorted(values.items()))


def _entry(number: int, fields: list[str]) -> Entry | None:
    """What a line says; None if that is nothing to us. Raises ValueError for fields of neither format."""
    if not fields:
        return None
    if len(fields) == 2:
        return Entry(number, fields[0], _number(fields[1]))
    vehicle, component, name, value, kind = fields
    if not (vehicle.isdecimal() and component.isdecimal() and kind.isdecimal()):
        raise ValueError(fields)
    entry = Entry(number, name, _number(value))
    return entry if int(component) == AUTOPILOT else None


def _number(text: str) -> float:
    """A number as people and programs write it; raises ValueError for anything else."""
    if "_" in text:  # Python's own habit
        raise ValueError(text)
    try:
        return float(int(text, 16)) if text.lower().startswith("0x") else float(text)
    except OverflowError:
        raise ValueError(text) from None
