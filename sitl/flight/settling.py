"""Taking the thrust away from a vehicle that has touched the ground, in whatever mode it came down."""

import numpy as np

from sitl.control.records import Level, Vertical
from sitl.flight.view import View

__all__ = ["Settling"]

RAMP = 2.0  # share of the largest thrust taken away per second: firm, yet slow enough to notice a mistake [1/s]


class Settling:
    """Lowers the setpoint's thrust limit while the ground carries and the vehicle is still asked to sink.

    Without contact, or once it is asked to climb, all thrust is there again at once.
    """

    def __init__(self) -> None:
        self._limit = 1.0
        self._time = 0.0

    def update(self, view: View, contact: bool, setpoint: np.void) -> None:
        """Judge the SETPOINT just written, and limit its thrust if need be."""
        if not (contact and _asks_to_sink(view, setpoint)):
            self._limit = 1.0
            self._time = view.time
            return
        step = min(max(view.time - self._time, 0.0), 0.1)
        self._time = view.time
        self._limit = max(min(self._limit, view.thrust) - RAMP * step, 0.0)
        setpoint["thrust_limit"] = self._limit


def _asks_to_sink(view: View, setpoint: np.void) -> bool:
    if setpoint["level"] != Level.VELOCITY:
        return False
    if setpoint["vertical"] == Vertical.RATE:
        return bool(setpoint["velocity_ned"][2] > 0.0)
    return bool(setpoint["position_ned"][2] > view.down)
