"""What a scenario plays on: the flight, and the world around it that a pilot cannot command."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from sitl.flight.flight import Flight
    from sitl.flight.offboard import AttitudeSetpoint, MotionSetpoint

__all__ = ["Action", "Stage", "Trigger", "Watch"]


class Stage(Protocol):
    """A flight that things can happen to; `sitl.simulation.Simulation` is one."""

    @property
    def flight(self) -> "Flight":
        """What commands go to."""
        ...

    @property
    def items_reached(self) -> Sequence[int]:
        """Indices of the mission items reached so far, in the order in which they were."""
        ...

    def say(self, severity: int, text: str) -> None:
        """Tell the pilot (severity as MAV_SEVERITY)."""
        ...

    def stream(self, setpoint: "MotionSetpoint | AttitudeSetpoint | None") -> None:
        """Fly in Offboard, with this setpoint sent at every update from now on; None: send no more."""
        ...

    def set_link(self, name: str, up: bool) -> None:
        """Let a ground station or a pilot's sticks be heard all the time, or be silent."""
        ...

    def set_wind(self, steady_ned: Sequence[float]) -> None:
        """Let this steady wind [m/s], blowing to, be the wind from now on."""
        ...

    def fail_motor(self, name: str, loss: float) -> None:
        """Take this share (0..1) of a rotor's thrust."""
        ...

    def fail_servo(self, name: str, angle: float | None = None) -> None:
        """Let a servo stick where it is, or at an angle [rad]."""
        ...

    def repair(self) -> None:
        """End all faults."""
        ...


Action = Callable[[Stage], None]
Watch = Callable[[], bool]
Trigger = Callable[[Stage], Watch]  # called when a step's turn comes: what it watches may have to change from then
