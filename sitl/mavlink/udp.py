"""UDP links: `udpout` speaks to one address, `udpin` to everybody it has heard."""

import contextlib
import socket
from collections.abc import Iterator

from sitl.mavlink.links import MAX_PEERS, MAX_READS, PEER_SILENCE, Link, LinkError, LinkSpec, Peer, resolve

__all__ = ["UdpIn", "UdpOut"]

_LARGEST_DATAGRAM = 1 << 16


class _UdpLink(Link):
    """One datagram socket and the peers heard on it."""

    def __init__(self, spec: LinkSpec, system: int, component: int) -> None:
        super().__init__(spec, system, component)
        self._family, self._address = resolve(spec, socket.SOCK_DGRAM)
        self._socket = socket.socket(self._family, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._heard: dict[tuple[str, int], Peer] = {}

    @property
    def sockets(self) -> list[socket.socket]:
        """See Link."""
        return [self._socket]

    def receive(self, wall_time: float) -> Iterator[tuple[Peer, bytes]]:  # noqa: ARG002  (only TCP retries by it)
        """See Link."""
        for _ in range(MAX_READS):
            try:
                data, address = self._socket.recvfrom(_LARGEST_DATAGRAM)
            except BlockingIOError:
                return
            except OSError:
                continue  # some systems report here that an earlier datagram met a closed port
            yield self._heard.get(address) or Peer(address, is_stream=False), data

    def believe(self, peer: Peer, wall_time: float) -> None:
        """See Link."""
        # Only who speaks MAVLink is remembered and answered; who floods from many addresses displaces the quietest.
        peer.heard = wall_time
        if peer.address not in self._heard:
            if len(self._heard) >= MAX_PEERS:
                del self._heard[min(self._heard, key=lambda address: self._heard[address].heard)]
            self._heard[peer.address] = peer

    def forget_silent(self, wall_time: float) -> None:
        """See Link."""
        silent = [address for address, peer in self._heard.items() if wall_time - peer.heard > PEER_SILENCE]
        for address in silent:
            del self._heard[address]

    def close(self) -> None:
        """See Link."""
        self._socket.close()

    def _transmit(self, peer: Peer, data: bytes) -> bool:
        try:
            self._socket.sendto(data, peer.address)
        except OSError:
            return False
        return True


class UdpOut(_UdpLink):
    """Sends to one address from a port of its own, and answers whoever sends to that port."""

    def __init__(self, spec: LinkSpec, system: int, component: int) -> None:
        super().__init__(spec, system, component)
        with contextlib.suppress(OSError):
            # A port of its own from the start, so that it can be heard before it has sent. On loopback where the
            # other end is there, so that nobody else can reach it.
            self._socket.bind((self._address[0] if _is_loopback(self._address[0]) else "", 0))
        target = Peer(self._address, is_stream=False)
        self._heard[self._address] = target
        self._audience = [target]

    @property
    def audience(self) -> list[Peer]:
        """See Link."""
        return self._audience

    @property
    def peers(self) -> list[Peer]:
        """See Link."""
        return list(self._heard.values())

    def forget_silent(self, wall_time: float) -> None:
        """See Link; the one address it was made for is never forgotten."""
        self._audience[0].heard = wall_time
        super().forget_silent(wall_time)


class UdpIn(_UdpLink):
    """Listens on a port; everybody heard there gets everything."""

    def __init__(self, spec: LinkSpec, system: int, component: int) -> None:
        super().__init__(spec, system, component)
        try:
            self._socket.bind(self._address)
        except OSError as error:
            self._socket.close()
            msg = f"link {spec.text!r}: expected a free port to listen on, got {error}"
            raise LinkError(msg) from None

    @property
    def audience(self) -> list[Peer]:
        """See Link."""
        return list(self._heard.values())


def _is_loopback(host: str) -> bool:
    return host.startswith("127.") or host == "::1"
