"""Values of parameters on the wire: as pymavlink and the autopilots themselves put them there."""

import struct
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.mavparm import MAVParmDict

from sitl.flight.parameter_table import DEFINITIONS, Definition
from sitl.flight.parameters import Parameters
from sitl.mavlink.codec import codec
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.parameter_encoding import WrongTypeError, decoded, encoded, hash_of, hash_payload, type_of

WHOLE = next(definition for definition in DEFINITIONS if definition.kind == "int" and definition.bits)
REAL = next(definition for definition in DEFINITIONS if definition.name == "NAV_ACC_RAD")
# Whole numbers whose bits, as a float, are a signalling NaN.
SIGNALLING = [(0x7F800001, 0x7FBFFFFF), (0xFF800001 - (1 << 32), 0xFFBFFFFF - (1 << 32))]


class Recorder:
    """A connection that keeps what pymavlink's mavset would send, and gives no answer."""

    def __init__(self) -> None:
        self.sent: list[tuple[str, float, int]] = []

    def param_set_send(self, name: str, value: float, parm_type: int) -> None:
        self.sent.append((name, value, parm_type))

    def recv_match(self, **_: Any) -> Any:
        """What mavset takes for the acknowledgement."""
        name, value, kind = self.sent[-1]
        return mav.MAVLink_param_value_message(name.encode(), value, kind, 1, 0)


def on_the_wire(value: float) -> float:
    """A float after its trip through a PARAM_SET."""
    packer = codec("PARAM_SET")
    return packer.read(packer.payload_of(param_id="X", param_value=value)).param_value


@given(st.integers(-(1 << 31), (1 << 31) - 1))
def test_whole_numbers_travel_by_their_bits_for_px4(value: int) -> None:
    field = encoded(WHOLE, value, bytewise=True)
    if not any(least <= value <= most for least, most in SIGNALLING):
        assert struct.pack("<f", field) == struct.pack("<i", value)
        assert decoded(WHOLE, on_the_wire(field), mav.MAV_PARAM_TYPE_INT32, bytewise=True) == value


def test_no_parameter_reaches_the_numbers_that_a_float_cannot_carry_by_their_bits() -> None:
    for definition in DEFINITIONS:
        for least, most in SIGNALLING:
            assert definition.kind == "float" or definition.maximum < least or definition.minimum > most


@given(st.integers(-(1 << 24), 1 << 24))
def test_whole_numbers_travel_as_floats_for_ardupilot(value: int) -> None:
    field = encoded(WHOLE, value, bytewise=False)
    assert field == float(value)
    for kind in (*range(1, 11), 0, 255):
        assert decoded(WHOLE, on_the_wire(field), kind, bytewise=False) == value


@given(st.floats(width=32, allow_nan=False), st.booleans())
def test_floats_travel_as_they_are(value: float, bytewise: bool) -> None:
    field = on_the_wire(encoded(REAL, value, bytewise=bytewise))
    assert decoded(REAL, field, mav.MAV_PARAM_TYPE_REAL32, bytewise=bytewise) == value


@pytest.mark.parametrize("definition", DEFINITIONS, ids=lambda definition: definition.name)
def test_what_pymavlink_sends_for_a_value_is_what_we_send(definition: Definition) -> None:
    for value in (definition.minimum, definition.default, definition.maximum):
        recorder = Recorder()
        assert MAVParmDict().mavset(recorder, definition.name, value, parm_type=type_of(definition))
        ((_, field, kind),) = recorder.sent
        assert struct.pack("<f", field) == struct.pack("<f", encoded(definition, value, bytewise=True))
        parameters = Parameters()
        parameters.set(definition.name, decoded(definition, on_the_wire(field), kind, bytewise=True))
        assert parameters[definition.name] == value


@pytest.mark.parametrize("definition", [WHOLE, REAL], ids=["int", "float"])
def test_other_types_are_refused_for_px4_with_the_reason(definition: Definition) -> None:
    for kind in set(range(256)) - {type_of(definition)}:
        text = rf"^{definition.name}: expected type \w+ \(\d\), got \w+ \({kind}\)$"
        with pytest.raises(WrongTypeError, match=text) as error:
            decoded(definition, 1.0, kind, bytewise=True)
        ours = kind in {mav.MAV_PARAM_TYPE_INT32, mav.MAV_PARAM_TYPE_REAL32}
        assert error.value.code == (mav.MAV_PARAM_ERROR_TYPE_MISMATCH if ours else mav.MAV_PARAM_ERROR_TYPE_UNSUPPORTED)


def bitwise_crc(data: bytes) -> int:
    """CRC32 (polynomial 0x04C11DB7, reflected) bit by bit, as MAVLink's guide has it: from zero, not inverted."""
    crc = 0
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0xEDB88320 if crc & 1 else 0)
    return crc


@given(st.integers(0, 7), st.floats(0.5, 200.0))
def test_the_hash_is_the_crc_over_names_and_value_bytes(whole: int, real: float) -> None:
    values = [(WHOLE, whole), (REAL, real)]
    data = WHOLE.name.encode() + np.int32(whole).tobytes() + REAL.name.encode() + np.float32(real).tobytes()
    assert hash_of(values) == bitwise_crc(data)
    assert hash_of([]) == 0


@given(st.integers(0, (1 << 32) - 1))
def test_every_bit_of_the_hash_arrives(value: int) -> None:
    frame = codec("PARAM_VALUE").frame(hash_payload(value, 77), 0, 1, 1)
    message: Any = mav.MAVLink(None).decode(bytearray(frame))
    assert frame[10:14] == value.to_bytes(4, "little")
    assert (message.param_id, message.param_type, message.param_count, message.param_index) == (
        "_HASH_CHECK", mav.MAV_PARAM_TYPE_UINT32, 77, 65535,
    )  # fmt: skip
