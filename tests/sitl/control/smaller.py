"""An aircraft file of a smaller tilt-wing: the paper's aircraft in all its proportions, but the servos of a store.

Froude's scaling, as of model aircraft that fly alike: lengths by s, masses by s^3, times by sqrt(s). What comes in no
other size stays as it is: time constants of servos and sensors, cells of batteries.
"""

import re
from pathlib import Path

from vehicle_model.aircraft import load_aircraft

__all__ = ["write_smaller"]

# Powers of s by unit.
POWERS = {
    "m": 1.0, "m^2": 2.0, "kg": 3.0, "kg m^2": 5.0, "N/m": 2.0, "N s/m": 2.5, "rad/s^2": -1.0, "rpm/V": -0.5,
    "W": 3.5, "A": 3.5, "A h": 4.0, "ohm": -3.5, "mohm": -3.5,
}  # fmt: skip
ENTRY = re.compile(r'value = (?P<value>\[[^]]*\]|[^,\s]+),(?P<space>\s*)unit = "(?P<unit>[^"]*)"')


def write_smaller(file: Path, size: float, mass_share: float = 1.0) -> None:
    """Write the aircraft file with all lengths times `size`, and masses and inertias times `mass_share` besides."""

    def scaled(entry: re.Match[str]) -> str:
        factor = size ** POWERS.get(entry["unit"], 0.0) * (mass_share if entry["unit"].startswith("kg") else 1.0)
        numbers = re.sub(r"-?\d[\d.e+-]*", lambda number: repr(float(number[0]) * factor), entry["value"])
        return f'value = {numbers},{entry["space"]}unit = "{entry["unit"]}"'

    source = load_aircraft().source_file.read_text(encoding="utf-8")
    file.write_text(ENTRY.sub(scaled, source), encoding="utf-8")
