"""Message signing, beside pymavlink's own: https://mavlink.io/en/guide/message_signing.html."""

import hashlib
import stat
from pathlib import Path
from typing import Any

import pytest

from sitl.mavlink.codec import codec
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.signing import MARGIN, SAVE_PERIOD, Signing, for_log
from sitl.mavlink.signing_key import SigningError
from sitl.mavlink.state_folder import StateFolder

KEY = hashlib.sha256(b"a passphrase").digest()
OTHER_KEY = hashlib.sha256(b"another one").digest()
NOW = 1.8e9  # [s since 1970]
TICKS = round((NOW - 1420070400) * 1e5)  # the same as a timestamp: 10 us since 2015
MINUTE = 6_000_000
LINK = 3


class Clock:
    """UTC that a test moves."""

    def __init__(self, now: float = NOW) -> None:
        self.now = now

    def __call__(self) -> float:
        return self.now


def pymavlink(key: bytes = KEY, timestamp: int = TICKS, link: int = LINK, system: int = 255) -> Any:
    """A speaker of pymavlink's own that signs all it sends."""
    speaker = mav.MAVLink(None, srcSystem=system, srcComponent=190)
    arm(speaker, key, timestamp, link)
    return speaker


def arm(speaker: Any, key: bytes, timestamp: int, link: int = LINK) -> None:
    speaker.signing.secret_key = key
    speaker.signing.timestamp = timestamp
    speaker.signing.link_id = link
    speaker.signing.sign_outgoing = True


def ping(speaker: Any, number: int = 7) -> bytes:
    return bytes(mav.MAVLink_ping_message(1000, number, 0, 0).pack(speaker))


def verdict(signing: Signing, raw: bytes, *, trusted: bool = False) -> tuple[bool, str]:
    v1 = raw[0] == 0xFE
    system, component = (raw[3], raw[4]) if v1 else (raw[5], raw[6])
    message = raw[5] if v1 else int.from_bytes(raw[7:10], "little")
    return signing.verdict(raw, system, component, message, trusted=trusted)


def receiver(now: float = NOW) -> Signing:
    return Signing(key=KEY, clock=Clock(now))


def radio_status() -> bytes:
    return bytes(mav.MAVLink_radio_status_message(1, 2, 3, 4, 5, 6, 7).pack(mav.MAVLink(None, 51, 68)))


# -- signatures ----------------------------------------------------------------------------------------------------


def test_a_signed_frame_is_pymavlinks_byte_for_byte() -> None:
    packer = codec("PING")
    theirs = pymavlink()
    ours = Signing(key=KEY, clock=Clock())
    for number in range(5):  # the clock stands: each frame is one later than the one before
        theirs.seq = number
        frame = packer.frame(packer.payload((1000, 7, 0, 0)), number, 255, 190, signed=True)
        assert ours.sign(frame, LINK) == ping(theirs)


def test_a_signature_is_the_first_48_bits_of_the_hash_that_the_guide_describes() -> None:
    packer = codec("PING")
    frame = packer.frame(packer.payload((1000, 7, 0, 0)), 0, 1, 1, signed=True)
    signed = Signing(key=KEY, clock=Clock()).sign(frame, LINK)
    link_and_timestamp = bytes((LINK,)) + TICKS.to_bytes(6, "little")
    assert signed == frame + link_and_timestamp + hashlib.sha256(KEY + frame + link_and_timestamp).digest()[:6]


def test_pymavlink_believes_what_we_sign_and_we_believe_what_it_signs() -> None:
    theirs, ours = pymavlink(), receiver()
    packer = codec("PING")
    for number in range(300):
        assert verdict(ours, ping(theirs, number)) == (True, "valid")
        frame = ours.sign(packer.frame(packer.payload((1000, number, 0, 0)), number & 255, 1, 1, signed=True), LINK)
        (message,) = theirs.parse_buffer(frame)
        assert message.seq == number
    assert theirs.signing.goodsig_count == 300
    assert ours.counts["valid"] == 300


def test_without_a_key_frames_stay_as_they_are_and_everything_is_accepted() -> None:
    signing = Signing()
    assert not signing.is_on
    assert signing.sign(b"frame", LINK) == b"frame"
    for raw in (ping(pymavlink()), ping(mav.MAVLink(None, 255, 190)), radio_status()):
        assert verdict(signing, raw) == (True, "open")


# -- what is not believed ------------------------------------------------------------------------------------------


def test_a_frame_changed_in_any_bit_is_forged_or_passes_for_unsigned() -> None:
    raw = ping(pymavlink())
    signing = receiver()
    for position in range(len(raw)):
        for bit in range(8):
            changed = bytearray(raw)
            changed[position] ^= 1 << bit
            accepted, reason = verdict(signing, bytes(changed))
            assert not accepted
            assert reason in {"forged", "unsigned"}
    assert verdict(signing, raw) == (True, "valid")


def test_a_frame_signed_with_another_key_is_forged_on_every_link() -> None:
    for trusted in (False, True):
        assert verdict(receiver(), ping(pymavlink(OTHER_KEY)), trusted=trusted) == (False, "forged")


