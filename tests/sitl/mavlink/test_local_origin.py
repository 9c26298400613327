"""The origin of local coordinates."""

import pytest

from sitl.mavlink.local_origin import LocalOrigin
from sitl.simulation import Simulation


@pytest.fixture
def simulation() -> Simulation:
    return Simulation(home=(47.0, 8.0, 500.0, 0.0))


def test_it_begins_at_home(simulation: Simulation) -> None:
    origin = LocalOrigin(simulation.scenario.home)
    assert origin.geodetic == (470000000, 80000000, 500000)
    assert origin.seen(1.0, 2.0, 3.0) == (1.0, 2.0, 3.0)


def test_what_is_seen_from_it_is_meant_from_it(simulation: Simulation) -> None:
    origin = LocalOrigin(simulation.scenario.home)
    origin.put(470010000, 80010000, 510000, simulation.flight.places)
    assert (origin.north, origin.east, origin.down) == pytest.approx((111.2, 75.9, -10.0), abs=0.5)
    assert origin.meant(*origin.seen(5.0, -6.0, -70.0)) == pytest.approx((5.0, -6.0, -70.0))
    assert origin.seen(origin.north, origin.east, origin.down) == (0.0, 0.0, 0.0)


def test_only_another_place_counts_as_a_move(simulation: Simulation) -> None:
    origin = LocalOrigin(simulation.scenario.home)
    places = simulation.flight.places
    origin.put(470000000, 80000000, 500000, places)
    assert origin.moves == 0
    origin.put(470000001, 80000000, 500000, places)
    assert origin.moves == 1


@pytest.mark.parametrize("place", [(900000001, 0, 0), (0, 1800000001, 0), (0, 0, 0)])
def test_a_place_that_is_none_or_too_far_away_changes_nothing(
    simulation: Simulation, place: tuple[int, int, int]
) -> None:
    origin = LocalOrigin(simulation.scenario.home)
    with pytest.raises(ValueError, match="origin: expected"):
        origin.put(*place, simulation.flight.places)
    assert origin.geodetic == (470000000, 80000000, 500000)
    assert origin.moves == 0
