"""A vehicle at the other end of a MAVLink link: finding it, hearing it, asking it until it answers.

What every ground program stands on. It is the ground station 255/190, says so by HEARTBEAT once a second, talks to one
vehicle and ignores what others on the same link send.
"""

import importlib.util
import itertools
import os
import re
import socket
import time
from collections.abc import Callable, Collection, Generator
from contextlib import contextmanager
from functools import cache
from typing import Any, TypeVar

from pymavlink import mavutil
from pymavlink.dialects.v20 import all as mav

from gcs_scripts.errors import GroundError, LinkLostError, RefusedError, UnansweredError
from gcs_scripts.status_text import StatusTexts

__all__ = ["DEFAULT_CONNECTION", "OWN_SYSTEM", "Vehicle", "connect", "enum_name", "message_id"]

DEFAULT_CONNECTION = "udpin:127.0.0.1:14550"
OWN_SYSTEM, OWN_COMPONENT = 255, mav.MAV_COMP_ID_MISSIONPLANNER  # as QGroundControl
HEARTBEAT_INTERVAL = 1.0  # [s]
SEARCH_INTERVAL = 0.2  # [s] between heartbeats while no vehicle is known: one that listens must hear us first
RETRY = 0.5  # [s], wall time, after which an unanswered message is sent again
PROGRESS_RETRY = 3.0  # [s] after which a command is that was IN_PROGRESS: its last acknowledgement may have got lost
SILENCE = 3.0  # [s] without HEARTBEAT after which a vehicle counts as lost, as MAVSDK does
REASON_WAIT = 0.3  # [s] after a refusal in which the vehicle may still say why
FLOOD = 1.0  # [s] beyond a wait's end for which messages that nobody wants are still read
RECEIVE_BUFFER = 4 << 20  # bytes: a second of everything at many times real time, should we be kept from reading
NETWORK = re.compile(r"(udpin|udpout|udp|tcp|tcpin):([^:]+):(\d+)")
SERIAL = re.compile(r"(/dev/[^,]+|COM\d+)(?:,(\d+))?")


