"""Steps of a mission that fly somewhere and stay there: waypoints, loiters, delays, turns on the spot.

A step is made when its item's turn comes, so that it sees home, wind and speed as they are then. Parameters mean what
MAVLink's `common.xml` says of the item's command.
"""

import math
from dataclasses import dataclass

from sitl.flight.landed import LandedState
from sitl.flight.manoeuvres import Hold
from sitl.flight.messages import Severity
from sitl.flight.mission_items import Command, MissionItem
from sitl.flight.mission_pilot import MissionPilot
from sitl.flight.places import Ned
from sitl.flight.view import View
from vehicle_model.earth import STANDARD_GRAVITY

__all__ = ["Ahead", "Loiter", "Stay", "Step", "Turn", "Waypoint", "angle_between", "given"]

CORNER_BANK = math.tan(math.radians(30.0))  # of the turn from one leg into the next
SHARPEST = math.tan(math.radians(60.0))  # tangent of half the sharpest turn that is begun before its waypoint
STILL = 1.0  # ground speed of a vehicle that has stopped at a place [m/s]
ON_COURSE = math.radians(10.0)  # course error with which a loiter is left towards the next place
HEADED = math.radians(5.0)  # heading error with which a turn on the spot is done
ENTRY = 2.0  # distance from a circle at which its tangent has met it [m]
TURN_RATE = math.radians(30.0)  # of a turn on the spot whose item names none [rad/s]


@dataclass(frozen=True, slots=True)
class Ahead:
    """What comes after a step."""

    place: Ned | None  # the next place to fly to [m]
    flows: bool  # whether it is flown to at once, so that this step's place need not be stopped at


class Step:
    """One item being flown."""

    def __init__(self, pilot: MissionPilot, ahead: Ahead) -> None:
        self.pilot, self.ahead = pilot, ahead
        pilot.forget()

    @property
    def landing(self) -> bool:
        """Whether it is about to meet the ground."""
        return False

    def look_ahead(self, ahead: Ahead) -> None:
        """Something else comes after it than was thought."""
        self.ahead = ahead

    def update(self, view: View, landed: LandedState) -> bool:
        """Ask the control laws for the next moment of it; True once it is done."""
        raise NotImplementedError

    def distance(self, view: View) -> float:
        """Horizontal distance [m] still to go to the step's place."""
        _ = view
        return 0.0


class Waypoint(Step):
    """Flies to a place along the line from the one before, and past it or to a stop there.

    On the wing the next leg begins where a turn of 30 deg bank joins the two, no later than abeam of the place; with a
    hold time, or where the height is not reached yet, the vehicle circles the place. In hover it stops there if there
    is a hold time or nowhere to go on to. `needs_height` False lets the next item have the rest of the climb.
    """

    def __init__(
        self, pilot: MissionPilot, ahead: Ahead, item: MissionItem, view: View, *, needs_height: bool = True
    ) -> None:
        super().__init__(pilot, ahead)
        self.start = pilot.came_from
        self._place = pilot.place(item, view)
        self._pass_by = given(item.param3)
        self.acceptance = item.param2 if item.param2 > 0.0 else pilot.parameters["NAV_ACC_RAD"]
        self.hold = given(item.param1)
        self.heading = math.radians(item.param4)
        self._needs_height = needs_height
        self._there = False
        self._since = math.nan
        self.look_ahead(ahead)

    def look_ahead(self, ahead: Ahead) -> None:
        """Aim: the leg's direction, its end moved abeam to pass the place at a radius, and the turn after it."""
        self.ahead, self.end = ahead, self._place
        self._stops = self.hold > 0.0 or not ahead.flows
        north, east = self.end[0] - self.start[0], self.end[1] - self.start[1]
        self.length = math.hypot(north, east)
        self._along = (north / self.length, east / self.length) if self.length > 1e-3 else (0.0, 0.0)
        if not self._stops:
            # Clockwise around the place means passing it on its left.
            by_north, by_east = self._pass_by * self._along[1], -self._pass_by * self._along[0]
            self.end = (self.end[0] + by_north, self.end[1] + by_east, self.end[2])
        self._half_turn, self._room = 0.0, 0.0
        if self.ahead.flows and self.ahead.place is not None and self.length > 1e-3:
            onward = self.ahead.place[0] - self.end[0], self.ahead.place[1] - self.end[1]
            turn = angle_between(math.atan2(onward[1], onward[0]), math.atan2(east, north))
            self._half_turn = min(math.tan(min(0.5 * abs(turn), 1.5)), SHARPEST)
            self._room = 0.5 * min(self.length, math.hypot(*onward))

    def distance(self, view: View) -> float:
        """As the base says."""
        return math.hypot(self.end[0] - view.north, self.end[1] - view.east)

    def update(self, view: View, landed: LandedState) -> bool:
        """As the base says."""
        _ = landed
        pilot = self.pilot
        high_enough = not self._needs_height or abs(view.down - self.end[2]) <= pilot.height_tolerance()
        if self._there:
            done = self._stay(view, high_enough)
        else:
            self._there = self._approach(view)
            done = self._there and high_enough and self.hold == 0.0 and (pilot.cruise or not self._stops)
        if done:
            pilot.came_from = self.end
        return done

    def _approach(self, view: View) -> bool:
        pilot, north, east = self.pilot, self.end[0] - view.north, self.end[1] - view.east
        near = north * north + east * east <= self.acceptance * self.acceptance
        if self._stops and not pilot.cruise:
            pilot.point(self.end, self.heading)
            return near and view.vn * view.vn + view.ve * view.ve <= STILL * STILL
        pilot.leg(view, self.start, self.end, self.heading)
        to_go = north * self._along[0] + east * self._along[1]
        early = 0.0
        if pilot.cruise and not self._stops:
            radius = (view.vn * view.vn + view.ve * view.ve) / (STANDARD_GRAVITY * CORNER_BANK)
            early = min(radius * self._half_turn, self._room)
        return near or to_go <= early

    def _stay(self, view: View, high_enough: bool) -> bool:
        pilot = self.pilot
        if pilot.cruise:
            pilot.circle(view, self.end, pilot.parameters["NAV_LOITER_RAD"])
        else:
            pilot.point(self.end, self.heading)
        if high_enough and math.isnan(self._since):
            self._since = view.time
        return view.time - self._since >= self.hold


