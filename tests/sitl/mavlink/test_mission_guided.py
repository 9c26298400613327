"""Guided items: places to fly to at once, sent as items of a mission."""

from sitl.flight.mode import Mode
from sitl.mavlink.dialect import tiltwing as mav
from sitl.simulation import Simulation
from tests.sitl.mavlink.in_memory import Desk
from tests.sitl.mavlink.plan_station import (
    last,
    texts,
)

ACCEPTED = mav.MAV_MISSION_ACCEPTED
WAYPOINT = mav.MAV_CMD_NAV_WAYPOINT


def flying() -> Desk:
    return Desk(Simulation(start="trim:0"))


def test_a_guided_item_is_flown_to_at_once() -> None:
    desk = flying()
    place = desk.simulation.flight.home.geodetic
    desk.send(
        "MISSION_ITEM", current=2, frame=3, command=WAYPOINT, x=place[0] + 1e-4, y=place[1], z=60.0, autocontinue=1
    )
    assert last(desk, "MISSION_ACK").type == ACCEPTED
    desk.until(lambda: desk.simulation.flight.view.north > 10.0)
    assert desk.simulation.flight.mode == Mode.HOLD
    desk.send("MISSION_ITEM_INT", current=3, frame=6, command=WAYPOINT, z=70.0)
    assert last(desk, "MISSION_ACK").type == ACCEPTED
    desk.until(lambda: desk.simulation.flight.height > 69.0)
    desk.close()


def test_a_guided_item_that_cannot_be_flown_to_is_refused(desk: Desk) -> None:
    desk.send("MISSION_ITEM", current=2, frame=3, command=WAYPOINT, x=47.4, y=8.5, z=20.0)
    assert last(desk, "MISSION_ACK").type == mav.MAV_MISSION_ERROR
    assert "Guided item refused: cannot go anywhere: on the ground" in texts(desk)
    desk.send("MISSION_ITEM", current=2, frame=3, command=21)
    assert last(desk, "MISSION_ACK").type == mav.MAV_MISSION_UNSUPPORTED
    desk.send("MISSION_ITEM", current=2, frame=1, command=WAYPOINT)
    assert last(desk, "MISSION_ACK").type == mav.MAV_MISSION_UNSUPPORTED_FRAME
