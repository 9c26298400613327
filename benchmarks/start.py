"""From the command to the first HEARTBEAT, with the numeric core compiled before."""

import statistics

from figures import Figure
from vehicle import HEARTBEAT, Vehicle

__all__ = ["measure"]

STARTS = 7


def measure() -> list[Figure]:
    """Median and worst of a few starts, after one that is not counted and may compile."""
    delays: list[float] = []
    for _ in range(STARTS + 1):
        with Vehicle("--at=trim:30") as vehicle:
            arrival, _, _ = next(vehicle.messages(HEARTBEAT))
            delays.append(arrival - vehicle.started)
    counted = delays[1:]
    return [
        Figure("start to first HEARTBEAT, median", statistics.median(counted), "s", goal=1.5, at_most=True),
        Figure("start to first HEARTBEAT, worst", max(counted), "s", at_most=True),
    ]
