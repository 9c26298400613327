"""Connection strings, and links on real sockets: who is served, what is dropped, what is survived."""

import socket
import time
from collections.abc import Callable, Iterator

import pytest

from sitl.mavlink.codec import codec
from sitl.mavlink.links import MAX_DATAGRAM, PEER_SILENCE, Link, LinkError, LinkSpec, Peer, parse_link
from sitl.mavlink.tcp import TcpIn, TcpOut
from sitl.mavlink.udp import UdpIn, UdpOut

PING = codec("PING")
PAYLOAD = PING.payload((1, 2, 3, 4))
DEADLINE = 10.0


@pytest.mark.parametrize(
    ("text", "kind", "host", "port", "streams"),
    [
        ("udpout:127.0.0.1:14550", "udpout", "127.0.0.1", 14550, "normal"),
        ("udpout:127.0.0.1:14540", "udpout", "127.0.0.1", 14540, "onboard"),
        ("udpout:[::1]:14551", "udpout", "::1", 14551, "normal"),
        ("udpin:14551", "udpin", "127.0.0.1", 14551, "normal"),
        ("udpin:0.0.0.0:14551", "udpin", "0.0.0.0", 14551, "normal"),
        ("tcpin:5760", "tcpin", "127.0.0.1", 5760, "normal"),
        ("tcpin:127.0.0.1:5760,onboard", "tcpin", "127.0.0.1", 5760, "onboard"),
        ("tcpout:localhost:5760", "tcpout", "localhost", 5760, "normal"),
    ],
)
def test_connection_strings(text: str, kind: str, host: str, port: int, streams: str) -> None:
    assert parse_link(text) == LinkSpec(text, kind, host, port, streams)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("serial:/dev/ttyACM0", "got the kind 'serial'"),
        ("", "got the kind ''"),
        ("udpout:14550", "got no host"),
        ("udpin::14550", "got no host"),
        ("udpin:127.0.0.1:99999", "port from 1 to 65535, got '99999'"),
        ("udpin:127.0.0.1:0", "got '0'"),
        ("udpin:127.0.0.1:x", "got 'x'"),
        ("udpin:14550,fast", "got 'fast'"),
    ],
)
def test_a_bad_connection_string_is_one_clear_line(text: str, said: str) -> None:
    with pytest.raises(LinkError) as error:
        parse_link(text)
    line = str(error.value)
    assert repr(text) in line
    assert "expected udpout:HOST:PORT" in line
    assert said in line
    assert "\n" not in line


@pytest.fixture
def opened() -> Iterator[Callable[..., Link]]:
    links: list[Link] = []

    def make(kind: type[Link], text: str) -> Link:
        links.append(kind(parse_link(text), 1, 1))
        return links[-1]

    yield make
    for link in links:
        link.close()


def bound(kind: socket.SocketKind = socket.SOCK_DGRAM) -> socket.socket:
    made = socket.socket(socket.AF_INET, kind)
    made.bind(("127.0.0.1", 0))
    made.settimeout(DEADLINE)
    return made


def free_port() -> int:
    with bound(socket.SOCK_STREAM) as probe:
        return probe.getsockname()[1]


def received(link: Link, count: int, wall_time: float = 1000.0) -> list[tuple[Peer, bytes]]:
    """The first `count` pieces that arrive on a link, whose senders are believed."""
    end = time.monotonic() + DEADLINE
    pieces: list[tuple[Peer, bytes]] = []
    while len(pieces) < count:
        assert time.monotonic() < end, f"only {len(pieces)} of {count} pieces came"
        for peer, data in link.receive(wall_time):
            link.believe(peer, wall_time)
            pieces.append((peer, data))
    return pieces


def test_udpout_sends_from_one_port_and_answers_who_writes_there(opened: Callable[..., Link]) -> None:
    with bound() as ground, bound() as other:
        link = opened(UdpOut, f"udpout:127.0.0.1:{ground.getsockname()[1]}")
        link.send(link.audience[0], [(PING, PAYLOAD)])
        data, vehicle = ground.recvfrom(2048)
        assert data == PING.frame(PAYLOAD, 0, 1, 1)
        assert vehicle[0] == "127.0.0.1"
        other.sendto(b"hello", vehicle)
        [(peer, piece)] = received(link, 1)
        link.send(peer, [(PING, PAYLOAD)])
        answer, again = other.recvfrom(2048)
        assert (piece, answer, again) == (b"hello", PING.frame(PAYLOAD, 0, 1, 1), vehicle)
        assert [member.address for member in link.audience] == [ground.getsockname()]


def test_udpin_serves_everybody_heard_with_sequence_numbers_of_their_own_until_silent(
    opened: Callable[..., Link],
) -> None:
    port = free_port()
    link = opened(UdpIn, f"udpin:{port}")
    with bound() as first, bound() as second:
        assert link.audience == []
        first.sendto(b"a", ("127.0.0.1", port))
        received(link, 1, 1000.0)
        link.send(link.audience[0], [(PING, PAYLOAD)])
        second.sendto(b"b", ("127.0.0.1", port))
        received(link, 1, 1001.0)
        for peer in link.audience:
            link.send(peer, [(PING, PAYLOAD)])
        assert [first.recv(2048)[4], first.recv(2048)[4]] == [0, 1]
        assert second.recv(2048)[4] == 0
        link.forget_silent(1000.5 + PEER_SILENCE)
        assert [peer.address for peer in link.audience] == [second.getsockname()]


