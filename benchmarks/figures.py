"""What a benchmark reports: a number with its unit, and beside it what it is measured against."""

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass

__all__ = ["Figure", "as_text", "cpu_time", "to_json"]


@dataclass(frozen=True)
class Figure:
    """One measured number.

    `goal` is what the project set itself; `at_most` says that smaller is better. `peer` names something else that was
    measured in the same run, and `peer_value` what it reached, in the same unit.
    """

    name: str
    value: float
    unit: str
    goal: float | None = None
    at_most: bool = False
    peer: str = ""
    peer_value: float | None = None

    @property
    def ratio(self) -> float | None:
        """How many times better than the peer."""
        if self.peer_value is None:
            return None
        return self.peer_value / self.value if self.at_most else self.value / self.peer_value

    @property
    def met(self) -> bool | None:
        """Whether the goal is reached; None where there is none."""
        if self.goal is None:
            return None
        return self.value <= self.goal if self.at_most else self.value >= self.goal


def as_text(figure: Figure) -> str:
    """One line for a person."""
    text = f"{figure.name:<58} {_number(figure.value):>10} {figure.unit:<9}"
    if figure.goal is not None:
        relation = "<=" if figure.at_most else ">="
        text += f" {relation} {_number(figure.goal):<8} {'ok  ' if figure.met else 'MISS'}"
    if figure.peer_value is not None:
        text += f" {figure.ratio:.2f} x {figure.peer} ({_number(figure.peer_value)})"
    return text.rstrip()


def to_json(figure: Figure) -> dict[str, object]:
    """For the JSON file: the fields and what follows from them."""
    return {**asdict(figure), "ratio": figure.ratio, "met": figure.met}


def _number(value: float) -> str:
    return f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.4g}"


def cpu_time(call: Callable[[], object], calls: int) -> float:
    """Mean CPU time [s] that this process spends on a call."""
    begin = time.process_time()
    for _ in range(calls):
        call()
    return (time.process_time() - begin) / calls
