"""Sockets and thread of the wire: UDP on the loopback, the vehicle at one side, any number of clients at the other.

Clients of both kinds are served. Those that listen find the vehicle's messages at their port, from a port that they
answer to. Those that send first send to that port, and from then on get everything as well.
"""

import selectors
import socket
import threading
import time

from sitl.testing.faults import split_frames
from sitl.testing.ports import LOOPBACK, reserve_port
from sitl.testing.wire import Wire

__all__ = ["Relay"]

_LARGEST_DATAGRAM = 1 << 16
_BUFFER = 4 << 20  # asked of the system for each socket [bytes]: a burst while Python is busy elsewhere is not lost
_READS = 64  # of one socket before the other gets its turn
_HEARTBEAT = 0

Address = tuple[str, int]


class Relay:
    """Carries datagrams over a wire between clients and one vehicle.

    Attributes:
        port: where clients may listen.
        port_out: where clients may send to.
        heard: set once the attached vehicle has sent a HEARTBEAT.
        vehicle: address it sends from, None before it has.
    """

    def __init__(self, wire: Wire, port: int | None = None) -> None:
        """`port`: where the client listens; None for a free one. Raises OSError when no port can be had."""
        self._wire = wire
        self._guard: socket.socket | None = None
        if port is None:
            port, self._guard = reserve_port()
        self.port = port
        self._ground = _open_socket()
        self.port_out: int = self._ground.getsockname()[1]
        self._clients: dict[Address, None] = {(LOOPBACK, port): None}
        self.heard = threading.Event()
        self.vehicle: Address | None = None
        self._side: socket.socket | None = None
        self._bell: socket.socket | None = None
        self._thread: threading.Thread | None = None

    def attach(self) -> int:
        """Begin to carry; gives the port that the vehicle is to send to, a new one for each process."""
        self.heard.clear()
        self.vehicle = None
        self._wire.forget()
        _empty(self._ground)  # what was sent to no vehicle must not reach the next one
        self._side = _open_socket()
        self._bell, bell = socket.socketpair()
        self._thread = threading.Thread(target=self._carry, args=(self._side, bell), name="wire", daemon=True)
        self._thread.start()
        return self._side.getsockname()[1]

    def detach(self) -> None:
        """Carry nothing any more until `attach`; the ports of the clients' side stay."""
        if self._thread is None or self._bell is None or self._side is None:
            return
        self._bell.close()
        self._thread.join()
        self._side.close()
        self._thread = self._bell = self._side = None

    def close(self) -> None:
        """Detach, and give the ports back."""
        self.detach()
        self._ground.close()
        if self._guard is not None:
            self._guard.close()

    def _carry(self, side: socket.socket, bell: socket.socket) -> None:
        with bell, selectors.DefaultSelector() as selector:
            for each in (side, self._ground, bell):
                selector.register(each, selectors.EVENT_READ)
            while True:
                due = self._wire.next_due()
                ready = {key.fileobj for key, _ in selector.select(None if due is None else due - time.monotonic())}
                if bell in ready:
                    return
                for each in (side, self._ground):
                    if each in ready:
                        self._receive(each, side)
                if due is not None:
                    with self._wire.lock:
                        self._send(self._wire.due(time.monotonic()), side)

    def _receive(self, source: socket.socket, side: socket.socket) -> None:
        is_from_vehicle = source is side
        for _ in range(_READS):
            try:
                data, address = source.recvfrom(_LARGEST_DATAGRAM)
            except BlockingIOError:
                return
            except OSError:
                continue  # some systems report here that an earlier datagram met a closed port
            if is_from_vehicle:
                self.vehicle = address
            elif address not in self._clients:
                self._clients[address] = None
            with self._wire.lock:
                self._send(self._wire.carry(data, time.monotonic(), to_vehicle=not is_from_vehicle), side)
            if is_from_vehicle and not self.heard.is_set() and _has_heartbeat(data):
                self.heard.set()

    def _send(self, datagrams: list[tuple[bool, bytes]], side: socket.socket) -> None:
        for to_vehicle, data in datagrams:
            if not to_vehicle:
                for address in self._clients:
                    _send_to(self._ground, data, address)
            elif self.vehicle is not None:
                _send_to(side, data, self.vehicle)


def _open_socket() -> socket.socket:
    opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    opened.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _BUFFER)
    opened.setblocking(False)
    opened.bind((LOOPBACK, 0))
    return opened


def _send_to(sender: socket.socket, data: bytes, address: Address) -> None:
    try:
        sender.sendto(data, address)
    except OSError:
        return  # as UDP does: nobody is told


def _empty(source: socket.socket) -> None:
    while True:
        try:
            source.recv(_LARGEST_DATAGRAM)
        except BlockingIOError:
            return
        except OSError:
            continue


def _has_heartbeat(data: bytes) -> bool:
    return any(message == _HEARTBEAT for message, _ in split_frames(data))
