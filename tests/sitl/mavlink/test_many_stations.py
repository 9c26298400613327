"""Many ground stations at once, on UDP and TCP, some of which do not listen: the others miss nothing."""

import socket
import time
from collections.abc import Callable, Iterator

import pytest

from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.face import MavlinkFace
from sitl.mavlink.links import Link, Peer
from sitl.simulation import Simulation
from tests.sitl.mavlink.conftest import DEADLINE, free_port
from tests.sitl.mavlink.crowd import Listener, greeting, request

SECONDS = 10.0  # of telemetry
RATE = 100  # turns in a second
FAST = 2500  # [us]
MANY = 2000  # messages that found a connection full


class Crowd:
    """A vehicle with a UDP and a TCP port, and stations on both; wall time is invented."""

    def __init__(self, *, udp: int, tcp: int) -> None:
        ports = free_port(), free_port()
        self.links = f"udpin:127.0.0.1:{ports[0]}", f"tcpin:127.0.0.1:{ports[1]}"
        self.simulation = Simulation()
        self.face = MavlinkFace(self.links, self.simulation)
        self.wall = self.face.wall_time
        self.ports = {"udp": ports[0], "tcp": ports[1]}
        self.everybody: list[Listener] = []
        self.listeners = [self.join("udp", 100 + number) for number in range(udp)]
        self.listeners += [self.join("tcp", 150 + number) for number in range(tcp)]

    def join(self, kind: str, system: int, **options: int) -> Listener:
        """One more station, which the vehicle has heard; it listens only if it is among the listeners."""
        heard = self.heard
        self.everybody.append(Listener(kind, self.ports[kind], system, **options))
        self.until_heard(heard + 1)
        return self.everybody[-1]

    @property
    def heard(self) -> int:
        """Messages that the vehicle has taken in."""
        return sum(counts["rx"] for counts in self.face.statistics().values())

    def until_heard(self, messages: int) -> None:
        """Let the vehicle take in so many messages."""
        end = time.monotonic() + DEADLINE
        while self.heard < messages:
            assert time.monotonic() < end
            self.face.receive(self.wall)

    def fill(self, listener: Listener) -> tuple[Link, Peer]:
        """Send to a station on TCP that does not read until its connection takes no more; returns that."""
        self.fly(0.1)
        link, telemetry = self.face.links[1], self.face.telemetry(mav.MAVLINK_MSG_ID_ATTITUDE)
        connection = next(peer for peer in link.peers if peer.address == listener.socket.getsockname())
        assert telemetry is not None
        end = time.monotonic() + DEADLINE
        while link.dropped < MANY:  # the first refusals are not the last: what is under way makes room once more
            link.send(connection, [telemetry] * 20)
            assert time.monotonic() < end
        return link, connection

    def fly(self, seconds: float) -> None:
        """Publish and serve; everybody who listens does so all the time."""
        for _ in range(round(seconds * RATE)):
            self.simulation.advance(1.0 / RATE)
            self.wall += 1.0 / RATE
            self.face.publish(self.simulation.snapshot(), self.wall)
            self.face.receive(self.wall)
            self.face.attend(self.wall)
            for listener in self.listeners:
                listener.listen()

    def until_silent(self) -> None:
        """Let the last of what is under way arrive."""
        end = time.monotonic() + DEADLINE
        before: list[int] = []
        while before != (before := [listener.heard for listener in self.listeners]):
            assert time.monotonic() < end
            for listener in self.listeners:
                listener.listen()


@pytest.fixture
def crowd() -> Iterator[Callable[..., Crowd]]:
    made: list[Crowd] = []

    def make(*, udp: int, tcp: int) -> Crowd:
        made.append(Crowd(udp=udp, tcp=tcp))
        return made[-1]

    yield make
    for one in made:
        one.face.close()
        for listener in one.everybody:
            listener.socket.close()


def test_ten_stations_miss_nothing_while_one_never_reads_and_one_has_gone(crowd: Callable[..., Crowd]) -> None:
    one = crowd(udp=5, tcp=3)
    link, _ = one.fill(one.join("tcp", 200, receive_buffer=4096))
    one.join("udp", 201).socket.close()
    for message in (mav.MAVLINK_MSG_ID_ATTITUDE, mav.MAVLINK_MSG_ID_ODOMETRY):
        one.listeners[0].socket.send(request(100, mav.MAV_CMD_SET_MESSAGE_INTERVAL, message, FAST))
    dropped = link.dropped
    one.fly(SECONDS)
    one.until_silent()
    assert [listener.missed for listener in one.listeners] == [0] * 8
    assert min(listener.heard for listener in one.listeners) > 400 * SECONDS
    assert link.dropped > dropped
    assert one.face.internal_errors == 0


def test_a_station_that_never_reads_costs_no_memory_and_its_messages_are_counted(crowd: Callable[..., Crowd]) -> None:
    one = crowd(udp=1, tcp=1)
    link, connection = one.fill(one.join("tcp", 200, receive_buffer=4096))
    dropped, end = link.dropped, time.monotonic() + DEADLINE
    while link.dropped < dropped + 500:
        assert time.monotonic() < end
        one.fly(1.0)
    one.until_silent()
    assert len(getattr(connection, "unsent")) <= link.max_datagram  # noqa: B009  (of TCP connections only)
    assert [listener.missed for listener in one.listeners] == [0, 0]


def test_a_station_whose_datagrams_fill_its_socket_leaves_the_others_alone(crowd: Callable[..., Crowd]) -> None:
    one = crowd(udp=3, tcp=0)
    deaf = one.join("udp", 200, receive_buffer=2048)
    one.fly(2.0)
    one.until_silent()
    deaf.listen()
    assert deaf.heard < 400
    assert [listener.missed for listener in one.listeners] == [0, 0, 0]


def test_sixteen_stations_are_served_on_a_port_and_the_quietest_makes_room_for_one_more(
    crowd: Callable[..., Crowd],
) -> None:
    one = crowd(udp=16, tcp=0)
    one.wall += 5.0
    for listener in one.listeners[1:]:
        listener.socket.send(greeting(listener.system))
    one.until_heard(31)
    one.listeners.append(one.join("udp", 201))
    before = [listener.heard for listener in one.listeners]
    one.fly(1.0)
    one.until_silent()
    news = [listener.heard - count for listener, count in zip(one.listeners, before, strict=True)]
    assert news[0] == 0
    assert min(news[1:]) > 300
    assert [listener.missed for listener in one.listeners] == [0] * 17


def test_a_closed_port_is_no_error_and_a_station_there_again_is_served() -> None:
    port = free_port()
    simulation = Simulation()
    with MavlinkFace([f"udpout:127.0.0.1:{port}"], simulation) as face:
        wall = face.wall_time
        for turn in range(50):
            simulation.advance(0.02)
            face.publish(simulation.snapshot(), wall + 0.02 * turn)
            face.receive(wall)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as late:
            late.bind(("127.0.0.1", port))
            late.settimeout(DEADLINE)
            simulation.advance(0.02)
            face.publish(simulation.snapshot(), wall + 2.0)
            assert late.recv(2048)
    assert face.internal_errors == 0
