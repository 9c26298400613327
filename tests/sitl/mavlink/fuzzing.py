"""Noise, and well-formed messages with arbitrary fields: what a vehicle in flight must bear without a scratch.

`make fuzz` throws ten million bytes and a million messages at one; the tests take a fraction of that.
"""

import argparse
import math
import random
import struct
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from sitl.mavlink.codec import MAGIC_V1, MAGIC_V2, codec_by_id
from sitl.mavlink.command import CommandService
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.identity import PX4, Identity
from sitl.mavlink.links import Peer
from sitl.mavlink.service import Service
from sitl.simulation import Simulation
from tests.sitl.mavlink.in_memory import Desk, MemoryLink, Station

__all__ = ["COMMANDING", "HARMLESS", "Outcome", "any_storm", "harmless_storm", "served_messages"]

MISSION = Path(__file__).parents[3] / "docs" / "examples" / "survey_3km.plan"
TURN = 0.02  # [s] of flight
SENDERS = 4
FLIGHT_TURNS = 10_000  # 200 s: most of the mission

# Messages by which somebody may have the vehicle do something, so that they must leave the flight as it is only when
# they are meant for somebody else, and those of them which say nothing that anybody has to do.
COMMANDING = frozenset({
    "COMMAND_LONG", "COMMAND_INT", "COMMAND_CANCEL", "SET_MODE", "PARAM_SET",
    "MISSION_COUNT", "MISSION_ITEM", "MISSION_ITEM_INT", "MISSION_CLEAR_ALL", "MISSION_SET_CURRENT",
    "MISSION_WRITE_PARTIAL_LIST", "SET_ATTITUDE_TARGET", "SET_POSITION_TARGET_GLOBAL_INT",
    "SET_POSITION_TARGET_LOCAL_NED", "MANUAL_CONTROL", "RC_CHANNELS_OVERRIDE", "SET_HOME_POSITION",
    "SET_GPS_GLOBAL_ORIGIN", "SETUP_SIGNING",
    "HEARTBEAT",  # of a ground station, which is missed when it stops
    "SERVO_OUTPUT_RAW", "HIL_ACTUATOR_CONTROLS", "HIL_CONTROLS",
})  # fmt: skip
# Messages that the vehicle serves, and that leave the flight as it is whatever they hold.
HARMLESS = frozenset({
    "REQUEST_DATA_STREAM", "PARAM_REQUEST_LIST", "PARAM_REQUEST_READ", "MISSION_ACK", "MISSION_REQUEST",
    "MISSION_REQUEST_INT", "MISSION_REQUEST_LIST", "MISSION_REQUEST_PARTIAL_LIST", "REQUEST_EVENT",
    "FILE_TRANSFER_PROTOCOL", "TIMESYNC", "PING", "TERRAIN_CHECK", "HIL_STATE", "HIL_STATE_QUATERNION",
    "AUTOPILOT_VERSION_REQUEST",
    "SERIAL_CONTROL",  # no noise is a line of the shell
    "OPEN_DRONE_ID_BASIC_ID", "OPEN_DRONE_ID_OPERATOR_ID", "OPEN_DRONE_ID_SELF_ID", "OPEN_DRONE_ID_SYSTEM",
    "OPEN_DRONE_ID_SYSTEM_UPDATE",
    "LOG_REQUEST_LIST", "LOG_REQUEST_DATA", "LOG_REQUEST_END", "LOG_ERASE", "LOGGING_ACK",
})  # fmt: skip
TARGETS = ((1, 1), (1, 1), (1, 1), (1, 0), (0, 0), (0, 1), (2, 1), (1, 154), (255, 190), (77, 3))
FLOATS = (0.0, 1.0, -1.0, 2.0, 30.0, math.nan, math.inf, -math.inf, 3.4e38, -3.4e38, 1e-45, 1e9, -0.0)
MODEST_FLOATS = (0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 3.0, 4.0, 6.0, 20.0, 60.0, math.nan, 47.4, 8.5)
PLACES = (473_977_418, 85_455_939, 474_008_897, 85_522_173)  # home and nearby [1e-7 deg]
INTEGERS = {"b": 8, "B": 8, "h": 16, "H": 16, "i": 32, "I": 32, "q": 64, "Q": 64}
MESSAGES = tuple(sorted(mav.mavlink_map))
NAMES = {message.msgname: number for number, message in mav.mavlink_map.items()}


