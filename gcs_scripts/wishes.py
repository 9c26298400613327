"""Messages that a program needs: asked for where the vehicle does not send them by itself, and left to it at the end.

Source: MAVLink guide, services/command (SET_MESSAGE_INTERVAL, REQUEST_MESSAGE).
"""

import time
from collections.abc import Mapping

from gcs_scripts.connection import Vehicle
from gcs_scripts.vehicle_state import VehicleState

__all__ = ["ONCE", "Wishes"]

ONCE = 0.0  # in place of an interval: one message is enough
GRACE, AGAIN = 1.5, 2.0  # [s] that a message has to come by itself, and between two questions for it


class Wishes:
    """Messages that one vehicle shall send."""

    def __init__(self, vehicle: Vehicle, state: VehicleState, intervals: Mapping[str, float], *, grace: float = GRACE):
        """`intervals` [s] by message name; what is in `state` after `grace` seconds need not be asked for."""
        self._vehicle, self._state = vehicle, state
        self._intervals = dict(intervals)
        self._begin = time.monotonic() + grace
        self._asked: dict[str, float] = {}

    def add(self, name: str, interval: float) -> None:
        """Wish for one more."""
        self._intervals.setdefault(name, interval)

    def update(self, now: float) -> None:
        """Ask for what has not come, if it is time [s, monotonic]."""
        if now < self._begin:
            return
        for name, interval in self._intervals.items():
            if self._state.get(name) is None and now - self._asked.get(name, -AGAIN) >= AGAIN:
                self._asked[name] = now
                if interval == ONCE:
                    self._vehicle.request(name)
                else:
                    self._vehicle.set_interval(name, round(1e6 * interval))

    def fulfilled(self) -> bool:
        """Whether one of each has come."""
        return all(self._state.get(name) is not None for name in self._intervals)

    def close(self) -> None:
        """Leave what was asked for to the vehicle's own rates."""
        for name in self._asked:
            if self._intervals[name] != ONCE:
                self._vehicle.set_interval(name, 0)
