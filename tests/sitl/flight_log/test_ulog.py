"""ULog files as https://docs.px4.io/main/en/dev_log/ulog_file_format.html has them; read by PX4's pyulog."""

import io
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyulog import ULog

from sitl.flight_log.ulog import (
    SIZES,
    data_header,
    default_parameter,
    dropout,
    field_size,
    file_header,
    format_definition,
    information,
    logged_string,
    message_starts,
    parameter,
    subscription,
)

POINT = (("uint64_t", "timestamp"), ("float[2]", "xy"), ("int8_t", "kind"))
PAIR = (("uint64_t", "timestamp"), ("point[2]", "ends"))


def point(time: int, x: float, y: float, kind: int) -> bytes:
    return struct.pack("<Qffb", time, x, y, kind)


def read(*messages: bytes, start: int = 0) -> ULog:
    return ULog(io.BytesIO(file_header(start) + b"".join(messages)))


def test_a_file_begins_with_magic_version_time_and_flags_that_say_where_nothing_is_appended() -> None:
    header = file_header(0x0102030405060708)
    assert header[:16] == bytes.fromhex("554c6f67011235 01 0807060504030201")
    assert header[16:19] == struct.pack("<HB", 40, ord("B"))
    assert header[19:] == bytes([1, *[0] * 39])  # default parameters may follow; everything else is as of old
    assert len(header) == 16 + 3 + 40


def test_pyulog_reads_every_kind_of_message_back() -> None:
    log = read(
        format_definition("pair", PAIR),
        format_definition("point", POINT),
        information("sys_name", "tilt-wing Ä"),
        information("time_ref_utc", -3600),
        parameter("GAIN", 0.5),
        parameter("COUNT", -7),
        default_parameter("GAIN", 0.25),
        subscription(0, "point"),
        subscription(1, "pair"),
        data_header(0, 17) + point(10, 1.5, -2.5, -3),
        logged_string(4, 11, "low"),
        parameter("GAIN", 0.75),
        data_header(1, 8 + 2 * 17) + struct.pack("<Q", 12) + point(1, 2.0, 3.0, 4) + point(5, 6.0, 7.0, 8),
        dropout(120),
        data_header(0, 17) + point(20, 3.5, 4.5, 5),
        start=9,
    )
    assert not log.file_corruption
    assert log.start_timestamp == 9
    assert log.msg_info_dict == {"sys_name": "tilt-wing Ä", "time_ref_utc": -3600}
    assert log.initial_parameters == {"GAIN": 0.5, "COUNT": -7}
    assert log.get_default_parameters(0) == {"GAIN": 0.25}
    assert log.changed_parameters == [(10, "GAIN", 0.75)]
    points, pairs = log.get_dataset("point").data, log.get_dataset("pair").data
    assert points["timestamp"].tolist() == [10, 20]
    assert points["xy[1]"].tolist() == [-2.5, 4.5]
    assert points["kind"].tolist() == [-3, 5]
    assert pairs["ends[1].xy[0]"].tolist() == [6.0]
    (text,) = log.logged_messages
    assert (text.log_level_str(), text.timestamp, text.message) == ("WARNING", 11, "low")
    assert [mark.duration for mark in log.dropouts] == [120]


def test_pyulog_writes_the_same_bytes_again() -> None:
    definitions = file_header(3) + format_definition("point", POINT) + information("sys_name", "x")
    whole = definitions + parameter("GAIN", 0.5) + subscription(0, "point") + data_header(0, 17) + point(4, 1, 2, 3)
    log, again = ULog(io.BytesIO(whole)), io.BytesIO()
    log.write_ulog(again)
    ours, theirs = bytearray(whole), bytearray(again.getvalue())
    ours[7] = theirs[7] = 1  # the version, which pyulog forgets
    assert ours == theirs


@pytest.mark.parametrize(("kind", "size"), [*SIZES.items(), ("float[3]", 12), ("uint64_t[2]", 16)])
def test_sizes_are_those_of_pyulog(kind: str, size: int) -> None:
    assert field_size(kind) == size
    basic = kind.partition("[")[0]
    assert SIZES[basic] == ULog.get_field_size(basic)


@pytest.mark.parametrize("kind", ["real", "float[]", "float[3][2]", "", "float 3"])
def test_an_unknown_type_is_refused_with_what_was_expected(kind: str) -> None:
    with pytest.raises(ValueError, match=r"expected one of int8_t.*got"):
        field_size(kind)


def test_a_text_of_any_length_stays_one_message() -> None:
    log = read(subscription(0, "x"), logged_string(6, 1, "a" * 100_000), logged_string(6, 2, "b"))
    assert [len(text.message) for text in log.logged_messages] == [0xFFFF - 9, 1]


def test_a_dropout_is_never_longer_than_its_field_nor_nothing() -> None:
    log = read(subscription(0, "x"), dropout(0), dropout(10**9))
    assert [mark.duration for mark in log.dropouts] == [1, 0xFFFF]


@given(st.lists(st.integers(0, 600), min_size=1, max_size=30), st.integers(1, 2000))
def test_message_starts_finds_the_first_message_at_or_after_a_place(sizes: list[int], end: int) -> None:
    starts, data = [0], b""
    for size in sizes:
        data += struct.pack("<HB", size, ord("L")) + bytes(size)
        starts.append(len(data))
    end = min(end, len(data))
    assert message_starts(data, 0, end) == next(start for start in starts if start >= end)
