"""The loop that makes a simulation a vehicle: receive, apply controls, advance to the next due event, publish, sleep.

Everything that can stall lives elsewhere: links never block and count what they drop, viewer and terminal stand
behind queues of their own. Nothing here waits but for the clock, or in lockstep for the outside controller.
"""

import gc
import math
import select
import time
from typing import TYPE_CHECKING

from sitl.simulation import FlightDivergedError
from sitl.status import Report

if TYPE_CHECKING:
    from sitl.clock import Clock
    from sitl.mavlink import MavlinkFace
    from sitl.simulation import Simulation
    from sitl.snapshot import Snapshot
    from sitl.status import Status
    from sitl.viewer import Viewer

__all__ = ["Runtime"]

VIEWER_PERIOD = 0.02  # [s], wall time
TICKS_PER_TURN = 100  # catching up, or as fast as possible: so many steps before input is looked at again
IDLE_PERIOD = 0.05  # [s], how long a held vehicle waits for input before it looks after the rest
HEARTBEAT_PERIOD = 1.0  # [s], wall time, while simulated time stands still
EMERGENCY = 0  # MAV_SEVERITY


class Runtime:
    """Runs one simulation against a clock until `stop`, or for `duration` simulated seconds.

    Args:
        simulation: the vehicle.
        face: its MAVLink side.
        clock: its pace; not used in lockstep, where each control message of the outside controller is one step.
        viewer, status: whom to show it to.
        duration: simulated seconds to fly.
        wait_servos: hold time still until the first servo output.
        lockstep: let an outside controller drive time.
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
    ) -> None:
        self._simulation = simulation
        self._face = face
        self._clock = clock
        self._viewer = viewer
        self._status = status
        self._end = math.inf if duration == math.inf else max(0, math.ceil(duration * simulation.rate - 1e-9))
        self._wait_servos = wait_servos
        self._lockstep = lockstep
        self._going = True
        self._next_view = self._next_report = self._next_heartbeat = -math.inf
        self._text = ""

    def stop(self) -> None:
        """End the flight after the present turn; may be called from a signal handler."""
        self._going = False

    def run(self) -> None:
        """Fly. Raises FlightDivergedError, after telling the links, when the equations give nonsense."""
        # Reference counting frees all of what a turn leaves behind, so the collector would only cost pauses over
        # the objects that exist by now.
        gc.collect()
        gc.freeze()
        try:
            if self._lockstep:
                self._run_lockstep()
            else:
                if self._wait_servos:
                    self._hold_until_servos()
                self._run_paced()
        except FlightDivergedError as error:
            self._face.statustext(EMERGENCY, "Flight diverged: simulation stopped")
            self._face.publish(self._simulation.snapshot(), time.monotonic())
            raise error from None
