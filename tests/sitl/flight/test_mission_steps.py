"""Single items of a mission: waypoints, loiters, delays, turns, take-offs, transitions, landings."""

import math
from pathlib import Path

import pytest

from sitl.control.records import Horizontal
from sitl.flight.landed import LandedState
from sitl.flight.mission_items import Command
from sitl.flight.plan_file import read_plan
from tests.sitl.flight.sortie import Sortie

EXAMPLE = Path(__file__).resolve().parents[3] / "docs" / "examples" / "survey_3km.plan"
TURN_RADIUS = 20.0**2 / (9.80665 * math.tan(math.radians(30.0)))  # at 20 m/s and 30 deg of bank [m]


def flying(wind: tuple[float, float] = (0.0, 0.0)) -> Sortie:
    return Sortie(wind).put(0.0, 0.0, 50.0, speed=20.0)


def hovering() -> Sortie:
    return Sortie().put(0.0, 0.0, 30.0)


def test_example_plan_is_flown_from_take_off_to_landing() -> None:
    plan = read_plan(EXAMPLE)
    sortie = Sortie(wind=(3.0, -4.0)).start(*plan.items)
    highest = 0.0
    for index, item in enumerate(plan.items[1:5], start=1):
        sortie.until_item(index)
        place = sortie.places.to_ned(item.x, item.y, 488.0 + item.z)
        assert sortie.distance(*place[:2]) < 110.0
        assert sortie.view.down == pytest.approx(place[2], abs=5.0)
        highest = max(highest, -sortie.view.down)
        assert sortie.mission.cruise
    assert highest > 94.0
    sortie.finish()
    assert sortie.mission.reached == list(range(7))
    assert sortie.follower.landed == LandedState.ON_GROUND
    assert sortie.distance(0.0, 0.0) < 1.0
    assert not sortie.mission.cruise


def test_next_leg_begins_where_a_turn_of_thirty_degrees_bank_joins_the_two() -> None:
    sortie = flying()
    sortie.start(sortie.waypoint(1000.0, 0.0, 50.0), sortie.waypoint(1000.0, 1000.0, 50.0)).until_item(0)
    assert 1000.0 - sortie.view.north == pytest.approx(TURN_RADIUS, abs=1.0)
    sortie.until(lambda: sortie.view.east > 500.0)
    assert sortie.view.north == pytest.approx(1000.0, abs=15.0)


def test_straight_on_the_next_leg_begins_within_the_acceptance_radius() -> None:
    sortie = flying()
    sortie.start(sortie.waypoint(1000.0, 0.0, 50.0), sortie.waypoint(2000.0, 0.0, 50.0)).until_item(0)
    assert 1000.0 - sortie.view.north == pytest.approx(10.0, abs=0.5)


def test_waypoint_missed_sideways_is_passed_where_it_is_abeam() -> None:
    sortie = flying()
    sortie.start(sortie.waypoint(500.0, 0.0, 50.0), sortie.waypoint(2000.0, 0.0, 50.0))
    sortie.until(lambda: sortie.view.north > 450.0)
    sortie.view.east = 200.0
    sortie.until_item(0)
    assert sortie.view.north == pytest.approx(500.0, abs=1.0)


def test_pass_radius_leaves_the_waypoint_on_the_right_when_positive() -> None:
    sortie = flying()
    by = sortie.item(Command.WAYPOINT, (1000.0, 0.0), 50.0, params=(0.0, 0.0, 60.0, math.nan))
    sortie.start(by, sortie.waypoint(2000.0, -60.0, 50.0)).until_item(0)
    assert sortie.view.east == pytest.approx(-60.0, abs=3.0)


def test_wing_borne_waypoint_is_circled_until_its_height_is_reached() -> None:
    sortie = flying()
    sortie.start(sortie.waypoint(300.0, 0.0, 110.0), sortie.waypoint(2000.0, 0.0, 110.0))
    sortie.until(lambda: sortie.demand.record[0]["horizontal"] == Horizontal.CIRCLE)
    assert not sortie.mission.reached
    sortie.until_item(0)
    assert -sortie.view.down >= 105.0


def test_wing_borne_hold_time_is_spent_circling() -> None:
    sortie = flying()
    sortie.start(sortie.waypoint(500.0, 0.0, 50.0, hold=30.0), sortie.waypoint(2000.0, 0.0, 50.0))
    sortie.until(lambda: sortie.demand.record[0]["horizontal"] == Horizontal.CIRCLE)
    began = sortie.view.time
    sortie.until_item(0)
    assert sortie.view.time - began == pytest.approx(30.0, abs=0.1)


