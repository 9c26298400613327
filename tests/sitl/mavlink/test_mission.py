"""Uploads and clearing, as https://mavlink.io/en/services/mission.html says."""

import math
from typing import Any

import pytest

from sitl.flight.mission_items import Command
from sitl.flight.mode import Mode
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.mission import LIMITS
from sitl.simulation import Simulation
from tests.sitl.mavlink.in_memory import Desk
from tests.sitl.mavlink.plan_station import (
    FENCE,
    MISSION,
    RALLY,
    asked,
    begin,
    fence,
    fetched,
    give,
    item,
    last,
    mission,
    rally,
    same_items,
    sent,
    texts,
)

ACCEPTED, DENIED, CANCELLED = (
    mav.MAV_MISSION_ACCEPTED, mav.MAV_MISSION_DENIED, mav.MAV_MISSION_OPERATION_CANCELLED,
)  # fmt: skip
PLANS = ((MISSION, mission()), (FENCE, fence()), (RALLY, rally()))
WAYPOINT = mav.MAV_CMD_NAV_WAYPOINT


# -- upload ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("kind", "items"), PLANS)
def test_a_plan_is_asked_for_in_order_and_taken_when_it_is_whole(
    desk: Desk, kind: int, items: list[dict[str, Any]]
) -> None:
    begin(desk, len(items), kind)
    for number, fields in enumerate(items):
        assert asked(desk)[-1] == ("MISSION_REQUEST_INT", number)
        assert not desk.of("MISSION_ACK")
        give(desk, number, fields, kind)
    (ack,) = desk.of("MISSION_ACK")
    assert (ack.type, ack.mission_type) == (ACCEPTED, kind)
    assert (ack.target_system, ack.target_component) == (255, 190)
    assert ack.opaque_id != 0
    assert same_items(fetched(desk.station, kind), items)


def test_the_flight_gets_what_was_sent(desk: Desk) -> None:
    for kind, items in PLANS:
        assert sent(desk.station, items, kind).type == ACCEPTED
    flight = desk.simulation.flight
    assert [one.command for one in flight.mission.items] == [84, 16, 16, 16, 85]
    assert flight.mission.items[1].x == pytest.approx(47.3977418 + 200.0 * 90e-7)
    assert len(flight.fence.polygons[0].points) == 4
    assert flight.fence.circles[0].radius == 50.0
    assert len(flight.rally.points) == 2


def test_items_may_come_as_floats_and_in_turns(desk: Desk) -> None:
    begin(desk, 2)
    floats = {**item(22), "frame": 3, "x": 47.398, "y": 8.546}
    desk.send("MISSION_ITEM", seq=0, **floats)
    give(desk, 1, item(WAYPOINT, 100.0))
    assert last(desk, "MISSION_ACK").type == ACCEPTED
    assert desk.simulation.flight.mission.items[0].x == pytest.approx(47.398)


def test_on_silence_an_item_is_asked_for_again_both_ways_and_then_given_up(desk: Desk) -> None:
    assert sent(desk.station, mission()).type == ACCEPTED
    desk.received.clear()
    begin(desk, 2)
    assert asked(desk) == [("MISSION_REQUEST_INT", 0)]
    desk.wait(0.24)
    assert len(asked(desk)) == 1
    desk.wait(0.02)
    assert asked(desk) == [("MISSION_REQUEST_INT", 0), ("MISSION_REQUEST", 0)]
    desk.wait(10.0)
    assert asked(desk) == [("MISSION_REQUEST_INT", 0), ("MISSION_REQUEST", 0)] * 5 + [("MISSION_REQUEST_INT", 0)]
    (ack,) = desk.of("MISSION_ACK")
    assert ack.type == CANCELLED
    assert "Mission upload given up" in texts(desk)
    assert len(fetched(desk.station)) == 5, "the old mission stays"


