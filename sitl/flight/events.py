"""What happens to a flight by itself: at every update, and when a mode ends, a failsafe acts or the vehicle lands."""

from collections.abc import Mapping

import numpy as np

from sitl.flight.actuator_test import ActuatorTest
from sitl.flight.actuator_watch import ActuatorWatch
from sitl.flight.arming import ArmingChecks
from sitl.flight.behaviour import Behaviour
from sitl.flight.demand import Demand
from sitl.flight.direct_modes import Manual, Stabilized
from sitl.flight.failsafe import Action, Failsafes, Links, Reaction
from sitl.flight.geofence import Fence
from sitl.flight.landed import AutoDisarm, LandedDetector, LandedState
from sitl.flight.limits import set_limits
from sitl.flight.manual_input import Sticks
from sitl.flight.messages import Messages, Severity
from sitl.flight.mission import Mission
from sitl.flight.mode import Mode
from sitl.flight.modes import HoldMode, LandMode, MissionMode, OrbitMode, ReturnMode, TakeoffMode, TerminationMode
from sitl.flight.offboard import Offboard
from sitl.flight.parameters import Parameters
from sitl.flight.places import LocalFrame, Ned
from sitl.flight.rally import Rally
from sitl.flight.regime import Regime, RegimeWatch
from sitl.flight.settling import Settling
from sitl.flight.stick_modes import Altitude, Position
from sitl.flight.view import View
from vehicle_model.aircraft import Aircraft
from vehicle_model.battery import open_circuit_voltage

__all__ = ["Events"]

SLOW_CHECKS = 5  # updates from one look at fence and failsafes to the next