def test_hold_time_in_hover_is_spent_standing_at_the_place_with_the_items_heading() -> None:
    sortie = hovering()
    hold = sortie.item(Command.WAYPOINT, (60.0, 0.0), 40.0, params=(10.0, 0.0, 0.0, 90.0))
    sortie.start(hold, sortie.waypoint(60.0, 100.0, 40.0)).until_item(0)
    assert sortie.view.time > 60.0 / 5.0 + 10.0
    assert sortie.distance(60.0, 0.0) < 0.5
    assert sortie.view.down == pytest.approx(-40.0, abs=0.8)
    assert sortie.view.yaw == pytest.approx(math.pi / 2, abs=0.01)


def test_waypoint_in_hover_without_hold_is_flown_past() -> None:
    sortie = hovering()
    sortie.start(sortie.waypoint(60.0, 0.0, 30.0), sortie.waypoint(60.0, 100.0, 30.0)).until_item(0)
    assert math.hypot(sortie.view.vn, sortie.view.ve) == pytest.approx(5.0, abs=0.1)
    sortie.finish()
    assert sortie.distance(60.0, 100.0) < 2.0  # the last one is stopped at
    sortie.run(10.0)
    assert sortie.distance(60.0, 100.0) < 0.1


def test_open_places_and_heights_are_those_of_the_vehicle() -> None:
    sortie = hovering()
    nan = math.nan
    here = sortie.item(Command.LOITER_TIME, None, nan, params=(5.0, 0.0, 0.0, 1.0))
    sortie.start(here).finish(20.0)
    assert sortie.distance(0.0, 0.0) < 0.1
    assert sortie.view.down == pytest.approx(-30.0, abs=0.1)


@pytest.mark.parametrize("radius", [100.0, -150.0])
def test_loiter_turns_are_counted_on_the_circle_in_its_direction(radius: float) -> None:
    sortie = flying()
    turns = sortie.item(Command.LOITER_TURNS, (500.0, 0.0), 50.0, params=(2.0, 0.0, radius, 1.0))
    sortie.start(turns, sortie.waypoint(3000.0, 0.0, 50.0))
    turned, last = 0.0, None
    sortie.until(lambda: sortie.distance(500.0, 0.0) < abs(radius) + 10.0)
    while not sortie.mission.reached:
        sortie.run(0.1)
        bearing = math.atan2(sortie.view.east, sortie.view.north - 500.0)
        turned += 0.0 if last is None else math.remainder(bearing - last, 2.0 * math.pi)
        last = bearing
    assert turned == pytest.approx(math.copysign(4.0 * math.pi, radius), abs=0.1)


@pytest.mark.parametrize("radius", [100.0, -100.0])
def test_circle_is_entered_along_its_tangent_in_its_direction(radius: float) -> None:
    sortie = flying()
    sortie.start(sortie.item(Command.LOITER_UNLIM, (800.0, 0.0), 50.0, params=(0.0, 0.0, radius, math.nan)))
    sortie.until(lambda: sortie.demand.record[0]["horizontal"] == Horizontal.CIRCLE)
    assert sortie.distance(800.0, 0.0) == pytest.approx(102.0, abs=1.0)
    assert sortie.view.east * radius < 0.0  # clockwise with the centre on the right
    outwards = math.atan2(sortie.view.east, sortie.view.north - 800.0)
    across = math.remainder(math.atan2(sortie.view.ve, sortie.view.vn) - outwards, 2.0 * math.pi)
    assert across == pytest.approx(math.copysign(math.pi / 2, radius), abs=0.25)


def test_loiter_time_counts_from_the_circle() -> None:
    sortie = flying()
    loiter = sortie.item(Command.LOITER_TIME, (800.0, 0.0), 50.0, params=(40.0, 0.0, 100.0, 1.0))
    sortie.start(loiter, sortie.waypoint(3000.0, 0.0, 50.0)).until(lambda: sortie.distance(800.0, 0.0) < 110.0)
    began = sortie.view.time
    assert sortie.until_item(0).view.time - began == pytest.approx(40.0, abs=0.1)


def test_loiter_to_altitude_ends_at_the_altitude_with_the_heading_it_requires() -> None:
    sortie = flying()
    loiter = sortie.item(Command.LOITER_TO_ALT, (500.0, 0.0), 90.0, params=(1.0, 100.0, 0.0, 1.0))
    sortie.start(loiter, sortie.waypoint(500.0, 3000.0, 90.0)).until_item(0)
    assert -sortie.view.down >= 85.0
    assert sortie.view.yaw == pytest.approx(math.pi / 2, abs=math.radians(12.0))


