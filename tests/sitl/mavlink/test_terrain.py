"""Terrain protocol: https://mavlink.io/en/services/terrain.html."""

import pytest

from sitl.simulation import Simulation
from tests.sitl.mavlink.in_memory import Desk

HOME_ALTITUDE = 488.0


def test_a_check_is_answered_with_the_ground_at_that_place_and_the_vehicles_height_above_it() -> None:
    desk = Desk(Simulation(start="trim:20", home=(47.4, 8.5, HOME_ALTITUDE, 0.0)))
    other = desk.join(254)
    desk.advance(1.0)
    desk.send("TERRAIN_CHECK", lat=474_100_000, lon=85_200_000)
    (report,) = desk.of("TERRAIN_REPORT")
    assert (report.lat, report.lon) == (474_100_000, 85_200_000)
    assert report.terrain_height == pytest.approx(HOME_ALTITUDE, abs=0.5)
    assert report.current_height == pytest.approx(desk.simulation.snapshot().altitude_msl - HOME_ALTITUDE, abs=0.5)
    assert report.spacing > 0  # 0 would mean that the terrain is not known there
    assert (report.pending, report.loaded) == (0, 0)
    assert other.of("TERRAIN_REPORT") == []
    desk.close()


@pytest.mark.parametrize("place", [{"lat": 910_000_000}, {"lon": -(2**31)}, {"lat": -900_000_001, "lon": 7}])
def test_a_place_that_is_none_gets_a_text_that_says_so(desk: Desk, place: dict[str, int]) -> None:
    desk.send("TERRAIN_CHECK", **place)
    assert desk.of("TERRAIN_REPORT") == []
    assert any("Terrain: expected a latitude and longitude" in text for text in desk.station.texts)
