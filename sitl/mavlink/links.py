"""Connection strings, and what all links have in common: peers, sequence numbers, counters, datagrams.

A link never waits. What a socket does not take at once is dropped and counted, what it brings is read up to a limit,
and an error of the network is never an error of the flight.
"""

import socket
import time
from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass

from sitl.mavlink.codec import MessageCodec
from sitl.mavlink.frames import FrameScanner

__all__ = ["Link", "LinkError", "LinkSpec", "Peer", "parse_link"]

LOOPBACK = "127.0.0.1"
KINDS = ("udpout", "udpin", "tcpin", "tcpout")
STREAM_SETS = ("normal", "onboard")
ONBOARD_PORTS = range(14540, 14550)  # where SDKs listen, by PX4's habit; one for each instance
MAX_DATAGRAM = 1400  # several messages share a datagram up to this size, which passes everywhere unfragmented [bytes]
MAX_READS = 100  # of one link before the others and the flight get their turn
MAX_PEERS = 16
PEER_SILENCE = 15.0  # after which a peer that was only heard is forgotten [s], wall time


class LinkError(ValueError):
    """A connection string that cannot be used; the text says which, why and what was expected."""


@dataclass(frozen=True, slots=True)
class LinkSpec:
    """A connection string, taken apart."""

    text: str
    kind: str  # one of KINDS
    host: str
    port: int
    streams: str  # one of STREAM_SETS


def parse_link(text: str) -> LinkSpec:
    """Read `udpout:HOST:PORT`, `udpin:[HOST:]PORT`, `tcpin:[HOST:]PORT` or `tcpout:HOST:PORT`.

    `,normal` or `,onboard` may follow and chooses the default streams; without it PX4's ports for SDKs (14540 to 14549)
    get those for SDKs. A link that listens does so on loopback unless a host is given. Raises LinkError.
    """
    address, comma, streams = text.partition(",")
    kind, _, rest = address.partition(":")
    host, colon, port_text = rest.rpartition(":")
    expected = f"link {text!r}: expected udpout:HOST:PORT, udpin:[HOST:]PORT, tcpin:[HOST:]PORT or tcpout:HOST:PORT"
    if kind not in KINDS:
        msg = f"{expected}, got the kind {kind!r}"
        raise LinkError(msg)
    if not (port_text.isascii() and port_text.isdigit() and 0 < int(port_text) < 1 << 16):
        msg = f"{expected}, with a port from 1 to 65535, got {port_text!r}"
        raise LinkError(msg)
    if not host and (colon or kind.endswith("out")):
        msg = f"{expected}, got no host"
        raise LinkError(msg)
    port = int(port_text)
    if not comma:
        streams = "onboard" if port in ONBOARD_PORTS else "normal"
    elif streams not in STREAM_SETS:
        msg = f"{expected}, with ,normal or ,onboard after it, got {streams!r}"
        raise LinkError(msg)
    return LinkSpec(text, kind, host.strip("[]") or LOOPBACK, port, streams)


def resolve(spec: LinkSpec, kind: socket.SocketKind) -> tuple[socket.AddressFamily, tuple[str, int]]:
    """Address family and numeric address of a link's host; raises LinkError when there is none."""
    try:
        found = socket.getaddrinfo(spec.host, spec.port, type=kind)
    except (OSError, UnicodeError) as error:
        msg = f"link {spec.text!r}: expected a host name or address, got {spec.host!r} ({error})"
        raise LinkError(msg) from None
    # IPv4 first: `localhost` may mean both, and that is where ground stations listen.
    family, _, _, _, address = min(found, key=lambda entry: entry[0] != socket.AF_INET)
    return family, (str(address[0]), int(address[1]))


class Peer:
    """Someone at the other end of a link. Sequence numbers are per peer, so that each can tell what it has missed."""

    __slots__ = ("address", "heard", "scanner", "sequence")

    def __init__(self, address: tuple[str, int], *, is_stream: bool) -> None:
        """`address`: of the peer, as its socket gives it."""
        self.address = address
        self.scanner = FrameScanner(is_stream=is_stream)
        self.sequence = 0
        self.heard = time.monotonic()


class Link(ABC):
    """One connection string at work.

    Attributes:
        spec: the connection string.
        system, component: ids that its frames carry.
        tx, rx: messages sent and received.
        dropped: messages not sent because a buffer was full or the network refused.
        malformed: pieces received that are no MAVLink.
    """

    def __init__(self, spec: LinkSpec, system: int, component: int) -> None:
        """Open the link; raises LinkError when its socket cannot be made."""
        self.spec = spec
        self.system = system
        self.component = component
        self.tx = self.rx = self.dropped = self.malformed = 0
        self.max_datagram = MAX_DATAGRAM

    @property
    @abstractmethod
    def sockets(self) -> list[socket.socket]:
        """Sockets that may have something to read, for select()."""

    @property
    @abstractmethod
    def audience(self) -> list[Peer]:
        """Peers that get what is sent to everybody on this link."""

    @abstractmethod
    def receive(self, wall_time: float) -> Iterator[tuple[Peer, bytes]]:
        """Whatever has arrived, without waiting, in the order of arrival; at most MAX_READS pieces."""

    @abstractmethod
    def close(self) -> None:
        """Close all sockets of the link."""

    @abstractmethod
    def _transmit(self, peer: Peer, data: bytes) -> bool:
        """Hand `data` to the peer's socket; False if it did not take it."""

    def believe(self, peer: Peer, wall_time: float) -> None:
        """Take note that a peer speaks MAVLink."""
        peer.heard = wall_time

    def forget_silent(self, wall_time: float) -> None:  # noqa: B027  (a connection ends by itself: only UDP forgets)
        """Forget peers that were not heard for PEER_SILENCE."""

    def send(self, peer: Peer, messages: list[tuple[MessageCodec, bytes]]) -> None:
        """Send messages (codec and payload) to one peer, as many to a datagram as fit."""
        datagram = b""
        count = 0
        for codec, payload in messages:
            frame = codec.frame(payload, peer.sequence, self.system, self.component)
            peer.sequence = (peer.sequence + 1) & 0xFF
            if count and len(datagram) + len(frame) > self.max_datagram:
                self._count(self._transmit(peer, datagram), count)
                datagram, count = frame, 1
            else:
                datagram += frame
                count += 1
        if count:
            self._count(self._transmit(peer, datagram), count)

    def statistics(self) -> dict[str, int]:
        """The counters."""
        return {"rx": self.rx, "tx": self.tx, "dropped": self.dropped, "malformed": self.malformed}

    def _count(self, was_taken: bool, messages: int) -> None:
        if was_taken:
            self.tx += messages
        else:
            self.dropped += messages
