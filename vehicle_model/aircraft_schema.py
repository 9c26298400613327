"""What the entries of an aircraft file may be: kinds of entry, how each is read from TOML and checked in SI.

The tables of the file are msgspec structs whose fields are annotated with a `Quantity`; `fields_of` turns those
annotations into the kinds below, `decode` reads parsed TOML by them and `replace` exchanges single values.
"""

from collections.abc import Sequence
from functools import cache
from typing import Annotated, Any, Literal, NamedTuple, Protocol, TypeVar, get_args, get_origin, get_type_hints

import msgspec

from vehicle_model.toml_lines import Keys
from vehicle_model.units import UNITS

__all__ = ["Field", "Quantity", "SchemaError", "decode", "element_index", "fields_of", "replace"]

_Table = TypeVar("_Table", bound=msgspec.Struct)


class SchemaError(ValueError):
    """An entry is not what it must be; `keys` says where it stands."""

    def __init__(self, keys: Keys, text: str) -> None:
        self.keys = keys
        super().__init__(f"{'.'.join(map(str, keys))}: {text}" if keys else text)


class Quantity(NamedTuple):
    """A number with a dimension: the unit its plausible range is given in, and that range."""

    unit: str
    minimum: float
    maximum: float


class Field(Protocol):
    """One kind of entry."""

    @property
    def expected(self) -> str:
        """What the entry must be, as a noun phrase."""
        ...

    def read(self, raw: object, keys: Keys, source: str | None) -> Any:
        """Typed SI value of the entry `raw` as TOML gives it; `source` is the one its tables state."""
        ...

    def check(self, value: Any, keys: Keys) -> Any:
        """The typed SI value itself if it is plausible, else SchemaError."""
        ...


def _is_number(value: object) -> bool:
    return not isinstance(value, bool) and isinstance(value, int | float)


def _written(value: object, unit: object = "") -> str:
    """A value as a person would write it back."""
    if isinstance(value, str):
        text = f'"{value}"'
    elif isinstance(value, bool):
        text = str(value).lower()
    elif isinstance(value, float):
        text = f"{value:.7g}"
    elif isinstance(value, list | tuple):
        text = f"[{', '.join(_written(item) for item in value)}]"
    elif isinstance(value, dict):
        text = "a table"
    else:
        text = str(value)
    return text if unit in {"", "1"} else f"{text} {unit}"


class _Number(NamedTuple):
    quantity: Quantity
    whole: bool = False  # a count

    @property
    def expected(self) -> str:
        unit, low, high = self.quantity
        noun = "a whole number" if self.whole else UNITS[unit].dimension
        return f"{noun}{'' if unit == '1' else f' in {unit}'} between {low:g} and {high:g}"

    def read(self, raw: object, keys: Keys, source: str | None) -> float | int:
        value, unit = _value_and_unit(self, raw, keys, source)
        if unit not in UNITS or UNITS[unit].dimension != UNITS[self.quantity.unit].dimension or not _is_number(value):
            raise SchemaError(keys, f"expected {self.expected}, got {_written(value, unit)}")
        return self._limited(value if self.whole else value * UNITS[unit].factor, keys, _written(value, unit))

    def check(self, value: Any, keys: Keys) -> float | int:
        if not _is_number(value):
            value = _plain(value, self, keys)
        return self._limited(value, keys, None)

    def _limited(self, value: float, keys: Keys, written: str | None) -> float | int:
        unit, low, high = self.quantity
        factor = UNITS[unit].factor
        if low * factor <= value <= high * factor and (not self.whole or value == int(value)):  # never true for NaN
            return int(value) if self.whole else float(value)
        raise SchemaError(keys, f"expected {self.expected}, got {written or _written(value / factor, unit)}")


