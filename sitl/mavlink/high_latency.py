"""High latency protocol: the few numbers that matter, on links where each message costs.

https://mavlink.io/en/services/high_latency.html. A link whose stream set is `highlatency` carries no heartbeat and no
streams, only commands, and HIGH_LATENCY2 every 5 s while MAV_CMD_CONTROL_HIGH_LATENCY lets it. On other links the
message can be asked for and streamed like any other.
"""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

from sitl.control.records import Horizontal, Level, Vertical
from sitl.flight.failsafe import Cause
from sitl.flight.flight import Flight
from sitl.flight.refused import Refused
from sitl.hil.air_data import equivalent_airspeed
from sitl.mavlink.command import Command, CommandHandler, whole_number
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.links import Link
from sitl.mavlink.router import QUIET
from sitl.mavlink.service import Builder, Exchange, Service
from sitl.mavlink.telemetry.context import Context, boot_ms
from sitl.mavlink.timers import Timer
from sitl.snapshot import Snapshot

__all__ = ["HighLatencyService"]

PERIOD = 5.0  # [s], wall time
START, STOP = 1, 0
AT_TARGET = 1.0  # [m]; closer to it there is no direction to speak of
BATTERY_UNKNOWN = -1
ZERO_CELSIUS = 273.15  # [K]
DEGREES_E7 = math.degrees(1.0) * 1e7

FAILURES = {
    Cause.MANUAL_CONTROL: mav.HL_FAILURE_FLAG_RC_RECEIVER,
    Cause.OFFBOARD: mav.HL_FAILURE_FLAG_OFFBOARD_LINK,
    Cause.FENCE: mav.HL_FAILURE_FLAG_GEOFENCE,
    Cause.BATTERY_CRITICAL: mav.HL_FAILURE_FLAG_BATTERY,
    Cause.BATTERY_EMERGENCY: mav.HL_FAILURE_FLAG_BATTERY,
    Cause.ACTUATOR: mav.HL_FAILURE_FLAG_ENGINE,
}


class _Target(NamedTuple):
    """Where the flight is going: altitude above mean sea level [m], heading [rad], distance [m], airspeed [m/s]."""

    altitude: float
    heading: float
    distance: float = 0.0
    airspeed: float = 0.0


