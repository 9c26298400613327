"""The mission: its items one after the other, jumps and conditions between them, pause, continue, change in flight.

A NAV item is flown; a DO item happens at once; a CONDITION holds back the commands after it. When those are DO items
the vehicle meanwhile flies to the next NAV item, and they happen on the way, at the latest when it is done. A
CONDITION_DELAY with a NAV item after it keeps the vehicle where it is.
Source: MAVLink guide, services/mission; MAV_CMD in MAVLink's `common.xml`.
"""

import math
from collections.abc import Sequence

from sitl.flight.demand import Demand
from sitl.flight.feasibility import Problem, check
from sitl.flight.geofence import Fence
from sitl.flight.landed import LandedState
from sitl.flight.messages import Severity
from sitl.flight.mission_ends import VTOL_FIXED_WING, Climb, GoHome, GroundTakeoff, Land, ToCruise, ToHover, VtolTakeoff
from sitl.flight.mission_items import (
    CONDITIONS,
    FLOWN,
    LOITERS,
    PLACED,
    Command,
    Frame,
    MissionItem,
    begins_with_home,
    place_of,
)
from sitl.flight.mission_pilot import MissionPilot, Say, SpeedType
from sitl.flight.mission_steps import Ahead, Loiter, Stay, Step, Turn, Waypoint
from sitl.flight.parameters import Parameters
from sitl.flight.places import LocalFrame, Ned
from sitl.flight.view import View

__all__ = ["InfeasibleMissionError", "Mission"]

TAKEOFFS = (Command.TAKEOFF, Command.VTOL_TAKEOFF)
AT_ONCE = 100  # most items that happen within one update


class InfeasibleMissionError(ValueError):
    """A mission that cannot be flown; `problems` lists the items and the reasons."""

    def __init__(self, problems: list[Problem]) -> None:
        super().__init__("mission refused: " + "; ".join(map(str, problems)))
        self.problems = problems


