"""How long ago the other ends of the vehicle's links were heard, in simulated time; scenarios can cut the links."""

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sitl.flight.failsafe import Links
    from sitl.flight.manual_input import Sticks

__all__ = ["LINKS", "LinkAges"]

LINKS = ("ground_station", "manual_control")


class LinkAges:
    """Keeps a flight's `Links` up to date.

    Sticks and setpoints are as old as the latest of them. A scenario may let a ground station or sticks be heard all
    the time, or fall silent; what it says of a link goes before what is heard.

    Attributes:
        setpoint_received: simulated time of the latest offboard setpoint [s].
        station_received: simulated time of the latest heartbeat of a ground station [s].
    """

    def __init__(self) -> None:
        self.setpoint_received = self.station_received = -math.inf
        self._silent_since: dict[str, float] = {}

    def switch(self, name: str, up: bool, time: float) -> None:
        """Let one of LINKS be heard all the time from now [s] on, or be silent."""
        self._silent_since[name] = math.inf if up else time

    def release(self, name: str) -> None:
        """Let one of LINKS be as old as what is heard of it."""
        self._silent_since.pop(name, None)

    def refresh(self, links: "Links", sticks: "Sticks", time: float, pace: float = 1.0) -> None:
        """Write the ages at this time [s].

        Who speaks lives in wall time, and `pace` simulated seconds pass in a second of his: his silence counts in his.
        """
        if math.isfinite(sticks.received):
            links.manual_control = (time - sticks.received) / pace
        if math.isfinite(self.setpoint_received):
            links.offboard = (time - self.setpoint_received) / pace
        if math.isfinite(self.station_received):
            links.ground_station = (time - self.station_received) / pace
        for name, since in self._silent_since.items():
            setattr(links, name, max(time - since, 0.0))
