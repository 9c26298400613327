"""What commands to a flight do, from arming to the motors' stop."""

import math
from dataclasses import replace

import pytest

from sitl.control.records import Level
from sitl.flight.landed import LandedState
from sitl.flight.mission_items import Command, MissionItem
from sitl.flight.mode import Mode
from sitl.flight.refused import Refused
from sitl.flight.regime import Regime


def take_off(vehicle, height=30.0):
    vehicle.flight.arm()
    vehicle.flight.takeoff(height)
    vehicle.run_until(lambda: vehicle.flight.mode == Mode.HOLD)
    vehicle.run(3.0)


def distance_home(vehicle):
    return math.hypot(vehicle.view.north, vehicle.view.east)


def waypoint(north, east, height, command=Command.WAYPOINT):
    return MissionItem(command, x=47.397742 + north / 111_194.0, y=8.545594 + east / 75_500.0, z=height)


def test_disarmed_vehicle_keeps_its_motors_off(vehicle):
    vehicle.run(1.0)
    assert vehicle.record["level"] == Level.OFF
    assert not vehicle.flight.armed
    assert vehicle.flight.on_ground


def test_armed_vehicle_on_the_ground_idles(vehicle):
    vehicle.flight.arm()
    vehicle.run(1.0)
    assert vehicle.record["level"] == Level.IDLE


def test_arming_is_refused_with_every_reason_and_force_overrides(vehicle):
    vehicle.view.battery_remaining = 0.05
    vehicle.view.roll = math.radians(30.0)
    with pytest.raises(Refused, match=r"battery at 5 %.*not level") as refusal:
        vehicle.flight.arm()
    assert refusal.value.temporary
    assert len(vehicle.flight.arming_problems) == 2
    assert not vehicle.flight.armed
    vehicle.flight.arm(force=True)
    assert vehicle.flight.armed


def test_takeoff_climbs_vertically_to_its_height_and_holds_there(vehicle):
    take_off(vehicle, 30.0)
    assert vehicle.view.down == pytest.approx(-30.27, abs=0.3)
    assert distance_home(vehicle) < 0.1
    assert vehicle.flight.landed == LandedState.IN_AIR
    assert vehicle.flight.regime == Regime.HOVER


def test_takeoff_waits_on_the_ground_for_the_wing(vehicle):
    vehicle.view.tilt = vehicle.view.tilt_command = math.radians(20.0)
    vehicle.flight.begin(vehicle.view, airborne=False)
    vehicle.flight.takeoff(10.0)
    vehicle.flight.arm()
    vehicle.flight.update(vehicle.view)
    assert vehicle.record["level"] == Level.IDLE
    vehicle.run(5.0)
    assert vehicle.record["level"] == Level.VELOCITY


def test_takeoff_asked_for_before_arming_begins_with_it(vehicle):
    vehicle.flight.takeoff(10.0)
    vehicle.run(1.0)
    assert vehicle.flight.on_ground
    vehicle.flight.arm()
    vehicle.run_until(lambda: vehicle.flight.mode == Mode.HOLD, timeout=20.0)
    assert vehicle.view.down == pytest.approx(-10.27, abs=1.0)


def test_takeoff_in_the_air_is_hold(vehicle):
    vehicle.begin(height=40.0)
    vehicle.flight.takeoff(100.0)
    vehicle.run(5.0)
    assert vehicle.flight.mode == Mode.HOLD
    assert vehicle.view.down == pytest.approx(-40.0, abs=0.1)


def test_takeoff_height_below_the_least_is_refused(vehicle):
    with pytest.raises(Refused, match=r"take-off height: expected 2 to 5000 m, got 0.5"):
        vehicle.flight.takeoff(0.5)


def test_landing_touches_down_slowly_and_disarms_within_three_seconds(vehicle):
    take_off(vehicle, 20.0)
    vehicle.flight.land()
    vehicle.run_until(lambda: vehicle.view.down > vehicle.ground - 0.01)
    assert vehicle.record["velocity_ned"][2] < 0.6
    touched = vehicle.view.time
    vehicle.run_until(lambda: not vehicle.flight.armed, timeout=10.0)
    assert vehicle.view.time - touched < 3.0
    assert vehicle.record["level"] == Level.OFF
    assert distance_home(vehicle) < 1.0
    assert vehicle.flight.mode == Mode.HOLD


def test_vehicle_can_be_armed_and_flown_again_at_once_after_landing(vehicle):
    take_off(vehicle, 10.0)
    vehicle.flight.land()
    vehicle.run_until(lambda: not vehicle.flight.armed)
    take_off(vehicle, 10.0)
    assert vehicle.view.down == pytest.approx(-10.27, abs=0.5)


