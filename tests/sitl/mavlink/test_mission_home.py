"""Missions that begin with home: always, as ArduPilot's do, or because a file does."""

import math
from typing import Any

import pytest

from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.identity import ARDUPILOT
from tests.sitl.mavlink.in_memory import Desk
from tests.sitl.mavlink.plan_station import (
    asked,
    fetched,
    give,
    item,
    jumping,
    last,
    mission,
    same_items,
    sent,
    texts,
)

ACCEPTED = mav.MAV_MISSION_ACCEPTED
WAYPOINT = mav.MAV_CMD_NAV_WAYPOINT


def test_a_mission_file_that_begins_with_home_is_taken_and_home_not_flown_to(desk: Desk) -> None:
    items = [item(WAYPOINT, frame=0, z=488.0), item(22), item(WAYPOINT, 60.0)]  # as MAVProxy sends it to everybody
    assert sent(desk.station, items).type == ACCEPTED
    assert same_items(fetched(desk.station), items)
    flight = desk.simulation.flight
    flight.start_mission()
    flight.arm()
    desk.until(lambda: flight.mission.finished, timeout=120.0)
    assert desk.simulation.items_reached == [0, 1, 2]
    assert flight.height > 25.0


@pytest.fixture
def ardupilot() -> Any:
    made = Desk(identity=ARDUPILOT)
    yield made
    made.close()


def test_with_home_the_first_item_is_taken_off_whatever_it_holds(ardupilot: Desk) -> None:
    home = item(31000, frame=99, param1=math.inf)
    items = jumping()
    items[3]["param1"] = 0
    assert sent(ardupilot.station, [home, *items]).type == mav.MAV_MISSION_INVALID_PARAM1, "home is nothing to jump to"
    items[3]["param1"] = 2
    assert sent(ardupilot.station, [home, *items]).type == ACCEPTED
    flight = ardupilot.simulation.flight
    assert [one.command for one in flight.mission.items] == [22, 16, 16, 177, 16]
    assert flight.mission.items[3].param1 == 1.0
    back = fetched(ardupilot.station)
    assert (back[0]["command"], back[0]["frame"]) == (WAYPOINT, mav.MAV_FRAME_GLOBAL)
    latitude, longitude, altitude = flight.home.geodetic
    assert back[0]["x"] == round(latitude * 1e7)
    assert back[0]["y"] == round(longitude * 1e7)
    assert back[0]["z"] == pytest.approx(altitude)
    assert same_items(back[1:], items)


def test_with_home_numbers_are_one_higher(ardupilot: Desk) -> None:
    items = [item(WAYPOINT), *mission()]
    sent(ardupilot.station, items)
    current = last(ardupilot, "MISSION_CURRENT")
    assert (current.seq, current.total) == (1, 5)
    ardupilot.send("MISSION_SET_CURRENT", seq=3)
    assert ardupilot.simulation.flight.mission.current == 2
    assert last(ardupilot, "MISSION_CURRENT").seq == 3
    ardupilot.send("MISSION_SET_CURRENT", seq=0)
    assert ardupilot.simulation.flight.mission.current == 0
    items[2]["z"] = -9.0
    assert sent(ardupilot.station, items).type == mav.MAV_MISSION_INVALID_PARAM7
    assert "item 2: " in texts(ardupilot)


def test_with_home_nothing_but_home_clears_the_mission_and_home_can_still_be_read(ardupilot: Desk) -> None:
    sent(ardupilot.station, [item(WAYPOINT), *mission()])
    assert sent(ardupilot.station, [item(WAYPOINT)]).type == ACCEPTED
    assert ardupilot.simulation.flight.mission.items == ()
    assert fetched(ardupilot.station) == []
    ardupilot.send("MISSION_REQUEST", seq=0)  # DroneKit asks for it although there are no items
    assert last(ardupilot, "MISSION_ITEM").x == pytest.approx(ardupilot.simulation.flight.home.geodetic[0], rel=1e-6)


def test_with_home_a_part_of_the_mission_is_numbered_the_same_way(ardupilot: Desk) -> None:
    items = [item(WAYPOINT), *mission()]
    sent(ardupilot.station, items)
    ardupilot.send("MISSION_WRITE_PARTIAL_LIST", start_index=2, end_index=2)
    assert asked(ardupilot)[-1] == ("MISSION_REQUEST_INT", 2)
    items[2] = item(WAYPOINT, 500.0)
    give(ardupilot, 2, items[2])
    assert same_items(fetched(ardupilot.station)[1:], items[1:])


def test_clients_of_ardupilot_leave_autocontinue_at_zero_and_mean_to_fly_on(ardupilot: Desk) -> None:
    items = [{**one, "autocontinue": 0} for one in (item(WAYPOINT), *mission())]
    sent(ardupilot.station, items)
    assert all(one.autocontinue for one in ardupilot.simulation.flight.mission.items)
    assert same_items(fetched(ardupilot.station)[1:], items[1:])
