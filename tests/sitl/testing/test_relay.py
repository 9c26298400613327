"""The wire's sockets: clients of both kinds at one side, a vehicle at the other, over real UDP."""

import select
import socket
import threading
import time
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from pymavlink import mavutil
from pymavlink.dialects.v20 import all as mav

from sitl.testing.ports import reserve_port
from sitl.testing.relay import Relay
from sitl.testing.wire import Wire

DEADLINE = 10.0  # [s]
LOOPBACK = "127.0.0.1"


class Vehicle:
    """What the relay sees of a vehicle: sends to one port from its own, and hears what comes back."""

    def __init__(self, port: int) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind((LOOPBACK, 0))
        self.socket.settimeout(DEADLINE)
        self.mav: Any = mav.MAVLink(None, 1, 1)
        self._port = port

    def send(self, message: Any) -> None:
        self.socket.sendto(message.pack(self.mav), (LOOPBACK, self._port))

    def beat(self) -> None:
        self.send(mav.MAVLink_heartbeat_message(24, 12, 1, 0, 4, 3))

    def receive(self) -> Any:
        (message,) = self.mav.parse_buffer(bytearray(self.socket.recv(4096)))
        return message


@pytest.fixture
def wire() -> Wire:
    return Wire()


@pytest.fixture
def relay(wire: Wire) -> Iterator[Relay]:
    opened = Relay(wire)
    yield opened
    opened.close()


@contextmanager
def attached(relay: Relay) -> Generator[Vehicle]:
    vehicle = Vehicle(relay.attach())
    try:
        vehicle.beat()
        assert relay.heard.wait(DEADLINE)
        yield vehicle
    finally:
        vehicle.socket.close()


@contextmanager
def client(connection: str) -> Generator[Any]:
    opened: Any = mavutil.mavlink_connection(connection)
    try:
        yield opened
    finally:
        opened.close()


def test_a_client_that_listens_hears_and_is_heard(relay: Relay) -> None:
    with client(f"udpin:{LOOPBACK}:{relay.port}") as ground, attached(relay) as vehicle:
        assert ground.recv_match(type="HEARTBEAT", blocking=True, timeout=DEADLINE) is not None
        ground.mav.ping_send(0, 7, 1, 1)
        assert vehicle.receive().seq == 7


def test_a_client_that_sends_first_hears_from_then_on(relay: Relay) -> None:
    with client(f"udpout:{LOOPBACK}:{relay.port_out}") as ground, attached(relay) as vehicle:
        ground.mav.ping_send(0, 7, 1, 1)
        assert vehicle.receive().seq == 7
        vehicle.beat()
        assert ground.recv_match(type="HEARTBEAT", blocking=True, timeout=DEADLINE) is not None


def test_clients_of_both_kinds_hear_the_same_at_once(relay: Relay) -> None:
    with (
        client(f"udpin:{LOOPBACK}:{relay.port}") as listening,
        client(f"udpout:{LOOPBACK}:{relay.port_out}") as sending,
        attached(relay) as vehicle,
    ):
        sending.mav.ping_send(0, 7, 1, 1)
        vehicle.receive()
        vehicle.send(mav.MAVLink_ping_message(0, 8, 0, 0))
        for ground in (listening, sending):
            assert ground.recv_match(type="PING", blocking=True, timeout=DEADLINE).seq == 8


def test_silence_is_complete_once_it_returns(relay: Relay, wire: Wire) -> None:
    with client(f"udpin:{LOOPBACK}:{relay.port}") as ground, attached(relay) as vehicle:
        stop = threading.Event()

        def talk() -> None:
            while not stop.is_set():
                vehicle.send(mav.MAVLink_ping_message(0, 1, 0, 0))

        talking = threading.Thread(target=talk)
        talking.start()
        try:
            for _ in range(20):
                assert ground.recv_match(type="PING", blocking=True, timeout=DEADLINE) is not None
                with wire.silence():
                    while ground.recv_msg() is not None or select.select([ground.port], [], [], 0.0)[0]:
                        pass
                    assert not select.select([ground.port], [], [], 0.01)[0]
        finally:
            stop.set()
            talking.join()


def test_a_delayed_message_comes_by_itself_when_its_time_has_come(relay: Relay, wire: Wire) -> None:
    with client(f"udpin:{LOOPBACK}:{relay.port}") as ground, attached(relay) as vehicle:
        wire.delay(0.3, messages="PING")
        begin = time.monotonic()
        vehicle.send(mav.MAVLink_ping_message(0, 1, 0, 0))
        assert ground.recv_match(type="PING", blocking=True, timeout=DEADLINE) is not None
        assert time.monotonic() - begin >= 0.3


def test_what_was_sent_to_one_vehicle_does_not_reach_the_next(relay: Relay) -> None:
    with client(f"udpout:{LOOPBACK}:{relay.port_out}") as ground:
        with attached(relay) as first:
            ground.mav.ping_send(0, 1, 1, 1)
            assert first.receive().seq == 1
        relay.detach()
        ground.mav.ping_send(0, 2, 1, 1)
        with attached(relay) as second:
            ground.mav.ping_send(0, 3, 1, 1)
            assert second.receive().seq == 3


def test_only_a_heartbeat_tells_that_the_vehicle_is_there(relay: Relay) -> None:
    vehicle = Vehicle(relay.attach())
    try:
        vehicle.send(mav.MAVLink_ping_message(0, 1, 0, 0))
        vehicle.send(mav.MAVLink_attitude_message(0, 0, 0, 0, 0, 0, 0))
        end = time.monotonic() + DEADLINE
        while relay.vehicle is None and time.monotonic() < end:
            time.sleep(0)
        assert not relay.heard.is_set()
        vehicle.beat()
        assert relay.heard.wait(DEADLINE)
    finally:
        vehicle.socket.close()


def threads_and_files() -> tuple[int, int]:
    """How many threads and open files this process has; files where the system tells."""
    opened = Path("/proc/self/fd")
    return threading.active_count(), len(list(opened.iterdir())) if opened.is_dir() else 0


def test_closing_leaves_no_thread_and_no_socket(wire: Wire) -> None:
    before = threads_and_files()
    relay = Relay(wire)
    for _ in range(3):
        with attached(relay):
            pass
        relay.detach()
    relay.close()
    assert threads_and_files() == before


def test_reserved_ports_differ_and_are_free_for_udp() -> None:
    reserved = [reserve_port() for _ in range(50)]
    try:
        assert len({port for port, _ in reserved}) == 50
        for port, _ in reserved:
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listening:
                listening.bind((LOOPBACK, port))
    finally:
        for _, guard in reserved:
            guard.close()
