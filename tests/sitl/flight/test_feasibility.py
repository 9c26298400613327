"""What keeps a mission from being flown, by item and reason, at upload."""

import math
from dataclasses import replace

import pytest

from sitl.flight.feasibility import check
from sitl.flight.geofence import Fence, FenceCircle
from sitl.flight.mission_items import Command, Frame, MissionItem
from sitl.flight.parameters import Parameters
from tests.sitl.flight.sortie import Sortie, make_places

NAN, INF = math.nan, math.inf
PLACES = make_places()


def at(
    command: Command,
    north: float = 100.0,
    east: float = 0.0,
    height: float = 30.0,
    params: tuple[float, float, float, float] = (0.0, 0.0, 0.0, NAN),
) -> MissionItem:
    latitude, longitude, _ = PLACES.to_geodetic(north, east, 0.0)
    return MissionItem(command, Frame.GLOBAL_RELATIVE_ALT, *params, latitude, longitude, height)


def do(command: int, param1: float = 0.0, param2: float = 0.0, param3: float = 0.0, param4: float = 0.0) -> MissionItem:
    return MissionItem(command, Frame.MISSION, param1, param2, param3, param4)


def found(*items: MissionItem, **parameters: float) -> list[str]:
    return [str(problem) for problem in check(items, PLACES, Parameters(parameters))]


WAYPOINT = at(Command.WAYPOINT)
TAKEOFF = at(Command.VTOL_TAKEOFF, 0.0)
LAND = at(Command.VTOL_LAND, 0.0, 0.0, 0.0)


def test_nothing_is_wrong_with_a_whole_mission_or_with_none() -> None:
    assert found() == []
    assert found(TAKEOFF, do(Command.DO_SET_ROI_NONE), WAYPOINT, do(Command.DO_LAND_START), LAND) == []


@pytest.mark.parametrize(
    ("item", "reason"),
    [
        (do(5000), "command 5000 is not supported"),
        (replace(WAYPOINT, frame=Frame.LOCAL_NED), "frame LOCAL_NED is not supported for places"),
        (replace(WAYPOINT, frame=Frame.MISSION), "frame MISSION is not supported for places"),
        (replace(WAYPOINT, frame=21), "frame 21 is not supported"),
        (replace(WAYPOINT, param2=INF), "param2: expected a finite number, got inf"),
        (replace(WAYPOINT, x=90.5), "expected a latitude within +-90 deg"),
        (replace(WAYPOINT, y=-180.5), "longitude within +-180 deg"),
        (replace(WAYPOINT, x=NAN), "expected both latitude and longitude or neither"),
        (replace(WAYPOINT, x=0.0, y=0.0), "a waypoint needs latitude and longitude"),
        (replace(WAYPOINT, z=-5.0), "expected one above the ground, got -5 m above home"),
        (replace(WAYPOINT, frame=Frame.GLOBAL, z=480.0), "expected one above the ground, got -8 m above home"),
        (replace(LAND, z=-1.0), "expected one above the ground"),
        (replace(WAYPOINT, param1=-1.0), "hold time: expected 0 to"),
        (replace(WAYPOINT, param2=-1.0), "acceptance radius: expected 0 to"),
        (at(Command.LOITER_TURNS, params=(0.0, 0.0, 100.0, 1.0)), "turns: expected more than 0"),
        (at(Command.LOITER_TURNS, params=(NAN, 0.0, 100.0, 1.0)), "turns: expected more than 0"),
        (at(Command.LOITER_TIME, params=(-1.0, 0.0, 100.0, 1.0)), "time: expected 0 to"),
        (at(Command.LOITER_TIME, params=(1.0, 0.0, 100.0, 30.0)), "exit (param4): expected 0 (centre), 1 (tangent)"),
        (at(Command.LOITER_TO_ALT, params=(0.0, -20000.0, 0.0, 1.0)), "radius: expected at most 10000 m"),
        (at(Command.VTOL_TAKEOFF, params=(0.0, 7.0, 0.0, NAN)), "transition heading (param2): expected 0 to 4, got 7"),
        (at(Command.VTOL_TAKEOFF, params=(0.0, 3.0, 0.0, NAN)), "expected a heading in param4, got none"),
        (do(Command.DELAY, -1, 12, 30, 0), "a simulated flight has none"),
        (do(Command.DELAY, NAN), "delay: expected 0 to"),
        (do(Command.CONDITION_DELAY, -1.0), "delay: expected 0 to"),
        (do(Command.CONDITION_DISTANCE, NAN), "distance: expected 0 m or more"),
        (do(Command.CONDITION_YAW, 400.0, 0.0, 0.0, 0.0), "angle: expected 0 to 360 deg"),
        (do(Command.CONDITION_YAW, 40.0, 0.0, 2.0, 0.0), "direction: expected -1, 0 or 1"),
        (do(Command.CONDITION_YAW, 40.0, 0.0, 1.0, 2.0), "relative (param4): expected 0 or 1"),
        (do(Command.DO_VTOL_TRANSITION, 1), "transition: expected 3 (hover) or 4 (wing-borne), got 1"),
        (do(Command.DO_CHANGE_SPEED, 4, 10.0), "speed type: expected 0 (air), 1 (ground)"),
        (do(Command.DO_CHANGE_SPEED, 0, -3.0), "speed: expected more than 0 m/s"),
        (do(Command.DO_CHANGE_ALTITUDE, 30.0, Frame.LOCAL_NED), "expected a height and a GLOBAL frame in param2"),
        (do(Command.DO_SET_HOME, 0), "home: expected latitude and longitude, or 1 in param1"),
        (do(Command.DO_JUMP, 1, 1), "expected the number of another item, 0 to 1, got 1"),
        (do(Command.DO_JUMP, 7, 1), "expected the number of another item, 0 to 1, got 7"),
        (do(Command.DO_JUMP, 0.5, 1), "expected the number of another item, 0 to 1, got 0.5"),
        (do(Command.DO_JUMP, NAN, 1), "expected the number of another item, 0 to 1, got nan"),
        (do(Command.DO_JUMP, 0, -2), "expected a number of repeats, -1 for ever, got -2"),
        (do(Command.DO_JUMP, 0, NAN), "expected a number of repeats, -1 for ever, got nan"),
    ],
)
def test_each_item_is_checked_by_itself(item: MissionItem, reason: str) -> None:
    (problem,) = found(WAYPOINT, item)
    assert problem.startswith("item 1: ")
    assert reason in problem


