"""The modes that fly by themselves: hold, take-off, landing, return, mission, orbit, termination.

Those flown by sticks are in `direct_modes` and `stick_modes`, that flown by a computer outside in `offboard`.
"""

import math
from collections.abc import Callable

from sitl.flight.behaviour import Behaviour
from sitl.flight.demand import Demand
from sitl.flight.landed import LandedState
from sitl.flight.manoeuvres import (
    STANDSTILL,
    ForcedLanding,
    Hold,
    Landing,
    Manoeuvre,
    Orbit,
    Place,
    Takeoff,
    YawBehaviour,
)
from sitl.flight.mission import Mission
from sitl.flight.mission_pilot import SpeedType
from sitl.flight.parameters import Parameters
from sitl.flight.places import Home, Ned
from sitl.flight.refused import Refused
from sitl.flight.returning import Return
from sitl.flight.view import View

__all__ = [
    "HoldMode", "LandMode", "MissionMode", "OrbitMode", "ReturnMode", "TakeoffMode", "TerminationMode",
]  # fmt: skip


def _set_speed(manoeuvre: Manoeuvre, airspeed: float | None, ground_speed: float | None) -> None:
    if airspeed is not None:
        manoeuvre.airspeed = airspeed
    if ground_speed is not None:
        manoeuvre.ground_speed = ground_speed


class HoldMode(Behaviour):
    """Stays where it is, or goes to a place and stays there."""

    def __init__(self, parameters: Parameters, demand: Demand) -> None:
        self._hold = Hold(parameters, demand)

    def start(self, view: View, cruise: bool) -> None:
        """Hover or circle here."""
        self.cruise = cruise
        self._hold.start(view, cruise)

    def go_to(
        self, view: View, point: Place, down: float, radius: float | None = None, heading: float | None = None
    ) -> None:
        """Fly to a point [m] and hover there, or circle around it; the mode has been started."""
        self._hold.start(view, self.cruise, point=point, down=down, radius=radius, heading=heading)

    def update(self, view: View, landed_state: LandedState) -> bool:  # noqa: ARG002
        """Ask for the next moment; it never ends."""
        return self._hold.update(view)

    def fly(self, view: View, cruise: bool) -> None:
        """Hover, or circle, from here on at the same height."""
        self.cruise = cruise
        self._hold.start(view, cruise, down=self._hold.down)

    def change_speed(self, *, airspeed: float | None = None, ground_speed: float | None = None) -> None:
        """Fly at another speed [m/s]."""
        _set_speed(self._hold, airspeed, ground_speed)

    def change_altitude(self, down: float) -> None:
        """Stay at another height [m, NED down]."""
        self._hold.down = down


class TakeoffMode(Behaviour):
    """Climbs from the ground to a height above it."""

    def __init__(self, parameters: Parameters, demand: Demand) -> None:
        self.height: float | None = None  # above the take-off point [m]; None: MIS_TAKEOFF_ALT
        self._parameters = parameters
        self._takeoff = Takeoff(parameters, demand)

    def start(self, view: View, cruise: bool) -> None:  # noqa: ARG002 (it begins on the ground)
        """Climb from where the vehicle stands."""
        height = self._parameters["MIS_TAKEOFF_ALT"] if self.height is None else self.height
        self._takeoff.start(view, view.down - height)

    @property
    def goal(self) -> tuple[Place, float]:
        """The point over which it climbs, and the height to which it does [m, NED down]."""
        return self._takeoff.point, self._takeoff.down

    def update(self, view: View, landed_state: LandedState) -> bool:
        """Ask for the next moment; True once the height is reached."""
        return self._takeoff.update(view, landed_state)

    def lifts(self, view: View) -> bool:  # noqa: ARG002
        """It does."""
        return True