class Vehicle:
    """One vehicle.

    Attributes:
        system, component: its MAVLink ids; commands are addressed to them.
        heartbeat: its latest HEARTBEAT.
        heard: monotonic time of that [s].
        timeout: wall time [s] without what was waited for until an error is raised.
        texts: what it has said by STATUSTEXT.
        on_message: called with every message on the link, also other systems' (their MAVLink ids are in its header).
    """

    def __init__(self, link: Any, text: str, timeout: float, system: int | None = None) -> None:
        """Wait for the first vehicle's HEARTBEAT, or that of `system`, on a pymavlink connection.

        `text` is what the user calls the connection. Raises LinkLostError when there is none within `timeout`.
        """
        self.timeout = timeout
        self.system = self.component = 0
        self.heartbeat: Any = None
        self.heard = time.monotonic()
        self.texts = StatusTexts()
        self.on_message: list[Callable[[Any], None]] = []
        self._link = link
        self._said = -HEARTBEAT_INTERVAL
        self._is_stream = isinstance(link, mavutil.mavtcp | mavutil.mavtcpin)
        self.on_message.append(_Introduction(link, system).ask)
        whom = "no vehicle" if system is None else f"no vehicle with system id {system}"
        end = time.monotonic() + timeout
        while (left := end - time.monotonic()) > 0.0:
            self._say(SEARCH_INTERVAL)
            heartbeat = self.receive("HEARTBEAT", min(left, SEARCH_INTERVAL))
            if heartbeat is None or not link.probably_vehicle_heartbeat(heartbeat):
                continue
            if system in (None, heartbeat.get_srcSystem()):
                self.system, self.component = heartbeat.get_srcSystem(), heartbeat.get_srcComponent()
                self._notice(heartbeat)
                self.on_message.clear()
                return
        raise LinkLostError(f"{whom} on {text}: no HEARTBEAT within {timeout:g} s")

    @property
    def send(self) -> Any:
        """pymavlink's senders by message: `vehicle.send.heartbeat_send(...)`."""
        return self._link.mav

    @property
    def own(self) -> tuple[int, int]:
        """Our system and component id."""
        return self._link.source_system, self._link.source_component

    @property
    def armed(self) -> bool:
        """Whether its latest HEARTBEAT says so."""
        return bool(self.heartbeat.base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED)

    @property
    def lost(self) -> int:
        """Messages lost on their way to us so far, by the gaps in their sequence numbers."""
        return self._link.mav_loss

    def receive(self, kinds: str | Collection[str], timeout: float) -> Any | None:
        """Next message of these kinds from the vehicle, or None after `timeout` seconds of wall time.

        Raises LinkLostError when the other end closes the connection.
        """
        wanted = (kinds,) if isinstance(kinds, str) else kinds
        end = time.monotonic() + timeout
        while True:
            message = self._link.recv_msg()
            now = time.monotonic()
            if now - self._said >= HEARTBEAT_INTERVAL:
                self._say(HEARTBEAT_INTERVAL)
            if message is not None:
                for call in self.on_message:
                    call(message)
                kind = message.get_type()
                if self.system in (0, message.get_srcSystem()):
                    if self.system:
                        self._notice(message)
                    if kind in wanted:
                        return message
                if now > end + FLOOD:
                    return None
                continue
            if now >= end:
                return None
            if self._link.select(min(end - now, HEARTBEAT_INTERVAL)):
                self._check_open()

    def listen(self, duration: float) -> None:
        """Take in whatever comes for so long [s]."""
        self.receive((), duration)

    def check_alive(self) -> None:
        """Raise LinkLostError if no HEARTBEAT has come for `timeout` seconds, or three if that is less."""
        silent = time.monotonic() - self.heard
        if silent > max(self.timeout, SILENCE):
            raise LinkLostError(f"system {self.system} has fallen silent: no HEARTBEAT for {silent:.0f} s")

    def wait_for_heartbeat(self, accept: Callable[[Any], bool], failure: str) -> None:
        """Wait until the latest HEARTBEAT is acceptable. Raises as `ask`."""
        end = time.monotonic() + self.timeout
        while not accept(self.heartbeat):
            left = end - time.monotonic()
            if left <= 0.0 or self.receive("HEARTBEAT", left) is None:
                raise self.unanswered(failure, self.timeout)

    def ask(
        self,
        send: Callable[[], None],
        kinds: str | Collection[str],
        accept: Callable[[Any], bool],
        failure: str,
        *,
        retry: float = RETRY,
        is_sent: bool = False,
    ) -> Any:
        """Send until a message of these kinds comes that is acceptable, and return it.

        `retry`: seconds from one sending to the next; `is_sent`: the first has been done. After the timeout raises
        UnansweredError, or LinkLostError if the vehicle has fallen silent altogether; the text is `failure` and how
        long was waited.
        """
        end = time.monotonic() + self.timeout
        while time.monotonic() < end:
            if not is_sent:
                send()
            is_sent = False
            again = min(time.monotonic() + retry, end)
            while (left := again - time.monotonic()) > 0.0:
                answer = self.receive(kinds, left)
                if answer is not None and accept(answer):
                    return answer
        raise self.unanswered(failure, self.timeout)

    def unanswered(self, failure: str, waited: float) -> GroundError:
        """The error for what the vehicle did not answer within `waited` seconds."""
        if time.monotonic() - self.heard > SILENCE:
            return LinkLostError(f"{failure} within {waited:g} s; system {self.system} has fallen silent")
        return UnansweredError(f"{failure} within {waited:g} s")

    def try_command(self, command: int, *parameters: float, name: str, retry: float = RETRY) -> int:
        """Send a COMMAND_LONG until it is acknowledged; returns the MAV_RESULT.

        While the vehicle says IN_PROGRESS it is waited for. `name` is what the command is called in errors, raised as
        by `ask`.
        """
        confirmations = itertools.count()

        def send() -> None:
            self._command_once(command, *parameters, confirmation=min(next(confirmations), 255))

        def is_ours(ack: Any) -> bool:
            return ack.command == command and ack.target_system in (0, self.own[0])

        self.receive((), 0.0)  # an acknowledgement that has been waiting to be read is not this one's
        failure = f"system {self.system} does not answer {name}"
        ack = self.ask(send, "COMMAND_ACK", is_ours, failure, retry=retry)
        while ack.result == mav.MAV_RESULT_IN_PROGRESS:
            ack = self.ask(send, "COMMAND_ACK", is_ours, failure, retry=PROGRESS_RETRY, is_sent=True)
        return ack.result

    def command(self, command: int, *parameters: float, name: str) -> None:
        """As `try_command`, but raises RefusedError, with what the vehicle said about it, unless it is ACCEPTED."""
        begin = time.monotonic()
        result = self.try_command(command, *parameters, name=name)
        if result != mav.MAV_RESULT_ACCEPTED:
            raise self.refusal(name, enum_name("MAV_RESULT", result), begin)

    def refusal(self, name: str, result: str, since: float) -> RefusedError:
        """The error for what the vehicle refused, with what it has said since a monotonic time and says yet."""
        self.listen(REASON_WAIT)
        said = self.texts.warnings_since(since)
        why = f" ({'; '.join(said)})" if said else ""
        return RefusedError(f"system {self.system} refuses {name}: {result}{why}")

    def request(self, name: str, *, parameter: float = 0.0) -> None:
        """Ask once for a message by REQUEST_MESSAGE, without waiting for it."""
        self._command_once(mav.MAV_CMD_REQUEST_MESSAGE, message_id(name), parameter)

    def set_interval(self, name: str, interval_us: int) -> None:
        """Ask once for a message every so many microseconds (0: as by default), without waiting for the answer."""
        self._command_once(mav.MAV_CMD_SET_MESSAGE_INTERVAL, message_id(name), interval_us)

    def _command_once(self, command: int, *parameters: float, confirmation: int = 0) -> None:
        filled = [*parameters, *[0.0] * (7 - len(parameters))]
        self.send.command_long_send(self.system, self.component, command, confirmation, *filled)

    def _notice(self, message: Any) -> None:
        kind = message.get_type()
        if kind == "HEARTBEAT" and message.get_srcComponent() == self.component:
            self.heartbeat, self.heard = message, time.monotonic()
        elif kind == "STATUSTEXT":
            self.texts.add(message, time.monotonic())

    def _say(self, interval: float) -> None:
        now = time.monotonic()
        if now - self._said >= interval:
            self._said = now
            self.send.heartbeat_send(mav.MAV_TYPE_GCS, mav.MAV_AUTOPILOT_INVALID, 0, 0, mav.MAV_STATE_ACTIVE)

    def _check_open(self) -> None:
        """A stream that is ready but has nothing to read has been closed; pymavlink would go on asking it."""
        if self._is_stream and self._link.port is not None:
            try:
                is_open = self._link.port.recv(1, socket.MSG_PEEK) != b""
            except BlockingIOError:
                is_open = True
            except OSError:
                is_open = False
            if not is_open:
                raise LinkLostError(f"{self._link.address}: the other end has closed the connection")


