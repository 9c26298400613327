"""Connection strings, and what all links have in common: peers, sequence numbers, counters, datagrams.

A link never waits. What a socket does not take at once is dropped and counted, what it brings is read up to a limit,
and an error of the network is never an error of the flight.
"""

import socket
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from sitl.mavlink.codec import MessageCodec
from sitl.mavlink.frames import FrameScanner

if TYPE_CHECKING:
    from sitl.mavlink.signing import Signing

__all__ = ["Link", "LinkError", "LinkSpec", "Messages", "Peer", "parse_link"]

Messages = list[tuple[MessageCodec, bytes]]  # each a codec and a payload

LOOPBACK = "127.0.0.1"
KINDS = ("udpout", "udpin", "tcpin", "tcpout")
STREAM_SETS = ("normal", "onboard", "viewer", "minimal", "highlatency")
TRUSTED, SINGLE = "trusted", "single"
OPTIONS = (*STREAM_SETS, TRUSTED, SINGLE)
VIEWER_PORT = 19410  # where viewers of simulated flights listen, by PX4's habit
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
    trusted: bool = False  # takes unsigned messages where others do not
    single: bool = False  # one message per datagram


def parse_link(text: str) -> LinkSpec:
    """Read `udpout:HOST:PORT`, `udpin:[HOST:]PORT`, `tcpin:[HOST:]PORT` or `tcpout:HOST:PORT`, and options after it.

    Options follow after commas: one of STREAM_SETS chooses the default streams; without it PX4's ports for SDKs (14540
    to 14549) get those for SDKs and its port for viewers theirs; `trusted` takes unsigned messages where signing is on;
    `single` puts one message into a datagram. A link that listens does so on loopback unless a host is given. Raises
    LinkError.
    """
    address, *options = text.split(",")
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
    sets = [option for option in options if option in STREAM_SETS]
    if len(sets) > 1 or not set(options) <= set(OPTIONS):
        wrong = next((option for option in options if option not in OPTIONS), ",".join(sets))
        msg = f"{expected}, with ,{' or ,'.join(OPTIONS)} after it, got {wrong!r}"
        raise LinkError(msg)
    usual = "onboard" if port in ONBOARD_PORTS else "viewer" if port == VIEWER_PORT else "normal"
    streams = sets[0] if sets else usual
    return LinkSpec(text, kind, host.strip("[]") or LOOPBACK, port, streams, TRUSTED in options, SINGLE in options)


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
        number: of the link among ours, which its signatures name.
        signing: signs its frames while there is a key.
        tape: told of every message that is sent to one peer alone; None: nobody records.
        tx, rx: messages sent and received.
        dropped: messages not sent because a buffer was full or the network refused.
        malformed: pieces received that are no MAVLink.
        rejected: messages received that signing did not let in.
        bytes_in, bytes_out: what came, and what was sent.
    """

    def __init__(self, spec: LinkSpec, system: int, component: int) -> None:
        """Open the link; raises LinkError when its socket cannot be made."""
        self.spec = spec
        self.system = system
        self.component = component
        self.number = 0
        self.signing: Signing | None = None
        self.tape: Callable[[Messages], None] | None = None
        self.tx = self.rx = self.dropped = self.malformed = self.rejected = 0
        self.bytes_in = self.bytes_out = 0
        self.max_datagram = 0 if spec.single else MAX_DATAGRAM

    @property
    @abstractmethod
    def sockets(self) -> list[socket.socket]:
        """Sockets that may have something to read, for select()."""

    @property
    @abstractmethod
    def audience(self) -> list[Peer]:
        """Peers that get what is sent to everybody on this link."""

    @property
    def peers(self) -> list[Peer]:
        """Everybody who can be reached on it."""
        return self.audience

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

    def send(self, peer: Peer, messages: "Messages") -> bool:
        """Send messages (codec and payload) to this peer alone; False if its socket did not take all of them."""
        if self.tape is not None:
            self.tape(messages)
        return self.deliver(peer, messages)

    def deliver(self, peer: Peer, messages: "Messages") -> bool:
        """Hand messages to a peer, as many to a datagram as fit; False if its socket did not take all of them."""
        signing = self.signing if self.signing is not None and self.signing.is_on else None
        datagram = b""
        count = 0
        taken = True
        for codec, payload in messages:
            frame = codec.frame(payload, peer.sequence, self.system, self.component, signed=signing is not None)
            if signing is not None:
                frame = signing.sign(frame, self.number)
            peer.sequence = (peer.sequence + 1) & 0xFF
            if count and len(datagram) + len(frame) > self.max_datagram:
                taken &= self._hand_over(peer, datagram, count)
                datagram, count = frame, 1
            else:
                datagram += frame
                count += 1
        if count:
            taken &= self._hand_over(peer, datagram, count)
        return taken

    def forward(self, peer: Peer, frame: bytes) -> None:
        """Pass a frame of somebody else on as it came."""
        self._hand_over(peer, frame, 1)

    def statistics(self) -> dict[str, int]:
        """The counters."""
        return {
            "rx": self.rx,
            "tx": self.tx,
            "dropped": self.dropped,
            "malformed": self.malformed,
            "rejected": self.rejected,
        }

    def _hand_over(self, peer: Peer, data: bytes, messages: int) -> bool:
        """Give the peer's socket so many messages, and count them."""
        taken = self._transmit(peer, data)
        if taken:
            self.tx += messages
            self.bytes_out += len(data)
        else:
            self.dropped += messages
        return taken