def test_a_station_that_knows_floats_only_is_asked_in_floats_once_that_is_clear(desk: Desk) -> None:
    begin(desk, 5)
    floats = [{**one, "frame": 3, "x": one["x"] / 1e7, "y": one["y"] / 1e7} for one in mission()]
    done, began = 0, desk.wall
    while not desk.of("MISSION_ACK"):
        desk.wait(0.05)
        new, done = asked(desk)[done:], len(asked(desk))
        for name, number in new:
            if name == "MISSION_REQUEST":
                desk.send("MISSION_ITEM", seq=number, **floats[number])
    assert last(desk, "MISSION_ACK").type == ACCEPTED
    assert desk.wall - began < 1.0, "silence is waited for once"


def test_a_station_that_refuses_float_requests_is_not_asked_that_way_again(desk: Desk) -> None:
    begin(desk, 5)
    desk.wait(0.26)
    assert asked(desk)[-1] == ("MISSION_REQUEST", 0)
    desk.send("MISSION_ACK", type=mav.MAV_MISSION_UNSUPPORTED)
    assert asked(desk)[-1] == ("MISSION_REQUEST_INT", 0)
    for number, fields in enumerate(mission()):
        desk.wait(0.6)
        desk.send("MISSION_ACK", type=mav.MAV_MISSION_UNSUPPORTED)  # late, of the same request
        assert asked(desk)[-1] == ("MISSION_REQUEST_INT", number)
        give(desk, number, fields)
    assert last(desk, "MISSION_ACK").type == ACCEPTED
    assert [name for name, _ in asked(desk)].count("MISSION_REQUEST") == 1


@pytest.mark.parametrize("answers", ["MISSION_REQUEST_INT", "MISSION_REQUEST"])
def test_over_a_slow_link_one_kind_of_request_is_settled_on(desk: Desk, answers: str) -> None:
    """A station that answers one kind only, 300 ms later: each item needs little more than that."""
    items, due, done, began = mission(20), list[tuple[float, int]](), 0, desk.wall
    begin(desk, len(items))
    while not desk.of("MISSION_ACK"):
        desk.wait(0.01)
        new, done = asked(desk)[done:], len(asked(desk))
        due += [(desk.wall + 0.3, number) for name, number in new if name == answers]
        while due and due[0][0] <= desk.wall:
            give(desk, due.pop(0)[1], items[asked(desk)[-1][1]])
    assert last(desk, "MISSION_ACK").type == ACCEPTED
    assert desk.wall - began < 0.35 * len(items) + 2.0


def test_an_item_out_of_order_is_dropped_and_the_expected_one_asked_for_again(desk: Desk) -> None:
    items = mission()
    begin(desk, len(items))
    give(desk, 2, items[2])
    assert asked(desk) == [("MISSION_REQUEST_INT", 0)] * 2
    give(desk, 0, items[0])
    give(desk, 0, items[0])
    assert asked(desk)[-2:] == [("MISSION_REQUEST_INT", 1)] * 2
    for number in range(1, 5):
        give(desk, number, items[number])
    assert same_items(fetched(desk.station), items)


def test_copies_of_items_do_not_multiply_the_requests(desk: Desk) -> None:
    items = mission(30)
    begin(desk, len(items))
    for number in range(len(items)):
        for _ in range(5):
            give(desk, number, items[number])
    assert len(asked(desk)) <= 2 * len(items)


def test_the_last_item_sent_again_is_acknowledged_again(desk: Desk) -> None:
    items = mission()
    sent(desk.station, items)
    give(desk, len(items) - 1, items[-1])
    give(desk, 2, items[2])  # an old copy
    first, second = desk.of("MISSION_ACK")
    assert (first.type, first.opaque_id) == (second.type, second.opaque_id)


def test_too_many_items_are_refused_at_once(desk: Desk) -> None:
    for kind, limit in LIMITS.items():
        begin(desk, limit + 1, kind)
        ack = last(desk, "MISSION_ACK")
        assert (ack.type, ack.mission_type) == (mav.MAV_MISSION_NO_SPACE, kind)
    assert not asked(desk)
    begin(desk, LIMITS[MISSION])
    assert asked(desk)


