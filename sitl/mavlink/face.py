"""The vehicle's MAVLink side as one object: links, microservices, telemetry, servo input.

It never waits, never raises for what arrives, and sees the flight only through immutable snapshots.
"""

import math
import socket
import time
from collections.abc import Callable, Iterable, Sequence
from typing import Any, Final, Self

import numpy as np

from sitl.hil.hil_messages import hil_gps, hil_sensor, hil_state, hil_state_quaternion
from sitl.hil.servo_input import ServoInput, Source
from sitl.mavlink.codec import MessageCodec, codec, codec_by_id
from sitl.mavlink.command import Command, CommandService
from sitl.mavlink.context import Context, context_for
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.frames import Frame
from sitl.mavlink.heartbeat import HEARTBEAT_PERIOD, heartbeat
from sitl.mavlink.links import Link, LinkSpec, Peer, parse_link
from sitl.mavlink.mavlink_version import autopilot_version, protocol_version, register_old_requests
from sitl.mavlink.message_interval import DEFAULT_RATES, LinkStreams, MessageIntervalService
from sitl.mavlink.ping import PingService
from sitl.mavlink.service import Sender
from sitl.mavlink.servo_outputs import servo_input_handlers, servo_output_raw
from sitl.mavlink.statustext import StatusText
from sitl.mavlink.tcp import TcpIn, TcpOut
from sitl.mavlink.telemetry import (
    altitude,
    attitude,
    attitude_quaternion,
    global_position_int,
    local_position_ned,
    vfr_hud,
)  # fmt: skip
from sitl.mavlink.timesync import TimesyncService
from sitl.mavlink.udp import UdpIn, UdpOut
from sitl.mavlink.vehicle_status import extended_sys_state, named_value_float, sys_status, system_time, tilt_status
from sitl.snapshot import Snapshot
from vehicle_model.aircraft import Channel

__all__ = ["RELEASE_SERVOS", "TELEMETRY", "MavlinkFace"]

AUTOPILOT: Final = mav.MAV_COMP_ID_AUTOPILOT1
RELEASE_SERVOS: Final = mav.MAV_CMD_USER_1

_KINDS: dict[str, Callable[[LinkSpec, int, int], Link]] = {
    "udpout": UdpOut, "udpin": UdpIn, "tcpin": TcpIn, "tcpout": TcpOut,
}  # fmt: skip

# Every message that can be streamed, and who makes its fields from a snapshot.
TELEMETRY: dict[str, Callable[[Snapshot, Context], tuple[Any, ...]]] = {
    "HEARTBEAT": heartbeat,
    "SYS_STATUS": sys_status,
    "SYSTEM_TIME": system_time,
    "EXTENDED_SYS_STATE": extended_sys_state,
    "ATTITUDE": attitude,
    "ATTITUDE_QUATERNION": attitude_quaternion,
    "LOCAL_POSITION_NED": local_position_ned,
    "GLOBAL_POSITION_INT": global_position_int,
    "VFR_HUD": vfr_hud,
    "ALTITUDE": altitude,
    "SERVO_OUTPUT_RAW": servo_output_raw,
    "NAMED_VALUE_FLOAT": named_value_float,
    "TILT_STATUS": tilt_status,
    "HIL_STATE_QUATERNION": hil_state_quaternion,
    "HIL_STATE": hil_state,
    "HIL_SENSOR": hil_sensor,
    "HIL_GPS": hil_gps,
}

_USUAL_SPEED = 500.0  # as fast as possible, in multiples of real time
_SPEED_WINDOW = 0.05  # over which the speed reached is measured [s], wall time


