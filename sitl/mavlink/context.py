"""What telemetry must know beside the snapshot: facts about the aircraft and its home that do not change in flight."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sitl.hil.magnetic_field import MagneticField
from sitl.snapshot import Snapshot
from vehicle_model.aircraft import Channel

__all__ = ["Context", "boot_ms", "boot_us", "context_for"]


@dataclass(slots=True)
class Context:
    """Facts for the builders of messages, all SI. The counters are kept by `sitl.mavlink.face`."""

    channels: Sequence[Channel]
    tilt_time_constant: float
    tilt_rate_limit: float
    tilt_minimum: float
    tilt_maximum: float
    unix_epoch: float  # UTC at simulated time zero [s since 1970]
    magnetic_field: MagneticField
    home_altitude_msl: float | None = None  # of the place that positions are measured from
    tilt_direction: int = -1  # of the last move of the tilt command: -1 to cruise, 1 to hover
    load: float = 0.0  # share of one processor core that the process uses
    received: int = 0  # messages, on all links
    malformed: int = 0

    def note(self, snapshot: Snapshot) -> None:
        """Learn from a snapshot what has to be remembered: the height of home, the way the wing is going."""
        if self.home_altitude_msl is None:
            self.home_altitude_msl = snapshot.altitude_msl + snapshot.position_ned[2]
        lag = float(snapshot.controls[3]) - snapshot.tilt
        if abs(lag) > 0.01:  # [rad]; a wing at rest stands closer to its command
            self.tilt_direction = 1 if lag > 0.0 else -1


def context_for(vehicle: np.ndarray, channels: Sequence[Channel], unix_epoch: float) -> Context:
    """Context for a VEHICLE record of shape (1,), its channels, and UTC [s since 1970] at simulated time zero."""
    tilt_servo = vehicle[0]["servos"][0]
    return Context(
        channels=channels,
        tilt_time_constant=float(tilt_servo["time_constant"]),
        tilt_rate_limit=float(tilt_servo["rate_limit"]),
        tilt_minimum=float(tilt_servo["minimum"]),
        tilt_maximum=float(tilt_servo["maximum"]),
        unix_epoch=unix_epoch,
        magnetic_field=MagneticField(unix_epoch),
    )


def boot_us(snapshot: Snapshot) -> int:
    """Simulated time since start, whole microseconds."""
    return round(snapshot.time * 1e6)


def boot_ms(snapshot: Snapshot) -> int:
    """Simulated time since start, whole milliseconds, as an unsigned 32-bit counter that wraps after 50 days."""
    return round(snapshot.time * 1e3) & 0xFFFFFFFF
