"""The course of a mission: what happens at once, jumps, conditions, pause, change in flight, what is refused."""

import math

import pytest

from sitl.flight.landed import LandedState
from sitl.flight.mission import InfeasibleMissionError
from sitl.flight.mission_items import Command, Frame, MissionItem
from sitl.flight.mission_pilot import SpeedType
from tests.sitl.flight.sortie import Sortie


def flying(wind: tuple[float, float] = (0.0, 0.0)) -> Sortie:
    return Sortie(wind).put(0.0, 0.0, 50.0, speed=20.0)


def hovering() -> Sortie:
    return Sortie().put(0.0, 0.0, 30.0)


def do(command: Command, param1: float = 0.0, param2: float = 0.0, param3: float = 0.0) -> MissionItem:
    """An item without a place."""
    return MissionItem(command, Frame.MISSION, param1, param2, param3)


def test_items_are_flown_in_order_and_the_end_is_held() -> None:
    sortie = hovering()
    sortie.start(sortie.waypoint(30.0, 0.0, 30.0), sortie.waypoint(30.0, 30.0, 35.0)).finish()
    assert sortie.mission.reached == [0, 1]
    assert sortie.mission.current == 1
    sortie.run(20.0)
    assert sortie.distance(30.0, 30.0) < 0.5
    assert sortie.mission.reached == [0, 1]


def test_jump_repeats_as_often_as_it_says_and_counts_anew_with_each_start() -> None:
    sortie = hovering()
    items = (sortie.waypoint(20.0, 0.0, 30.0), sortie.waypoint(0.0, 0.0, 30.0), do(Command.DO_JUMP, 0, 2))
    for _ in range(2):
        sortie.mission.reached.clear()
        sortie.start(*items).finish()
        assert sortie.mission.reached == [0, 1, 2, 0, 1, 2, 0, 1, 2]


def test_jump_for_ever_does_not_end() -> None:
    sortie = hovering()
    sortie.start(sortie.waypoint(20.0, 0.0, 30.0), sortie.waypoint(0.0, 0.0, 30.0), do(Command.DO_JUMP, 0, -1))
    sortie.run(300.0)
    assert not sortie.mission.finished
    assert sortie.mission.reached.count(0) > 10


def test_turn_into_the_leg_that_a_jump_leads_to_begins_before_the_waypoint() -> None:
    sortie = flying()
    sortie.start(
        sortie.waypoint(0.0, 1000.0, 50.0), sortie.waypoint(1000.0, 1000.0, 50.0), do(Command.DO_JUMP, 0, 1), first=1
    )
    sortie.mission.jump_to(1)
    sortie.until_item(1)
    assert sortie.distance(1000.0, 1000.0) > 50.0


def test_airspeed_and_ground_speed_change_wing_borne() -> None:
    sortie = flying(wind=(-6.0, 0.0))
    sortie.start(
        do(Command.DO_CHANGE_SPEED, SpeedType.AIRSPEED, 24.0, -1.0),
        sortie.waypoint(1500.0, 0.0, 50.0),
        do(Command.DO_CHANGE_SPEED, SpeedType.GROUND_SPEED, 22.0, -1.0),
        sortie.waypoint(3500.0, 0.0, 50.0),
        do(Command.DO_CHANGE_SPEED, SpeedType.AIRSPEED, -2.0, -1.0),
        sortie.waypoint(9000.0, 0.0, 50.0),
    )
    assert sortie.run(20.0).view.airspeed == pytest.approx(24.0, abs=0.1)
    assert sortie.until_item(1).run(20.0).view.vn == pytest.approx(22.0, abs=0.1)
    assert sortie.until_item(3).run(20.0).view.airspeed == pytest.approx(20.0, abs=0.1)


def test_speed_never_leaves_what_the_aircraft_can_fly() -> None:
    sortie = flying(wind=(-14.0, 0.0))
    sortie.start(do(Command.DO_CHANGE_SPEED, SpeedType.GROUND_SPEED, 25.0, -1.0), sortie.waypoint(1900.0, 0.0, 50.0))
    assert sortie.run(20.0).view.airspeed == pytest.approx(30.0, abs=0.1)


