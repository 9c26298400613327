"""The way home: up to a safe height, across, down, a pause above home, and the landing."""

import math
from enum import IntEnum

from sitl.flight.demand import Demand
from sitl.flight.landed import LandedState
from sitl.flight.manoeuvres import ARRIVAL, ARRIVAL_TIME, NEAR, SLOW, Hold, Landing, Manoeuvre, Place, arrived
from sitl.flight.parameters import Parameters
from sitl.flight.view import View

__all__ = ["Return"]

FAR = 150.0  # distance from which the way is worth a transition [m]
CLOSE = 10.0  # within it, hovering, the vehicle is at home already: no climb [m]


class _Phase(IntEnum):
    CLIMB = 0
    ACROSS = 1
    DESCEND = 2
    WAIT = 3
    LAND = 4


class Return(Manoeuvre):
    """Brings the vehicle back to a place and lands it there, hovering in the end.

    It climbs where it is, hovering or circling, to RTL_RETURN_ALT above the place; flies over on the wing if it is on
    the wing or the way is long, else in hover; descends to RTL_DESCEND_ALT; waits RTL_LAND_DELAY; lands.
    """

    def __init__(self, parameters: Parameters, demand: Demand) -> None:
        super().__init__(parameters, demand)
        self._hold = Hold(parameters, demand)
        self._landing = Landing(parameters, demand)

    def start(self, view: View, place: Place, ground_down: float, *, cruise: bool) -> None:
        """Begin a return to `place`, whose ground lies at `ground_down` [m, NED down]; `cruise`: on the wing."""
        self.usual_speeds()
        self.place = place
        self.ground_down = ground_down
        self._stay_in_hover = False
        self._phase = _Phase.CLIMB
        self.cruise = cruise
        self._down = min(view.down, ground_down - self.parameters["RTL_RETURN_ALT"])
        if not self.cruise and self._distance(view) <= CLOSE:
            self._down = view.down
        self._hold.start(view, self.cruise, down=self._down)

    @property
    def climbing(self) -> bool:
        """Whether the vehicle is not yet at the height for the way."""
        return self._phase == _Phase.CLIMB

    @property
    def landing(self) -> bool:
        """Whether the landing has begun."""
        return self._phase == _Phase.LAND

    @property
    def on_the_way(self) -> bool:
        """Whether the vehicle still climbs or crosses: not yet above the place."""
        return self._phase <= _Phase.ACROSS

    def fly(self, view: View, cruise: bool) -> None:
        """Go on in another regime, on the way."""
        self.cruise = cruise
        self._stay_in_hover = not cruise
        if self._phase == _Phase.CLIMB:
            self._hold.start(view, cruise, down=self._down)

    def update(self, view: View, landed_state: LandedState) -> bool:
        """Ask for the next moment of it; True once the vehicle stands."""
        if self._phase == _Phase.LAND:
            done = self._landing.update(view, landed_state)
            self.cruise = self._landing.cruise
            return done
        if self._phase == _Phase.CLIMB:
            self._climb(view)
        elif self._phase == _Phase.ACROSS:
            self._across(view)
        else:
            self._above(view)
        return False

    def _climb(self, view: View) -> None:
        self._hold.airspeed = self.airspeed
        self._hold.update(view)
        tolerance = self.parameters["NAV_FW_ALT_RAD" if self.cruise else "NAV_MC_ALT_RAD"]
        if view.down <= self._down + tolerance and self._hold.settled:
            self._phase = _Phase.ACROSS
            self._near_since = math.inf
            self._heading = view.yaw
            self.cruise = self.cruise or (not self._stay_in_hover and self._distance(view) > FAR)

    def _across(self, view: View) -> None:
        if self.cruise and arrived(view, self.place, NEAR, SLOW):
            self.cruise = False
        self.demand.point((*self.place, self._down), speed=self.speed, cruise=self.cruise)
        near = not self.cruise and arrived(view, self.place, NEAR, SLOW)
        if not near:
            self._heading = view.yaw
            self._near_since = math.inf
            return
        self.nose(self._heading)
        if self._near_since == math.inf:
            self._near_since = view.time
        if view.time - self._near_since > ARRIVAL_TIME or arrived(view, self.place, 2.0 * ARRIVAL, 1.0):
            self._phase = _Phase.DESCEND
            self._down = max(self._down, self.ground_down - self.parameters["RTL_DESCEND_ALT"])

    def _above(self, view: View) -> None:
        self.demand.point((*self.place, self._down), speed=self.ground_speed)
        self.nose(self._heading)
        if self._phase == _Phase.DESCEND:
            if view.down >= self._down - self.parameters["NAV_MC_ALT_RAD"]:
                self._phase = _Phase.WAIT
                self._waiting_since = view.time
            return
        delay = self.parameters["RTL_LAND_DELAY"]
        if delay >= 0.0 and view.time - self._waiting_since >= delay:
            self._phase = _Phase.LAND
            self._landing.start(view, self.place, self.ground_down)

    def _distance(self, view: View) -> float:
        return math.hypot(self.place[0] - view.north, self.place[1] - view.east)
