"""Return: the way it takes by distance and height, and where it ends."""

import math

import pytest

from sitl.flight.mission_items import Command, MissionItem
from sitl.flight.mode import Mode
from sitl.flight.rally import RallyPoint
from sitl.flight.regime import Regime


def distance_home(vehicle):
    return math.hypot(vehicle.view.north, vehicle.view.east)


def waypoint(north, east, height, command=Command.WAYPOINT):
    return MissionItem(command, x=47.397742 + north / 111_194.0, y=8.545594 + east / 75_500.0, z=height)


def test_return_from_far_climbs_flies_home_on_the_wing_and_lands_there(vehicle):
    vehicle.begin(height=25.0)
    vehicle.view.north, vehicle.view.east = 600.0, -300.0
    vehicle.flight.hold()
    vehicle.flight.return_home()
    highest = 0.0
    cruised = False
    while vehicle.flight.armed and vehicle.view.time < 300.0:
        if vehicle.view.down > -38.0 and vehicle.view.time < 15.0:
            assert math.hypot(vehicle.view.north - 600.0, vehicle.view.east + 300.0) < 1.0  # climbs before it leaves
        vehicle.step()
        highest = max(highest, -vehicle.view.down)
        cruised = cruised or vehicle.flight.regime == Regime.CRUISE
    assert not vehicle.flight.armed
    assert cruised
    assert highest == pytest.approx(40.0, abs=1.0)
    assert distance_home(vehicle) < 1.0


def test_return_from_near_stays_in_hover(vehicle):
    vehicle.begin(height=25.0)
    vehicle.view.north = 60.0
    vehicle.flight.hold()
    vehicle.flight.return_home()
    while vehicle.flight.armed and vehicle.view.time < 200.0:
        vehicle.step()
        assert vehicle.flight.regime == Regime.HOVER
    assert distance_home(vehicle) < 1.0


def test_return_waits_above_home_for_a_command_with_a_negative_delay(make_vehicle):
    vehicle = make_vehicle(RTL_LAND_DELAY=-1.0).begin(height=30.0)
    vehicle.flight.return_home()
    vehicle.run(120.0)
    assert vehicle.flight.mode == Mode.RETURN
    assert -vehicle.view.down == pytest.approx(20.0, abs=1.0)


def test_return_by_the_missions_landing(make_vehicle):
    vehicle = make_vehicle(RTL_TYPE=2)
    vehicle.flight.load_mission(
        [
            waypoint(0.0, 0.0, 30.0, Command.TAKEOFF),
            waypoint(300.0, 0.0, 30.0),
            MissionItem(Command.DO_LAND_START),
            waypoint(0.0, 200.0, 40.0),
            waypoint(0.0, 120.0, 0.0, Command.LAND),
        ]
    )
    vehicle.begin(height=45.0)
    vehicle.flight.return_home()
    vehicle.run_until(lambda: not vehicle.flight.armed, timeout=300.0)
    assert vehicle.view.east == pytest.approx(120.0, abs=2.0)
    assert vehicle.view.north == pytest.approx(0.0, abs=2.0)


def test_return_on_the_wing_climbs_circling_and_arrives_hovering(vehicle):
    vehicle.begin(height=30.0, airspeed=20.0)
    vehicle.view.north = 800.0
    vehicle.flight.hold()
    vehicle.flight.return_home()
    vehicle.run(1.0)
    assert vehicle.record["radius"] == 80.0
    vehicle.run_until(lambda: not vehicle.flight.armed, timeout=300.0)
    assert distance_home(vehicle) < 1.0


def test_return_higher_than_its_altitude_does_not_descend_on_the_way(vehicle):
    vehicle.begin(height=90.0)
    vehicle.view.north = 500.0
    vehicle.flight.hold()
    vehicle.flight.return_home()
    vehicle.run_until(lambda: distance_home(vehicle) < 100.0)
    assert vehicle.view.down == pytest.approx(-90.0, abs=0.5)


def test_nearest_rally_point_is_returned_to(vehicle):
    latitude, longitude, _ = vehicle.flight.places.to_geodetic(250.0, 0.0, 0.0)
    vehicle.flight.rally.load((RallyPoint(latitude, longitude, 30.0),))
    vehicle.begin(height=40.0)
    vehicle.view.north = 200.0
    vehicle.flight.hold()
    vehicle.flight.return_home()
    vehicle.run_until(lambda: not vehicle.flight.armed, timeout=300.0)
    assert vehicle.view.north == pytest.approx(250.0, abs=1.0)


def test_return_in_hover_can_be_asked_for_on_the_way(vehicle):
    vehicle.begin(height=45.0)
    vehicle.view.north = 400.0
    vehicle.flight.hold()
    vehicle.flight.return_home()
    vehicle.run_until(lambda: vehicle.flight.regime == Regime.CRUISE, timeout=30.0)
    vehicle.flight.transition(cruise=False)
    vehicle.run_until(lambda: vehicle.flight.regime == Regime.HOVER, timeout=30.0)
    vehicle.run(5.0)
    assert vehicle.flight.mode == Mode.RETURN
    assert math.hypot(vehicle.view.vn, vehicle.view.ve) <= 5.0 + 1e-6  # MPC_XY_CRUISE