def test_no_items_clear_a_plan(desk: Desk) -> None:
    for kind, items in PLANS:
        sent(desk.station, items, kind)
        begin(desk, 0, kind)
        ack = last(desk, "MISSION_ACK")
        assert (ack.type, ack.mission_type, ack.opaque_id) == (ACCEPTED, kind, 0)
        assert fetched(desk.station, kind) == []


def test_an_unknown_type_of_plan_is_unsupported(desk: Desk) -> None:
    for name in ("MISSION_COUNT", "MISSION_REQUEST_LIST", "MISSION_REQUEST_INT", "MISSION_CLEAR_ALL"):
        desk.send(name, mission_type=7)
        ack = last(desk, "MISSION_ACK")
        assert (ack.type, ack.mission_type) == (mav.MAV_MISSION_UNSUPPORTED, 7)


@pytest.mark.parametrize(
    ("kind", "wrong", "result"),
    [
        (MISSION, item(31000), "UNSUPPORTED"),
        (MISSION, item(WAYPOINT, 100.0, frame=1), "UNSUPPORTED_FRAME"),
        (MISSION, item(WAYPOINT, 100.0, param2=math.inf), "INVALID_PARAM2"),
        (FENCE, item(5002, param1=4), "INVALID_PARAM1"),
        (FENCE, item(WAYPOINT), "UNSUPPORTED"),
        (RALLY, item(5100, frame=2), "UNSUPPORTED_FRAME"),
        (RALLY, item(5100, x=910000000), "INVALID_PARAM5_X"),
    ],
)
def test_a_wrong_item_ends_the_upload_with_what_is_wrong(
    desk: Desk, kind: int, wrong: dict[str, Any], result: str
) -> None:
    old = dict(PLANS)[kind]
    sent(desk.station, old, kind)
    ack = sent(desk.station, [*old, wrong], kind)
    assert ack.type == getattr(mav, f"MAV_MISSION_{result}")
    assert f"item {len(old)}: " in texts(desk)
    assert same_items(fetched(desk.station, kind), old)


@pytest.mark.parametrize(
    ("wrong", "result"),
    [
        (item(WAYPOINT, 100.0, param1=-1.0), "INVALID_PARAM1"),
        (item(WAYPOINT, 100.0, param2=-1.0), "INVALID_PARAM2"),
        (item(31, 100.0, param2=1e5), "INVALID_PARAM2"),
        (item(17, 100.0, param3=1e5), "INVALID_PARAM3"),
        (item(19, 100.0, param1=5.0, param4=7.0), "INVALID_PARAM4"),
        (item(WAYPOINT, x=900000001), "INVALID_PARAM5_X"),
        (item(WAYPOINT, y=1800000001), "INVALID_PARAM6_Y"),
        (item(WAYPOINT, x=0x7FFFFFFF), "INVALID_PARAM5_X"),
        (item(WAYPOINT, 100.0, z=-1.0), "INVALID_PARAM7"),
        (item(177, frame=2, param1=99), "INVALID_PARAM1"),
        (item(179, frame=1, param1=0), "UNSUPPORTED_FRAME"),
        (item(22, 100.0), "INVALID"),  # a second take-off
    ],
)
def test_a_mission_that_cannot_be_flown_is_refused_at_its_end(desk: Desk, wrong: dict[str, Any], result: str) -> None:
    old, items = mission(), mission()
    sent(desk.station, old)
    items[3] = wrong
    ack = sent(desk.station, items)
    assert ack.type == getattr(mav, f"MAV_MISSION_{result}")
    assert "Mission refused: item 3: " in texts(desk)
    assert same_items(fetched(desk.station), old)


