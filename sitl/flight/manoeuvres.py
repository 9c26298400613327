"""Pieces of flight that modes and missions share: hold, take-off, landing, orbit.

Each asks the control laws for one thing after another through the Demand. Places are metres from the local frame's
origin, (north, east) and down; speeds are airspeeds where the regime is wing-borne and ground speeds in hover.
"""

import math
from enum import IntEnum

from sitl.flight.demand import Demand
from sitl.flight.landed import LandedState
from sitl.flight.parameters import Parameters
from sitl.flight.regime import wing_borne
from sitl.flight.view import View
from vehicle_model.earth import STANDARD_GRAVITY

__all__ = [
    "ARRIVAL",
    "ARRIVAL_TIME",
    "NEAR",
    "SLOW",
    "STANDSTILL",
    "ForcedLanding",
    "Hold",
    "Landing",
    "Manoeuvre",
    "Orbit",
    "Place",
    "Takeoff",
    "YawBehaviour",
    "arrived",
    "landing_rate",
]

Place = tuple[float, float]  # north, east [m]

UPRIGHT = math.radians(75.0)  # tilt from which a vertical take-off can begin
STANDSTILL = 0.5  # ground speed at which braking ends [m/s]
BRAKING_TIME = 40.0  # after which a vehicle that cannot stop holds where it is [s]
NEAR = 10.0  # distance from a point at which a wing-borne approach has come to its hovering end [m]
ARRIVAL = 1.0  # distance from a point over which to descend [m]
ARRIVAL_TIME = 20.0  # near the point, after which a vehicle that cannot come closer descends all the same [s]
SLOW = 3.0  # and the ground speed below which it has [m/s]
SLOWING = 0.3  # sink rate per height above where a landing is slow [1/s]


def arrived(view: View, point: Place, distance: float, speed: float) -> bool:
    """Whether the vehicle is within a distance [m] of a point and slower over the ground than `speed` [m/s]."""
    return math.hypot(point[0] - view.north, point[1] - view.east) <= distance and math.hypot(view.vn, view.ve) <= speed


def landing_rate(parameters: Parameters, height: float, fast: float) -> float:
    """Sink rate [m/s] at a height [m] above the ground: `fast` high up, MPC_LAND_SPEED from MPC_LAND_ALT2 down."""
    slow = parameters["MPC_LAND_SPEED"]
    return min(slow + SLOWING * max(height - parameters["MPC_LAND_ALT2"], 0.0), max(fast, slow))


class Manoeuvre:
    """What all have: the regime wanted now and the speeds to fly at, which a pilot may change on the way."""

    def __init__(self, parameters: Parameters, demand: Demand) -> None:
        self.parameters = parameters
        self.demand = demand
        self.cruise = False
        self.usual_speeds()

    def usual_speeds(self) -> None:
        """Fly at the speeds of the parameters, again."""
        self.airspeed = self.parameters["FW_AIRSPD_TRIM"]
        self.ground_speed = self.parameters["MPC_XY_CRUISE"]

    @property
    def speed(self) -> float:
        """Speed [m/s] in the regime wanted now."""
        return self.airspeed if self.cruise else self.ground_speed

    def smallest_radius(self, cruise: bool, wind: float) -> float:
        """Smallest radius [m] that can be kept in a wind [m/s]: at FW_R_LIM on the wing, at 0.2 g in hover."""
        if cruise:
            steepest = math.tan(math.radians(self.parameters["FW_R_LIM"]))
            return (self.airspeed + wind) ** 2 / (STANDARD_GRAVITY * steepest)
        return max(self.ground_speed**2 / (0.2 * STANDARD_GRAVITY), 1.0)

    def nose(self, heading: float) -> None:
        """Keep the nose of a hovering vehicle at a heading [rad], or in the wind if WV_EN says so."""
        if self.parameters["WV_EN"]:
            self.demand.weathervane()
        else:
            self.demand.heading(heading)


