"""Plan items between the wire and the flight: nothing is lost on the way there and back."""

import math
import struct
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl.flight.geofence import FenceCircle, FencePolygon
from sitl.flight.mission_items import Command, Frame, MissionItem
from sitl.flight.rally import RallyPoint
from sitl.mavlink.codec import codec
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.mission_conversion import (
    FENCE,
    MISSION,
    RALLY,
    InvalidPlanError,
    StoredItem,
    fence_areas,
    fence_items,
    item_fields,
    item_int_fields,
    mission_item,
    mission_items,
    rally_items,
    rally_points,
    result_of,
    stored,
    unsupported_item,
)

NAN = math.nan
RELATIVE, RELATIVE_INT = mav.MAV_FRAME_GLOBAL_RELATIVE_ALT, mav.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT
single = st.floats(width=32, allow_nan=True, allow_infinity=True)
SQUARE = ((47.0, 8.0), (47.0, 8.1), (47.1, 8.1), (47.1, 8.0))


def same(a: Any, b: Any) -> bool:
    return a == b or (a != a and b != b)  # noqa: PLR0124


def message(**fields: Any) -> Any:
    """A message's fields; those that are not given are zero."""
    names = ("command", "frame", "param1", "param2", "param3", "param4", "x", "y", "z", "autocontinue")
    return SimpleNamespace(**{**dict.fromkeys(names, 0), **fields})


@given(
    command=st.integers(0, 0xFFFF),
    frame=st.integers(0, 0xFF),
    params=st.tuples(single, single, single, single),
    place=st.tuples(st.integers(-(2**31), 2**31 - 1), st.integers(-(2**31), 2**31 - 1), single),
    autocontinue=st.integers(0, 0xFF),
)
def test_an_integer_item_comes_back_as_it_was_sent(
    command: int,
    frame: int,
    params: tuple[float, float, float, float],
    place: tuple[int, int, float],
    autocontinue: int,
) -> None:
    names = ("param1", "param2", "param3", "param4", "x", "y", "z")
    sent = {
        "command": command, "frame": frame, "autocontinue": autocontinue,
        **dict(zip(names, (*params, *place), strict=True)),
    }  # fmt: skip
    back = item_int_fields(stored(message(**sent), is_int=True))
    assert all(same(back[name], value) for name, value in sent.items())


@given(single, single)
def test_a_float_item_comes_back_as_it_was_sent(x: float, y: float) -> None:
    item = stored(message(command=16, frame=RELATIVE, x=x, y=y), is_int=False)
    back = item_fields(item)
    assert same(back["x"], x)
    assert same(back["y"], y)
    codec("MISSION_ITEM_INT").payload_of(**item_int_fields(item))  # whatever it holds


@given(st.integers(-1_800_000_000, 1_800_000_000))
def test_an_integer_item_is_told_in_floats_as_near_as_they_get(number: int) -> None:
    item = stored(message(command=16, frame=RELATIVE_INT, x=number), is_int=True)
    fields = item_fields(item)
    nearest = struct.unpack("<f", struct.pack("<f", number / 1e7))[0]
    assert struct.unpack("<f", struct.pack("<f", fields["x"]))[0] == nearest
    assert fields["frame"] == RELATIVE, "degrees are told in a frame of degrees"


def test_places_are_degrees_and_other_parameters_plain_numbers() -> None:
    place = stored(message(command=16, frame=RELATIVE, x=473977420, y=85455940), is_int=True)
    assert (place.x, place.y) == (47.397742, 8.545594)
    for command, frame in ((16, mav.MAV_FRAME_MISSION), (mav.MAV_CMD_DO_DIGICAM_CONTROL, RELATIVE)):
        plain = stored(message(command=command, frame=frame, x=3, y=-4), is_int=True)
        assert (plain.x, plain.y) == (3.0, -4.0)
        assert item_int_fields(plain)["x"] == 3
    local = stored(message(command=16, frame=mav.MAV_FRAME_LOCAL_NED, x=50000), is_int=True)
    assert local.x == 5.0, "metres x 1e4, as the guide says of local frames"


@pytest.mark.parametrize("unset", [0x7FFFFFFF, -0x80000000])
def test_a_place_that_is_unset_means_wherever_the_vehicle_is(unset: int) -> None:
    item = stored(message(command=16, frame=RELATIVE_INT, x=unset, y=unset), is_int=True)
    assert mission_item(item).here
    assert math.isnan(item_fields(item)["x"])
    assert item_int_fields(item)["x"] == unset
    floats = stored(message(command=16, frame=RELATIVE, x=NAN, y=NAN), is_int=False)
    assert item_int_fields(floats)["x"] == 0x7FFFFFFF


def test_items_of_the_flight_survive_the_wire() -> None:
    items = (
        MissionItem(Command.VTOL_TAKEOFF, Frame.GLOBAL_RELATIVE_ALT, 0.0, 0.0, 0.0, NAN, 47.3977420, 8.5455940, 30.0),
        MissionItem(Command.DO_CHANGE_SPEED, Frame.MISSION, 0.0, 20.0, -1.0, 0.0, autocontinue=False),
    )
    back = [mission_item(stored(message(**item_int_fields(item)), is_int=True)) for item in mission_items(items)]
    for one, other in zip(items, back, strict=True):
        for name in MissionItem.__slots__:
            assert same(getattr(one, name), getattr(other, name)), name


