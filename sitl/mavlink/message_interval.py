"""Message interval protocol: what is streamed on each link and how often, and single messages on request.

https://mavlink.io/en/services/message_interval.html and
https://mavlink.io/en/mavgen_c/howto_requestmessages.html. Intervals count in simulated time. Default streams are
stretched above real time so that they keep their rates per wall second; what a client has asked for is exact.
"""

import math
from collections.abc import Mapping
from typing import Any

from sitl.flight.refused import Refused
from sitl.mavlink.codec import MessageCodec, codec
from sitl.mavlink.command import Command, CommandHandler, whole_number
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.links import Link
from sitl.mavlink.service import Exchange, Handler, Request, Requestable, Sender, Service
from sitl.mavlink.standard_modes import HEARTBEAT_PERIOD
from sitl.mavlink.telemetry.streams import DATA_STREAMS

__all__ = ["LinkStreams", "MessageIntervalService"]

# Commands from before REQUEST_MESSAGE, each for one message.
OLDER_REQUESTS: Mapping[int, str] = {
    mav.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES: "AUTOPILOT_VERSION",
    mav.MAV_CMD_REQUEST_PROTOCOL_VERSION: "PROTOCOL_VERSION",
    mav.MAV_CMD_GET_HOME_POSITION: "HOME_POSITION",
    mav.MAV_CMD_REQUEST_FLIGHT_INFORMATION: "FLIGHT_INFORMATION",
    mav.MAV_CMD_REQUEST_STORAGE_INFORMATION: "STORAGE_INFORMATION",
}
SHORTEST_INTERVAL = 2500  # [us]: 400 Hz
OFF = -1


class _Stream:
    __slots__ = ("due_us", "interval_us", "is_default")

    def __init__(self, interval_us: int, *, is_default: bool) -> None:
        self.interval_us = interval_us
        self.is_default = is_default
        self.due_us: float = -math.inf