def test_jump_back_over_nothing_that_takes_time_is_refused() -> None:
    speed = do(Command.DO_CHANGE_SPEED, 1, 5.0)
    assert found(WAYPOINT, speed, do(Command.DO_JUMP, 1, -1)) == [
        "item 2: jump: expected something to fly between items 1 and 2, got nothing"
    ]
    assert found(WAYPOINT, speed, do(Command.DO_JUMP, 0, -1)) == []


def test_places_outside_the_fence_are_refused() -> None:
    fence = Fence(Parameters(), PLACES)
    fence.load((), (FenceCircle(*PLACES.to_geodetic(0.0, 0.0, 0.0)[:2], 500.0, inclusion=True),))
    items = (WAYPOINT, at(Command.WAYPOINT, 600.0))
    assert [str(problem) for problem in check(items, PLACES, Parameters(), fence)] == [
        "item 1: outside the geofence: outside every area to stay in"
    ]
    high = Fence(Parameters({"GF_MAX_VER_DIST": 25.0}), PLACES)
    assert "30 m above home, 25 m allowed" in str(check((WAYPOINT,), PLACES, Parameters(), high)[0])


def test_home_at_the_beginning_of_a_mission_is_not_flown() -> None:
    home = replace(WAYPOINT, frame=Frame.GLOBAL, z=PLACES.altitude)
    assert found(home, TAKEOFF, WAYPOINT, LAND) == []
    assert found(replace(home, x=0.0, y=0.0, z=0.0), TAKEOFF, LAND, MIS_DIST_1WP=500.0) == []
    assert "latitude" in found(replace(home, x=91.0), TAKEOFF)[0]
    assert found(home, do(Command.DO_SET_ROI_NONE)) == ["nothing to fly"]
    assert found(home, TAKEOFF, home) == ["item 2: altitude: expected one above the ground, got 0 m above home"]
    assert "expected something to fly between" in found(home, do(Command.DO_JUMP, 0, 1), TAKEOFF)[0]
    assert found(replace(home, z=PLACES.altitude + 30.0), TAKEOFF) == ["item 1: expected a take-off to be flown first"]


def test_home_is_where_an_item_sets_it_only_if_that_is_on_the_map() -> None:
    there = at(Command.DO_SET_HOME)
    assert found(WAYPOINT, there) == []
    assert "latitude" in found(WAYPOINT, replace(there, x=-91.0))[0]
    assert "frame 99 is not supported" in found(WAYPOINT, replace(there, frame=99))[0]


def test_a_problem_names_the_field_that_is_wrong() -> None:
    wrong = {
        "command": do(5000), "frame": replace(WAYPOINT, frame=1), "param1": replace(WAYPOINT, param1=-1.0),
        "param2": replace(WAYPOINT, param2=-1.0), "param3": at(Command.LOITER_UNLIM, params=(0.0, 0.0, 1e5, NAN)),
        "param4": do(Command.CONDITION_YAW, 40.0, 0.0, 1.0, 2.0), "x": replace(WAYPOINT, x=99.0),
        "y": replace(WAYPOINT, y=199.0), "z": replace(WAYPOINT, z=-1.0), "": TAKEOFF,
    }  # fmt: skip
    for field, item in wrong.items():
        (problem,) = check((WAYPOINT, item), PLACES, Parameters())
        assert (problem.index, problem.field) == (1, field)


