"""Runs the benchmarks and prints their figures: `make bench`, or `python benchmarks/run.py step --json FILE`."""

import argparse
import importlib
import json
import platform
import sys
from pathlib import Path

from figures import Figure, as_text, to_json

# Each is a module beside this one with a function measure() -> list[Figure].
BENCHMARKS = ("step", "fly", "realtime", "lockstep", "fast", "start", "ftp", "log_download", "mavlink")


def main() -> int:
    """Run what was asked for; exit code 1 when a goal was missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"which ones: {', '.join(BENCHMARKS)}; default all")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the figures there")
    options = parser.parse_args()
    for name in options.names:
        if name not in BENCHMARKS:
            parser.error(f"no benchmark {name!r}; expected {', '.join(BENCHMARKS)}")

    figures: list[Figure] = []
    for name in options.names or BENCHMARKS:
        print(f"{name}:")
        for figure in importlib.import_module(name).measure():
            print(f"  {as_text(figure)}", flush=True)
            figures.append(figure)
    if options.json:
        machine = {"machine": platform.machine(), "system": platform.system(), "python": platform.python_version()}
        options.json.write_text(json.dumps({**machine, "figures": [to_json(f) for f in figures]}, indent=2) + "\n")
    return int(any(figure.met is False for figure in figures))


if __name__ == "__main__":
    sys.exit(main())
