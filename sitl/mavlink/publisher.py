"""What is told without being asked: streams by simulated time, the heartbeat by wall time, each message made once."""

import math
import time
from collections.abc import Callable

from sitl.mavlink.codec import MessageCodec, codec, codec_by_id
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.identity import Identity
from sitl.mavlink.links import Link
from sitl.mavlink.message_interval import LinkStreams
from sitl.mavlink.network import Network
from sitl.mavlink.router import QUIET
from sitl.mavlink.service import Builder
from sitl.mavlink.standard_modes import HEARTBEAT_PERIOD
from sitl.mavlink.telemetry.context import Context
from sitl.mavlink.telemetry.streams import BUILDERS, DEFAULT_RATES
from sitl.snapshot import Snapshot

__all__ = ["Publisher"]

_USUAL_SPEED = 500.0  # as fast as possible, in multiples of real time
_SPEED_WINDOW = 0.05  # over which the speed reached is measured [s], wall time


class Publisher:
    """The streams of all links.

    Attributes:
        streams: of each link.
        builders: who makes a message's fields from a snapshot, by message id; services add theirs.
        snapshot: the latest moment published, None before the first.
    """

    def __init__(
        self,
        network: Network,
        identity: Identity,
        context: Context,
        on_error: Callable[[], None],
        *,
        speed: float,
        lockstep: bool,
    ) -> None:
        """Publish on all links of a network; `on_error` is told in an except block when a builder fails."""
        self._network, self._context, self._on_error = network, context, on_error
        self.streams: dict[Link, LinkStreams] = {}
        for link in network.links:
            name = link.spec.streams
            self.streams[link] = LinkStreams(DEFAULT_RATES[identity.streams.get(name, name)])
        self.builders: dict[int, Builder] = {codec(name).id: build for name, build in BUILDERS.items()}
        self.snapshot: Snapshot | None = None
        self._caps_rates = speed > 1.0 or lockstep
        # Until it is measured: the speed asked for, or about what a computer reaches.
        self._stretch = 1.0 if lockstep else max(1.0, min(speed, _USUAL_SPEED))
        self._speed_mark: tuple[float, float] | None = None  # wall time and simulated time of the last measurement
        self._next_heartbeat = -math.inf  # [s], wall time
        self._load_mark = (time.monotonic(), time.process_time(), 0, 0)

    def next_due(self) -> float:
        """Simulated time [s] at which the next message is due."""
        return min((streams.next_due_us for streams in self.streams.values()), default=math.inf) * 1e-6

    def publish(self, snapshot: Snapshot, now_us: int, wall_time: float) -> None:
        """Send what is due at simulated time `now_us` and at this wall time [s]."""
        self.snapshot = snapshot
        if self._caps_rates:
            self._measure_speed(snapshot.time, wall_time)
        is_heartbeat_due = wall_time >= self._next_heartbeat
        if is_heartbeat_due:
            self._keep_house(wall_time)
        made: dict[int, tuple[MessageCodec, bytes] | None] = {}
        for link, streams in self.streams.items():
            due = streams.take_due(now_us, self._stretch) if streams.next_due_us <= now_us else []
            if is_heartbeat_due and link.spec.streams != QUIET:
                due.insert(0, mav.MAVLINK_MSG_ID_HEARTBEAT)
            audience = link.audience if due else ()
            if audience:
                for message_id in due:
                    if message_id not in made:
                        made[message_id] = self.made(message_id)
                messages = [message for message_id in due if (message := made[message_id]) is not None]
                for peer in audience:
                    link.deliver(peer, messages)
        if made and self._network.tape is not None:
            self._network.tape.sent([message for message in made.values() if message is not None])

    def made(self, message_id: int) -> tuple[MessageCodec, bytes] | None:
        """A message as it would be sent now; None before the first snapshot, and where there is nothing to tell."""
        if self.snapshot is None:
            return None
        try:
            values = self.builders[message_id](self.snapshot, self._context)
        except Exception:  # noqa: BLE001  (a message less, but the vehicle keeps flying)
            self._on_error()
            return None
        if values is None:
            return None
        packer = codec_by_id(message_id)
        return packer, packer.payload(values)

    def restarted(self) -> None:
        """Simulated time begins anew."""
        self.snapshot = None
        self._speed_mark = None
        for streams in self.streams.values():
            streams.restart()

    def _measure_speed(self, simulated: float, wall_time: float) -> None:
        if self._speed_mark is None:
            self._speed_mark = (wall_time, simulated)
            return
        elapsed = wall_time - self._speed_mark[0]
        if elapsed >= _SPEED_WINDOW:
            self._stretch = max(1.0, (simulated - self._speed_mark[1]) / elapsed)
            self._speed_mark = (wall_time, simulated)

    def _keep_house(self, wall_time: float) -> None:
        """Once per heartbeat: forget silent peers, sum up what telemetry reports of links and processor."""
        self._next_heartbeat = wall_time + HEARTBEAT_PERIOD
        self._network.forget_silent(wall_time)
        context, links = self._context, self._network.links
        context.received, context.malformed = sum(link.rx for link in links), sum(link.malformed for link in links)
        context.sent, context.dropped = sum(link.tx for link in links), sum(link.dropped for link in links)
        bytes_in, bytes_out = sum(link.bytes_in for link in links), sum(link.bytes_out for link in links)
        before, now = self._load_mark, (time.monotonic(), time.process_time(), bytes_in, bytes_out)
        elapsed = now[0] - before[0]
        if elapsed > 0.0:
            context.load, context.receive_rate, context.send_rate = (
                (new - old) / elapsed for new, old in zip(now[1:], before[1:], strict=True)
            )
        self._load_mark = now
