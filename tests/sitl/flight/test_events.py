"""What happens to a flight by itself: failsafes, the ends of modes, automatic disarm."""

import math

import pytest

from sitl.flight.mission_items import Command, MissionItem
from sitl.flight.mode import Mode


def distance_home(vehicle):
    return math.hypot(vehicle.view.north, vehicle.view.east)


def waypoint(north, east, height, command=Command.WAYPOINT):
    return MissionItem(command, x=47.397742 + north / 111_194.0, y=8.545594 + east / 75_500.0, z=height)


def test_leaving_the_fence_leads_home(make_vehicle):
    vehicle = make_vehicle(GF_MAX_HOR_DIST=150.0).begin(height=50.0)
    vehicle.view.north = 140.0
    vehicle.view.vn = 8.0
    vehicle.flight.hold()
    vehicle.run_until(lambda: vehicle.flight.breach is not None, timeout=10.0)
    vehicle.step()
    assert vehicle.flight.mode == Mode.RETURN
    vehicle.run_until(lambda: not vehicle.flight.armed, timeout=200.0)
    assert distance_home(vehicle) < 1.5


def test_emergency_battery_lands_at_once(vehicle):
    vehicle.begin(height=30.0)
    vehicle.view.battery_remaining = 0.05
    vehicle.run(0.2)
    assert vehicle.flight.mode == Mode.LAND


def test_pilot_may_override_a_failsafe(vehicle):
    vehicle.begin(height=30.0)
    vehicle.view.battery_remaining = 0.05
    vehicle.run(0.2)
    vehicle.flight.hold()
    vehicle.run(5.0)
    assert vehicle.flight.mode == Mode.HOLD


def test_lost_ground_station_returns_after_its_delay(make_vehicle):
    vehicle = make_vehicle(NAV_DLL_ACT=2, COM_FAIL_ACT_T=5.0).begin(height=30.0)
    vehicle.flight.links.ground_station = 11.0
    vehicle.run(1.0)
    assert vehicle.flight.mode == Mode.HOLD
    vehicle.run(5.0)
    assert vehicle.flight.mode == Mode.RETURN


def test_vehicle_not_flown_disarms_by_itself(vehicle):
    vehicle.flight.arm()
    vehicle.run(9.0)
    assert vehicle.flight.armed
    vehicle.run(2.0)
    assert not vehicle.flight.armed
    assert any("no take-off" in message.text for message in vehicle.flight.messages.kept)


def test_mission_that_ends_in_the_air_leads_to_hold(vehicle):
    vehicle.flight.load_mission([waypoint(0.0, 0.0, 20.0, Command.TAKEOFF), waypoint(30.0, 0.0, 20.0)])
    vehicle.flight.start_mission()
    vehicle.flight.arm()
    vehicle.run_until(lambda: vehicle.flight.mission.finished)
    vehicle.run(1.0)
    assert vehicle.flight.mode == Mode.HOLD
    assert vehicle.flight.flying


def test_mission_goes_on_when_the_ground_station_is_back_in_time(make_vehicle):
    vehicle = make_vehicle(NAV_DLL_ACT=2, COM_FAIL_ACT_T=5.0)
    flight = vehicle.flight
    flight.load_mission([waypoint(0.0, 0.0, 20.0, Command.TAKEOFF), waypoint(200.0, 0.0, 20.0)])
    flight.start_mission()
    flight.arm()
    vehicle.run_until(lambda: flight.mission.current == 1 and vehicle.view.north > 20.0)
    flight.links.ground_station = 11.0
    vehicle.run(2.0)
    assert flight.mode == Mode.HOLD
    flight.links.ground_station = 0.1
    vehicle.run(0.5)
    assert flight.mode == Mode.MISSION
    vehicle.run_until(lambda: flight.mission.finished)
    assert vehicle.view.north == pytest.approx(200.0, abs=11.0)


