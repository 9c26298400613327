"""The page of parameters is what the command prints, and the command prints every parameter."""

import subprocess
import sys
from pathlib import Path

from sitl.flight.parameter_table import DEFINITIONS

PAGE = Path(__file__).parents[3] / "docs" / "parameters.md"


def test_the_page_is_what_is_printed_and_has_every_parameter_in_full() -> None:
    command = [sys.executable, "-m", "sitl.flight"]
    printed = subprocess.run(command, capture_output=True, encoding="utf-8", check=True, timeout=60).stdout
    assert PAGE.read_text(encoding="utf-8") == printed, "print it anew: python -m sitl.flight > docs/parameters.md"
    rows = {line.split("`")[1]: line for line in printed.splitlines() if line.startswith("| `")}
    assert tuple(rows) == tuple(definition.name for definition in DEFINITIONS)
    for definition in DEFINITIONS:
        row = rows[definition.name]
        assert definition.description in row
        assert f"| {definition.default:g} |" in row
        if definition.read_only:
            assert row.endswith(("| a fact | |", f"| a fact | {definition.unit} |"))
        elif definition.values is None:
            assert f"| {definition.minimum:g} to {definition.maximum:g} |" in row
        else:
            assert all(f"<br>{number}: {meaning}" in row for number, meaning in definition.values.items())