class MavlinkFace:
    """Everything the vehicle says and hears over MAVLink.

    Attributes:
        servo_input: servo outputs of an outside controller.
        system, component: our ids.
    """

    def __init__(
        self,
        links: Iterable[str | LinkSpec],
        channels: Sequence[Channel],
        *,
        vehicle: np.ndarray,
        system_id: int = 1,
        servos_sysid: int | None = None,
        servo_timeout: float = 0.5,
        unix_epoch: float | None = None,
        speed: float = 1.0,
        lockstep: bool = False,
        autopilot: bool = False,
        on_text: Callable[[int, str], None] | None = None,
    ) -> None:
        """Open the links.

        Args:
            links: connection strings (see `sitl.mavlink.links.parse_link`), or what they say.
            channels: the aircraft's channel map, `Aircraft.channels`.
            vehicle: its VEHICLE record, shape (1,), `Aircraft.vehicle`.
            system_id: our MAVLink system id; the component is 1, autopilot.
            servos_sysid: take servo outputs from this system only.
            servo_timeout: silence after which servo outputs are stale, simulated seconds at the requested speed.
            unix_epoch: UTC at simulated time zero [s since 1970]; the present if None.
            speed: simulated seconds per wall second asked for; inf is as fast as possible.
            lockstep: HIL_ACTUATOR_CONTROLS are ticks, answered by `answer`.
            autopilot: the vehicle's own flight controller flies while nobody gives servo outputs.
            on_text: told (MAV_SEVERITY, text) what the pilot is told.

        Raises LinkError, and leaves nothing open, if a link cannot be had.
        """
        self.system = system_id
        self.component = AUTOPILOT
        self._context = context_for(vehicle, channels, time.time() if unix_epoch is None else unix_epoch)
        self._status_text = StatusText()
        self._on_text = on_text
        self._snapshot: Snapshot | None = None
        self._caps_rates = speed > 1.0 or lockstep
        # Until it is measured: the speed asked for, or about what a computer reaches.
        self._stretch = 1.0 if lockstep else max(1.0, min(speed, _USUAL_SPEED))
        self._speed_mark: tuple[float, float] | None = None  # wall time and simulated time of the last measurement
        self._next_heartbeat = -math.inf
        self._load_mark = (time.monotonic(), time.process_time())
        self._links: list[tuple[Link, LinkStreams]] = []
        try:
            for given in links:
                spec = parse_link(given) if isinstance(given, str) else given
                link = _KINDS[spec.kind](spec, system_id, AUTOPILOT)
                self._links.append((link, LinkStreams(DEFAULT_RATES[spec.streams])))
        except ValueError:
            self.close()
            raise

        self.servo_input = ServoInput(
            channels,
            self.statustext,
            system=servos_sysid,
            timeout=servo_timeout,
            speed=speed,
            lockstep=lockstep,
            fallback="autopilot flies" if autopilot else "last ones held",
        )
        self._servo_sender: tuple[Link, Peer] | None = None
        self._servo_handlers = servo_input_handlers(self.servo_input)

        commands = CommandService(self)
        intervals = MessageIntervalService(self, commands, frozenset(codec(name).id for name in TELEMETRY))
        for link, streams in self._links:
            intervals.add_link(link, streams)
        intervals.add_requestable("AUTOPILOT_VERSION", lambda: autopilot_version(system_id))
        intervals.add_requestable("PROTOCOL_VERSION", protocol_version)
        register_old_requests(commands, intervals.request)
        commands.register(RELEASE_SERVOS, self._release_servos)
        self._handlers: dict[int, Callable[[bytes, Sender], None]] = {
            mav.MAVLINK_MSG_ID_COMMAND_LONG: commands.on_command_long,
            mav.MAVLINK_MSG_ID_COMMAND_INT: commands.on_command_int,
            mav.MAVLINK_MSG_ID_PING: PingService(self).on_ping,
            mav.MAVLINK_MSG_ID_TIMESYNC: TimesyncService(self).on_timesync,
        }
        self._telemetry = {codec(name).id: make for name, make in TELEMETRY.items()}
        self._hil_answer = (codec("HIL_STATE_QUATERNION").id, codec("HIL_SENSOR").id)

    def __enter__(self) -> Self:
        """Close the links at the end of a with block."""
        return self

    def __exit__(self, *_: object) -> None:
        """See __enter__."""
        self.close()

    # -- what the runtime calls ----------------------------------------------------------------------------------

    def sockets(self) -> list[socket.socket]:
        """Sockets that may have something to read, for select(); they change as peers come and go."""
        return [open_socket for link, _ in self._links for open_socket in link.sockets]

    def receive(self, wall_time: float) -> None:
        """Take in what has arrived on all links, without waiting, and answer it. `wall_time` is monotonic [s]."""
        for link, _ in self._links:
            for peer, data in link.receive(wall_time):
                scanner = peer.scanner
                malformed = scanner.malformed
                frames = scanner.scan(data)
                link.malformed += scanner.malformed - malformed
                if frames:
                    link.believe(peer, wall_time)
                    link.rx += len(frames)
                    for frame in frames:
                        self._take(frame, link, peer, wall_time)

    def next_due(self) -> float:
        """Simulated time [s] at which the next periodic message is due."""
        return min((streams.next_due_us for _, streams in self._links), default=math.inf) * 1e-6

    def publish(self, snapshot: Snapshot, wall_time: float) -> None:
        """Send what is due at the snapshot's time, and by wall time what is due then (the heartbeat)."""
        self._see(snapshot)
        now_us = self.servo_input.time_us
        if self._caps_rates:
            self._measure_speed(snapshot.time, wall_time)
        is_heartbeat_due = wall_time >= self._next_heartbeat
        if is_heartbeat_due:
            self._keep_house(wall_time)
        payloads: dict[int, tuple[MessageCodec, bytes]] = {}
        for link, streams in self._links:
            due = streams.take_due(now_us, self._stretch) if streams.next_due_us <= now_us else []
            if is_heartbeat_due:
                due.insert(0, mav.MAVLINK_MSG_ID_HEARTBEAT)
            if due:
                audience = link.audience
                if audience:
                    for message_id in due:
                        if message_id not in payloads:
                            payloads[message_id] = self._made(message_id, snapshot)
                    messages = [payloads[message_id] for message_id in due]
                    for peer in audience:
                        link.send(peer, messages)

    def answer(self, snapshot: Snapshot, wall_time: float) -> None:
        """In lockstep: tell the controller the state its tick has led to (HIL_STATE_QUATERNION, HIL_SENSOR)."""
        del wall_time
        self._see(snapshot)
        if self._servo_sender is not None:
            link, peer = self._servo_sender
            link.send(peer, [self._made(message_id, snapshot) for message_id in self._hil_answer])

    def statustext(self, severity: int, text: str) -> None:
        """Send a text for the pilot (severity as MAV_SEVERITY) to everybody on all links."""
        messages = self._status_text.messages(severity, text)
        for link, _ in self._links:
            for peer in link.audience:
                link.send(peer, messages)
        if self._on_text is not None:
            self._on_text(severity, text)

    def statistics(self) -> dict[str, dict[str, int]]:
        """Counters rx, tx, dropped, malformed of each link, by its connection string."""
        return {link.spec.text: link.statistics() for link, _ in self._links}

    def close(self) -> None:
        """Close all links."""
        for link, _ in self._links:
            link.close()

    # -- what the microservices call (sitl.mavlink.service.Exchange) -----------------------------------------------

    @property
    def time_us(self) -> int:
        """Simulated time of the present state [us]."""
        return self.servo_input.time_us

    def reply(self, sender: Sender, name: str, **fields: Any) -> None:
        """Send one message to the sender of another, and to nobody else."""
        packer = codec(name)
        sender.link.send(sender.peer, [(packer, packer.payload_of(**fields))])

    def is_for_us(self, target_system: int, target_component: int) -> bool:
        """Whether a message with this target is ours to answer (0 means everybody)."""
        return target_system in (0, self.system) and target_component in (0, self.component)

    def telemetry(self, message_id: int) -> tuple[MessageCodec, bytes] | None:
        """A streamed message as it would be sent now; None before the first snapshot."""
        return None if self._snapshot is None else self._made(message_id, self._snapshot)

    # -- inside --------------------------------------------------------------------------------------------------

    def _take(self, frame: Frame, link: Link, peer: Peer, wall_time: float) -> None:
        message_id, system, component, payload = frame
        if system == self.system and component == self.component:
            return  # our own words, come back over some router
        servo_handler = self._servo_handlers.get(message_id)
        if servo_handler is not None:
            source = Source(system, component, link.spec.text)
            servo_handler(payload, source, wall_time)
            if self.servo_input.source == source:
                self._servo_sender = (link, peer)
            return
        handler = self._handlers.get(message_id)
        if handler is not None:
            handler(payload, Sender(system, component, link, peer))

    def _see(self, snapshot: Snapshot) -> None:
        self._snapshot = snapshot
        self.servo_input.time_us = round(snapshot.time * 1e6)
        self._context.note(snapshot)

    def _made(self, message_id: int, snapshot: Snapshot) -> tuple[MessageCodec, bytes]:
        packer = codec_by_id(message_id)
        return packer, packer.payload(self._telemetry[message_id](snapshot, self._context))

    def _measure_speed(self, simulated: float, wall_time: float) -> None:
        if self._speed_mark is None:
            self._speed_mark = (wall_time, simulated)
            return
        elapsed = wall_time - self._speed_mark[0]
        if elapsed >= _SPEED_WINDOW:
            self._stretch = max(1.0, (simulated - self._speed_mark[1]) / elapsed)
            self._speed_mark = (wall_time, simulated)

    def _keep_house(self, wall_time: float) -> None:
        """Once per heartbeat: forget silent peers, sum up what SYS_STATUS reports."""
        self._next_heartbeat = wall_time + HEARTBEAT_PERIOD
        for link, _ in self._links:
            link.forget_silent(wall_time)
        self._context.received = sum(link.rx for link, _ in self._links)
        self._context.malformed = sum(link.malformed for link, _ in self._links)
        wall, processor = self._load_mark
        now = (time.monotonic(), time.process_time())
        if now[0] > wall:
            self._context.load = (now[1] - processor) / (now[0] - wall)
        self._load_mark = now

    def _release_servos(self, command: Command) -> int:
        source = Source(command.sender.system, command.sender.component, command.sender.link.spec.text)
        return mav.MAV_RESULT_ACCEPTED if self.servo_input.release(source) else mav.MAV_RESULT_DENIED
