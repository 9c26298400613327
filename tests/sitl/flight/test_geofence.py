"""The geofence: in and out of polygons and circles, distance and height, what is no fence."""

import math

import pytest

from sitl.flight.geofence import Fence, FenceCircle, FencePolygon
from sitl.flight.parameters import Parameters
from sitl.flight.places import LocalFrame
from vehicle_model.earth import make_environment

PLACES = LocalFrame(
    make_environment("flat", latitude=math.radians(47.4), longitude=math.radians(8.5), height_ellipsoid=488.0)
)


def on_map(*points: tuple[float, float]) -> tuple[tuple[float, float], ...]:
    return tuple(PLACES.to_geodetic(north, east, 0.0)[:2] for north, east in points)


def circle(north: float, east: float, radius: float, *, inclusion: bool) -> FenceCircle:
    return FenceCircle(*on_map((north, east))[0], radius, inclusion)


SQUARE = ((-100.0, -100.0), (-100.0, 100.0), (100.0, 100.0), (100.0, -100.0))
# A U that opens to the north: the gap between its arms is outside.
HORSESHOE = ((0.0, 0.0), (300.0, 0.0), (300.0, 100.0), (100.0, 100.0), (100.0, 200.0), (300.0, 200.0), (300.0, 300.0),
             (0.0, 300.0))  # fmt: skip


def fence(*areas: FencePolygon | FenceCircle, **parameters: float) -> Fence:
    made = Fence(Parameters(parameters), PLACES)
    made.load(
        tuple(area for area in areas if isinstance(area, FencePolygon)),
        tuple(area for area in areas if isinstance(area, FenceCircle)),
    )
    return made


def test_without_areas_and_limits_everywhere_is_inside() -> None:
    assert fence().breach(1e5, -1e5, -1e4) is None


@pytest.mark.parametrize(("place", "inside"), [((0.0, 99.0), True), ((0.0, 101.0), False), ((-101.0, 0.0), False)])
def test_polygon_to_stay_in_and_to_stay_out_of(place: tuple[float, float], inside: bool) -> None:
    assert (fence(FencePolygon(on_map(*SQUARE), inclusion=True)).breach_at(*place) is None) is inside
    assert (fence(FencePolygon(on_map(*SQUARE), inclusion=False)).breach_at(*place) is None) is not inside


def test_polygon_with_a_bay_leaves_the_bay_out() -> None:
    horseshoe = fence(FencePolygon(on_map(*HORSESHOE), inclusion=True))
    assert horseshoe.breach_at(200.0, 50.0) is None
    assert horseshoe.breach_at(50.0, 150.0) is None
    assert horseshoe.breach_at(200.0, 150.0) is not None


def test_any_one_area_to_stay_in_is_enough_but_none_to_stay_out_of_may_hold() -> None:
    areas = fence(
        circle(0.0, 0.0, 100.0, inclusion=True),
        circle(300.0, 0.0, 100.0, inclusion=True),
        circle(300.0, 0.0, 20.0, inclusion=False),
    )
    assert areas.breach_at(0.0, 0.0) is None
    assert areas.breach_at(350.0, 0.0) is None
    assert areas.breach(310.0, 0.0, 0.0) == "inside circle 2 to stay out of"
    assert areas.breach(150.0, 0.0, 0.0) == "outside every area to stay in"


def test_distance_and_height_count_from_home_wherever_it_is() -> None:
    limited = fence(GF_MAX_HOR_DIST=500.0, GF_MAX_VER_DIST=100.0)
    assert limited.breach(499.0, 0.0, -99.0) is None
    assert limited.breach(0.0, 501.0, 0.0) == "501 m from home, 500 m allowed"
    assert limited.breach(0.0, 0.0, -120.0) == "120 m above home, 100 m allowed"
    try:
        PLACES.home.move(0.0, 400.0, -30.0)
        assert limited.breach(0.0, 501.0, -120.0) is None
    finally:
        PLACES.home.move(0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("area", "reason"),
    [
        (FencePolygon(((0.0, 0.0), (1.0, 1.0)), inclusion=True), "polygon 0: expected at least 3 corners, got 2"),
        (FencePolygon(((0.0, 0.0), (1.0, 1.0), (0.0, 1.0), (1.0, 0.0)), inclusion=True), "sides that do not cross"),
        (FencePolygon(((0.0, 0.0), (91.0, 1.0), (0.0, 1.0)), inclusion=True), "latitude within"),
        (FencePolygon(((0.0, 0.0), (math.nan, 1.0), (0.0, 1.0)), inclusion=True), "latitude within"),
        (FenceCircle(0.0, 0.0, 0.0, inclusion=True), "circle 0: radius: expected more than 0 m"),
        (FenceCircle(0.0, 181.0, 10.0, inclusion=True), "longitude within"),
    ],
)
def test_what_is_no_fence_is_refused_and_the_old_one_stays(area: FencePolygon | FenceCircle, reason: str) -> None:
    standing = fence(circle(0.0, 0.0, 100.0, inclusion=True))
    with pytest.raises(ValueError, match=reason):
        standing.load(
            (area,) if isinstance(area, FencePolygon) else (), (area,) if isinstance(area, FenceCircle) else ()
        )
    assert standing.breach_at(200.0, 0.0) is not None


def test_polygons_that_touch_themselves_only_at_neighbouring_corners_are_fences() -> None:
    for shape in (SQUARE, HORSESHOE, SQUARE[:3]):
        assert fence(FencePolygon(on_map(*shape), inclusion=True)).polygons
