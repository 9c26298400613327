"""A vehicle in a process of its own, and a ground station of pymavlink that waits for it."""

import os
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from pymavlink import mavutil

__all__ = ["DEADLINE", "ROOT", "Station", "vehicle"]

DEADLINE = 120.0  # [s]; a first start compiles
ROOT = Path(__file__).parents[2]


class Station:
    """A ground station of pymavlink that listens on a free port; `process` is the vehicle it waits for."""

    def __init__(self) -> None:
        self.process: subprocess.Popen[str] | None = None
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.bind(("127.0.0.1", 0))
            self.port = probe.getsockname()[1]
        self.connection: Any = mavutil.mavlink_connection(f"udpin:127.0.0.1:{self.port}", source_system=255)

    @property
    def link(self) -> str:
        return f"udpout:127.0.0.1:{self.port}"

    def wait_for(self, kind: str, condition: Callable[[Any], bool] = lambda _: True) -> Any:
        end = time.monotonic() + DEADLINE
        while time.monotonic() < end:
            message = self.connection.recv_match(type=kind, blocking=True, timeout=1.0)
            if message is not None and condition(message):
                return message
            if message is None and self.process is not None and self.process.poll() is not None:
                pytest.fail(f"no {kind}, for the vehicle has ended: {self.process.communicate()}")
        pytest.fail(f"no {kind} as expected within {DEADLINE} s")

    def send_servos(self, time_us: int = 0) -> None:
        controls = [0.2, 0.2, 0.0, 0.5, 0.0, 0.0, 0.0, *[0.0] * 9]
        self.connection.mav.hil_actuator_controls_send(time_us, controls, 129, 0)


@contextmanager
def vehicle(station: Station, *arguments: str) -> Generator[subprocess.Popen[str]]:
    """The program in a process of its own, connected to a ground station and killed at the end if it still runs."""
    if "--link" not in arguments:
        arguments = ("--link", station.link, *arguments)
    station.process = process = subprocess.Popen(
        [sys.executable, "-m", "sitl", *arguments],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONWARNINGS": "error"},
    )
    try:
        yield process
    finally:
        if process.poll() is None:
            process.kill()
        process.communicate()
