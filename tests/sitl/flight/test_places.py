"""Maps and the local frame: there and back, heights, a home that moves."""

import math

import pytest

from sitl.flight.places import LocalFrame
from vehicle_model.earth import make_environment

LATITUDE, LONGITUDE, ALTITUDE = 47.397742, 8.545594, 488.0


def frame(earth: str = "wgs84") -> LocalFrame:
    environment = make_environment(
        earth,  # pyright: ignore[reportArgumentType]
        latitude=math.radians(LATITUDE),
        longitude=math.radians(LONGITUDE),
        height_ellipsoid=ALTITUDE,
    )
    return LocalFrame(environment)


@pytest.mark.parametrize("earth", ["flat", "round", "wgs84"])
@pytest.mark.parametrize("place", [(0.0, 0.0, 0.0), (1500.0, -2300.0, -120.0), (-9000.0, 12000.0, 30.0)])
def test_a_place_there_and_back_is_the_same(earth: str, place: tuple[float, float, float]) -> None:
    places = frame(earth)
    assert places.to_ned(*places.to_geodetic(*place)) == pytest.approx(place, abs=1e-3)


def test_down_is_the_difference_in_altitude_also_where_the_earth_has_curved_away() -> None:
    places = frame()
    assert places.to_ned(LATITUDE + 0.2, LONGITUDE, 538.0)[2] == -50.0
    assert places.to_geodetic(22000.0, 0.0, -50.0)[2] == 538.0
    # The tangent plane is 38 m above the ellipsoid there: d^2 / 2R.
    assert pytest.approx(38.0, abs=0.1) == 22000.0**2 / (2 * 6.37e6)


def test_degree_of_latitude_has_its_length() -> None:
    north, east, _ = frame().to_ned(LATITUDE + 0.01, LONGITUDE, ALTITUDE)
    assert north == pytest.approx(math.radians(0.01) * (6_370_060.0 + 488.0), abs=0.1)  # meridian radius there
    assert east == pytest.approx(0.0, abs=1e-6)


def test_home_moves_and_the_frame_stays() -> None:
    places = frame()
    home = places.home
    assert home.geodetic == pytest.approx((LATITUDE, LONGITUDE, ALTITUDE))
    home.move_to(LATITUDE, LONGITUDE, 500.0)
    assert (home.north, home.east, home.down) == pytest.approx((0.0, 0.0, -12.0), abs=1e-6)
    assert home.altitude == 500.0
    assert places.to_ned(LATITUDE, LONGITUDE, 488.0)[2] == 0.0
