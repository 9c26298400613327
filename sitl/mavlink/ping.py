"""Ping protocol: whoever asks everybody is answered with his own numbers. https://mavlink.io/en/services/ping.html."""

from collections.abc import Mapping
from typing import Any

from sitl.mavlink.service import Builder, Exchange, Handler, Sender, Service
from sitl.mavlink.telemetry.context import Context, boot_us
from sitl.snapshot import Snapshot

__all__ = ["PingService"]

COUNTER_SIZE = 1 << 32


class PingService(Service):
    """Answers PING, and asks where it is streamed."""

    def __init__(self, exchange: Exchange) -> None:
        """Number our own questions from 0."""
        super().__init__(exchange)
        self._next = 0

    def messages(self) -> Mapping[str, Handler]:
        """See Service."""
        return {"PING": self._on_ping}

    def telemetry(self) -> Mapping[str, Builder]:
        """See Service."""
        return {"PING": self._question}

    def _on_ping(self, message: Any, sender: Sender) -> None:
        """One with a target is an answer, and answering answers would never end."""
        if message.target_system == 0 and message.target_component == 0:
            self.exchange.reply(sender, "PING", time_usec=message.time_usec, seq=message.seq)

    def _question(self, snapshot: Snapshot, _: Context) -> tuple[Any, ...]:
        """PING to everybody: our time [us], and the next number."""
        number = self._next
        self._next = (number + 1) % COUNTER_SIZE
        return (boot_us(snapshot), number, 0, 0)
