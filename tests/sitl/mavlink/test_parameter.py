"""The parameter protocol, one parameter at a time; and that no link and no message disturbs flight or parameters."""

import math
import random
import struct
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.flight.parameters import Parameters
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.identity import IDENTITIES
from sitl.mavlink.parameter import ParameterService
from sitl.mavlink.router import QUIET
from sitl.simulation import Simulation
from tests.sitl.mavlink.in_memory import Desk, MemoryLink
from tests.sitl.mavlink.parameter_station import LIST_TIME, NAMES, bits, taken, texts, value_of, values

REAL32, INT32 = mav.MAV_PARAM_TYPE_REAL32, mav.MAV_PARAM_TYPE_INT32
Make = Callable[..., Desk]


@pytest.fixture
def make() -> Iterator[Make]:
    """Vehicles to order."""
    desks: list[Desk] = []

    def made(simulation: Simulation | None = None, **options: Any) -> Desk:
        desks.append(Desk(simulation, **options))
        return desks[-1]

    yield made
    for desk in desks:
        desk.close()


@pytest.mark.parametrize("asked", [{"param_id": "COM_ACT_FAIL_ACT", "param_index": -1}, {"param_index": 7}])
def test_one_is_read_by_name_or_index_names_of_sixteen_characters_without_a_zero(
    desk: Desk, asked: dict[str, Any]
) -> None:
    desk.send("PARAM_REQUEST_READ", **asked)
    (message,) = desk.of("PARAM_VALUE")
    expected = asked.get("param_id") or NAMES[7]
    assert message.param_id == expected
    assert message.param_index == NAMES.index(expected)
    assert value_of(message) == Parameters()[expected]
    assert taken(desk.station)[-1] is message


def test_a_name_beside_an_index_does_not_count(desk: Desk) -> None:
    desk.send("PARAM_REQUEST_READ", param_id="WV_EN", param_index=3)
    assert [message.param_id for message in desk.of("PARAM_VALUE")] == [NAMES[3]]


@pytest.mark.parametrize(
    ("asked", "name", "index"),
    [
        ({"param_id": "NOPE", "param_index": -1}, "NOPE", -1),
        ({"param_id": "SIXTEEN_LETTERS_", "param_index": -1}, "SIXTEEN_LETTERS_", -1),
        ({"param_id": b"", "param_index": -1}, "", -1),
        ({"param_id": "wv_en", "param_index": -32768}, "wv_en", -1),
        ({"param_id": "WV_EN", "param_index": len(NAMES)}, "", len(NAMES)),
        ({"param_index": 32767}, "", 32767),
    ],
)
def test_reading_what_there_is_not_is_an_error_and_nothing_else(
    desk: Desk, asked: dict[str, Any], name: str, index: int
) -> None:
    other = desk.join(system=254)
    taken(desk.station)
    desk.send("PARAM_REQUEST_READ", **asked)
    (error,) = taken(desk.station)
    assert error.get_type() == "PARAM_ERROR"
    assert (error.param_id, error.param_index, error.error) == (name, index, mav.MAV_PARAM_ERROR_DOES_NOT_EXIST)
    assert (error.target_system, error.target_component) == (255, 190)
    assert taken(other) == []


def test_setting_what_there_is_not_is_an_error_and_nothing_else(desk: Desk) -> None:
    taken(desk.station)
    desk.send("PARAM_SET", param_id="NOPE", param_value=1.0, param_type=REAL32)
    (error,) = taken(desk.station)
    assert (error.get_type(), error.param_id, error.error) == (
        "PARAM_ERROR",
        "NOPE",
        mav.MAV_PARAM_ERROR_DOES_NOT_EXIST,
    )


def test_a_new_value_is_told_everybody_once_and_is_in_force(make: Make) -> None:
    desk = make(links=[MemoryLink("first"), MemoryLink("second")])
    stations = [desk.station, desk.join(system=254), desk.join(system=253, link=1)]
    desk.send("PARAM_SET", param_id="NAV_ACC_RAD", param_value=0.7, param_type=REAL32)
    desk.send("PARAM_SET", param_id="COM_RCL_EXCEPT", param_value=bits(5), param_type=INT32)
    for station in stations:
        assert [(m.param_id, value_of(m)) for m in values(station)] == [
            ("NAV_ACC_RAD", pytest.approx(0.7)),
            ("COM_RCL_EXCEPT", 5),
        ]
    parameters = desk.simulation.flight.parameters
    assert parameters["NAV_ACC_RAD"] == 0.7
    assert parameters["COM_RCL_EXCEPT"] == 5
    assert all(station.of("PARAM_ERROR") == [] for station in stations)


