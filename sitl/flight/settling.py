"""Taking the thrust away from a vehicle that has touched the ground, in whatever mode it came down."""

from sitl.control.records import Level
from sitl.flight.demand import Demand
from sitl.flight.view import View

__all__ = ["Settling"]

RAMP = 2.0  # share of the largest thrust taken away per second: firm, yet slow enough to notice a mistake [1/s]


class Settling:
    """Lowers the thrust limit of what is asked while the ground carries and the vehicle is still asked to sink.

    Without contact, or once it is asked to climb, all thrust is there again at once.
    """

    def __init__(self) -> None:
        self._limit = 1.0
        self._time = 0.0

    def update(self, view: View, contact: bool, demand: Demand) -> None:
        """Judge what has just been asked, and limit its thrust if need be."""
        if not (contact and _asks_to_sink(view, demand)):
            self._limit = 1.0
            self._time = view.time
            return
        step = min(max(view.time - self._time, 0.0), 0.1)
        self._time = view.time
        self._limit = max(min(self._limit, view.thrust) - RAMP * step, 0.0)
        demand.limit_thrust(self._limit)


def _asks_to_sink(view: View, demand: Demand) -> bool:
    if demand.level != Level.VELOCITY:
        return False
    rate = demand.down_rate
    return demand.down > view.down if rate is None else rate > 0.0