def test_speeds_change_in_hover_and_return_to_usual_at_the_next_start() -> None:
    sortie = hovering()
    items = (
        do(Command.DO_CHANGE_SPEED, SpeedType.GROUND_SPEED, 2.0, -1.0),
        do(Command.DO_CHANGE_SPEED, SpeedType.CLIMB, 0.5, -1.0),
        sortie.waypoint(200.0, 0.0, 60.0),
    )
    sortie.start(*items).run(10.0)
    assert sortie.view.vn == pytest.approx(2.0, abs=0.1)
    assert sortie.view.vd == pytest.approx(-0.5)
    sortie.mission.start(sortie.view, 2, cruise=False)
    assert sortie.run(10.0).view.vn == pytest.approx(5.0, abs=0.1)


def test_home_set_on_the_way_moves_the_heights_of_the_items_after_it() -> None:
    sortie = hovering()
    there = sortie.item(Command.DO_SET_HOME, (20.0, 0.0), 5.0)
    sortie.start(there, sortie.waypoint(40.0, 0.0, 10.0)).finish()
    assert sortie.view.down == pytest.approx(-15.0, abs=0.8)  # 10 m above the home set at 5 m
    assert (sortie.places.home.north, sortie.places.home.down) == pytest.approx((20.0, -5.0), abs=0.1)


def test_home_set_here_in_flight_is_on_the_ground_below() -> None:
    sortie = hovering()
    at_no_height = sortie.item(Command.DO_SET_HOME, (20.0, 0.0), math.nan)
    sortie.start(sortie.waypoint(40.0, 0.0, 20.0), do(Command.DO_SET_HOME, 1), do(Command.DELAY, 1.0), at_no_height)
    home = sortie.until_item(1).places.home
    assert (home.north, home.down) == pytest.approx((40.0, 0.0), abs=10.0)
    assert home.down == 0.0
    sortie.finish()
    assert (home.north, home.down) == pytest.approx((20.0, 0.0), abs=1e-6)


def test_altitude_changed_is_that_of_what_names_none() -> None:
    sortie = hovering()
    up = do(Command.DO_CHANGE_ALTITUDE, 45.0, Frame.GLOBAL_RELATIVE_ALT)
    sortie.start(up, do(Command.DELAY, 30.0), sortie.waypoint(30.0, 0.0, math.nan)).until_item(1)
    assert sortie.view.down == pytest.approx(-45.0, abs=0.1)
    assert sortie.finish().view.down == pytest.approx(-45.0, abs=0.8)


def test_altitudes_above_the_sea_and_above_terrain() -> None:
    sortie = hovering()
    place = sortie.places.to_geodetic(20.0, 0.0, 0.0)[:2]
    sea = MissionItem(Command.WAYPOINT, Frame.GLOBAL, 0.0, 0.0, 0.0, math.nan, *place, 488.0 + 40.0)
    terrain = MissionItem(Command.WAYPOINT, Frame.GLOBAL_TERRAIN_ALT, 0.0, 0.0, 0.0, math.nan, *place, 20.0)
    sortie.start(sea, do(Command.DELAY, 1.0), terrain).until_item(0)
    assert sortie.view.down == pytest.approx(-40.0, abs=1.0)
    assert sortie.finish().view.down == pytest.approx(-20.0, abs=1.0)
    assert sortie.said[0] == "Mission: the ground is flat, heights above terrain are heights above home"


def test_condition_distance_holds_back_what_follows_until_so_near_to_the_next_place() -> None:
    sortie = flying()
    sortie.start(
        do(Command.CONDITION_DISTANCE, 400.0),
        do(Command.DO_CHANGE_SPEED, SpeedType.AIRSPEED, 16.0, -1.0),
        sortie.waypoint(1000.0, 0.0, 50.0),
    )
    sortie.until_item(1)
    assert sortie.view.north == pytest.approx(600.0, abs=1.0)
    assert sortie.finish().mission.reached == [0, 1, 2]


