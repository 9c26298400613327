"""Rally points: which one Return would choose."""

import math

import pytest

from sitl.flight.places import LocalFrame
from sitl.flight.rally import Rally, RallyPoint
from vehicle_model.earth import make_environment


def rally(*places_ne: tuple[float, float]) -> Rally:
    places = LocalFrame(
        make_environment("flat", latitude=math.radians(47.4), longitude=math.radians(8.5), height_ellipsoid=488.0)
    )
    made = Rally(places)
    made.load(tuple(RallyPoint(*places.to_geodetic(*place, 0.0)[:2], 30.0) for place in places_ne))
    return made


def test_nearest_is_the_nearest_of_points_and_home() -> None:
    points = rally((1000.0, 0.0), (0.0, -800.0))
    assert points.nearest(900.0, 50.0) == pytest.approx((1000.0, 0.0, 0.0), abs=1e-3)
    assert points.nearest(0.0, -500.0) == pytest.approx((0.0, -800.0, 0.0), abs=1e-3)
    assert points.nearest(100.0, -100.0) == (0.0, 0.0, 0.0)


def test_without_points_it_is_home() -> None:
    assert rally().nearest(5000.0, 5000.0) == (0.0, 0.0, 0.0)


def test_point_off_the_map_is_refused_and_the_old_ones_stay() -> None:
    points = rally((1000.0, 0.0))
    with pytest.raises(ValueError, match="rally point 1: expected a latitude within"):
        points.load((RallyPoint(47.0, 8.0, 30.0), RallyPoint(147.0, 8.0, 30.0)))
    assert len(points.points) == 1
