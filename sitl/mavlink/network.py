"""All links as one: what comes in by right, what goes out to everybody, what is passed on, what is recorded."""

import socket
from collections.abc import Callable, Iterable, Iterator

from sitl.mavlink.frames import Frame
from sitl.mavlink.links import Link, LinkSpec, Messages, Peer, parse_link
from sitl.mavlink.router import QUIET, Router
from sitl.mavlink.signing import Signing
from sitl.mavlink.tape import Tape
from sitl.mavlink.tcp import TcpIn, TcpOut
from sitl.mavlink.udp import UdpIn, UdpOut

__all__ = ["Network"]

_KINDS: dict[str, Callable[[LinkSpec, int, int], Link]] = {
    "udpout": UdpOut, "udpin": UdpIn, "tcpin": TcpIn, "tcpout": TcpOut,
}  # fmt: skip


class Network:
    """The links of one vehicle.

    Attributes:
        links: in the order in which they were given.
        system, component: our ids.
        tape: records all traffic, or None.
    """

    def __init__(
        self, links: Iterable[str | LinkSpec | Link], system: int, component: int, signing: Signing, tape: Tape | None
    ) -> None:
        """Open links: connection strings, what they say, or open ones.

        Raises LinkError, and leaves nothing open, if one cannot be had.
        """
        self.system, self.component = system, component
        self.tape = tape
        self.links: list[Link] = []
        self._signing = signing
        try:
            for given in links:
                self._open(given)
        except ValueError:
            self.close()
            raise
        self._router = Router(self.links)
        self.forward = self._router.forward

    def _open(self, given: str | LinkSpec | Link) -> None:
        if isinstance(given, Link):
            link = given
        else:
            spec = parse_link(given) if isinstance(given, str) else given
            link = _KINDS[spec.kind](spec, self.system, self.component)
        link.number = len(self.links)
        link.signing = self._signing
        link.tape = None if self.tape is None else self.tape.sent
        self.links.append(link)

    def set_system(self, system: int) -> None:
        """Have another system id from the next message on."""
        self.system = system
        for link in self.links:
            link.system = system
        if self.tape is not None:
            self.tape.system = system

    def sockets(self) -> list[socket.socket]:
        """Sockets that may have something to read, for select(); they change as peers come and go."""
        return [open_socket for link in self.links for open_socket in link.sockets]

    def receive(self, wall_time: float) -> Iterator[tuple[Frame, Link, Peer]]:
        """Frames that have arrived, without waiting: not our own come back, and only what signing lets in."""
        for link in self.links:
            for peer, data in link.receive(wall_time):
                link.bytes_in += len(data)
                scanner = peer.scanner
                malformed = scanner.malformed
                frames = scanner.scan(data)
                link.malformed += scanner.malformed - malformed
                for frame in frames:
                    if self._is_welcome(frame, link):
                        link.believe(peer, wall_time)
                        link.rx += 1
                        self._router.learn(frame, link, peer)
                        if self.tape is not None:
                            self.tape.received(frame)
                        yield frame, link, peer

    def _is_welcome(self, frame: Frame, link: Link) -> bool:
        if frame.system == self.system and frame.component == self.component:
            return False  # our own words, come back over some router
        if not self._signing.is_on:
            return True
        verdict = self._signing.verdict(
            frame.raw, frame.system, frame.component, frame.message, trusted=link.spec.trusted
        )
        link.rejected += not verdict.accepted
        return verdict.accepted

    def to_everybody(self, messages: Messages) -> None:
        """Send messages to all peers on all links, but those that carry only what is meant for them."""
        if self.tape is not None:
            self.tape.sent(messages)
        for link in self.links:
            if link.spec.streams != QUIET:
                for peer in link.audience:
                    link.deliver(peer, messages)

    def forget_silent(self, wall_time: float) -> None:
        """Forget peers that have gone, and the ways to them."""
        for link in self.links:
            link.forget_silent(wall_time)
        self._router.forget()

    def statistics(self) -> dict[str, dict[str, int]]:
        """Counters of each link, by its connection string."""
        return {link.spec.text: link.statistics() for link in self.links}

    def close(self) -> None:
        """Close all links, and the recording."""
        for link in self.links:
            link.close()
        if self.tape is not None:
            self.tape.close()
