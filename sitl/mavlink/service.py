"""What all microservices have in common: who sent something, how to answer, and the tables by which they are found.

A microservice is a class derived from `Service` in a file of its own, named as the MAVLink guide names it
(https://mavlink.io/en/services/). It sees the rest of the vehicle only through an `Exchange`, so that it runs alone
behind an in-memory link as well as behind sockets.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from sitl.mavlink.links import Link, Peer

if TYPE_CHECKING:
    from sitl.mavlink.codec import MessageCodec
    from sitl.mavlink.command import CommandHandler
    from sitl.mavlink.identity import Identity
    from sitl.mavlink.state_folder import StateFolder
    from sitl.mavlink.telemetry.context import Context
    from sitl.mavlink.timers import Timer
    from sitl.simulation import Simulation
    from sitl.snapshot import Snapshot

__all__ = ["Builder", "Exchange", "Handler", "Request", "Requestable", "Sender", "Service"]


@dataclass(frozen=True, slots=True)
class Sender:
    """Where a message came from and where an answer goes.

    `sequence` is the number of the frame that brought it: no part of who it is from.
    """

    system: int
    component: int
    link: Link
    peer: Peer
    sequence: int = field(default=0, compare=False)


class Request(NamedTuple):
    """A REQUEST_MESSAGE: the command's parameters after the message id, as sent (NaN: unset)."""

    params: tuple[float, ...]
    sender: Sender


# What a service does with a message: a named tuple of its fields (see MessageCodec.read).
Handler = Callable[[Any, Sender], None]
# The fields of each message to send on request; none at all is an answer too; None: there is nothing to send now.
Requestable = Callable[[Request], Iterable[Mapping[str, Any]] | None]
# Field values in the order of the definition, arrays flattened, in the message's units; None: nothing to send now.
Builder = Callable[["Snapshot", "Context"], tuple[Any, ...] | None]


class Exchange(Protocol):
    """What microservices ask of the face of the vehicle.

    Attributes:
        system, component: our ids.
        simulation: the vehicle; its `flight` takes the commands. A restart gives it another flight.
        identity: whom we look like.
        wall_time: of this turn, on the monotonic clock [s].
        speed: simulated seconds per wall second asked for; inf is as fast as possible.
        state: where things are kept.
    """

    system: int
    component: int
    simulation: "Simulation"
    identity: "Identity"
    wall_time: float
    speed: float
    state: "StateFolder"

    @property
    def time_us(self) -> int:
        """Simulated time of the present state [us]."""
        ...

    @property
    def links(self) -> Sequence[Link]:
        """All links."""
        ...

    def reply(self, sender: Sender, name: str, **fields: Any) -> bool:
        """Send one message to the sender of another, and to nobody else.

        Target fields that are not given are the sender's; other fields left out are zero. Returns whether the peer's
        socket took it.
        """
        ...

    def broadcast(self, name: str, **fields: Any) -> None:
        """Send one message to everybody on all links."""
        ...

    def tell(self, sender: Sender, severity: int, text: str) -> None:
        """Send a text for the pilot (severity as MAV_SEVERITY) to one of them."""
        ...

    def statustext(self, severity: int, text: str) -> None:
        """Send a text for the pilot to everybody."""
        ...

    def after(self, delay: float, call: Callable[[], None]) -> "Timer":
        """Call something once, so many wall seconds from now; the loop is woken for it."""
        ...

    def telemetry(self, message_id: int) -> "tuple[MessageCodec, bytes] | None":
        """A streamed message as it would be sent now; None if there is no such message or nothing to tell."""
        ...

    def request_restart(self, refused: Callable[[str], None] | None = None, **how: Any) -> None:
        """Let the vehicle begin anew once this turn is over, as Simulation.restart does with these arguments.

        `refused` is told why it cannot be, if it cannot.
        """
        ...

    def request_stop(self) -> None:
        """Let the process end."""
        ...


class Service:
    """Base of the microservices: the tables are empty until one fills them.

    Handlers are called only for messages that are meant for us, never for our own words come back, and must not raise
    for any values of the fields.
    """

    def __init__(self, exchange: Exchange) -> None:
        """Serve through `exchange`."""
        self.exchange = exchange

    def messages(self) -> Mapping[str, Handler]:
        """Messages served, by name."""
        return {}

    def commands(self) -> "Mapping[int, CommandHandler]":
        """MAV_CMDs served."""
        return {}

    def requestable(self) -> Mapping[str, Requestable]:
        """Messages sent on REQUEST_MESSAGE only, by name."""
        return {}

    def telemetry(self) -> Mapping[str, Builder]:
        """Messages that can be streamed, and requested, by name."""
        return {}

    def update(self, snapshot: "Snapshot") -> None:
        """Look at the vehicle; called after every publication, at most 50 times per simulated second."""

    def restarted(self) -> None:
        """The vehicle has begun anew: the flight is another object, time is zero again."""

    def close(self) -> None:
        """The vehicle ends."""
