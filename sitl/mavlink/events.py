"""Events: what happens to the flight, numbered so that a ground station misses none of it.

https://mavlink.io/en/services/events.html. Each EVENT has the next sequence number; CURRENT_EVENT_SEQUENCE tells the
latest one now and then, and who has missed some asks for them with REQUEST_EVENT. What the numbers mean is in the
component's metadata (`sitl.mavlink.event_definitions`).
"""

import math
from collections import deque
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

from sitl.flight.failsafe import Action, Cause
from sitl.flight.flight import Flight
from sitl.flight.landed import LandedState
from sitl.flight.messages import Message
from sitl.flight.mode import Mode
from sitl.flight.regime import Regime
from sitl.mavlink.arming_events import Judge, Report
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.event_definitions import EVENTS, Actuator, DisarmReason, Event, log_levels
from sitl.mavlink.service import Builder, Exchange, Handler, Sender, Service
from sitl.mavlink.telemetry.context import Context
from sitl.snapshot import Snapshot

__all__ = ["EventsService"]

KEPT: Final = 100  # events, for who has missed them
SEQUENCES: Final = 1 << 16
BEFORE_FIRST: Final = 0  # sequence number
RESET_TOLD: Final = 10.0  # that numbers have begun anew is told for so long [s], wall time
MOST_ERRORS: Final = 32  # answers to one request for events that are not kept any more
JUDGEMENT_PERIOD: Final = 1.0  # of health and arming checks [s], simulated,
JUDGEMENT_PAUSE: Final = 0.5  # and at least so long [s], wall time
DISARMED: Final = "Disarmed: "
REASONS: Final = {"by command": DisarmReason.COMMAND, "by force": DisarmReason.FORCE, "landed": DisarmReason.LANDED}
NO_TAKEOFF: Final = "no take-off"
ACTUATORS: Final = {
    "left motor": Actuator.LEFT_MOTOR,
    "right motor": Actuator.RIGHT_MOTOR,
    "tail motor": Actuator.TAIL_MOTOR,
    "tilt servo": Actuator.TILT_SERVO,
}


class _Seen(NamedTuple):
    """What the flight is like, to notice what has changed since the last look."""

    mode: Mode
    armed: bool
    regime: Regime
    on_ground: bool
    causes: tuple[Cause, ...]
    action: Action
    faults: tuple[str, ...]
    home: tuple[float, float, float]
    finished: bool
    paused: bool
    refusal: list[str]
    from_outside: bool
    items_reached: int


def _seen(flight: Flight, snapshot: Snapshot, items_reached: int) -> _Seen:
    failsafes, mission, home = flight.failsafes, flight.mission, flight.home
    causes = failsafes.causes
    return _Seen(
        flight.mode,
        flight.armed,
        flight.regime,
        flight.landed == LandedState.ON_GROUND,
        causes,
        failsafes.action if causes else Action.NONE,
        flight.actuators.faults,
        (home.north, home.east, home.down),
        mission.finished,
        mission.paused,
        flight.arming_problems,
        snapshot.mode is None,
        items_reached,
    )


