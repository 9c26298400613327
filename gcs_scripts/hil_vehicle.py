"""A vehicle in hardware-in-the-loop simulation as the ground sees it: its true state in, servo outputs out.

Only MAVLink's `common` messages are used, so it makes no difference who simulates.
"""

import socket
import time
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from typing import Any

from pymavlink import mavutil
from pymavlink.dialects.v20 import common as mav

__all__ = ["HilVehicle", "VehicleError", "connect"]

ACTUATORS = 16  # of HIL_ACTUATOR_CONTROLS
RETRY = 0.05  # [s], wall time, after which an unanswered message is sent again
RECEIVE_BUFFER = 4 << 20  # bytes: a second of everything at many times real time, should we be kept from reading
KINDS = ("udpin", "udpout", "udp", "tcp", "tcpin")  # of pymavlink's connection strings, those with address and port


class VehicleError(RuntimeError):
    """The vehicle cannot be reached, or does not do what it was asked for; the text is one line for the user."""


class HilVehicle:
    """A vehicle that takes HIL_ACTUATOR_CONTROLS and tells HIL_STATE_QUATERNION.

    Attributes:
        system: its MAVLink system id.
        timeout: wall time [s] without what was waited for until VehicleError is raised.
    """

    def __init__(self, link: Any, text: str, timeout: float) -> None:
        """Wait for the vehicle's heartbeat on a pymavlink connection; `text` is what the user calls it."""
        self.timeout = timeout
        self.system = 0
        self._link = link
        ours = (mav.MAV_TYPE_GCS, mav.MAV_AUTOPILOT_INVALID, 0, 0, mav.MAV_STATE_ACTIVE)
        heartbeat = self._ask(
            lambda: link.mav.heartbeat_send(*ours),  # a vehicle that listens must hear us first
            "HEARTBEAT",
            link.probably_vehicle_heartbeat,
            f"no vehicle on {text}: no HEARTBEAT",
        )
        self.system, self._component = heartbeat.get_srcSystem(), heartbeat.get_srcComponent()

    @property
    def lost(self) -> int:
        """Messages lost on their way to us so far, by the gaps in their sequence numbers."""
        return self._link.mav_loss

    def receive(self, kinds: str | Sequence[str], timeout: float) -> Any | None:
        """Next message of these kinds from the vehicle, or None after `timeout` seconds of wall time."""
        wanted = (kinds,) if isinstance(kinds, str) else kinds
        end = time.monotonic() + timeout
        while True:
            message = self._link.recv_match(type=list(wanted), blocking=False)
            if message is not None:
                if self.system in (0, message.get_srcSystem()):
                    return message
                continue
            remaining = end - time.monotonic()
            if remaining <= 0.0:
                return None
            self._link.select(remaining)

    def send_controls(self, outputs: Sequence[float], time_us: int) -> None:
        """HIL_ACTUATOR_CONTROLS: normalised outputs by channel, for the state of the vehicle's time `time_us`."""
        controls = [*outputs, *[0.0] * (ACTUATORS - len(outputs))]
        armed = mav.MAV_MODE_FLAG_SAFETY_ARMED | mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
        self._link.mav.hil_actuator_controls_send(time_us, controls, armed, 0)

    def state(self) -> Any:
        """The present HIL_STATE_QUATERNION, asked for. Raises VehicleError when none comes."""
        while self.receive("HIL_STATE_QUATERNION", 0.0) is not None:
            pass  # what has been waiting to be read is not the present
        return self._ask(
            lambda: self._command(mav.MAV_CMD_REQUEST_MESSAGE, _number("HIL_STATE_QUATERNION")),
            "HIL_STATE_QUATERNION",
            lambda _: True,
            f"system {self.system} does not tell its state: no HIL_STATE_QUATERNION",
        )

    def tick(self, outputs: Sequence[float], time_us: int) -> Any:
        """In lockstep: answer the state of `time_us` and return the next, HIL_STATE_QUATERNION of a later time.

        What gets lost is sent again. Raises VehicleError when no later state comes.
        """
        return self._ask(
            lambda: self.send_controls(outputs, time_us),
            "HIL_STATE_QUATERNION",
            lambda state: state.time_usec > time_us,
            f"system {self.system} does not go on from {time_us} us in answer to HIL_ACTUATOR_CONTROLS",
        )

    def stream(self, name: str, rate: float) -> None:
        """Ask for a message at `rate` [Hz] of the vehicle's time. Raises VehicleError if refused or not answered."""
        command = mav.MAV_CMD_SET_MESSAGE_INTERVAL
        answer = self._ask(
            lambda: self._command(command, _number(name), round(1e6 / rate)),
            "COMMAND_ACK",
            lambda ack: ack.command == command,
            f"system {self.system} does not answer SET_MESSAGE_INTERVAL for {name}",
        )
        if answer.result != mav.MAV_RESULT_ACCEPTED:
            raise VehicleError(f"system {self.system} refuses {name} at {rate:g} Hz: MAV_RESULT {answer.result}")

    def stream_by_default(self, name: str) -> None:
        """Leave a message to the vehicle's own rate again, without waiting: one that has ended gives no answer."""
        self._command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, _number(name), 0)

    def _command(self, command: int, *parameters: float) -> None:
        filled = [*parameters, *[0.0] * (7 - len(parameters))]
        self._link.mav.command_long_send(self.system, self._component, command, 0, *filled)

    def _ask(self, send: Callable[[], None], kind: str, accept: Callable[[Any], bool], failure: str) -> Any:
        """Send until a message of this kind comes that is acceptable; after the timeout raise VehicleError."""
        end = time.monotonic() + self.timeout
        while time.monotonic() < end:
            send()
            retry = time.monotonic() + RETRY
            while (left := retry - time.monotonic()) > 0.0:
                answer = self.receive(kind, left)
                if answer is not None and accept(answer):
                    return answer
        raise VehicleError(f"{failure} within {self.timeout:g} s")


@contextmanager
def connect(text: str, system_id: int = 255, timeout: float = 10.0) -> Generator[HilVehicle]:
    """The first vehicle heard on a pymavlink connection string; the connection is closed at the end of the with block.

    `system_id` is ours. Raises VehicleError for a string that is no connection, and when there is no vehicle.
    """
    kind, _, address = text.partition(":")
    host, _, port = address.rpartition(":")
    if kind not in KINDS or not host or not port.isdecimal() or not 0 < int(port) < 1 << 16:
        raise VehicleError(f"--connect: expected {', '.join(KINDS)} and :HOST:PORT, got {text!r}")
    try:
        link: Any = mavutil.mavlink_connection(text, source_system=system_id, source_component=0, dialect="common")
    except OSError as error:
        raise VehicleError(f"--connect {text}: {error.strerror or error}") from None
    try:
        if kind.startswith("udp"):  # a stream loses nothing, and has no socket before somebody connects
            link.port.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)
        yield HilVehicle(link, text, timeout)
    finally:
        link.close()


def _number(name: str) -> int:
    return getattr(mav, f"MAVLINK_MSG_ID_{name}")
