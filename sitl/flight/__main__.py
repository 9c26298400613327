"""`python -m sitl.flight` prints the page of all parameters, docs/parameters.md."""

import sys

from sitl.flight.parameter_table import DEFINITIONS, Definition

__all__ = ["page"]

HEAD = """\
# Parameters

Every parameter of the flight controller, as `python -m sitl.flight` prints them from
[parameter_table.py](../sitl/flight/parameter_table.py). Where the name is PX4's, meaning, unit and choices are PX4's,
too; ranges and defaults are those of this aircraft. `TW_` begins what PX4 has no name for.

Set them on the command line (`--param NAME=VALUE`, `--params FILE` with a file of QGroundControl's or MAVProxy's), in a
scenario (`[parameters]`, or `do = "parameter NAME VALUE"` in flight), as an argument
(`Simulation(parameters={"NAME": VALUE})`), in flight (`flight.parameters.set("NAME", VALUE)`), or from any ground
station. The command line goes before the scenario, this before what `--state` has kept, and this before the default. A
value out of its range is refused with the range, an unknown name with similar ones. A fact cannot be set; ground
stations look it up. What each does is in [flight.md](flight.md).

| name | meaning | default | range | unit |
| --- | --- | --- | --- | --- |
"""


def page() -> str:
    """The page as Markdown: a row for each parameter, by name; choices stand under the meaning with their numbers."""
    return HEAD + "".join(_row(definition) for definition in DEFINITIONS)


def _row(definition: Definition) -> str:
    meaning, range_ = definition.description, f"{definition.minimum:g} to {definition.maximum:g}"
    if definition.reboot_required:
        meaning += "; in force when the vehicle begins anew"
    if definition.values is not None:
        meaning += "".join(f"<br>{number}: {choice}" for number, choice in definition.values.items())
        range_ = ", ".join(map(str, definition.values))
    if definition.bits is not None:
        meaning += "".join(f"<br>{1 << bit}: {choice}" for bit, choice in definition.bits.items())
    if definition.read_only:
        range_ = "a fact"
    unit = "share" if definition.unit == "1" else definition.unit
    return f"| `{definition.name}` | {meaning} | {definition.default:g} | {range_} | {unit} |\n"


if __name__ == "__main__":
    sys.stdout.write(page())
