"""What every flight mode can be asked, and what it answers where it has no answer of its own."""

from sitl.flight.landed import LandedState
from sitl.flight.refused import Refused
from sitl.flight.view import View

__all__ = ["Behaviour"]


class Behaviour:
    """What one mode does with the vehicle.

    Attributes:
        cruise: the regime it wants now: wing-borne, or hovering.
        own_limits: it sets climb and sink rates itself, instead of those usual in its regime.
        landing: it is about to meet the ground.
    """

    cruise: bool = False
    own_limits: bool = False

    @property
    def landing(self) -> bool:
        """See the class."""
        return False

    def start(self, view: View, cruise: bool) -> None:  # noqa: ARG002
        """Take the vehicle over as it is, wing-borne or hovering."""
        self.cruise = cruise

    def update(self, view: View, landed_state: LandedState) -> bool:
        """Ask the control laws for the next moment; True once the mode has done what it is for."""
        raise NotImplementedError

    def lifts(self, view: View) -> bool:  # noqa: ARG002 (most need not look)
        """Whether it would have a standing vehicle leave the ground; else the motors idle."""
        return False

    def fly(self, view: View, cruise: bool) -> None:  # noqa: ARG002
        """Go on wing-borne or hovering. Raises Refused where the mode cannot."""
        msg = "no transition in this mode"
        raise Refused(msg, temporary=True)

    def change_speed(self, *, airspeed: float | None = None, ground_speed: float | None = None) -> None:  # noqa: ARG002
        """Fly at another airspeed wing-borne, or ground speed in hover [m/s]. Raises Refused where none is set."""
        msg = "no speed to change in this mode"
        raise Refused(msg, temporary=True)

    def change_altitude(self, down: float) -> None:  # noqa: ARG002
        """Go to another height [m, NED down]. Raises Refused where the mode has its own."""
        msg = "no altitude to change in this mode"
        raise Refused(msg, temporary=True)
