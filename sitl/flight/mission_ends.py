"""Steps of a mission that change what carries the vehicle: take-offs, transitions, landings."""

import math
from dataclasses import replace
from enum import IntEnum

from sitl.flight.landed import LandedState
from sitl.flight.manoeuvres import NEAR, SLOW, Hold, Landing, Takeoff, arrived
from sitl.flight.messages import Severity
from sitl.flight.mission_items import MissionItem
from sitl.flight.mission_pilot import MissionPilot
from sitl.flight.mission_steps import Ahead, Step, Waypoint, angle_between, given
from sitl.flight.places import Ned
from sitl.flight.regime import REACHED
from sitl.flight.returning import Return
from sitl.flight.view import View

__all__ = [
    "VTOL_FIXED_WING", "VTOL_MULTICOPTER", "Climb", "GoHome", "GroundTakeoff", "Land", "ToCruise", "ToHover",
    "TransitionHeading", "VtolTakeoff",
]  # fmt: skip

VTOL_MULTICOPTER, VTOL_FIXED_WING = 3, 4  # MAV_VTOL_STATE
ALIGNED = math.radians(10.0)  # heading error with which a transition begins
ALIGNING_TIME = 15.0  # after which it begins all the same: the wind may not let the nose turn [s]
FAR = 1000.0  # of the far end of a leg that has a direction only [m]


class TransitionHeading(IntEnum):
    """Where VTOL_TAKEOFF turns to before it accelerates; MAVLink's VTOL_TRANSITION_HEADING."""

    VEHICLE_DEFAULT = 0  # towards the item's place, or the next one
    NEXT_WAYPOINT = 1
    TAKEOFF = 2
    SPECIFIED = 3
    ANY = 4


class GroundTakeoff(Step):
    """TAKEOFF: climbs vertically to the item's height, then hovers to its place if that is elsewhere."""

    def __init__(self, pilot: MissionPilot, ahead: Ahead, item: MissionItem, view: View) -> None:
        super().__init__(pilot, ahead)
        self.place = pilot.place(item, view)
        self._climb = Climb(pilot, self.place[2], view)
        self._item = replace(item, param1=0.0, param2=0.0, param3=0.0)
        self._way: Waypoint | None = None

    def update(self, view: View, landed: LandedState) -> bool:
        """As the base says."""
        if self._way is None:
            if not self._climb.update(view, landed):
                return False
            self._way = Waypoint(self.pilot, self.ahead, self._item, view)
            if self._item.here or self._way.length <= self._way.acceptance:
                return True
        return self._way.update(view, landed)


class Climb:
    """A vertical climb in hover, from the ground or from where the vehicle hovers; nothing to do on the wing."""

    def __init__(self, pilot: MissionPilot, down: float, view: View) -> None:
        self._pilot, self.down = pilot, down
        self._takeoff = Takeoff(pilot.parameters, pilot.demand)
        self._takeoff.start(view, down)
        self._idle = pilot.cruise

    def update(self, view: View, landed: LandedState) -> bool:
        """True once the height is reached."""
        if self._idle or (landed != LandedState.ON_GROUND and view.down <= self.down):
            done = True
        else:
            done = self._takeoff.update(view, landed)
        if done:
            self._pilot.came_from = (view.north, view.east, self.down)
        return done


class ToCruise(Step):
    """Transition to wing-borne flight: turns the nose to where the flight goes on, then accelerates that way.

    `heading` [rad] is that of the acceleration, not a number: towards the next place, or straight ahead without one.
    """

    def __init__(self, pilot: MissionPilot, ahead: Ahead, view: View, heading: float = math.nan) -> None:
        super().__init__(pilot, ahead)
        if math.isnan(heading):
            heading = view.yaw
            if ahead.place is not None:
                onward = ahead.place[0] - view.north, ahead.place[1] - view.east
                if math.hypot(*onward) > pilot.parameters["NAV_ACC_RAD"]:
                    heading = math.atan2(onward[1], onward[0])
        self.heading = heading
        self._down = pilot.came_from[2]
        self._align_by = view.time + ALIGNING_TIME
        self._start: Ned | None = None
        self._hold = Hold(pilot.parameters, pilot.demand)
        self._hold.start(view, False, down=self._down)

    def update(self, view: View, landed: LandedState) -> bool:
        """As the base says."""
        _ = landed
        pilot = self.pilot
        if self._start is None:
            if pilot.cruise:  # already: go straight on
                fast = math.hypot(view.vn, view.ve) > SLOW  # else the wind outweighs the airspeed: no course to keep
                self.heading = math.atan2(view.ve, view.vn) if fast else view.yaw
            elif not self._align(view):
                return False
            self._start = (view.north, view.east, self._down)
        pilot.cruise = True
        end = (
            self._start[0] + FAR * math.cos(self.heading),
            self._start[1] + FAR * math.sin(self.heading),
            self._down,
        )
        pilot.leg(view, self._start, end, math.nan)
        if view.airspeed < REACHED * pilot.parameters["FW_AIRSPD_MIN"]:
            return False
        pilot.came_from = (view.north, view.east, self._down)
        return True

    def _align(self, view: View) -> bool:
        self._hold.update(view)
        if self._hold.settled:
            self.pilot.demand.heading(self.heading)
            aligned = abs(angle_between(self.heading, view.yaw)) <= ALIGNED
            return aligned or view.time >= self._align_by
        return False


