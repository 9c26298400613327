"""A ground station made of pymavlink's own helpers: what scripts all over the world are written with."""

import math
import time
from collections.abc import Callable
from typing import Any

from pymavlink import mavutil

from tests.clients.vehicle import DEADLINE, HOME, FlownVehicle

__all__ = ["PymavlinkStation"]

JUST_BEGUN = 10_000  # [ms], simulated


class PymavlinkStation:
    """A `mavutil` connection that has heard the vehicle.

    Attributes:
        link: the connection, with all that pymavlink has to offer.
        mav: the definitions that pymavlink has chosen.
    """

    def __init__(self, vehicle: FlownVehicle) -> None:
        """Connect; fails if nothing is heard."""
        self.vehicle = vehicle
        self.link: Any = mavutil.mavlink_connection(vehicle.pymavlink)
        assert self.link.wait_heartbeat(timeout=DEADLINE) is not None
        self.mav: Any = mavutil.mavlink

    def close(self) -> None:
        self.link.close()

    def begin(self) -> None:
        """Let the vehicle begin anew on the ground, and wait until that is heard."""
        self.vehicle.reset("ground")
        while self.link.recv_match() is not None:
            pass
        self.get("ATTITUDE", lambda message: message.time_boot_ms < JUST_BEGUN)

    def get(
        self, name: str | list[str], condition: Callable[[Any], bool] = lambda _: True, timeout: float = DEADLINE
    ) -> Any:
        """The next message of a kind, or of one of several, that fulfils a condition."""
        end = time.monotonic() + timeout
        while time.monotonic() < end:
            message = self.link.recv_match(type=name, blocking=True, timeout=1.0)
            if message is not None and condition(message):
                return message
        msg = f"no such {name} within {timeout:g} s"
        raise AssertionError(msg)

    def command(self, command: int, *params: float) -> int:
        """MAV_RESULT of a COMMAND_LONG; parameters left out are zero."""
        padded = [*params, *[0.0] * (7 - len(params))]
        self.link.mav.command_long_send(1, 1, command, 0, *padded)
        return self.get("COMMAND_ACK", lambda ack: ack.command == command).result

    def wait_for_mode(self, name: str) -> None:
        """Until pymavlink reads this mode from a heartbeat."""
        self.get("HEARTBEAT", lambda _: self.link.flightmode == name)

    def wait_disarmed(self) -> None:
        """Until a heartbeat tells it."""
        self.get("HEARTBEAT", lambda _: not self.link.motors_armed())

    def take_off(self, height: float) -> None:
        """Arm and climb to a height above home [m]."""
        self.link.arducopter_arm()
        self.link.motors_armed_wait()
        is_px4 = self.link.field("HEARTBEAT", "autopilot") == self.mav.MAV_AUTOPILOT_PX4
        above = HOME[2] if is_px4 else 0.0
        unset = [math.nan] * 6
        assert self.command(self.mav.MAV_CMD_NAV_TAKEOFF, *unset, above + height) == self.mav.MAV_RESULT_ACCEPTED
        self.get("GLOBAL_POSITION_INT", lambda m: m.relative_alt > (height - 0.5) * 1000)
