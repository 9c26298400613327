"""Routing between links and stations, as the MAVLink guide's rules have it."""

from typing import Any

import pytest

from sitl.mavlink.codec import codec
from sitl.mavlink.dialect import tiltwing as mav
from tests.sitl.mavlink.in_memory import Desk, MemoryLink

Stations = tuple[Desk, Any, Any, Any]


@pytest.fixture
def stations() -> Any:
    """A vehicle, and three systems: two on its first link, one on its second; all have been heard."""
    desk = Desk(links=[MemoryLink("near"), MemoryLink("far")])
    one, two, three = desk.station, desk.join(250, 190), desk.join(42, 191, link=1)
    for station in (one, two, three):
        station.send("HEARTBEAT", type=mav.MAV_TYPE_GCS, autopilot=mav.MAV_AUTOPILOT_INVALID)
    for station in (one, two, three):
        station.received.clear()
    yield desk, one, two, three
    desk.close()


def test_what_is_for_everybody_goes_to_all_others_and_not_back(stations: Stations) -> None:
    _, one, two, three = stations
    one.send("HEARTBEAT", type=mav.MAV_TYPE_GCS, autopilot=mav.MAV_AUTOPILOT_INVALID)
    assert [len(station.of("HEARTBEAT")) for station in (one, two, three)] == [0, 1, 1]
    assert two.of("HEARTBEAT")[0].get_srcSystem() == 255


def test_what_is_for_one_system_goes_only_where_it_was_heard(stations: Stations) -> None:
    desk, one, two, three = stations
    one.send("COMMAND_LONG", target_system=42, target_component=0, command=400)
    assert [len(station.of("COMMAND_LONG")) for station in (one, two, three)] == [0, 0, 1]
    assert one.of("COMMAND_ACK") == []
    assert not desk.simulation.flight.armed


@pytest.mark.parametrize("component", [0, 191, 5])
def test_a_component_must_have_been_heard_too(stations: Stations, component: int) -> None:
    _, one, _, three = stations
    one.send("COMMAND_LONG", target_system=42, target_component=component, command=400)
    assert len(three.of("COMMAND_LONG")) == (component != 5)


def test_what_is_for_us_alone_stays_here(stations: Stations) -> None:
    _, one, two, three = stations
    assert one.command(mav.MAV_CMD_RUN_PREARM_CHECKS).result == mav.MAV_RESULT_ACCEPTED
    assert two.of("COMMAND_LONG") == three.of("COMMAND_LONG") == []
    assert two.of("COMMAND_ACK") == three.of("COMMAND_ACK") == []


def test_a_component_of_our_own_system_is_somebody_else(stations: Stations) -> None:
    desk, one, _, _ = stations
    camera = desk.join(1, 100, link=1)
    camera.send("HEARTBEAT", type=mav.MAV_TYPE_CAMERA, autopilot=mav.MAV_AUTOPILOT_INVALID)
    one.send("COMMAND_LONG", target_system=1, target_component=100, command=mav.MAV_CMD_RUN_PREARM_CHECKS)
    assert len(camera.of("COMMAND_LONG")) == 1
    assert one.of("COMMAND_ACK") == []  # a winch or gimbal that is not there must not be answered for
    one.send("COMMAND_LONG", target_system=1, target_component=0, command=mav.MAV_CMD_RUN_PREARM_CHECKS)
    assert len(camera.of("COMMAND_LONG")) == 2
    assert len(one.of("COMMAND_ACK")) == 1


def test_keys_and_radio_reports_stay_on_their_link(stations: Stations) -> None:
    _, one, two, three = stations
    one.send("SETUP_SIGNING", target_system=42, target_component=0, secret_key=range(32))
    one.send("RADIO_STATUS", rssi=5)
    for name in ("SETUP_SIGNING", "RADIO_STATUS"):
        assert two.of(name) == three.of(name) == []


def test_messages_that_we_do_not_know_pass_through_unchanged(stations: Stations) -> None:
    _, one, _, three = stations
    ping = codec("PING")
    known = ping.frame(ping.payload_of(seq=1), 0, 255, 190)
    unknown = known[:7] + b"\xf0\xff\x12" + known[10:]
    bytes_seen: list[bytes] = []
    three.take = lambda data: not bytes_seen.append(data)
    one.send_bytes(unknown)
    assert bytes_seen == [unknown]


def test_a_high_latency_link_carries_only_what_is_meant_for_its_stations() -> None:
    desk = Desk(links=[MemoryLink("near"), MemoryLink("satellite", streams="highlatency")])
    far = desk.join(42, 191, link=1)
    desk.advance(2.0)
    desk.send("HEARTBEAT", type=mav.MAV_TYPE_GCS, autopilot=mav.MAV_AUTOPILOT_INVALID)
    desk.face.statustext(6, "to everybody")
    assert far.received == []
    assert far.command(mav.MAV_CMD_RUN_PREARM_CHECKS).result == mav.MAV_RESULT_ACCEPTED
    desk.send("COMMAND_LONG", target_system=42, target_component=191, command=400)
    assert len(far.of("COMMAND_LONG")) == 1
    desk.close()
