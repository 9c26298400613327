"""Time synchronisation protocol: our time since start, beside the asker's. https://mavlink.io/en/services/timesync.html."""

from sitl.mavlink.codec import codec
from sitl.mavlink.service import Exchange, Sender

__all__ = ["TimesyncService"]


class TimesyncService:
    """Answers TIMESYNC requests, in simulated time like every other time stamp we send."""

    def __init__(self, exchange: Exchange) -> None:
        """Answer through `exchange`."""
        self._exchange = exchange
        self._codec = codec("TIMESYNC")

    def on_timesync(self, payload: bytes, sender: Sender) -> None:
        """TIMESYNC; `tc1` is zero in a request and set in an answer."""
        tc1, ts1, target_system, target_component = self._codec.unpack(payload)
        if tc1 == 0 and self._exchange.is_for_us(target_system, target_component):
            self._exchange.reply(
                sender,
                "TIMESYNC",
                # At the very start our time is zero too, which would make this a request.
                tc1=max(self._exchange.time_us, 1) * 1000,
                ts1=ts1,
                target_system=sender.system,
                target_component=sender.component,
            )