class EventsService(Service):
    """Sends events, keeps the latest, and sends them again to who has missed them."""

    def __init__(self, exchange: Exchange) -> None:
        """Serve through `exchange`; the first event is that the vehicle has started."""
        super().__init__(exchange)
        self._sequence = BEFORE_FIRST
        self._kept: deque[tuple[int, dict[str, Any]]] = deque(maxlen=KEPT)
        self._reset_told: float | None = None  # since when [s], wall time
        self._flight: Flight | None = None  # whose messages are listened to
        self._seen: _Seen | None = None
        self._disarm_reason = DisarmReason.COMMAND
        self._judge = Judge()
        self._judged_at = (0.0, -math.inf)  # simulated time of the latest judgement, wall time before the next
        self._report_key: tuple[object, ...] | None = None
        self._send("vehicle_started")

    def messages(self) -> Mapping[str, Handler]:
        """See Service."""
        return {"REQUEST_EVENT": self._on_request_event}

    def telemetry(self) -> Mapping[str, Builder]:
        """See Service."""
        return {"CURRENT_EVENT_SEQUENCE": self._current_event_sequence}

    def restarted(self) -> None:
        """See Service: numbers go on, so that nobody takes new events for old ones."""
        self._seen = self._flight = self._report_key = None
        self._send("vehicle_started")

    def update(self, snapshot: Snapshot) -> None:
        """See Service."""
        simulation = self.exchange.simulation
        if not simulation.autopilot:
            return
        flight = simulation.flight
        if flight is not self._flight:
            self._flight = flight
            flight.messages.listeners.append(self._listen)
        before, now = self._seen, _seen(flight, snapshot, len(simulation.items_reached))
        self._seen = now
        if before is not None and (now.refusal is not before.refusal or now != before):
            self._tell_changes(before, now, flight)
        if not now.from_outside and self._is_time_to_judge(snapshot.time):
            report = self._judge.report(flight)
            if report.key != self._report_key:
                self._send_report(report)

    def _is_time_to_judge(self, time: float) -> bool:
        """Once in a while both of simulated time and of wall time, for it takes a millisecond."""
        wall_time = self.exchange.wall_time
        is_time = not 0.0 <= time - self._judged_at[0] < JUDGEMENT_PERIOD and wall_time >= self._judged_at[1]
        if is_time:
            self._judged_at = (time, wall_time + JUDGEMENT_PAUSE)
        return is_time

    def report(self) -> None:
        """Tell everybody the health of the vehicle, changed or not."""
        self._send_report(self._judge.report(self.exchange.simulation.flight))

    # -- what has happened ---------------------------------------------------------------------------------------

    def _listen(self, message: Message) -> None:
        """The reason of a disarming is known from the text alone."""
        if message.text.startswith(DISARMED):
            reason = message.text.removeprefix(DISARMED)
            other = DisarmReason.NO_TAKEOFF if reason.startswith(NO_TAKEOFF) else DisarmReason.FAILSAFE
            self._disarm_reason = REASONS.get(reason, other)

    def _tell_changes(self, before: _Seen, now: _Seen, flight: Flight) -> None:
        if now.from_outside != before.from_outside:
            self._send("control_taken" if now.from_outside else "control_returned")
        self._tell_arming(before, now, flight)
        self._tell_failsafes(before, now)
        if now.mode != before.mode:
            self._send("mode_changed", now.mode)
            if now.mode == Mode.TERMINATION:
                self._send("flight_terminated")
        if now.on_ground != before.on_ground:
            self._send("landing_detected" if now.on_ground else "takeoff_detected")
        if now.regime != before.regime:
            self._send("regime_changed", now.regime)
        if now.home != before.home:
            latitude, longitude, altitude = flight.home.geodetic
            self._send("home_set", round(latitude * 1e7), round(longitude * 1e7), altitude)
        self._tell_mission(before, now, flight)

    def _tell_arming(self, before: _Seen, now: _Seen, flight: Flight) -> None:
        if now.refusal is not before.refusal and now.refusal and not now.armed:
            self._send_report(self._judge.report(flight))
            told = self.exchange.identity.told(flight.mode, wing_borne=False, asked=None)
            self._send("arming_denied", told.number)
        if now.armed and not before.armed:
            self._send("armed_by_force" if now.refusal else "armed")
        elif before.armed and not now.armed:
            self._send("disarmed", self._disarm_reason)

    def _tell_failsafes(self, before: _Seen, now: _Seen) -> None:
        for fault in now.faults[len(before.faults) :]:
            self._send(
                "actuator_failed",
                next((ACTUATORS[name] for name in ACTUATORS if fault.startswith(name)), Actuator.OTHER),
            )
        for cause in now.causes:
            if cause not in before.causes:
                self._send("failsafe_raised", cause)
        for cause in before.causes:
            if cause not in now.causes:
                self._send("failsafe_ended", cause)
        if now.action > max(before.action, Action.WARN):
            self._send("failsafe_action", now.action, sum(1 << cause for cause in now.causes))

    def _tell_mission(self, before: _Seen, now: _Seen, flight: Flight) -> None:
        first = int(self.exchange.identity.mission_has_home)  # number that stations give the flight's first item
        count = len(flight.mission.items) + first
        reached = self.exchange.simulation.items_reached
        for item in reached[before.items_reached :]:
            self._send("mission_item_reached", item + first, count)
        if now.paused and not before.paused and reached:
            self._send("mission_paused", reached[-1] + first)
        if now.finished and not before.finished:
            self._send("mission_finished")

    def _send_report(self, report: Report) -> None:
        self._report_key = report.key
        for event, values in report.events:
            self._send_event(event, *values)

    # -- sending, once and again ---------------------------------------------------------------------------------

    def _send(self, name: str, *values: float) -> None:
        self._send_event(EVENTS[name], *values)

    def _send_event(self, event: Event, *values: float) -> None:
        self._sequence = (self._sequence + 1) % SEQUENCES
        fields: dict[str, Any] = {
            "id": event.id(self.exchange.component),
            "event_time_boot_ms": self.exchange.time_us // 1000 & 0xFFFFFFFF,
            "sequence": self._sequence,
            "log_levels": log_levels(event.level),
            "arguments": tuple(event.packed(*values)),
        }
        self._kept.append((self._sequence, fields))
        self.exchange.broadcast("EVENT", **fields)

    def _on_request_event(self, message: Any, sender: Sender) -> None:
        """Each of the events asked for, or that it is not kept; numbers may pass zero on the way."""
        kept = dict(self._kept)
        first = message.first_sequence
        count = (message.last_sequence - first) % SEQUENCES + 1
        nearby = ((first + number) % SEQUENCES for number in range(min(count, KEPT + MOST_ERRORS)))
        for sequence in [number for number in nearby if number not in kept][:MOST_ERRORS]:
            self.exchange.reply(
                sender,
                "RESPONSE_EVENT_ERROR",
                sequence=sequence,
                sequence_oldest_available=self._kept[0][0],
                reason=mav.MAV_EVENT_ERROR_REASON_UNAVAILABLE,
            )
        for sequence, fields in self._kept:
            if (sequence - first) % SEQUENCES < count:
                self.exchange.reply(sender, "EVENT", **fields)

    def _current_event_sequence(self, snapshot: Snapshot, context: Context) -> tuple[Any, ...]:
        del snapshot, context
        now = self.exchange.wall_time
        if self._reset_told is None:
            self._reset_told = now
        is_new = now - self._reset_told < RESET_TOLD
        return (self._sequence, mav.MAV_EVENT_CURRENT_SEQUENCE_FLAGS_RESET if is_new else 0)
