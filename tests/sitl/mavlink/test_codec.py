"""Our frames are those of pymavlink, byte for byte."""

import math
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.mavlink.codec import codec
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.face import TELEMETRY

SENT = [
    *TELEMETRY,
    "COMMAND_ACK",
    "MESSAGE_INTERVAL",
    "PING",
    "TIMESYNC",
    "STATUSTEXT",
    "AUTOPILOT_VERSION",
    "PROTOCOL_VERSION",
]
CLASSES = {message.msgname: message for message in mav.mavlink_map.values()}
NUMBERS = {
    "float": st.floats(width=32, allow_nan=False),
    "double": st.floats(allow_nan=False),
    **{f"uint{bits}_t": st.integers(0, 2**bits - 1) | st.just(0) for bits in (8, 16, 32, 64)},
    **{f"int{bits}_t": st.integers(-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) | st.just(0) for bits in (8, 16, 32, 64)},
}


def fields_of(message: Any) -> st.SearchStrategy[dict[str, Any]]:
    """Any values for the fields of a message, zeros often, for those are cut from the end of a frame."""
    lengths = dict(zip(message.ordered_fieldnames, message.array_lengths, strict=True))
    strategies: dict[str, st.SearchStrategy[Any]] = {}
    for name, kind in zip(message.fieldnames, message.fieldtypes, strict=True):
        if kind == "char":
            size = lengths[name] or 1
            strategies[name] = st.text(st.characters(codec="ascii", exclude_characters="\0"), max_size=size).map(
                str.encode
            )
        elif lengths[name]:
            strategies[name] = st.lists(NUMBERS[kind], min_size=lengths[name], max_size=lengths[name])
        else:
            strategies[name] = NUMBERS[kind]
    return st.fixed_dictionaries(strategies)


def pymavlink_frame(message: Any, fields: dict[str, Any], sequence: int, system: int, component: int) -> bytes:
    packer = mav.MAVLink(None, srcSystem=system, srcComponent=component)
    packer.seq = sequence
    return bytes(message(**fields).pack(packer))


@pytest.mark.parametrize("name", SENT)
@settings(max_examples=50)
@given(data=st.data(), sequence=st.integers(0, 255), system=st.integers(1, 255), component=st.integers(1, 255))
def test_every_message_we_send_is_framed_as_pymavlink_frames_it(
    name: str, data: st.DataObject, sequence: int, system: int, component: int
) -> None:
    fields = data.draw(fields_of(CLASSES[name]))
    ours = codec(name)
    assert ours.frame(ours.payload_of(**fields), sequence, system, component) == pymavlink_frame(
        CLASSES[name], fields, sequence, system, component
    )


@settings(max_examples=10)
@given(data=st.data())
@pytest.mark.parametrize(
    "name", ["HIL_ACTUATOR_CONTROLS", "SERVO_OUTPUT_RAW", "HIL_CONTROLS", "COMMAND_LONG", "COMMAND_INT"]
)
def test_what_is_packed_is_unpacked_again_in_definition_order(name: str, data: st.DataObject) -> None:
    fields = data.draw(fields_of(CLASSES[name]))
    ordered = [fields[field] for field in CLASSES[name].fieldnames]
    flat = [item for value in ordered for item in (value if isinstance(value, list) else [value])]
    ours = codec(name)
    assert list(ours.unpack(ours.payload_of(**fields))) == flat


def test_a_payload_longer_than_we_know_is_read_as_far_as_we_know() -> None:
    ping = codec("PING")
    assert ping.unpack(ping.payload((5, 6, 7, 8)) + b"\1\2\3") == (5, 6, 7, 8)


def test_numbers_beyond_their_field_are_sent_as_its_ends() -> None:
    hil = codec("HIL_STATE")
    values = (2**70, 1e300, -1e300, 0.0, 0.0, 0.0, 0.0, 2**40, -(2**40), 7, 400.0 * 100, -70000, 0, math.nan, 3, 4)
    largest = (2 - 2**-23) * 2.0**127
    assert hil.unpack(hil.payload(values)) == (
        2**64 - 1, largest, -largest, 0.0, 0.0, 0.0, 0.0, 2**31 - 1, -(2**31), 7, 32767, -32768, 0, 0, 3, 4,
    )  # fmt: skip


def test_a_missing_and_an_unknown_field_are_errors() -> None:
    with pytest.raises(KeyError, match="seq"):
        codec("PING").payload_of(time_usec=1, target_system=0, target_component=0)
    with pytest.raises(KeyError, match="PING has no field speed"):
        codec("PING").payload_of(time_usec=1, seq=1, target_system=0, target_component=0, speed=1)
