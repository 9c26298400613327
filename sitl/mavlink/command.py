"""Command protocol: COMMAND_LONG and COMMAND_INT in, one COMMAND_ACK out for each, at once.

https://mavlink.io/en/services/command.html. Other microservices register the commands they serve; a command nobody
has registered is answered UNSUPPORTED. Commands served today can be repeated without harm, so a retransmitted one is
simply carried out again.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

from sitl.mavlink.codec import codec
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.service import Exchange, Sender

__all__ = ["Command", "CommandService", "whole_number"]


class Command(NamedTuple):
    """A command addressed to us. Parameters are as sent: any may be NaN, which means unset."""

    id: int
    params: tuple[float, ...]  # 7
    sender: Sender


class CommandService:
    """Passes commands to whoever registered for them and acknowledges."""

    def __init__(self, exchange: Exchange) -> None:
        """Answer through `exchange`."""
        self._exchange = exchange
        self._long = codec("COMMAND_LONG")
        self._int = codec("COMMAND_INT")
        self._handlers: dict[int, Callable[[Command], int]] = {}

    def register(self, command: int, handler: Callable[[Command], int]) -> None:
        """Let `handler` serve a MAV_CMD; it returns the MAV_RESULT to acknowledge with."""
        self._handlers[command] = handler

    def on_command_long(self, payload: bytes, sender: Sender) -> None:
        """COMMAND_LONG."""
        target_system, target_component, command, _, *params = self._long.unpack(payload)
        self._serve(target_system, target_component, Command(command, tuple(params), sender))

    def on_command_int(self, payload: bytes, sender: Sender) -> None:
        """COMMAND_INT; no command served today has a place, so its frame does not matter."""
        target_system, target_component, _, command, _, _, *params = self._int.unpack(payload)
        self._serve(target_system, target_component, Command(command, tuple(params), sender))

    def _serve(self, target_system: int, target_component: int, command: Command) -> None:
        if not self._exchange.is_for_us(target_system, target_component):
            return
        handler = self._handlers.get(command.id)
        result = handler(command) if handler else mav.MAV_RESULT_UNSUPPORTED
        self._exchange.reply(
            command.sender,
            "COMMAND_ACK",
            command=command.id,
            result=result,
            progress=0,
            result_param2=0,
            target_system=command.sender.system,
            target_component=command.sender.component,
        )


def whole_number(param: float) -> int | None:
    """A parameter that should hold a whole number; None if it holds something else (NaN for unset, most often)."""
    return int(param) if math.isfinite(param) and param == int(param) else None
