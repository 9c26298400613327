"""Compiles the vehicle ahead of time and designs its laws, so that it starts in a second: `python -m sitl.warm`.

The numeric core comes first (`vehicle_model.warm`). Then a flight of a few ticks with everything on board compiles the
rest, for the types of arguments that a flight has.
"""

import sys
import time
from collections.abc import Callable
from pathlib import Path

from sitl.flight_log.flight_log import FlightLog
from sitl.simulation import Simulation
from vehicle_model import warm
from vehicle_model.compiled import WARM_MARK, cache_folder, is_warm

__all__ = ["main", "warm_up"]

FOLDER = cache_folder(Path(__file__).parent)


def warm_up(report: Callable[[str], None] | None = None) -> None:
    """Compile what flies into the cache and mark it complete; at once when that was done before.

    `report` is given a line before each stage, for a person who waits.
    """
    warm.warm_up(report)
    if is_warm(FOLDER):
        return
    if report:
        report("compiling for this machine, once: the control laws, and designing them for the aircraft")
    for autopilot in (True, False):
        simulation = Simulation(autopilot=autopilot)
        FlightLog(simulation, Path("logs")).close()
        simulation.record()
        simulation.advance(0.1)
        simulation.snapshot()
    if FOLDER is not None:
        (FOLDER / WARM_MARK).touch()


def main() -> None:
    """Warm the cache, saying so on standard error when it takes a while."""
    begin = time.perf_counter()
    if not is_warm(FOLDER):
        warm_up(lambda line: print(line, file=sys.stderr, flush=True))
        print(f"compiled in {time.perf_counter() - begin:.0f} s into {FOLDER}", file=sys.stderr)


if __name__ == "__main__":
    main()