def test_loiter_whose_circle_never_points_to_the_next_place_is_left_after_one_more_turn() -> None:
    sortie = flying()
    loiter = sortie.item(Command.LOITER_TO_ALT, (500.0, 0.0), 50.0, params=(1.0, 100.0, 0.0, 1.0))
    sortie.start(loiter, sortie.waypoint(500.0, 0.0, 50.0, hold=1.0)).until_item(0, timeout=120.0)


def test_unlimited_loiter_is_not_left() -> None:
    sortie = flying()
    sortie.start(sortie.item(Command.LOITER_UNLIM, (300.0, 0.0), 50.0), sortie.waypoint(900.0, 0.0, 50.0)).run(300.0)
    assert not sortie.mission.reached
    assert sortie.distance(300.0, 0.0) == pytest.approx(80.0, abs=10.0)


def test_circle_too_tight_for_the_wind_is_widened_and_said() -> None:
    sortie = flying(wind=(8.0, 0.0))
    loiter = sortie.item(Command.LOITER_UNLIM, (500.0, 0.0), 50.0, params=(0.0, 0.0, -60.0, math.nan))
    sortie.start(loiter).until(lambda: sortie.demand.record[0]["horizontal"] == Horizontal.CIRCLE)
    least = 28.0**2 / (9.80665 * math.tan(math.radians(35.0)))
    assert sortie.demand.record[0]["radius"] == pytest.approx(-least)
    assert sortie.said == [f"Loiter radius 60 m is too tight in this wind: flying {least:.0f} m"]


@pytest.mark.parametrize("item", [Command.DELAY, Command.CONDITION_DELAY])
def test_delay_in_hover_is_spent_at_the_place_reached(item: Command) -> None:
    sortie = hovering()
    wait = sortie.item(item, params=(12.0, 0.0, 0.0, 0.0))
    sortie.start(sortie.waypoint(50.0, 0.0, 30.0), wait, sortie.waypoint(0.0, 0.0, 30.0)).until_item(0)
    began = sortie.view.time
    sortie.until_item(1)
    assert sortie.view.time - began == pytest.approx(12.0, abs=0.1)
    assert sortie.distance(50.0, 0.0) < 1.0


def test_delay_wing_borne_is_spent_circling() -> None:
    sortie = flying()
    wait = sortie.item(Command.DELAY, params=(30.0, 0.0, 0.0, 0.0))
    sortie.start(sortie.waypoint(300.0, 0.0, 50.0), wait, sortie.waypoint(2000.0, 0.0, 50.0)).until_item(1)
    assert sortie.distance(300.0, 80.0) < 120.0


@pytest.mark.parametrize(
    ("params", "heading", "seconds"),
    [
        ((90.0, 30.0, 0.0, 0.0), 90.0, 3.0),
        ((270.0, 30.0, 0.0, 0.0), -90.0, 3.0),
        ((270.0, 30.0, 1.0, 0.0), -90.0, 9.0),
        ((40.0, 10.0, -1.0, 1.0), -40.0, 4.0),
    ],
)
def test_condition_yaw_turns_by_the_way_and_at_the_rate_asked_for(
    params: tuple[float, float, float, float], heading: float, seconds: float
) -> None:
    sortie = hovering()
    sortie.start(sortie.item(Command.CONDITION_YAW, params=params), sortie.waypoint(0.0, 0.0, 30.0)).until_item(0)
    assert math.remainder(math.degrees(sortie.view.yaw) - heading, 360.0) == pytest.approx(0.0, abs=5.0)
    assert sortie.view.time == pytest.approx(seconds, abs=0.5)


def test_vtol_takeoff_climbs_vertically_turns_and_then_accelerates_to_its_place_and_height() -> None:
    sortie = Sortie(MIS_TAKEOFF_ALT=20.0)
    takeoff = sortie.item(Command.VTOL_TAKEOFF, (0.0, 400.0), 60.0)
    sortie.start(takeoff, sortie.waypoint(2000.0, 400.0, 60.0))
    sortie.until(lambda: math.hypot(sortie.view.vn, sortie.view.ve) > 1.0)
    assert -sortie.view.down == pytest.approx(20.0, abs=1.0)
    assert sortie.distance(0.0, 0.0) < 1.0
    assert sortie.view.yaw == pytest.approx(math.pi / 2, abs=math.radians(10.0))
    assert sortie.mission.cruise
    sortie.until_item(0)
    assert sortie.view.airspeed > 13.5
    assert sortie.view.down < -30.0
    sortie.until_item(1)