def test_condition_delay_holds_back_what_follows_while_the_next_leg_is_flown() -> None:
    sortie = flying()
    sortie.start(
        do(Command.CONDITION_DELAY, 15.0),
        do(Command.DO_SET_HOME, 1),
        do(Command.CONDITION_DELAY, 5.0),
        do(Command.DO_VTOL_TRANSITION, 3),
        sortie.waypoint(1500.0, 0.0, 50.0),
    )
    sortie.until_item(1)
    assert sortie.view.time == pytest.approx(15.0, abs=0.1)
    assert sortie.places.home.north == pytest.approx(300.0, abs=3.0)
    assert sortie.mission.cruise
    sortie.until_item(3)
    assert sortie.view.time == pytest.approx(20.0, abs=0.1)
    assert not sortie.mission.cruise
    assert sortie.finish().distance(1500.0, 0.0) < 2.0


def test_what_is_held_back_happens_at_the_latest_when_the_place_is_reached() -> None:
    sortie = flying()
    sortie.start(
        do(Command.CONDITION_DELAY, 500.0), do(Command.DO_SET_HOME, 1), sortie.waypoint(300.0, 0.0, 50.0)
    ).finish()
    assert sortie.mission.reached == [0, 1, 2]
    assert sortie.places.home.north == pytest.approx(290.0, abs=2.0)


def test_cameras_and_gimbals_are_passed_over() -> None:
    sortie = hovering()
    roi = sortie.item(Command.DO_SET_ROI_LOCATION, (10.0, 10.0), 0.0)
    shoot = do(Command.IMAGE_START_CAPTURE, 0.0, 2.0, 0.0)
    sortie.start(roi, shoot, sortie.waypoint(20.0, 0.0, 30.0)).finish(60.0)
    assert sortie.mission.reached == [0, 1, 2]


def test_return_item_flies_home_and_lands() -> None:
    sortie = flying()
    sortie.start(sortie.waypoint(600.0, 0.0, 50.0), do(Command.RETURN_TO_LAUNCH)).finish()
    assert sortie.follower.landed == LandedState.ON_GROUND
    assert sortie.distance(0.0, 0.0) < 1.0
    assert not sortie.mission.cruise


def test_item_without_autocontinue_pauses_the_mission_until_it_is_resumed() -> None:
    sortie = hovering()
    stop = sortie.item(Command.WAYPOINT, (30.0, 0.0), 30.0, autocontinue=False)
    sortie.start(stop, sortie.waypoint(60.0, 0.0, 30.0)).until(lambda: sortie.mission.paused).run(30.0)
    assert sortie.distance(30.0, 0.0) < 1.0
    assert (sortie.mission.reached, sortie.mission.current) == ([0], 1)
    sortie.mission.resume(sortie.view, cruise=False)
    sortie.finish()
    assert sortie.distance(60.0, 0.0) < 1.5


def test_resume_goes_on_with_the_item_from_where_the_vehicle_is() -> None:
    sortie = flying()
    sortie.start(sortie.waypoint(500.0, 0.0, 50.0), sortie.waypoint(1500.0, 0.0, 50.0)).until_item(0)
    sortie.put(700.0, 400.0, 50.0, speed=20.0)
    sortie.mission.resume(sortie.view, cruise=True)
    sortie.run(0.1)
    assert sortie.mission.current == 1
    assert list(sortie.demand.record[0]["start_ned"]) == pytest.approx([700.0, 400.0, -50.0])
    assert sortie.mission.cruise
    sortie.finish()
    assert sortie.mission.reached == [0, 1]


def test_first_climb_interrupted_goes_on_from_where_the_vehicle_is() -> None:
    sortie = Sortie(MIS_TAKEOFF_ALT=20.0)
    sortie.start(sortie.waypoint(100.0, 0.0, 40.0)).until(lambda: sortie.view.down < -10.0)
    sortie.put(40.0, 30.0, 10.0)
    sortie.mission.resume(sortie.view, cruise=False)
    sortie.until(lambda: sortie.view.down < -18.0)
    assert sortie.distance(40.0, 30.0) < 0.5
    sortie.finish()
    assert sortie.distance(100.0, 0.0) < 1.5