class _Vector(NamedTuple):
    component: _Number

    @property
    def expected(self) -> str:
        return f"[x, y, z], each {self.component.expected}"

    def read(self, raw: object, keys: Keys, source: str | None) -> tuple[float, float, float]:
        value, unit = _value_and_unit(self, raw, keys, source)
        mine = UNITS[self.component.quantity.unit].dimension
        known = unit in UNITS and UNITS[unit].dimension == mine
        if not (known and isinstance(value, list) and len(value) == 3 and all(map(_is_number, value))):
            raise SchemaError(keys, f"expected {self.expected}, got {_written(value, unit)}")
        return self.check([item * UNITS[unit].factor for item in value], keys)

    def check(self, value: Any, keys: Keys) -> tuple[float, float, float]:
        if not hasattr(value, "__len__") or len(value) != 3:
            raise SchemaError(keys, f"expected {self.expected}, got {_written(value)}")
        x, y, z = (self.component.check(item, keys) for item in value)
        return x, y, z


class _Choice(NamedTuple):
    choices: tuple[str, ...]

    @property
    def expected(self) -> str:
        return " or ".join(_written(choice) for choice in self.choices)

    def read(self, raw: object, keys: Keys, source: str | None) -> str:
        del source  # a choice is not a number
        return self.check(raw, keys)

    def check(self, value: Any, keys: Keys) -> str:
        if not isinstance(value, str) or value not in self.choices:
            raise SchemaError(keys, f"expected {self.expected}, got {_written(value)}")
        return value


class _Plain(NamedTuple):
    kind: type
    expected: str

    def read(self, raw: object, keys: Keys, source: str | None) -> Any:
        del source  # neither a text nor a flag is a number
        return self.check(raw, keys)

    def check(self, value: Any, keys: Keys) -> Any:
        if not isinstance(value, self.kind) or value == "":
            raise SchemaError(keys, f"expected {self.expected}, got {_written(value)}")
        return value


class _SubTable(NamedTuple):
    table: type[msgspec.Struct]
    expected: str = "a table"

    def read(self, raw: object, keys: Keys, source: str | None) -> Any:
        if not isinstance(raw, dict):
            raise SchemaError(keys, f"expected {self.expected}, got {_written(raw)}")
        return decode(self.table, raw, keys, source)

    def check(self, value: Any, keys: Keys) -> Any:
        del value  # tables are not replaced as a whole
        raise SchemaError(keys, f"expected the name of a value in this table, one of {_names(self.table)}")


class _Tables(NamedTuple):
    table: type[msgspec.Struct]
    expected: str = "an array of tables"

    def read(self, raw: object, keys: Keys, source: str | None) -> Any:
        if not isinstance(raw, list) or not raw or not all(isinstance(item, dict) for item in raw):
            raise SchemaError(keys, f"expected {self.expected}, got {_written(raw)}")
        return tuple(decode(self.table, item, (*keys, index), source) for index, item in enumerate(raw))

    def check(self, value: Any, keys: Keys) -> Any:
        del value
        raise SchemaError(keys, "expected the name or index of one of these tables")


def _plain(value: Any, field: _Number, keys: Keys) -> float:
    """A plain float from anything that behaves as one number (numpy scalars do)."""
    if hasattr(value, "__float__") and not isinstance(value, bool):
        try:
            return float(value)
        except (TypeError, ValueError):  # an array of several numbers
            pass
    raise SchemaError(keys, f"expected {field.expected}, got {_written(value)}")


def _value_and_unit(field: Field, raw: object, keys: Keys, source: str | None) -> tuple[Any, str]:
    """Value and unit of `{ value = .., unit = "..", source = ".." }`, after making sure that it has a source."""
    if not isinstance(raw, dict):
        raise SchemaError(keys, f'expected {{ value = .., unit = ".." }} with {field.expected}, got {_written(raw)}')
    for key in raw:
        if key not in {"value", "unit", "source"}:
            raise SchemaError((*keys, key), f"no such key{_suggestion(key, ('value', 'unit', 'source'))}")
    for key in ("value", "unit"):
        if key not in raw:
            raise SchemaError(keys, f"{key} is missing; expected {field.expected}")
    if not isinstance(raw["unit"], str):
        raise SchemaError(keys, f"expected a unit such as {_written(_unit_of(field))}, got {_written(raw['unit'])}")
    if _source(raw, keys, source) is None:
        raise SchemaError(keys, "source is missing; give one here or in its table")
    return raw["value"], raw["unit"]


def _unit_of(field: Field) -> str:
    """The unit in which the range of a number or vector is given."""
    number = field.component if isinstance(field, _Vector) else field
    return number.quantity.unit if isinstance(number, _Number) else "1"


