"""Free UDP ports for test clients to listen on, kept apart between all tests that run on a machine at once."""

import random
import socket

__all__ = ["LOOPBACK", "reserve_port"]

LOOPBACK = "127.0.0.1"
# The client may bind its port any time later, so nobody else may be given it until then. Operating systems hand out
# ports from 32768 or 49152 on; programs with a port of their own mostly stay below 20000.
_PORTS = range(20000, 32000)


def reserve_port() -> tuple[int, socket.socket]:
    """A UDP port of the loopback that nobody uses, and what keeps it reserved until it is closed.

    The reservation is a TCP socket bound to the port of the same number: that keeps the UDP port free for the client,
    keeps other reservations away, and ends with the process. Raises OSError when no port is free.
    """
    for port in random.SystemRandom().sample(_PORTS, k=1000):
        guard = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        try:
            guard.bind((LOOPBACK, port))
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
                probe.bind((LOOPBACK, port))
        except OSError:
            guard.close()
        else:
            return port, guard
    msg = f"expected a free UDP port from {_PORTS[0]} to {_PORTS[-1]}, found none in {1000} tries"
    raise OSError(msg)
