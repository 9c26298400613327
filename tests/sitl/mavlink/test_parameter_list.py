"""Lists of parameters: complete, in order, in time, and stopped by stations that know them already."""

import struct
import zlib
from contextlib import closing

import pytest

from sitl.flight.parameter_table import DEFINITIONS
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.identity import IDENTITIES
from sitl.scenario import Scenario
from sitl.simulation import Simulation
from tests.sitl.mavlink.in_memory import Desk, MemoryLink
from tests.sitl.mavlink.parameter_station import LIST_TIME, NAMES, value_of, values

REAL32, INT32 = mav.MAV_PARAM_TYPE_REAL32, mav.MAV_PARAM_TYPE_INT32


@pytest.mark.parametrize("identity", ["px4", "ardupilot"])
def test_a_list_has_every_parameter_once_in_order_within_half_a_second(identity: str) -> None:
    with closing(Desk(identity=IDENTITIES[identity])) as desk:
        desk.send("PARAM_REQUEST_LIST")
        desk.wait(LIST_TIME)
        listed = values(desk)
        assert [message.param_id for message in listed] == NAMES
        assert [message.param_index for message in listed] == list(range(len(NAMES)))
        assert {message.param_count for message in listed} == {len(NAMES)}
        parameters = desk.simulation.flight.parameters
        for message, definition in zip(listed, DEFINITIONS, strict=True):
            assert message.param_type == (INT32 if definition.kind == "int" else REAL32)
            value = value_of(message) if identity == "px4" else message.param_value
            assert value == pytest.approx(parameters[definition.name], rel=1e-7)


def test_a_list_goes_to_who_asked_and_to_nobody_else(desk: Desk) -> None:
    other = desk.join(system=254)
    desk.send("PARAM_REQUEST_LIST", target_component=0)
    desk.wait(LIST_TIME)
    assert len(values(desk)) == len(NAMES)
    assert values(other) == []


def test_the_hash_comes_first_and_is_what_qgroundcontrol_computes_from_the_list(desk: Desk) -> None:
    desk.send("PARAM_REQUEST_LIST")
    desk.wait(LIST_TIME)
    first = desk.of("PARAM_VALUE")[0]
    assert (first.param_id, first.param_type, first.param_index) == ("_HASH_CHECK", mav.MAV_PARAM_TYPE_UINT32, 65535)
    crc = 0
    for message in sorted(values(desk), key=lambda message: message.param_id):
        data = message.param_id.encode() + struct.pack("<f", message.param_value)
        crc = ~zlib.crc32(data, ~crc & 0xFFFFFFFF) & 0xFFFFFFFF  # goes on from a state that is not inverted
    assert first.get_msgbuf()[10:14] == crc.to_bytes(4, "little")


def test_the_hash_is_another_one_when_a_parameter_is(desk: Desk) -> None:
    def read() -> bytes:
        desk.station.received.clear()
        desk.send("PARAM_REQUEST_READ", param_id="_HASH_CHECK", param_index=-1)
        (message,) = desk.of("PARAM_VALUE")
        return message.get_msgbuf()[10:14]

    before = read()
    desk.simulation.flight.parameters.set("NAV_ACC_RAD", 11.0)
    assert read() != before
    desk.simulation.flight.parameters.set("NAV_ACC_RAD", 10.0)
    assert read() == before


def test_a_station_that_knows_the_hash_stops_the_list_and_gets_no_answer(desk: Desk) -> None:
    desk.send("PARAM_REQUEST_LIST")
    (hash_check,) = (message for message in desk.of("PARAM_VALUE") if message.param_id == "_HASH_CHECK")
    begun = len(values(desk))
    assert begun < len(NAMES)
    desk.send("PARAM_SET", param_id="_HASH_CHECK", param_value=hash_check.param_value, param_type=5)
    desk.wait(LIST_TIME)
    assert len(values(desk)) == begun
    assert len(desk.of("PARAM_VALUE")) == begun + 1
    assert desk.of("PARAM_ERROR") == []
    desk.send("PARAM_REQUEST_LIST")  # and may want it after all
    desk.wait(LIST_TIME)
    assert len(values(desk)) == begun + len(NAMES)


def test_ardupilots_vehicle_has_no_hash() -> None:
    with closing(Desk(identity=IDENTITIES["ardupilot"])) as desk:
        desk.send("PARAM_REQUEST_LIST")
        desk.wait(LIST_TIME)
        assert desk.of("PARAM_VALUE")[0].param_id == NAMES[0]
        desk.send("PARAM_REQUEST_READ", param_id="_HASH_CHECK", param_index=-1)
        assert desk.of("PARAM_ERROR")[0].error == mav.MAV_PARAM_ERROR_DOES_NOT_EXIST


def test_who_asks_again_during_a_list_gets_it_from_its_beginning_without_the_hash(desk: Desk) -> None:
    desk.send("PARAM_REQUEST_LIST")
    first = len(values(desk))
    desk.send("PARAM_REQUEST_LIST")
    desk.wait(LIST_TIME)
    assert [message.param_id for message in values(desk)[first:]] == NAMES
    assert len(desk.of("PARAM_VALUE")) == first + len(NAMES) + 1


def test_a_flood_of_requests_makes_no_more_lists_than_one(desk: Desk) -> None:
    for _ in range(1000):
        desk.send("PARAM_REQUEST_LIST")
    desk.wait(LIST_TIME)
    assert len(desk.of("PARAM_VALUE")) < 2 * len(NAMES)


def test_a_list_waits_for_a_socket_that_is_full_and_gives_up_when_it_stays_so(desk: Desk) -> None:
    desk.station.full = True
    desk.send("PARAM_REQUEST_LIST")
    desk.wait(0.3)
    desk.station.full = False
    desk.wait(LIST_TIME)
    assert [message.param_id for message in values(desk)] == NAMES
    desk.station.full = True
    desk.send("PARAM_REQUEST_LIST")
    desk.wait(5.0)
    desk.station.full = False
    desk.station.received.clear()
    desk.wait(LIST_TIME)
    assert values(desk) == []
    desk.send("PARAM_REQUEST_LIST")
    desk.wait(LIST_TIME)
    assert [message.param_id for message in values(desk)] == NAMES


def test_ten_stations_on_two_links_get_their_lists_at_once() -> None:
    with closing(Desk(links=[MemoryLink("first"), MemoryLink("second")])) as desk:
        stations = [desk.join(system=100 + number, link=number % 2) for number in range(10)]
        for station in stations:
            station.send("PARAM_REQUEST_LIST")
        desk.wait(LIST_TIME)
        assert all([message.param_id for message in values(station)] == NAMES for station in stations)


def test_values_of_the_scenario_are_those_that_are_listed() -> None:
    with closing(Desk(Simulation(Scenario(parameters={"WV_EN": 1}), parameters={"NAV_ACC_RAD": 3.0}))) as desk:
        desk.send("PARAM_REQUEST_LIST")
        desk.wait(LIST_TIME)
        listed = {message.param_id: value_of(message) for message in values(desk)}
        assert listed["WV_EN"] == 1
        assert listed["NAV_ACC_RAD"] == 3.0
