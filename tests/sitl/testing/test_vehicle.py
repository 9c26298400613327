"""A vehicle for tests, end to end: a real process, the wire, pymavlink as the client."""

import os
import select
import signal
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from pymavlink import mavutil
from pymavlink.dialects.v20 import all as mav

from sitl.testing import SitlError, SitlVehicle

DEADLINE = 30.0  # [s]


@pytest.fixture(scope="module")
def shared() -> Iterator[SitlVehicle]:
    """A vehicle in level flight for the tests that leave it as it was."""
    with SitlVehicle(at="trim:20", seed=5, system_id=7) as vehicle:
        yield vehicle


@pytest.fixture
def cruising(shared: SitlVehicle) -> Iterator[SitlVehicle]:
    yield shared
    shared.wire.restore()


def ask(connection: Any, message: int = mav.MAVLINK_MSG_ID_SYSTEM_TIME) -> None:
    connection.mav.command_long_send(
        connection.target_system, 1, mav.MAV_CMD_REQUEST_MESSAGE, 0, message, *[0.0] * 6
    )  # fmt: skip


def heard(connection: Any, kind: str, condition: Callable[[Any], bool] = lambda _: True) -> Any:
    end = time.monotonic() + DEADLINE
    while time.monotonic() < end:
        message = connection.recv_match(type=kind, blocking=True, timeout=1.0)
        if message is not None and condition(message):
            return message
    pytest.fail(f"no {kind} as expected within {DEADLINE} s")


