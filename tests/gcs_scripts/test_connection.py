"""Finding one vehicle among others, and losing it; with real vehicles, and a peer for what ours never does."""

import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Any

import pytest
from pymavlink.dialects.v20 import all as mav

from gcs_scripts.connection import SILENCE, connect, message_id
from gcs_scripts.errors import GroundError, LinkLostError, RefusedError, UnansweredError

Vehicle = Callable[..., AbstractContextManager[str]]
PeerStarter = Callable[..., AbstractContextManager[Any]]
Port = Callable[[], int]


def test_of_several_vehicles_the_one_asked_for_is_found_and_only_it_is_heard(vehicle: Vehicle, free_port: Port) -> None:
    link = f"udpout:127.0.0.1:{free_port()}"
    with (
        vehicle("--sysid", "3", link=link),
        vehicle("--sysid", "7", link=link),
        connect(link.replace("udpout", "udpin"), system=7, timeout=30.0) as craft,
    ):
        assert (craft.system, craft.component) == (7, 1)
        others: set[int] = set()
        craft.on_message.append(
            lambda message: others.add(message.get_srcSystem()) if message.get_type() == "HEARTBEAT" else None
        )
        end = time.monotonic() + 20.0
        while others != {3, 7} and time.monotonic() < end:
            message = craft.receive("ATTITUDE", 1.0)
            assert message is None or message.get_srcSystem() == 7
        assert others == {3, 7}


def test_a_system_that_is_not_there_is_named(vehicle: Vehicle) -> None:
    missing = pytest.raises(LinkLostError, match="no vehicle with system id 9 on udpin")
    with vehicle("--sysid", "3") as link, missing, connect(link, system=9, timeout=2.0):
        pass


def test_the_end_of_a_tcp_connection_is_the_end_of_the_link(
    vehicle: Vehicle, free_port: Port, capfd: pytest.CaptureFixture[str]
) -> None:
    place = f"127.0.0.1:{free_port()}"
    with (
        vehicle("--duration", "2", link=f"tcpin:{place}"),
        connect(f"tcp:{place}", timeout=30.0) as craft,
        pytest.raises(LinkLostError, match="the other end has closed the connection"),
    ):
        craft.listen(30.0)
    assert "EOF" not in capfd.readouterr().out  # pymavlink's own word for it, which would repeat for ever


def test_nobody_who_accepts_a_tcp_connection_is_no_vehicle(free_port: Port) -> None:
    with pytest.raises(LinkLostError, match="nobody accepts"), connect(f"tcp:127.0.0.1:{free_port()}", timeout=0.3):
        pass


@pytest.mark.parametrize(
    "text", ["", "udpin:127.0.0.1", "udpin::14550", "udpin:127.0.0.1:0", "serial:/dev/x:1", "x.log"]
)
def test_a_string_that_is_no_connection_is_refused_with_those_that_are(text: str) -> None:
    with pytest.raises(GroundError, match="--connect: expected udpin"), connect(text):
        pass


def test_companions_and_ground_stations_are_not_taken_for_the_vehicle(peer: PeerStarter, free_port: Port) -> None:
    port = free_port()
    link = f"udpin:127.0.0.1:{port}"
    with peer(port, system=2, kind=mav.MAV_TYPE_GCS, autopilot=mav.MAV_AUTOPILOT_INVALID):
        with pytest.raises(LinkLostError), connect(link, timeout=0.5):
            pass
        with peer(port, system=5), connect(link) as craft:
            assert craft.system == 5


def test_we_are_255_190_and_say_so_once_a_second_in_mavlink_2(peer: PeerStarter, free_port: Port) -> None:
    port = free_port()
    with peer(port) as other, connect(f"udpin:127.0.0.1:{port}") as craft:
        craft.listen(0.2)
        other.heard.clear()
        begin = time.monotonic()
        craft.listen(3.2)
        beats = [message for message in other.heard if message.get_type() == "HEARTBEAT"]
        assert abs(len(beats) - (time.monotonic() - begin)) <= 1.3
        for beat in beats:
            assert (beat.get_srcSystem(), beat.get_srcComponent()) == (255, 190)
            assert beat.get_msgbuf()[0] == mav.PROTOCOL_MARKER_V2
            assert (beat.type, beat.autopilot) == (mav.MAV_TYPE_GCS, mav.MAV_AUTOPILOT_INVALID)


def test_a_command_is_repeated_with_its_count_until_its_own_acknowledgement_and_waits_while_in_progress(
    peer: PeerStarter, free_port: Port
) -> None:
    port = free_port()
    command = mav.MAV_CMD_PREFLIGHT_CALIBRATION
    confirmations: list[int] = []
    with peer(port) as other, connect(f"udpin:127.0.0.1:{port}") as craft:

        def answer(message: Any) -> None:
            # On connecting it has asked for a heartbeat, too.
            if message.get_type() != "COMMAND_LONG" or message.command != command:
                return
            confirmations.append(message.confirmation)
            assert (message.target_system, message.target_component) == (1, 1)
            other.mav.command_ack_send(command, mav.MAV_RESULT_FAILED, 0, 0, 42, 7)  # somebody else's
            other.mav.command_ack_send(mav.MAV_CMD_DO_SET_MODE, mav.MAV_RESULT_FAILED, 0, 0, 255, 190)
            if len(confirmations) == 3:
                other.mav.command_ack_send(command, mav.MAV_RESULT_IN_PROGRESS, 50, 0, 255, 190)
                other.mav.command_ack_send(command, mav.MAV_RESULT_ACCEPTED, 0, 0, 255, 190)

        other.answer = answer
        craft.command(command, 1, name="calibration")
    assert confirmations == [0, 1, 2]


def test_a_refusal_carries_what_the_vehicle_says_and_an_answer_that_misses_is_told_from_a_lost_link(
    peer: PeerStarter, free_port: Port
) -> None:
    port = free_port()
    with peer(port) as other, connect(f"udpin:127.0.0.1:{port}") as craft:

        def refuse(message: Any) -> None:
            if message.get_type() == "COMMAND_LONG" and message.command == mav.MAV_CMD_DO_SET_HOME:
                other.mav.command_ack_send(message.command, mav.MAV_RESULT_DENIED, 0, 0, 255, 190)
                other.mav.statustext_send(mav.MAV_SEVERITY_WARNING, b"no position yet")

        other.answer = refuse
        with pytest.raises(RefusedError, match=r"^system 1 refuses a new home: DENIED \(no position yet\)$"):
            craft.command(mav.MAV_CMD_DO_SET_HOME, name="a new home")
        craft.timeout = 0.6
        with pytest.raises(UnansweredError, match=r"^system 1 does not answer a dance within 0\.6 s$"):
            craft.command(mav.MAV_CMD_USER_5, name="a dance")
        other.is_silent = True
        craft.timeout = SILENCE + 0.5
        with pytest.raises(LinkLostError, match="has fallen silent"):
            craft.command(mav.MAV_CMD_USER_5, name="a dance")


def test_every_message_that_is_asked_for_has_its_number() -> None:
    assert (message_id("HIL_STATE_QUATERNION"), message_id("CURRENT_MODE")) == (115, 436)
