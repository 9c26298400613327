"""Time synchronisation protocol: our time since start, beside the asker's. https://mavlink.io/en/services/timesync.html.

Like every other time stamp that we send it is simulated time. A streamed TIMESYNC is a question of ours: whoever
answers shows his clock beside ours to everybody on the link.
"""

from collections.abc import Mapping
from typing import Any

from sitl.mavlink.service import Builder, Handler, Sender, Service
from sitl.mavlink.telemetry.context import Context, boot_us
from sitl.snapshot import Snapshot

__all__ = ["TimesyncService"]


class TimesyncService(Service):
    """Answers TIMESYNC, and asks where it is streamed."""

    def messages(self) -> Mapping[str, Handler]:
        """See Service."""
        return {"TIMESYNC": self._on_timesync}

    def telemetry(self) -> Mapping[str, Builder]:
        """See Service."""
        return {"TIMESYNC": _question}

    def _on_timesync(self, message: Any, sender: Sender) -> None:
        """`tc1` is zero in a question and set in an answer; at the very start our time is zero, too."""
        if message.tc1 == 0:
            self.exchange.reply(sender, "TIMESYNC", tc1=max(self.exchange.time_us, 1) * 1000, ts1=message.ts1)


def _question(snapshot: Snapshot, _: Context) -> tuple[Any, ...]:
    """TIMESYNC to everybody: our time [ns]."""
    return (0, boot_us(snapshot) * 1000, 0, 0)