class LandMode(Behaviour):
    """Lands hovering: where the vehicle comes to a stop, or at a place."""

    def __init__(self, parameters: Parameters, demand: Demand, home: Home, tilt_failed: Callable[[], bool]) -> None:
        self.place: Place | None = None  # where to; None: here
        self._home = home
        self._tilt_failed = tilt_failed
        self._hold = Hold(parameters, demand)
        self._landing = Landing(parameters, demand)
        self._forced = ForcedLanding(parameters, demand)
        self._begun = False

    @property
    def landing(self) -> bool:
        """As the base says."""
        return True

    def start(self, view: View, cruise: bool) -> None:
        """Slow down to a hover; then land here, or fly to the place and land there."""
        self._begun = self.place is not None
        self.cruise = cruise and self._begun
        self._forced.start(self._home.down)
        if self.place is not None:
            self._landing.start(view, self.place, self._home.down, cruise=cruise)
        else:
            self._hold.start(view, cruise=False)

    def update(self, view: View, landed_state: LandedState) -> bool:
        """Ask for the next moment; True once the vehicle stands."""
        if self._tilt_failed():
            self.cruise = False
            return self._forced.update(view, landed_state)
        if not self._begun:
            self._hold.update(view)
            if self._hold.settled and math.hypot(view.vn, view.ve) <= 2.0 * STANDSTILL:
                self._begun = True
                self._landing.start(view, self._hold.point, self._home.down)
            return False
        done = self._landing.update(view, landed_state)
        self.cruise = self._landing.cruise
        return done


class ReturnMode(Behaviour):
    """Goes home, to a rally point or to the mission's landing, and lands."""

    def __init__(
        self,
        parameters: Parameters,
        demand: Demand,
        mission: Mission,
        destination: Callable[[View], Ned],
        tilt_failed: Callable[[], bool],
    ) -> None:
        """`destination` gives the place to return to and its ground; it is asked at every start."""
        self._parameters = parameters
        self._mission = mission
        self._destination = destination
        self._tilt_failed = tilt_failed
        self._return = Return(parameters, demand)
        self._forced = ForcedLanding(parameters, demand)
        self._land_start: int | None = None

    @property
    def landing(self) -> bool:
        """As the base says."""
        return self._tilt_failed() or (self._mission.landing if self.own_limits else self._return.landing)

    def start(self, view: View, cruise: bool) -> None:
        """Begin with the climb to the return altitude."""
        north, east, ground_down = self._destination(view)
        self._forced.start(ground_down)
        self._return.start(view, (north, east), ground_down, cruise=cruise)
        self.cruise = self._return.cruise
        self.own_limits = False
        self._land_start = self._mission.land_start_index() if self._parameters["RTL_TYPE"] == 2 else None

    def update(self, view: View, landed_state: LandedState) -> bool:
        """Ask for the next moment; True once the vehicle stands."""
        mission = self._mission
        if self._tilt_failed():  # such a wing may carry at no speed that reaches home, or stops there: land here
            self.cruise = False
            return self._forced.update(view, landed_state)
        if self.own_limits:  # the mission flies the rest
            mission.landed_state = landed_state
            mission.update(view)
            self.cruise = mission.cruise
            return landed_state == LandedState.ON_GROUND
        done = self._return.update(view, landed_state)
        self.cruise = self._return.cruise
        if self._land_start is not None and not self._return.climbing:
            self.own_limits = True
            mission.jump_to(self._land_start)
            mission.resume(view, cruise=self.cruise)
        return done

    def fly(self, view: View, cruise: bool) -> None:
        """Return wing-borne or hovering, as long as the vehicle is on its way."""
        if self.own_limits:
            self._mission.cruise = cruise
        elif self._return.on_the_way:
            self._return.fly(view, cruise)
        elif cruise:
            msg = "home is reached: the vehicle is about to land"
            raise Refused(msg, temporary=True)
        self.cruise = cruise

    def change_speed(self, *, airspeed: float | None = None, ground_speed: float | None = None) -> None:
        """Fly home at another speed [m/s]."""
        _set_speed(self._return, airspeed, ground_speed)


