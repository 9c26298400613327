"""The scanner finds every frame and survives everything else."""

import random
import struct
from typing import Any

import pytest

from sitl.mavlink.codec import codec
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.frames import FrameScanner

PING = codec("PING")
PAYLOAD = PING.payload((123456789, 42, 1, 2))
FRAME = PING.frame(PAYLOAD, 7, 11, 22)


def datagram(data: bytes) -> tuple[list[Any], int]:
    scanner = FrameScanner(is_stream=False)
    return list(scanner.scan(data)), scanner.malformed


def test_a_frame_is_found_with_its_sender_and_payload() -> None:
    assert datagram(FRAME) == ([(PING.id, 11, 22, PAYLOAD, FRAME, True)], 0)


def test_several_frames_of_both_versions_share_a_datagram() -> None:
    old = mav.MAVLink(None, srcSystem=3, srcComponent=4)
    version_1 = bytes(mav.MAVLink_heartbeat_message(6, 8, 1, 2, 3, 3).pack(old, force_mavlink1=True))
    frames, malformed = datagram(FRAME + version_1 + FRAME)
    assert [(frame.message, frame.system, frame.component) for frame in frames] == [(4, 11, 22), (0, 3, 4), (4, 11, 22)]
    assert codec("HEARTBEAT").unpack(frames[1].payload) == (6, 8, 1, 2, 3, 3)
    assert malformed == 0


def test_a_signed_frame_is_read() -> None:
    sender = mav.MAVLink(None, srcSystem=5, srcComponent=6)
    sender.signing.secret_key = bytes(32)
    sender.signing.sign_outgoing = True
    signed = bytes(mav.MAVLink_ping_message(1, 2, 3, 4).pack(sender))
    frames, malformed = datagram(signed + FRAME)
    assert ([frame.system for frame in frames], malformed) == ([5, 11], 0)


@pytest.mark.parametrize("cut", range(1, len(FRAME)))
def test_a_stream_may_be_cut_anywhere(cut: int) -> None:
    scanner = FrameScanner(is_stream=True)
    found = scanner.scan(FRAME[:cut]) + scanner.scan(FRAME[cut:] + FRAME)
    assert ([frame.payload for frame in found], scanner.malformed) == ([PAYLOAD, PAYLOAD], 0)


@pytest.mark.parametrize("cut", range(1, len(FRAME)))
def test_a_cut_datagram_holds_no_frame_and_the_next_one_is_not_hurt(cut: int) -> None:
    scanner = FrameScanner(is_stream=False)
    assert scanner.scan(FRAME[:cut]) == []
    assert scanner.malformed > 0
    assert [frame.payload for frame in scanner.scan(FRAME)] == [PAYLOAD]


@pytest.mark.parametrize("place", range(len(FRAME)))
def test_any_changed_byte_is_noticed(place: int) -> None:
    damaged = bytearray(FRAME)
    damaged[place] ^= 0x55
    frames, malformed = datagram(bytes(damaged) + FRAME)
    # The sender's ids, too, are under the checksum: whatever was hit, the first frame does not come through.
    assert [frame.payload for frame in frames if frame.is_known] in ([PAYLOAD], [])
    # A message id that nobody here knows cannot be checked, so that frame is taken for somebody else's.
    has_unknown_id = place in (8, 9)
    assert (malformed == 0) is has_unknown_id


def test_unknown_messages_are_found_whole_for_those_who_know_them() -> None:
    unknown = struct.pack("<BBBBBBBHB", 0xFD, 3, 0, 0, 0, 1, 1, 0xFFF0, 0x12) + b"abc\x11\x22"
    frames, malformed = datagram(unknown + FRAME)
    assert ([frame.is_known for frame in frames], malformed) == ([False, True], 0)
    assert [frame.raw for frame in frames] == [unknown, FRAME]


def test_undefined_incompatibility_flags_are_refused() -> None:
    body = bytearray(FRAME)
    body[2] = 0x02
    assert datagram(bytes(body))[0] == []


def test_random_bytes_never_raise_and_frames_after_them_are_found() -> None:
    random_numbers = random.Random(20130602)
    scanner = FrameScanner(is_stream=False)
    found = 0
    for _ in range(50_000):
        data = random_numbers.randbytes(random_numbers.randrange(0, 80))
        if data and random_numbers.random() < 0.5:  # noise that begins like a frame is the harder kind
            data = random_numbers.choice((b"\xfd", b"\xfe")) + data
        scanner.scan(data)
        found += len(scanner.scan(FRAME))
    assert found == 50_000
    assert scanner.malformed > 20_000


def test_random_bytes_on_a_stream_do_not_block_it_for_good() -> None:
    random_numbers = random.Random(7)
    scanner = FrameScanner(is_stream=True)
    for _ in range(2000):
        scanner.scan(random_numbers.randbytes(random_numbers.randrange(0, 400)))
    # A false start may swallow as many bytes as a frame can have; after that the stream must be in step again.
    found = [frame for _ in range(20) for frame in scanner.scan(FRAME)]
    assert len(found) >= 10
    assert found[-1].payload == PAYLOAD


def test_a_huge_datagram_of_false_starts_costs_little() -> None:
    almost = bytearray(FRAME)
    almost[-1] ^= 0xFF
    frames, malformed = datagram(bytes(almost) * (65000 // len(almost)))
    assert frames == []
    assert 0 < malformed <= 33
