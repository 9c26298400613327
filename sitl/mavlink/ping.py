"""Ping protocol: whoever asks everybody is answered with his own numbers. https://mavlink.io/en/services/ping.html."""

from sitl.mavlink.codec import codec
from sitl.mavlink.service import Exchange, Sender

__all__ = ["PingService"]


class PingService:
    """Answers PING."""

    def __init__(self, exchange: Exchange) -> None:
        """Answer through `exchange`."""
        self._exchange = exchange
        self._codec = codec("PING")

    def on_ping(self, payload: bytes, sender: Sender) -> None:
        """PING; one with a target is an answer, and answering answers would never end."""
        time_us, sequence, target_system, target_component = self._codec.unpack(payload)
        if target_system == 0 and target_component == 0:
            self._exchange.reply(
                sender,
                "PING",
                time_usec=time_us,
                seq=sequence,
                target_system=sender.system,
                target_component=sender.component,
            )
