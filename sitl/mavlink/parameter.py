"""Parameter protocol: the flight's parameters listed, read, set and kept.

https://mavlink.io/en/services/parameter.html, with PARAM_ERROR for what cannot be done and PX4's _HASH_CHECK, by which
a ground station knows that it has the list already. Whoever changes a parameter, every station is told.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from sitl.flight.refused import Refused
from sitl.mavlink.codec import codec
from sitl.mavlink.command import whole_number
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.parameter_encoding import (
    HASH_NAME,
    WrongTypeError,
    decoded,
    encoded,
    hash_of,
    hash_payload,
    type_of,
)  # fmt: skip
from sitl.mavlink.parameter_storage import ParameterStorage
from sitl.mavlink.router import QUIET
from sitl.mavlink.service import Exchange, Handler, Request, Requestable, Sender, Service

if TYPE_CHECKING:
    from sitl.flight.parameters import Parameters
    from sitl.mavlink.codec import MessageCodec
    from sitl.mavlink.command import Command, CommandHandler
    from sitl.mavlink.links import Peer

__all__ = ["ParameterService"]

BURST = 32  # parameters sent at once: what fits into a datagram
PAUSE = 0.01  # between bursts, so that others get their turn [s], wall time
MOST_REFUSALS = 100  # bursts that a peer's socket does not take before its list is given up

BY_NAME: Final = -1  # index in a request or an error that means a name
STORAGE_ACTIONS = "0 (read), 1 (write), 2 (reset, but the system id), 3 (reset calibrations) or 4 (reset all)"
READ, WRITE, RESET, RESET_ALL = 0, 1, 2, 4  # PREFLIGHT_STORAGE_PARAMETER_ACTION
SYSTEM_ID = "MAV_SYS_ID"


@dataclass(slots=True)
class _Listing:
    """A list under way to one peer."""

    sender: Sender
    next: int = 0  # index of the parameter to be sent next
    refusals: int = 0  # bursts in a row that were not taken
    is_stopped: bool = False


class ParameterService(Service):
    """Serves the parameters of the flight as it is now; with the autopilot off there are none."""

    def __init__(self, exchange: Exchange) -> None:
        """Set what is in store, unless the scenario or the command line says otherwise."""
        super().__init__(exchange)
        self._bytewise = exchange.identity.bytewise_parameters
        self._listings: dict[Peer, _Listing] = {}
        self._storage = ParameterStorage(exchange)
        self._index: dict[str, int] = {}
        parameters = self._parameters
        if parameters is not None:
            self._index = {name: index for index, name in enumerate(parameters.names())}
            self._storage.load(parameters, but=exchange.simulation.scenario.parameters)
        self.restarted()

    @property
    def system_id(self) -> int | None:
        """MAVLink system id that the vehicle is to have when it begins (anew); None with the autopilot off."""
        parameters = self._parameters
        return None if parameters is None else int(parameters[SYSTEM_ID])

    def messages(self) -> Mapping[str, Handler]:
        """See Service."""
        return {
            "PARAM_REQUEST_LIST": self._on_request_list,
            "PARAM_REQUEST_READ": self._on_request_read,
            "PARAM_SET": self._on_set,
        }

    def commands(self) -> "Mapping[int, CommandHandler]":
        """See Service."""
        return {mav.MAV_CMD_PREFLIGHT_STORAGE: self._on_storage}

    def requestable(self) -> Mapping[str, Requestable]:
        """See Service."""
        return {"PARAM_VALUE": self._requested}

    def restarted(self) -> None:
        """See Service: the new flight's parameters are listened to."""
        parameters = self._parameters
        if parameters is not None:
            parameters.on_change.append(self._changed)

    def close(self) -> None:
        """See Service."""
        self._storage.flush()

    @property
    def _parameters(self) -> "Parameters | None":
        try:
            return self.exchange.simulation.flight.parameters
        except Refused:  # there is no autopilot
            return None

    def _changed(self, name: str) -> None:
        """Somebody has changed a parameter."""
        parameters = self._parameters
        if parameters is not None:
            self._storage.keep(name, parameters[name])
            self.exchange.broadcast("PARAM_VALUE", **self._fields(parameters, name))

    # -- lists -----------------------------------------------------------------------------------------------------

    def _on_request_list(self, _: Any, sender: Sender) -> None:
        parameters = self._parameters
        if parameters is None:
            return
        listing = self._listings.get(sender.peer)
        if listing is not None:
            listing.next = 0  # goes on from there, without the hash: whoever asks again wants the parameters
            return
        if self._bytewise:
            sender.link.send(sender.peer, [self._hash(parameters)])
        self._listings[sender.peer] = listing = _Listing(sender)
        self._go_on(listing)

    def _go_on(self, listing: _Listing) -> None:
        """Send the next burst of a list."""
        parameters = self._parameters
        if parameters is None or listing.is_stopped:
            return
        peer = listing.sender.peer
        burst = parameters.names()[listing.next : listing.next + BURST]
        packer = codec("PARAM_VALUE")
        messages = [(packer, packer.payload_of(**self._fields(parameters, name))) for name in burst]
        if listing.sender.link.send(peer, messages):
            listing.next += len(burst)
            listing.refusals = 0
        else:
            listing.refusals += 1
        if listing.next >= len(parameters.names()) or listing.refusals > MOST_REFUSALS:
            del self._listings[peer]
        else:
            self.exchange.after(PAUSE, lambda: self._go_on(listing))

    def _stop_list(self, sender: Sender) -> None:
        listing = self._listings.pop(sender.peer, None)
        if listing is not None:
            listing.is_stopped = True

    def _hash(self, parameters: "Parameters") -> "tuple[MessageCodec, bytes]":
        values = [(parameters.definition(name), parameters[name]) for name in parameters.names()]
        return codec("PARAM_VALUE"), hash_payload(hash_of(values), len(values))

    # -- one parameter ---------------------------------------------------------------------------------------------

    def _on_request_read(self, message: Any, sender: Sender) -> None:
        parameters = self._parameters
        by_name = message.param_index < 0
        name = _text(message.param_id) if by_name else self._name(parameters, message.param_index)
        if parameters is not None and name in parameters:
            self.exchange.reply(sender, "PARAM_VALUE", **self._fields(parameters, name))
        elif parameters is not None and self._is_hash(name):
            sender.link.send(sender.peer, [self._hash(parameters)])
        elif by_name:
            self._refuse(sender, mav.MAV_PARAM_ERROR_DOES_NOT_EXIST, message.param_id)
        else:
            self._refuse(sender, mav.MAV_PARAM_ERROR_DOES_NOT_EXIST, index=message.param_index)

    def _on_set(self, message: Any, sender: Sender) -> None:
        parameters, name = self._parameters, _text(message.param_id)
        if self._is_hash(name):
            self._stop_list(sender)  # it has them all; an answer would only make it compare again
            return
        if parameters is None or name not in parameters:
            self._refuse(sender, mav.MAV_PARAM_ERROR_DOES_NOT_EXIST, message.param_id)
            return
        definition, before = parameters.definition(name), parameters[name]
        try:
            parameters.set(name, decoded(definition, message.param_value, message.param_type, bytewise=self._bytewise))
        except ValueError as error:
            if isinstance(error, WrongTypeError):
                code = error.code
            else:
                code = mav.MAV_PARAM_ERROR_READ_ONLY if definition.read_only else mav.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE
            # The error goes first: after the value in force alone some would try again.
            self._refuse(sender, code, name)
            self.exchange.tell(sender, mav.MAV_SEVERITY_WARNING, str(error))
        fields = self._fields(parameters, name)
        if parameters[name] == before:  # else everybody has been told by now
            self.exchange.broadcast("PARAM_VALUE", **fields)
        link = sender.link
        if link.spec.streams == QUIET or sender.peer not in link.audience:
            self.exchange.reply(sender, "PARAM_VALUE", **fields)

    def _refuse(self, sender: Sender, code: int, name: str | bytes = "", index: int = BY_NAME) -> None:
        self.exchange.reply(sender, "PARAM_ERROR", param_id=name, param_index=index, error=code)

    def _requested(self, request: Request) -> Iterable[Mapping[str, Any]] | None:
        """PARAM_VALUE by REQUEST_MESSAGE: its second parameter is the index."""
        parameters, index = self._parameters, whole_number(request.params[0])
        name = None if index is None or index < 0 else self._name(parameters, index)
        return None if parameters is None or not name else [self._fields(parameters, name)]

    def _fields(self, parameters: "Parameters", name: str) -> dict[str, Any]:
        """Fields of PARAM_VALUE."""
        definition = parameters.definition(name)
        return {
            "param_id": name,
            "param_value": encoded(definition, parameters[name], bytewise=self._bytewise),
            "param_type": type_of(definition),
            "param_count": len(self._index),
            "param_index": self._index[name],
        }

    def _name(self, parameters: "Parameters | None", index: int) -> str:
        """Name of the parameter with this index, from 0; empty if there is none."""
        names = () if parameters is None else parameters.names()
        return names[index] if index < len(names) else ""

    def _is_hash(self, name: str) -> bool:
        """Where values travel as floats no hash would arrive unharmed, so there is none."""
        return self._bytewise and name == HASH_NAME

    # -- storage ---------------------------------------------------------------------------------------------------

    def _on_storage(self, command: "Command") -> int | None:
        """MAV_CMD_PREFLIGHT_STORAGE.

        Param1 is for parameters; param2, missions, may ask for nothing but what is always done: they are stored as they
        are accepted. Unset and -1 ask for nothing.
        """
        flight = self.exchange.simulation.flight
        action, missions = command.params[0], command.params[1]
        if not (math.isnan(action) or action in range(-1, 5)):
            raise Refused(f"PREFLIGHT_STORAGE param1: expected {STORAGE_ACTIONS}, got {action:g}")
        if not (math.isnan(missions) or missions in range(-1, 2)):
            raise Refused(f"PREFLIGHT_STORAGE param2: expected 0 (read) or 1 (write), got {missions:g}")
        if action in {READ, RESET, RESET_ALL} and flight.armed:
            raise Refused("PREFLIGHT_STORAGE: armed, so parameters are only written", temporary=True)
        parameters = flight.parameters
        if action == READ:
            return None if self._storage.load(parameters) else mav.MAV_RESULT_FAILED
        if action == WRITE:
            return None if self._storage.keep_all(parameters) else mav.MAV_RESULT_FAILED
        if action in {RESET, RESET_ALL}:
            kept = {SYSTEM_ID} if action == RESET else set[str]()
            definitions = [definition for definition in parameters.definitions if definition.name not in kept]
            parameters.load({definition.name: definition.default for definition in definitions})
            return None if self._storage.clear(but=kept) else mav.MAV_RESULT_FAILED
        return None


def _text(name: bytes) -> str:
    return name.decode("ascii", errors="replace")
