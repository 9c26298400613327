"""RC_CHANNELS: the pilot's sticks as a radio receiver would give them, and whether they are heard at all.

Roll, pitch, throttle, yaw on channels 1 to 4, as remote controls for aircraft have them, the tilt lever on 5. A pitch
stick that is pushed forward, nose down, is a short pulse.
"""

import math
from typing import Any

from sitl.flight.flight import Flight
from sitl.mavlink.telemetry.context import Context, boot_ms
from sitl.snapshot import Snapshot

__all__ = ["has_sticks", "hears_sticks", "rc_channels"]

CHANNELS = 18
UNUSED = 0xFFFF
UNKNOWN_STRENGTH = 255
CENTRE, HALF_TRAVEL = 1500, 500  # [us]
LOWEST, TRAVEL = 1000, 1000


def has_sticks(flight: Flight | None) -> bool:
    """Whether sticks have ever been heard of."""
    return flight is not None and math.isfinite(flight.sticks.received)


def hears_sticks(flight: Flight | None) -> bool:
    """Whether they are heard, and not lost (COM_RC_LOSS_T)."""
    if flight is None or not math.isfinite(flight.sticks.received):
        return False
    age = flight.links.manual_control
    return not flight.links.enforced or age is None or age <= flight.parameters["COM_RC_LOSS_T"]


def rc_channels(snapshot: Snapshot, context: Context) -> tuple[Any, ...]:
    """RC_CHANNELS: pulses [us]; no channels while no sticks are heard."""
    flight = context.flight
    pulses: list[int] = []
    if flight is not None and hears_sticks(flight):
        sticks = flight.sticks.now
        pulses = [
            round(CENTRE + HALF_TRAVEL * sticks.right),
            round(CENTRE - HALF_TRAVEL * sticks.forward),
            round(LOWEST + TRAVEL * sticks.throttle),
            round(CENTRE + HALF_TRAVEL * sticks.turn),
        ]
        if sticks.tilt is not None:
            pulses.append(round(LOWEST + TRAVEL * sticks.tilt))
    return (boot_ms(snapshot), len(pulses), *pulses, *(UNUSED,) * (CHANNELS - len(pulses)), UNKNOWN_STRENGTH)
