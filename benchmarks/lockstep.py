"""Lockstep round trips with an outside controller written in Python, beside those of a bare UDP echo.

The controller holds the trimmed controls and answers each state at once: HIL_ACTUATOR_CONTROLS out, the vehicle
advances one step, HIL_STATE_QUATERNION in. The echo does nothing but return datagrams of that size; it is measured in
turns with the vehicle, so that a busy machine slows both.
"""

import socket
import statistics
import subprocess
import sys
import time

from fastcrc.crc16 import mcrf4xx
from figures import Figure
from pymavlink.dialects.v20 import common
from vehicle import HIL_STATE_QUATERNION, Vehicle, frames

from vehicle_model.aircraft import load_aircraft
from vehicle_model.trim import trim_level

__all__ = ["measure"]

ROUNDS = 7
TRIPS = 4000  # 10 s of flight each round
AIRSPEED = 30.0
ECHO = """
import socket
s = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
s.bind(("127.0.0.1", 0))
print(s.getsockname()[1], flush=True)
while True:
    data, peer = s.recvfrom(2048)
    s.sendto(data, peer)
"""


class Controller:
    """Packs HIL_ACTUATOR_CONTROLS with trimmed controls; pymavlink makes the first, then only what differs is new."""

    def __init__(self) -> None:
        """Find the trim and its normalised values by channel."""
        aircraft = load_aircraft()
        trim = trim_level(aircraft, AIRSPEED)
        outputs = [0.0] * 16
        for channel in aircraft.channels:
            outputs[channel.number - 1] = channel.to_normalised(float(trim.controls[channel.index]))
        message = common.MAVLink_hil_actuator_controls_message(0, outputs, 129, 0)
        sender = common.MAVLink(None, srcSystem=200, srcComponent=1)
        frame = message.pack(sender)
        self.header = frame[1:4]
        self.address = frame[5:10]
        self.rest = frame[18:-2]  # behind time_usec
        self.crc_extra = bytes([message.crc_extra])
        self.sequence = 0

    def frame(self, time_us: bytes) -> bytes:
        """The message that answers the state of this time (uint64, little endian)."""
        self.sequence = (self.sequence + 1) & 0xFF
        body = self.header + bytes([self.sequence]) + self.address + time_us + self.rest
        return b"\xfd" + body + mcrf4xx(body + self.crc_extra).to_bytes(2, "little")


def fly(s: socket.socket, controller: Controller, now: bytes) -> tuple[bytes, float]:
    """Answer TRIPS states, beginning with that of time `now`; returns the last state's time and the seconds it took."""
    begin = time.perf_counter()
    for _ in range(TRIPS):
        s.send(controller.frame(now))
        while True:
            identity, payload = next(frames(s.recv(2048)), (None, b""))
            # The 50 Hz stream carries the same message; a state that was answered already is not a new one.
            if identity == HIL_STATE_QUATERNION and payload[:8] != now:
                now = payload[:8]
                break
    return now, time.perf_counter() - begin


def bounce(s: socket.socket, datagram: bytes) -> float:
    """Seconds that TRIPS echoes take."""
    begin = time.perf_counter()
    for _ in range(TRIPS):
        s.send(datagram)
        s.recv(2048)
    return time.perf_counter() - begin


def measure() -> list[Figure]:
    """Round trips per second of both, and the lockstep flight as a multiple of real time."""
    controller = Controller()
    own: list[float] = []
    bare: list[float] = []
    echo = subprocess.Popen([sys.executable, "-c", ECHO], stdout=subprocess.PIPE, text=True)
    try:
        assert echo.stdout is not None
        port = int(echo.stdout.readline())
        with (
            Vehicle(f"--at=trim:{AIRSPEED:g}", "--lockstep") as vehicle,
            socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as mirror,
        ):
            mirror.settimeout(5.0)
            mirror.connect(("127.0.0.1", port))
            _, _, source = vehicle.receive()
            s = vehicle.sockets[0]
            s.connect(source)
            s.settimeout(5.0)
            now = bytes(8)
            for _ in range(ROUNDS):
                now, seconds = fly(s, controller, now)
                own.append(TRIPS / seconds)
                bare.append(TRIPS / bounce(mirror, controller.frame(now)))
    finally:
        echo.kill()
        echo.wait()
    simulated = int.from_bytes(now, "little") * 1e-6
    if abs(simulated - ROUNDS * TRIPS / 400.0) > 1e-3:
        raise RuntimeError(f"{ROUNDS * TRIPS} round trips flew {simulated} s: expected one period of 1/400 s each")
    return [
        Figure("lockstep round trips per second", statistics.median(own), "1/s", goal=15_000.0,
               peer="bare UDP echo", peer_value=statistics.median(bare)),
        Figure("lockstep flight", statistics.median(own) / 400.0, "x real"),
    ]  # fmt: skip
