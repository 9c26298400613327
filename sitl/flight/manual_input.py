"""A pilot's sticks, named by where they move the vehicle."""

import math
from dataclasses import dataclass

__all__ = ["ManualInput", "Sticks", "past_dead_zone"]

DEAD_ZONE = 0.1  # share of the stick's travel about its centre that asks for nothing, as PX4's MPC_HOLD_DZ


@dataclass(frozen=True, slots=True)
class ManualInput:
    """Stick positions. Raises ValueError for a value out of its range.

    As MAVLink's MANUAL_CONTROL, divided by 1000: x, y, z, r are `forward`, `right`, `throttle`, `turn`.
    """

    forward: float = 0.0  # pitch stick, pushed: nose down [-1..1]
    right: float = 0.0  # roll stick [-1..1]
    throttle: float = 0.5  # 0..1
    turn: float = 0.0  # yaw stick, to the right [-1..1]
    tilt: float | None = None  # wing tilt in Manual mode, 0 cruise .. 1 hover; None: where transitions have moved it

    def __post_init__(self) -> None:
        for name, lowest in (("forward", -1.0), ("right", -1.0), ("throttle", 0.0), ("turn", -1.0), ("tilt", 0.0)):
            value = getattr(self, name)
            if name == "tilt" and value is None:
                continue
            if not (math.isfinite(value) and lowest <= value <= 1.0):
                msg = f"manual input {name}: expected {lowest:g} to 1, got {value}"
                raise ValueError(msg)

    @property
    def up(self) -> float:
        """Throttle stick from its centre, -1..1, past the dead zone."""
        return past_dead_zone(2.0 * self.throttle - 1.0)


def past_dead_zone(stick: float) -> float:
    """Deflection beyond the dead zone, -1..1: zero inside it, continuous at its edge."""
    beyond = abs(stick) - DEAD_ZONE
    return 0.0 if beyond <= 0.0 else math.copysign(beyond / (1.0 - DEAD_ZONE), stick)


class Sticks:
    """The sticks as the modes see them: the latest input, and when it came."""

    def __init__(self) -> None:
        self.now = ManualInput()
        self.received = -math.inf  # simulated time [s]
