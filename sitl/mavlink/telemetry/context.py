"""What telemetry must know beside the snapshot: the vehicle itself, what has happened, facts that stay as they are."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from sitl.flight.flight import Flight
from sitl.hil.magnetic_field import MagneticField
from sitl.mavlink.local_origin import LocalOrigin
from sitl.mavlink.telemetry.flight_record import FlightRecord
from sitl.mavlink.telemetry.guidance import Guidance
from sitl.simulation import Simulation
from sitl.snapshot import Snapshot
from vehicle_model.aircraft import Channel

__all__ = ["Context", "boot_ms", "boot_us", "context_for"]

JUDGEMENT_PERIOD = 0.5  # of the arming checks [s], simulated


@dataclass(slots=True)
class Context:
    """Facts for the builders of messages, all SI.

    The face keeps the counters of the links, adds all links up, and says where files are kept.
    """

    simulation: Simulation
    channels: Sequence[Channel]
    tilt_time_constant: float
    tilt_rate_limit: float
    tilt_minimum: float
    tilt_maximum: float
    unix_epoch: float  # UTC at simulated time zero [s since 1970]
    magnetic_field: MagneticField
    guidance: Guidance
    origin: LocalOrigin
    record: FlightRecord = field(default_factory=FlightRecord)
    free_pulses: dict[int, int] = field(default_factory=dict[int, int])  # [us], of channels that the aircraft has not
    home_altitude_msl: float | None = None  # None until the first snapshot
    tilt_direction: int = -1  # of the last move of the tilt command: -1 to cruise, 1 to hover
    storage: Path | None = None  # folder that files are kept in; None: nothing is kept
    next_motor: int = 0  # to be told of in RAW_RPM
    load: float = 0.0  # share of one processor core that the process uses
    received: int = 0  # messages
    malformed: int = 0  # pieces received that are no MAVLink
    sent: int = 0  # messages
    dropped: int = 0  # messages that found a buffer full
    receive_rate: float = 0.0  # [bytes/s]
    send_rate: float = 0.0
    _judged_at: float = -math.inf  # simulated time [s]
    _ready: bool = False

    @property
    def flight(self) -> Flight | None:
        """The flight controller's events; None with the autopilot off."""
        return self.simulation.flight if self.simulation.autopilot else None

    def ready_to_arm(self, snapshot: Snapshot, flight: Flight) -> bool:
        """Whether nothing speaks against arming, judged every JUDGEMENT_PERIOD: a long mission takes its time."""
        if not 0.0 <= snapshot.time - self._judged_at < JUDGEMENT_PERIOD:
            self._judged_at = snapshot.time
            self._ready = not flight.check_arming()
        return self._ready

    def restarted(self) -> None:
        """The vehicle has begun anew, maybe elsewhere."""
        self._judged_at = -math.inf
        self.origin.restarted()
        self.home_altitude_msl = None
        self.tilt_direction = -1
        self.record = FlightRecord()

    def note(self, snapshot: Snapshot) -> None:
        """Learn from a snapshot what has to be remembered."""
        flight = self.flight
        if flight is not None:
            self.home_altitude_msl = flight.home.altitude
            self.record.note(snapshot, flight)
        elif self.home_altitude_msl is None:
            self.home_altitude_msl = snapshot.altitude_msl + snapshot.position_ned[2]
        lag = float(snapshot.controls[3]) - snapshot.tilt
        if abs(lag) > 0.01:  # [rad]; a wing at rest stands closer to its command
            self.tilt_direction = 1 if lag > 0.0 else -1


def context_for(simulation: Simulation, unix_epoch: float) -> Context:
    """Context for a vehicle, and UTC [s since 1970] at simulated time zero."""
    tilt_servo = simulation.aircraft.vehicle[0]["servos"][0]
    return Context(
        simulation=simulation,
        channels=simulation.aircraft.channels,
        tilt_time_constant=float(tilt_servo["time_constant"]),
        tilt_rate_limit=float(tilt_servo["rate_limit"]),
        tilt_minimum=float(tilt_servo["minimum"]),
        tilt_maximum=float(tilt_servo["maximum"]),
        unix_epoch=unix_epoch,
        magnetic_field=MagneticField(unix_epoch),
        guidance=Guidance(simulation),
        origin=LocalOrigin(simulation.scenario.home),
    )


def boot_us(snapshot: Snapshot) -> int:
    """Simulated time since start, whole microseconds."""
    return round(snapshot.time * 1e6)


def boot_ms(snapshot: Snapshot) -> int:
    """Simulated time since start, whole milliseconds, as an unsigned 32-bit counter that wraps after 50 days."""
    return round(snapshot.time * 1e3) & 0xFFFFFFFF
