"""Metadata of the flight's parameters: what each means, its unit, range and choices.

https://github.com/mavlink/mavlink/blob/master/component_metadata/parameter.schema.json.
"""

from typing import Any, Final

from sitl.flight.parameter_table import DEFINITIONS, Definition

__all__ = ["parameter_metadata"]

VERSION: Final = 3  # of the schema
TYPES: Final = {"int": "Int32", "float": "Float"}
UNITS: Final = {"1": "norm"}  # units that the schema knows by another name
MOST_DECIMALS: Final = 3


def parameter_metadata() -> dict[str, Any]:
    """What is known of all parameters: parameters.json."""
    return {"version": VERSION, "parameters": [_entry(definition) for definition in DEFINITIONS]}


def _entry(definition: Definition) -> dict[str, Any]:
    is_int = definition.kind == "int"
    entry: dict[str, Any] = {
        "name": definition.name,
        "type": TYPES[definition.kind],
        "shortDesc": definition.description,
        "group": definition.group,
        "default": _number(definition.default),
        "min": _number(definition.minimum),
        "max": _number(definition.maximum),
    }
    if definition.unit:
        entry["units"] = UNITS.get(definition.unit, definition.unit)
    if not is_int:
        entry["decimalPlaces"] = max(
            1, *(_decimals(value) for value in (definition.default, definition.minimum, definition.maximum))
        )
    if definition.values is not None:
        entry["values"] = [{"value": value, "description": text} for value, text in definition.values.items()]
    if definition.bits is not None:
        entry["bitmask"] = [{"index": index, "description": text} for index, text in definition.bits.items()]
    if definition.reboot_required:
        entry["rebootRequired"] = True
    if definition.read_only:
        entry["readOnly"] = True
    return entry


def _number(value: float) -> float:
    return int(value) if value == int(value) else value


def _decimals(value: float) -> int:
    """Digits after the point that it takes to write a number."""
    return next((digits for digits in range(MOST_DECIMALS) if round(value, digits) == value), MOST_DECIMALS)