def test_the_value_in_force_set_again_is_told_everybody_again(desk: Desk) -> None:
    other = desk.join(system=254)
    for count in (1, 2):
        desk.send("PARAM_SET", param_id="WV_EN", param_value=bits(1), param_type=INT32)
        assert [value_of(message) for message in values(desk)] == [1] * count
        assert [value_of(message) for message in values(other)] == [1] * count


@pytest.mark.parametrize(
    ("name", "value", "kind", "code", "text"),
    [
        ("NAV_ACC_RAD", 0.1, REAL32, 2, "NAV_ACC_RAD: expected 0.5 to 200 m, got 0.1"),
        ("NAV_ACC_RAD", math.nan, REAL32, 2, "NAV_ACC_RAD: expected 0.5 to 200 m, got nan"),
        ("NAV_ACC_RAD", math.inf, REAL32, 2, "NAV_ACC_RAD: expected 0.5 to 200 m, got inf"),
        ("NAV_ACC_RAD", bits(10), INT32, 7, "NAV_ACC_RAD: expected type REAL32 (9), got INT32 (6)"),
        ("WV_EN", 1.0, REAL32, 7, "WV_EN: expected type INT32 (6), got REAL32 (9)"),
        ("WV_EN", bits(1), mav.MAV_PARAM_TYPE_UINT8, 6, "WV_EN: expected type INT32 (6), got UINT8 (1)"),
        ("WV_EN", bits(1), 200, 6, "WV_EN: expected type INT32 (6), got unknown (200)"),
        ("WV_EN", bits(-1), INT32, 2, "WV_EN: expected 0 (Keep heading), 1 (Turn into the wind), got -1"),
        ("CAL_MAG0_ID", bits(0), INT32, 5, "CAL_MAG0_ID: expected 1, which cannot be set, got 0"),
    ],
)
def test_what_is_refused_is_told_with_the_reason_and_the_value_in_force(
    desk: Desk, name: str, value: float, kind: int, code: int, text: str
) -> None:
    before = Parameters()[name]
    other = desk.join(system=254)
    taken(desk.station)
    desk.send("PARAM_SET", param_id=name, param_value=value, param_type=kind)
    # The error first: MAVSDK tries again after the value in force alone.
    kinds = [message.get_type() for message in desk.received]
    assert kinds.index("PARAM_ERROR") < kinds.index("PARAM_VALUE")
    (error,), (told,) = desk.of("PARAM_ERROR"), desk.of("PARAM_VALUE")
    assert (error.param_id, error.param_index, error.error) == (name, -1, code)
    assert (told.param_id, value_of(told)) == (name, pytest.approx(before))
    assert texts(desk) == text
    assert desk.simulation.flight.parameters[name] == before
    # The guide has everybody told the value, whether or not it is another one; the rest is the sender's matter.
    assert [message.get_type() for message in other.received] == ["PARAM_VALUE"]


def test_a_fact_may_be_set_to_what_it_is_as_a_whole_file_does(desk: Desk) -> None:
    desk.send("PARAM_SET", param_id="CAL_MAG0_ID", param_value=bits(1), param_type=INT32)
    assert [value_of(message) for message in values(desk)] == [1]
    assert desk.of("PARAM_ERROR") == []


@pytest.mark.parametrize("kind", [0, 1, 2, 6, 9, 10])
def test_ardupilots_clients_set_by_any_type_and_whole_numbers_as_floats(make: Make, kind: int) -> None:
    desk = make(identity=IDENTITIES["ardupilot"])
    desk.send("PARAM_SET", param_id="CBRK_FLIGHTTERM", param_value=0.0, param_type=kind)
    desk.send("PARAM_SET", param_id="COM_RCL_EXCEPT", param_value=7.0, param_type=kind)
    assert [message.param_value for message in values(desk)] == [0.0, 7.0]
    assert {message.param_type for message in values(desk)} == {INT32}
    desk.send("PARAM_SET", param_id="COM_RCL_EXCEPT", param_value=2.5, param_type=kind)
    assert texts(desk) == "COM_RCL_EXCEPT: expected a whole number 0 to 7, got 2.5"
    assert desk.of("PARAM_ERROR")[0].error == mav.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE
    assert values(desk)[-1].param_value == 7.0