def test_all_is_told_that_is_wrong_but_no_more_than_a_handful(desk: Desk) -> None:
    items = [{**one, "z": -5.0} for one in mission(10)]
    assert sent(desk.station, items).type == mav.MAV_MISSION_INVALID_PARAM7
    told = texts(desk)
    assert [f"item {number}: altitude" in told for number in range(12)] == [True] * 5 + [False] * 7
    assert "Mission refused: 7 more problems" in told


def test_a_mission_wrong_as_a_whole_is_an_error(desk: Desk) -> None:
    assert sent(desk.station, [item(178, frame=2, param1=1.0, param2=5.0)]).type == mav.MAV_MISSION_ERROR
    assert "Mission refused: nothing to fly" in texts(desk)


def test_a_second_station_is_denied_meanwhile_and_the_first_one_unharmed(desk: Desk) -> None:
    other, items = desk.join(254), mission()
    begin(desk, len(items))
    give(desk, 0, items[0])
    for message in ("MISSION_COUNT", "MISSION_ITEM_INT", "MISSION_WRITE_PARTIAL_LIST", "MISSION_CLEAR_ALL"):
        other.send(message, **({"count": 1} if message == "MISSION_COUNT" else {}))
        assert last(other, "MISSION_ACK").type == DENIED
    other.send("MISSION_CLEAR_ALL", mission_type=mav.MAV_MISSION_TYPE_ALL)
    assert (last(other, "MISSION_ACK").type, last(other, "MISSION_ACK").mission_type) == (DENIED, 255)
    other.send("MISSION_ACK", type=CANCELLED)
    assert sent(other, rally(), RALLY).type == ACCEPTED, "of another kind"
    for number in range(1, len(items)):
        give(desk, number, items[number])
    assert last(desk, "MISSION_ACK").type == ACCEPTED
    assert sent(other, mission(4)).type == ACCEPTED


def test_stations_of_the_same_ids_are_told_apart(desk: Desk) -> None:
    twin = desk.join()
    begin(desk, 5)
    begin(twin, 5)
    assert last(twin, "MISSION_ACK").type == DENIED


def test_the_same_station_may_start_anew(desk: Desk) -> None:
    begin(desk, 7)
    give(desk, 0, mission()[0])
    assert sent(desk.station, mission()).type == ACCEPTED
    desk.wait(5.0)
    assert len(desk.of("MISSION_ACK")) == 1
    assert len(fetched(desk.station)) == 5


def test_a_station_may_cancel_and_both_are_idle_then(desk: Desk) -> None:
    sent(desk.station, mission())
    begin(desk, 3)
    give(desk, 0, mission()[0])
    desk.received.clear()
    desk.send("MISSION_ACK", type=CANCELLED)
    assert last(desk, "MISSION_ACK").type == CANCELLED
    desk.wait(5.0)
    assert not asked(desk)
    assert len(desk.of("MISSION_ACK")) == 1
    assert len(fetched(desk.station)) == 5
    assert sent(desk.station, mission(4)).type == ACCEPTED


def test_an_item_nobody_asked_for_is_out_of_sequence(desk: Desk) -> None:
    give(desk, 0, mission()[0])
    assert last(desk, "MISSION_ACK").type == mav.MAV_MISSION_INVALID_SEQUENCE


def test_a_fence_s_return_point_is_kept_and_said_not_to_be_flown_to(desk: Desk) -> None:
    items = [item(5000, 50.0, 0.0, frame=0), *fence()]
    assert sent(desk.station, items, FENCE).type == ACCEPTED
    assert "return point is kept but not flown to" in texts(desk)
    assert same_items(fetched(desk.station, FENCE), items)


def test_rally_points_may_bring_their_approaches(desk: Desk) -> None:
    items = [rally()[0], item(31, 300.0, 0.0, 60.0, param2=80.0), rally()[1]]
    assert sent(desk.station, items, RALLY).type == ACCEPTED
    assert len(desk.simulation.flight.rally.points) == 2
    assert same_items(fetched(desk.station, RALLY), items)


# -- parts of plans ----------------------------------------------------------------------------------------------------


