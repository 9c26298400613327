"""Levels of MIL-F-8785C for the natural modes, flight phase categories A, B and C, class I aircraft.

Written for manned aircraft: reported, not asked of a small unmanned one. Level 4 stands for worse than Level 3.
"""

import math
from typing import Literal

from vehicle_model.linearise import Mode

__all__ = ["CATEGORIES", "Category", "level"]

Category = Literal["A", "B", "C"]
CATEGORIES: tuple[Category, ...] = ("A", "B", "C")

_SHORT_PERIOD = {  # damping: lowest and highest of Levels 1 and 2, lowest of Level 3
    "A": ((0.35, 1.30), (0.25, 2.00), (0.15, math.inf)),
    "B": ((0.30, 2.00), (0.20, 2.00), (0.15, math.inf)),
    "C": ((0.35, 1.30), (0.25, 2.00), (0.15, math.inf)),
}
_DUTCH_ROLL = {  # least damping, damping times frequency [rad/s], frequency [rad/s]
    "A": ((0.19, 0.35, 1.0), (0.02, 0.05, 0.4), (0.0, -math.inf, 0.4)),
    "B": ((0.08, 0.15, 0.4), (0.02, 0.05, 0.4), (0.0, -math.inf, 0.4)),
    "C": ((0.08, 0.15, 1.0), (0.02, 0.05, 0.4), (0.0, -math.inf, 0.4)),
}
_ROLL = {"A": (1.0, 1.4, 10.0), "B": (1.4, 3.0, 10.0), "C": (1.0, 1.4, 10.0)}  # longest time constant [s]
_SPIRAL = {"A": (12.0, 8.0, 4.0), "B": (20.0, 8.0, 4.0), "C": (12.0, 8.0, 4.0)}  # shortest time to double [s]


def level(mode: Mode, category: Category) -> int:
    """Level 1, 2 or 3 of a named mode, 4 if it is worse; raises KeyError for modes the specification does not know."""
    return {
        "short_period": _short_period,
        "phugoid": _phugoid,
        "dutch_roll": _dutch_roll,
        "roll": _roll,
        "spiral": _spiral,
    }[mode.name](mode, category)


def _first(met: list[bool]) -> int:
    return met.index(True) + 1 if True in met else 4


def _time_to_double(mode: Mode) -> float:
    return -mode.time_to_half if mode.real > 0.0 else math.inf


def _short_period(mode: Mode, category: Category) -> int:
    return _first([low <= mode.damping <= high for low, high in _SHORT_PERIOD[category]])


def _phugoid(mode: Mode, category: Category) -> int:
    del category  # the same in all
    return _first([mode.damping >= 0.04, mode.damping >= 0.0, _time_to_double(mode) >= 55.0])


def _dutch_roll(mode: Mode, category: Category) -> int:
    return _first(
        [
            mode.damping >= damping and mode.damping * mode.omega >= product and mode.omega >= omega
            for damping, product, omega in _DUTCH_ROLL[category]
        ]
    )


def _roll(mode: Mode, category: Category) -> int:
    constant = -1.0 / mode.real if mode.real < 0.0 else math.inf
    return _first([constant <= longest for longest in _ROLL[category]])


def _spiral(mode: Mode, category: Category) -> int:
    return _first([_time_to_double(mode) >= shortest for shortest in _SPIRAL[category]])