def test_a_station_on_a_link_that_nothing_is_broadcast_to_is_answered_all_the_same(make: Make) -> None:
    desk = make(links=[MemoryLink("quiet", streams=QUIET), MemoryLink()])
    other = desk.join(system=254, link=1)
    for value in (5.0, 5.0, -1.0):
        desk.send("PARAM_SET", param_id="NAV_ACC_RAD", param_value=value, param_type=REAL32)
    assert [message.param_value for message in values(desk)] == [5.0] * 3
    assert [message.param_value for message in values(other)] == [5.0] * 3


def test_whoever_changes_a_parameter_everybody_is_told_also_after_the_vehicle_began_anew(desk: Desk) -> None:
    other = desk.join(system=254)
    desk.simulation.flight.parameters.set("NAV_ACC_RAD", 5.0)
    desk.face.request_restart()
    desk.turn()
    desk.simulation.flight.parameters.set("NAV_ACC_RAD", 6.0)
    desk.simulation.flight.parameters.set("NAV_ACC_RAD", 6.0)
    for station in (desk.station, other):
        assert [(m.param_id, m.param_value) for m in values(station)] == [("NAV_ACC_RAD", 5.0), ("NAV_ACC_RAD", 6.0)]


def test_a_parameter_of_the_list_comes_by_request_message_too(desk: Desk) -> None:
    for index in (0, len(NAMES) - 1):
        ack = desk.command(mav.MAV_CMD_REQUEST_MESSAGE, mav.MAVLINK_MSG_ID_PARAM_VALUE, index)
        assert ack.result == mav.MAV_RESULT_ACCEPTED
        assert desk.of("PARAM_VALUE")[-1].param_id == NAMES[index]
    for wrong in (-1, len(NAMES), 0.5, math.nan, math.inf):
        ack = desk.command(mav.MAV_CMD_REQUEST_MESSAGE, mav.MAVLINK_MSG_ID_PARAM_VALUE, wrong)
        assert ack.result == mav.MAV_RESULT_DENIED


def test_the_system_id_is_a_parameter_for_the_next_begin(desk: Desk) -> None:
    (service,) = (service for service in desk.face.services if isinstance(service, ParameterService))
    assert service.system_id == 1
    desk.send("PARAM_SET", param_id="MAV_SYS_ID", param_value=bits(42), param_type=INT32)
    assert service.system_id == 42
    assert Parameters().definition("MAV_SYS_ID").reboot_required


def test_without_an_autopilot_there_are_no_parameters(make: Make) -> None:
    desk = make(Simulation(autopilot=False))
    taken(desk.station)
    desk.send("PARAM_REQUEST_LIST")
    desk.wait(LIST_TIME)
    assert desk.of("PARAM_VALUE") == []
    desk.send("PARAM_REQUEST_READ", param_id="WV_EN", param_index=-1)
    desk.send("PARAM_REQUEST_READ", param_index=0)
    desk.send("PARAM_SET", param_id="WV_EN", param_value=bits(1), param_type=INT32)
    assert [error.error for error in desk.of("PARAM_ERROR")] == [mav.MAV_PARAM_ERROR_DOES_NOT_EXIST] * 3
    assert desk.command(mav.MAV_CMD_PREFLIGHT_STORAGE, 1).result == mav.MAV_RESULT_DENIED
    assert desk.command(mav.MAV_CMD_REQUEST_MESSAGE, mav.MAVLINK_MSG_ID_PARAM_VALUE, 0).result == mav.MAV_RESULT_DENIED
    assert desk.face.internal_errors == 0


