"""The loop that makes a simulation a vehicle: receive, apply controls, advance to the next due event, publish, sleep.

Everything that can stall lives elsewhere: links never block and count what they drop, viewer and terminal stand
behind queues of their own. Nothing here waits but for the clock, or in lockstep for the outside controller.
"""

import gc
import math
import select
import socket
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING

from sitl.airframe import FlightDivergedError
from sitl.start_file import StartError
from sitl.status import Report

if TYPE_CHECKING:
    from sitl.clock import Clock
    from sitl.mavlink import MavlinkFace
    from sitl.simulation import Simulation
    from sitl.snapshot import Snapshot
    from sitl.status import Status
    from sitl.viewer import Viewer

__all__ = ["Runtime"]

VIEWER_PERIOD = 0.02  # between pictures [s], wall time
KEEPALIVE_PERIOD = 0.2  # [s], wall time: the links' own matters go on while simulated time stands still
SPIN_PERIOD = 2e-4  # [s]: in lockstep the next tick is mostly near, and to be woken up for it would take longer
IDLE_PERIOD = 0.05  # [s], how long to wait for input at a time where nothing else sets the pace
TICKS_PER_TURN = 100  # catching up, or as fast as possible: so many steps before input is looked at again
NOT_SEEN = -1
ROUNDING = 1e-6  # [ticks]; a message due exactly on a tick must not wait for the next
EMERGENCY = 0  # MAV_SEVERITY


def _until_input(sockets: list[socket.socket], seconds: float) -> None:
    select.select(sockets, (), (), seconds)


