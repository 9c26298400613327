"""Manual and Stabilized: the pilot's sticks go to the actuators, or to attitude and thrust."""

import math

from sitl.flight.behaviour import Behaviour
from sitl.flight.demand import Demand
from sitl.flight.landed import LandedState
from sitl.flight.manual_input import Sticks
from sitl.flight.parameters import Parameters
from sitl.flight.view import View
from vehicle_model.aircraft import Aircraft

__all__ = ["Manual", "Stabilized"]

HOVER_TILT = math.radians(90.0)
CRUISE_TILT = 0.0
TILT_RATE = math.radians(12.0)  # of a transition by hand: 7.5 s from end to end [rad/s]
DIFFERENTIAL = 0.2  # difference of throttle from the mean that a full stick makes
STANDING_THROTTLE = 0.15  # throttle stick below which a standing vehicle idles
CRUISE_PITCH = math.radians(20.0)  # at full stick, wing-borne


class _ByHand(Behaviour):
    """The tilt that transitions move, common to both modes."""

    def __init__(self, parameters: Parameters, demand: Demand, sticks: Sticks) -> None:
        self.tilt = HOVER_TILT
        self._parameters = parameters
        self._demand = demand
        self._sticks = sticks
        self._time = 0.0

    def start(self, view: View, cruise: bool) -> None:
        """Begin with the wing where it is, on its way to hover or cruise."""
        self.cruise = cruise
        self.tilt = view.tilt
        self._time = view.time

    def fly(self, view: View, cruise: bool) -> None:  # noqa: ARG002
        """Let the wing swing to hover or to cruise."""
        self.cruise = cruise

    def lifts(self, view: View) -> bool:  # noqa: ARG002
        """Whether the throttle stick asks a standing vehicle for power."""
        return self._sticks.now.throttle >= STANDING_THROTTLE

    def _swing(self, view: View) -> None:
        step = TILT_RATE * (view.time - self._time)
        self._time = view.time
        goal = CRUISE_TILT if self.cruise else HOVER_TILT
        self.tilt = min(max(goal, self.tilt - step), self.tilt + step)


class Manual(_ByHand):
    """Sticks to surfaces, tilt and throttles, through nothing but a mixer that turns with the wing.

    With the wing up, differential thrust rolls and the ailerons, in the slipstream, yaw; with the wing down it is the
    other way round. The tail rotor helps the elevator as much as the wing is up.
    """

    def __init__(self, parameters: Parameters, demand: Demand, sticks: Sticks, aircraft: Aircraft) -> None:
        super().__init__(parameters, demand, sticks)
        servos = aircraft.vehicle[0]["servos"]
        self._ranges = [(float(servo["minimum"]), float(servo["maximum"])) for servo in servos]
        self._lowest_tail = float(aircraft.vehicle[0]["rotors"][2]["min_throttle"])
        self._controls = [0.0] * 7

    def update(self, view: View, landed_state: LandedState) -> bool:  # noqa: ARG002
        """Ask for the actuators' positions."""
        self._swing(view)
        sticks, controls = self._sticks.now, self._controls
        tilt = self.tilt if sticks.tilt is None else CRUISE_TILT + sticks.tilt * (HOVER_TILT - CRUISE_TILT)
        up, forward = math.sin(view.tilt), math.cos(view.tilt)
        difference = DIFFERENTIAL * (sticks.right * up + sticks.turn * forward)
        ailerons = sticks.right * forward - sticks.turn * up
        controls[0] = min(max(sticks.throttle + difference, 0.0), 1.0)
        controls[1] = min(max(sticks.throttle - difference, 0.0), 1.0)
        controls[2] = max(sticks.forward * up, self._lowest_tail)
        lowest, highest = self._ranges[0]
        controls[3] = min(max(tilt, lowest), highest)
        controls[4] = self._deflection(1, ailerons)
        controls[5] = self._deflection(2, -ailerons)
        controls[6] = self._deflection(3, sticks.forward)
        self._demand.direct(controls)
        return False

    def _deflection(self, servo: int, stick: float) -> float:
        lowest, highest = self._ranges[servo]
        stick = min(max(stick, -1.0), 1.0)
        return stick * highest if stick >= 0.0 else -stick * lowest


class Stabilized(_ByHand):
    """Sticks to roll, pitch, yaw rate and collective thrust; in cruise the laws choose the tilt."""

    def update(self, view: View, landed_state: LandedState) -> bool:  # noqa: ARG002
        """Ask for an attitude and a thrust."""
        self._swing(view)
        sticks, parameters = self._sticks.now, self._parameters
        lean = math.radians(parameters["MPC_MAN_TILT_MAX"])
        if self.cruise:
            roll = sticks.right * math.radians(parameters["FW_R_LIM"])
            pitch = -sticks.forward * CRUISE_PITCH
        else:
            roll, pitch = sticks.right * lean, -sticks.forward * lean
        turn = sticks.turn * math.radians(parameters["MPC_MAN_Y_MAX"])
        tilt = math.nan if self.cruise and self.tilt <= CRUISE_TILT else self.tilt
        self._demand.attitude(roll, pitch, turn, sticks.throttle, tilt)
        return False
