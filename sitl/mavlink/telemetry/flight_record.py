"""When the vehicle armed, took off, landed and left its fence: FLIGHT_INFORMATION and FENCE_STATUS."""

from typing import TYPE_CHECKING, Any

from sitl.flight.flight import Flight
from sitl.mavlink.dialect import tiltwing as mav
from sitl.snapshot import Snapshot

if TYPE_CHECKING:
    from sitl.mavlink.telemetry.context import Context

__all__ = ["FlightRecord", "fence_status", "flight_information"]

ON_GROUND = "ON_GROUND"


class FlightRecord:
    """What has happened since the start, in the messages' units: simulated time since then, 0 for not yet.

    Attributes:
        armed_us, took_off_us, landed_ms: of the present flight, or the last one.
        number: of that flight, from 1; 0: there was none yet.
        breaches: how often the fence was left.
        breach_type: MAVLink's FENCE_BREACH, of the latest breach.
        breach_ms: when that began.
    """

    def __init__(self) -> None:
        self.armed_us = self.took_off_us = self.landed_ms = self.number = 0
        self.breaches = self.breach_ms = 0
        self.breach_type: int = mav.FENCE_BREACH_NONE
        self._armed = self._flying = self._outside = False

    def note(self, snapshot: Snapshot, flight: Flight) -> None:
        """Look at the vehicle; some of a microsecond while nothing changes."""
        # An outside controller that flies does not say whether it has armed.
        armed = self._armed if snapshot.armed is None else snapshot.armed
        if armed != self._armed:
            self._armed = armed
            if armed:
                self.number += 1
                self.armed_us = max(round(snapshot.time * 1e6), 1)
                self.took_off_us = self.landed_ms = 0
        flying = self._flying if snapshot.landed is None else snapshot.landed != ON_GROUND
        if flying != self._flying:
            self._flying = flying
            if flying:
                self.took_off_us = max(round(snapshot.time * 1e6), 1)
            else:
                self.landed_ms = max(round(snapshot.time * 1e3), 1)
        outside = flight.breach is not None
        if outside != self._outside:
            self._outside = outside
            if outside:
                self.breaches += 1
                self.breach_ms = round(snapshot.time * 1e3)
                too_high = flight.fence.breach_above(flight.view.down) is not None
                self.breach_type = mav.FENCE_BREACH_MAXALT if too_high else mav.FENCE_BREACH_BOUNDARY


def flight_information(snapshot: Snapshot, context: "Context") -> tuple[Any, ...]:
    """FLIGHT_INFORMATION: when it armed and took off [us], and landed [ms] since start; number of the flight."""
    record = context.record
    return (
        round(snapshot.time * 1e3) & 0xFFFFFFFF,
        record.armed_us,
        record.took_off_us,
        record.number,
        record.landed_ms & 0xFFFFFFFF,
    )


def fence_status(_: Snapshot, context: "Context") -> tuple[Any, ...]:
    """FENCE_STATUS: whether the vehicle is outside now; how often it was, why and when [ms since start] at last."""
    flight, record = context.flight, context.record
    return (
        int(flight is not None and flight.breach is not None),
        record.breaches,
        record.breach_type,
        record.breach_ms & 0xFFFFFFFF,
        mav.FENCE_MITIGATE_NONE,
    )