def test_land_in_cruise_first_slows_down_to_hover(vehicle):
    vehicle.begin(height=50.0, airspeed=20.0)
    vehicle.run(1.0)
    vehicle.flight.land()
    vehicle.run(1.0)
    assert vehicle.flight.regime == Regime.TO_HOVER
    assert vehicle.record["cruise"] == 0
    vehicle.run_until(lambda: vehicle.view.down > -45.0)
    assert math.hypot(vehicle.view.vn, vehicle.view.ve) < 1.0
    vehicle.run_until(lambda: not vehicle.flight.armed)


def test_disarming_in_flight_needs_force(vehicle):
    take_off(vehicle, 10.0)
    with pytest.raises(Refused, match="flying"):
        vehicle.flight.disarm()
    assert vehicle.flight.armed
    vehicle.flight.disarm(force=True)
    vehicle.run(0.02)
    assert vehicle.record["level"] == Level.OFF


def test_hold_in_hover_brakes_and_stays(vehicle):
    vehicle.begin(height=40.0)
    vehicle.view.vn = 6.0
    vehicle.flight.hold()
    vehicle.run(10.0)
    north = vehicle.view.north
    assert 5.0 < north < 20.0  # 6 m/s at 2 m/s^2: 9 m
    vehicle.run(10.0)
    assert vehicle.view.north == pytest.approx(north, abs=0.2)


def test_hold_in_cruise_circles_from_where_the_vehicle_is(vehicle):
    vehicle.begin(height=60.0, airspeed=20.0, heading=math.radians(90.0))
    vehicle.run(1.0)
    centre = vehicle.record["position_ned"].copy()
    assert math.hypot(*centre[:2]) == pytest.approx(80.0)
    assert centre[0] < 0.0  # to the right of a flight to the east: clockwise
    turned = 0.0
    for _ in range(2000):
        before = math.atan2(vehicle.view.east - centre[1], vehicle.view.north - centre[0])
        vehicle.step()
        after = math.atan2(vehicle.view.east - centre[1], vehicle.view.north - centre[0])
        turned += math.remainder(after - before, 2.0 * math.pi)
        assert math.hypot(vehicle.view.north - centre[0], vehicle.view.east - centre[1]) == pytest.approx(80.0, abs=9.0)
    assert turned == pytest.approx(20.0 * 40.0 / 80.0, rel=0.1)


def test_transition_to_cruise_and_back_in_hold(vehicle):
    take_off(vehicle, 30.0)
    vehicle.flight.transition(cruise=True)
    vehicle.step()
    assert vehicle.flight.regime == Regime.TO_CRUISE
    vehicle.run_until(lambda: vehicle.flight.regime == Regime.CRUISE, timeout=20.0)
    assert vehicle.record["speed"] == 20.0
    vehicle.flight.transition(cruise=False)
    vehicle.step()
    assert vehicle.flight.regime == Regime.TO_HOVER
    vehicle.run_until(lambda: vehicle.flight.regime == Regime.HOVER, timeout=20.0)
    assert vehicle.flight.mode == Mode.HOLD
    assert vehicle.view.down == pytest.approx(-30.27, abs=0.5)


def test_transition_is_refused_on_the_ground_and_low_and_in_strong_wind(vehicle):
    with pytest.raises(Refused, match="on the ground"):
        vehicle.flight.transition(cruise=True)
    vehicle.begin(height=5.0)
    with pytest.raises(Refused, match="5 m above home, at least 10 m"):
        vehicle.flight.transition(cruise=True)
    vehicle.begin(height=50.0, airspeed=20.0)
    vehicle.view.wind_north = 16.0
    with pytest.raises(Refused, match="wind 16 m/s, at most FW_AIRSPD_MIN = 15 m/s"):
        vehicle.flight.transition(cruise=False)


def test_transition_during_takeoff_goes_on_in_hold(vehicle):
    vehicle.flight.arm()
    vehicle.flight.takeoff(60.0)
    vehicle.run_until(lambda: vehicle.view.down < -20.0)
    vehicle.flight.transition(cruise=True)
    assert vehicle.flight.mode == Mode.HOLD
    vehicle.run_until(lambda: vehicle.flight.regime == Regime.CRUISE, timeout=20.0)