class Events:
    """The parts of a flight, and what they do by themselves.

    Attributes:
        parameters: of the flight; they may be set at any time.
        demand: what the control laws are asked; its `record` is the SETPOINT they read.
        places: between the map and the local frame.
        home: where Return leads to and relative altitudes count from.
        mission, fence, rally: as uploaded.
        links: ages of the other ends' words, refreshed by their owner.
        sticks: the latest manual input.
        view: what the vehicle saw at the latest update.
        mode: the flight mode.
        armed: motors may turn.
        landed: standing, in the air, taking off or landing.
        regime: what carries the vehicle.
        breach: how the fence is left, None if it is not.
        arming_problems: why the latest arming was refused, or would have been but for force.
        failsafes: what is wrong now (`causes`) and what has been done about it (`action`).
        actuators: motors and servos known to have failed (`faults`).
        actuator_test: motors and servos being tried while disarmed.
        messages: what the pilot was told (`kept`), and who else is (`listeners`).
    """

    def __init__(
        self, aircraft: Aircraft, environment: np.ndarray, parameters: Parameters | Mapping[str, float] | None = None
    ) -> None:
        """`environment` is an ENVIRONMENT record, whose origin is home.

        Raises ValueError for a parameter that is unknown or out of its range.
        """
        given = parameters if isinstance(parameters, Parameters) else Parameters(parameters)
        self.parameters = given
        self.demand = Demand()
        self.places = LocalFrame(environment)
        self.home = self.places.home
        self.messages = Messages()
        self.say = self.messages.say
        self.fence = Fence(given, self.places)
        self.mission = Mission(given, self.places, self.demand, self.say, self.fence)
        self.rally = Rally(self.places)
        self.links = Links()
        self.sticks = Sticks()
        self.actuators = ActuatorWatch(aircraft.vehicle)
        self.actuator_test = ActuatorTest()
        self._standing_height = max(float(contact.position[2]) for contact in aircraft.contacts)
        self._checks = ArmingChecks(given, open_circuit_voltage(float(aircraft.battery.cells), 0.0))
        self._landed_detector = LandedDetector(given)
        self._settling = Settling()
        self._regime = RegimeWatch(given)
        self._limited_for: bool | None = None  # regime whose limits the laws have; None: set them anew
        given.on_change.append(self._parameter_changed)
        self._make_modes(aircraft)
        self.begin(View(), airborne=False)

    def _make_modes(self, aircraft: Aircraft) -> None:
        parameters, demand, sticks = self.parameters, self.demand, self.sticks
        self._hold = HoldMode(parameters, demand)
        self._takeoff = TakeoffMode(parameters, demand)
        self._land = LandMode(parameters, demand, self.home, self._tilt_failed)
        self._mission_mode = MissionMode(self.mission)
        self._orbit = OrbitMode(parameters, demand)
        self._offboard = Offboard(parameters, demand)
        self._behaviours: dict[Mode, Behaviour] = {
            Mode.MANUAL: Manual(parameters, demand, sticks, aircraft),
            Mode.STABILIZED: Stabilized(parameters, demand, sticks),
            Mode.ALTITUDE: Altitude(parameters, demand, sticks, self.home),
            Mode.POSITION: Position(parameters, demand, sticks, self.home),
            Mode.HOLD: self._hold,
            Mode.TAKEOFF: self._takeoff,
            Mode.LAND: self._land,
            Mode.RETURN: ReturnMode(parameters, demand, self.mission, self._destination, self._tilt_failed),
            Mode.MISSION: self._mission_mode,
            Mode.OFFBOARD: self._offboard,
            Mode.ORBIT: self._orbit,
            Mode.TERMINATION: TerminationMode(demand),
        }

    def begin(self, view: View, *, airborne: bool, cruise: bool = False) -> None:
        """Start anew from this moment: disarmed on the ground, or armed and holding in the air in the given regime.

        Uploads, parameters and home stay.
        """
        self.view = view
        self.messages.time = view.time
        self.armed = airborne
        self.arming_problems: list[str] = []
        self.breach: str | None = None
        self.landed = LandedState.IN_AIR if airborne else LandedState.ON_GROUND
        self.regime = Regime.CRUISE if cruise else Regime.HOVER
        self.failsafes = Failsafes(self.parameters, self.say)
        self.actuators.reset()
        self.actuator_test.stop()
        self._auto_disarm = AutoDisarm(self.parameters)
        self._landed_detector.begin(airborne=airborne)
        self._regime.begin(cruise)
        self._mission_mode.begin_at(0)
        self._updates = 0
        self._enter(Mode.HOLD)
        self._ask()

    @property
    def on_ground(self) -> bool:
        """The vehicle stands."""
        return self.landed == LandedState.ON_GROUND

    @property
    def flying(self) -> bool:
        """Armed and off the ground."""
        return self.armed and not self.on_ground

    @property
    def height(self) -> float:
        """Above home [m]."""
        return self.home.down - self.view.down

    def update(self, view: View) -> None:
        """Look at the vehicle, decide, and ask the control laws for the next 20 ms; called at 50 Hz."""
        self.view = view
        self.messages.time = view.time
        demand = self.demand
        landed = self._landed_detector.update(
            view, demand, self.armed, taking_off=self.mode == Mode.TAKEOFF, landing=self._behaviour.landing
        )
        if landed != self.landed:
            self._landed_changed(landed)
        turn = self._updates % SLOW_CHECKS
        self._updates += 1
        if turn == 0:
            self._check_slowly()
        elif turn in (1, 3):
            self.actuators.update(view, demand.level)
        self._ask()
        self._settling.update(view, self._landed_detector.contact, demand)
        self.regime = self._regime.update(self._behaviour.cruise and self.flying, view)

    def _ask(self) -> None:
        """Let the mode ask the control laws for the next moment."""
        if not self.armed:
            tried = self.actuator_test.controls(self.view)
            if tried is None:
                self.demand.off()
            else:
                self.demand.direct(tried)
            return
        behaviour = self._behaviour
        if self.on_ground and not behaviour.lifts(self.view):
            self.demand.idle()
            return
        if behaviour.own_limits:
            self._limited_for = None
        elif behaviour.cruise is not self._limited_for:
            self._limited_for = behaviour.cruise
            by_pilot = self.mode.by_sticks or self.mode == Mode.OFFBOARD
            set_limits(self.demand, self.parameters, cruise=behaviour.cruise, by_pilot=by_pilot)
        if behaviour.update(self.view, self.landed):
            self._mode_done()

    def _mode_done(self) -> None:
        """The mode has done what it is for: what it leads to."""
        if self.mode == Mode.TAKEOFF:
            point, down = self._takeoff.goal
            self._enter(Mode.HOLD)
            self._hold.go_to(self.view, point, down)
        elif self.mode == Mode.MISSION and not self.on_ground:
            self._enter(Mode.HOLD)

    def _check_slowly(self) -> None:
        view = self.view
        reason = self._auto_disarm.update(view.time, self.armed, self.landed)
        if reason is not None:
            self._disarm(reason)
        self.breach = self.fence.breach(view.north, view.east, view.down)
        reaction = self.failsafes.update(
            view,
            self.links,
            mode=self.mode,
            armed=self.armed,
            on_ground=self.on_ground,
            breach=self.breach,
            faults=self.actuators.faults,
        )
        if reaction.mode is not None or reaction.action != Action.NONE:
            self._react(reaction)

    def _react(self, reaction: Reaction) -> None:
        """Do what a failsafe says."""
        mode = reaction.mode
        if reaction.action == Action.DISARM:
            self._disarm(reaction.text)
        elif mode == Mode.TAKEOFF:  # interrupted by a lost link: the take-off point is far below by now
            self._enter(Mode.HOLD)
        elif mode is not None:
            self._land.place = None
            self._enter(mode)

    def _enter(self, mode: Mode) -> None:
        """Fly in a mode from now on, taken over in the regime of the moment."""
        self.mode = mode
        self._limited_for = None
        self._behaviour = self._behaviours[mode]
        self._behaviour.start(self.view, self.regime.wing_borne and not self.on_ground)

    def _landed_changed(self, landed: LandedState) -> None:
        was_on_ground, self.landed = self.on_ground, landed
        if was_on_ground:
            self.say(Severity.INFO, "Take-off detected")
        elif self.on_ground:
            self.say(Severity.INFO, "Landing detected")

    def _disarm(self, reason: str) -> None:
        """Stop the motors. What began or ended this flight does not begin the next one: the mode becomes Hold."""
        self.armed = False
        self.say(Severity.NOTICE, f"Disarmed: {reason}")
        if not self.mode.by_sticks:
            self._enter(Mode.HOLD)

    def _destination(self, view: View) -> Ned:
        """Where Return leads to: home or the nearest rally point, on the ground."""
        return self.rally.nearest(view.north, view.east)

    def _parameter_changed(self, _: str) -> None:
        self._limited_for = None

    def _tilt_failed(self) -> bool:
        return self.actuators.tilt_stuck