class _Introduction:
    """Asks every autopilot that is heard for its HEARTBEAT, once, instead of waiting up to a second for the next."""

    def __init__(self, link: Any, system: int | None) -> None:
        self._link, self._system = link, system
        self._asked = {0}

    def ask(self, message: Any) -> None:
        """Take in a message of anybody's."""
        system = message.get_srcSystem()
        if system in self._asked or self._system not in (None, system):
            return
        if message.get_srcComponent() == mav.MAV_COMP_ID_AUTOPILOT1:
            self._asked.add(system)
            command, heartbeat = mav.MAV_CMD_REQUEST_MESSAGE, mav.MAVLINK_MSG_ID_HEARTBEAT
            self._link.mav.command_long_send(
                system, mav.MAV_COMP_ID_AUTOPILOT1, command, 0, heartbeat, 0, 0, 0, 0, 0, 0
            )


AnyVehicle = TypeVar("AnyVehicle", bound=Vehicle)


@contextmanager
def connect(
    text: str,
    *,
    timeout: float = 10.0,
    system: int | None = None,
    own_system: int = OWN_SYSTEM,
    kind: type[AnyVehicle] = Vehicle,
) -> Generator[AnyVehicle]:
    """The first vehicle heard on a pymavlink connection string, or that of `system`.

    The connection is closed at the end of the with block. Raises GroundError for a string that is no connection,
    LinkLostError when there is no vehicle within `timeout` [s].
    """
    link = _opened(text, timeout, own_system)
    try:
        yield kind(link, text, timeout, system)
    finally:
        link.close()


def _opened(text: str, timeout: float, own_system: int) -> Any:
    network, serial = NETWORK.fullmatch(text), SERIAL.fullmatch(text)
    if serial is None and (network is None or not 0 < int(network[3]) < 1 << 16):
        raise GroundError(
            f"--connect: expected udpin, udpout, udp, tcp or tcpin and :HOST:PORT, or a serial port as"
            f" /dev/ttyACM0,57600; got {text!r}"
        )
    if serial is not None and importlib.util.find_spec("serial") is None:
        raise GroundError(f"--connect {text}: serial ports need pyserial (pip install pyserial)")
    os.environ["MAVLINK20"] = "1"  # how pymavlink is told to begin with MAVLink 2
    options: dict[str, Any] = {"source_system": own_system, "source_component": OWN_COMPONENT, "dialect": "all"}
    end = time.monotonic() + timeout
    while True:
        try:
            if serial is not None:
                link: Any = mavutil.mavlink_connection(serial[1], baud=int(serial[2] or 57600), **options)
            else:
                link = mavutil.mavlink_connection(text, retries=0, **options)
            break
        except ConnectionRefusedError:
            if time.monotonic() >= end:
                raise LinkLostError(f"no vehicle on {text}: nobody accepts the connection") from None
            time.sleep(SEARCH_INTERVAL)
        except (OSError, ValueError) as error:
            raise GroundError(f"--connect {text}: {getattr(error, 'strerror', None) or error}") from None
    if isinstance(link, mavutil.mavudp):
        link.port.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)
    if isinstance(link, mavutil.mavtcp):
        link.handle_eof = link.handle_disconnect = _nothing  # it would print; `Vehicle` notices by itself
    return link


def _nothing() -> None:
    """Do nothing."""


@cache
def message_id(name: str) -> int:
    """Number of a message that pymavlink can decode."""
    return next(number for number, message in mav.mavlink_map.items() if message.msgname == name)


def enum_name(enum: str, value: int) -> str:
    """Name of an entry without what all entries of the enum begin with; the number if there is none."""
    entry = mav.enums[enum].get(value)
    return f"{enum} {value}" if entry is None else entry.name.removeprefix(f"{enum}_")