def served_messages(desk: Desk) -> set[str]:
    """All messages that some service takes, or who serves the actuators."""
    services: list[Service] = desk.face.services
    actuators = {"SERVO_OUTPUT_RAW", "HIL_ACTUATOR_CONTROLS", "HIL_CONTROLS", "HIL_STATE", "HIL_STATE_QUATERNION"}
    return {name for service in services for name in service.messages()} | actuators


class Fuzzer:
    """Makes what to send; the same seed makes the same. Nine commands of ten are among `commands`."""

    def __init__(self, seed: int, commands: Sequence[int]) -> None:
        self.random = random.Random(seed)
        self.commands = commands
        self._is_modest = False

    def noise(self, size: int) -> Iterator[bytes]:
        """Datagrams of this many bytes together: noise, noise that begins like frames, and spoiled frames."""
        chance = self.random
        while size > 0:
            data = chance.randbytes(min(chance.randrange(1, 600), size))
            kind = chance.randrange(5)
            if kind == 1:
                data = bytes((chance.choice((MAGIC_V1, MAGIC_V2)), chance.randrange(256), chance.randrange(3))) + data
            elif kind == 2:
                data = data.replace(bytes((chance.randrange(256),)), bytes((MAGIC_V2,)))
            elif kind == 3:
                data = self._spoiled(self.frame(chance.choice(MESSAGES), {})) + data
            elif kind == 4:
                data = bytes((MAGIC_V2,)) * len(data)
            data = data[:size]
            size -= len(data)
            yield data

    def _spoiled(self, frame: bytes) -> bytes:
        spoiled = bytearray(frame)
        if self.random.random() < 0.5:
            del spoiled[self.random.randrange(1, len(spoiled)) :]
        else:
            spoiled[self.random.randrange(1, len(spoiled))] ^= 1 << self.random.randrange(8)
        return bytes(spoiled)

    def message(self, *, commanding: bool) -> bytes:
        """A well-formed frame of any message of the dialect, or of an unknown one, with arbitrary fields.

        `commanding`: also one that may command something.
        """
        chance = self.random
        if chance.random() < 0.02:
            return self._unknown()
        # A third of them are commands, a third of the few that somebody serves.
        kind = chance.randrange(3)
        if kind == 0:
            number = NAMES[chance.choice(("COMMAND_LONG", "COMMAND_INT"))]
        else:
            number = NAMES[chance.choice(SERVED)] if kind == 1 else chance.choice(MESSAGES)
        fields = self.fields(number)
        if not commanding and mav.mavlink_map[number].msgname in COMMANDING:
            if "target_system" not in fields:
                return self.message(commanding=False)
            fields["target_system"] = chance.choice((2, 3, 77, 255))
        return self.frame(number, fields)

    def frame(self, number: int, fields: Mapping[str, Any]) -> bytes:
        """A frame from any sender."""
        chance, packer = self.random, codec_by_id(number)
        sender = chance.choice((255, 254, 2, 77, 200, chance.randrange(2, 256))), chance.choice((190, 0, 1, 191))
        if not fields or chance.random() < 0.1:
            payload = chance.randbytes(packer.size) if not fields else packer.payload_of(**fields) + b"\0" * 3
        else:
            payload = packer.payload_of(**fields)
        return packer.frame(payload[:255], chance.randrange(256), *sender)

    def fields(self, number: int) -> dict[str, Any]:
        """Arbitrary values; those of every second message could be meant."""
        message = mav.mavlink_map[number]
        self._is_modest = self.random.random() < 0.5
        kinds = iter(message.native_format.decode()[1:])
        values: dict[str, Any] = {}
        for name, length in zip(message.ordered_fieldnames, message.array_lengths, strict=True):
            kind = next(kinds)
            if kind == "c":
                values[name] = self._text(max(length, 1))
            else:
                values[name] = [self._number(kind) for _ in range(length)] if length else self._number(kind)
        if "target_system" in values:
            values["target_system"], component = self.random.choice(TARGETS)
            if "target_component" in values:
                values["target_component"] = component
        if message.msgname in ("COMMAND_LONG", "COMMAND_INT") and self.random.random() < 0.9:
            values["command"] = self.random.choice(self.commands)
        return values

    def _number(self, kind: str) -> float:
        chance = self.random
        if self._is_modest:
            if kind in "fd":
                return chance.choice(MODEST_FLOATS)
            return chance.choice(PLACES) if kind == "i" and chance.random() < 0.5 else chance.randrange(8)
        if kind in "fd":
            which = chance.randrange(4)
            if which == 0:
                return struct.unpack("<f", chance.randbytes(4))[0]
            return chance.choice(FLOATS) if which == 1 else chance.uniform(-100.0, 100.0) if which == 2 else 0.0
        bits = INTEGERS[kind]
        low = -(1 << (bits - 1)) if kind.islower() else 0
        which = chance.randrange(4)
        if which == 0:
            return low + chance.getrandbits(bits)
        return chance.choice((low, low + (1 << bits) - 1)) if which == 1 else chance.randrange(8) if which == 2 else 0

    def _text(self, size: int) -> bytes:
        chance = self.random
        return chance.choice((b"", b"WV_EN", b"_HASH_CHECK", b"NAN", chance.randbytes(size)))[:size]

    def _unknown(self) -> bytes:
        body = struct.pack("<BBBBBBHB", 20, 0, 0, 0, 255, 190, self.random.randrange(40_000, 50_000), 0)
        return bytes((MAGIC_V2,)) + body + self.random.randbytes(22)