class Hold(Manoeuvre):
    """Stays about a place: hovering at a point, or circling on the wing.

    A hover entered in motion first brakes and then holds the point it has come to; a circle entered without a centre
    begins where the vehicle is, tangent to its track. NAV_LOITER_RAD is the radius, clockwise if positive, or wider
    where speed and wind do not allow it.
    """

    def start(
        self,
        view: View,
        cruise: bool,
        *,
        point: Place | None = None,
        down: float | None = None,
        radius: float | None = None,
        heading: float | None = None,
    ) -> None:
        """Begin; without `point`, `down`, `radius` [m] and `heading` [rad], those of the vehicle and the parameters."""
        self.usual_speeds()
        self.cruise = cruise
        self.down = view.down if down is None else down
        self.radius = self._wanted_radius = self.parameters["NAV_LOITER_RAD"] if radius is None else radius
        self._widen(view)
        self.heading = view.yaw if heading is None else heading
        self._since = view.time
        self._braking = False
        if point is not None:
            self.point = point
        elif cruise:
            track = math.atan2(view.ve, view.vn) if math.hypot(view.vn, view.ve) > 1.0 else view.yaw
            self.point = (
                view.north - self.radius * math.sin(track),
                view.east + self.radius * math.cos(track),
            )
        else:
            self.point = (view.north, view.east)
            self._braking = math.hypot(view.vn, view.ve) > STANDSTILL

    @property
    def settled(self) -> bool:
        """Whether the place is chosen: the vehicle no longer brakes."""
        return not self._braking

    def update(self, view: View) -> bool:
        """Ask for the next moment of it; never done: False."""
        if self._braking:
            self._brake(view)
        if self.cruise:
            if self.airspeed != self._widened_for:
                self._widen(view)
            self.demand.circle((*self.point, self.down), self.radius, speed=self.airspeed, cruise=True)
        elif not self._braking:
            self.demand.point((*self.point, self.down), speed=self.ground_speed)
            self.nose(self.heading)
        return False

    def _widen(self, view: View) -> None:
        """Fly the circle wanted, or the tightest one that this airspeed and wind allow."""
        self._widened_for = self.airspeed
        least = self.smallest_radius(cruise=True, wind=math.hypot(view.wind_north, view.wind_east))
        self.radius = math.copysign(max(abs(self._wanted_radius), least), self._wanted_radius)

    def _brake(self, view: View) -> None:
        self.demand.velocity((0.0, 0.0, 0.0))
        self.demand.altitude(self.down)
        speed = math.hypot(view.vn, view.ve)
        if speed > SLOW and wing_borne(view, self.parameters):
            self.heading = view.yaw  # the nose stays in the airflow until the rotors carry
        else:
            self.demand.heading(self.heading)
        stopped = speed <= STANDSTILL
        if stopped or view.time - self._since > BRAKING_TIME:
            self._braking = False
            self.point = (view.north, view.east)


class Takeoff(Manoeuvre):
    """Climbs vertically in hover to a height, over a point and with the heading of its start."""

    def start(self, view: View, height_down: float, position: Place | None = None) -> None:
        """Begin a climb to `height_down` [m, NED down] over `position`, or over where the vehicle stands."""
        self.usual_speeds()
        self.point = (view.north, view.east) if position is None else position
        self.down = height_down
        self.heading = view.yaw
        self._ready = False

    def update(self, view: View, landed_state: LandedState) -> bool:
        """Ask for the next moment of it; True once the height is reached, within NAV_MC_ALT_RAD."""
        if not self._ready:
            # On the ground the wing swings up first; the laws do that while the motors idle.
            self._ready = view.tilt >= UPRIGHT or landed_state != LandedState.ON_GROUND
            if not self._ready:
                self.demand.idle()
                return False
        parameters = self.parameters
        self.demand.limits(
            climb_rate=parameters["MPC_TKO_SPEED"],
            sink_rate=parameters["MPC_Z_V_AUTO_DN"],
            max_bank=math.radians(parameters["FW_R_LIM"]),
        )
        self.demand.point((*self.point, self.down), speed=self.ground_speed)
        self.nose(self.heading)
        return view.down <= self.down + parameters["NAV_MC_ALT_RAD"]


