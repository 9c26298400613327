"""Downloads, as https://mavlink.io/en/services/mission.html says, by several stations of all ages at once."""

import struct
from typing import Any

import pytest

from sitl.mavlink.dialect import tiltwing as mav
from tests.sitl.mavlink.in_memory import Desk
from tests.sitl.mavlink.plan_station import (
    FENCE,
    FIELDS,
    MISSION,
    RALLY,
    fence,
    fetched,
    item,
    mission,
    rally,
    same_items,
    sent,
)


def single(value: float) -> float:
    """As a single-precision number holds it."""
    return struct.unpack("<f", struct.pack("<f", value))[0]


def test_an_empty_plan_has_no_items(desk: Desk) -> None:
    for kind in (MISSION, FENCE, RALLY):
        desk.send("MISSION_REQUEST_LIST", mission_type=kind)
        count = desk.of("MISSION_COUNT")[-1]
        assert (count.count, count.mission_type, count.opaque_id) == (0, kind, 0)
        assert (count.target_system, count.target_component) == (255, 190)


def test_items_are_told_as_integers_or_floats_as_they_are_asked_for(desk: Desk) -> None:
    sent(desk.station, mission())
    desk.send("MISSION_REQUEST_INT", seq=1)
    integer = desk.of("MISSION_ITEM_INT")[-1]
    desk.send("MISSION_REQUEST", seq=1)
    floating = desk.of("MISSION_ITEM")[-1]
    assert (integer.frame, floating.frame) == (6, 3)
    assert floating.x == single(integer.x / 1e7)
    assert floating.y == single(integer.y / 1e7)
    for name in ("command", "param1", "param2", "z", "autocontinue", "seq", "target_system", "target_component"):
        assert getattr(floating, name) == getattr(integer, name)


def test_the_current_item_is_marked(desk: Desk) -> None:
    sent(desk.station, mission())
    desk.send("MISSION_SET_CURRENT", seq=2)
    for number in range(5):
        desk.send("MISSION_REQUEST_INT", seq=number)
    assert [m.current for m in desk.of("MISSION_ITEM_INT")] == [0, 0, 1, 0, 0]


def test_a_request_out_of_range_is_out_of_sequence(desk: Desk) -> None:
    for kind, items in ((MISSION, mission()), (FENCE, fence()), (RALLY, rally())):
        for count in (0, len(items)):
            for name in ("MISSION_REQUEST_INT", "MISSION_REQUEST"):
                desk.send(name, seq=count, mission_type=kind)
                ack = desk.of("MISSION_ACK")[-1]
                assert (ack.type, ack.mission_type) == (mav.MAV_MISSION_INVALID_SEQUENCE, kind)
            sent(desk.station, items, kind)


def test_stations_fetch_different_plans_at_once(desk: Desk) -> None:
    stations = [desk.join(system) for system in range(10, 20)]
    plans: dict[int, list[dict[str, Any]]] = {MISSION: mission(8), FENCE: fence(7), RALLY: rally(8)}
    for kind, items in plans.items():
        sent(desk.station, items, kind)
    got: list[list[dict[str, Any]]] = [[] for _ in stations]
    for number in range(8):
        for which, station in enumerate(stations):
            station.send("MISSION_REQUEST_INT", seq=number, mission_type=which % 3)
            message = station.of("MISSION_ITEM_INT")[-1]
            got[which].append({name: getattr(message, name) for name in FIELDS})
    for which, items in enumerate(got):
        assert same_items(items, plans[which % 3][:8])


def test_a_plan_that_changes_meanwhile_is_fetched_as_it_was(desk: Desk) -> None:
    other, old = desk.join(254), mission(6)
    sent(desk.station, old)
    desk.send("MISSION_REQUEST_LIST")
    items: list[dict[str, Any]] = []
    for number in range(8):
        if number == 4:
            sent(other, mission(1))
        desk.send("MISSION_REQUEST_INT", seq=number)
        message = desk.of("MISSION_ITEM_INT")[-1]
        items.append({name: getattr(message, name) for name in FIELDS})
    assert same_items(items, old)
    desk.send("MISSION_ACK", type=mav.MAV_MISSION_ACCEPTED)
    assert len(fetched(desk.station)) == 3


def test_a_download_that_was_left_is_forgotten(desk: Desk) -> None:
    sent(desk.station, mission(6))
    desk.send("MISSION_REQUEST_LIST")
    sent(desk.join(254), mission(1))
    desk.wait(11.0)
    desk.send("MISSION_REQUEST_INT", seq=7)
    assert desk.of("MISSION_ACK")[-1].type == mav.MAV_MISSION_INVALID_SEQUENCE


@pytest.mark.parametrize(("first", "last"), [(0, -1), (10, 45), (7, 7)])
def test_part_of_a_plan_is_sent_at_a_word(desk: Desk, first: int, last: int) -> None:
    sent(desk.station, mission(48))
    desk.send("MISSION_REQUEST_PARTIAL_LIST", start_index=first, end_index=last)
    desk.wait(0.1)
    assert [m.seq for m in desk.of("MISSION_ITEM_INT")] == list(range(first, 50 if last == -1 else last + 1))


@pytest.mark.parametrize(("first", "last"), [(0, 5), (-1, 3), (3, 2), (5, -1)])
def test_a_part_that_is_not_there_is_out_of_sequence(desk: Desk, first: int, last: int) -> None:
    sent(desk.station, mission())
    desk.send("MISSION_REQUEST_PARTIAL_LIST", start_index=first, end_index=last)
    assert desk.of("MISSION_ACK")[-1].type == mav.MAV_MISSION_INVALID_SEQUENCE
    assert not desk.of("MISSION_ITEM_INT")


def test_downloads_do_not_pile_up(desk: Desk) -> None:
    sent(desk.station, [item(16, 100.0)])
    for system in range(1, 201):
        desk.join(system).send("MISSION_REQUEST_LIST")
    desk.send("MISSION_REQUEST_INT", seq=0)
    assert desk.of("MISSION_ITEM_INT")
    assert desk.face.internal_errors == 0
