"""The vehicle's MAVLink side as one object: links, routing, microservices, telemetry, servo input.

It never waits, and never raises for what arrives. Telemetry sees the flight through immutable snapshots; the services
give its commands to the simulation between two steps.
"""

import math
import socket
import time
import traceback
from collections.abc import Callable, Iterable, Sequence
from typing import Any, Final, Self, TypeVar

from sitl.flight_log.flight_log import FlightLog, rate_for
from sitl.hil.servo_input import ServoInput, Source
from sitl.mavlink.codec import MessageCodec, codec
from sitl.mavlink.command import Command, CommandService
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.frames import Frame, sequence_of
from sitl.mavlink.identity import PX4, Identity
from sitl.mavlink.links import Link, LinkSpec, Peer
from sitl.mavlink.message_interval import MessageIntervalService
from sitl.mavlink.network import Network
from sitl.mavlink.parameter import ParameterService
from sitl.mavlink.publisher import Publisher
from sitl.mavlink.router import targets_of
from sitl.mavlink.service import Handler, Sender, Service
from sitl.mavlink.services import microservices
from sitl.mavlink.servo_outputs import servo_input_handlers
from sitl.mavlink.signing import Signing
from sitl.mavlink.state_folder import StateFolder
from sitl.mavlink.statustext import StatusText
from sitl.mavlink.tape import Tape
from sitl.mavlink.telemetry.context import context_for
from sitl.mavlink.timers import Timer, Timers
from sitl.simulation import Simulation
from sitl.snapshot import Snapshot

__all__ = ["RELEASE_SERVOS", "MavlinkFace"]

AUTOPILOT: Final = mav.MAV_COMP_ID_AUTOPILOT1
RELEASE_SERVOS: Final = mav.MAV_CMD_USER_1

_UPDATE_PERIOD = 0.02  # of the services' look at the vehicle [s], simulated

_S = TypeVar("_S", bound=Service)


