"""MISSION_CURRENT and MISSION_ITEM_REACHED: everybody hears how far the mission is, at once."""

from typing import Any

from sitl.flight.mode import Mode
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.identity import ARDUPILOT
from tests.sitl.mavlink.in_memory import Desk
from tests.sitl.mavlink.plan_station import FENCE, fence, item, mission, sent

IN_MODE, SUSPENDED = 1, 2


def current(desk: Desk) -> Any:
    """MISSION_CURRENT as it is now."""
    desk.command(mav.MAV_CMD_REQUEST_MESSAGE, mav.MAVLINK_MSG_ID_MISSION_CURRENT)
    return desk.of("MISSION_CURRENT")[-1]


def test_without_a_mission_that_is_said(desk: Desk) -> None:
    told = current(desk)
    assert (told.seq, told.total, told.mission_state) == (0, 0xFFFF, mav.MISSION_STATE_NO_MISSION)
    assert (told.mission_id, told.fence_id, told.rally_points_id) == (0, 0, 0)


def test_a_whole_mission_is_told_item_by_item_to_everybody(desk: Desk) -> None:
    other = desk.join(254)
    sent(desk.station, mission(2))
    told = current(desk)
    assert (told.seq, told.total, told.mission_state, told.mission_mode) == (
        0, 4, mav.MISSION_STATE_NOT_STARTED, SUSPENDED,
    )  # fmt: skip
    flight = desk.simulation.flight
    flight.start_mission()
    flight.arm()
    desk.advance(0.1)
    told = other.of("MISSION_CURRENT")[-1]
    assert (told.seq, told.mission_state, told.mission_mode) == (0, mav.MISSION_STATE_ACTIVE, IN_MODE)
    desk.until(lambda: flight.mission.current == 2, timeout=300.0)
    flight.pause()
    desk.advance(0.1)
    told = other.of("MISSION_CURRENT")[-1]
    assert (told.seq, told.mission_state, told.mission_mode) == (2, mav.MISSION_STATE_PAUSED, SUSPENDED)
    flight.resume()
    desk.until(lambda: not flight.armed, timeout=300.0)
    for station in (desk, other):
        assert [m.seq for m in station.of("MISSION_ITEM_REACHED")] == [0, 1, 2, 3]
        told = station.of("MISSION_CURRENT")[-1]
        assert (told.seq, told.mission_state) == (3, mav.MISSION_STATE_COMPLETE)
    changes = [m.seq for m in other.of("MISSION_CURRENT")]
    assert changes == sorted(changes)


def test_a_change_is_told_at_once_and_only_then_beside_the_stream(desk: Desk) -> None:
    desk.command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, mav.MAVLINK_MSG_ID_MISSION_CURRENT, -1.0)
    sent(desk.station, mission())
    desk.received.clear()
    desk.advance(1.0)
    assert not desk.of("MISSION_CURRENT")
    sent(desk.station, fence(), FENCE)
    (told,) = desk.of("MISSION_CURRENT")
    assert told.fence_id == desk.of("MISSION_ACK")[-1].opaque_id
    desk.simulation.flight.jump_to(3)  # from a script
    desk.advance(0.02)
    assert [m.seq for m in desk.of("MISSION_CURRENT")] == [0, 3]


def test_an_item_without_autocontinue_pauses_the_mission(desk: Desk) -> None:
    sent(desk.station, [{**item(22), "autocontinue": 0}, item(16, 100.0)])
    flight = desk.simulation.flight
    flight.start_mission()
    flight.arm()
    desk.until(lambda: flight.mission.paused)
    assert flight.mode == Mode.MISSION
    told = current(desk)
    assert (told.seq, told.mission_state, told.mission_mode) == (1, mav.MISSION_STATE_PAUSED, IN_MODE)


def test_with_home_numbers_are_one_higher() -> None:
    desk = Desk(identity=ARDUPILOT)
    sent(desk.station, [item(16), item(22), item(16, 100.0)])
    flight = desk.simulation.flight
    flight.start_mission()
    flight.arm()
    desk.until(lambda: flight.mission.current == 1)
    assert [m.seq for m in desk.of("MISSION_ITEM_REACHED")] == [1]
    told = current(desk)
    assert (told.seq, told.total) == (2, 2)
    desk.close()


def test_after_a_restart_items_are_told_anew(desk: Desk) -> None:
    for _ in range(2):
        desk.received.clear()
        sent(desk.station, [item(22), item(16, 100.0)])
        flight = desk.simulation.flight
        flight.start_mission()
        flight.arm()
        desk.until(lambda: desk.simulation.flight.mission.current == 1)
        assert [m.seq for m in desk.of("MISSION_ITEM_REACHED")] == [0]
        desk.face.request_restart()
        desk.turn()