def test_autocontinue_is_obeyed_unless_it_has_no_meaning() -> None:
    item = StoredItem(16, autocontinue=0)
    assert not mission_item(item).autocontinue
    assert mission_item(item, always_continues=True).autocontinue


@pytest.mark.parametrize(
    ("kind", "item", "result"),
    [
        (MISSION, StoredItem(5000), "UNSUPPORTED"),
        (MISSION, StoredItem(16, mav.MAV_FRAME_LOCAL_NED), "UNSUPPORTED_FRAME"),
        (MISSION, StoredItem(16, 99), "UNSUPPORTED_FRAME"),
        (MISSION, StoredItem(16, param3=math.inf), "INVALID_PARAM3"),
        (FENCE, StoredItem(16), "UNSUPPORTED"),
        (FENCE, StoredItem(5001, mav.MAV_FRAME_MISSION), "UNSUPPORTED_FRAME"),
        (FENCE, StoredItem(5003, x=math.inf), "INVALID_PARAM5_X"),
        (RALLY, StoredItem(5001), "UNSUPPORTED"),
        (RALLY, StoredItem(5100, z=-math.inf), "INVALID_PARAM7"),
        (RALLY, StoredItem(5100, mav.MAV_FRAME_LOCAL_NED), "UNSUPPORTED_FRAME"),
    ],
)
def test_an_item_that_no_plan_could_hold_is_named_with_its_result(kind: int, item: StoredItem, result: str) -> None:
    problem = unsupported_item(kind, 3, item)
    assert problem is not None
    assert problem.index == 3
    assert result_of(problem) == getattr(mav, f"MAV_MISSION_{result}")


def test_fence_areas_survive_the_wire() -> None:
    polygons = (FencePolygon(SQUARE, inclusion=True), FencePolygon(SQUARE[:3], inclusion=False))
    circles = (FenceCircle(47.05, 8.05, 100.0, inclusion=True), FenceCircle(47.06, 8.05, 50.0, inclusion=False))
    items = fence_items(polygons, circles)
    assert [item.command for item in items] == [5001] * 4 + [5002] * 3 + [5003, 5004]
    assert fence_areas(items) == (polygons, circles)
    assert fence_areas((StoredItem(5000, x=47.0, y=8.0), *items)) == (polygons, circles), "a return point is no area"


def corners(command: int, count: float, points: int) -> list[StoredItem]:
    return [StoredItem(command, param1=count, x=x, y=y) for x, y in (SQUARE * 2)[:points]]


@pytest.mark.parametrize(
    ("items", "index", "result"),
    [
        (corners(5001, 4.0, 3), 0, "INVALID_PARAM1"),
        (corners(5001, 3.0, 3) + corners(5001, 4.0, 3), 3, "INVALID_PARAM1"),
        (corners(5001, 4.0, 2) + corners(5002, 4.0, 2), 0, "INVALID_PARAM1"),
        (corners(5001, 2.0, 2), 0, "INVALID_PARAM1"),
        (corners(5001, 3.5, 4), 0, "INVALID_PARAM1"),
        (corners(5001, NAN, 4), 0, "INVALID_PARAM1"),
        (corners(5001, 3e38, 4), 0, "INVALID_PARAM1"),
        ([StoredItem(5003, param1=0.0, x=47.0, y=8.0)], 0, "INVALID_PARAM1"),
        ([StoredItem(5003, param1=NAN, x=47.0, y=8.0)], 0, "INVALID_PARAM1"),
        ([*corners(5001, 3.0, 3), StoredItem(5004, param1=9.0, x=91.0, y=8.0)], 3, "INVALID_PARAM5_X"),
        ([StoredItem(5003, param1=9.0, x=47.0, y=-180.1)], 0, "INVALID_PARAM6_Y"),
        ([StoredItem(5000, x=NAN, y=8.0)], 0, "INVALID_PARAM5_X"),
    ],
)
def test_a_fence_that_makes_no_sense_is_refused_at_the_item(items: list[StoredItem], index: int, result: str) -> None:
    with pytest.raises(InvalidPlanError) as refused:
        fence_areas(items)
    problem = refused.value.problems[0]
    assert problem.index == index
    assert result_of(problem) == getattr(mav, f"MAV_MISSION_{result}")


def test_rally_points_survive_the_wire_and_approaches_are_no_points() -> None:
    points = (RallyPoint(47.0, 8.0, 30.0), RallyPoint(47.1, 8.1, 530.0, above_home=False))
    items = rally_items(points)
    assert rally_points(items) == points
    assert rally_points((items[0], StoredItem(31, x=47.0, y=8.0, z=50.0), items[1])) == points


@pytest.mark.parametrize(
    ("item", "result"),
    [
        (StoredItem(5100, x=90.5, y=8.0), "INVALID_PARAM5_X"),
        (StoredItem(5100, x=47.0, y=NAN), "INVALID_PARAM6_Y"),
        (StoredItem(5100, x=47.0, y=8.0, z=NAN), "INVALID_PARAM7"),
    ],
)
def test_a_rally_point_that_is_nowhere_is_refused(item: StoredItem, result: str) -> None:
    with pytest.raises(InvalidPlanError) as refused:
        rally_points((StoredItem(5100, x=47.0, y=8.0), item))
    assert refused.value.problems[0].index == 1
    assert result_of(refused.value.problems[0]) == getattr(mav, f"MAV_MISSION_{result}")
