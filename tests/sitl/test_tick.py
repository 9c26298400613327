"""The compiled tick: the same bits however ticks are grouped, commands that act one tick later, wind that is felt."""

import numpy as np
import pytest

from sitl.flight.demand import Demand
from tests.sitl.control.flown import PERIOD, Flown, aircraft
from vehicle_model.battery import make_battery
from vehicle_model.wind import Gust

GUSTS = [Gust(0.5, 40.0, (-4.0, 2.0, -3.0)), Gust(1.7, 25.0, (0.0, 5.0, 1.0))]
TICKS = 1600


def tasks(demand: Demand, tick: int) -> None:
    """A demand that changes at ticks that every grouping below has in common."""
    if tick == 0:
        demand.leg((0.0, 0.0, -30.0), (900.0, 50.0, -60.0), speed=18.0, cruise=True)
    elif tick == 800:
        demand.point((200.0, 40.0, -40.0), speed=15.0)
        demand.climb(1.0)


def flown_in(groups: list[int], airspeed: float) -> Flown:
    """4 s through shear and gusts, so many ticks at a time."""
    flown = Flown(airspeed, height=30.0, wind=(2.0, -3.0, 0.0), roughness=0.2, gusts=GUSTS)
    turn = 0
    while flown.airframe.tick < TICKS:
        tasks(flown.demand, flown.airframe.tick)
        flown.airframe.advance(groups[turn % len(groups)])
        turn += 1
    assert flown.airframe.tick == TICKS
    return flown


@pytest.mark.parametrize("airspeed", [0.0, 18.0])
@pytest.mark.parametrize("groups", [[1], [8], [1, 7, 12, 30, 350]])
def test_the_laws_in_shear_and_gusts_fly_the_same_bits_however_ticks_are_grouped(
    groups: list[int], airspeed: float
) -> None:
    at_once, in_groups = flown_in([800], airspeed), flown_in(groups, airspeed)
    np.testing.assert_array_equal(in_groups.airframe.state, at_once.airframe.state)
    np.testing.assert_array_equal(in_groups.airframe.controls, at_once.airframe.controls)
    assert in_groups.airframe.status.tobytes() == at_once.airframe.status.tobytes()
    assert in_groups.airframe.battery == at_once.airframe.battery


def test_looking_at_a_flight_does_not_change_it() -> None:
    watched, alone = flown_in([800], 18.0), flown_in([800], 18.0)
    for _ in range(50):
        watched.airframe.snapshot()
        watched.airframe.advance(2)
    alone.airframe.advance(100)
    assert watched.airframe.state.tobytes() == alone.airframe.state.tobytes()


def test_a_command_acts_a_tick_after_the_estimate_it_was_made_of() -> None:
    flown = Flown(height=30.0)
    before = flown.airframe.controls
    flown.demand.direct((0.1, 0.2, 0.3, 1.0, 0.01, 0.02, 0.03))
    flown.airframe.advance()
    np.testing.assert_array_equal(flown.airframe.controls, before)
    flown.airframe.advance()
    np.testing.assert_array_equal(flown.airframe.controls, (0.1, 0.2, 0.3, 1.0, 0.01, 0.02, 0.03))


def test_with_controls_from_outside_the_laws_move_nothing() -> None:
    flown = Flown(20.0, height=100.0)
    flown.airframe.controls_from_outside = True
    held = flown.airframe.controls
    flown.demand.leg((0.0, 0.0, -100.0), (900.0, 900.0, -150.0), speed=28.0, cruise=True)
    flown.airframe.advance(200)
    np.testing.assert_array_equal(flown.airframe.controls, held)


def test_the_wind_of_a_gust_is_that_which_the_vehicle_meets_on_its_way() -> None:
    """(1 - cos)/2 of the way through the air since the gust began, which at constant airspeed is time."""
    flown = Flown(20.0, height=100.0, gusts=[Gust(0.5, 40.0, (0.0, 0.0, -2.0))])
    flown.demand.leg((0.0, 0.0, -100.0), (900.0, 0.0, -100.0), speed=20.0, cruise=True)
    seen = np.empty((1200, 2))
    for row in seen:
        flown.airframe.advance()
        row[:] = flown.airframe.snapshot().wind_ned[2], flown.time
    way = np.clip(20.0 * (seen[:, 1] - 0.5), 0.0, 40.0)
    np.testing.assert_allclose(seen[:, 0], -1.0 + np.cos(2.0 * np.pi * way / 40.0), atol=0.05)


def test_the_battery_gives_what_the_motors_and_the_avionics_draw() -> None:
    """Its charge times its voltage, which changes by per cents only, is the energy of the flight."""
    flown = Flown(height=100.0)
    flown.demand.point((0.0, 0.0, -100.0), speed=5.0)
    flown.fly(60.0)
    pack = make_battery(aircraft().battery)[0]
    voltage, _, remaining = flown.airframe.battery
    assert remaining is not None
    used = (1.0 - remaining) * float(pack["capacity"]) * voltage
    drawn = float((flown.history()["power"] + pack["avionics_power"]).sum()) * PERIOD
    assert drawn > 60.0 * 1000.0
    assert used == pytest.approx(drawn, rel=0.03)
