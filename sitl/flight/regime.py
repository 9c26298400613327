"""Whether the vehicle hovers, flies on its wing, or is on the way from one to the other.

There is one control law for all of it: the regime says what is asked of the vehicle and how far it has got.
"""

import math
from enum import IntEnum

from sitl.flight.parameters import Parameters
from sitl.flight.view import View

__all__ = ["Regime", "RegimeWatch", "wing_borne"]

REACHED = 0.9  # of FW_AIRSPD_MIN: cruise is reached
SLOWED = 0.75  # of FW_AIRSPD_MIN: cruise is left
HOVER_TILT = math.radians(55.0)  # steeper than in any flight on the wing
HOVER_AIRSPEED = 8.0  # below it rotors carry, whatever the tilt [m/s]
STOPPED = 1.0  # ground speed at which a vehicle that slows down has come to its hover, in whatever wind [m/s]


class Regime(IntEnum):
    """What carries the vehicle."""

    HOVER = 0
    TO_CRUISE = 1
    CRUISE = 2
    TO_HOVER = 3

    @property
    def wing_borne(self) -> bool:
        """Whether the vehicle flies on its wing or is about to."""
        return self in (Regime.TO_CRUISE, Regime.CRUISE)


class RegimeWatch:
    """Follows the regime from what is asked for and what the vehicle does."""

    def __init__(self, parameters: Parameters) -> None:
        self.regime = Regime.HOVER
        self._parameters = parameters
        self._wanted = False

    def begin(self, cruise: bool) -> None:
        """Start over in a settled regime: on the ground, or in the air where a simulation begins."""
        self._wanted = cruise
        self.regime = Regime.CRUISE if cruise else Regime.HOVER

    def update(self, cruise: bool, view: View) -> Regime:
        """The regime now, when `cruise` (wing-borne flight) is asked for or not.

        A task that flies wing-borne to a point and stops there asks for cruise to its end: its slowing down shows as
        TO_HOVER.
        """
        begun = cruise != self._wanted
        self._wanted = cruise
        minimum = self._parameters["FW_AIRSPD_MIN"]
        if cruise:
            if view.airspeed >= REACHED * minimum:
                self.regime = Regime.CRUISE
            elif begun or self.regime == Regime.HOVER:
                self.regime = Regime.TO_CRUISE
            elif self.regime == Regime.CRUISE and view.airspeed < SLOWED * minimum:
                self.regime = Regime.TO_HOVER
        elif self.regime != Regime.HOVER:
            upright = view.tilt > HOVER_TILT and view.airspeed < REACHED * minimum
            stopped = math.hypot(view.vn, view.ve) < STOPPED
            hovers = upright or stopped or view.airspeed < HOVER_AIRSPEED
            self.regime = Regime.HOVER if hovers else Regime.TO_HOVER
        return self.regime


def wing_borne(view: View, parameters: Parameters) -> bool:
    """Whether the wing carries the vehicle at this moment; in strong wind it does so in a hover too."""
    return view.airspeed >= SLOWED * parameters["FW_AIRSPD_MIN"] and view.tilt < HOVER_TILT