def test_first_place_must_not_be_too_far() -> None:
    far = at(Command.WAYPOINT, 1500.0)
    assert found(do(Command.DELAY, 1.0), far, MIS_DIST_1WP=1000.0) == [
        "item 1: first place is 1500 m from home, expected at most 1000 m"
    ]
    assert found(WAYPOINT, far, MIS_DIST_1WP=1000.0) == []
    assert found(far, MIS_DIST_1WP=-1.0) == []


@pytest.mark.parametrize(
    ("required", "items", "lacks"),
    [
        (1, (WAYPOINT, LAND), "take-off"),
        (2, (TAKEOFF, WAYPOINT), "landing"),
        (3, (TAKEOFF, WAYPOINT), "landing"),
        (4, (TAKEOFF, WAYPOINT), "landing"),
        (4, (WAYPOINT, LAND), "take-off"),
        (4, (WAYPOINT,), None),
        (3, (TAKEOFF, WAYPOINT, LAND), None),
    ],
)
def test_take_off_and_landing_are_there_where_they_are_required(
    required: int, items: tuple[MissionItem, ...], lacks: str | None
) -> None:
    problems = found(*items, MIS_TKO_LAND_REQ=required)
    if lacks is None:
        assert problems == []
    else:
        assert len(problems) == 1
        assert lacks in problems[0]


def test_nothing_but_actions_is_no_mission() -> None:
    assert found(do(Command.DO_SET_ROI_NONE)) == ["nothing to fly"]


def test_after_a_landing_only_another_landing_may_follow() -> None:
    assert found(TAKEOFF, LAND, WAYPOINT) == [
        "item 2: expected nothing to fly after a landing but another landing (DO_LAND_START)"
    ]
    assert found(TAKEOFF, LAND, do(Command.DO_SET_ROI_NONE)) == []
    assert found(TAKEOFF, do(Command.DO_LAND_START), LAND, do(Command.DO_LAND_START), WAYPOINT, LAND) == []


def test_nothing_is_flown_after_a_return_nor_by_jumping_back_from_the_ground() -> None:
    home, again = do(Command.RETURN_TO_LAUNCH), do(Command.DO_JUMP, 1, 1)
    reason = "expected nothing to fly after a return but another landing (DO_LAND_START)"
    assert found(TAKEOFF, home, WAYPOINT) == [f"item 2: {reason}"]
    assert found(TAKEOFF, WAYPOINT, home, again) == [f"item 3: {reason}"]
    assert found(TAKEOFF, WAYPOINT, again, home, do(Command.DO_LAND_START), LAND) == []


def test_take_off_comes_first_and_before_any_transition() -> None:
    assert found(WAYPOINT, TAKEOFF) == ["item 1: expected a take-off to be flown first"]
    forward = do(Command.DO_VTOL_TRANSITION, 4)
    assert found(forward, TAKEOFF) == ["item 0: no transition is possible before the take-off"]
    assert found(TAKEOFF, forward, WAYPOINT) == []
    assert found(forward, WAYPOINT) == []  # begun in the air


def test_speed_must_suit_the_regime_flown_there() -> None:
    slow, fast = do(Command.DO_CHANGE_SPEED, 0, 6.0), do(Command.DO_CHANGE_SPEED, 0, 22.0)
    hover = do(Command.DO_VTOL_TRANSITION, 3)
    assert found(TAKEOFF, slow, WAYPOINT) == ["item 1: speed: expected 15 to 30 m/s wing-borne, got 6 m/s"]
    assert found(TAKEOFF, fast, WAYPOINT, hover, slow, LAND) == []
    assert found(at(Command.TAKEOFF), fast, WAYPOINT) == ["item 1: speed: expected 0 to 8 m/s in hover, got 22 m/s"]


def test_wing_borne_waypoints_must_be_farther_apart_than_what_reaches_them() -> None:
    close = at(Command.WAYPOINT, 105.0)
    assert found(TAKEOFF, WAYPOINT, close) == [
        "item 2: 5 m from the waypoint before, expected more than the 10 m that reach it"
    ]
    assert found(at(Command.TAKEOFF), WAYPOINT, close) == []
    assert found(TAKEOFF, WAYPOINT, replace(close, z=60.0)) == []


def test_mission_stays_checked_when_home_or_parameters_change() -> None:
    sortie = Sortie()
    sortie.mission.load((sortie.waypoint(100.0, 0.0, 30.0),))
    assert sortie.mission.problems() == []
    sortie.places.home.move(0.0, 0.0, -40.0)
    sortie.parameters.set("MIS_DIST_1WP", 50.0)
    assert "first place is 100 m from home" in str(sortie.mission.problems()[0])
