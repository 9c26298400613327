"""Files of parameters, as QGroundControl (.params) and as MAVProxy and Mission Planner write them (.parm, .param).

QGroundControl: five columns with tabs between them: system id, component id, name, value, MAV_PARAM_TYPE.
MAVProxy: name and value with blanks between them, or a comma. In both `#` begins a comment.
"""

import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
from pymavlink import mavparm

from gcs_scripts.connection import Vehicle, enum_name
from gcs_scripts.errors import GroundError
from gcs_scripts.parameter_encoding import Parameter, as_type, is_integer

__all__ = ["FileValue", "compare", "is_equal", "read_file", "text_of", "write_file"]

QGROUNDCONTROL, MAVPROXY = (".params",), (".parm", ".param")
NOT_LOADED = frozenset(mavparm.MAVParmDict().exclude_load)  # counters and states that MAVProxy leaves alone, too
DECIMALS = 6  # of what MAVProxy writes


class FileValue(NamedTuple):
    """A parameter in a file: its value, and by how much a writer may have rounded it."""

    name: str
    value: float
    rounding: float


class Difference(NamedTuple):
    """A parameter whose values differ; None where it is missing."""

    name: str
    in_file: float | None
    in_vehicle: Parameter | None


def text_of(parameter: Parameter) -> str:
    """The value as text: the shortest that reads back as the same value of its type."""
    if is_integer(parameter.type) or not math.isfinite(parameter.value):
        return str(parameter.value)
    return np.format_float_positional(np.float32(parameter.value), trim="0")


def write_file(path: Path, parameters: Iterable[Parameter], vehicle: Vehicle) -> None:
    """Write parameters in the format of the file's ending. Raises GroundError for another ending, OSError."""
    kind = enum_name("MAV_TYPE", vehicle.heartbeat.type)
    stack = enum_name("MAV_AUTOPILOT", vehicle.heartbeat.autopilot)
    if path.suffix in QGROUNDCONTROL:
        lines = [
            f"# Onboard parameters for Vehicle {vehicle.system}",
            "#",
            f"# Stack: {stack}",
            f"# Vehicle: {kind}",
            "#",
            "# Vehicle-Id Component-Id Name Value Type",
            *(f"{vehicle.system}\t{vehicle.component}\t{p.name}\t{text_of(p)}\t{p.type}" for p in parameters),
        ]
    elif path.suffix in MAVPROXY:
        lines = [f"# system {vehicle.system}, {stack}, {kind}", *(f"{p.name:16} {text_of(p)}" for p in parameters)]
    else:
        endings = ", ".join(QGROUNDCONTROL + MAVPROXY)
        raise GroundError(f"{path}: expected a file name that ends with one of {endings}")
    path.write_text("\n".join([*lines, ""]), encoding="utf-8")


def read_file(path: Path) -> list[FileValue]:
    """Read a file of either format, told by its columns. Raises GroundError with the line."""
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise GroundError(f"{path}: cannot be read: {getattr(error, 'strerror', None) or error}") from None
    found: dict[str, FileValue] = {}
    for number, line in enumerate(lines, 1):
        words = line.partition("#")[0].replace(",", " ").split()
        if not words:
            continue
        if len(words) not in (2, 5):
            raise GroundError(
                f"{path}:{number}: expected NAME VALUE, or system, component, NAME, VALUE, type; got {line.strip()!r}"
            )
        name, text = words if len(words) == 2 else words[2:4]
        try:
            value = float(int(text, 16)) if text.lower().startswith("0x") else float(text)
        except ValueError:
            raise GroundError(f"{path}:{number}: {name}: expected a number, got {text!r}") from None
        decimals = len(text.partition(".")[2]) if "e" not in text.lower() else 0
        found[name] = FileValue(name, value, 0.5 * 10.0**-decimals if decimals >= DECIMALS else 0.0)
    return list(found.values())


def is_equal(given: FileValue, parameter: Parameter) -> bool:
    """Whether a file's value is the vehicle's, but for rounding to float and to the file's decimals."""
    if math.isnan(given.value) or math.isnan(parameter.value):
        return math.isnan(given.value) and math.isnan(parameter.value)
    try:
        held = as_type(given.value, parameter.type)
    except ValueError:
        return False
    return held == parameter.value or abs(given.value - parameter.value) <= given.rounding


def compare(given: Iterable[FileValue], parameters: Mapping[str, Parameter]) -> list[Difference]:
    """What differs between a file and a vehicle, by name; what MAVProxy never loads is left out."""
    by_name = {value.name: value for value in given}
    found: list[Difference] = []
    for name in sorted(by_name.keys() | parameters.keys()):
        value, parameter = by_name.get(name), parameters.get(name)
        if name in NOT_LOADED or (value is not None and parameter is not None and is_equal(value, parameter)):
            continue
        found.append(Difference(name, None if value is None else value.value, parameter))
    return found
