"""A mission and a point that follows it: what the tests of missions share."""

import math
from collections.abc import Callable

from sitl.flight.demand import Demand
from sitl.flight.mission import Mission
from sitl.flight.mission_items import Command, Frame, MissionItem
from sitl.flight.parameters import Parameters
from sitl.flight.places import LocalFrame
from sitl.flight.view import View
from tests.sitl.flight.follower import Follower
from vehicle_model.earth import make_environment

__all__ = ["Sortie", "make_places"]

WING_BORNE = 12.0  # speed from which the follower is put on the wing [m/s]


def make_places() -> LocalFrame:
    """Around PX4's home, on a flat Earth."""
    return LocalFrame(
        make_environment(
            "flat", latitude=math.radians(47.397742), longitude=math.radians(8.545594), height_ellipsoid=488.0
        )
    )


class Sortie:
    """A mission that a Follower flies; attributes of both, and every text said."""

    def __init__(self, wind: tuple[float, float] = (0.0, 0.0), **parameters: float) -> None:
        self.parameters = Parameters(parameters)
        self.places = make_places()
        self.demand = Demand()
        self.said: list[str] = []
        self.mission = Mission(self.parameters, self.places, self.demand, lambda _, text: self.said.append(text))
        self.follower = Follower(self.demand.record[0], wind)
        self.view = self.follower.view

    def item(
        self,
        command: Command,
        place: tuple[float, float] | None = None,
        height: float = 0.0,
        *,
        params: tuple[float, float, float, float] = (0.0, 0.0, 0.0, math.nan),
        autocontinue: bool = True,
    ) -> MissionItem:
        """An item at north, east [m] and a height above home [m]."""
        where = (0.0, 0.0) if place is None else self.places.to_geodetic(*place, 0.0)[:2]
        return MissionItem(
            command, Frame.GLOBAL_RELATIVE_ALT, *params, *where, height, autocontinue
        )  # fmt: skip

    def waypoint(self, north: float, east: float, height: float, hold: float = 0.0) -> MissionItem:
        """A plain waypoint."""
        return self.item(Command.WAYPOINT, (north, east), height, params=(hold, 0.0, 0.0, math.nan))

    def put(self, north: float, east: float, height: float, *, speed: float = 0.0, course: float = 0.0) -> "Sortie":
        """The vehicle is in the air, hovering or on the wing."""
        self.follower.put(north, east, -height, speed=speed, course=course)
        return self

    def start(self, *items: MissionItem, first: int = 0) -> "Sortie":
        """Load and start a mission."""
        self.mission.load(items)
        self.mission.start(self.view, first, cruise=math.hypot(self.view.vn, self.view.ve) > WING_BORNE)
        return self

    def update(self, view: View) -> None:
        """One update of the mission."""
        self.mission.landed_state = self.follower.landed
        self.mission.update(view)

    def until(self, condition: Callable[[], bool], timeout: float = 600.0) -> "Sortie":
        """Fly until it is so."""
        self.follower.fly(self.update, condition, timeout)
        return self

    def until_item(self, index: int, timeout: float = 600.0) -> "Sortie":
        """Fly until an item is done."""
        return self.until(lambda: index in self.mission.reached, timeout)

    def finish(self, timeout: float = 1200.0) -> "Sortie":
        """Fly until the mission is finished."""
        return self.until(lambda: self.mission.finished, timeout)

    def run(self, seconds: float) -> "Sortie":
        """Let time pass [s]."""
        end = self.view.time + seconds
        return self.until(lambda: self.view.time >= end)

    def distance(self, north: float, east: float) -> float:
        """From the vehicle to a place [m]."""
        return math.hypot(self.view.north - north, self.view.east - east)
