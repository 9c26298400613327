"""A simulation with its flight log."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from sitl import Simulation
from sitl.flight_log.flight_log import FlightLog


@pytest.fixture
def logged(tmp_path: Path) -> Iterator[Callable[..., tuple[Simulation, FlightLog]]]:
    """Makes a simulation and its log; the log is closed at the end."""
    made: list[FlightLog] = []

    def make(rate: int = 10, **options: Any) -> tuple[Simulation, FlightLog]:
        simulation = Simulation(**options)
        made.append(FlightLog(simulation, tmp_path / "logs", rate=rate, unix_epoch=1.8e9, system=7))
        return simulation, made[-1]

    yield make
    for log in made:
        log.close()