def test_modes_that_cannot_be_flown_are_refused_with_the_reason(vehicle):
    flight = vehicle.flight
    for mode, reason in (
        (Mode.MISSION, "no mission"),
        (Mode.OFFBOARD, "no offboard setpoints"),
        (Mode.RETURN, "on the ground"),
        (Mode.LAND, "on the ground"),
        (Mode.ORBIT, "on the ground"),
        (Mode.MANUAL, "needs manual control"),
        (Mode.TERMINATION, "disarmed"),
    ):
        with pytest.raises(Refused, match=reason):
            flight.set_mode(mode)
        assert flight.mode == Mode.HOLD


def test_termination_stops_the_motors_and_ends_only_by_disarming(vehicle):
    take_off(vehicle, 20.0)
    vehicle.flight.set_mode(Mode.TERMINATION)
    vehicle.run(0.1)
    assert vehicle.record["level"] == Level.OFF
    assert vehicle.flight.armed
    for command in (vehicle.flight.hold, vehicle.flight.land, vehicle.flight.takeoff, vehicle.flight.return_home):
        with pytest.raises(Refused, match="terminated"):
            command()
    vehicle.flight.disarm()
    assert not vehicle.flight.armed
    assert vehicle.flight.mode == Mode.HOLD


def test_go_to_hovers_at_the_point(vehicle):
    vehicle.begin(height=30.0)
    vehicle.flight.go_to(50.0, 20.0, -40.0, speed=3.0, heading=1.0)
    vehicle.run(5.0)
    assert math.hypot(vehicle.view.vn, vehicle.view.ve) <= 3.0 + 1e-6
    vehicle.run(60.0)
    assert (vehicle.view.north, vehicle.view.east) == pytest.approx((50.0, 20.0), abs=0.5)
    assert vehicle.view.down == pytest.approx(-40.0, abs=0.2)
    assert vehicle.view.yaw == pytest.approx(1.0, abs=0.02)


def test_reposition_in_cruise_circles_the_place_on_the_map(vehicle):
    vehicle.begin(height=60.0, airspeed=20.0)
    latitude, longitude, _ = vehicle.flight.places.to_geodetic(400.0, 100.0, 0.0)
    vehicle.flight.reposition(latitude, longitude, 488.0 + 80.0, radius=-120.0)
    vehicle.run(60.0)
    around = math.hypot(vehicle.view.north - 400.0, vehicle.view.east - 100.0)
    assert around == pytest.approx(120.0, abs=12.0)
    assert vehicle.view.down == pytest.approx(-80.0, abs=0.5)
    assert vehicle.record["radius"] == -120.0


def test_places_that_are_too_low_or_outside_the_fence_are_refused(make_vehicle):
    vehicle = make_vehicle(GF_MAX_HOR_DIST=200.0).begin(height=30.0)
    with pytest.raises(Refused, match="altitude: expected at least 2 m above home, got -5 m"):
        vehicle.flight.go_to(10.0, 0.0, 5.0)
    with pytest.raises(Refused, match="place is outside the geofence: 300 m from home, 200 m allowed"):
        vehicle.flight.go_to(300.0, 0.0, -30.0)
    assert vehicle.record["position_ned"][0] == 0.0


def test_heights_above_the_fence_are_refused_with_the_reason(make_vehicle):
    vehicle = make_vehicle(GF_MAX_VER_DIST=50.0)
    flight = vehicle.flight
    reason = "altitude is outside the geofence: 60 m above home, 50 m allowed"
    with pytest.raises(Refused, match=reason):
        flight.takeoff(59.7)
    vehicle.begin(height=30.0)
    latitude, longitude, _ = flight.places.to_geodetic(10.0, 0.0, 0.0)
    for command in (
        lambda: flight.go_to(10.0, 0.0, -60.0),
        lambda: flight.reposition(latitude, longitude, 488.0 + 60.0),
        lambda: flight.change_altitude(488.0 + 60.0),
        lambda: flight.orbit((0.0, 0.0), 30.0, 3.0, down=-60.0),
    ):
        with pytest.raises(Refused, match=reason):
            command()
    assert flight.mode == Mode.HOLD
    vehicle.run(20.0)
    assert vehicle.view.down == pytest.approx(-30.0, abs=0.1)


def test_orbit_is_refused_where_its_circle_leaves_the_fence(make_vehicle):
    vehicle = make_vehicle(GF_MAX_HOR_DIST=100.0).begin(height=30.0)
    with pytest.raises(Refused, match="outside the geofence: 120 m from home"):
        vehicle.flight.orbit((80.0, 0.0), 40.0, 4.0)
    vehicle.flight.orbit((50.0, 0.0), 40.0, 4.0)
    assert vehicle.flight.mode == Mode.ORBIT