def _source(table: dict[str, Any], keys: Keys, inherited: str | None) -> str | None:
    source = table.get("source", inherited)
    if source is not None and (not isinstance(source, str) or not source.strip()):
        expected = "expected a text that says where the numbers are from"
        raise SchemaError((*keys, "source"), f"{expected}, got {_written(source)}")
    return source


def _names(table: type[msgspec.Struct]) -> str:
    return ", ".join(fields_of(table))


def _suggestion(name: str, known: Sequence[str]) -> str:
    """End of a message about an unknown name: the nearest known one, or all of them."""
    from difflib import get_close_matches  # only needed once something is wrong

    near = get_close_matches(name, known, 1)
    return f'; did you mean "{near[0]}"?' if near else f"; expected one of {', '.join(known)}"


def _field(hint: Any) -> Field:
    origin, arguments = get_origin(hint), get_args(hint)
    if origin is Annotated:
        kind, quantity = arguments
        number = _Number(quantity, whole=kind is int)
        return _Vector(number) if get_origin(kind) is tuple else number
    if origin is Literal:
        return _Choice(arguments)
    if origin is tuple:
        return _Tables(arguments[0])
    if hint is bool:
        return _Plain(bool, "true or false")
    if hint is str:
        return _Plain(str, "a text")
    return _SubTable(hint)


@cache
def fields_of(table: type[msgspec.Struct]) -> dict[str, Field]:
    """Kind of each entry of a table, by name, in the order of its struct."""
    return {name: _field(hint) for name, hint in get_type_hints(table, include_extras=True).items() if name[0] != "_"}


def decode(table: type[_Table], raw: dict[str, Any], keys: Keys = (), source: str | None = None) -> _Table:
    """A table from parsed TOML. Every entry must be there, nothing else may be, and every number needs a source.

    A `source` in a table covers its numbers and those of the tables below it. Raises SchemaError.
    """
    fields = fields_of(table)
    source = _source(raw, keys, source)
    for key in raw:
        if key not in fields and key != "source":
            raise SchemaError((*keys, key), f"no such key{_suggestion(key, tuple(fields))}")
    for name, field in fields.items():
        if name not in raw:
            raise SchemaError((*keys, name), f"missing; expected {field.expected}")
    return table(**{name: field.read(raw[name], (*keys, name), source) for name, field in fields.items()})


def replace(table: _Table, path: Sequence[str], value: Any, keys: Keys = ()) -> _Table:
    """The table with the entry at `path` replaced by `value` in SI; SchemaError if that is not plausible.

    In an array of tables an element is named by its first entry or by its index, in a vector by x, y or z.
    """
    name, rest = path[0], path[1:]
    field = fields_of(type(table)).get(name)
    keys = (*keys, name)
    if field is None:
        raise SchemaError(keys, f"no such value{_suggestion(name, tuple(fields_of(type(table))))}")
    old = getattr(table, name)
    if not rest:
        new = field.check(value, keys)
    elif isinstance(field, _SubTable):
        new = replace(old, rest, value, keys)
    elif isinstance(field, _Tables) and len(rest) > 1:
        index = element_index(old, rest[0], (*keys, rest[0]))
        new = (*old[:index], replace(old[index], rest[1:], value, (*keys, rest[0])), *old[index + 1 :])
    elif isinstance(field, _Vector) and len(rest) == 1 and rest[0] in {"x", "y", "z"}:
        index = "xyz".index(rest[0])
        new = (*old[:index], field.component.check(value, (*keys, rest[0])), *old[index + 1 :])
    else:
        raise SchemaError((*keys, *rest), "no such value")
    return msgspec.structs.replace(table, **{name: new})


def element_index(elements: Sequence[Any], name: str, keys: Keys) -> int:
    """Index of the table that `name` means: its first entry (a name), or its index in digits."""
    names = [str(getattr(item, item.__struct_fields__[0])) for item in elements]
    if name in names:
        return names.index(name)
    if name.isdecimal() and int(name) < len(elements):
        return int(name)
    raise SchemaError(keys, f"no such table{_suggestion(name, names)}")
