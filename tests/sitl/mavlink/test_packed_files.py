"""Packed parameters and plans, read with pymavlink's own decoder and written as MAVProxy writes them."""

import math
import struct
from collections.abc import Callable, Sequence
from itertools import pairwise, takewhile

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink import mavftp
from pymavlink.dialects.v20 import ardupilotmega

from sitl.flight.parameters import Parameters
from sitl.mavlink.packed_files import packed_parameters, packed_plan, unpacked_parameters, unpacked_plan


def single(value: float) -> float:
    return struct.unpack("<f", struct.pack("<f", value))[0]


def in_common(first: Sequence[object], second: Sequence[object]) -> int:
    """With how many characters two names begin alike."""
    return sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], zip(first, second, strict=False)))


def test_pymavlink_reads_all_parameters_and_their_defaults() -> None:
    parameters = Parameters({"MIS_TAKEOFF_ALT": 20.0, "RTL_TYPE": 2})
    data = mavftp.MAVFTP.ftp_param_decode(packed_parameters(parameters, "withdefaults=1"))
    assert data is not None
    assert data.defaults is not None
    assert [name.decode() for name, _, _ in data.params] == list(parameters.names())
    for (name, value, kind), (_, default, _) in zip(data.params, data.defaults, strict=True):
        definition = parameters.definition(name.decode())
        assert value == single(parameters[definition.name])
        assert default == single(definition.default)
        assert kind == (3 if definition.kind == "int" else 4)
    without = mavftp.MAVFTP.ftp_param_decode(packed_parameters(parameters))
    assert without is not None
    assert without.params == data.params


def test_names_share_their_beginnings_as_far_as_four_bits_go() -> None:
    data = packed_parameters(Parameters())
    place, before = 6, b""
    while place < len(data):
        common, more = data[place + 1] & 15, (data[place + 1] >> 4) + 1
        name = before[:common] + data[place + 2 : place + 2 + more]
        assert common == min(15, in_common(before, name))
        place, before = place + 2 + more + 4, name


@pytest.mark.parametrize(("start", "count"), [(0, 5), (5, 5), (60, 1000), (0, 0)])
def test_a_part_of_the_list_is_served(start: int, count: int) -> None:
    parameters = Parameters()
    data = packed_parameters(parameters, f"start={start}&count={count}")
    names = parameters.names()
    chosen = names[start:][: count or None]
    assert struct.unpack("<HHH", data[:6]) == (0x671B, len(chosen), len(names))
    decoded = mavftp.MAVFTP.ftp_param_decode(data)
    assert decoded is not None
    assert [name.decode() for name, _, _ in decoded.params] == list(chosen)


@pytest.mark.parametrize("query", ["start=9999", "start=-1", "count=x", "other=1", "withdefaults=", "start=1e3"])
def test_a_query_that_makes_no_sense_is_refused(query: str) -> None:
    with pytest.raises(OSError, match="expected"):
        packed_parameters(Parameters(), query)


def as_mavproxy(values: dict[str, float]) -> bytes:
    """An upload as MAVProxy's `param ftpload` makes it: the smallest type for each, the file's length in the header."""
    packed, before = b"", ""
    for name, value in sorted(values.items()):
        common = in_common(before, name)
        kind, form = (4, "<f")
        if value == int(value):
            kind, form = (1, "<b") if -128 <= value <= 127 else (2, "<h") if -32768 <= value <= 32767 else (3, "<i")
        packed += bytes((kind, common | (len(name) - common - 1) << 4)) + name[common:].encode()
        packed += struct.pack(form, int(value) if kind < 4 else value)
        before = name
    return struct.pack("<HHH", 0x671B, len(values), 6 + len(packed)) + packed


def test_an_upload_of_mavproxy_is_read() -> None:
    values = {"MIS_TAKEOFF_ALT": 20.0, "MIS_TKO_LAND_REQ": 1.0, "CBRK_FLIGHTTERM": 121212.0, "BAT_LOW_THR": single(0.3)}
    assert unpacked_parameters(as_mavproxy(values)) == values


@pytest.mark.parametrize(
    "damage", [lambda data: data[:-1], lambda data: data + b"x", lambda data: b"x" + data[1:], lambda _: b""]
)
def test_a_damaged_upload_of_parameters_is_refused(damage: Callable[[bytes], bytes]) -> None:
    data = damage(as_mavproxy({"MIS_TAKEOFF_ALT": 20.5, "RTL_TYPE": 2.0}))
    with pytest.raises(ValueError, match="parameters: expected"):
        unpacked_parameters(data)


ITEM = {
    "seq": 1, "frame": 6, "command": 16, "current": 0, "autocontinue": 1, "param1": 1.5, "param2": 0.0, "param3": 0.0,
    "param4": math.nan, "x": 473977420, "y": -85455940, "z": 30.25, "mission_type": 0,
}  # fmt: skip


def test_a_plan_is_a_header_and_whole_items_as_mavproxy_reads_them() -> None:
    data = packed_plan(0, [ITEM, {**ITEM, "seq": 2}])
    assert struct.unpack("<HHHHH", data[:10]) == (0x763D, 0, 0, 0, 2)
    message = ardupilotmega.MAVLink_mission_item_int_message
    size = message.unpacker.size
    assert len(data) == 10 + 2 * size
    for number, (start, end) in enumerate(pairwise(range(10, len(data) + 1, size))):
        on_wire = message.unpacker.unpack(data[start:end])
        item = message(*(on_wire[place] for place in message.orders))
        assert (item.seq, item.x, item.y, item.z, item.param1) == (1 + number, 473977420, -85455940, 30.25, 1.5)
        assert math.isnan(item.param4)


def test_an_upload_of_a_plan_is_read() -> None:
    plan = unpacked_plan(packed_plan(2, [ITEM] * 3))
    assert (plan.kind, plan.start, plan.is_part, len(plan.items)) == (2, 0, False, 3)
    assert (plan.items[0].x, plan.items[0].frame) == (473977420, 6)
    part = unpacked_plan(struct.pack("<HHHHH", 0x763D, 0, 1, 5, 1) + packed_plan(0, [ITEM])[10:])
    assert (part.start, part.is_part) == (5, True)


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"", "at least 10 bytes"),
        (packed_plan(0, [ITEM])[:-1], "expected 1 items, got 0 and 37 bytes"),
        (packed_plan(0, [ITEM]) + bytes(38), "expected 1 items, got 2"),
        (struct.pack("<HHHHH", 0x763D, 0, 0, 0, 1) + bytes(38), "item 0 has never come"),
        (struct.pack("<HHHHH", 0x1234, 0, 0, 0, 0), "0x763d, got 0x1234"),
        (struct.pack("<HHHHH", 0x763D, 0, 2, 0, 0), "options 2"),
    ],
)
def test_a_plan_that_is_not_whole_is_refused(data: bytes, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        unpacked_plan(data)


@given(st.binary(max_size=200))
def test_no_bytes_make_the_readers_stumble(data: bytes) -> None:
    for read in (unpacked_parameters, unpacked_plan):
        for header in (b"", b"\x1b\x67\x05\x00", b"\x3d\x76"):
            try:
                read(header + data)
            except ValueError:
                continue