@pytest.mark.parametrize("is_v1", [False, True])
def test_unsigned_frames_of_both_versions_are_accepted_on_trusted_links_only(is_v1: bool) -> None:
    raw = bytes(mav.MAVLink_ping_message(1, 2, 0, 0).pack(mav.MAVLink(None, 255, 190), force_mavlink1=is_v1))
    assert raw[0] == (0xFE if is_v1 else 0xFD)
    assert verdict(receiver(), raw) == (False, "unsigned")
    assert verdict(receiver(), raw, trusted=True) == (True, "trusted")


def test_radio_status_is_always_accepted() -> None:
    speaker = pymavlink(OTHER_KEY)
    signed = bytes(mav.MAVLink_radio_status_message(1, 2, 3, 4, 5, 6, 7).pack(speaker))
    for raw in (radio_status(), signed):
        assert verdict(receiver(), raw) == (True, "exempt")


def test_a_frame_heard_before_is_a_replay_and_so_is_an_older_one() -> None:
    speaker, signing = pymavlink(), receiver()
    first, second, third = ping(speaker), ping(speaker), ping(speaker)
    assert verdict(signing, second) == (True, "valid")
    assert verdict(signing, second) == (False, "replayed")
    assert verdict(signing, first, trusted=True) == (False, "replayed")
    assert verdict(signing, third) == (True, "valid")


def test_each_system_component_and_link_is_a_stream_of_its_own() -> None:
    signing = receiver()
    for speaker in (pymavlink(), pymavlink(link=LINK + 1), pymavlink(system=254)):
        assert verdict(signing, ping(speaker)) == (True, "valid")
        speaker.signing.timestamp = TICKS
        assert verdict(signing, ping(speaker)) == (False, "replayed")


@pytest.mark.parametrize("known", [False, True])
@pytest.mark.parametrize(("behind", "expected"), [(MINUTE, (True, "valid")), (MINUTE + 1, (False, "stale"))])
def test_more_than_a_minute_behind_is_stale_in_new_and_in_known_streams(
    known: bool, behind: int, expected: tuple[bool, str]
) -> None:
    clock = Clock(NOW - 3600.0)
    signing = Signing(key=KEY, clock=clock)
    if known:
        assert verdict(signing, ping(pymavlink(timestamp=TICKS - 3600 * 100_000))) == (True, "valid")
    clock.now = NOW
    assert verdict(signing, ping(pymavlink(timestamp=TICKS - behind))) == expected


def test_bad_frames_advance_no_timestamp() -> None:
    signing = receiver()
    future = TICKS + 10 * MINUTE
    for bad in (ping(pymavlink(OTHER_KEY, future)), radio_status(), ping(mav.MAVLink(None, 255, 190))):
        verdict(signing, bad, trusted=True)
        assert signing.timestamp == TICKS
    stale = ping(pymavlink(timestamp=TICKS - 2 * MINUTE))
    assert verdict(signing, stale) == (False, "stale")
    assert verdict(signing, ping(pymavlink())) == (True, "valid")


def test_frames_are_counted_by_verdict() -> None:
    signing = receiver()
    raw = ping(pymavlink())
    for frame in (raw, raw, ping(pymavlink(OTHER_KEY)), radio_status(), ping(mav.MAVLink(None, 255, 190))):
        verdict(signing, frame)
    assert signing.counts == {"valid": 1, "replayed": 1, "forged": 1, "exempt": 1, "unsigned": 1}


