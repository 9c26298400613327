"""What a microservice gets to see: who sent something, and how to answer."""

from typing import Any, NamedTuple, Protocol

from sitl.mavlink.codec import MessageCodec
from sitl.mavlink.links import Link, Peer

__all__ = ["Exchange", "Sender"]


class Sender(NamedTuple):
    """Where a message came from and where an answer goes."""

    system: int
    component: int
    link: Link
    peer: Peer


class Exchange(Protocol):
    """What microservices ask of the face of the vehicle."""

    system: int
    component: int

    @property
    def time_us(self) -> int:
        """Simulated time of the present state [us]."""
        ...

    def reply(self, sender: Sender, name: str, **fields: Any) -> None:
        """Send one message to the sender of another, and to nobody else."""
        ...

    def is_for_us(self, target_system: int, target_component: int) -> bool:
        """Whether a message with this target is ours to answer (0 means everybody)."""
        ...

    def telemetry(self, message_id: int) -> tuple[MessageCodec, bytes] | None:
        """A streamed message as it would be sent now; None if there is no such message or nothing to tell yet."""
        ...
