"""Reads and sets a vehicle's parameters. Source: MAVLink guide, services/parameter.

What gets lost is asked for again: of a list the missing places, a value that was set until it is told back.
"""

import time
from collections.abc import Callable
from typing import Any

from gcs_scripts.autopilot import is_ardupilot, is_px4
from gcs_scripts.connection import Vehicle, enum_name
from gcs_scripts.errors import GroundError, RefusedError
from gcs_scripts.parameter_encoding import Parameter, as_type, decoded, is_bytewise, set_message

__all__ = ["ParameterLink"]

GAP = 0.5  # [s] without a PARAM_VALUE after which the missing ones are asked for
BATCH = 50  # asked for at once
STALE, DELAYS = 0.4, 3.0  # [s] and times the usual delay in which answers to older questions may still come
NAME_LENGTH = 16


class ParameterLink:
    """A vehicle's parameters."""

    def __init__(self, vehicle: Vehicle) -> None:
        """Find out how the vehicle encodes them; asks only autopilots that are neither PX4 nor ArduPilot."""
        self._vehicle = vehicle
        self._delay = 0.0  # of an answer [s]
        capabilities = None
        if not is_px4(vehicle.heartbeat) and not is_ardupilot(vehicle.heartbeat):
            version = vehicle.ask(
                lambda: vehicle.request("AUTOPILOT_VERSION"),
                "AUTOPILOT_VERSION",
                lambda _: True,
                f"system {vehicle.system} does not tell its capabilities: no AUTOPILOT_VERSION",
            )
            capabilities = version.capabilities
        self._bytewise = is_bytewise(vehicle.heartbeat, capabilities)

    def read_all(self, progress: Callable[[int, int], None] = lambda *_: None) -> dict[str, Parameter]:
        """All parameters by name, sorted; `progress` is told how many there are so far, and in all.

        Raises UnansweredError when no new one comes within the vehicle's timeout, LinkLostError.
        """
        vehicle = self._vehicle
        found: dict[int, Parameter] = {}
        total = 0
        awaited = self._ask_for_missing(found, total)
        advanced = asked = time.monotonic()
        while total == 0 or len(found) < total:
            message = vehicle.receive("PARAM_VALUE", GAP)
            now = time.monotonic()
            if message is not None and _is_listed(message, vehicle):
                self._delay = self._delay if total else now - asked
                total = message.param_count
                if message.param_index not in found:
                    advanced = now
                found[message.param_index] = decoded(message, bytewise=self._bytewise)
                progress(len(found), total)
                awaited.discard(message.param_index)
            if now - advanced > vehicle.timeout:
                part = f"{len(found)} of {total}" if total else "no PARAM_VALUE"
                raise vehicle.unanswered(
                    f"system {vehicle.system} does not list its parameters: {part}", vehicle.timeout
                )
            if not awaited or now - max(advanced, asked) >= GAP:
                awaited = self._ask_for_missing(found, total)
                asked = now
        return dict(sorted((parameter.name, parameter) for parameter in found.values()))

    def _ask_for_missing(self, found: dict[int, Parameter], total: int) -> set[int]:
        """Returns the places whose coming ends the wait for what was asked for."""
        vehicle = self._vehicle
        missing = [index for index in range(total) if index not in found]
        if total == 0 or len(missing) > total // 2:
            vehicle.send.param_request_list_send(vehicle.system, vehicle.component)
            return {total - 1}
        for index in missing[:BATCH]:
            vehicle.send.param_request_read_send(vehicle.system, vehicle.component, b"", index)
        return set(missing[:BATCH])

    def read(self, name: str) -> Parameter:
        """One parameter. Raises RefusedError if the vehicle says that there is none, UnansweredError, LinkLostError."""
        encoded = _encoded(name)
        vehicle = self._vehicle

        def send() -> None:
            vehicle.send.param_request_read_send(vehicle.system, vehicle.component, encoded, -1)

        failure = f"system {vehicle.system} does not tell {name}, if there is such a parameter: no PARAM_VALUE"
        begin = time.monotonic()
        answer = vehicle.ask(
            send, ("PARAM_VALUE", "PARAM_ERROR"), lambda m: m.param_id == name and _for_us(m, vehicle), failure
        )
        self._delay = time.monotonic() - begin
        if answer.get_type() == "PARAM_ERROR":
            raise RefusedError(f"system {vehicle.system} does not tell {name}: {_error_name(answer.error)}")
        return decoded(answer, bytewise=self._bytewise)

    def write(self, name: str, value: float, kind: int | None = None) -> Parameter:
        """Set one parameter; `kind` is its type, asked for if not given. Returns it as the vehicle tells it back.

        Raises RefusedError, with the reason if the vehicle gives one, when it keeps another value or the value does not
        fit the type; UnansweredError, LinkLostError.
        """
        vehicle = self._vehicle
        kind = self.read(name).type if kind is None else kind
        try:
            wanted = Parameter(name, as_type(value, kind), kind)
        except ValueError as error:
            raise RefusedError(f"{name}: {error}") from None
        message = set_message(vehicle.system, vehicle.component, wanted, bytewise=self._bytewise)
        begin = time.monotonic()
        certain = begin + max(STALE, DELAYS * self._delay)  # before that, another value may be from before ours came in

        def tells(answer: Any) -> bool:
            if answer.param_id != name or not _for_us(answer, vehicle):
                return False
            return (
                answer.get_type() == "PARAM_ERROR"
                or time.monotonic() > certain
                or decoded(answer, bytewise=self._bytewise).value == wanted.value
            )

        failure = f"system {vehicle.system} does not acknowledge {name}"
        answer = vehicle.ask(lambda: vehicle.send.send(message), ("PARAM_VALUE", "PARAM_ERROR"), tells, failure)
        result = f"{name} = {wanted.value:g}"
        if answer.get_type() == "PARAM_ERROR":
            raise vehicle.refusal(result, _error_name(answer.error), begin)
        told = decoded(answer, bytewise=self._bytewise)
        if told.value != wanted.value:
            raise vehicle.refusal(result, f"it stays {told.value:g}", begin)
        return told


def _is_listed(message: Any, vehicle: Vehicle) -> bool:
    """Whether a PARAM_VALUE is one of the list; PX4's _HASH_CHECK is not."""
    return message.get_srcComponent() == vehicle.component and message.param_index < message.param_count


def _for_us(message: Any, vehicle: Vehicle) -> bool:
    """Whether a PARAM_VALUE, which is for everybody, or a PARAM_ERROR is meant for us and from the autopilot."""
    if message.get_srcComponent() != vehicle.component:
        return False
    return getattr(message, "target_system", 0) in (0, vehicle.own[0])


def _error_name(error: int) -> str:
    return enum_name("MAV_PARAM_ERROR", error).replace("_", " ").lower()


def _encoded(name: str) -> bytes:
    if not name.isascii() or not 0 < len(name) <= NAME_LENGTH:
        raise GroundError(f"{name!r}: expected a parameter's name, 1 to {NAME_LENGTH} plain characters")
    return name.encode("ascii")
