"""Parameters in the one float that carries them, against the guide's two encodings."""

import math
import struct
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import all as mav

from gcs_scripts.parameter_encoding import Parameter, as_type, decoded, is_bytewise, set_message

INT8, UINT16, INT32, UINT32, REAL32 = 2, 3, 6, 5, 9


def over_the_wire(message: mav.MAVLink_message, *, v1: bool = False) -> Any:
    return mav.MAVLink(None).decode(bytearray(message.pack(mav.MAVLink(None, 1, 1), force_mavlink1=v1)))


def value_message(bits: bytes, kind: int, *, v1: bool = False) -> Any:
    """PARAM_VALUE with these four bytes as its value, as a vehicle in C sends them."""

    class Raw(mav.MAVLink_param_value_message):
        unpacker = struct.Struct("<4sHH16sB")

    return over_the_wire(Raw(b"NAME", bits, kind, 7, 3), v1=v1)  # pyright: ignore[reportArgumentType]


@given(st.integers(-(1 << 31), (1 << 31) - 1))
def test_every_int32_survives_bytewise_both_ways_also_where_its_bits_are_a_signalling_nan(value: int) -> None:
    told = decoded(value_message(struct.pack("<i", value), INT32), bytewise=True)
    assert (told.value, told.type, told.index, told.name) == (value, INT32, 3, "NAME")
    sent = set_message(1, 1, told, bytewise=True).pack(mav.MAVLink(None))
    assert sent[10:14] == struct.pack("<i", value)[: len(sent) - 12]


@pytest.mark.parametrize("v1", [False, True])
@pytest.mark.parametrize(
    ("kind", "form", "value"), [(INT8, "<b", -3), (UINT16, "<H", 65535), (INT32, "<i", 2139095041)]
)
def test_bytewise_integers_are_read_from_either_mavlink(kind: int, form: str, value: int, v1: bool) -> None:
    assert decoded(value_message(struct.pack(form, value).ljust(4, b"\0"), kind, v1=v1), bytewise=True).value == value


@given(st.integers(-(1 << 24), 1 << 24))
def test_a_cast_integer_is_the_float_of_the_same_number(value: int) -> None:
    told = decoded(value_message(struct.pack("<f", value), INT32), bytewise=False)
    assert told.value == value
    sent = over_the_wire(set_message(1, 1, told, bytewise=False))
    assert (sent.param_value, sent.param_id, sent.param_type) == (value, "NAME", INT32)


@given(st.floats(width=32, allow_nan=False), st.booleans())
def test_floats_are_the_same_in_both(value: float, bytewise: bool) -> None:
    told = decoded(value_message(struct.pack("<f", value), REAL32), bytewise=bytewise)
    assert told == Parameter("NAME", value, REAL32, 3)
    assert over_the_wire(set_message(1, 1, told, bytewise=bytewise)).param_value == value


def test_the_heartbeats_autopilot_decides_and_of_others_the_capabilities() -> None:
    def by(autopilot: int) -> SimpleNamespace:
        return SimpleNamespace(autopilot=autopilot)

    cast, bits = mav.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST, mav.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE
    assert is_bytewise(by(mav.MAV_AUTOPILOT_PX4), cast)  # as MAVSDK: the autopilot's word goes before the bits
    assert not is_bytewise(by(mav.MAV_AUTOPILOT_ARDUPILOTMEGA), bits)
    assert is_bytewise(by(mav.MAV_AUTOPILOT_GENERIC), bits)
    assert not is_bytewise(by(mav.MAV_AUTOPILOT_GENERIC), cast)
    assert is_bytewise(by(mav.MAV_AUTOPILOT_GENERIC))


@pytest.mark.parametrize(
    ("value", "kind"), [(1.5, INT32), (math.nan, INT32), (200, INT8), (-1, UINT32), (1e39, REAL32)]
)
def test_a_number_that_does_not_fit_its_type_is_refused_with_what_was_expected(value: float, kind: int) -> None:
    with pytest.raises(ValueError, match="expected a"):
        as_type(value, kind)


def test_a_float_is_rounded_as_the_vehicle_will_hold_it() -> None:
    assert as_type(0.1, REAL32) == struct.unpack("<f", struct.pack("<f", 0.1))[0] != 0.1
