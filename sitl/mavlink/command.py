"""Command protocol: COMMAND_LONG and COMMAND_INT in, a COMMAND_ACK out for each, at once.

https://mavlink.io/en/services/command.html. Other microservices register the commands they serve; a command nobody
has registered is answered UNSUPPORTED. A retransmission (COMMAND_LONG with a confirmation count) is acknowledged as the
first one was and not carried out again, and so is a frame that the network has brought twice; but a message asked for
is sent again, for it is lost as easily as the acknowledgement. What takes time is acknowledged IN_PROGRESS until it is
done or cancelled; given anew meanwhile it is TEMPORARILY_REJECTED.
"""

import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from sitl.flight.refused import Refused
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.service import Exchange, Handler, Sender, Service

__all__ = ["Command", "CommandHandler", "CommandService", "Running", "whole_number"]

# Commands whose fifth and sixth parameter are a place: a COMMAND_INT brings it in 1e-7 degrees or 1e-4 metres. In all
# others these are numbers like the rest.
LOCATED = frozenset(
    number for number, entry in mav.enums["MAV_CMD"].items() if entry.has_location or number == mav.MAV_CMD_USER_2
)
UNSET = 0x7FFFFFFF  # INT32_MAX: a place that is not given
LOCAL_FRAMES = frozenset({
    mav.MAV_FRAME_LOCAL_NED, mav.MAV_FRAME_LOCAL_ENU, mav.MAV_FRAME_LOCAL_OFFSET_NED, mav.MAV_FRAME_BODY_NED,
    mav.MAV_FRAME_BODY_OFFSET_NED, mav.MAV_FRAME_BODY_FRD, mav.MAV_FRAME_LOCAL_FRD, mav.MAV_FRAME_LOCAL_FLU,
})  # fmt: skip
QUESTIONS = frozenset({
    mav.MAV_CMD_REQUEST_MESSAGE, mav.MAV_CMD_GET_MESSAGE_INTERVAL, mav.MAV_CMD_GET_HOME_POSITION,
    mav.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES, mav.MAV_CMD_REQUEST_PROTOCOL_VERSION,
    mav.MAV_CMD_REQUEST_FLIGHT_INFORMATION, mav.MAV_CMD_REQUEST_STORAGE_INFORMATION,
})  # fmt: skip
NEXT_TRY = 5.0  # a client tries again within this time, and counts its tries: QGroundControl waits 3 s [s], wall time
SAME_FRAME = 0.5  # and so soon a frame that a network duplicates; later its number may be another frame's
REPEAT_PERIOD = 1.0  # of IN_PROGRESS [s], wall time: senders wait some seconds for the next
PROGRESS_UNKNOWN = 255
MOST_REMEMBERED = 64  # senders and commands


class Command(NamedTuple):
    """A command addressed to us. Any parameter may be NaN, which means unset.

    Where the fifth and sixth parameter are a place they are degrees, or metres in a local frame. The frame is that of a
    COMMAND_INT; a COMMAND_LONG has none (None).
    """

    id: int
    params: tuple[float, ...]  # 7
    frame: int | None
    confirmation: int
    sender: Sender


class Running:
    """A command that takes time; its service reports progress and the end. `on_cancel` is told of COMMAND_CANCEL."""

    def __init__(self, on_cancel: Callable[[], None] | None = None) -> None:
        self.result: int | None = None
        self.percent = PROGRESS_UNKNOWN
        self.on_cancel = on_cancel
        self.on_change: Callable[[], None] | None = None  # the command service's own

    def progress(self, percent: float) -> None:
        """So much is done, 0 to 100."""
        self.percent = round(min(max(percent, 0.0), 100.0))
        self._changed()

    def finish(self, result: int) -> None:
        """It is done, with this MAV_RESULT."""
        if self.result is None:
            self.result = result
            self._changed()

    def cancelled(self) -> None:
        """Its sender does not want it any more."""
        if self.result is None:
            if self.on_cancel is not None:
                self.on_cancel()
            self.finish(mav.MAV_RESULT_CANCELLED)

    def _changed(self) -> None:
        if self.on_change is not None:
            self.on_change()


# Carries a command out: returns the MAV_RESULT to acknowledge with (None: accepted), or what takes time.
# Raises Refused with the reason for a command that cannot be carried out.
CommandHandler = Callable[[Command], "int | Running | None"]


class _Served(NamedTuple):
    """The latest command of one kind from one sender, when it was heard last, and what was answered."""

    command: Command
    time: float
    answer: "int | Running"


