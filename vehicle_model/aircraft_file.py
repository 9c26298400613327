"""Aircraft files on disk: read with errors that name the line, and rewritten value by value.

Every number is `name = { value = .., unit = "..", source = ".." }`; a `source` of a table covers the numbers in it.
"""

import json
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from vehicle_model.aircraft_checks import check_consistency
from vehicle_model.aircraft_schema import SchemaError, decode, element_index, replace
from vehicle_model.aircraft_tables import AircraftTables
from vehicle_model.toml_lines import Keys, blank_texts, entry_lines, line_of
from vehicle_model.units import UNITS

__all__ = ["AircraftFileError", "read_tables", "write_values"]


class AircraftFileError(ValueError):
    """An aircraft file cannot be used. One line: `FILE:LINE: entry: what was expected, what was found`."""


def read_tables(path: Path) -> AircraftTables:
    """Read and check an aircraft file; raises AircraftFileError."""
    return _parse(_read(path), path)


def write_values(path: Path | str, values: Mapping[str, Any], source: str, *, digits: int = 7) -> None:
    """Put values (SI, by dotted path as in `Aircraft.with_values`) and their source into an aircraft file in place.

    Only the numbers and their `source` change; unit, layout and comments stay. Numbers are written with `digits`
    significant digits in the unit of the file. The file is left alone if the result would not be a valid aircraft.
    Raises AircraftFileError; ValueError if `source` is empty.
    """
    if not source.strip():
        raise ValueError("expected a source that says where the values are from, got an empty text")
    path = Path(path)
    text = _read(path)
    tables = _parse(text, path)
    places = entry_lines(text)
    lines = text.split("\n")
    changed: dict[Keys, Any] = {}
    for dotted, value in values.items():
        try:
            tables = replace(tables, dotted.split("."), value)
            keys = _keys(tables, dotted.split("."))
        except SchemaError as error:
            raise AircraftFileError(f"{path}: {error}") from None
        changed[keys] = _value_at(tables, keys)
    document = tomllib.loads(text)
    for keys, value in changed.items():
        number = places.get(keys)
        line = None if number is None else _rewritten(lines[number - 1], _raw_at(document, keys), value, source, digits)
        if number is None or line is None:
            place = f"{path}:{line_of(places, keys)}: {'.'.join(map(str, keys))}"
            raise AircraftFileError(f'{place}: expected {{ value = .., unit = ".." }} on one line, to write into')
        lines[number - 1] = line
    text = "\n".join(lines)
    _parse(text, path)
    path.write_bytes(text.encode())


def _read(path: Path) -> str:
    try:
        return path.read_bytes().decode()
    except UnicodeDecodeError as error:
        line = error.object[: error.start].count(b"\n") + 1
        found = f"got byte 0x{error.object[error.start]:02x}"
        raise AircraftFileError(f"{path}:{line}: expected UTF-8 text, {found}") from None
    except OSError as error:
        raise AircraftFileError(f"{path}: cannot be read: {error.strerror}") from None


def _parse(text: str, path: Path) -> AircraftTables:
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        found = re.search(r" \(at line (\d+), column \d+\)", str(error))
        line = int(found[1]) if found else text.count("\n") + 1
        reason = str(error).replace(found[0], "") if found else str(error).replace(" (at end of document)", "")
        raise AircraftFileError(f"{path}:{line}: not valid TOML: {reason}") from None
    try:
        tables = decode(AircraftTables, document)
        check_consistency(tables)
    except SchemaError as error:
        raise AircraftFileError(f"{path}:{line_of(entry_lines(text), error.keys)}: {error}") from None
    return tables


def _keys(tables: AircraftTables, path: list[str]) -> Keys:
    """Where in the file the value at a valid dotted path stands; for a component of a vector, the vector."""
    keys: Keys = ()
    at: Any = tables
    for name in path:
        if not isinstance(at, tuple):
            keys, at = (*keys, name), getattr(at, name)
        elif not isinstance(at[0], float):
            index = element_index(at, name, keys)
            keys, at = (*keys, index), at[index]
    return keys


def _value_at(tables: AircraftTables, keys: Keys) -> Any:
    at: Any = tables
    for key in keys:
        at = at[key] if isinstance(key, int) else getattr(at, key)
    return at


def _raw_at(document: dict[str, Any], keys: Keys) -> Any:
    at: Any = document
    for key in keys:
        at = at[key]
    return at


def _rewritten(line: str, raw: Any, value: Any, source: str, digits: int) -> str | None:
    """The line of an entry with a new value and source, columns kept if wide enough; None if it has no value."""
    if not isinstance(raw, dict):  # a choice, a flag or a text: no number, so no source
        return _with_text(line, value)
    found = re.search(r"\bvalue\s*=\s*(\[[^\]]*\]|[^\s,}]+)(\s*,\s*|\s*)", blank_texts(line))
    close = blank_texts(line).rfind("}")
    if found is None or close < 0:
        return None
    factor = UNITS[raw["unit"]].factor
    if isinstance(value, tuple):
        new = f"[{', '.join(_number(item / factor, digits) for item in value)}]"
    else:
        new = str(value) if isinstance(value, int) else _number(value / factor, digits)
    gap = found[2]
    if gap.strip():
        spare = len(found[1]) + len(gap) - len(new) - 1
        gap = "," + " " * max(spare, 1)
    line = line[: found.start(1)] + new + gap + line[found.end(2) :]
    return _with_source(line, source)


def _with_source(line: str, source: str) -> str:
    text = json.dumps(source, ensure_ascii=False)  # a TOML basic string has JSON's escapes
    blanked = blank_texts(line)
    found = re.search(r"\bsource\s*=\s*(~+)", blanked)
    if found:
        return line[: found.start(1)] + text + line[found.end(1) :]
    close = blanked.rfind("}")
    return f"{line[:close].rstrip()}, source = {text} {line[close:]}"


def _with_text(line: str, value: Any) -> str | None:
    new = json.dumps(value, ensure_ascii=False)
    found = re.match(r"""([^=]*=\s*)("(?:\\.|[^"\\])*"|'[^']*'|true|false)""", line)
    return None if found is None else line[: found.start(2)] + new + line[found.end(2) :]


def _number(value: float, digits: int) -> str:
    text = f"{value:.{digits}g}"
    return text if any(mark in text for mark in ".e") else f"{text}.0"
