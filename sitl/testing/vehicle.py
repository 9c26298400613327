"""A vehicle for tests: its process, the wire to it, and what a test can do with both."""

import math
import re
import tempfile
import time
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from sitl.testing.options import SitlOptions
from sitl.testing.ports import LOOPBACK
from sitl.testing.process import SitlError, VehicleProcess
from sitl.testing.relay import Relay
from sitl.testing.wire import Wire

__all__ = ["SitlVehicle"]

_RESET = 31011  # MAV_CMD_USER_2
_AS_STARTED, _ON_THE_GROUND, _TRIMMED = 0.0, 1.0, 2.0
_NAN = math.nan


class SitlVehicle:
    """A vehicle in a process of its own, reached over a wire that can fail. `start` it, or use it in a with block.

    Attributes:
        options: what it is started with.
        wire: the wire between clients and vehicle, with its faults.
        port: where a client may listen; the vehicle's messages are sent there.
        port_out: where a client may send to first, and answer to.
        system_id: its MAVLink system id.
        speed: simulated seconds per wall second asked for, inf for as fast as possible.
    """

    def __init__(self, **options: Any) -> None:
        """Options as `SitlOptions` has them. Raises SitlError for one that there is not."""
        self.options = SitlOptions.of(options)
        self.system_id = self.options.system_id
        self.speed = self.options.speed_factor
        self.wire = Wire(system=self.system_id, seed=self.options.seed or 0)
        self._folder = tempfile.TemporaryDirectory(prefix="tiltwing-sitl-")
        self._log = Path(self._folder.name) / "log"
        self._log.touch()
        self._last_log = ""
        self._connections: list[Any] = []
        self._process: VehicleProcess | None = None
        try:
            self._relay = Relay(self.wire, self.options.port)
        except OSError as error:
            self._folder.cleanup()
            raise SitlError(str(error)) from None
        self.port = self._relay.port
        self.port_out = self._relay.port_out

    def __enter__(self) -> Self:
        """Start; at the end of the with block close."""
        try:
            return self.start()
        except BaseException:
            self.close()
            raise

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """See __enter__."""
        self.close()

    # -- where it is ---------------------------------------------------------------------------------------------

    @property
    def connection(self) -> str:
        """For pymavlink and its like, which listen: `udpin:127.0.0.1:PORT`."""
        return f"udpin:{LOOPBACK}:{self.port}"

    @property
    def connection_out(self) -> str:
        """The same for a client that sends first: `udpout:127.0.0.1:PORT`."""
        return f"udpout:{LOOPBACK}:{self.port_out}"

    @property
    def mavsdk(self) -> str:
        """For MAVSDK, which listens: `udpin://127.0.0.1:PORT`."""
        return f"udpin://{LOOPBACK}:{self.port}"

    @property
    def mavsdk_out(self) -> str:
        """For MAVSDK that sends first: `udpout://127.0.0.1:PORT`."""
        return f"udpout://{LOOPBACK}:{self.port_out}"

    @property
    def log(self) -> str:
        """What its process has printed so far, also what it printed before a restart."""
        return self._log.read_text("utf-8", "replace") if self._log.exists() else self._last_log

    @property
    def is_running(self) -> bool:
        """Whether its process runs."""
        return self._process is not None and self._process.is_running

    @property
    def pid(self) -> int | None:
        """Id of its process; None before the first start."""
        return None if self._process is None else self._process.pid

    # -- what a test does with it --------------------------------------------------------------------------------

    def start(self) -> Self:
        """Start the process and wait until it is heard. Raises SitlError, with what it printed, if it does not fly."""
        __tracebackhide__ = True  # of no interest to who reads why a test has failed
        if self.is_running:
            return self
        self.stop()  # it may have ended by itself
        self._process = VehicleProcess(self.options.command_line(self._relay.attach()), self._log)
        try:
            self._process.wait_until(self._relay.heard, self.options.start_timeout)
        except BaseException:
            self.stop()
            self._process = None
            raise
        return self

    def stop(self) -> None:
        """End the process, as when the power fails: clients hear nothing more. Faults of the wire stay."""
        if self._process is not None:
            self._process.stop()
        self._relay.detach()

    def restart(self) -> None:
        """Stop and start: another process with the same options, at the same ports. Wire and its faults stay."""
        self.stop()
        self.start()

    def close(self) -> None:
        """Stop, and close all that was opened. Raises SitlError if the process had ended by itself, with an error."""
        for connection in self._connections:
            connection.close()
        self._connections.clear()
        try:
            if self._process is not None:
                self._process.check()
        finally:
            self.stop()
            self._process = None
            self._relay.close()
            self._last_log = self.log
            self._folder.cleanup()

    def connect(self, *, source_system: int = 250, source_component: int = 191, timeout: float = 10.0) -> Any:
        """A pymavlink connection of its own, beside the client under test, that has heard the vehicle.

        It speaks as `source_system` and `source_component`, is no ground station whose heartbeats the vehicle could
        miss, and is closed with the vehicle. Raises SitlError if no HEARTBEAT comes within `timeout` wall seconds.
        """
        from pymavlink import mavutil

        mav: Any = mavutil.mavlink
        connection: Any = mavutil.mavlink_connection(
            self.connection_out, source_system=source_system, source_component=source_component
        )
        self._connections.append(connection)
        end = time.monotonic() + timeout
        while time.monotonic() < end:
            # Also tells the wire where to send to.
            connection.mav.heartbeat_send(mav.MAV_TYPE_ONBOARD_CONTROLLER, mav.MAV_AUTOPILOT_INVALID, 0, 0, 0)
            heartbeat = connection.recv_match(type="HEARTBEAT", blocking=True, timeout=1.5)
            if heartbeat is not None and heartbeat.get_srcSystem() == self.system_id:
                return connection
        self._check_running()
        msg = f"no HEARTBEAT of system {self.system_id} within {timeout:g} s at {self.connection_out}"
        raise SitlError(msg)

    def reset(
        self,
        start: str | None = None,
        *,
        heading: float | None = None,
        place: tuple[float, float] | None = None,
        height: float | None = None,
        timeout: float = 10.0,
    ) -> None:
        """Let the vehicle begin anew at simulated time zero and wait until it has; what was uploaded stays.

        It is asked by MAV_CMD_USER_2, past the wire: no fault keeps it from it. What it sent before may still be on the
        way to a client, or in the client's socket.

        Args:
            start: "ground", "trim:AIRSPEED" for level flight [m/s], or None: as its process was started, wherever.
            heading: [deg]; home's if None.
            place: latitude, longitude [deg]; home if None.
            height: of level flight, above home [m]; the usual one if None.
            timeout: wall time [s].

        Raises SitlError, with the reason, if it is refused or does not happen.
        """
        from sitl.testing.control_channel import ControlChannel

        kind, airspeed = _parsed_start(start)
        if start is None and (heading, place, height) != (None, None, None):
            msg = 'reset: expected a start, "ground" or "trim:AIRSPEED", with a heading, place or height'
            raise SitlError(msg)
        given = [_NAN if value is None else value for value in (heading, _NAN, *(place or (_NAN, _NAN)), height)]
        self._check_running()
        assert self._relay.vehicle is not None
        with ControlChannel(self._relay.vehicle, self.system_id) as control:
            control.command(_RESET, (kind, airspeed, *given), timeout)

    def _check_running(self) -> None:
        if self._process is None:
            msg = "the vehicle was not started"
            raise SitlError(msg)
        self._process.check()
        if not self._process.is_running:
            msg = "the vehicle does not run any more"
            raise SitlError(msg)


def _parsed_start(start: str | None) -> tuple[float, float]:
    """Kind and airspeed of the reset command."""
    if start is None:
        return _AS_STARTED, _NAN
    if start == "ground":
        return _ON_THE_GROUND, _NAN
    trimmed = re.fullmatch(r"trim:(\d+(?:\.\d*)?)", start)
    if trimmed is None:
        msg = f'reset: expected "ground", "trim:AIRSPEED" or None, got {start!r}'
        raise SitlError(msg)
    return _TRIMMED, float(trimmed[1])