class HighLatencyService(Service):
    """HIGH_LATENCY2, and MAV_CMD_CONTROL_HIGH_LATENCY, which starts and stops it on the links made for it."""

    def __init__(self, exchange: Exchange) -> None:
        """Begin in silence."""
        super().__init__(exchange)
        self._timer: Timer | None = None  # while it is being sent
        self._fastest_climb = 0.0  # up or down since the last message [m/s]

    def commands(self) -> Mapping[int, CommandHandler]:
        """See Service."""
        return {mav.MAV_CMD_CONTROL_HIGH_LATENCY: self._control}

    def telemetry(self) -> Mapping[str, Builder]:
        """See Service."""
        return {"HIGH_LATENCY2": self._high_latency2}

    def update(self, snapshot: Snapshot) -> None:
        """See Service."""
        self._fastest_climb = max(self._fastest_climb, abs(snapshot.velocity_ned[2]))

    def _control(self, command: Command) -> int:
        wanted = whole_number(command.params[0])
        if wanted not in (START, STOP):
            msg = f"high latency: expected 1 to start or 0 to stop, got {command.params[0]:g}"
            raise Refused(msg)
        if not self._links():
            self.exchange.tell(command.sender, mav.MAV_SEVERITY_WARNING, f"No link for high latency: needs ,{QUIET}")
            return mav.MAV_RESULT_FAILED
        if wanted == STOP:
            if self._timer is not None:
                self._timer.cancel()
            self._timer = None
        elif self._timer is None:
            self._send()
        return mav.MAV_RESULT_ACCEPTED

    def _links(self) -> list[Link]:
        return [link for link in self.exchange.links if link.spec.streams == QUIET]

    def _send(self) -> None:
        """Send one now, and the next in PERIOD."""
        self._timer = self.exchange.after(PERIOD, self._send)
        message = self.exchange.telemetry(mav.MAVLINK_MSG_ID_HIGH_LATENCY2)
        if message is not None:
            for link in self._links():
                for peer in link.audience:
                    link.send(peer, [message])

    # -- the message ---------------------------------------------------------------------------------------------

    def _high_latency2(self, snapshot: Snapshot, _: Context) -> tuple[Any, ...]:
        """HIGH_LATENCY2; `wind_heading` is where the wind blows to, as PX4 has it, `custom0` the tilt angle [deg]."""
        identity = self.exchange.identity
        north, east, down = snapshot.velocity_ned
        wind_north, wind_east = snapshot.wind_ned[:2]
        climb, self._fastest_climb = max(self._fastest_climb, abs(down)), 0.0
        flight = self._flight()
        target = _target(snapshot, flight)
        remaining = snapshot.battery_remaining
        exact = (0, 0)  # position errors: the estimate is the truth
        return (
            boot_ms(snapshot),
            identity.vehicle_type,
            identity.autopilot,
            self._custom_mode(),
            round(snapshot.latitude * DEGREES_E7),
            round(snapshot.longitude * DEGREES_E7),
            round(snapshot.altitude_msl),
            round(target.altitude),
            _half_degrees(snapshot.yaw),
            _half_degrees(target.heading),
            round(target.distance / 10.0),
            round(50.0 * float(snapshot.controls[0] + snapshot.controls[1])),
            round(5.0 * equivalent_airspeed(snapshot.airspeed, snapshot.density)),
            round(5.0 * target.airspeed),
            round(5.0 * math.hypot(north, east)),
            round(5.0 * math.hypot(wind_north, wind_east)),
            _half_degrees(math.atan2(wind_east, wind_north)),
            *exact,
            round(snapshot.temperature - ZERO_CELSIUS),
            round(10.0 * climb),
            BATTERY_UNKNOWN if remaining is None else round(100.0 * remaining),
            0 if flight is None else flight.mission.current + identity.mission_has_home,
            0 if flight is None else _failures(flight),
            round(math.degrees(snapshot.tilt)),
            *(0, 0),
        )

    def _custom_mode(self) -> int:
        """The heartbeat's, in 16 bits: where main and sub mode fill the upper half of 32 it is these."""
        heartbeat = self.exchange.telemetry(mav.MAVLINK_MSG_ID_HEARTBEAT)
        if heartbeat is None:
            return 0
        packer, payload = heartbeat
        mode = packer.read(payload).custom_mode
        return mode >> 16 if self.exchange.identity.packs_mode else mode & 0xFFFF

    def _flight(self) -> Flight | None:
        try:
            return self.exchange.simulation.flight
        except Refused:
            return None


def _target(snapshot: Snapshot, flight: Flight | None) -> _Target:
    """What the control laws are asked for, where that is a place, a height or a speed; else where the vehicle is."""
    here = _Target(snapshot.altitude_msl, snapshot.yaw)
    if flight is None or flight.demand.level != Level.VELOCITY:
        return here
    setpoint = flight.demand.record[0]
    north, east, down = (float(value) for value in setpoint["position_ned"])
    if setpoint["cruise"]:
        here = here._replace(airspeed=float(setpoint["speed"]))
    if setpoint["vertical"] == Vertical.ALTITUDE and math.isfinite(down):
        here = here._replace(altitude=flight.places.altitude - down)
    if setpoint["horizontal"] in (Horizontal.POINT, Horizontal.LEG, Horizontal.CIRCLE):
        to_north, to_east = north - snapshot.position_ned[0], east - snapshot.position_ned[1]
        distance = math.hypot(to_north, to_east)
        if AT_TARGET < distance < math.inf:
            return here._replace(distance=distance, heading=math.atan2(to_east, to_north))
    return here


def _failures(flight: Flight) -> int:
    flags = 0
    for cause in flight.failsafes.causes:
        flags |= FAILURES.get(cause, 0)
    if flight.breach is not None:
        flags |= mav.HL_FAILURE_FLAG_GEOFENCE
    return flags


def _half_degrees(angle: float) -> int:
    """An angle [rad] as HIGH_LATENCY2 tells directions: in steps of 2 degrees, 0 to 179."""
    return round(math.degrees(angle) / 2.0) % 180
