"""A vehicle's MAVLink side on real sockets, a moment of flight with known numbers, and a client to talk to it."""

import math
import socket
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from sitl.mavlink import MavlinkFace
from sitl.mavlink.dialect import tiltwing as mav
from sitl.simulation import Simulation
from sitl.snapshot import Snapshot
from tests.sitl.mavlink.in_memory import Desk
from vehicle_model.aircraft import Aircraft, load_aircraft
from vehicle_model.records import OUTPUTS
from vehicle_model.state import ROTOR_SPEED, blank_controls, blank_state

DEADLINE = 10.0  # [s], wall time: far more than anything here takes


def make_snapshot(**changes: Any) -> Snapshot:
    """A climbing turn in a transition, every number different from every other; fields can be changed."""
    controls = blank_controls()
    controls[:] = (0.60, 0.50, -0.25, math.radians(40.0), 0.10, -0.05, 0.02)
    state = blank_state()
    state[ROTOR_SPEED : ROTOR_SPEED + 3] = (600.0, 590.0, -300.0)
    outputs = np.zeros(1, OUTPUTS)
    outputs["height_above_ground"] = 23.5
    outputs["velocity_air_body"] = (18.0, 1.5, 2.5)
    outputs["current"] = (20.0, 19.0, -4.0)
    fields: dict[str, Any] = {
        "time": 12.3475,
        "state": state,
        "controls": controls,
        "outputs": outputs[0],
        "latitude": math.radians(47.3977),
        "longitude": math.radians(-8.5456),
        "height_ellipsoid": 560.0,
        "altitude_msl": 512.25,
        "position_ned": (101.5, -203.25, -24.25),
        "velocity_ned": (15.125, -9.25, -2.5),
        "quaternion": (0.9, 0.1, -0.2, 0.3741657386773941),
        "roll": 0.1,
        "pitch": -0.2,
        "yaw": -0.75,
        "rates": (0.01, -0.02, 0.03),
        "specific_force": (0.5, -0.25, -10.5),
        "airspeed": 18.25,
        "pressure": 95000.0,
        "temperature": 284.5,
        "density": 1.16,
        "wind_ned": (1.0, -2.0, 0.0),
        "tilt": math.radians(42.0),
        "on_ground": False,
    }
    return Snapshot(**{**fields, **changes})


@pytest.fixture(scope="session")
def aircraft() -> Aircraft:
    return load_aircraft()


def free_port() -> int:
    """A UDP and TCP port on loopback that nobody uses now."""
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Client:
    """A ground station of few words, made of a plain socket and pymavlink's parser."""

    def __init__(self, port: int, *, system: int = 255, component: int = 190) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.connect(("127.0.0.1", port))
        self.socket.setblocking(False)
        self.mav = mav.MAVLink(None, srcSystem=system, srcComponent=component)
        self.mav.robust_parsing = True
        self.received: list[Any] = []

    def send(self, message: Any) -> None:
        self.socket.send(message.pack(self.mav))
        self.mav.seq = (self.mav.seq + 1) % 256

    def command(self, command: int, *params: float, target: tuple[int, int] = (1, 1)) -> None:
        padded = [*params, *[math.nan] * (7 - len(params))]
        self.send(mav.MAVLink_command_long_message(*target, command, 0, *padded))

    def poll(self) -> None:
        while True:
            try:
                data = self.socket.recv(65536)
            except (BlockingIOError, ConnectionRefusedError):
                return
            self.received += self.mav.parse_buffer(data) or []

    def of(self, name: str) -> list[Any]:
        return [message for message in self.received if message.get_type() == name]


class Ground:
    """The face of a vehicle on one udpin link, clients on it, and the flight going on between them."""

    def __init__(self, aircraft: Aircraft, **options: Any) -> None:
        self.port = free_port()
        self.link = f"udpin:127.0.0.1:{self.port}"
        self.face = MavlinkFace([self.link], Simulation(aircraft=aircraft), **options)
        self.wall = 1000.0
        self.clients: list[Client] = []

    def client(self, **ids: int) -> Client:
        client = Client(self.port, **ids)
        self.clients.append(client)
        return client

    def acknowledged(self, client: "Client", command: int, *params: float) -> Any:
        """Send a command and return its COMMAND_ACK."""
        count = len(client.of("COMMAND_ACK"))
        client.command(command, *params)
        self.until(lambda: len(client.of("COMMAND_ACK")) > count)
        return client.of("COMMAND_ACK")[-1]

    def until(self, condition: Callable[[], object]) -> None:
        """Let the face receive until the condition holds; simulated and its wall time stand still."""
        end = time.monotonic() + DEADLINE
        while not condition():
            assert time.monotonic() < end, "the condition never came true"
            self.face.receive(self.wall)
            for client in self.clients:
                client.poll()

    def heard(self, client: Client) -> Client:
        """Have the client greet, so that the link knows it."""
        before = self.rx
        client.send(mav.MAVLink_heartbeat_message(mav.MAV_TYPE_GCS, mav.MAV_AUTOPILOT_INVALID, 0, 0, 0, 3))
        self.until(lambda: self.rx > before)
        return client

    @staticmethod
    def at(seconds: float) -> Snapshot:
        """A snapshot at this simulated time."""
        return make_snapshot(time=seconds)

    @property
    def rx(self) -> int:
        return self.face.statistics()[self.link]["rx"]

    def fly(self, seconds: float, *, start: float = 0.0, rate: int = 400, speed: float = 1.0) -> None:
        """Publish every tick of so many simulated seconds, on an invented wall clock."""
        begun = self.wall
        for tick in range(round(seconds * rate) + 1):
            self.wall = begun + tick / rate / speed
            self.face.publish(self.at(start + tick / rate), self.wall)
            if tick % 20 == 0:
                for client in self.clients:
                    client.poll()
        for client in self.clients:
            client.poll()


@pytest.fixture
def ground(aircraft: Aircraft) -> Iterator[Callable[..., Ground]]:
    made: list[Ground] = []

    def make(**options: Any) -> Ground:
        made.append(Ground(aircraft, **options))
        return made[-1]

    yield make
    for ground in made:
        ground.face.close()
        for client in ground.clients:
            client.socket.close()


@pytest.fixture
def moment() -> Callable[..., Snapshot]:
    return make_snapshot


@pytest.fixture
def desk() -> Iterator[Desk]:
    """A vehicle on the ground and a ground station, in memory."""
    made = Desk()
    yield made
    made.close()