def test_item_after_the_first_climb_begins_once() -> None:
    sortie = Sortie(MIS_TAKEOFF_ALT=20.0)
    sortie.start(sortie.item(Command.LAND, (50.0, 0.0))).until(lambda: sortie.view.down < -19.0)
    assert sortie.said == []
    sortie.finish()
    assert sortie.said.count("Landing") == 1


def test_mission_changed_during_its_first_climb_goes_on_climbing() -> None:
    sortie = Sortie(MIS_TAKEOFF_ALT=20.0)
    first = sortie.waypoint(100.0, 0.0, 40.0)
    sortie.start(do(Command.DO_CHANGE_SPEED, SpeedType.GROUND_SPEED, 2.0, -1.0), first)
    sortie.until(lambda: sortie.view.down < -10.0)
    sortie.mission.load((sortie.mission.items[0], first, sortie.waypoint(150.0, 0.0, 40.0)))
    sortie.finish()
    assert sortie.mission.reached == [0, 1, 2]


def test_jump_to_an_item_is_flown_at_once_from_anywhere() -> None:
    sortie = flying()
    sortie.start(*(sortie.waypoint(500.0 * i, 0.0, 50.0) for i in range(1, 5))).run(2.0)
    sortie.mission.jump_to(3)
    sortie.finish()
    assert sortie.mission.reached == [3]


def test_jumps_go_on_counting_after_a_jump_to_an_item_until_they_are_reset() -> None:
    for reset, ways in ((False, 1), (True, 2)):
        sortie = hovering()
        items = (sortie.waypoint(20.0, 0.0, 30.0), sortie.waypoint(0.0, 0.0, 30.0), do(Command.DO_JUMP, 0, 1))
        sortie.start(*items)
        sortie.until_item(2)
        if reset:
            sortie.mission.reset_jumps()
        sortie.mission.jump_to(0)
        sortie.mission.reached.clear()
        sortie.finish()
        assert sortie.mission.reached == [0, 1, 2] * ways


def test_home_at_the_beginning_is_passed_over() -> None:
    sortie = hovering()
    home = MissionItem(Command.WAYPOINT, Frame.GLOBAL, z=sortie.places.altitude)
    sortie.start(home, sortie.waypoint(20.0, 0.0, 30.0), sortie.waypoint(20.0, 20.0, 30.0)).finish()
    assert sortie.mission.reached == [0, 1, 2]
    assert sortie.distance(20.0, 20.0) < 5.0


@pytest.mark.parametrize("index", [-1, 1])
def test_jump_to_an_item_that_is_not_there_is_refused(index: int) -> None:
    sortie = flying()
    sortie.start(sortie.waypoint(500.0, 0.0, 50.0))
    with pytest.raises(ValueError, match=f"expected 0 to 0, got {index}"):
        sortie.mission.jump_to(index)


def test_start_without_items_is_refused() -> None:
    with pytest.raises(ValueError, match="no mission"):
        flying().mission.start(flying().view, cruise=True)


def test_mission_changed_behind_the_item_being_flown_goes_on_with_it() -> None:
    sortie = flying()
    first, second = sortie.waypoint(500.0, 0.0, 50.0), sortie.waypoint(1500.0, 0.0, 50.0)
    sortie.start(first, second).until_item(0).run(5.0)
    sortie.mission.load((first, second, sortie.waypoint(1500.0, 800.0, 50.0)))
    sortie.finish()
    assert sortie.mission.reached == [0, 1, 2]


def test_turn_is_towards_the_place_that_a_changed_mission_has_next() -> None:
    sortie = flying()
    first = sortie.waypoint(1000.0, 0.0, 50.0)
    sortie.start(first, sortie.waypoint(2000.0, 0.0, 50.0)).run(10.0)
    sortie.mission.load((first, sortie.waypoint(1000.0, 1000.0, 50.0)))
    sortie.until_item(0)
    assert sortie.distance(1000.0, 0.0) > 60.0