def wait_until(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + DEADLINE
    while not condition():
        assert time.monotonic() < end
        select.select([], [], [], 0.01)


def is_gone(pid: int) -> bool:
    """Whether a process has ended; one that nobody waited for counts, too."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except FileNotFoundError:
        return True
    return state == "Z"


def test_every_way_to_connect_leads_to_the_vehicle(cruising: SitlVehicle) -> None:
    assert cruising.mavsdk == cruising.connection.replace("udpin:", "udpin://") == f"udpin://127.0.0.1:{cruising.port}"
    assert cruising.mavsdk_out == f"udpout://127.0.0.1:{cruising.port_out}"
    for text in (cruising.connection, cruising.connection_out):
        connection: Any = mavutil.mavlink_connection(text)
        try:
            connection.mav.heartbeat_send(mav.MAV_TYPE_GCS, mav.MAV_AUTOPILOT_INVALID, 0, 0, 0)
            assert heard(connection, "HEARTBEAT").get_srcSystem() == 7
            ask(connection)
            assert heard(connection, "COMMAND_ACK").result == mav.MAV_RESULT_ACCEPTED
        finally:
            connection.close()


def test_connect_gives_a_connection_that_knows_the_vehicle(cruising: SitlVehicle) -> None:
    connection = cruising.connect(source_system=201)
    assert connection.target_system == 7
    ask(connection)
    assert heard(connection, "COMMAND_ACK", lambda ack: ack.target_system == 201).command == 512


def test_an_answer_lost_on_the_wire_is_missed_and_the_next_arrives(cruising: SitlVehicle) -> None:
    connection = cruising.connect(source_system=202)
    cruising.wire.drop(messages="COMMAND_ACK", count=1)
    ask(connection)
    ask(connection)
    heard(connection, "COMMAND_ACK", lambda ack: ack.target_system == 202)
    assert connection.recv_match(type="COMMAND_ACK") is None
    sent = cruising.wire.messages("COMMAND_LONG")
    assert [message.get_srcSystem() for message in sent].count(202) == 2


def test_a_denied_command_gets_its_answer_from_the_wire(cruising: SitlVehicle) -> None:
    connection = cruising.connect(source_system=203)
    with cruising.wire.deny("REQUEST_MESSAGE", "FAILED"):
        ask(connection)
        answer = heard(connection, "COMMAND_ACK", lambda ack: ack.target_system == 203)
        assert answer.result == mav.MAV_RESULT_FAILED
        assert answer.get_srcSystem() == 7
    ask(connection)
    answer = heard(connection, "COMMAND_ACK", lambda ack: ack.target_system == 203)
    assert answer.result == mav.MAV_RESULT_ACCEPTED


def test_a_reset_begins_anew_where_and_how_it_is_asked_whatever_the_wire_does(cruising: SitlVehicle) -> None:
    connection = cruising.connect(source_system=204)
    cruising.wire.deny()
    cruising.wire.drop(0.9)
    cruising.reset("ground", heading=90.0, place=(47.41, 8.55))
    cruising.wire.restore()
    ask(connection)
    heard(connection, "COMMAND_ACK", lambda ack: ack.target_system == 204)  # older messages have been read now
    place = heard(connection, "GLOBAL_POSITION_INT")
    assert place.time_boot_ms < 10_000
    assert (place.lat, place.lon) == pytest.approx((47.41e7, 8.55e7), abs=100)
    assert place.relative_alt == pytest.approx(0.0, abs=1000)
    assert place.hdg == pytest.approx(9000, abs=100)

    cruising.reset("trim:25", height=150.0)
    ask(connection)
    heard(connection, "COMMAND_ACK", lambda ack: ack.target_system == 204)
    assert heard(connection, "VFR_HUD").airspeed == pytest.approx(25.0, abs=2.0)
    assert heard(connection, "GLOBAL_POSITION_INT").relative_alt == pytest.approx(150e3, abs=5e3)

    cruising.reset()
    ask(connection)
    heard(connection, "COMMAND_ACK", lambda ack: ack.target_system == 204)
    assert heard(connection, "VFR_HUD").airspeed == pytest.approx(20.0, abs=2.0)


def test_resets_in_a_row_are_each_done_once(cruising: SitlVehicle) -> None:
    before = cruising.log.count("Restarted: ")
    for _ in range(5):
        cruising.reset()
    end = time.monotonic() + 10.0
    while cruising.log.count("Restarted: ") < before + 5:  # it is done before it is printed
        assert time.monotonic() < end
    assert cruising.log.count("Restarted: ") == before + 5


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ({"start": "trim:500"}, "MAV_RESULT_FAILED not restarted: trim:500"),
        ({"start": "up"}, 'reset: expected "ground", "trim:AIRSPEED" or None, got .up.'),
        ({"start": None, "heading": 90.0}, "reset: expected a start"),
        ({"start": "ground", "heading": float("inf")}, "MAV_CMD_USER_2 with .* MAV_RESULT_DENIED restart: expected"),
    ],
)
def test_a_reset_that_cannot_be_says_why(cruising: SitlVehicle, arguments: Any, expected: str) -> None:
    with pytest.raises(SitlError, match=expected):
        cruising.reset(**arguments)


def test_its_log_is_what_the_process_printed(cruising: SitlVehicle) -> None:
    wait_until(lambda: "Tilt-wing, system 7: level flight at 20 m/s" in cruising.log)


def test_a_stopped_vehicle_is_silent_and_a_restarted_one_is_another_at_the_same_place() -> None:
    with SitlVehicle() as vehicle:
        connection, first = vehicle.connect(), vehicle.pid
        vehicle.stop()
        assert not vehicle.is_running
        while connection.recv_msg() is not None or select.select([connection.port], [], [], 0.0)[0]:
            pass
        assert first is not None
        assert is_gone(first)
        with pytest.raises(SitlError, match="does not run any more"):
            vehicle.reset()
        vehicle.restart()
        assert heard(connection, "ATTITUDE").time_boot_ms < 5000
        last = vehicle.pid
        assert last != first
        vehicle.start()
        assert vehicle.pid == last
        wait_until(lambda: vehicle.log.count("Tilt-wing, system 1") == 2)
    assert last is not None
    assert is_gone(last)
    assert vehicle.log.count("Tilt-wing, system 1") == 2


def test_a_vehicle_that_cannot_start_says_why_in_the_error(tmp_path: Path) -> None:
    with (
        pytest.raises(SitlError, match=r"(?s)exit code 2 before its first HEARTBEAT.*--at=there.is.none.*no such file"),
        SitlVehicle(at="there.is.none"),
    ):
        pass
    wrong = tmp_path / "wrong.toml"
    wrong.write_text("colour = 1\n")
    with pytest.raises(SitlError, match=r"wrong\.toml: .*colour"), SitlVehicle(scenario=wrong):
        pass


def test_a_vehicle_that_ends_by_itself_is_an_error_when_it_is_closed() -> None:
    vehicle = SitlVehicle().start()
    assert vehicle.pid is not None
    wait_until(lambda: "Tilt-wing, system 1" in vehicle.log)  # it flies before it prints
    os.kill(vehicle.pid, signal.SIGKILL)
    wait_until(lambda: not vehicle.is_running)
    with pytest.raises(SitlError, match=r"(?s)ended by itself with exit code -9.*Tilt-wing, system 1"):
        vehicle.reset()
    with pytest.raises(SitlError, match=r"(?s)ended by itself with exit code -9.*Tilt-wing, system 1"):
        vehicle.close()
    vehicle.close()


def test_a_vehicle_that_has_ended_can_be_started_again_and_leaves_nothing_open() -> None:
    before = threading.active_count()
    with SitlVehicle(arguments=["--duration", "0.1"]) as vehicle:
        wait_until(lambda: not vehicle.is_running)
        vehicle.start()
        wait_until(lambda: not vehicle.is_running)
    assert threading.active_count() == before


def test_a_flight_that_ends_as_planned_is_no_error() -> None:
    with SitlVehicle(speed="max", arguments=["--duration", "1"]) as vehicle:
        wait_until(lambda: not vehicle.is_running)
    assert "Flew 1.00 s" in vehicle.log


def test_a_vehicle_that_does_not_heed_sigterm_is_killed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sitl.testing.process.GRACE", 0.2)
    vehicle = SitlVehicle().start()
    assert vehicle.pid is not None
    os.kill(vehicle.pid, signal.SIGSTOP)
    vehicle.close()
    assert is_gone(vehicle.pid)


def test_identity_speed_and_parameters_are_those_of_the_vehicle() -> None:
    with SitlVehicle(identity="ardupilot", speed=20, params={"MIS_TAKEOFF_ALT": 37.5}) as vehicle:
        assert vehicle.speed == 20.0
        connection = vehicle.connect()
        connection.mav.param_request_read_send(1, 1, b"MIS_TAKEOFF_ALT", -1)
        assert heard(connection, "PARAM_VALUE").param_value == 37.5
        first = heard(connection, "SYSTEM_TIME")
        later = heard(connection, "SYSTEM_TIME", lambda message: message.time_boot_ms > first.time_boot_ms)
        flown = later.time_boot_ms - first.time_boot_ms
        assert flown > 5 * (later._timestamp - first._timestamp) * 1e3  # how far a busy machine falls behind: unknown
        autopilot = heard(connection, "HEARTBEAT", lambda message: message.get_srcSystem() == 1).autopilot
        assert autopilot == mav.MAV_AUTOPILOT_ARDUPILOTMEGA


def test_several_vehicles_can_share_a_clients_port() -> None:
    with SitlVehicle(system_id=1) as first, SitlVehicle(system_id=2, port=first.port) as second:
        assert second.port == first.port
        ground: Any = mavutil.mavlink_connection(first.connection)
        try:
            for system in (1, 2):
                heard(ground, "HEARTBEAT", lambda message, system=system: message.get_srcSystem() == system)
        finally:
            ground.close()