@pytest.mark.parametrize("seed", range(5))
def test_with_thirty_percent_loss_a_client_that_tries_again_gets_and_sets_everything(make: Make, seed: int) -> None:
    desk = make()
    station = desk.join(system=200 + seed)
    station.loss, station.duplicates, station.random = 0.3, 0.1, random.Random(seed)
    have: dict[int, Any] = {}
    for _ in range(40):
        if not have:
            station.send("PARAM_REQUEST_LIST")
        for index in range(len(NAMES)):
            if have and index not in have:
                station.send("PARAM_REQUEST_READ", param_index=index)
        desk.wait(LIST_TIME)
        have |= {message.param_index: message for message in values(station)}
        if len(have) == len(NAMES):
            break
    assert [have[index].param_id for index in range(len(NAMES))] == NAMES

    wanted = {"MPC_XY_CRUISE": 4.5, "NAV_ACC_RAD": 12.5, "RTL_RETURN_ALT": 60.0}
    for name, value in wanted.items():
        for _ in range(40):
            station.received.clear()
            station.send("PARAM_SET", param_id=name, param_value=value, param_type=REAL32)
            if any(message.param_id == name and message.param_value == value for message in values(station)):
                break
        else:
            pytest.fail(f"{name} was never acknowledged")
    assert {name: desk.simulation.flight.parameters[name] for name in wanted} == wanted


@pytest.fixture(scope="module")
def fuzzed() -> Iterator[Desk]:
    desk = Desk()
    yield desk
    desk.close()


@settings(max_examples=400, deadline=None)
@given(
    kind=st.sampled_from(["PARAM_REQUEST_READ", "PARAM_REQUEST_LIST", "PARAM_SET"]),
    name=st.one_of(st.sampled_from([*NAMES, "_HASH_CHECK"]).map(str.encode), st.binary(max_size=16)),
    pattern=st.one_of(
        st.integers(0, (1 << 32) - 1), st.floats(-200.0, 200.0, width=32).map(lambda value: struct.pack("<f", value))
    ),
    number=st.integers(0, 255),
    index=st.integers(-32768, 32767),
)
def test_no_field_of_a_message_can_do_harm(
    fuzzed: Desk, kind: str, name: bytes, pattern: int | bytes, number: int, index: int
) -> None:
    data = pattern if isinstance(pattern, bytes) else pattern.to_bytes(4, "little")
    parameters = fuzzed.simulation.flight.parameters
    before = {known: parameters[known] for known in parameters.names()}
    fields: dict[str, Any] = {
        "PARAM_REQUEST_READ": {"param_id": name, "param_index": index},
        "PARAM_REQUEST_LIST": {},
        "PARAM_SET": {
            "param_id": name,
            "param_value": struct.unpack("<f", data)[0],
            "param_type": (6, 9, number)[number % 3],
        },
    }[kind]
    fuzzed.station.received.clear()
    fuzzed.send(kind, **fields)
    assert fuzzed.face.internal_errors == 0
    after = {known: parameters[known] for known in parameters.names()}
    changed = {known for known in after if after[known] != before[known]}
    assert changed <= ({name.partition(b"\0")[0].decode("ascii", "replace")} if kind == "PARAM_SET" else set())
    Parameters(after)  # all within their ranges
    if kind != "PARAM_REQUEST_LIST" and name != b"_HASH_CHECK":
        assert fuzzed.of("PARAM_VALUE") or fuzzed.of("PARAM_ERROR")


def test_messages_for_others_are_not_answered(desk: Desk) -> None:
    taken(desk.station)
    for target in ({"target_system": 2}, {"target_component": 154}):
        desk.send("PARAM_REQUEST_LIST", **target)
        desk.send("PARAM_REQUEST_READ", param_index=0, **target)
        desk.send("PARAM_SET", param_id="WV_EN", param_value=bits(1), param_type=INT32, **target)
    desk.wait(LIST_TIME)
    assert [message for message in taken(desk.station) if message.get_type().startswith("PARAM")] == []
    assert desk.simulation.flight.parameters["WV_EN"] == 0


def test_sticks_are_not_listened_to_where_com_rc_in_mode_says_so(desk: Desk) -> None:
    sticks = desk.simulation.flight.sticks
    for mode, heard in ((4, -math.inf), (1, pytest.approx(0.0, abs=0.1))):
        desk.send("PARAM_SET", param_id="COM_RC_IN_MODE", param_value=bits(mode), param_type=INT32)
        desk.send("MANUAL_CONTROL", x=500, z=500)
        desk.send("RC_CHANNELS_OVERRIDE", chan1_raw=1600)
        assert sticks.received == heard
