"""Real vehicle processes on free ports, a wire to them that loses datagrams, and peers for what ours never does."""

import contextlib
import os
import random
import select
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Generator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import IO, Any

import pytest
from pymavlink.dialects.v20 import all as mav

ROOT = Path(__file__).parents[2]
START_WAIT = 120.0  # [s]; the first start compiles the numeric core


def _free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@contextmanager
def _vehicle(*arguments: str, link: str | None = None) -> Generator[str]:
    """A vehicle in a process of its own; gives the connection string for the ground.

    It sends to a free port, or is reached as `link` says.
    """
    port = _free_port()
    with tempfile.TemporaryFile() as said:
        process = subprocess.Popen(
            [sys.executable, "-u", "-m", "sitl", "--link", link or f"udpout:127.0.0.1:{port}", *arguments],
            cwd=ROOT,
            stdout=said,
        )
        try:
            _wait_until_it_runs(process, said)
            yield f"udpin:127.0.0.1:{port}"
        finally:
            process.kill()
            process.wait()


def _wait_until_it_runs(process: "subprocess.Popen[bytes]", said: IO[bytes]) -> None:
    end = time.monotonic() + START_WAIT
    while b"Ctrl-C ends" not in os.pread(said.fileno(), 1 << 16, 0):
        assert time.monotonic() < end, "the vehicle does not start"
        with contextlib.suppress(subprocess.TimeoutExpired):
            code = process.wait(0.02)
            raise AssertionError(f"the vehicle has ended with exit code {code}")


@contextmanager
def _lossy_wire(port: int, share: float) -> Generator[tuple[int, list[int]]]:
    """Carries datagrams between whoever writes to the port it gives and `port`, and drops a share of them.

    Gives that port, and a list of one: how many it has dropped.
    """
    chance, dropped, stop = random.Random(1), [0], threading.Event()
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as near,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as far,
    ):
        near.bind(("127.0.0.1", 0))
        far.connect(("127.0.0.1", port))

        def carry() -> None:
            ground = None
            while not stop.is_set():
                for ready in select.select([near, far], [], [], 0.05)[0]:
                    with contextlib.suppress(ConnectionRefusedError):  # while the vehicle does not listen yet
                        data, source = ready.recvfrom(65535)
                        ground = source if ready is near else ground
                        if chance.random() < share:
                            dropped[0] += 1
                        elif ready is near:
                            far.send(data)
                        elif ground is not None:
                            near.sendto(data, ground)

        thread = threading.Thread(target=carry)
        thread.start()
        try:
            yield near.getsockname()[1], dropped
        finally:
            stop.set()
            thread.join()


class Peer:
    """The other end of a link, of a few lines: beats ten times a second and answers as the test says.

    Attributes:
        mav: its senders.
        heard: every message it has received.
        answer: called with each of them.
        custom_mode, armed: what its HEARTBEAT says.
    """

    def __init__(self, port: int, system: int, kind: int, autopilot: int) -> None:
        self.mav = mav.MAVLink(self, system, 1)
        self.heard: list[Any] = []
        self.answer: Callable[[Any], None] = lambda _: None
        self.custom_mode, self.armed, self.is_silent = 0, False, False
        self._kind, self._autopilot = kind, autopilot
        self._wire = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._wire.connect(("127.0.0.1", port))
        self._decoder = mav.MAVLink(None)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run)

    def write(self, data: bytes) -> None:
        """Where its senders put what they send."""
        with contextlib.suppress(ConnectionRefusedError):  # while nobody listens
            self._wire.send(data)

    def _run(self) -> None:
        due = 0.0
        while not self._stop.is_set():
            if time.monotonic() >= due and not self.is_silent:
                due = time.monotonic() + 0.1
                flags = mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | mav.MAV_MODE_FLAG_SAFETY_ARMED * self.armed
                self.mav.heartbeat_send(self._kind, self._autopilot, flags, self.custom_mode, mav.MAV_STATE_ACTIVE)
            if select.select([self._wire], [], [], 0.02)[0]:
                with contextlib.suppress(ConnectionRefusedError):
                    for message in self._decoder.parse_buffer(self._wire.recv(65535)) or []:
                        self.heard.append(message)
                        self.answer(message)

    def __enter__(self) -> "Peer":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()
        self._wire.close()


@pytest.fixture(scope="session")
def peer() -> Callable[..., AbstractContextManager[Any]]:
    """What starts a peer that sends to a port; a PX4 quadrotor of system 1 unless it is told otherwise."""

    def start(port: int, *, system: int = 1, kind: int = mav.MAV_TYPE_QUADROTOR, autopilot: int = 12) -> Peer:
        return Peer(port, system, kind, autopilot)

    return start


@pytest.fixture(scope="session")
def free_port() -> Callable[[], int]:
    """Gives a UDP port of loopback that nobody uses."""
    return _free_port


@pytest.fixture(scope="session")
def vehicle() -> Callable[..., AbstractContextManager[str]]:
    """What starts a vehicle and gives the link to it."""
    return _vehicle


@pytest.fixture(scope="session")
def lossy_wire() -> Callable[[int, float], AbstractContextManager[tuple[int, list[int]]]]:
    """What lays a wire to a port and gives the wire's own port and its count of losses."""
    return _lossy_wire