class CommandService(Service):
    """Passes commands to whoever serves them and acknowledges.

    Attributes:
        handlers: by MAV_CMD, filled by the face from the tables of all services.
    """

    def __init__(self, exchange: Exchange) -> None:
        """Serve through `exchange`."""
        super().__init__(exchange)
        self.handlers: dict[int, CommandHandler] = {}
        self._served: dict[tuple[int, int, int], _Served] = {}

    def messages(self) -> Mapping[str, Handler]:
        """See Service."""
        return {
            "COMMAND_LONG": self._on_command_long,
            "COMMAND_INT": self._on_command_int,
            "COMMAND_CANCEL": self._on_command_cancel,
        }

    def restarted(self) -> None:
        """See Service: what was under way is over. The rest is remembered: no restart for a retransmission of one."""
        for served in self._served.values():
            if isinstance(served.answer, Running):
                served.answer.finish(mav.MAV_RESULT_FAILED)

    def _on_command_long(self, message: Any, sender: Sender) -> None:
        self._serve(Command(message.command, tuple(message[4:11]), None, message.confirmation, sender))

    def _on_command_int(self, message: Any, sender: Sender) -> None:
        scale = 1.0
        if message.command in LOCATED:
            scale = 1e-4 if message.frame in LOCAL_FRAMES else 1e-7
        x, y = (math.nan if value == UNSET else value * scale for value in (message.x, message.y))
        params = (message.param1, message.param2, message.param3, message.param4, x, y, message.z)
        self._serve(Command(message.command, params, message.frame, 0, sender))

    def _serve(self, command: Command) -> None:
        key = (command.sender.system, command.sender.component, command.id)
        now = self.exchange.wall_time
        before = self._served.get(key)
        if before is not None and command.id not in QUESTIONS:
            running = isinstance(before.answer, Running) and before.answer.result is None
            if _is_again(command, before, now, running=running):
                self._served[key] = before._replace(command=command, time=now)
                self._acknowledge(command, before.answer)
                return
            if running:
                self._acknowledge(command, mav.MAV_RESULT_TEMPORARILY_REJECTED)
                return
        answer = self._carried_out(command)
        if len(self._served) >= MOST_REMEMBERED and key not in self._served:
            self._forget_oldest()
        self._served[key] = _Served(command, now, answer)
        self._acknowledge(command, answer)
        if isinstance(answer, Running) and answer.result is None:
            answer.on_change = lambda: self._acknowledge(command, answer)
            self._repeat(command, answer)

    def _carried_out(self, command: Command) -> "int | Running":
        handler = self.handlers.get(command.id)
        if handler is None:
            return mav.MAV_RESULT_UNSUPPORTED
        try:
            answer = handler(command)
        except Refused as refused:
            self.exchange.tell(command.sender, mav.MAV_SEVERITY_WARNING, refused.reason)
            return mav.MAV_RESULT_TEMPORARILY_REJECTED if refused.temporary else mav.MAV_RESULT_DENIED
        return mav.MAV_RESULT_ACCEPTED if answer is None else answer

    def _acknowledge(self, command: Command, answer: "int | Running") -> None:
        result, progress = answer, 0
        if isinstance(answer, Running):
            result = mav.MAV_RESULT_IN_PROGRESS if answer.result is None else answer.result
            progress = answer.percent if answer.result is None else 0
        self.exchange.reply(command.sender, "COMMAND_ACK", command=command.id, result=result, progress=progress)

    def _repeat(self, command: Command, running: Running) -> None:
        """Say every now and then that it is still under way."""

        def again() -> None:
            if running.result is None:
                self._acknowledge(command, running)
                self._repeat(command, running)

        self.exchange.after(REPEAT_PERIOD, again)

    def _on_command_cancel(self, message: Any, sender: Sender) -> None:
        served = self._served.get((sender.system, sender.component, message.command))
        if served is not None and isinstance(served.answer, Running):
            served.answer.cancelled()

    def _forget_oldest(self) -> None:
        idle = [
            key
            for key, served in self._served.items()
            if not (isinstance(served.answer, Running) and served.answer.result is None)
        ]
        for key in sorted(idle or self._served, key=lambda key: self._served[key].time)[: MOST_REMEMBERED // 2]:
            del self._served[key]


def whole_number(param: float) -> int | None:
    """A parameter that should hold a whole number; None if it holds something else (NaN for unset, most often)."""
    return int(param) if math.isfinite(param) and param == int(param) else None


def _is_again(command: Command, before: _Served, now: float, *, running: bool) -> bool:
    """Whether a command is one that was served, come again: a retransmission, or one frame brought twice."""
    if not _same(command.params, before.command.params):
        return False
    elapsed, tries = now - before.time, command.confirmation - before.command.confirmation
    one, other = command.sender, before.command.sender
    is_copy = tries == 0 and elapsed < SAME_FRAME and (one.sequence, one.peer) == (other.sequence, other.peer)
    # A COMMAND_INT cannot say that it is a retransmission.
    return is_copy or (running and (tries > 0 or command.frame is not None)) or 0.0 <= elapsed < tries * NEXT_TRY


def _same(first: tuple[float, ...], second: tuple[float, ...]) -> bool:
    """Whether two sets of parameters are equal, what is unset (NaN) included."""
    return all(a == b or (math.isnan(a) and math.isnan(b)) for a, b in zip(first, second, strict=True))
