"""Our frames are those of pymavlink, byte for byte."""

import math
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.mavlink.codec import codec
from sitl.mavlink.dialect import tiltwing as mav

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


@pytest.mark.parametrize("name", sorted(CLASSES))
@settings(max_examples=6)
@given(data=st.data(), sequence=st.integers(0, 255), system=st.integers(1, 255), component=st.integers(1, 255))
def test_every_message_we_send_is_framed_as_pymavlink_frames_it(
    name: str, data: st.DataObject, sequence: int, system: int, component: int
) -> None:
    fields = data.draw(fields_of(CLASSES[name]))
    ours = codec(name)
    assert ours.frame(ours.payload_of(**fields), sequence, system, component) == pymavlink_frame(
        CLASSES[name], fields, sequence, system, component
    )


@settings(max_examples=4)
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


def test_fields_left_out_are_zero_and_unknown_ones_an_error() -> None:
    ping = codec("PING")
    assert ping.read(ping.payload_of(seq=3)) == (0, 3, 0, 0)
    with pytest.raises(KeyError, match="PING has no field speed"):
        ping.payload_of(seq=1, speed=1)


def test_texts_and_arrays_are_cut_and_filled_to_their_fields() -> None:
    text = codec("STATUSTEXT")
    assert text.read(text.payload_of(text="a" * 60)).text == b"a" * 50
    assert text.read(text.payload_of(text=b"short")).text == b"short"
    ftp = codec("FILE_TRANSFER_PROTOCOL")
    assert ftp.read(ftp.payload_of(payload=b"abc")).payload == (*b"abc", *[0] * 248)
    assert len(ftp.read(ftp.payload_of(payload=bytes(300))).payload) == 251


@pytest.mark.parametrize("name", sorted(CLASSES))
@settings(max_examples=4)
@given(data=st.data())
def test_a_payload_is_read_as_pymavlink_decodes_it(name: str, data: st.DataObject) -> None:
    fields = data.draw(fields_of(CLASSES[name]))
    frame = pymavlink_frame(CLASSES[name], fields, 0, 1, 1)
    [message] = mav.MAVLink(None).parse_buffer(frame) or []
    read = codec(name).read(frame[10:-2])
    for field in message.get_fieldnames():
        theirs, ours = getattr(message, field), getattr(read, field)
        theirs = tuple(theirs) if isinstance(theirs, list) else theirs
        assert theirs == (ours.decode() if isinstance(ours, bytes) else ours), field


@pytest.mark.parametrize("name", sorted(name for name in CLASSES if codec(name).has_target))
def test_targets_are_found_in_any_payload_whole_or_cut(name: str) -> None:
    packer = codec(name)
    system = "target_system" if "target_system" in packer.field_names else "target"
    payload = packer.payload_of(**{system: 77})
    assert packer.targets(payload) == (77, 0)
    if "target_component" in packer.field_names:
        assert packer.targets(packer.payload_of(**{system: 77, "target_component": 88})) == (77, 88)
    assert packer.targets(b"\0") == (0, 0)
