"""The flight's parameters while it flies: read by name, set within their ranges, with word to who depends on them."""

import difflib
import math
import struct
from collections.abc import Callable, Mapping

from sitl.flight.parameter_table import DEFINITIONS, Definition

__all__ = ["Definition", "Parameters"]

_SINGLE = struct.Struct("<f")
_DIGITS_OF_SINGLE = range(6, 10)  # nine tell any two numbers of single precision apart


class Parameters:
    """Values by name, in the unit of their definition; "int" parameters are int, the others float.

    Attributes:
        definitions: all parameters there are, by name.
        on_change: called with a parameter's name after its value has become another one.
    """

    definitions: tuple[Definition, ...] = DEFINITIONS

    def __init__(self, values: Mapping[str, float] | None = None) -> None:
        """Begin with the defaults and `values`, as `load` does."""
        self.on_change: list[Callable[[str], None]] = []
        self._definitions = {definition.name: definition for definition in self.definitions}
        self._values = {definition.name: _as_kind(definition, definition.default) for definition in self.definitions}
        if values is not None:
            self.load(values)

    def __getitem__(self, name: str) -> float:
        """The value of a parameter; raises KeyError if there is none of this name."""
        return self._values[name]

    def __contains__(self, name: str) -> bool:
        return name in self._values

    def names(self) -> tuple[str, ...]:
        """All names, sorted: the order in which MAVLink counts them."""
        return tuple(self._values)

    def definition(self, name: str) -> Definition:
        """What is known of a parameter; raises ValueError with similar names if there is none of this name."""
        definition = self._definitions.get(name)
        if definition is None:
            similar = difflib.get_close_matches(name.upper(), self._definitions, n=3)
            msg = f"{name}: unknown parameter, expected {' or '.join(similar) or 'one of the listed names'}"
            raise ValueError(msg)
        return definition

    def set(self, name: str, value: float) -> None:
        """Set a parameter.

        A value that has been in single precision, as MAVLink carries them, becomes the decimal number it stands for.

        Raises ValueError, and changes nothing, if there is no such parameter, it is a fact with another value, or the
        value is not within its range or not one of its choices: "NAME: expected RANGE, got VALUE".
        """
        self.load({name: value})

    def load(self, mapping: Mapping[str, float]) -> None:
        """Set all of these parameters, or none: raises ValueError as `set` does for the first that will not do."""
        checked = {name: _checked(self.definition(name), value) for name, value in mapping.items()}
        changed = [name for name, value in checked.items() if value != self._values[name]]
        self._values.update(checked)
        for name in changed:
            for listener in self.on_change:
                listener(name)


def _checked(definition: Definition, value: object) -> float:
    """The value as its parameter keeps it; raises ValueError."""
    if isinstance(value, int | float) and math.isfinite(value):
        if definition.kind == "int":
            good = value == round(value) and _in_range(definition, value)
        else:
            value = _decimal(value)
            good = _in_range(definition, value)
        if good:
            return _as_kind(definition, value)
    msg = f"{definition.name}: expected {_range(definition)}, got {value!r}"
    raise ValueError(msg)


def _in_range(definition: Definition, value: float) -> bool:
    if definition.values is not None:
        return value in definition.values
    return definition.minimum <= value <= definition.maximum


def _decimal(value: float) -> float:
    """The shortest decimal number of a value that is one of single precision; any other value as it is.

    So 0.2 stays 0.2 on its way over MAVLink, limits stay within their ranges, and it does not matter for the flight who
    has set a parameter.
    """
    if abs(value) > _LARGEST_SINGLE or _single(value) != value:
        return value
    decimals = (float(f"{value:.{digits}g}") for digits in _DIGITS_OF_SINGLE)
    return next(decimal for decimal in decimals if _single(decimal) == value)


def _single(value: float) -> float:
    return _SINGLE.unpack(_SINGLE.pack(value))[0]


_LARGEST_SINGLE: float = _SINGLE.unpack(b"\xff\xff\x7f\x7f")[0]


def _as_kind(definition: Definition, value: float) -> float:
    return int(value) if definition.kind == "int" else float(value)


def _range(definition: Definition) -> str:
    if definition.values is not None:
        return ", ".join(f"{number} ({meaning})" for number, meaning in definition.values.items())
    unit = f" {definition.unit}" if definition.unit not in {"", "1"} else ""
    if definition.read_only:
        return f"{definition.default:g}{unit}, which cannot be set"
    whole = "a whole number " if definition.kind == "int" else ""
    return f"{whole}{definition.minimum:g} to {definition.maximum:g}{unit}"