def test_takeoff_interrupted_by_a_lost_link_ends_in_hold(make_vehicle):
    vehicle = make_vehicle(NAV_DLL_ACT=2, COM_FAIL_ACT_T=5.0)
    vehicle.flight.arm()
    vehicle.flight.takeoff(40.0)
    vehicle.run_until(lambda: vehicle.view.down < -10.0)
    vehicle.flight.links.ground_station = 11.0
    vehicle.run(1.0)
    vehicle.flight.links.ground_station = 0.1
    vehicle.run(30.0)
    assert vehicle.flight.mode == Mode.HOLD
    assert vehicle.view.down > -15.0


def test_failed_motor_lands(vehicle):
    vehicle.begin(height=30.0)
    vehicle.view.rotor_speed_commands = (500.0, 500.0, 0.0)
    vehicle.view.rotor_speeds = (500.0, 100.0, 0.0)
    vehicle.run(1.0)
    assert vehicle.flight.actuators.faults == ("right motor failed",)
    assert vehicle.flight.mode == Mode.LAND


def test_lost_attitude_terminates_if_the_circuit_breaker_allows(make_vehicle):
    vehicle = make_vehicle(CBRK_FLIGHTTERM=0).begin(height=30.0)
    vehicle.view.pitch = math.radians(80.0)
    vehicle.run(1.0)
    assert vehicle.flight.mode == Mode.TERMINATION
    assert vehicle.record["level"] == 0


def test_parameter_changed_in_flight_counts_at_once(vehicle):
    vehicle.begin(height=30.0)
    vehicle.run(0.1)
    vehicle.flight.parameters.set("MPC_Z_V_AUTO_UP", 1.25)
    vehicle.run(0.1)
    assert vehicle.record["climb_rate"] == 1.25


def test_unknown_parameter_is_an_error(make_vehicle):
    with pytest.raises(ValueError, match="FW_AIRSPD_TRM: unknown parameter, expected FW_AIRSPD_TRIM"):
        make_vehicle(FW_AIRSPD_TRM=20.0)


def test_fence_left_on_the_way_in_hold_stops_the_vehicle_where_it_is(make_vehicle):
    vehicle = make_vehicle(GF_ACTION=2).begin(height=30.0)
    flight = vehicle.flight
    flight.change_altitude(488.0 + 80.0)
    vehicle.run(1.0)
    flight.parameters.set("GF_MAX_VER_DIST", 50.0)
    vehicle.run_until(lambda: flight.breach is not None, timeout=20.0)
    vehicle.run(20.0)
    assert flight.mode == Mode.HOLD
    assert vehicle.view.down == pytest.approx(-50.0, abs=1.0)
    told = [message.text for message in flight.messages.kept if message.text.endswith("Hold")]
    assert len(told) == 1
    flight.change_altitude(488.0 + 40.0)
    vehicle.run(20.0)
    assert vehicle.view.down == pytest.approx(-40.0, abs=0.2)


def test_hold_lets_a_failsafe_wait_but_not_without_saying_what_comes(make_vehicle):
    vehicle = make_vehicle(NAV_DLL_ACT=2, COM_FAIL_ACT_T=5.0).begin(height=30.0)
    vehicle.flight.go_to(30.0, 0.0, -30.0)
    vehicle.flight.links.ground_station = 11.0
    vehicle.run(4.0)
    texts = [message.text for message in vehicle.flight.messages.kept]
    assert texts == ["Ground station lost", "Ground station lost: Return in 5 s"]
    assert vehicle.record["position_ned"][0] == 30.0
    vehicle.run(2.0)
    assert vehicle.flight.mode == Mode.RETURN


def test_vehicle_that_lies_on_its_back_is_down_and_stops_its_motors(vehicle):
    vehicle.begin(height=30.0)
    vehicle.flight.land()
    vehicle.view.down, vehicle.view.roll, vehicle.view.thrust = -0.3, math.radians(175.0), 0.8
    for _ in range(300):
        vehicle.view.time += 0.02
        vehicle.flight.update(vehicle.view)
    assert not vehicle.flight.armed
    assert vehicle.record["level"] == 0
    assert not vehicle.flight.failsafes.causes