@pytest.mark.parametrize(
    ("choice", "yaw", "heading"), [(1, 0.0, 180.0), (2, 0.0, 0.0), (3, -45.0, -45.0), (4, 0.0, 0.0)]
)
def test_vtol_takeoff_accelerates_at_the_heading_chosen(choice: int, yaw: float, heading: float) -> None:
    sortie = Sortie()
    takeoff = sortie.item(Command.VTOL_TAKEOFF, None, 30.0, params=(0.0, choice, 0.0, yaw))
    sortie.start(takeoff, sortie.waypoint(-1000.0, 0.0, 30.0)).until(lambda: sortie.view.airspeed > 10.0)
    course = math.degrees(math.atan2(sortie.view.ve, sortie.view.vn))
    assert math.remainder(course - heading, 360.0) == pytest.approx(0.0, abs=2.0)


def test_takeoff_climbs_vertically_to_its_height_and_stays_hovering() -> None:
    sortie = Sortie()
    sortie.start(sortie.item(Command.TAKEOFF, None, 25.0), sortie.waypoint(50.0, 0.0, 25.0)).until_item(0)
    assert -sortie.view.down == pytest.approx(25.0, abs=1.0)
    assert sortie.distance(0.0, 0.0) < 0.5
    sortie.until_item(1)
    assert not sortie.mission.cruise


def test_takeoff_with_a_place_elsewhere_hovers_there() -> None:
    sortie = Sortie()
    sortie.start(sortie.item(Command.TAKEOFF, (40.0, 0.0), 15.0)).until_item(0)
    assert sortie.distance(40.0, 0.0) < 2.0
    assert -sortie.view.down == pytest.approx(15.0, abs=1.0)


def test_takeoff_in_flight_is_passed_over() -> None:
    sortie = flying()
    sortie.start(sortie.item(Command.TAKEOFF, None, 30.0), sortie.waypoint(1000.0, 0.0, 50.0)).run(1.0)
    assert sortie.mission.reached == [0]
    assert sortie.mission.cruise


def test_mission_without_take_off_is_begun_on_the_ground_with_one() -> None:
    sortie = Sortie(MIS_TAKEOFF_ALT=12.0)
    sortie.start(sortie.waypoint(50.0, 0.0, 30.0)).until(lambda: sortie.view.north > 0.5)
    assert -sortie.view.down == pytest.approx(12.0, abs=1.0)


def test_transition_to_hover_brings_the_vehicle_to_a_stop_before_the_next_item() -> None:
    sortie = flying()
    back = sortie.item(Command.DO_VTOL_TRANSITION, params=(3.0, 0.0, 0.0, 0.0))
    sortie.start(sortie.waypoint(300.0, 0.0, 50.0), back, sortie.waypoint(500.0, 0.0, 50.0)).until_item(1)
    assert math.hypot(sortie.view.vn, sortie.view.ve) < 0.6
    assert not sortie.mission.cruise
    sortie.finish()
    assert sortie.distance(500.0, 0.0) < 2.0


def test_transition_to_cruise_turns_to_the_next_place_first_and_ends_wing_borne() -> None:
    sortie = hovering()
    front = sortie.item(Command.DO_VTOL_TRANSITION, params=(4.0, 0.0, 0.0, 0.0))
    sortie.start(front, sortie.waypoint(0.0, -1500.0, 30.0)).until(lambda: sortie.mission.cruise)
    assert sortie.view.yaw == pytest.approx(-math.pi / 2, abs=math.radians(10.0))
    assert sortie.distance(0.0, 0.0) < 1.0
    sortie.until_item(0)
    assert sortie.view.airspeed >= 13.5
    sortie.until_item(1)


@pytest.mark.parametrize("command", [Command.LAND, Command.VTOL_LAND])
def test_landing_is_approached_on_the_wing_and_ends_on_the_point(command: Command) -> None:
    sortie = flying()
    sortie.start(sortie.item(command, (900.0, 300.0), 0.0)).run(10.0)
    assert sortie.view.airspeed > 18.0
    sortie.finish()
    assert sortie.follower.landed == LandedState.ON_GROUND
    assert sortie.distance(900.0, 300.0) < 1.0


def test_vtol_landing_descends_to_its_approach_altitude_and_lands_with_its_heading() -> None:
    sortie = flying()
    land = sortie.item(Command.VTOL_LAND, (900.0, 0.0), 0.0, params=(0.0, 0.0, 25.0, 120.0))
    sortie.start(land).until(lambda: math.hypot(sortie.view.vn, sortie.view.ve) < 1.0)
    assert -sortie.view.down == pytest.approx(25.0, abs=2.0)
    sortie.finish()
    assert math.degrees(sortie.view.yaw) == pytest.approx(120.0, abs=2.0)
