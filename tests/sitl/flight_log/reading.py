"""Flights short enough for tests, and their logs as pyulog reads them."""

import io
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from pyulog import ULog

from sitl import Simulation
from sitl.flight.mode import Mode
from sitl.flight_log.flight_log import FlightLog


def hop(simulation: Simulation) -> None:
    """Take off a little and land."""
    simulation.flight.takeoff(3.0)
    simulation.flight.arm()
    assert simulation.run_until(lambda s: s.flight.mode == Mode.HOLD and s.flight.flying, 60.0)
    simulation.flight.land()
    assert simulation.run_until(lambda s: not s.flight.armed, 60.0)


def poll(condition: Callable[[], object]) -> None:
    """Wait for the writer of logs, which is a thread."""
    end = time.monotonic() + 10.0
    while not condition():
        assert time.monotonic() < end, "the condition never came true"


def texts_of(simulation: Simulation) -> list[str]:
    heard: list[str] = []
    simulation.listener = lambda _, text: heard.append(text)
    return heard


def roll_pitch_yaw(q: np.ndarray) -> np.ndarray:
    """Euler angles [rad] of quaternions (n, 4), scalar first."""
    w, x, y, z = q.T
    return np.stack([
        np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
        np.arcsin(2 * (w * y - z * x)),
        np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
    ]).T  # fmt: skip


def array_of(topic: dict[str, np.ndarray], name: str, count: int) -> np.ndarray:
    return np.stack([topic[f"{name}[{i}]"] for i in range(count)]).T


def ulog(path: Path | bytes) -> ULog:
    log = ULog(io.BytesIO(path) if isinstance(path, bytes) else str(path))
    assert not log.file_corruption
    return log


def only_log(log: FlightLog) -> ULog:
    log.close()
    (file,) = log.folder.logs()
    return ulog(file.path)