class Landing(Manoeuvre):
    """Flies to above a point, on the wing if the vehicle is on it, and lands there hovering.

    It descends at MPC_Z_V_AUTO_DN, slows to MPC_LAND_SPEED by MPC_LAND_ALT2 above the ground it expects, and keeps
    sinking until the vehicle stands, wherever the ground really is.
    """

    def start(
        self, view: View, point: Place, ground_down: float, *, cruise: bool = False, heading: float = math.nan
    ) -> None:
        """Begin a landing at `point`, whose ground lies at `ground_down` [m, NED down]; `cruise`: on the wing.

        `heading` [rad] is that of the landing; not a number: that of the arrival.
        """
        self.usual_speeds()
        self.cruise = cruise
        self.point = point
        self.ground_down = ground_down
        self.heading = heading
        self.descending = False
        self._down = min(view.down, ground_down)
        self._near_since = math.inf

    def update(self, view: View, landed_state: LandedState) -> bool:
        """Ask for the next moment of it; True once the vehicle has come down and stands."""
        if not self.descending:
            self._approach(view)
            return False
        parameters = self.parameters
        self.demand.point((*self.point, self.ground_down), speed=self.ground_speed)
        self.demand.climb(landing_rate(parameters, self.ground_down - view.down, parameters["MPC_Z_V_AUTO_DN"]))
        self.nose(self.heading)
        return landed_state == LandedState.ON_GROUND

    def _approach(self, view: View) -> None:
        if self.cruise and arrived(view, self.point, NEAR, SLOW):
            self.cruise = False
        self.demand.point((*self.point, self._down), speed=self.speed, cruise=self.cruise)
        if self.cruise:
            return
        near = arrived(view, self.point, NEAR, SLOW)
        if near and math.isnan(self.heading):
            self.heading = view.yaw
        if not math.isnan(self.heading):
            self.nose(self.heading)
        if not near:
            self._near_since = math.inf
            return
        if self._near_since == math.inf:
            self._near_since = view.time
        waited = view.time - self._near_since > ARRIVAL_TIME
        self.descending = waited or arrived(view, self.point, ARRIVAL, STANDSTILL)


class ForcedLanding(Manoeuvre):
    """Comes down with a wing that cannot tilt: nose into the wind, as slowly as that wing carries, wherever it is."""

    def start(self, ground_down: float) -> None:
        """Begin to sink towards ground that is expected at `ground_down` [m, NED down]."""
        self.usual_speeds()
        self.ground_down = ground_down

    def update(self, view: View, landed_state: LandedState) -> bool:
        """Ask for the next moment of it; True once the vehicle has come down and stands."""
        parameters = self.parameters
        rate = landing_rate(parameters, self.ground_down - view.down, parameters["MPC_Z_V_AUTO_DN"])
        self.demand.velocity((0.0, 0.0, rate))
        self.demand.weathervane()
        return landed_state == LandedState.ON_GROUND


class YawBehaviour(IntEnum):
    """Where the nose points on an orbit flown in hover; numbers of MAVLink's ORBIT_YAW_BEHAVIOUR."""

    CENTRE = 0
    INITIAL_HEADING = 1
    UNCONTROLLED = 2
    TRACK = 3


class Orbit(Manoeuvre):
    """Circles a centre, hovering or on the wing."""

    def start(
        self,
        view: View,
        centre: Place,
        down: float,
        radius: float,
        *,
        cruise: bool,
        speed: float | None = None,
        yaw: YawBehaviour = YawBehaviour.CENTRE,
    ) -> None:
        """Begin around `centre` at `down` and `radius` [m], clockwise if positive, at `speed` or the usual one."""
        self.usual_speeds()
        self.cruise = cruise
        self.centre, self.down, self.radius, self.yaw = centre, down, radius, yaw
        self.heading = view.yaw
        if speed is not None:
            if cruise:
                self.airspeed = speed
            else:
                self.ground_speed = speed

    def update(self, view: View) -> bool:
        """Ask for the next moment of it; never done: False."""
        self.demand.circle((*self.centre, self.down), self.radius, speed=self.speed, cruise=self.cruise)
        if not self.cruise:
            if self.yaw == YawBehaviour.CENTRE:
                self.demand.heading(math.atan2(self.centre[1] - view.east, self.centre[0] - view.north))
            elif self.yaw == YawBehaviour.INITIAL_HEADING:
                self.demand.heading(self.heading)
        return False
