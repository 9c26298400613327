"""SETUP_SIGNING, and a vehicle that signs: https://mavlink.io/en/guide/message_signing.html."""

import hashlib
import time
from pathlib import Path

import pytest

from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.signing import MARGIN, SAVE_PERIOD, Signing
from sitl.mavlink.state_folder import StateFolder
from tests.sitl.mavlink.in_memory import Desk, MemoryLink, Station

KEY = hashlib.sha256(b"a passphrase").digest()
OTHER_KEY = hashlib.sha256(b"another one").digest()
REQUEST = mav.MAV_CMD_REQUEST_MESSAGE
VERSION = mav.MAVLINK_MSG_ID_PROTOCOL_VERSION


def now() -> int:
    """A timestamp: 10 us since 2015."""
    return int((time.time() - 1420070400) * 1e5)


def use(station: Station, key: bytes) -> None:
    """Let pymavlink sign all that a station sends, and believe nothing else."""
    signing = station.mav.signing
    signing.secret_key, signing.timestamp, signing.sign_outgoing = key, now(), True


def set_up(station: Station, key: bytes = KEY) -> None:
    """What `signing setup` of MAVProxy does."""
    station.send("SETUP_SIGNING", secret_key=list(key), initial_timestamp=now())
    use(station, key)


def texts(station: Station) -> list[str]:
    return [message.text for message in station.of("STATUSTEXT")]


def is_served(station: Station) -> bool:
    return station.command(REQUEST, VERSION) is not None


def test_after_setup_signing_all_is_signed_and_only_the_key_holder_is_heard(desk: Desk) -> None:
    stranger = desk.join(system=200)
    set_up(desk.station)
    assert "Message signing on" in texts(stranger)
    desk.received.clear()
    assert is_served(desk.station)
    desk.advance(1.0)
    assert desk.of("BAD_DATA") == []
    assert all(message.get_signed() for message in desk.received)
    assert not is_served(stranger)
    assert stranger.of("ATTITUDE")  # told, though not heard
    assert desk.links[0].rejected == 1


def test_an_all_zero_key_turns_signing_off(desk: Desk) -> None:
    stranger = desk.join(system=200)
    set_up(desk.station)
    assert not is_served(stranger)
    desk.send("SETUP_SIGNING", secret_key=[0] * 32, initial_timestamp=0)
    assert is_served(stranger)
    assert "Message signing off" in texts(stranger)


def test_once_there_is_a_key_only_its_holder_or_a_trusted_link_changes_it() -> None:
    links = [MemoryLink(), MemoryLink("usb", trusted=True)]
    desk = Desk(links=links)
    stranger, on_usb = desk.join(system=200), desk.join(system=201, link=1)
    set_up(desk.station)
    stranger.send("SETUP_SIGNING", secret_key=list(OTHER_KEY), initial_timestamp=now())
    assert is_served(desk.station)
    on_usb.send("SETUP_SIGNING", secret_key=list(OTHER_KEY), initial_timestamp=now())
    assert not is_served(desk.station)
    use(desk.station, OTHER_KEY)
    assert is_served(desk.station)
    desk.close()


def test_setup_signing_is_refused_while_armed(desk: Desk) -> None:
    desk.simulation.flight.arm(force=True)
    desk.send("SETUP_SIGNING", secret_key=list(KEY), initial_timestamp=now())
    assert texts(desk.station)[-1] == "Signing not changed: only while disarmed"
    assert is_served(desk.station)


@pytest.mark.parametrize("timestamp", [(1 << 64) - 1, (1 << 48) - 1])
def test_an_absurd_initial_timestamp_is_refused_with_a_text(desk: Desk, timestamp: int) -> None:
    desk.send("SETUP_SIGNING", secret_key=list(KEY), initial_timestamp=timestamp)
    assert "".join(texts(desk.station)).startswith("Signing not changed: signing timestamp: expected one up to a year")
    assert is_served(desk.station)


def test_the_key_set_over_a_link_is_there_again_in_the_next_run(tmp_path: Path) -> None:
    with StateFolder(tmp_path) as state:
        desk = Desk(state=state, signing=Signing(state))
        set_up(desk.station)
        desk.close()
    with StateFolder(tmp_path) as state:
        desk = Desk(state=state, signing=Signing(state))
        assert not is_served(desk.station)
        use(desk.station, KEY)
        assert is_served(desk.station)
        desk.send("SETUP_SIGNING", secret_key=[0] * 32, initial_timestamp=0)
        desk.close()
    with StateFolder(tmp_path) as state:
        assert not Signing(state).is_on


def test_the_timestamp_is_stored_again_and_again(tmp_path: Path) -> None:
    utc = 1.8e9
    with StateFolder(tmp_path) as state:
        desk = Desk(state=state, signing=Signing(state, KEY, clock=lambda: utc))
        for _ in range(3):
            utc += SAVE_PERIOD
            least = round((utc - 1420070400) * 1e5) + MARGIN
            deadline = time.monotonic() + 10.0
            while Signing(state, clock=lambda: 0.0).timestamp < least:
                assert time.monotonic() < deadline, "it never was"
                desk.wait(1.0)  # the disk has a thread of its own, and time here is invented
        desk.close()


def test_a_key_that_cannot_be_stored_is_used_and_the_pilot_is_told_once(tmp_path: Path) -> None:
    with StateFolder(tmp_path) as state:
        desk = Desk(state=state, signing=Signing(state))
        (tmp_path / "signing.new").mkdir()
        set_up(desk.station)
        assert is_served(desk.station)
        desk.wait(2 * SAVE_PERIOD + 1.0)
        said = "".join(texts(desk.station))
        assert said.count("Signing key not stored") == 1
        desk.close()
