"""A way to the vehicle beside the wire, for what the fixture itself has to ask of it: no fault can touch that."""

import math
import socket
import time
from collections import deque
from types import TracebackType
from typing import Any, Self

from pymavlink.dialects.v20 import all as mav

from sitl.testing.ports import LOOPBACK
from sitl.testing.process import SitlError

__all__ = ["ControlChannel"]

_OURS = (246, mav.MAV_COMP_ID_MISSIONPLANNER)  # system and component: nobody else's by habit
_REPEAT = 0.5  # after which a question is asked again [s]
_LARGEST_DATAGRAM = 1 << 16


class ControlChannel:
    """Asks the vehicle at an address and waits for its answers; it sends them to whoever asks."""

    def __init__(self, address: tuple[str, int], system: int) -> None:
        """`address` that the vehicle receives at, and its `system` id."""
        self._address = address
        self._system = system
        self._target = (system, mav.MAV_COMP_ID_AUTOPILOT1)
        self._mavlink: Any = mav.MAVLink(None, *_OURS)
        self._mavlink.robust_parsing = True
        self._received: deque[Any] = deque()
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind((LOOPBACK, 0))

    def __enter__(self) -> Self:
        """Close it at the end of a with block."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """See __enter__."""
        self._socket.close()

    def command(self, command: int, params: tuple[float, ...], timeout: float) -> None:
        """Have a command accepted: a COMMAND_INT with degrees in params[4] and [5] and a height above home in [6].

        Parameters that are NaN are not given. Raises SitlError if it is not, with the reason if the vehicle gives one.
        """
        place: list[int] = [0x7FFFFFFF if math.isnan(degrees) else round(degrees * 1e7) for degrees in params[4:6]]
        name = mav.enums["MAV_CMD"][command].name
        texts: list[str] = []
        result: int | None = None
        end = time.monotonic() + timeout
        while result in (None, mav.MAV_RESULT_IN_PROGRESS):
            if time.monotonic() > end:
                msg = f"{name}: no answer within {timeout:g} s"
                raise SitlError(msg)
            fields: Any = (
                *self._target,
                mav.MAV_FRAME_GLOBAL_RELATIVE_ALT,
                command,
                0,
                0,
                *params[:4],
                *place,
                params[6],
            )
            self._send(mav.MAVLink_command_int_message(*fields))
            until = min(end, time.monotonic() + _REPEAT)
            while (answer := self._receive(until)) is not None:
                kind = answer.get_type()
                if kind == "COMMAND_ACK" and answer.command == command:
                    result = answer.result
                    if result != mav.MAV_RESULT_IN_PROGRESS:
                        break
                elif kind == "STATUSTEXT":
                    texts.append(answer.text)
        if result != mav.MAV_RESULT_ACCEPTED:
            said = mav.enums["MAV_RESULT"][result].name if result in mav.enums["MAV_RESULT"] else result
            msg = f"{name} with {params}: {said} {'; '.join(texts)}".rstrip()
            raise SitlError(msg)

    def _send(self, message: Any) -> None:
        self._socket.sendto(message.pack(self._mavlink), self._address)

    def _receive(self, until: float) -> Any:
        """The next message of the vehicle, None if there is none until that monotonic wall time."""
        while not self._received:
            self._socket.settimeout(max(until - time.monotonic(), 1e-3))
            try:
                data = self._socket.recv(_LARGEST_DATAGRAM)
            except OSError:
                return None
            messages = self._mavlink.parse_buffer(bytearray(data)) or ()
            self._received.extend(message for message in messages if message.get_srcSystem() == self._system)
        return self._received.popleft()