class LinkStreams:
    """The streams of one link.

    Attributes:
        next_due_us: simulated time [us] at which the next message is due.
    """

    def __init__(self, rates: Mapping[str, float]) -> None:
        """Begin with these default rates [Hz], by message name."""
        self._defaults = {codec(name).id: round(1e6 / rate) for name, rate in rates.items()}
        self._streams = {key: _Stream(interval, is_default=True) for key, interval in self._defaults.items()}
        self.next_due_us: float = -math.inf if self._streams else math.inf

    def restart(self) -> None:
        """Simulated time begins anew."""
        for stream in self._streams.values():
            stream.due_us = -math.inf
        self.next_due_us = -math.inf if self._streams else math.inf

    def set(self, message_id: int, interval_us: float) -> None:
        """Stream a message at this interval [us] from now on; 0 for its default rate, -1 for not at all."""
        is_default = interval_us == 0
        interval = self._defaults.get(message_id, OFF) if is_default else interval_us
        if interval < 0:
            self._streams.pop(message_id, None)
        else:
            self._streams[message_id] = _Stream(max(round(interval), SHORTEST_INTERVAL), is_default=is_default)
        self.next_due_us = min((stream.due_us for stream in self._streams.values()), default=math.inf)

    def interval(self, message_id: int) -> int:
        """Present interval of a message [us], -1 if it is not streamed."""
        stream = self._streams.get(message_id)
        return OFF if stream is None else stream.interval_us

    def take_due(self, now_us: int, stretch: float) -> list[int]:
        """Ids of the messages due at simulated time `now_us`; default intervals are longer by the factor `stretch`."""
        due = []
        next_due = math.inf
        for message_id, stream in self._streams.items():
            if stream.due_us <= now_us:
                due.append(message_id)
                interval = stream.interval_us * stretch if stream.is_default else stream.interval_us
                # On a grid of whole intervals, so that equal rates stay in step and share datagrams; a grid point that
                # was missed is left out, not made up for. The first one is counted from time zero.
                begun = 0.0 if stream.due_us == -math.inf else stream.due_us
                stream.due_us = begun + ((now_us - begun) // interval + 1) * interval
            next_due = min(next_due, stream.due_us)
        self.next_due_us = next_due
        return due


class MessageIntervalService(Service):
    """SET_ and GET_MESSAGE_INTERVAL, REQUEST_MESSAGE, the older commands for single messages, REQUEST_DATA_STREAM.

    Attributes:
        streams: of each link.
        streamed: ids of the messages that can be streamed.
        on_request: those that are sent on request only, by id: codec and what makes the fields.

    All three are filled by the face.
    """

    def __init__(self, exchange: Exchange) -> None:
        """Serve through `exchange`."""
        super().__init__(exchange)
        self.streams: dict[Link, LinkStreams] = {}
        self.streamed: frozenset[int] = frozenset()
        self.on_request: dict[int, tuple[MessageCodec, Requestable]] = {}

    def messages(self) -> Mapping[str, Handler]:
        """See Service."""
        return {"REQUEST_DATA_STREAM": self._on_request_data_stream}

    def commands(self) -> Mapping[int, CommandHandler]:
        """See Service."""
        commands: dict[int, CommandHandler] = {
            mav.MAV_CMD_SET_MESSAGE_INTERVAL: self._set_interval,
            mav.MAV_CMD_GET_MESSAGE_INTERVAL: self._get_interval,
            mav.MAV_CMD_REQUEST_MESSAGE: self._request_message,
        }
        for older, name in OLDER_REQUESTS.items():
            commands[older] = lambda command, name=name: self._request(command, codec(name).id, ())
        return commands

    def _set_interval(self, command: Command) -> None:
        message_id, interval = whole_number(command.params[0]), command.params[1]
        if message_id == mav.MAVLINK_MSG_ID_HEARTBEAT:
            if interval not in (0.0, HEARTBEAT_PERIOD * 1e6):
                msg = f"message interval: the heartbeat's is {HEARTBEAT_PERIOD:g} s, got {interval * 1e-6:g} s"
                raise Refused(msg)
            return
        if message_id not in self.streamed:
            msg = f"message interval: no message {command.params[0]:g} is streamed here"
            raise Refused(msg)
        if not math.isfinite(interval) or interval < OFF:
            msg = f"message interval: expected microseconds, 0 or -1, got {interval:g}"
            raise Refused(msg)
        self.streams[command.sender.link].set(message_id, interval)

    def _get_interval(self, command: Command) -> None:
        message_id = whole_number(command.params[0])
        if message_id is None or not 0 <= message_id <= 0xFFFF:
            msg = f"message interval: expected a message id, got {command.params[0]:g}"
            raise Refused(msg)
        self._send_interval(message_id, command.sender)

    def _request_message(self, command: Command) -> int:
        message_id = whole_number(command.params[0])
        if message_id == mav.MAVLINK_MSG_ID_MESSAGE_INTERVAL:
            self._get_interval(command._replace(params=command.params[1:]))
            return mav.MAV_RESULT_ACCEPTED
        return self._request(command, message_id, command.params[1:])

    def _request(self, command: Command, message_id: int | None, params: tuple[float, ...]) -> int:
        """Send this message to the sender of a command."""
        sender = command.sender
        if message_id in self.on_request:
            packer, make = self.on_request[message_id]
            made = make(Request(params, sender))
            if made is None:
                return mav.MAV_RESULT_DENIED
            for fields in made:
                self.exchange.reply(sender, packer.name, **fields)
            return mav.MAV_RESULT_ACCEPTED
        if message_id not in self.streamed:
            return mav.MAV_RESULT_DENIED
        message = self.exchange.telemetry(message_id)
        if message is None:
            return mav.MAV_RESULT_TEMPORARILY_REJECTED
        sender.link.send(sender.peer, [message])
        return mav.MAV_RESULT_ACCEPTED

    def _on_request_data_stream(self, message: Any, sender: Sender) -> None:
        """REQUEST_DATA_STREAM: a group of messages at one rate [Hz], or none of them."""
        streams = self.streams[sender.link]
        rate = message.req_message_rate if message.start_stop else 0
        for name in DATA_STREAMS.get(message.req_stream_id, ()):
            streams.set(codec(name).id, 1e6 / rate if rate else OFF)

    def _send_interval(self, message_id: int, sender: Sender) -> None:
        # 0 is the message's word for "not available", -1 for "not streamed now".
        interval = 0
        if message_id == mav.MAVLINK_MSG_ID_HEARTBEAT:
            interval = round(HEARTBEAT_PERIOD * 1e6)
        elif message_id in self.streamed:
            interval = self.streams[sender.link].interval(message_id)
        self.exchange.reply(sender, "MESSAGE_INTERVAL", message_id=message_id, interval_us=interval)
