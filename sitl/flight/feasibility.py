"""Whether a mission can be flown, item by item, looked at when it is uploaded: each problem with its reason."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import accumulate

from sitl.flight.geofence import Fence
from sitl.flight.mission_ends import VTOL_FIXED_WING, VTOL_MULTICOPTER, TransitionHeading
from sitl.flight.mission_items import (
    FLOWN,
    LOITERS,
    PLACED,
    Command,
    Frame,
    MissionItem,
    begins_with_home,
    place_of,
)
from sitl.flight.mission_pilot import SpeedType
from sitl.flight.parameters import Parameters
from sitl.flight.places import LocalFrame

__all__ = ["LARGEST_RADIUS", "Problem", "check", "unsupported"]

Wrong = tuple[str, str]  # the field of an item that is wrong, and the reason

LONGEST_TIME = 1e6  # [s]
LARGEST_RADIUS = 10000.0  # of a loiter, orbit or acceptance [m]
TAKEOFFS = (Command.TAKEOFF, Command.VTOL_TAKEOFF)
LANDINGS = (Command.LAND, Command.VTOL_LAND)
VALUES = ("param1", "param2", "param3", "param4", "x", "y", "z")
ENDS = (*LANDINGS, Command.RETURN_TO_LAUNCH)  # after which the vehicle stands


@dataclass(frozen=True, slots=True)
class Problem:
    """What is wrong with an item; index -1 is the mission as a whole.

    `field` names the field of MissionItem that is wrong, where it is one.
    """

    index: int
    reason: str
    field: str = ""

    def __str__(self) -> str:
        return self.reason if self.index < 0 else f"item {self.index}: {self.reason}"


def check(
    items: Sequence[MissionItem], places: LocalFrame, parameters: Parameters, fence: Fence | None = None
) -> list[Problem]:
    """All that keeps a mission from being flown; an empty list if nothing does, as of one without items.

    An item's own problems come first: what concerns the course of the mission is looked at when there are none.
    """
    first = int(begins_with_home(items, places))  # the first item that is flown
    flown = [0, *accumulate(item.command in FLOWN and i >= first for i, item in enumerate(items))]
    problems: list[Problem] = []
    for index, item in enumerate(items):
        found = unsupported(item)
        if found is not None:
            problems.append(Problem(index, found[1], found[0]))
            continue
        wrong = _off_map(item) if index < first else _of_item(index, item, flown, places, fence)
        problems += [Problem(index, reason, field) for field, reason in wrong]
    return problems or (list(_of_course(items, first, places, parameters)) if items else [])


def unsupported(item: MissionItem) -> Wrong | None:
    """What no mission could hold, wherever the item stood in it: the field that is wrong, and the reason.

    A command or a frame that is not known, a value that is infinite.
    """
    try:
        command = Command(item.command)
    except ValueError:
        return "command", f"command {item.command} is not supported"
    for number, name in enumerate(VALUES):
        value = getattr(item, name)
        if math.isinf(value):
            return name, f"param{number + 1}: expected a finite number, got {value}"
    if command not in PLACED and (command != Command.DO_SET_HOME or item.here or item.param1 == 1.0):
        return None
    try:
        frame = Frame(item.frame)
    except ValueError:
        return "frame", f"frame {item.frame} is not supported"
    if not (frame.above_sea or frame.above_home):
        return "frame", f"frame {frame.name} is not supported for places, expected a GLOBAL one"
    return None


def _of_item(
    index: int, item: MissionItem, flown: Sequence[int], places: LocalFrame, fence: Fence | None
) -> Iterator[Wrong]:
    """Problems that an item has by itself; `flown` counts the items to fly before each index."""
    command = Command(item.command)
    if command in PLACED:
        yield from _of_place(command, item, places, fence)
    if command in LOITERS:
        yield from _of_loiter(command, item)
    elif command == Command.DO_JUMP:
        yield from _of_jump(index, item, flown)
    else:
        yield from _of_parameters(command, item)


def _off_map(item: MissionItem) -> Iterator[Wrong]:
    if math.isnan(item.x) != math.isnan(item.y):
        field = "x" if math.isnan(item.x) else "y"
        yield field, f"expected both latitude and longitude or neither, got {item.x}, {item.y}"
    elif abs(item.x) > 90.0 or abs(item.y) > 180.0:
        field = "x" if abs(item.x) > 90.0 else "y"
        yield field, f"expected a latitude within +-90 deg and a longitude within +-180 deg, got {item.x}, {item.y}"


def _of_place(command: Command, item: MissionItem, places: LocalFrame, fence: Fence | None) -> Iterator[Wrong]:
    off_map = list(_off_map(item))
    if off_map:
        yield from off_map
        return
    if command == Command.WAYPOINT and item.x == item.y == 0.0:
        yield "x", "a waypoint needs latitude and longitude, got 0, 0"
        return
    home = places.home
    place = place_of(item, places, (home.north, home.east, home.down - 1.0))
    height = home.down - place[2]
    if height < 0.0 or (height == 0.0 and command not in LANDINGS):
        yield "z", f"altitude: expected one above the ground, got {height:g} m above home"
    if fence is None:
        return
    reason = fence.breach_above(place[2])
    if reason is not None:
        yield "z", f"outside the geofence: {reason}"
        return
    reason = None if item.here else fence.breach_at(*place[:2])
    if reason is not None:
        yield "", f"outside the geofence: {reason}"


def _of_loiter(command: Command, item: MissionItem) -> Iterator[Wrong]:
    to_altitude = command == Command.LOITER_TO_ALT
    radius = item.param2 if to_altitude else item.param3
    if abs(radius) > LARGEST_RADIUS:
        field = "param2" if to_altitude else "param3"
        yield field, f"radius: expected at most {LARGEST_RADIUS:g} m, got {radius:g} m"
    if command == Command.LOITER_TURNS and not 0.0 < item.param1 <= 1000.0:
        yield "param1", f"turns: expected more than 0 and at most 1000, got {item.param1:g}"
    if command == Command.LOITER_TIME and not 0.0 <= item.param1 <= LONGEST_TIME:
        yield "param1", f"time: expected 0 to {LONGEST_TIME:g} s, got {item.param1:g}"
    if command != Command.LOITER_UNLIM and not math.isnan(item.param4) and item.param4 not in (0.0, 1.0):
        yield "param4", f"exit (param4): expected 0 (centre), 1 (tangent) or none, got {item.param4:g}"


def _of_jump(index: int, item: MissionItem, flown: Sequence[int]) -> Iterator[Wrong]:
    target, times, last = item.param1, item.param2, len(flown) - 2
    if not 0.0 <= target <= last or target != math.floor(target) or target == index:
        yield "param1", f"jump: expected the number of another item, 0 to {last}, got {target:g}"
        return
    if not (times >= -1.0 and times == math.floor(times)):
        yield "param2", f"jump: expected a number of repeats, -1 for ever, got {times:g}"
        return
    if target < index and times != 0 and flown[index] == flown[int(target)]:
        yield "", f"jump: expected something to fly between items {int(target)} and {index}, got nothing"


def _of_parameters(command: Command, item: MissionItem) -> Iterator[Wrong]:
    """Problems with the parameters of items that are neither loiters nor jumps."""
    first, second = item.param1, item.param2
    if command == Command.WAYPOINT:
        if first < 0.0 or first > LONGEST_TIME:
            yield "param1", f"hold time: expected 0 to {LONGEST_TIME:g} s, got {first:g}"
        if second < 0.0 or second > LARGEST_RADIUS:
            yield "param2", f"acceptance radius: expected 0 to {LARGEST_RADIUS:g} m, got {second:g}"
    elif command == Command.VTOL_TAKEOFF:
        if not math.isnan(second) and second not in list(TransitionHeading):
            yield "param2", f"transition heading (param2): expected 0 to 4, got {second:g}"
        if second == TransitionHeading.SPECIFIED and math.isnan(item.param4):
            yield "param4", "transition heading: expected a heading in param4, got none"
    elif command == Command.DELAY:
        if first == -1.0:
            yield "param1", "delay until a time of day: a simulated flight has none; expected seconds in param1"
        elif not 0.0 <= first <= LONGEST_TIME:
            yield "param1", f"delay: expected 0 to {LONGEST_TIME:g} s, got {first:g}"
    elif command == Command.CONDITION_DELAY and not 0.0 <= first <= LONGEST_TIME:
        yield "param1", f"delay: expected 0 to {LONGEST_TIME:g} s, got {first:g}"
    elif command == Command.CONDITION_DISTANCE and not first >= 0.0:
        yield "param1", f"distance: expected 0 m or more, got {first:g}"
    elif command == Command.CONDITION_YAW:
        if not abs(first) <= 360.0:
            yield "param1", f"angle: expected 0 to 360 deg, got {first:g}"
        if not math.isnan(item.param3) and item.param3 not in (-1.0, 0.0, 1.0):
            yield "param3", f"direction: expected -1, 0 or 1, got {item.param3:g}"
        if not math.isnan(item.param4) and item.param4 not in (0.0, 1.0):
            yield "param4", f"relative (param4): expected 0 or 1, got {item.param4:g}"
    elif command == Command.DO_VTOL_TRANSITION and first not in (VTOL_MULTICOPTER, VTOL_FIXED_WING):
        yield (
            "param1",
            f"transition: expected {VTOL_MULTICOPTER} (hover) or {VTOL_FIXED_WING} (wing-borne), got {first:g}",
        )
    elif command == Command.DO_CHANGE_SPEED:
        if first not in list(SpeedType):
            yield "param1", f"speed type: expected 0 (air), 1 (ground), 2 (climb) or 3 (descent), got {first:g}"
        elif not (second in (-1.0, -2.0) or second > 0.0):
            yield "param2", f"speed: expected more than 0 m/s, -1 (no change) or -2 (usual speed), got {second:g}"
    elif command == Command.DO_CHANGE_ALTITUDE:
        known = [frame for frame in Frame if frame.above_sea or frame.above_home]
        if math.isnan(first) or second not in known:
            field = "param1" if math.isnan(first) else "param2"
            yield field, f"altitude: expected a height and a GLOBAL frame in param2, got {first:g} and {second:g}"
    elif command == Command.DO_SET_HOME and first != 1.0:
        if item.here:
            yield "x", "home: expected latitude and longitude, or 1 in param1 for the present place"
        else:
            yield from _off_map(item)


def _of_course(
    items: Sequence[MissionItem], first: int, places: LocalFrame, parameters: Parameters
) -> Iterator[Problem]:
    """Problems between items, in the order in which they stand, from the `first` one that is flown."""
    commands = [Command(item.command) for item in items]
    if not any(command in FLOWN for command in commands[first:]):
        yield Problem(-1, "nothing to fly")
        return
    yield from _first_place(items, first, places, parameters)
    yield from _ends(commands, parameters)
    ended = ""  # by what the flight has ended, once it has
    airborne = False
    cruise: bool | None = None  # unknown until an item sets it: a mission may be begun in any flight
    last: MissionItem | None = None
    last_takeoff = max((i for i, command in enumerate(commands) if command in TAKEOFFS), default=-1)
    for index in range(first, len(items)):
        command, item = commands[index], items[index]
        if command == Command.DO_LAND_START:
            ended = ""
        elif ended and (command in FLOWN or (command == Command.DO_JUMP and item.param2 != 0.0)):
            yield Problem(index, f"expected nothing to fly after a {ended} but another landing (DO_LAND_START)")
            ended = ""
        if command in TAKEOFFS and airborne:
            yield Problem(index, "expected a take-off to be flown first")
        if command == Command.DO_VTOL_TRANSITION and not airborne and index < last_takeoff:
            yield Problem(index, "no transition is possible before the take-off")
        if command == Command.DO_CHANGE_SPEED:
            yield from _speed(index, item, cruise, parameters)
        if command == Command.WAYPOINT and cruise and last is not None:
            yield from _apart(index, last, item, places, parameters)
        cruise = _regime_after(command, item, cruise)
        if command in ENDS:
            ended = "return" if command == Command.RETURN_TO_LAUNCH else "landing"
        airborne = airborne or command in PLACED
        if command in PLACED:
            last = item if command == Command.WAYPOINT else None


def _regime_after(command: Command, item: MissionItem, cruise: bool | None) -> bool | None:
    """Whether the vehicle flies on the wing after an item, when it did before it or not, or that is unknown."""
    if command == Command.DO_VTOL_TRANSITION:
        return item.param1 == VTOL_FIXED_WING
    if command in TAKEOFFS:
        return command == Command.VTOL_TAKEOFF
    return False if command in ENDS else cruise


def _first_place(
    items: Sequence[MissionItem], first: int, places: LocalFrame, parameters: Parameters
) -> Iterator[Problem]:
    farthest, home = parameters["MIS_DIST_1WP"], places.home
    for index, item in enumerate(items):
        if index >= first and item.command in PLACED and not item.here:
            place = place_of(item, places, (home.north, home.east, home.down))
            distance = math.hypot(place[0] - home.north, place[1] - home.east)
            if 0.0 < farthest < distance:
                yield Problem(index, f"first place is {distance:.0f} m from home, expected at most {farthest:.0f} m")
            return


def _ends(commands: list[Command], parameters: Parameters) -> Iterator[Problem]:
    """What MIS_TKO_LAND_REQ requires."""
    required = parameters["MIS_TKO_LAND_REQ"]
    takeoff = any(command in TAKEOFFS for command in commands)
    landing = any(command in LANDINGS for command in commands)
    if required in (1, 3) and not takeoff:
        yield Problem(-1, "expected a take-off, got none (MIS_TKO_LAND_REQ)")
    if required in (2, 3) and not landing:
        yield Problem(-1, "expected a landing, got none (MIS_TKO_LAND_REQ)")
    if required == 4 and takeoff != landing:
        have, lack = ("take-off", "landing") if takeoff else ("landing", "take-off")
        yield Problem(-1, f"expected both a take-off and a landing or neither, got a {have} but no {lack}")


def _speed(index: int, item: MissionItem, cruise: bool | None, parameters: Parameters) -> Iterator[Problem]:
    """A speed that the regime flown at an item does not allow."""
    speed = item.param2
    if speed < 0.0 or cruise is None:
        return
    if item.param1 == SpeedType.AIRSPEED and cruise:
        least, most = parameters["FW_AIRSPD_MIN"], parameters["FW_AIRSPD_MAX"]
    elif item.param1 in (SpeedType.AIRSPEED, SpeedType.GROUND_SPEED):
        least, most = 0.0, parameters["FW_AIRSPD_MAX" if cruise else "MPC_XY_VEL_MAX"]
    elif item.param1 == SpeedType.CLIMB:
        least, most = 0.0, parameters["FW_T_CLMB_MAX" if cruise else "MPC_Z_VEL_MAX_UP"]
    else:
        least, most = 0.0, parameters["FW_T_SINK_MAX" if cruise else "MPC_Z_VEL_MAX_DN"]
    if not least <= speed <= most:
        flying = "wing-borne" if cruise else "in hover"
        yield Problem(index, f"speed: expected {least:g} to {most:g} m/s {flying}, got {speed:g} m/s", "param2")


def _apart(
    index: int, last: MissionItem, item: MissionItem, places: LocalFrame, parameters: Parameters
) -> Iterator[Problem]:
    """Two waypoints that would be reached together."""
    home = places.home
    here = (home.north, home.east, home.down)
    start, end = place_of(last, places, here), place_of(item, places, here)
    acceptance = item.param2 if item.param2 > 0.0 else parameters["NAV_ACC_RAD"]
    climb = abs(end[2] - start[2]) > parameters["NAV_FW_ALT_RAD"]
    distance = math.hypot(end[0] - start[0], end[1] - start[1])
    if distance < acceptance and not climb and not item.param1 > 0.0:
        yield Problem(
            index, f"{distance:.0f} m from the waypoint before, expected more than the {acceptance:g} m that reach it"
        )