SERVED = tuple(sorted((COMMANDING | HARMLESS) - {"SETUP_SIGNING"}))


class Deaf(Station):
    """A station that hears nothing: to take apart what comes would cost more than all the rest."""

    def hear(self, data: bytes) -> None:
        """Let it go."""


class Storm:
    """A vehicle in flight and what several senders throw at it."""

    def __init__(self, simulation: Simulation, seed: int, identity: Identity) -> None:
        self.desk = Desk(simulation, links=[MemoryLink("memory:1"), MemoryLink("memory:2")], identity=identity)
        self.fuzzer = Fuzzer(seed, sorted(self.desk.face.service(CommandService).handlers))
        self.peers: list[Peer] = []
        self.desk.links[0].stations.clear()
        for number in range(SENDERS):
            station = Deaf(self.desk, self.desk.links[number % 2], 200 + number, 190)
            self.peers.append(station.peer)
        self.flights = 1
        self.turns = 0

    def throw(self, data: bytes) -> None:
        """Have a datagram arrive from anybody."""
        number = self.fuzzer.random.randrange(len(self.peers))
        self.desk.links[number % 2].arrived.append((self.peers[number], data))

    def fly(self) -> None:
        """One turn of flight, with all that has been thrown."""
        self.turns += 1
        self.desk.turn()
        self.desk.advance(TURN)

    def fly_again_if_need_be(self) -> None:
        """Begin anew in the air after a landing, or once somebody has locked all others out."""
        signing, simulation = self.desk.face.signing, self.desk.simulation
        if signing.is_on:
            signing.set_key(None)
        if not simulation.flight.armed:
            simulation.restart("trim:20")
            self.desk.face.restarted()
            self.flights += 1

    def outcome(self, noise: int, messages: int, *, unchanged: bool | None) -> "Outcome":
        """What has come of it; the vehicle's links are closed."""
        desk = self.desk
        desk.close()
        received, malformed = (sum(getattr(link, name) for link in desk.links) for name in ("rx", "malformed"))
        errors, simulated = desk.face.internal_errors, self.turns * TURN
        return Outcome(noise, messages, received, malformed, errors, unchanged, simulated, self.flights)


