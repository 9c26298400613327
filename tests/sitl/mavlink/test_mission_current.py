"""The current item of a mission, set by message and by command."""

import math

import pytest

from sitl.mavlink.dialect import tiltwing as mav
from tests.sitl.mavlink.in_memory import Desk
from tests.sitl.mavlink.plan_station import (
    jumping,
    last,
    mission,
    sent,
    texts,
)

ACCEPTED = mav.MAV_MISSION_ACCEPTED
WAYPOINT = mav.MAV_CMD_NAV_WAYPOINT


def test_the_current_item_can_be_set_and_everybody_hears_of_it(desk: Desk) -> None:
    other = desk.join(254)
    sent(desk.station, mission())
    for number in (2, 2):  # whether or not it changes
        other.received.clear()
        desk.send("MISSION_SET_CURRENT", seq=number)
        assert last(other, "MISSION_CURRENT").seq == 2
    assert desk.simulation.flight.mission.current == 2
    assert desk.command(mav.MAV_CMD_DO_SET_MISSION_CURRENT, 3.0).result == mav.MAV_RESULT_ACCEPTED
    assert last(other, "MISSION_CURRENT").seq == 3


def test_an_item_that_is_not_there_is_said_not_to_be_set(desk: Desk) -> None:
    desk.send("MISSION_SET_CURRENT", seq=0)
    assert "Mission item 0 not set: no mission" in texts(desk)
    sent(desk.station, mission())
    desk.send("MISSION_SET_CURRENT", seq=5)
    assert "Mission item 5 not set: expected one from 0 to 4" in texts(desk)
    assert desk.command(mav.MAV_CMD_DO_SET_MISSION_CURRENT, 5.0).result == mav.MAV_RESULT_FAILED
    for wrong in (math.nan, 1.5, -2.0, math.inf):
        assert desk.command(mav.MAV_CMD_DO_SET_MISSION_CURRENT, wrong).result == mav.MAV_RESULT_DENIED
    assert desk.simulation.flight.mission.current == 0


@pytest.mark.parametrize(("reset", "ways"), [(math.nan, 1), (1.0, 2)])
def test_jumps_count_on_unless_they_are_reset(desk: Desk, reset: float, ways: int) -> None:
    sent(desk.station, jumping())
    flight, reached = desk.simulation.flight, desk.simulation.items_reached
    flight.start_mission()
    flight.arm()
    desk.until(lambda: reached.count(3) == 1, timeout=120.0)
    desk.until(lambda: flight.mission.current == 1)
    assert desk.command(mav.MAV_CMD_DO_SET_MISSION_CURRENT, -1.0, reset).result == mav.MAV_RESULT_ACCEPTED
    assert flight.mission.current == 1
    before = reached.count(1)
    desk.until(lambda: flight.mission.finished, timeout=120.0)
    assert reached.count(1) - before == ways
