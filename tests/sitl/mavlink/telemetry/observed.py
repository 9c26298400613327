"""A vehicle as the builders of messages see it, and what they make of it as pymavlink decodes it."""

from typing import Any

from sitl.mavlink.codec import codec
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.telemetry.context import context_for
from sitl.mavlink.telemetry.streams import BUILDERS
from sitl.simulation import Simulation
from sitl.snapshot import Snapshot

__all__ = ["EPOCH", "Observed"]

EPOCH = 1_790_000_000.25  # 2026-09-21


class Observed:
    """A simulation on the ground, or as its arguments say, and the context that telemetry has of it."""

    def __init__(self, **simulation: Any) -> None:
        self.simulation = Simulation(**simulation)
        self.context = context_for(self.simulation, EPOCH)

    @property
    def flight(self) -> Any:
        return self.simulation.flight

    def fly(self, seconds: float) -> None:
        """Let time pass; the face looks at every update."""
        for _ in range(round(seconds * 50)):
            self.simulation.advance(0.02)
            self.context.note(self.simulation.snapshot())

    def values(self, name: str, snapshot: Snapshot | None = None) -> tuple[Any, ...] | None:
        """What a builder gives for a snapshot, by default one of now."""
        snapshot = self.simulation.snapshot() if snapshot is None else snapshot
        self.context.note(snapshot)
        return BUILDERS[name](snapshot, self.context)

    def sent(self, name: str, snapshot: Snapshot | None = None) -> Any:
        """The message as pymavlink decodes it from our frame; there must be one."""
        values = self.values(name, snapshot)
        assert values is not None, f"{name}: there is nothing to send"
        packer = codec(name)
        return mav.MAVLink(None).decode(bytearray(packer.frame(packer.payload(values), 0, 1, 1)))
