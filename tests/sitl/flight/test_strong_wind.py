"""Hovering in a wind as fast as flight on the wing: what lands, returns and makes transitions must not mistake it."""

import math

import pytest

from sitl import Scenario, Simulation
from sitl.flight.mission_items import Command, Frame, MissionItem
from sitl.flight.mode import Mode
from sitl.flight.regime import Regime
from sitl.scenario.scenario import Wind

NORTHERLY = (-12.0, 0.0)  # blowing to, on the nose [m/s]
WINDS = [
    pytest.param(NORTHERLY, 0.0, id="headwind"),
    pytest.param((0.0, 12.0), 0.0, id="crosswind"),
    pytest.param((-10.0, 0.0), 0.0457, id="shear"),  # 10 m/s at 20 ft, 13 m/s at 30 m
]


def hovering(wind: tuple[float, float], roughness: float = 0.0) -> Simulation:
    """In Hold at 30 m; the wind has freshened after the take-off, for nothing stands in it."""
    simulation = Simulation(Scenario(wind=Wind(roughness=roughness)))
    simulation.advance(0.1)
    simulation.flight.takeoff(30.0)
    simulation.flight.arm()
    assert simulation.run_until(lambda s: s.flight.mode == Mode.HOLD and s.flight.flying, 60.0)
    for share in range(1, 21):
        simulation.set_wind((wind[0] * share / 20.0, wind[1] * share / 20.0, 0.0))
        simulation.advance(1.0)
    simulation.advance(10.0)
    assert simulation.flight.view.airspeed > 0.99 * math.hypot(*wind)
    return simulation


def item(
    simulation: Simulation,
    command: Command,
    param1: float = 0.0,
    place: tuple[float, float] = (0.0, 0.0),
    z: float = 0.0,
) -> MissionItem:
    latitude, longitude, _ = simulation.flight.places.to_geodetic(*place, 0.0)
    return MissionItem(command, Frame.GLOBAL_RELATIVE_ALT, param1, x=latitude, y=longitude, z=z)


def lands(simulation: Simulation, place: tuple[float, float], timeout: float) -> None:
    assert simulation.run_until(lambda s: not s.flight.armed, timeout)
    view = simulation.flight.view
    assert view.down == pytest.approx(-0.27, abs=0.1)
    assert math.hypot(view.north - place[0], view.east - place[1]) < 1.5


@pytest.mark.parametrize(("wind", "roughness"), WINDS)
def test_land_comes_down_where_it_hovers(wind: tuple[float, float], roughness: float) -> None:
    simulation = hovering(wind, roughness)
    simulation.flight.land()
    lands(simulation, (0.0, 0.0), 60.0)


@pytest.mark.parametrize(("wind", "roughness"), WINDS)
def test_return_hovers_home_and_lands(wind: tuple[float, float], roughness: float) -> None:
    simulation = hovering(wind, roughness)
    simulation.flight.go_to(60.0, 20.0, -30.0)
    simulation.advance(40.0)
    simulation.flight.return_home()
    simulation.advance(1.0)
    assert simulation.flight.regime == Regime.HOVER
    lands(simulation, (0.0, 0.0), 120.0)


@pytest.mark.parametrize(("wind", "roughness"), WINDS)
def test_mission_hovers_to_its_landing(wind: tuple[float, float], roughness: float) -> None:
    simulation = hovering(wind, roughness)
    waypoint = item(simulation, Command.WAYPOINT, place=(40.0, 0.0), z=30.0)
    simulation.flight.load_mission([waypoint, item(simulation, Command.VTOL_LAND, place=(60.0, 10.0))])
    simulation.flight.start_mission()
    simulation.advance(1.0)
    assert simulation.flight.regime == Regime.HOVER
    lands(simulation, (60.0, 10.0), 120.0)


@pytest.mark.parametrize(("wind", "roughness"), WINDS)
def test_transition_item_turns_to_the_next_place_before_it_accelerates(
    wind: tuple[float, float], roughness: float
) -> None:
    simulation = hovering(wind, roughness)
    flight = simulation.flight
    items = [
        item(simulation, Command.DO_VTOL_TRANSITION, 4.0),
        item(simulation, Command.WAYPOINT, place=(0.0, 600.0), z=40.0),
        item(simulation, Command.DO_VTOL_TRANSITION, 3.0),
        item(simulation, Command.LAND, place=(0.0, 600.0)),
    ]
    flight.load_mission(items)
    flight.start_mission()
    assert simulation.run_until(lambda s: s.flight.mission.cruise, 30.0)
    aligned = abs(math.remainder(flight.view.yaw - 0.5 * math.pi, 2.0 * math.pi)) < math.radians(15.0)
    assert aligned or simulation.time > 40.0 + 14.0  # unless the wind did not let it turn in time
    assert simulation.run_until(lambda s: s.items_reached[-1:] == [0], 60.0)
    assert simulation.run_until(lambda s: s.items_reached[-1:] == [1], 120.0)
    assert abs(flight.view.north) < 15.0
    lands(simulation, (0.0, 600.0), 180.0)


@pytest.mark.parametrize("wind", [NORTHERLY, (-8.0, 0.0)])
def test_take_off_item_in_flight_climbs_with_the_wing_as_the_wind_has_it(wind: tuple[float, float]) -> None:
    simulation = hovering(wind)
    simulation.flight.load_mission([item(simulation, Command.VTOL_TAKEOFF, place=(0.0, 500.0), z=45.0)])
    simulation.flight.start_mission()
    simulation.advance(4.0)
    assert not simulation.flight.mission.cruise
    assert math.hypot(simulation.flight.view.north, simulation.flight.view.east) < 1.5
    assert simulation.run_until(lambda s: s.flight.mission.cruise, 60.0)
    assert simulation.flight.view.down < -43.0