def test_part_of_a_plan_can_be_replaced_and_added_to(desk: Desk) -> None:
    items = mission()
    sent(desk.station, items)
    items[2:4] = [item(WAYPOINT, 300.0, 50.0), item(WAYPOINT, 320.0, 90.0)]
    desk.send("MISSION_WRITE_PARTIAL_LIST", start_index=2, end_index=3)
    for number in (2, 3):
        assert asked(desk)[-1] == ("MISSION_REQUEST_INT", number)
        give(desk, number, items[number])
    assert last(desk, "MISSION_ACK").type == ACCEPTED
    assert same_items(fetched(desk.station), items)
    desk.send("MISSION_WRITE_PARTIAL_LIST", start_index=5, end_index=5)
    give(desk, 5, item(203))
    assert same_items(fetched(desk.station), [*items, item(203)])


@pytest.mark.parametrize(("first", "last_one"), [(6, 6), (-1, 2), (3, 2), (0, -1)])
def test_a_part_that_does_not_fit_is_refused(desk: Desk, first: int, last_one: int) -> None:
    sent(desk.station, mission())
    desk.send("MISSION_WRITE_PARTIAL_LIST", start_index=first, end_index=last_one)
    assert last(desk, "MISSION_ACK").type == mav.MAV_MISSION_INVALID_SEQUENCE
    desk.send("MISSION_WRITE_PARTIAL_LIST", start_index=0, end_index=LIMITS[MISSION])
    assert last(desk, "MISSION_ACK").type == mav.MAV_MISSION_NO_SPACE


# -- clearing ----------------------------------------------------------------------------------------------------------


def test_plans_are_cleared_one_by_one_or_all_at_once(desk: Desk) -> None:
    for kind, items in PLANS:
        sent(desk.station, items, kind)
    desk.send("MISSION_CLEAR_ALL", mission_type=FENCE)
    assert (last(desk, "MISSION_ACK").type, last(desk, "MISSION_ACK").mission_type) == (ACCEPTED, FENCE)
    assert [len(fetched(desk.station, kind)) for kind, _ in PLANS] == [5, 0, 2]
    desk.send("MISSION_CLEAR_ALL", mission_type=255)
    assert (last(desk, "MISSION_ACK").type, last(desk, "MISSION_ACK").mission_type) == (ACCEPTED, 255)
    assert [len(fetched(desk.station, kind)) for kind, _ in PLANS] == [0, 0, 0]
    current = last(desk, "MISSION_CURRENT")
    assert (current.mission_id, current.fence_id, current.rally_points_id) == (0, 0, 0)


def test_without_an_autopilot_plans_are_refused() -> None:
    desk = Desk(Simulation(autopilot=False))
    begin(desk, 3)
    assert last(desk, "MISSION_ACK").type == mav.MAV_MISSION_ERROR
    assert fetched(desk.station) == []
    for name in ("MISSION_CLEAR_ALL", "MISSION_SET_CURRENT", "MISSION_REQUEST_INT", "MISSION_ITEM"):
        desk.send(name, **({"current": 2} if name == "MISSION_ITEM" else {}))
    assert desk.command(mav.MAV_CMD_DO_SET_MISSION_CURRENT, 0.0).result != mav.MAV_RESULT_ACCEPTED
    assert desk.face.internal_errors == 0
    desk.close()


def test_a_mission_can_change_in_flight_and_goes_on_where_it_is(desk: Desk) -> None:
    sent(desk.station, mission())
    flight = desk.simulation.flight
    flight.start_mission()
    flight.arm()
    desk.until(lambda: flight.mission.current == 1, timeout=120.0)
    assert sent(desk.station, mission(4)).type == ACCEPTED
    assert (flight.mission.current, flight.mode) == (1, Mode.MISSION)
    desk.send("MISSION_CLEAR_ALL")
    assert flight.mode == Mode.HOLD
    assert Command.WAYPOINT not in [one.command for one in flight.mission.items]