class Loiter(Step):
    """Circles a place on the wing, or hovers over it; LOITER_TURNS circles in hover too.

    Time and turns count from when the circle (or, in hover, the place) and its height are reached. If the item requires
    a heading, a circle is left where the track points to the next place, or after one more turn if it never does.
    """

    def __init__(self, pilot: MissionPilot, ahead: Ahead, item: MissionItem, view: View) -> None:
        super().__init__(pilot, ahead)
        self.command = Command(item.command)
        self.centre = pilot.place(item, view)
        to_altitude = self.command == Command.LOITER_TO_ALT
        self._amount = given(item.param1)  # seconds or turns
        self._heads_out = given(item.param1 if to_altitude else item.param2) != 0.0
        self._from_centre = item.param4 == 0.0
        self._heading = math.radians(item.param4) if self.command == Command.LOITER_UNLIM else math.nan
        self.radius = given(item.param2 if to_altitude else item.param3) or pilot.parameters["NAV_LOITER_RAD"]
        self._widen(view)
        self._entry = self._tangent(view)
        self._since = math.nan
        self._turned = 0.0
        self._bearing = math.nan
        self._leaves_by = math.inf

    def _widen(self, view: View) -> None:
        """The smallest circle that can be kept in this wind, if the item wants a smaller one."""
        least = self.pilot.turn_radius(view)
        if self.pilot.cruise and abs(self.radius) < least:
            text = f"Loiter radius {abs(self.radius):.0f} m is too tight in this wind: flying {least:.0f} m"
            self.pilot.say(Severity.INFO, text)
            self.radius = math.copysign(least, self.radius)

    def _tangent(self, view: View) -> tuple[Ned, Ned] | None:
        """The straight way onto the circle, that meets it in its direction; None where the vehicle is about there."""
        north, east, down = self.centre
        distance = self.distance(view)
        if distance <= abs(self.radius) + self.pilot.parameters["NAV_ACC_RAD"]:
            return None
        aside = math.asin(self.radius / distance)  # clockwise: the centre stays on the right
        course = math.atan2(east - view.east, north - view.north) - aside
        length = distance * math.cos(aside)
        meets = (view.north + length * math.cos(course), view.east + length * math.sin(course), down)
        return (view.north, view.east, down), meets

    def distance(self, view: View) -> float:
        """As the base says."""
        return math.hypot(self.centre[0] - view.north, self.centre[1] - view.east)

    def update(self, view: View, landed: LandedState) -> bool:
        """As the base says."""
        _ = landed
        pilot = self.pilot
        circles = pilot.cruise or self.command == Command.LOITER_TURNS
        if circles and self._entry is not None:
            pilot.leg(view, *self._entry, math.nan)
            if self.distance(view) <= abs(self.radius) + ENTRY or passed(view, *self._entry):
                self._entry = None
        elif circles:
            pilot.circle(view, self.centre, self.radius)
        else:
            pilot.point(self.centre, self._heading)
        if math.isnan(self._since):
            near = self.distance(view) <= (abs(self.radius) if circles else 0.0) + pilot.parameters["NAV_ACC_RAD"]
            if near and abs(view.down - self.centre[2]) <= pilot.height_tolerance():
                self._since = view.time
            return False
        self._count(view)
        if not self._complete(view) or not self._may_leave(view, circles):
            return False
        pilot.came_from = self.centre if self._from_centre or not circles else (view.north, view.east, self.centre[2])
        return True

    def _count(self, view: View) -> None:
        bearing = math.atan2(view.east - self.centre[1], view.north - self.centre[0])
        if not math.isnan(self._bearing):
            self._turned += math.copysign(1.0, self.radius) * angle_between(bearing, self._bearing)
        self._bearing = bearing

    def _complete(self, view: View) -> bool:
        if self.command == Command.LOITER_TIME:
            return view.time - self._since >= self._amount
        if self.command == Command.LOITER_TURNS:
            return self._turned >= 2.0 * math.pi * self._amount
        return self.command == Command.LOITER_TO_ALT

    def _may_leave(self, view: View, circles: bool) -> bool:
        if not (circles and self._heads_out) or self.ahead.place is None:
            return True
        self._leaves_by = min(self._leaves_by, self._turned + 2.0 * math.pi)
        onward = math.atan2(self.ahead.place[1] - view.east, self.ahead.place[0] - view.north)
        off_course = angle_between(onward, math.atan2(view.ve, view.vn))
        return abs(off_course) <= ON_COURSE or self._turned >= self._leaves_by