class ToHover(Step):
    """Transition to hover: slows down to a stop."""

    def __init__(self, pilot: MissionPilot, ahead: Ahead, view: View) -> None:
        super().__init__(pilot, ahead)
        pilot.cruise = False
        self._hold = Hold(pilot.parameters, pilot.demand)
        self._hold.start(view, False, down=pilot.came_from[2])

    def update(self, view: View, landed: LandedState) -> bool:
        """As the base says."""
        _ = landed
        self._hold.update(view)
        if self._hold.settled:
            self.pilot.came_from = (*self._hold.point, self._hold.down)
        return self._hold.settled


class VtolTakeoff(Step):
    """VTOL_TAKEOFF: climbs vertically to MIS_TAKEOFF_ALT above its start, or to the item's height if that is lower.

    Then it turns to the transition's heading, accelerates and flies on past the item's place, climbing to its height.
    In flight it only sees to wing-borne flight.
    """

    def __init__(self, pilot: MissionPilot, ahead: Ahead, item: MissionItem, view: View) -> None:
        super().__init__(pilot, ahead)
        self.place = pilot.place(item, view)
        self._item = replace(item, param1=0.0, param2=0.0, param3=0.0, param4=math.nan)
        self._start_heading = view.yaw
        self._choice = TransitionHeading(int(given(item.param2)))
        self._specified = math.radians(item.param4)
        lower = max(view.down - pilot.parameters["MIS_TAKEOFF_ALT"], self.place[2])
        self._climb = Climb(pilot, lower, view)
        self._accelerate: ToCruise | None = None
        self._way: Waypoint | None = None

    def update(self, view: View, landed: LandedState) -> bool:
        """As the base says."""
        pilot = self.pilot
        if self._accelerate is None:
            if not self._climb.update(view, landed):
                return False
            self._accelerate = ToCruise(pilot, Ahead(self._towards(view), flows=True), view, self._heading(view))
        if self._way is None:
            if not self._accelerate.update(view, landed):
                return False
            self._way = Waypoint(pilot, self.ahead, self._item, view, needs_height=False)
            if self._item.here or self._behind(view):
                pilot.came_from = (view.north, view.east, self.place[2])
                return True
        return self._way.update(view, landed)

    def _towards(self, view: View) -> Ned | None:
        own = math.hypot(self.place[0] - view.north, self.place[1] - view.east)
        near = own <= self.pilot.parameters["NAV_ACC_RAD"]
        return self.ahead.place if near or self._choice == TransitionHeading.NEXT_WAYPOINT else self.place

    def _heading(self, view: View) -> float:
        if self._choice == TransitionHeading.TAKEOFF:
            return self._start_heading
        if self._choice == TransitionHeading.SPECIFIED:
            return self._specified
        if self._choice == TransitionHeading.ANY:
            return view.yaw
        return math.nan

    def _behind(self, view: View) -> bool:
        """The acceleration has passed the place: no turning back for it."""
        north, east = self.place[0] - view.north, self.place[1] - view.east
        return north * view.vn + east * view.ve <= 0.0


class Land(Step):
    """LAND and VTOL_LAND: flies to above the place, on the wing if that carries, stops there and lands vertically."""

    def __init__(
        self, pilot: MissionPilot, ahead: Ahead, item: MissionItem, view: View, approach: float = math.nan
    ) -> None:
        """`approach` is the height of the flight to the place [m, down], not a number: the present one."""
        super().__init__(pilot, ahead)
        self.place = pilot.place(item, view)
        self.heading = math.radians(item.param4)
        self._approach = (*self.place[:2], pilot.came_from[2] if math.isnan(approach) else approach)
        self._began = False
        self._landing = Landing(pilot.parameters, pilot.demand)
        pilot.say(Severity.INFO, "Landing")

    @property
    def landing(self) -> bool:
        """As the base says."""
        return self._began

    def distance(self, view: View) -> float:
        """As the base says."""
        return math.hypot(self.place[0] - view.north, self.place[1] - view.east)

    def update(self, view: View, landed: LandedState) -> bool:
        """As the base says."""
        pilot, landing = self.pilot, self._landing
        if not self._began:
            pilot.demand.point(self._approach, speed=pilot.speed(view), cruise=pilot.cruise)
            if not arrived(view, self._approach[:2], NEAR, SLOW):
                return False
            if abs(view.down - self._approach[2]) > pilot.height_tolerance():
                return False
            self._began = True
            pilot.cruise = False
            landing.start(view, self._approach[:2], self.place[2], heading=self.heading)
        return landing.update(view, landed)


class GoHome(Step):
    """RETURN_TO_LAUNCH: flies to home and lands there, as Return does."""

    def __init__(self, pilot: MissionPilot, ahead: Ahead, view: View) -> None:
        super().__init__(pilot, ahead)
        home = pilot.places.home
        self._return = Return(pilot.parameters, pilot.demand)
        self._return.start(view, (home.north, home.east), home.down, cruise=pilot.cruise)

    @property
    def landing(self) -> bool:
        """As the base says."""
        return self._return.landing

    def update(self, view: View, landed: LandedState) -> bool:
        """As the base says."""
        wanted = self.pilot.cruise
        if wanted != self._return.cruise and self._return.on_the_way:
            self._return.fly(view, wanted)
        done = self._return.update(view, landed)
        self.pilot.cruise = self._return.cruise
        return done
