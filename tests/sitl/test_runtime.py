"""The loop on invented time with the real simulation and real UDP: what leaves when, and what cannot stop it."""

import io
import math
import socket
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from sitl import Simulation
from sitl.clock import Clock
from sitl.mavlink import MavlinkFace
from sitl.mavlink.dialect import tiltwing as mav
from sitl.runtime import Runtime
from sitl.status import Status
from sitl.viewer import open_viewer
from vehicle_model.aircraft import Aircraft, load_aircraft


class Wall:
    """A wall clock that only sleeping moves; `delay` says how much too late each sleep ends."""

    def __init__(self, delay: Callable[[int], float] = lambda _: 0.0) -> None:
        self.now = 1000.0
        self.sleeps = 0
        self._delay = delay

    def monotonic(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.sleeps += 1
        self.now += seconds + self._delay(self.sleeps)


class Flight:
    """A vehicle in cruise whose one link ends in a socket of ours."""

    def __init__(
        self, aircraft: Aircraft, wall: Wall, duration: float, speed: float = 1.0, *, autopilot: bool = False
    ) -> None:
        self.simulation = Simulation(aircraft=aircraft, start="trim:25", autopilot=autopilot)
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.setblocking(False)
        self.face = MavlinkFace(
            [f"udpout:127.0.0.1:{self.socket.getsockname()[1]}"],
            self.simulation,
            speed=speed,
            unix_epoch=0.0,
            on_text=lambda _, text: self.said.append((self.simulation.time, text)),
        )
        self.said: list[tuple[float, str]] = []  # with the simulated time
        self.output = io.StringIO()
        self.status = Status(self.output)
        self.clock = Clock(speed, self.simulation.rate, monotonic=wall.monotonic)
        viewer = open_viewer("off", aircraft)
        self.runtime = Runtime(
            self.simulation,
            self.face,
            self.clock,
            viewer,
            self.status,
            duration=duration,
            wait=lambda _, seconds: wall.sleep(seconds),
        )

    def run(self) -> list[Any]:
        """Fly to the end; the messages that arrived."""
        self.runtime.run()
        self.status.close()
        parser = mav.MAVLink(None)
        messages: list[Any] = []
        while True:
            try:
                messages += parser.parse_buffer(self.socket.recv(1 << 16)) or []
            except BlockingIOError:
                return messages

    def close(self) -> None:
        self.status.close()
        self.face.close()
        self.socket.close()


Fly = Callable[..., Flight]


@pytest.fixture
def flight() -> Iterator[Fly]:
    aircraft = load_aircraft()
    flights: list[Flight] = []

    def begin(wall: Wall, duration: float, speed: float = 1.0, **options: bool) -> Flight:
        flights.append(Flight(aircraft, wall, duration, speed, **options))
        return flights[-1]

    yield begin
    for each in flights:
        each.close()


def times(messages: list[Any], kind: str) -> list[int]:
    return [message.time_boot_ms for message in messages if message.get_type() == kind]


@pytest.mark.parametrize("delay", [0.0, 0.0004, 0.03])
def test_messages_leave_on_their_grid_of_simulated_time_however_late_the_host_wakes(flight: Fly, delay: float) -> None:
    flown = flight(Wall(lambda _: delay), 2.0)
    attitude = times(flown.run(), "ATTITUDE")  # 50 Hz on this link
    assert attitude == list(range(0, 2001, 20))


def test_the_flight_is_the_same_to_the_last_bit_on_a_calm_and_on_a_stumbling_host(flight: Fly) -> None:
    calm = flight(Wall(), 2.0)
    stumbling = flight(Wall(lambda count: 0.2 if count % 7 == 0 else 0.0), 2.0)
    calm.run()
    stumbling.run()
    assert stumbling.clock.late_ticks > 0
    assert stumbling.simulation.tick == calm.simulation.tick == 800
    assert stumbling.simulation.state.tobytes() == calm.simulation.state.tobytes()


@pytest.mark.parametrize("speed", [1.0, 7.0, math.inf])
def test_with_the_autopilot_flying_the_flight_at_any_speed_is_that_in_process_to_the_last_bit(
    flight: Fly, speed: float
) -> None:
    flown = flight(Wall(lambda count: 0.05 if count % 11 == 0 else 0.0), 3.0, speed, autopilot=True)
    flown.run()
    alone = Simulation(aircraft=flown.simulation.aircraft, start="trim:25")
    alone.advance(3.0)
    assert flown.simulation.tick == alone.tick
    assert flown.simulation.state.tobytes() == alone.state.tobytes()


def test_a_host_that_stands_still_for_long_loses_wall_time_not_its_senses(flight: Fly) -> None:
    wall = Wall(lambda count: 30.0 if count == 100 else 0.0)
    flown = flight(wall, 1.0)
    begin = wall.now
    flown.run()
    assert flown.simulation.tick == 400
    assert flown.clock.dropped_ticks == pytest.approx(30 * 400, abs=2)
    assert wall.now - begin == pytest.approx(31.0, abs=0.01)


@pytest.mark.parametrize("speed", [0.5, 4.0])
def test_wall_time_is_simulated_time_over_speed(flight: Fly, speed: float) -> None:
    wall = Wall()
    flown = flight(wall, 4.0, speed)
    begin = wall.now
    flown.run()
    assert wall.now - begin == pytest.approx(4.0 / speed, abs=0.01)


def test_as_fast_as_possible_never_sleeps_and_ends_exactly_at_the_duration(flight: Fly) -> None:
    wall = Wall()
    flown = flight(wall, 7.77, math.inf)
    flown.run()
    assert wall.sleeps == 0
    assert flown.simulation.tick == 3108
    assert "Flew 7.77 s" in flown.output.getvalue()


def test_servo_outputs_reach_the_model_and_stay_until_the_next(flight: Fly) -> None:
    flown = flight(Wall(), 1.0)
    vehicle = flown.face.sockets()[0].getsockname()[1]
    sender = mav.MAVLink(None, srcSystem=42)
    controls = [0.3, 0.4, 0.0, *[0.0] * 13]
    frame = mav.MAVLink_hil_actuator_controls_message(0, controls, 129, 0).pack(sender)
    flown.socket.sendto(frame, ("127.0.0.1", vehicle))
    messages = flown.run()
    assert flown.simulation.controls[:2] == pytest.approx([0.3, 0.4], abs=1e-6)
    texts = [message.text for message in messages if message.get_type() == "STATUSTEXT"]
    assert any("Servos taken by 42/0" in text for text in texts)
    assert any("No servo outputs" in text for text in texts)


def send_servos(flown: Flight, controls: list[float]) -> None:
    """Outputs of an outside controller, system 42."""
    vehicle = flown.face.sockets()[0].getsockname()[1]
    frame = mav.MAVLink_hil_actuator_controls_message(0, controls, 129, 0).pack(mav.MAVLink(None, srcSystem=42))
    flown.socket.sendto(frame, ("127.0.0.1", vehicle))


def test_servo_outputs_take_the_actuators_from_the_autopilot_until_they_are_stale(flight: Fly) -> None:
    flown = flight(Wall(), 3.0, autopilot=True)
    trimmed = flown.simulation.aircraft.normalised_outputs(flown.simulation.controls)
    send_servos(flown, [*trimmed, *[0.0] * (16 - len(trimmed))])
    messages = flown.run()
    (_, taken), (silent, text) = flown.said[:2]
    assert "Servos taken by 42/0" in taken
    assert "No servo outputs for 0.5 s: autopilot flies" in text
    assert silent == pytest.approx(0.5, abs=0.01)
    assert not flown.simulation.is_flown_from_outside
    assert flown.simulation.snapshot().mode == "HOLD"
    assert 19.0 < flown.simulation.snapshot().airspeed < 25.0  # on its way to FW_AIRSPD_TRIM
    heartbeats = [message for message in messages if message.get_type() == "HEARTBEAT"]
    manual, *hold = [beat.custom_mode for beat in heartbeats]
    assert (manual, set(hold)) == (1 << 16, {4 << 16 | 3 << 24})  # PX4's numbers
    assert all(beat.base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED for beat in heartbeats)


@pytest.mark.parametrize("speed", [1.0, 5.0])
def test_the_silence_of_a_controller_is_said_after_half_a_simulated_second_at_any_speed(
    flight: Fly, speed: float
) -> None:
    flown = flight(Wall(), 2.0, speed)
    vehicle = flown.face.sockets()[0].getsockname()[1]
    frame = mav.MAVLink_hil_actuator_controls_message(0, [0.3] * 16, 129, 0).pack(mav.MAVLink(None, srcSystem=42))
    flown.socket.sendto(frame, ("127.0.0.1", vehicle))
    flown.run()
    (taken, _), (silent, text) = flown.said
    assert "No servo outputs for 0.5 s" in text
    # A turn of the loop advances as many ticks as the speed is a multiple of real time.
    assert silent - taken == pytest.approx(0.5, abs=2.0 * speed / 400)
