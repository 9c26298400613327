"""Status texts in chunks: https://mavlink.io/en/messages/common.html#STATUSTEXT."""

import pytest

from sitl.mavlink.codec import MessageCodec
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.statustext import StatusText

V1_SIZE = 51  # of the payload, before chunks were added


def reassembled(messages: list[tuple[MessageCodec, bytes]]) -> bytes:
    """As a receiver does it: chunks of one id in order, until one holds a zero byte."""
    whole, ended, ids = b"", False, set[int]()
    for expected, (packer, payload) in enumerate(messages):
        _, text, text_id, number = packer.unpack(payload)
        assert not ended, "a chunk after the last one"
        assert number == expected
        ids.add(text_id)
        part, zero, _ = text.partition(b"\0")
        whole += part
        ended = bool(zero)
    assert ended
    assert len(ids) == 1
    return whole


@pytest.mark.parametrize("length", [1, 49, 50])
def test_a_text_that_fits_is_one_message_that_version_1_can_hold(length: int) -> None:
    ((packer, payload),) = StatusText().messages(mav.MAV_SEVERITY_INFO, "x" * length)
    assert len(payload) <= V1_SIZE
    severity, text, text_id, number = packer.unpack(payload)
    assert (severity, text.rstrip(b"\0"), text_id, number) == (mav.MAV_SEVERITY_INFO, b"x" * length, 0, 0)


@pytest.mark.parametrize("length", [51, 99, 100, 101, 150, 1000])
def test_a_longer_text_arrives_whole_and_its_end_can_be_seen(length: int) -> None:
    text = "".join(chr(33 + i % 90) for i in range(length))
    assert reassembled(StatusText().messages(mav.MAV_SEVERITY_ERROR, text)) == text.encode()


@pytest.mark.parametrize("shift", range(4))
@pytest.mark.parametrize("letter", ["ß", "€", "🛩"])
def test_letters_of_several_bytes_may_be_cut_by_a_chunk_and_are_whole_again(letter: str, shift: int) -> None:
    text = "x" * shift + letter * 60
    assert reassembled(StatusText().messages(mav.MAV_SEVERITY_INFO, text)).decode() == text


def test_what_cannot_be_encoded_is_replaced() -> None:
    ((packer, payload),) = StatusText().messages(mav.MAV_SEVERITY_INFO, "a\udc80b")
    assert packer.unpack(payload)[1].rstrip(b"\0") == b"a?b"


def test_long_texts_have_ids_of_their_own_and_never_zero() -> None:
    status_text = StatusText()
    firsts = (status_text.messages(mav.MAV_SEVERITY_INFO, "x" * 51)[0] for _ in range(70_000))
    ids = [packer.unpack(payload)[2] for packer, payload in firsts]
    assert ids[:3] == [1, 2, 3]
    assert ids[65534:65537] == [65535, 1, 2]
    assert min(ids) == 1