def test_orbit_flies_around_its_centre_facing_it(vehicle):
    vehicle.begin(height=30.0)
    vehicle.flight.orbit((0.0, 40.0), 40.0, 4.0)
    assert vehicle.flight.mode == Mode.ORBIT
    vehicle.run(60.0)
    view = vehicle.view
    assert math.hypot(view.north, view.east - 40.0) == pytest.approx(40.0, abs=3.0)
    facing = math.atan2(40.0 - view.east, -view.north)
    assert math.remainder(view.yaw - facing, 2.0 * math.pi) == pytest.approx(0.0, abs=0.05)


def test_orbit_too_tight_for_the_wing_is_refused_and_changes_nothing(vehicle):
    vehicle.begin(height=60.0, airspeed=20.0)
    with pytest.raises(Refused, match="orbit radius: expected at least 58 m wing-borne in this wind, got 30 m"):
        vehicle.flight.orbit((0.0, 0.0), 30.0)
    assert vehicle.flight.mode == Mode.HOLD


def test_change_of_speed_and_altitude_are_flown_in_hold(vehicle):
    vehicle.begin(height=60.0, airspeed=20.0)
    vehicle.flight.change_speed(airspeed=25.0)
    vehicle.flight.change_altitude(488.0 + 75.0)
    vehicle.run(30.0)
    assert vehicle.view.airspeed == pytest.approx(25.0, abs=0.5)
    assert vehicle.view.down == pytest.approx(-75.0, abs=0.5)
    with pytest.raises(Refused, match="airspeed: expected 15 to 30 m/s, got 40"):
        vehicle.flight.change_speed(airspeed=40.0)


def test_mission_is_flown_paused_and_resumed(vehicle):
    flight = vehicle.flight
    flight.load_mission(
        [
            waypoint(0.0, 0.0, 20.0, Command.TAKEOFF),
            waypoint(40.0, 0.0, 20.0),
            waypoint(40.0, 40.0, 20.0),
            waypoint(0.0, 0.0, 0.0, Command.LAND),
        ]
    )
    flight.start_mission()
    flight.arm()
    vehicle.run_until(lambda: flight.mission.current == 2)
    flight.pause()
    assert flight.mode == Mode.HOLD
    vehicle.run(10.0)
    assert flight.mission.current == 2
    flight.resume()
    vehicle.run_until(lambda: not flight.armed, timeout=200.0)
    assert flight.mission.finished
    assert flight.mission.reached == [0, 1, 2, 3]
    assert distance_home(vehicle) < 1.5


def test_mission_item_that_is_not_there_is_refused(vehicle):
    vehicle.flight.load_mission([waypoint(0.0, 0.0, 20.0, Command.TAKEOFF), waypoint(30.0, 0.0, 20.0)])
    with pytest.raises(Refused, match="mission item: expected one of 2, counted from 0, got 2"):
        vehicle.flight.start_mission(2)


def test_without_a_mission_there_is_no_item_to_go_to(vehicle):
    for command in (vehicle.flight.jump_to, vehicle.flight.start_mission):
        with pytest.raises(Refused, match=r"^no mission: upload one first$"):
            command(0)


def test_mission_that_waits_after_an_item_without_autocontinue_is_resumed(vehicle):
    flight = vehicle.flight
    stop = replace(waypoint(40.0, 0.0, 20.0), autocontinue=False)
    flight.load_mission([waypoint(0.0, 0.0, 20.0, Command.TAKEOFF), stop, waypoint(40.0, 40.0, 20.0)])
    flight.start_mission()
    flight.arm()
    vehicle.run_until(lambda: flight.mission.paused)
    vehicle.run(10.0)
    assert flight.mode == Mode.MISSION
    flight.resume()
    vehicle.run_until(lambda: flight.mission.finished, timeout=60.0)
    assert flight.mission.reached == [0, 1, 2]


def test_home_follows_a_vehicle_that_is_armed_elsewhere(vehicle):
    vehicle.view.north = 100.0
    vehicle.run(0.1)
    vehicle.flight.arm()
    assert vehicle.flight.home.north == pytest.approx(100.0)
    assert vehicle.flight.home.down == pytest.approx(0.01, abs=0.02)


def test_same_commands_give_the_same_flight_to_the_last_bit(make_vehicle):
    def fly():
        vehicle = make_vehicle()
        take_off(vehicle, 30.0)
        vehicle.flight.transition(cruise=True)
        vehicle.run(20.0)
        vehicle.flight.return_home()
        vehicle.run(60.0)
        return vehicle.record.tobytes(), vehicle.view

    assert fly() == fly()