class MavlinkFace:
    """Everything the vehicle says and hears over MAVLink; the `Exchange` of its microservices.

    Attributes:
        servo_input: servo outputs of an outside controller.
        system, component: our ids.
        services: the microservices.
        context: what telemetry knows beside the snapshot.
        log: of the flight, kept while armed.
        restart_wanted: arguments for `Simulation.restart` that somebody has asked for, or None.
        stop_wanted: somebody has asked for the end of the process.
        internal_errors: how often a service failed at something; the vehicle flies on.

    See `sitl.mavlink.service.Exchange` for the rest.
    """

    def __init__(
        self,
        links: Iterable[str | LinkSpec | Link],
        simulation: Simulation,
        *,
        identity: Identity = PX4,
        system_id: int | None = None,
        servos_sysid: int | None = None,
        servo_timeout: float = 0.5,
        unix_epoch: float | None = None,
        speed: float = 1.0,
        lockstep: bool = False,
        signing: Signing | None = None,
        state: StateFolder | None = None,
        tape: Tape | None = None,
        on_text: Callable[[int, str], None] | None = None,
    ) -> None:
        """Open the links.

        Args:
            links: connection strings (see `sitl.mavlink.links.parse_link`), what they say, or open links.
            simulation: the vehicle.
            identity: whom it looks like.
            system_id: our MAVLink system id, by default the parameter MAV_SYS_ID; the component is 1, autopilot.
            servos_sysid: take servo outputs from this system only.
            servo_timeout: silence after which servo outputs are stale, simulated seconds at the requested speed.
            unix_epoch: UTC at simulated time zero [s since 1970]; the present if None.
            speed: simulated seconds per wall second asked for; inf is as fast as possible.
            lockstep: HIL_ACTUATOR_CONTROLS are ticks, answered by `answer`.
            signing: the key, if there is one, and what belongs to it.
            state: where parameters, missions, logs and files are kept; by default nothing outlives the process.
            tape: records all traffic.
            on_text: told (MAV_SEVERITY, text) what the pilot is told.

        Raises LinkError, and leaves nothing open, if a link cannot be had.
        """
        self._given_system = system_id
        self.system = system_id or 1
        self.component = AUTOPILOT
        self.simulation = simulation
        self.identity = identity
        self.speed = speed
        self.wall_time = time.monotonic()
        self.signing = signing or Signing()
        self._network = Network(links, self.system, AUTOPILOT, self.signing, tape)
        self.state = StateFolder() if state is None else state
        self._owns_state = state is None
        self.restart_wanted: dict[str, Any] | None = None
        self._on_refused: Callable[[str], None] | None = None
        self.stop_wanted = False
        self.internal_errors = 0
        self.context = context_for(simulation, time.time() if unix_epoch is None else unix_epoch)
        self.context.storage = self.state.folder
        self._timers = Timers()
        self._status_text = StatusText()
        self._on_text = on_text
        self._next_update = -math.inf  # simulated time [s]
        self.services: list[Service] = []
        self._publisher = Publisher(
            self._network, identity, self.context, self._note_error, speed=speed, lockstep=lockstep
        )
        self._servo_sender: tuple[Link, Peer] | None = None
        self.log = FlightLog(simulation, self.state.logs, rate=rate_for(speed), unix_epoch=self.context.unix_epoch)
        self.servo_input = ServoInput(
            simulation.aircraft.channels,
            self.statustext,
            system=servos_sysid,
            timeout=servo_timeout,
            speed=speed,
            lockstep=lockstep,
            fallback="autopilot flies" if simulation.autopilot else "last ones held",
        )
        self._servo_handlers = servo_input_handlers(self.servo_input)
        self._hil_answer = (codec("HIL_STATE_QUATERNION").id, codec("HIL_SENSOR").id)
        self._handlers: dict[int, tuple[MessageCodec, Handler]] = {}
        self._serve()

    def _serve(self) -> None:
        """Let every service fill its tables in."""
        self.services = microservices(self)
        commands, intervals = self.service(CommandService), self.service(MessageIntervalService)
        for service in self.services:
            self._handlers |= {codec(name).id: (codec(name), take) for name, take in service.messages().items()}
            self._publisher.builders |= {codec(name).id: build for name, build in service.telemetry().items()}
            commands.handlers.update(service.commands())
            intervals.on_request.update({codec(name).id: (codec(name), m) for name, m in service.requestable().items()})
        commands.handlers[RELEASE_SERVOS] = self._release_servos
        intervals.streamed = self.streamed
        intervals.streams = self._publisher.streams
        self._take_system_id()
        self._updated = [service for service in self.services if type(service).update is not Service.update]

    def _take_system_id(self) -> None:
        """Have the system id that was given, or that the parameters say at every beginning."""
        self.system = self._given_system or self.service(ParameterService).system_id or 1
        self._network.set_system(self.system)
        self.log.system = self.system

    def service(self, kind: type[_S]) -> _S:
        """The one microservice of a kind."""
        return next(service for service in self.services if isinstance(service, kind))

    def __enter__(self) -> Self:
        """Close the links at the end of a with block."""
        return self

    def __exit__(self, *_: object) -> None:
        """See __enter__."""
        self.close()

    @property
    def streamed(self) -> frozenset[int]:
        """Ids of the messages that can be streamed."""
        return frozenset(self._publisher.builders)

    @property
    def offered(self) -> frozenset[int]:
        """Ids of the messages that are sent on request."""
        on_request = (name for service in self.services for name in service.requestable())
        return self.streamed | {codec(name).id for name in on_request}

    # -- what the runtime calls ----------------------------------------------------------------------------------

    def sockets(self) -> list[socket.socket]:
        """Sockets that may have something to read, for select(); they change as peers come and go."""
        return self._network.sockets()

    def receive(self, wall_time: float) -> None:
        """Take in what has arrived on all links, without waiting, and answer it. `wall_time` is monotonic [s]."""
        self.wall_time = wall_time
        for frame, link, peer in self._network.receive(wall_time):
            self._guarded(lambda: self._take(frame, link, peer, wall_time))  # noqa: B023  (called at once)

    def attend(self, wall_time: float) -> None:
        """Do what the services have set a wall time for."""
        self.wall_time = wall_time
        if self._timers.next_due <= wall_time:
            self._timers.run(wall_time)

    def next_due(self) -> float:
        """Simulated time [s] at which the next periodic message is due."""
        return self._publisher.next_due()

    @property
    def next_attention(self) -> float:
        """Wall time [s] at which `attend` has something to do."""
        return self._timers.next_due

    def publish(self, snapshot: Snapshot, wall_time: float) -> None:
        """Send what is due at the snapshot's time, and by wall time what is due then (the heartbeat)."""
        self.wall_time = wall_time
        self._see(snapshot)
        self._publisher.publish(snapshot, self.servo_input.time_us, wall_time)
        if snapshot.time >= self._next_update:
            self._next_update = snapshot.time + _UPDATE_PERIOD
            for service in self._updated:
                self._guarded(lambda: service.update(snapshot))  # noqa: B023  (called at once)

    def answer(self, snapshot: Snapshot, wall_time: float) -> None:
        """In lockstep: tell the controller the state its tick has led to (HIL_STATE_QUATERNION, HIL_SENSOR)."""
        self.wall_time = wall_time
        self._see(snapshot)
        self._publisher.snapshot = snapshot
        if self._servo_sender is not None:
            link, peer = self._servo_sender
            made = (self._publisher.made(message_id) for message_id in self._hil_answer)
            link.send(peer, [message for message in made if message is not None])

    def restarted(self) -> None:
        """The simulation has begun anew: so do streams and services."""
        self.restart_wanted = None
        self._next_update = -math.inf
        self.context.restarted()
        self._publisher.restarted()
        for service in self.services:
            self._guarded(service.restarted)
        self._take_system_id()

    def restart_refused(self, reason: str) -> None:
        """The simulation cannot begin as somebody has asked: everything is as before."""
        self.restart_wanted = None
        if self._on_refused is not None:
            self._on_refused(f"not restarted: {reason}")

    def statistics(self) -> dict[str, dict[str, int]]:
        """Counters rx, tx, dropped, malformed, rejected of each link, by its connection string."""
        return self._network.statistics()

    def close(self) -> None:
        """Let the services end, and close all links."""
        for service in self.services:
            self._guarded(service.close)
        self._network.close()
        self.log.close()
        if self._owns_state:
            self.state.close()

    # -- what the microservices call (sitl.mavlink.service.Exchange) -----------------------------------------------

    @property
    def time_us(self) -> int:
        """Simulated time of the present state [us]."""
        return self.servo_input.time_us

    @property
    def links(self) -> Sequence[Link]:
        """See Exchange."""
        return self._network.links

    def reply(self, sender: Sender, name: str, **fields: Any) -> bool:
        """See Exchange."""
        packer = codec(name)
        if packer.has_target and "target_system" in packer.field_names:
            fields.setdefault("target_system", sender.system)
            if "target_component" in packer.field_names:
                fields.setdefault("target_component", sender.component)
        return sender.link.send(sender.peer, [(packer, packer.payload_of(**fields))])

    def broadcast(self, name: str, **fields: Any) -> None:
        """See Exchange."""
        packer = codec(name)
        self._network.to_everybody([(packer, packer.payload_of(**fields))])

    def tell(self, sender: Sender, severity: int, text: str) -> None:
        """See Exchange."""
        sender.link.send(sender.peer, self._status_text.messages(severity, text))

    def statustext(self, severity: int, text: str) -> None:
        """See Exchange."""
        self._network.to_everybody(self._status_text.messages(severity, text))
        self.log.text(severity, text)
        if self._on_text is not None:
            self._on_text(severity, text)

    def after(self, delay: float, call: Callable[[], None]) -> Timer:
        """See Exchange."""
        return self._timers.at(self.wall_time + delay, lambda: self._guarded(call))

    def telemetry(self, message_id: int) -> tuple[MessageCodec, bytes] | None:
        """See Exchange."""
        return self._publisher.made(message_id)

    def request_stop(self) -> None:
        """See Exchange."""
        self.stop_wanted = True

    def request_restart(self, refused: Callable[[str], None] | None = None, **how: Any) -> None:
        """See Exchange."""
        self.restart_wanted = how
        self._on_refused = refused

    # -- inside --------------------------------------------------------------------------------------------------

    def _take(self, frame: Frame, link: Link, peer: Peer, wall_time: float) -> None:
        message_id, system, component, payload, raw, is_known = frame
        servo_handler = self._servo_handlers.get(message_id)
        if servo_handler is not None:  # between a simulator and its controller: nobody else's matter
            source = Source(system, component, link.spec.text)
            servo_handler(payload, source, wall_time)
            if self.servo_input.source == source:
                self._servo_sender = (link, peer)
            return
        target = targets_of(frame)
        if target != (self.system, self.component):
            self._network.forward(frame, target, peer)
        if is_known and target[0] in (0, self.system) and target[1] in (0, self.component):
            served = self._handlers.get(message_id)
            if served is not None:
                packer, handler = served
                handler(packer.read(payload), Sender(system, component, link, peer, sequence_of(raw)))

    def _guarded(self, call: Callable[[], None]) -> None:
        """Whatever a service does wrong, the vehicle keeps flying and says so."""
        try:
            call()
        except Exception:  # noqa: BLE001
            self._note_error()

    def _note_error(self) -> None:
        """Tell of an error being handled, the first one with all its details, later ones less and less often."""
        self.internal_errors += 1
        if self.internal_errors == 1:
            traceback.print_exc()
        if self.internal_errors.bit_count() == 1:
            self.statustext(mav.MAV_SEVERITY_ERROR, f"Internal error {self.internal_errors} of the MAVLink side")

    def _see(self, snapshot: Snapshot) -> None:
        self.servo_input.time_us = round(snapshot.time * 1e6)
        self.context.note(snapshot)

    def _release_servos(self, command: Command) -> int:
        source = Source(command.sender.system, command.sender.component, command.sender.link.spec.text)
        return mav.MAV_RESULT_ACCEPTED if self.servo_input.release(source) else mav.MAV_RESULT_DENIED
