"""TOML files that people write: read as a typed table, or refused in one line that names the key."""

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TypeVar

import msgspec

__all__ = ["LARGEST", "TableError", "numbers", "read_table", "typed"]

LARGEST = 1e6  # of any value in its unit [m, m/s, deg/s, rpm]: far from where the equations overflow

Kind = TypeVar("Kind", bound=msgspec.Struct)


class TableError(ValueError):
    """What a file says is no use; the text is one line, "KEY: expected ..., got ..."."""


def read_table(path: Path) -> dict[str, Any]:
    """The file's table. Raises TableError if it cannot be read as TOML."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise TableError(f"cannot be read as TOML: {error}") from None


def typed(table: dict[str, Any], kind: type[Kind]) -> Kind:
    """The table as a struct. Raises TableError for an unknown key, a wrong type or a number that is no quantity."""
    _known(table, msgspec.inspect.type_info(kind), "")
    for key, value in numbers(table):
        if not abs(value) <= LARGEST:
            got = value if isinstance(value, float) else "more"
            raise TableError(f"{key}: expected a number within +-{LARGEST:g}, got {got}")
    try:
        return msgspec.convert(table, kind)
    except msgspec.ValidationError as error:
        problem, _, place = str(error).partition(" - at `$.")
        place = place.rstrip("`")
        if problem.startswith("Object missing required field"):
            key = problem.split("`")[1]
            raise TableError(f"{place}.{key}: expected this key, got none" if place else f"{key}: missing") from None
        raise TableError(f"{place}: {problem[:1].lower()}{problem[1:]}") from None


def numbers(value: object, place: str = "") -> Iterator[tuple[str, float]]:
    """The numbers in a table by their place, such as `tilt_deg`, `throttle[2]` or `wind.gusts[0].length`."""
    if isinstance(value, int | float):
        yield place, value
    elif isinstance(value, dict):
        for key, item in value.items():
            yield from numbers(item, f"{place}.{key}" if place else str(key))
    elif isinstance(value, list | tuple):
        for index, item in enumerate(value):
            yield from numbers(item, f"{place}[{index}]")


def _known(value: object, kind: msgspec.inspect.Type, place: str) -> None:
    """Raise TableError for the first key that its struct does not have."""
    if isinstance(kind, msgspec.inspect.StructType) and isinstance(value, dict):
        fields = {field.name: field.type for field in kind.fields}
        for key, item in value.items():
            here = f"{place}.{key}" if place else str(key)
            if key not in fields:
                raise TableError(f"{here}: unknown key, expected one of {', '.join(fields)}")
            _known(item, fields[key], here)
    elif isinstance(kind, msgspec.inspect.VarTupleType) and isinstance(value, list):
        for index, item in enumerate(value):
            _known(item, kind.item_type, f"{place}[{index}]")