class MissionMode(Behaviour):
    """Flies the mission; from where it was left, or from its beginning."""

    own_limits = True

    def __init__(self, mission: Mission) -> None:
        self._mission = mission
        self._first = 0
        self._begun = False

    @property
    def landing(self) -> bool:
        """As the base says."""
        return self._mission.landing

    def begin_at(self, first: int) -> None:
        """Let the next start be one anew, from this item."""
        self._first = first
        self._begun = False

    def start(self, view: View, cruise: bool) -> None:
        """Start the mission, or take it up again."""
        if self._begun and not self._mission.finished:
            self._mission.resume(view, cruise=cruise)
        else:
            self._mission.start(view, self._first, cruise=cruise)
        self._first = 0
        self._begun = True
        self.cruise = self._mission.cruise

    def update(self, view: View, landed_state: LandedState) -> bool:
        """Ask for the next moment; True once the mission is finished."""
        self._mission.landed_state = landed_state
        self._mission.update(view)
        self.cruise = self._mission.cruise
        return self._mission.finished

    def lifts(self, view: View) -> bool:  # noqa: ARG002
        """Whether there is something left to fly."""
        return not self._mission.finished

    def fly(self, view: View, cruise: bool) -> None:  # noqa: ARG002
        """Go on with the mission in another regime, until an item says otherwise."""
        self._mission.cruise = self.cruise = cruise

    def change_speed(self, *, airspeed: float | None = None, ground_speed: float | None = None) -> None:
        """Go on with the mission at another speed [m/s], as DO_CHANGE_SPEED does."""
        if airspeed is not None:
            self._mission.change_speed(SpeedType.AIRSPEED, airspeed)
        if ground_speed is not None:
            self._mission.change_speed(SpeedType.GROUND_SPEED, ground_speed)


class OrbitMode(Behaviour):
    """Flies around a centre."""

    def __init__(self, parameters: Parameters, demand: Demand) -> None:
        self._orbit = Orbit(parameters, demand)

    def go_round(
        self,
        view: View,
        centre: Place,
        down: float,
        radius: float,
        speed: float | None,
        yaw: YawBehaviour,
        *,
        cruise: bool,
    ) -> None:
        """Begin an orbit. Raises Refused, and changes nothing, for one that cannot be flown."""
        orbit = Orbit(self._orbit.parameters, self._orbit.demand)
        orbit.start(view, centre, down, radius, cruise=cruise, speed=speed, yaw=yaw)
        self._check(orbit, view, cruise)
        self._orbit = orbit
        self.cruise = cruise

    def start(self, view: View, cruise: bool) -> None:
        """The orbit has been begun by `go_round`."""

    def update(self, view: View, landed_state: LandedState) -> bool:  # noqa: ARG002
        """Ask for the next moment; it never ends."""
        return self._orbit.update(view)

    def fly(self, view: View, cruise: bool) -> None:
        """Go round wing-borne or hovering."""
        self._check(self._orbit, view, cruise)
        self._orbit.cruise = self.cruise = cruise

    def change_speed(self, *, airspeed: float | None = None, ground_speed: float | None = None) -> None:
        """Go round at another speed [m/s]."""
        _set_speed(self._orbit, airspeed, ground_speed)

    def change_altitude(self, down: float) -> None:
        """Go round at another height [m, NED down]."""
        self._orbit.down = down

    def _check(self, orbit: Orbit, view: View, cruise: bool) -> None:
        smallest = orbit.smallest_radius(cruise, math.hypot(view.wind_north, view.wind_east))
        if abs(orbit.radius) < smallest:
            how = "wing-borne in this wind" if cruise else "at this speed"
            msg = f"orbit radius: expected at least {smallest:.0f} m {how}, got {abs(orbit.radius):.0f} m"
            raise Refused(msg)


class TerminationMode(Behaviour):
    """Motors off, servos at rest, for good."""

    def __init__(self, demand: Demand) -> None:
        self._demand = demand

    def update(self, view: View, landed_state: LandedState) -> bool:  # noqa: ARG002
        """Ask for nothing."""
        self._demand.off()
        return False

    def lifts(self, view: View) -> bool:  # noqa: ARG002
        """Never idles either."""
        return True