class Stay(Step):
    """Waits where the vehicle is, hovering or circling, for a time [s] that may be infinite."""

    def __init__(self, pilot: MissionPilot, ahead: Ahead, seconds: float, view: View) -> None:
        super().__init__(pilot, ahead)
        self._until = view.time + seconds
        self._hold = Hold(pilot.parameters, pilot.demand)
        self._begin(view)

    def _begin(self, view: View) -> None:
        pilot = self.pilot
        heading = None if math.isnan(pilot.heading) else pilot.heading
        north, east, down = pilot.came_from
        stands = not pilot.cruise and math.hypot(north - view.north, east - view.east) < pilot.parameters["NAV_ACC_RAD"]
        point = (north, east) if stands else None  # rather the place stopped at than where the wind has it now
        self._hold.start(view, pilot.cruise, point=point, down=down, heading=heading)

    def update(self, view: View, landed: LandedState) -> bool:
        """As the base says."""
        pilot = self.pilot
        if landed == LandedState.ON_GROUND:
            pilot.demand.idle()
        else:
            if self._hold.cruise != pilot.cruise:
                self._begin(view)
            self._hold.airspeed = pilot.airspeed(view)
            self._hold.update(view)
        if view.time < self._until:
            return False
        pilot.came_from = (view.north, view.east, pilot.came_from[2])
        return True


class Turn(Step):
    """CONDITION_YAW: turns the nose on the spot, at a rate and in a direction if they are given.

    On the wing the nose follows the airflow: there the item does nothing.
    """

    def __init__(self, pilot: MissionPilot, ahead: Ahead, item: MissionItem, view: View) -> None:
        super().__init__(pilot, ahead)
        angle = math.radians(item.param1)
        way = given(item.param3)
        if given(item.param4):
            turn = angle if way >= 0.0 else -angle
        else:
            turn = angle_between(angle, view.yaw)
            if way * turn < 0.0:
                turn += math.copysign(2.0 * math.pi, way)
        self._place = pilot.came_from
        self._from, self._turn, self._began = view.yaw, turn, view.time
        self._rate = math.radians(item.param2) if item.param2 > 0.0 else TURN_RATE
        if pilot.cruise:
            pilot.say(Severity.INFO, "Heading cannot be chosen wing-borne: item passed over")
        else:
            pilot.heading = math.remainder(self._from + turn, 2.0 * math.pi)

    def update(self, view: View, landed: LandedState) -> bool:
        """As the base says."""
        _ = landed
        pilot = self.pilot
        if pilot.cruise:
            return True
        turned = math.copysign(min(self._rate * (view.time - self._began), abs(self._turn)), self._turn)
        pilot.point(self._place, self._from + turned)
        return turned == self._turn and abs(angle_between(pilot.heading, view.yaw)) <= HEADED


def angle_between(to: float, start: float) -> float:
    """The shorter turn from one direction to another [rad]."""
    return math.remainder(to - start, 2.0 * math.pi)


def given(parameter: float) -> float:
    """A parameter's value, zero where it is unset."""
    return 0.0 if math.isnan(parameter) else parameter


def passed(view: View, start: Ned, end: Ned) -> bool:
    """Whether the vehicle is beyond the plane through the end of a leg, square to it."""
    north, east = end[0] - start[0], end[1] - start[1]
    return (view.north - end[0]) * north + (view.east - end[1]) * east >= 0.0