class Runtime:
    """Runs one simulation against a clock until `stop`, or for `duration` simulated seconds.

    Args:
        simulation: the vehicle.
        face: its MAVLink side.
        clock: its pace; not used in lockstep, where each control message of the outside controller is one step.
        viewer, status: whom to show it to.
        duration: simulated seconds to fly.
        wait_servos: hold time still until the first servo output; in lockstep it always is.
        lockstep: let an outside controller drive time.
        wait: waits for something to read from these sockets, so many wall seconds at most.
    """

    def __init__(
        self,
        simulation: "Simulation",
        face: "MavlinkFace",
        clock: "Clock",
        viewer: "Viewer",
        status: "Status",
        *,
        duration: float = math.inf,
        wait_servos: bool = False,
        lockstep: bool = False,
        wait: Callable[[list[socket.socket], float], None] = _until_input,
    ) -> None:
        self._simulation = simulation
        self._face = face
        self._clock = clock
        self._viewer = viewer
        self._status = status
        self._end = sys.maxsize if duration == math.inf else math.ceil(duration * simulation.rate - ROUNDING)
        self._wait_servos = wait_servos
        self._lockstep = lockstep
        self._wait_for_input = wait
        self._going = True
        self._servos_taken = 0
        self._flown_before = self._counted_from = (
            0.0  # simulated time before the last restart, and at its beginning [s]
        )
        simulation.listener = face.statustext
        self._seen = simulation.snapshot()
        self._seen_tick = simulation.tick
        self._next_view = self._next_keepalive = self._next_report = 0.0  # [s], wall time

    def stop(self) -> None:
        """End the flight after the present turn; may be called from a signal handler."""
        self._going = False

    def run(self) -> None:
        """Fly. Raises FlightDivergedError, after telling the links, when the equations give nonsense."""
        # What the imports left need never be looked through again: a full collection would cost 90 ms of flight.
        gc.freeze()
        begin = self._clock.now()
        self._counted_from = self._simulation.time
        self._next_view = self._next_keepalive = begin
        self._next_report = begin + self._status.period
        try:
            if self._lockstep:
                self._fly_in_lockstep()
            else:
                if self._wait_servos:
                    self._hold_until_servos()
                self._fly_by_clock()
        except FlightDivergedError:
            self._face.statustext(EMERGENCY, "Flight diverged: simulation stopped")
            self._face.publish(self._look(), self._clock.now())
            raise
        finally:
            now = self._clock.now()
            self._status.offer(self._report(now))
            flown, took = self._flown_before + self._flown_now, max(now - begin, 1e-9)
            self._status.say(f"Flew {flown:.2f} s in {took:.2f} s, {flown / took:.4g} x real time")

    def _fly_by_clock(self) -> None:
        simulation, face, clock = self._simulation, self._face, self._clock
        clock.start(simulation.tick)
        while self._going and simulation.tick < self._end:
            now = clock.now()
            # Asking all sockets at once costs half of trying each.
            if select.select(face.sockets(), (), (), 0.0)[0] or now >= self._next_keepalive:
                self._receive(now)
                self._apply_servos()
            target = min(clock.due(simulation.tick, now, TICKS_PER_TURN), self._end)
            while True:
                message_due = face.next_due() * simulation.rate - ROUNDING
                if message_due <= simulation.tick:
                    face.publish(self._look(), now)
                    message_due = face.next_due() * simulation.rate - ROUNDING
                if simulation.tick >= target:
                    break
                stop = target if message_due >= target else max(math.ceil(message_due), simulation.tick + 1)
                simulation.step(stop - simulation.tick)
            self._attend(now)
            self._wait(clock.remaining(simulation.tick))

    def _fly_in_lockstep(self) -> None:
        simulation, face, servos, clock = self._simulation, self._face, self._face.servo_input, self._clock
        ticked = -math.inf
        while self._going and simulation.tick < self._end:
            now = clock.now()
            if now - ticked > SPIN_PERIOD:
                select.select(face.sockets(), (), (), IDLE_PERIOD)
                now = clock.now()
            self._receive(now)
            if servos.take_repeat():
                face.answer(self._look(), now)
            while servos.take_tick() and simulation.tick < self._end:
                ticked = now
                simulation.set_controls(servos.controls)
                simulation.step(1)
                face.answer(self._look(), now)
                if face.next_due() <= simulation.time:
                    face.publish(self._look(), now)
            self._attend(now)

    def _hold_until_servos(self) -> None:
        face, clock = self._face, self._clock
        while self._going and face.servo_input.source is None:
            select.select(face.sockets(), (), (), IDLE_PERIOD)
            now = clock.now()
            self._receive(now)
            self._apply_servos()
            self._attend(now)

    def _wait(self, remaining: float) -> None:
        """Sleep until the next step is due, a service wants to be called, or something arrives."""
        if remaining > 0.0:
            wanted = self._face.next_attention - self._clock.now()
            self._wait_for_input(self._face.sockets(), max(min(remaining, wanted), 0.0))

    @property
    def _flown_now(self) -> float:
        """Simulated time since the flight began, or began anew [s]."""
        return self._simulation.time - self._counted_from

    def _restart(self) -> None:
        """Let the vehicle begin anew, as somebody has asked over MAVLink."""
        wanted = self._face.restart_wanted
        assert wanted is not None
        flown = self._flown_now
        try:
            self._simulation.restart(**wanted)
        except StartError as error:
            self._face.restart_refused(str(error))
            return
        self._flown_before += flown
        self._counted_from = self._simulation.time
        self._seen_tick = NOT_SEEN
        self._clock.start(self._simulation.tick)
        self._face.restarted()
        self._status.say(f"Restarted: {self._simulation.description}")

    def _receive(self, now: float) -> None:
        # Channels that an outside controller does not send stay where they are when it takes the servos.
        self._face.servo_input.follow(self._simulation.controls)
        self._face.receive(now)
        self._seen_tick = NOT_SEEN  # what came may have changed more than time does

    def _apply_servos(self) -> None:
        """Let the servo outputs of an outside controller have the actuators, and the autopilot once they are missed."""
        servos = self._face.servo_input
        if servos.taken != self._servos_taken:
            self._servos_taken = servos.taken
            self._simulation.set_controls(servos.controls)

    def _watch_servos(self, now: float) -> None:
        servos = self._face.servo_input
        servos.watch(now)
        if self._simulation.is_flown_from_outside and not servos.fresh(now):
            self._simulation.take_over()

    def _look(self) -> "Snapshot":
        """The present moment, looked at once however many want to see it."""
        if self._seen_tick != self._simulation.tick:
            self._seen = self._simulation.snapshot()
            self._seen_tick = self._simulation.tick
        return self._seen

    def _attend(self, now: float) -> None:
        """What is due by wall time: stale servos, pictures, the links' own matters, a line for the terminal."""
        self._face.attend(now)
        if self._face.restart_wanted is not None:
            self._restart()
        if self._face.stop_wanted:
            self.stop()
        self._watch_servos(now)
        # A picture may be late by half its period, to show a moment that is looked at anyway.
        late = now - self._next_view
        if late >= 0.0 and (self._seen_tick == self._simulation.tick or late >= 0.5 * VIEWER_PERIOD):
            self._next_view += max(late, VIEWER_PERIOD)
            self._viewer.offer(self._look())
        if now >= self._next_keepalive:
            self._next_keepalive = now + KEEPALIVE_PERIOD
            self._face.publish(self._look(), now)
        if now >= self._next_report:
            self._next_report = now + self._status.period
            self._status.offer(self._report(now))

    def _report(self, now: float) -> Report:
        seen, source = self._look(), self._face.servo_input.source
        place = "on ground" if seen.on_ground else f"{-seen.position_ned[2]:.0f} m {seen.airspeed:.1f} m/s"
        if seen.mode is None:
            flown_by = f"servos {'-' if source is None else source.system}"
        else:
            flown_by = f"{seen.mode.capitalize()} {'armed' if seen.armed else 'disarmed'}"
        return Report(
            time=seen.time,
            wall_time=now,
            state=f"{place} tilt {math.degrees(seen.tilt):.0f} {flown_by}",
            late_ticks=self._clock.late_ticks,
            dropped_ticks=self._clock.dropped_ticks,
            links=self._face.statistics(),
            viewer_dropped=self._viewer.dropped,
        )
