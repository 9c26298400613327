"""How far the mission is: MISSION_CURRENT, streamed and sent at once when it changes, and MISSION_ITEM_REACHED.

https://mavlink.io/en/services/mission.html, "Monitor Mission Progress".
"""

from typing import Any

from sitl.flight.flight import Flight
from sitl.flight.mode import Mode
from sitl.mavlink.codec import codec
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.mission_conversion import FENCE, MISSION, RALLY
from sitl.mavlink.mission_plans import Plans
from sitl.mavlink.service import Exchange
from sitl.mavlink.telemetry.context import Context
from sitl.snapshot import Snapshot

__all__ = ["MissionProgress"]

NO_MISSION = 0xFFFF  # as the number of items
IN_MISSION_MODE, SUSPENDED = 1, 2  # of MISSION_CURRENT.mission_mode


class MissionProgress:
    """Tells everybody where the mission stands."""

    def __init__(self, exchange: Exchange, plans: Plans) -> None:
        self._exchange, self._plans, self._offset = exchange, plans, plans.offset(MISSION)
        self._names = codec("MISSION_CURRENT").field_names
        self.restarted()

    def restarted(self) -> None:
        """The vehicle has begun anew, with nothing told."""
        self._told: tuple[Any, ...] | None = None
        self._flown: tuple[Any, ...] = ()  # items of the mission that has been begun
        self._reached = len(self._exchange.simulation.items_reached)  # how many of them have been told

    def mission_current(self, snapshot: Snapshot, context: Context) -> tuple[Any, ...] | None:
        """MISSION_CURRENT: number and count of items, state, mode, and the ids of the three plans."""
        _ = snapshot, context
        flight = self._plans.flight
        return None if flight is None else self._values(flight)

    def tell(self) -> None:
        """Send MISSION_CURRENT to everybody now."""
        flight = self._plans.flight
        if flight is not None:
            self._told = _looked_at(flight)
            self._exchange.broadcast("MISSION_CURRENT", **dict(zip(self._names, self._values(flight), strict=True)))

    def update(self) -> None:
        """Tell what has changed since the last time."""
        flight = self._plans.flight
        if flight is None:
            return
        reached = self._exchange.simulation.items_reached
        while self._reached < len(reached):
            self._exchange.broadcast("MISSION_ITEM_REACHED", seq=reached[self._reached] + self._offset)
            self._reached += 1
        if flight.armed and flight.mode == Mode.MISSION:
            self._flown = flight.mission.items
        if _looked_at(flight) != self._told:
            self.tell()

    def _values(self, flight: Flight) -> tuple[Any, ...]:
        mission, in_mode = flight.mission, flight.mode == Mode.MISSION
        count = len(mission.items)
        return (
            min(mission.current, count - 1) + self._offset if count else 0,  # one beyond them when the last is done
            count or NO_MISSION,
            self._state(flight),
            IN_MISSION_MODE if in_mode else SUSPENDED,
            self._plans.plan(MISSION).id,
            self._plans.plan(FENCE).id,
            self._plans.plan(RALLY).id,
        )

    def _state(self, flight: Flight) -> int:
        mission = flight.mission
        if not mission.items:
            return mav.MISSION_STATE_NO_MISSION
        if mission.finished:
            return mav.MISSION_STATE_COMPLETE
        if flight.armed and flight.mode == Mode.MISSION:
            return mav.MISSION_STATE_PAUSED if mission.paused else mav.MISSION_STATE_ACTIVE
        return mav.MISSION_STATE_PAUSED if self._flown is mission.items else mav.MISSION_STATE_NOT_STARTED


def _looked_at(flight: Flight) -> tuple[Any, ...]:
    """What MISSION_CURRENT is made from; cheap to compare, for that happens 50 times in every simulated second."""
    mission, fence = flight.mission, flight.fence
    return (
        mission.items, mission.current, mission.finished, mission.paused, flight.mode, flight.armed,
        fence.polygons, fence.circles, flight.rally.points,
    )  # fmt: skip