class Mission:
    """Flies a list of items by writing to the Demand.

    Attributes:
        items: the mission as loaded.
        current: number of the item being flown, or to be flown next.
        reached: numbers of items done, in order, until someone takes them out.
        finished: no item is left; the vehicle stays where it is.
        paused: an item without autocontinue is done; the vehicle stays where it is until `resume`.
        landed_state: whether the vehicle stands or flies, kept up to date by the flight before each update.
        fence: missions must keep inside it; None: there is none.
    """

    def __init__(
        self, parameters: Parameters, places: LocalFrame, demand: Demand, say: Say, fence: Fence | None = None
    ) -> None:
        """`say` takes messages to the pilot: MAV_SEVERITY and text."""
        self._parameters, self._places, self._say = parameters, places, say
        self.fence = fence
        self.landed_state = LandedState.ON_GROUND
        self._pilot = MissionPilot(parameters, places, demand, say)
        self.items: tuple[MissionItem, ...] = ()
        self.reached: list[int] = []
        self._reset(0)

    def _reset(self, index: int) -> None:
        self.current = index
        self.finished = self.paused = False
        self._step: Step | None = None
        self._lift: Climb | None = None
        self._jumped: dict[int, int] = {}
        self._changed = False
        self._held_back: list[int] = []
        self._holding_since = math.nan

    @property
    def cruise(self) -> bool:
        """Whether wing-borne flight is wanted; set it to fly on in the other regime."""
        return self._pilot.cruise

    @cruise.setter
    def cruise(self, cruise: bool) -> None:
        self._pilot.cruise = cruise

    def problems(self) -> list[Problem]:
        """What keeps the loaded mission from being flown with home, fence and parameters as they are now."""
        return check(self.items, self._places, self._parameters, self.fence)

    def load(self, items: Sequence[MissionItem]) -> None:
        """Replace the mission. If it is being flown and the item being flown is in its place still, that goes on.

        Otherwise the new mission begins at its first item. Raises InfeasibleMissionError, and keeps the old mission.
        """
        problems = check(items, self._places, self._parameters, self.fence)
        if problems:
            raise InfeasibleMissionError(problems)
        begun = self._step is not None or self._lift is not None
        old = self.items[self.current] if begun and not self.finished else None
        self.items = tuple(items)
        goes_on = old is not None and self.current < len(items) and items[self.current].same_as(old)
        if not goes_on:
            self._reset(0)
        self._changed = goes_on
        if any(item.command in PLACED and Frame(item.frame).above_terrain for item in items):
            self._say(Severity.INFO, "Mission: the ground is flat, heights above terrain are heights above home")

    def keep(self, other: "Mission") -> None:
        """Have the items of another flight's mission, from the first one on."""
        self.items = other.items
        self._reset(0)

    def start(self, view: View, first: int = 0, *, cruise: bool) -> None:
        """Begin at an item, with the usual speeds, wing-borne or hovering; raises ValueError if there is none."""
        self._check_number(first)
        self._reset(first)
        self._pilot.cruise = cruise
        self._pilot.begin(view)

    def resume(self, view: View, *, cruise: bool) -> None:
        """Go on with the current item from where the vehicle is, wing-borne or hovering."""
        self._pilot.cruise = cruise
        self._pilot.came_from = (view.north, view.east, view.down)
        self._pilot.forget()
        self._step = None
        if self._lift is not None:
            self._lift = Climb(self._pilot, self._lift.down, view)
        self.paused = False

    def jump_to(self, index: int) -> None:
        """Go on with this item, at once if the mission is being flown; raises ValueError if there is none.

        Jumps go on counting their repeats.
        """
        self._check_number(index)
        jumped = self._jumped
        self._reset(index)
        self._jumped = jumped

    def reset_jumps(self) -> None:
        """Let every jump count its repeats anew."""
        self._jumped.clear()

    def change_speed(self, kind: SpeedType, speed: float) -> None:
        """As the item DO_CHANGE_SPEED does [m/s]."""
        self._pilot.change_speed(kind, speed)

    def land_start_index(self) -> int | None:
        """Number of the item where the mission's landing begins (DO_LAND_START), None without one."""
        return next((i for i, item in enumerate(self.items) if item.command == Command.DO_LAND_START), None)

    @property
    def landing(self) -> bool:
        """Whether the item being flown is about to meet the ground."""
        return self._step is not None and self._step.landing

    def update(self, view: View) -> None:
        """Ask the control laws for the next moment of the mission."""
        landed = self.landed_state
        self._pilot.limits()
        if self._step is None and self._lift is None:
            self._proceed(view, landed)
        if self._lift is not None:
            if not self._lift.update(view, landed):
                return
            self._lift = None
            self._begin(view)
        if self._step is None:
            return
        if self._changed:
            self._changed = False
            self._step.look_ahead(self._ahead(view))
        if self._held_back:
            self._release(view, self._step.distance(view))
        if self._step.update(view, landed) and not (self.finished or self.paused):
            self._done(view)

    def _done(self, view: View) -> None:
        """Go over to the next item."""
        if self._held_back:
            self._release(view, -math.inf)
        self.reached.append(self.current)
        if self.items[self.current].autocontinue or self.current + 1 == len(self.items):
            self._step = None
        else:
            self.paused = True
            self._step = Stay(self._pilot, Ahead(None, flows=False), math.inf, view)
            self._say(Severity.INFO, f"Mission paused after item {self.current}")
        self.current += 1

    def _proceed(self, view: View, landed: LandedState) -> None:
        """Carry out items up to the next one that takes time, and begin that."""
        for _ in range(AT_ONCE):
            if self.current >= len(self.items):
                self._finish(view)
                return
            if self.current == 0 and begins_with_home(self.items, self._places):
                self.reached.append(0)
                self.current = 1
            item = self.items[self.current]
            command = Command(item.command)
            if command in CONDITIONS:
                self._hold_back()
                command = Command(self.items[self.current].command) if self.current < len(self.items) else command
            if command in FLOWN or command == Command.CONDITION_DELAY:
                if landed == LandedState.ON_GROUND and command in PLACED and command not in TAKEOFFS:
                    self._lift = Climb(self._pilot, view.down - self._parameters["MIS_TAKEOFF_ALT"], view)
                else:
                    self._begin(view)
                return
            if command not in CONDITIONS:
                self.reached.append(self.current)
                self.current = self._perform(self.current, view)

    def _finish(self, view: View) -> None:
        self.finished = True
        self.current = max(len(self.items) - 1, 0)
        self._step = Stay(self._pilot, Ahead(None, flows=False), math.inf, view)
        self._say(Severity.INFO, "Mission finished")

    def _hold_back(self) -> None:
        """Put a condition and the DO items after it aside, if there are any, until they are released on the way."""
        first = self.current
        end = first + 1
        while end < len(self.items) and self._can_wait(end):
            end += 1
        alone = end == first + 1
        if alone and self.items[first].command == Command.CONDITION_DELAY:
            return
        self._held_back = list(range(first, end))
        self._holding_since = math.nan
        self.current = end

    def _can_wait(self, index: int) -> bool:
        command = self.items[index].command
        return command == Command.DO_VTOL_TRANSITION or not (command in FLOWN or command == Command.DO_JUMP)

    def _release(self, view: View, to_go: float) -> None:
        """Carry out what was held back, as far as its conditions are met; all of it at the end of the way (-inf)."""
        while self._held_back:
            index = self._held_back[0]
            item = self.items[index]
            if item.command == Command.CONDITION_DISTANCE and to_go > item.param1:
                return
            if item.command == Command.CONDITION_DELAY and to_go > -math.inf:
                if math.isnan(self._holding_since):
                    self._holding_since = view.time
                if view.time - self._holding_since < item.param1:
                    return
            self._holding_since = math.nan
            del self._held_back[0]
            self._perform(index, view)
            self.reached.append(index)

    def _perform(self, index: int, view: View) -> int:
        """Carry out an item that happens at once; returns the number of the item to go on with."""
        item, pilot = self.items[index], self._pilot
        if item.command == Command.DO_JUMP and self._jumps(index, self._jumped):
            return int(item.param1)
        if item.command == Command.DO_CHANGE_SPEED:
            self.change_speed(SpeedType(int(item.param1)), item.param2)
        elif item.command == Command.DO_CHANGE_ALTITUDE:
            in_frame = MissionItem(item.command, int(item.param2))
            pilot.came_from = (*pilot.came_from[:2], in_frame.down(item.param1, self._places))
        elif item.command == Command.DO_SET_HOME:
            home = self._places.home
            below = (view.north, view.east, home.down)  # the ground is as high as home, all over
            home.move(*(below if item.param1 == 1.0 else place_of(item, self._places, below)))
        elif item.command == Command.DO_VTOL_TRANSITION:
            self.cruise = item.param1 == VTOL_FIXED_WING
        return index + 1

    def _jumps(self, index: int, jumped: dict[int, int]) -> bool:
        """Whether a DO_JUMP has repeats left; counts the one it takes."""
        times = jumped.get(index, 0)
        if 0 <= self.items[index].param2 <= times:
            return False
        jumped[index] = times + 1
        return True

    def _begin(self, view: View) -> None:
        """Begin the current item."""
        item, pilot, ahead = self.items[self.current], self._pilot, self._ahead(view)
        command = Command(item.command)
        if command == Command.WAYPOINT:
            self._step = Waypoint(pilot, ahead, item, view)
        elif command in LOITERS:
            self._step = Loiter(pilot, ahead, item, view)
        elif command == Command.TAKEOFF:
            self._step = GroundTakeoff(pilot, ahead, item, view)
        elif command == Command.VTOL_TAKEOFF:
            self._step = VtolTakeoff(pilot, ahead, item, view)
        elif command in (Command.LAND, Command.VTOL_LAND):
            approaches = command == Command.VTOL_LAND and not math.isnan(item.param3) and item.param3 != 0.0
            approach = item.down(item.param3, self._places) if approaches else math.nan
            self._step = Land(pilot, ahead, item, view, approach)
        elif command == Command.CONDITION_YAW:
            self._step = Turn(pilot, ahead, item, view)
        elif command == Command.DO_VTOL_TRANSITION:
            to_cruise = item.param1 == VTOL_FIXED_WING
            self._step = ToCruise(pilot, ahead, view) if to_cruise else ToHover(pilot, ahead, view)
        elif command == Command.RETURN_TO_LAUNCH:
            self._step = GoHome(pilot, ahead, view)
        else:
            self._step = Stay(pilot, ahead, item.param1, view)

    def _ahead(self, view: View) -> Ahead:
        """What comes after the current item, jumps taken as they will be."""
        jumped = dict(self._jumped)
        index, flows, first = self.current + 1, False, True
        for _ in range(AT_ONCE):
            if index >= len(self.items):
                break
            item = self.items[index]
            if item.command == Command.DO_JUMP and self._jumps(index, jumped):
                index = int(item.param1)
                continue
            if item.command in FLOWN or item.command == Command.CONDITION_DELAY:
                if item.command in PLACED:
                    flows = first and item.command not in TAKEOFFS and self.items[self.current].autocontinue
                    return Ahead(None if item.here else self._pilot.place(item, view), flows)
                if item.command == Command.RETURN_TO_LAUNCH:
                    return Ahead(self._home(), flows=False)
                first = False
            index += 1
        return Ahead(None, flows=False)

    def _home(self) -> Ned:
        home = self._places.home
        return home.north, home.east, home.down

    def _check_number(self, index: int) -> None:
        if not 0 <= index < len(self.items):
            msg = f"mission item: expected 0 to {len(self.items) - 1}, got {index}" if self.items else "no mission"
            raise ValueError(msg)