def moment(simulation: Simulation) -> bytes:
    """The whole state of the vehicle and its setpoint, bit by bit."""
    airframe = simulation.airframe
    return airframe.craft.tobytes() + airframe.setpoint.tobytes()


class Outcome(NamedTuple):
    """What was thrown, what has come of it: messages received, services that failed, how many flights it took.

    `unchanged`: the flight is the same bit by bit; None where messages might change it.
    """

    noise: int
    messages: int
    received: int
    malformed: int
    errors: int
    unchanged: bool | None
    simulated: float
    flights: int


def harmless_storm(seed: int, noise: int, messages: int, turns: int, identity: Identity = PX4) -> Outcome:
    """A mission flown in a storm of noise and of messages that command nothing, beside one flown in peace."""
    calm, rough = mission_begun(), mission_begun()
    storm = Storm(rough, seed, identity)
    fuzzer = storm.fuzzer
    datagrams = fuzzer.noise(noise)
    unchanged = True
    for turn in range(turns):
        for _ in range(noise * (turn + 1) // turns // 300 - noise * turn // turns // 300):
            data = next(datagrams, b"")
            storm.throw(data)
        for _ in range(messages * (turn + 1) // turns - messages * turn // turns):
            storm.throw(fuzzer.message(commanding=False))
        storm.fly()
        calm.advance(TURN)
        unchanged = unchanged and moment(calm) == moment(rough)
    for data in datagrams:
        storm.throw(data)
    storm.fly()
    calm.advance(TURN)
    unchanged = unchanged and moment(calm) == moment(rough) and same_flight(calm, rough)
    return storm.outcome(noise, messages, unchanged=unchanged)


def any_storm(seed: int, messages: int, turns: int, identity: Identity = PX4) -> Outcome:
    """A flight with any message there is, commands too; whenever it has ended another one begins."""
    storm = Storm(Simulation(start="trim:20"), seed, identity)
    for turn in range(turns):
        for _ in range(messages * (turn + 1) // turns - messages * turn // turns):
            storm.throw(storm.fuzzer.message(commanding=True))
        storm.fly()
        storm.fly_again_if_need_be()
    return storm.outcome(0, messages, unchanged=None)


def mission_begun() -> Simulation:
    """A vehicle on the ground, armed, about to fly a mission."""
    simulation = Simulation(wind=(3.0, -2.0, 0.0))
    simulation.load_plan(MISSION)
    simulation.flight.start_mission()
    simulation.flight.arm()
    return simulation


def same_flight(one: Simulation, other: Simulation) -> bool:
    """Whether two flights are at the same point of the same plans, with the same parameters."""
    first, second = one.flight, other.flight
    return (
        [first.parameters[name] for name in first.parameters.names()]
        == [second.parameters[name] for name in second.parameters.names()]
        and (first.mode, first.armed, first.mission.current, first.mission.items, first.rally.points)
        == (second.mode, second.armed, second.mission.current, second.mission.items, second.rally.points)
        and one.items_reached == other.items_reached
    )


def main() -> int:
    """The whole storm; exit code 1 if the vehicle minded."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bytes", type=float, default=1e7, help="of noise [1e7]")
    parser.add_argument("--messages", type=float, default=1e6, help="well-formed, half of them any there is [1e6]")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    half = int(options.messages) // 2
    begin = time.monotonic()
    calm = harmless_storm(options.seed, int(options.bytes), half, FLIGHT_TURNS)
    print(f"noise and messages that command nothing: {calm}", flush=True)
    rough = any_storm(options.seed + 1, half, FLIGHT_TURNS)
    print(f"any messages: {rough}")
    print(f"{time.monotonic() - begin:.0f} s")
    return int(not calm.unchanged or calm.errors + rough.errors > 0)


if __name__ == "__main__":
    sys.exit(main())
