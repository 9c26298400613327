"""What the steps of a mission share: the regime, the speeds and the place flown from, and how they reach the Demand."""

import math
from collections.abc import Callable
from enum import IntEnum

from sitl.flight.demand import Demand
from sitl.flight.mission_items import MissionItem, place_of
from sitl.flight.parameters import Parameters
from sitl.flight.places import LocalFrame, Ned
from sitl.flight.view import View
from vehicle_model.earth import STANDARD_GRAVITY

__all__ = ["MissionPilot", "Say", "SpeedType"]

Say = Callable[[int, str], None]  # severity as MAV_SEVERITY, text


class SpeedType(IntEnum):
    """Which speed DO_CHANGE_SPEED sets; MAVLink's SPEED_TYPE."""

    AIRSPEED = 0
    GROUND_SPEED = 1
    CLIMB = 2
    DESCENT = 3


class MissionPilot:
    """Flies what a step asks for, in the regime wanted and at the speeds in force.

    Attributes:
        cruise: wing-borne flight is wanted; otherwise hover.
        came_from: where the leg being flown began [m]; its height is the one held by what names no other.
        heading: of the nose in hover [rad]; not a number: free.
    """

    def __init__(self, parameters: Parameters, places: LocalFrame, demand: Demand, say: Say) -> None:
        self.parameters, self.places, self.demand, self.say = parameters, places, demand, say
        self.cruise = False
        self.came_from: Ned = (0.0, 0.0, 0.0)
        self.heading = math.nan
        self._speeds: dict[tuple[bool, SpeedType], float] = {}
        self._limited_for: bool | None = None
        self._asked: tuple[object, ...] = ()
        parameters.on_change.append(lambda _: self.forget())

    def forget(self) -> None:
        """Ask for everything again: someone else may have asked for something in between, or a limit has changed."""
        self._limited_for = None
        self._asked = ()

    def begin(self, view: View) -> None:
        """The mission starts here, with the speeds of the parameters."""
        self.came_from = (view.north, view.east, view.down)
        self.heading = math.nan
        self._speeds.clear()

    def change_speed(self, kind: SpeedType, speed: float) -> None:
        """Fly at this speed [m/s] in the regime wanted now; -2: that of the parameters again, -1: no change.

        An airspeed and a ground speed for wing-borne flight replace each other. In hover both are over the ground.
        """
        if speed == -1.0:
            return
        self.forget()
        if kind in (SpeedType.AIRSPEED, SpeedType.GROUND_SPEED):
            self._speeds.pop((self.cruise, SpeedType.AIRSPEED), None)
            self._speeds.pop((self.cruise, SpeedType.GROUND_SPEED), None)
            if not self.cruise:
                kind = SpeedType.GROUND_SPEED
        if speed >= 0.0:
            self._speeds[self.cruise, kind] = speed
        else:
            self._speeds.pop((self.cruise, kind), None)

    def airspeed(self, view: View) -> float:
        """True airspeed to fly at on the wing [m/s]; what gives a wanted ground speed along the present track."""
        parameters = self.parameters
        ground = self._speeds.get((True, SpeedType.GROUND_SPEED))
        if ground is None:
            wanted = self._speeds.get((True, SpeedType.AIRSPEED), parameters["FW_AIRSPD_TRIM"])
        else:
            over_ground = max(math.hypot(view.vn, view.ve), 1e-3)
            wanted = math.hypot(
                ground * view.vn / over_ground - view.wind_north, ground * view.ve / over_ground - view.wind_east
            )
        return min(max(wanted, parameters["FW_AIRSPD_MIN"]), parameters["FW_AIRSPD_MAX"])

    def hover_speed(self) -> float:
        """Largest ground speed in hover [m/s]."""
        wanted = self._speeds.get((False, SpeedType.GROUND_SPEED), self.parameters["MPC_XY_CRUISE"])
        return min(wanted, self.parameters["MPC_XY_VEL_MAX"])

    def speed(self, view: View) -> float:
        """Speed in the regime wanted [m/s]."""
        return self.airspeed(view) if self.cruise else self.hover_speed()

    def limits(self) -> None:
        """Give the laws the rates and the bank of the regime wanted; DO_CHANGE_SPEED may have set the rates."""
        parameters, cruise = self.parameters, self.cruise
        if cruise is self._limited_for:
            return
        self._limited_for = cruise
        up, down = ("FW_T_CLMB_MAX", "FW_T_SINK_MAX") if cruise else ("MPC_Z_V_AUTO_UP", "MPC_Z_V_AUTO_DN")
        climb, sink = parameters[up], parameters[down]
        if self._speeds:
            most_up, most_down = (up, down) if cruise else ("MPC_Z_VEL_MAX_UP", "MPC_Z_VEL_MAX_DN")
            climb = min(self._speeds.get((cruise, SpeedType.CLIMB), climb), parameters[most_up])
            sink = min(self._speeds.get((cruise, SpeedType.DESCENT), sink), parameters[most_down])
        self.demand.limits(climb_rate=climb, sink_rate=sink, max_bank=math.radians(parameters["FW_R_LIM"]))

    def turn_radius(self, view: View) -> float:
        """Radius [m] of the tightest circle on the wing that FW_R_LIM allows in this wind, down-wind side included."""
        over_ground = self.airspeed(view) + math.hypot(view.wind_north, view.wind_east)
        return over_ground * over_ground / (STANDARD_GRAVITY * math.tan(math.radians(self.parameters["FW_R_LIM"])))

    def height_tolerance(self) -> float:
        """Height error within which a place is reached [m]."""
        return self.parameters["NAV_FW_ALT_RAD" if self.cruise else "NAV_MC_ALT_RAD"]

    def place(self, item: MissionItem, view: View) -> Ned:
        """Where an item leads to [m]; what it leaves open is where the vehicle is and the height being flown."""
        return place_of(item, self.places, (view.north, view.east, self.came_from[2]))

    def leg(self, view: View, start: Ned, end: Ned, heading: float) -> None:
        """Along a line; `heading` [rad] or not a number is the nose's in hover."""
        speed = self.speed(view)
        if self._is_new(start, end, speed):
            self.demand.leg(start, end, speed=speed, cruise=self.cruise)
            self._nose(heading)

    def point(self, place: Ned, heading: float) -> None:
        """To a point in hover, to stay there; `heading` [rad] or not a number is the nose's."""
        self.demand.point(place, speed=self.hover_speed())
        self._nose(heading)

    def circle(self, view: View, centre: Ned, radius: float) -> None:
        """Around a centre."""
        speed = self.speed(view)
        if self._is_new(centre, radius, speed):
            self.demand.circle(centre, radius, speed=speed, cruise=self.cruise)

    def _is_new(self, *asked: object) -> bool:
        """Whether this is not what was asked for just before: on the wing the same need not be written again.

        In hover it must: near the ground the setpoint's thrust limit is lowered, and writing it anew restores it.
        """
        if self.cruise and asked == self._asked:
            return False
        self._asked = asked if self.cruise else ()
        return True

    def _nose(self, heading: float) -> None:
        if self.cruise:
            return
        if not math.isnan(heading):
            self.demand.heading(heading)
        elif self.parameters["WV_EN"]:
            self.demand.weathervane()
        elif not math.isnan(self.heading):
            self.demand.heading(self.heading)