def test_many_sources_displace_the_quietest_and_never_more_are_kept(opened: Callable[..., Link]) -> None:
    port = free_port()
    link = opened(UdpIn, f"udpin:{port}")
    sockets = [bound() for _ in range(20)]
    try:
        for number, source in enumerate(sockets):
            source.sendto(b"x", ("127.0.0.1", port))
            received(link, 1, 1000.0 + number)
        assert [peer.address for peer in link.audience] == [source.getsockname() for source in sockets[-16:]]
    finally:
        for source in sockets:
            source.close()


def test_a_taken_port_is_one_clear_error(opened: Callable[..., Link]) -> None:
    with bound() as taken:
        text = f"udpin:{taken.getsockname()[1]}"
        with pytest.raises(LinkError, match="expected a free port to listen on"):
            opened(UdpIn, text)
    with bound(socket.SOCK_STREAM) as taken:
        taken.listen()
        with pytest.raises(LinkError, match="expected a free port to listen on"):
            opened(TcpIn, f"tcpin:{taken.getsockname()[1]}")


def test_an_unknown_host_is_one_clear_error(opened: Callable[..., Link]) -> None:
    with pytest.raises(LinkError, match="expected a host name or address, got 'no host'"):
        opened(UdpOut, "udpout:no host:14550")


def test_messages_share_datagrams_up_to_the_limit(opened: Callable[..., Link]) -> None:
    with bound() as ground:
        link = opened(UdpOut, f"udpout:127.0.0.1:{ground.getsockname()[1]}")
        link.send(link.audience[0], [(PING, PAYLOAD)] * 130)
        frame = len(PING.frame(PAYLOAD, 0, 1, 1))
        sizes = [len(ground.recv(65536)) for _ in range(3)]
        per_datagram = MAX_DATAGRAM // frame
        assert sizes == [per_datagram * frame, per_datagram * frame, (130 - 2 * per_datagram) * frame]
        assert link.tx == 130


def test_tcpin_serves_every_client_and_survives_their_leaving(opened: Callable[..., Link]) -> None:
    port = free_port()
    link = opened(TcpIn, f"tcpin:{port}")
    first = socket.create_connection(("127.0.0.1", port), timeout=DEADLINE)
    second = socket.create_connection(("127.0.0.1", port), timeout=DEADLINE)
    first.sendall(b"1")
    second.sendall(b"2")
    assert sorted(data for _, data in received(link, 2)) == [b"1", b"2"]
    for peer in link.audience:
        link.send(peer, [(PING, PAYLOAD)])
    assert first.recv(2048) == second.recv(2048) == PING.frame(PAYLOAD, 0, 1, 1)
    first.close()
    end = time.monotonic() + DEADLINE
    while len(link.audience) > 1:
        assert time.monotonic() < end
        list(link.receive(0.0))
    second.close()


def test_a_tcp_client_that_does_not_read_loses_whole_messages_only(opened: Callable[..., Link]) -> None:
    port = free_port()
    link = opened(TcpIn, f"tcpin:{port}")
    with socket.create_connection(("127.0.0.1", port), timeout=DEADLINE) as client:
        client.sendall(b"x")
        [(peer, _)] = received(link, 1)
        begun = time.monotonic()
        sent = 0
        while not link.dropped:
            link.send(peer, [(PING, PAYLOAD)] * 50)
            sent += 50
        assert time.monotonic() - begun < DEADLINE
        assert link.tx + link.dropped == sent
        client.settimeout(0.05)
        data = b""
        quiet = 0
        while quiet < 3:  # read all that was taken; what the link kept back goes out with its next look
            list(link.receive(0.0))
            try:
                data += client.recv(1 << 20)
            except TimeoutError:
                quiet += 1
        frame = PING.frame(PAYLOAD, 0, 1, 1)
        assert len(data) == link.tx * len(frame)
        starts = range(0, len(data), len(frame))
        assert all(data[start] == 0xFD for start in starts)


def test_tcpout_connects_once_the_server_is_there_and_again_after_a_loss(opened: Callable[..., Link]) -> None:
    port = free_port()
    link = opened(TcpOut, f"tcpout:127.0.0.1:{port}")
    list(link.receive(0.0))
    assert link.audience == []
    server = socket.create_server(("127.0.0.1", port))
    server.settimeout(DEADLINE)
    for attempt in (1.0, 2.0):
        wall = attempt * 10.0
        end = time.monotonic() + DEADLINE
        while not link.audience:
            assert time.monotonic() < end
            wall += 2.0
            list(link.receive(wall))
        connection, _ = server.accept()
        link.send(link.audience[0], [(PING, PAYLOAD)])
        connection.settimeout(DEADLINE)
        assert connection.recv(2048) == PING.frame(PAYLOAD, 0, 1, 1)
        connection.close()
        while link.audience:
            assert time.monotonic() < end
            list(link.receive(wall))
    server.close()


def test_the_network_refusing_is_counted_not_raised(opened: Callable[..., Link]) -> None:
    link = opened(UdpOut, "udpout:127.0.0.1:9")
    link.close()  # a closed socket refuses everything, as a vanished interface does
    link.send(link.audience[0], [(PING, PAYLOAD)])
    assert (link.tx, link.dropped) == (0, 1)
