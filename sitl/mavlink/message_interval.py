"""Message interval protocol: what is streamed on each link and how often, and single messages on request.

https://mavlink.io/en/services/message_interval.html and
https://mavlink.io/en/mavgen_c/howto_requestmessages.html. Intervals count in simulated time. Default streams are
stretched above real time so that they keep their rates per wall second; what a client has asked for is exact.
"""

import math
from collections.abc import Callable, Mapping

from sitl.mavlink.codec import MessageCodec, codec
from sitl.mavlink.command import Command, CommandService, whole_number
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.heartbeat import HEARTBEAT_PERIOD
from sitl.mavlink.service import Exchange, Sender

__all__ = ["DEFAULT_RATES", "LinkStreams", "MessageIntervalService"]

# Messages per second, as PX4 streams them in its modes "normal" (for ground stations) and "onboard" (for SDKs); of our
# own are SYSTEM_TIME on both, HIL_STATE_QUATERNION, and NAMED_VALUE_FLOAT with the tilt angle. What is due together is
# sent in this order: HIL_STATE_QUATERNION first tells other simulated vehicles that our SERVO_OUTPUT_RAW is no claim.
DEFAULT_RATES: Mapping[str, Mapping[str, float]] = {
    "normal": {
        "SYS_STATUS": 1.0,
        "SYSTEM_TIME": 1.0,
        "EXTENDED_SYS_STATE": 1.0,
        "ATTITUDE": 50.0,
        "ATTITUDE_QUATERNION": 50.0,
        "LOCAL_POSITION_NED": 50.0,
        "GLOBAL_POSITION_INT": 50.0,
        "HIL_STATE_QUATERNION": 50.0,
        "SERVO_OUTPUT_RAW": 50.0,
        "VFR_HUD": 4.0,
        "ALTITUDE": 1.0,
        "NAMED_VALUE_FLOAT": 4.0,
    },
    "onboard": {
        "SYS_STATUS": 5.0,
        "SYSTEM_TIME": 1.0,
        "EXTENDED_SYS_STATE": 5.0,
        "ATTITUDE": 100.0,
        "ATTITUDE_QUATERNION": 50.0,
        "LOCAL_POSITION_NED": 30.0,
        "GLOBAL_POSITION_INT": 50.0,
        "HIL_STATE_QUATERNION": 50.0,
        "SERVO_OUTPUT_RAW": 10.0,
        "VFR_HUD": 10.0,
        "ALTITUDE": 10.0,
        "NAMED_VALUE_FLOAT": 10.0,
    },
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
        self.next_due_us: float = -math.inf

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


class MessageIntervalService:
    """MAV_CMD_SET_MESSAGE_INTERVAL, MAV_CMD_GET_MESSAGE_INTERVAL and MAV_CMD_REQUEST_MESSAGE."""

    def __init__(self, exchange: Exchange, commands: CommandService, streamed: frozenset[int]) -> None:
        """`streamed`: ids of the messages that can be streamed. Each link gets its streams from `add_link`."""
        self._exchange = exchange
        self._streamed = streamed
        self._by_link: dict[object, LinkStreams] = {}
        self._on_request: dict[int, tuple[MessageCodec, Callable[[], dict[str, object]]]] = {}
        commands.register(mav.MAV_CMD_SET_MESSAGE_INTERVAL, self._set_interval)
        commands.register(mav.MAV_CMD_GET_MESSAGE_INTERVAL, self._get_interval)
        commands.register(mav.MAV_CMD_REQUEST_MESSAGE, self._request_message)

    def add_link(self, link: object, streams: LinkStreams) -> None:
        """Serve a link."""
        self._by_link[link] = streams

    def add_requestable(self, name: str, make: Callable[[], dict[str, object]]) -> None:
        """Offer a message, not streamed, on request; `make` returns its fields."""
        packer = codec(name)
        self._on_request[packer.id] = (packer, make)

    def _set_interval(self, command: Command) -> int:
        message_id, interval = whole_number(command.params[0]), command.params[1]
        if message_id == mav.MAVLINK_MSG_ID_HEARTBEAT:
            return mav.MAV_RESULT_DENIED  # its rate is the protocol's, in wall time
        if message_id not in self._streamed or not math.isfinite(interval) or interval < OFF:
            return mav.MAV_RESULT_DENIED
        self._by_link[command.sender.link].set(message_id, interval)
        return mav.MAV_RESULT_ACCEPTED

    def _get_interval(self, command: Command) -> int:
        message_id = whole_number(command.params[0])
        if message_id is None or not 0 <= message_id <= 0xFFFF:
            return mav.MAV_RESULT_DENIED
        self._send_interval(message_id, command.sender)
        return mav.MAV_RESULT_ACCEPTED

    def request(self, command: Command, message_id: int | None) -> int:
        """Send this message once to the sender of a command; returns the MAV_RESULT."""
        sender = command.sender
        if message_id in self._on_request:
            packer, make = self._on_request[message_id]
            sender.link.send(sender.peer, [(packer, packer.payload_of(**make()))])
            return mav.MAV_RESULT_ACCEPTED
        if message_id is None or message_id not in self._streamed:
            return mav.MAV_RESULT_DENIED
        message = self._exchange.telemetry(message_id)
        if message is None:
            return mav.MAV_RESULT_TEMPORARILY_REJECTED
        sender.link.send(sender.peer, [message])
        return mav.MAV_RESULT_ACCEPTED

    def _request_message(self, command: Command) -> int:
        message_id = whole_number(command.params[0])
        if message_id != mav.MAVLINK_MSG_ID_MESSAGE_INTERVAL:
            return self.request(command, message_id)
        return self._get_interval(command._replace(params=command.params[1:]))

    def _send_interval(self, message_id: int, sender: Sender) -> None:
        # 0 is the message's word for "not available", -1 for "not streamed now".
        interval = 0
        if message_id == mav.MAVLINK_MSG_ID_HEARTBEAT:
            interval = round(HEARTBEAT_PERIOD * 1e6)
        elif message_id in self._streamed:
            interval = self._by_link[sender.link].interval(message_id)
        self._exchange.reply(sender, "MESSAGE_INTERVAL", message_id=message_id, interval_us=interval)