def test_other_mission_loaded_in_flight_begins_at_its_first_item() -> None:
    sortie = flying()
    sortie.start(sortie.waypoint(500.0, 0.0, 50.0), sortie.waypoint(1500.0, 0.0, 50.0)).until_item(0)
    sortie.mission.load((sortie.waypoint(0.0, 500.0, 50.0), sortie.waypoint(0.0, 900.0, 50.0)))
    sortie.finish()
    assert sortie.mission.reached == [0, 0, 1]
    assert sortie.distance(0.0, 900.0) < 200.0


def test_mission_taken_away_in_flight_is_finished_where_the_vehicle_is() -> None:
    sortie = hovering()
    sortie.start(sortie.waypoint(500.0, 0.0, 30.0)).run(10.0)
    north = sortie.view.north
    sortie.mission.load(())
    sortie.run(20.0)
    assert sortie.mission.finished
    assert sortie.view.north - north < 10.0


def test_infeasible_mission_is_refused_with_items_and_reasons_and_the_old_one_stays() -> None:
    sortie = hovering()
    good = sortie.waypoint(30.0, 0.0, 30.0)
    sortie.mission.load((good,))
    with pytest.raises(InfeasibleMissionError, match="item 1: command 999 is not supported") as refusal:
        sortie.mission.load((good, MissionItem(999)))
    assert [problem.index for problem in refusal.value.problems] == [1]
    assert sortie.mission.items == (good,)


def test_land_start_is_found() -> None:
    sortie = hovering()
    sortie.mission.load(
        (sortie.waypoint(30.0, 0.0, 30.0), do(Command.DO_LAND_START), sortie.item(Command.LAND, (0.0, 0.0), 0.0))
    )
    assert sortie.mission.land_start_index() == 1
    sortie.mission.load((sortie.waypoint(30.0, 0.0, 30.0),))
    assert sortie.mission.land_start_index() is None


def test_transition_asked_for_on_the_way_is_flown_on_with_in_the_other_regime() -> None:
    sortie = flying()
    sortie.start(sortie.waypoint(500.0, 0.0, 50.0), sortie.waypoint(700.0, 0.0, 50.0)).run(5.0)
    sortie.mission.cruise = False
    sortie.until(lambda: sortie.view.airspeed < 6.0)
    assert sortie.mission.current == 0
    sortie.mission.cruise = True
    sortie.until(lambda: sortie.view.airspeed > 19.0, timeout=10.0)
    sortie.mission.cruise = False
    sortie.finish()
    assert sortie.distance(700.0, 0.0) < 1.5


def test_parameters_set_on_the_way_count_at_once() -> None:
    sortie = flying()
    sortie.start(sortie.waypoint(1900.0, 0.0, 110.0)).run(3.0)
    sortie.parameters.load({"FW_AIRSPD_TRIM": 23.0, "FW_T_CLMB_MAX": 1.0})
    sortie.run(5.0)
    assert sortie.view.airspeed == pytest.approx(23.0, abs=0.1)
    assert sortie.view.vd == pytest.approx(-1.0)


def test_demand_that_another_mode_has_written_is_written_again_on_resuming() -> None:
    sortie = flying()
    sortie.start(sortie.waypoint(1900.0, 0.0, 50.0)).run(3.0)
    sortie.demand.velocity((0.0, 0.0, 0.0))
    sortie.mission.resume(sortie.view, cruise=True)
    assert sortie.run(10.0).view.vn == pytest.approx(20.0, abs=0.1)


def test_same_mission_is_flown_the_same_to_the_last_bit() -> None:
    ends: list[tuple[float, ...]] = []
    for _ in range(2):
        sortie = flying(wind=(3.0, 2.0))
        sortie.start(*(sortie.waypoint(300.0 * i, 200.0 * (i % 2), 50.0) for i in range(1, 5))).finish()
        view = sortie.view
        ends.append((view.time, view.north, view.east, view.down, view.vn, view.ve))
    assert ends[0] == ends[1]
