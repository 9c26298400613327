"""TCP links: `tcpin` serves every client that connects, `tcpout` connects and keeps trying."""

import contextlib
import errno
import os
import socket
from collections.abc import Iterator

from sitl.mavlink.links import MAX_PEERS, MAX_READS, Link, LinkError, LinkSpec, Peer, resolve

__all__ = ["TcpIn", "TcpOut"]

_PIECE = 1 << 16
_RETRY_PERIOD = 1.0  # [s], wall time
_CONNECTING = (0, errno.EINPROGRESS, errno.EWOULDBLOCK)


class _Connection(Peer):
    """A peer with a socket of its own and what that did not take yet: a frame once begun must be sent to its end."""

    __slots__ = ("stream", "unsent")

    def __init__(self, connection: socket.socket, address: tuple[str, int]) -> None:
        super().__init__(address, is_stream=True)
        connection.setblocking(False)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.stream = connection
        self.unsent = b""


class _TcpLink(Link):
    """Connected peers, and how bytes go to and fro."""

    def __init__(self, spec: LinkSpec, system: int, component: int) -> None:
        super().__init__(spec, system, component)
        self._family, self._address = resolve(spec, socket.SOCK_STREAM)
        self._connections: list[_Connection] = []

    @property
    def audience(self) -> list[Peer]:
        """See Link."""
        return list(self._connections)

    def receive(self, wall_time: float) -> Iterator[tuple[Peer, bytes]]:
        """See Link."""
        self._connect(wall_time)
        for peer in list(self._connections):
            if peer.unsent:
                self._transmit(peer, b"")
            for _ in range(MAX_READS):
                try:
                    data = peer.stream.recv(_PIECE)
                except BlockingIOError:
                    break
                except OSError:
                    data = b""
                if not data:
                    self._drop(peer)
                    break
                yield peer, data

    def close(self) -> None:
        """See Link."""
        for peer in list(self._connections):
            self._drop(peer)

    def _connect(self, wall_time: float) -> None:
        """Get new connections, without waiting."""
        raise NotImplementedError

    def _drop(self, peer: _Connection) -> None:
        peer.stream.close()
        if peer in self._connections:
            self._connections.remove(peer)

    def _transmit(self, peer: Peer, data: bytes) -> bool:
        if not isinstance(peer, _Connection):
            return False
        try:
            if peer.unsent:
                peer.unsent = peer.unsent[peer.stream.send(peer.unsent) :]
                if peer.unsent:
                    return False
            if data:
                peer.unsent = data[peer.stream.send(data) :]
        except BlockingIOError:
            return False
        except OSError:
            self._drop(peer)
            return False
        return True


class TcpIn(_TcpLink):
    """Listens on a port; every client that connects gets everything."""

    def __init__(self, spec: LinkSpec, system: int, component: int) -> None:
        super().__init__(spec, system, component)
        self._listener = socket.socket(self._family, socket.SOCK_STREAM)
        self._listener.setblocking(False)
        if os.name == "posix":  # elsewhere this would let two processes listen on one port
            self._listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            self._listener.bind(self._address)
            self._listener.listen(MAX_PEERS)
        except OSError as error:
            self._listener.close()
            msg = f"link {spec.text!r}: expected a free port to listen on, got {error}"
            raise LinkError(msg) from None

    @property
    def sockets(self) -> list[socket.socket]:
        """See Link."""
        return [self._listener, *(peer.stream for peer in self._connections)]

    def close(self) -> None:
        """See Link."""
        super().close()
        self._listener.close()

    def _connect(self, wall_time: float) -> None:  # noqa: ARG002  (clients come when they like)
        for _ in range(MAX_PEERS):
            try:
                connection, address = self._listener.accept()
            except OSError:
                return
            if len(self._connections) >= MAX_PEERS:
                connection.close()
            else:
                self._connections.append(_Connection(connection, address))


class TcpOut(_TcpLink):
    """Connects to a server, again after every loss."""

    def __init__(self, spec: LinkSpec, system: int, component: int) -> None:
        super().__init__(spec, system, component)
        self._pending: socket.socket | None = None
        self._next_try = 0.0

    @property
    def sockets(self) -> list[socket.socket]:
        """See Link."""
        return [peer.stream for peer in self._connections]

    def close(self) -> None:
        """See Link."""
        super().close()
        if self._pending is not None:
            self._pending.close()

    def _connect(self, wall_time: float) -> None:
        if self._connections:
            return
        if self._pending is not None:
            with contextlib.suppress(OSError):
                self._pending.getpeername()  # has one only once the connection stands
                self._connections.append(_Connection(self._pending, self._address))
                self._pending = None
                return
        if wall_time < self._next_try:
            return
        self._next_try = wall_time + _RETRY_PERIOD
        if self._pending is not None:
            self._pending.close()
        self._pending = socket.socket(self._family, socket.SOCK_STREAM)
        self._pending.setblocking(False)
        if self._pending.connect_ex(self._address) not in _CONNECTING:
            self._pending.close()
            self._pending = None