def test_more_streams_than_can_be_remembered_let_no_replay_in() -> None:
    signing = receiver()
    raws = [ping(pymavlink(link=number % 256, system=1 + number // 256)) for number in range(1100)]
    for raw in raws:
        verdict(signing, raw)
    assert signing.counts == {"valid": 1024, "replayed": 76}
    for raw in raws:
        assert not verdict(signing, raw)[0]


def test_streams_silent_for_more_than_a_minute_make_room_for_new_ones() -> None:
    clock = Clock()
    signing = Signing(key=KEY, clock=clock)
    raws = [ping(pymavlink(link=number % 256, system=1 + number // 256)) for number in range(1024)]
    for raw in raws:
        verdict(signing, raw)
    clock.now += 61.0
    assert verdict(signing, ping(pymavlink(timestamp=TICKS + MINUTE, system=100))) == (True, "valid")
    assert verdict(signing, raws[0]) == (False, "stale")


# -- our timestamp -------------------------------------------------------------------------------------------------


def timestamp_of(signed: bytes) -> int:
    return int.from_bytes(signed[-12:-6], "little")


def test_timestamps_are_the_clocks_and_rise_where_it_stands_or_goes_back() -> None:
    clock = Clock()
    signing = Signing(key=KEY, clock=clock)
    sent = [timestamp_of(signing.sign(b"frame", 0)) for _ in range(3)]
    clock.now -= 1000.0
    sent.append(timestamp_of(signing.sign(b"frame", 0)))
    clock.now += 1001.0
    sent.append(timestamp_of(signing.sign(b"frame", 0)))
    assert sent == [TICKS, TICKS + 1, TICKS + 2, TICKS + 3, TICKS + 100_000]


def test_an_accepted_frame_that_is_ahead_takes_our_timestamp_along() -> None:
    signing = receiver()
    assert verdict(signing, ping(pymavlink(timestamp=TICKS + 10 * MINUTE)))[0]
    assert timestamp_of(signing.sign(b"frame", 0)) == TICKS + 10 * MINUTE + 1


def test_the_last_timestamp_there_is_breaks_nothing() -> None:
    signing = receiver()
    assert verdict(signing, ping(pymavlink(timestamp=(1 << 48) - 1)))[0]
    assert timestamp_of(signing.sign(b"frame", 0)) == (1 << 48) - 1


@pytest.mark.parametrize("key", [b"", bytes(31), bytes(32), bytes(33), KEY + b"\0"])
def test_a_key_that_is_none_is_refused_and_the_old_one_stays(key: bytes) -> None:
    signing = receiver()
    with pytest.raises(ValueError, match="expected 32 bytes"):
        signing.set_key(key)
    assert verdict(signing, ping(pymavlink())) == (True, "valid")


def test_an_initial_timestamp_takes_ours_along_but_none_that_would_lock_everybody_out() -> None:
    signing = Signing(clock=Clock())
    signing.set_key(KEY, TICKS + MINUTE)
    assert signing.timestamp == TICKS + MINUTE
    signing.set_key(KEY, 0)
    assert signing.timestamp == TICKS + MINUTE
    for absurd in (TICKS + 400 * 86400 * 100_000, (1 << 48) - 1, (1 << 64) - 1):
        with pytest.raises(ValueError, match="up to a year ahead"):
            signing.set_key(OTHER_KEY, absurd)
    assert verdict(signing, ping(pymavlink())) == (True, "valid")


def test_turned_off_and_on_with_the_same_key_replays_stay_replays() -> None:
    signing = receiver()
    raw = ping(pymavlink())
    verdict(signing, raw)
    signing.set_key(None)
    signing.set_key(KEY)
    assert verdict(signing, raw) == (False, "replayed")
    signing.set_key(OTHER_KEY)
    assert verdict(signing, ping(pymavlink(OTHER_KEY))) == (True, "valid")


# -- what outlives the run -----------------------------------------------------------------------------------------


def test_key_and_timestamp_outlive_the_run_for_the_owners_eyes_only(tmp_path: Path) -> None:
    with StateFolder(tmp_path) as state:
        signing = Signing(state, KEY, clock=Clock())
        last = timestamp_of(signing.sign(b"frame", 0))
        signing.close()
        assert stat.S_IMODE((tmp_path / "signing").stat().st_mode) == 0o600
        again = Signing(state, clock=Clock(NOW - 1e6))
        assert again.is_on
        assert timestamp_of(again.sign(b"frame", 0)) == last + 1


def test_after_a_crash_no_timestamp_is_used_twice_even_if_the_clock_was_set_back(tmp_path: Path) -> None:
    clock = Clock()
    with StateFolder(tmp_path) as state:
        signing = Signing(state, KEY, clock=clock)
        signing.save()
        clock.now += SAVE_PERIOD
        last = timestamp_of(signing.sign(b"frame", 0))
        again = Signing(state, clock=Clock(NOW - 1e6))
        assert timestamp_of(again.sign(b"frame", 0)) > last
        assert again.timestamp - TICKS <= MARGIN + 1


def test_a_given_key_goes_before_the_stored_one(tmp_path: Path) -> None:
    with StateFolder(tmp_path) as state:
        Signing(state, OTHER_KEY, clock=Clock()).close()
        signing = Signing(state, KEY, clock=Clock())
        assert verdict(signing, ping(pymavlink(timestamp=TICKS + 1))) == (True, "valid")


@pytest.mark.parametrize("content", [b"", b"{", b"[]", b'{"key":null}', b'{"key":"AAAA","timestamp":0}',
                                     b'{"key":null,"timestamp":-1}'])  # fmt: skip
def test_a_damaged_file_is_refused_in_one_line_and_nobody_is_let_in(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "signing").write_bytes(content)
    with StateFolder(tmp_path) as state, pytest.raises(SigningError, match=rf"{tmp_path}/signing: expected .* got"):
        Signing(state)


# -- logs ----------------------------------------------------------------------------------------------------------


def test_a_log_gets_frames_without_signature_and_no_key() -> None:
    plain = mav.MAVLink(None, 255, 190)
    assert for_log(ping(pymavlink()), mav.MAVLINK_MSG_ID_PING) == ping(plain)
    assert for_log(ping(plain), mav.MAVLINK_MSG_ID_PING) == ping(plain)
    setup = mav.MAVLink_setup_signing_message(1, 1, list(KEY), TICKS)
    assert for_log(bytes(setup.pack(plain)), mav.MAVLINK_MSG_ID_SETUP_SIGNING) is None
    unknown = bytearray(ping(pymavlink()))
    unknown[7:10] = b"\xff\xff\xff"
    assert for_log(bytes(unknown), 0xFFFFFF) is None
