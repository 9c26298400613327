"""The vehicle as one object in this process: airframe, flight and scenario, driven by nothing but calls.

    simulation = Simulation("windy.toml", start="trim:20")
    simulation.flight.return_home()
    simulation.run_until(lambda s: not s.flight.armed, timeout=300.0)

It knows no clock and no socket. The same arguments, commands at the same simulated times and a seed give the same bits,
however the steps between them are grouped.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sitl.airframe import Airframe
from sitl.control.design import design_for
from sitl.fate import Fate
from sitl.flight.flight import Flight
from sitl.flight.mode import Mode
from sitl.flight.parameters import Parameters
from sitl.flight.plan_file import PlanError, read_plan
from sitl.flight.refused import Refused
from sitl.flight.view import EVENTS_RATE, View
from sitl.history import History
from sitl.recorder import Recorder
from sitl.scenario import Earth, Scenario, Script, load_scenario
from sitl.scenario.link_ages import LinkAges
from sitl.start import Start, start_at
from sitl.start_file import TRIM_HEIGHT
from vehicle_model.aircraft import Aircraft, load_aircraft
from vehicle_model.earth import make_environment
from vehicle_model.state import CONTROL_COUNT, STATE_COUNT, TILT, TILT_COMMAND
from vehicle_model.wind import wind_step

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sitl.flight.offboard import AttitudeSetpoint, MotionSetpoint
    from sitl.snapshot import Snapshot

__all__ = ["Simulation"]

# A start in the air is one on the wing from this airspeed, unless it stands over the ground as a hover in wind does.
WING_BORNE, STANDING = 8.0, 3.0  # [m/s]


class Simulation(Fate):
    """One tilt-wing, its flight controller and what a scenario does to them.

    Args:
        scenario: or the path of its file; calm and on the ground if None. What follows goes before what it says.
        aircraft: what flies: an aircraft or the path of its file.
        design_aircraft: what the control laws are designed for; what flies, if None.
        seed: from which random streams spawn, one per source. Nothing in the flight itself is random yet.
        start: `ground`, `trim:AIRSPEED`, the path of a start file, or a state (20,), as `reset` takes it.
        wind: steady wind (NED, blowing to) [m/s]; gusts and roughness stay those of the scenario.
        home: latitude, longitude [deg], altitude above mean sea level [m] and heading [deg].
        earth: flat, round or wgs84.
        parameters: values by name, on top of the scenario's.
        autopilot: False leaves the actuators to `set_controls`; there is no flight then.
        rate: integration steps per simulated second [Hz], a multiple of the flight's 50. The control laws run as often,
            but their gains are for the delay of one step at 400 Hz: slower they have less margin, faster no more.

    Attributes:
        aircraft: what flies.
        scenario: what is flown, with the arguments above in it.
        airframe: dynamics, wind, battery and control laws.
        items_reached: indices of the mission's items in the order in which they were reached.
        autopilot: whether there is one.
        description: where this began, in words.
        listener: told (MAV_SEVERITY, text) what the pilot is told, or None.
        watchers: called at 50 Hz of simulated time, after the flight's events.
        pace: simulated seconds that pass in a second of those who speak to it, by which their silence is judged.

    Raises ScenarioError, StartError, PlanError, AircraftFileError or another ValueError, each with one line.
    """

    def __init__(
        self,
        scenario: Scenario | Path | str | None = None,
        *,
        aircraft: Aircraft | Path | str | None = None,
        design_aircraft: Aircraft | None = None,
        seed: int | None = None,
        start: "str | Path | ArrayLike | None" = None,
        wind: Sequence[float] | None = None,
        home: Sequence[float] | None = None,
        earth: Earth | None = None,
        parameters: Mapping[str, float] | None = None,
        autopilot: bool = True,
        rate: int = 400,
    ) -> None:
        if rate < EVENTS_RATE or rate % EVENTS_RATE:
            msg = f"rate: expected a multiple of {EVENTS_RATE} steps per second, got {rate}"
            raise ValueError(msg)
        if not isinstance(scenario, Scenario):
            scenario = Scenario() if scenario is None else load_scenario(scenario)
        self.scenario = scenario.with_arguments(seed=seed, wind=wind, home=home, earth=earth, parameters=parameters)
        if not isinstance(aircraft, Aircraft):
            aircraft = load_aircraft(self.scenario.aircraft if aircraft is None else aircraft)
        self.aircraft = aircraft
        self.autopilot = autopilot
        self.listener: Callable[[int, str], None] | None = None
        self.watchers: list[Callable[[], None]] = []
        self.pace = 1.0
        self._design = design_for(design_aircraft or aircraft) if autopilot else None
        self._rate = rate
        self._ticks_per_update = rate // EVENTS_RATE
        self._first_start = self.scenario.start if start is None else start
        self.reset(self._first_start)

    # -- time ------------------------------------------------------------------------------------------------------

    @property
    def rate(self) -> int:
        """Integration steps per simulated second [Hz]."""
        return self._rate

    @property
    def tick(self) -> int:
        """Steps since the start."""
        return self.airframe.tick

    def advance(self, seconds: float) -> None:
        """Fly so many simulated seconds, to the nearest step. Raises FlightDivergedError as `step`."""
        self.step(round(seconds * self._rate))

    def step(self, ticks: int = 1) -> None:
        """Fly so many steps of 1/rate; the flight is updated whenever 1/50 s is full, the first time before anything.

        Raises FlightDivergedError when the equations give nonsense; the state is then the last sound one.
        """
        airframe = self.airframe
        end = airframe.tick + ticks
        while True:
            if airframe.tick == self._next_update:
                self._update()
            if airframe.tick >= end:
                return
            airframe.advance(min(end, self._next_update) - airframe.tick)

    def run_until(self, condition: "Callable[[Simulation], bool]", timeout: float) -> bool:
        """Fly until the condition holds, looked at after every update of the flight, or for `timeout` [s] at most.

        Returns whether it holds.
        """
        end = self.tick + round(timeout * self._rate)
        while not condition(self):
            if self.tick >= end:
                return False
            self.step(min(self._next_update - self.tick or self._ticks_per_update, end - self.tick))
        return True

    # -- state -----------------------------------------------------------------------------------------------------

    def reset(self, start: "str | Path | Start | ArrayLike") -> None:
        """Begin anew, anywhere: everything is as in a new Simulation of the same arguments with this start.

        So time is zero, the battery full, the scenario at its beginning, and the flight another object, with the
        parameters and the mission that the arguments say. In the air it begins armed, in Hold, wing-borne from 8 m/s
        of airspeed on; on the ground disarmed.

        `start` is `ground`, `trim:AIRSPEED`, the path of a start file, or a state (20,) as in `vehicle_model.state`,
        whose servos stay where they are. Raises StartError, or ValueError for a state that is none.
        """
        wind = self.scenario.wind.record()
        environment = self._environment()
        in_the_air = isinstance(start, str) and start.startswith("trim:")
        wind_step(wind, 0.0, TRIM_HEIGHT if in_the_air else 0.0, 0.0, 0.0, environment)
        begin = self._start(start, environment)
        self.description = begin.description
        self.airframe = Airframe(
            self.aircraft,
            environment,
            begin.state,
            begin.controls,
            wind=wind,
            design=self._design,
            drains=self.autopilot,
            rate=self._rate,
        )
        self.items_reached: list[int] = []
        self._recorder: Recorder | None = None
        self._ticks_per_row = 0
        self._next_update = 0
        self._view = View()
        self._links = LinkAges()
        self._setpoint: MotionSetpoint | AttitudeSetpoint | None = None
        self._flight: Flight | None = None
        if self.autopilot:
            self._flight = Flight(self.aircraft, self.airframe.environment, Parameters(self.scenario.parameters))
            self._flight.messages.listeners.append(lambda message: self._tell(message.severity, message.text))
            self.airframe.setpoint = self._flight.demand.record
            self._begin_flight()
            if self.scenario.mission is not None:
                self.load_plan(self.scenario.mission)
        self._script = Script(self.scenario.steps, self)

    def restart(
        self,
        start: str | None = None,
        *,
        heading: float = math.nan,
        place: tuple[float, float] | None = None,
        height: float = math.nan,
    ) -> None:
        """Begin anew as after a reboot: with the parameters, mission, fence and rally points of now.

        `start` is `ground` or `trim:AIRSPEED`, by default where this first began; `heading` [deg], by default home's;
        `place` latitude and longitude [deg], by default home; `height` above home [m] of a start in the air. Raises
        StartError, and then changes nothing.
        """
        begin = self._first_start if start is None else start
        if start is not None:
            environment = self._environment()
            direction = math.radians(self.scenario.home.heading if math.isnan(heading) else heading)
            height = TRIM_HEIGHT if math.isnan(height) else height
            begin = start_at(start, self.aircraft, environment, direction, height)
            if place is not None:
                begin = begin.moved(*place, environment)
        before = self._flight
        self.reset(begin)
        if before is not None:
            flight = self.flight
            flight.links.enforced = before.links.enforced
            flight.parameters.load({name: before.parameters[name] for name in before.parameters.names()})
            flight.fence.load(before.fence.polygons, before.fence.circles)
            flight.rally.load(before.rally.points)
            flight.mission.keep(before.mission)

    def snapshot(self) -> "Snapshot":
        """All there is to see of the vehicle now, immutable."""
        snapshot = self.airframe.snapshot()
        flight = self._flight
        if flight is None or self.airframe.controls_from_outside:
            return snapshot
        return replace(
            snapshot,
            armed=flight.armed,
            mode=flight.mode.name,
            landed=flight.landed.name,
            regime=flight.regime.name,
        )

    @property
    def state(self) -> np.ndarray:
        """Copy of the state (20,), as in `vehicle_model.state`."""
        return self.airframe.state

    @property
    def controls(self) -> np.ndarray:
        """Copy of the controls in force (7,), as there."""
        return self.airframe.controls

    def record(self, every: float = 0.1) -> History:
        """Keep a row of history every so many simulated seconds, to the nearest update, from now on; returns it."""
        self._ticks_per_row = max(1, round(every * EVENTS_RATE)) * self._ticks_per_update
        self._recorder = Recorder(self.airframe)
        return self._recorder.history

    # -- commands --------------------------------------------------------------------------------------------------

    @property
    def flight(self) -> Flight:
        """The flight controller's events: where commands go. Raises Refused with the autopilot off."""
        if self._flight is None:
            raise Refused("the autopilot is off")
        return self._flight

    def load_plan(self, path: Path | str) -> None:
        """Load mission, fence and rally points of a QGroundControl plan; home stays where it is.

        Raises PlanError with one line that names the file and what is wrong with it, and then changes nothing.
        """
        plan = read_plan(Path(path))
        flight = self.flight
        before = flight.fence.polygons, flight.fence.circles, flight.rally.points
        try:
            flight.fence.load(plan.polygons, plan.circles)
            flight.rally.load(plan.rally_points)
            flight.load_mission(plan.items)
        except ValueError as error:
            flight.fence.load(*before[:2])
            flight.rally.load(before[2])
            msg = f"{path}: {error}"
            raise PlanError(msg) from None

    def say(self, severity: int, text: str) -> None:
        """Tell the pilot (severity as MAV_SEVERITY)."""
        if self._flight is None:
            self._tell(severity, text)
        else:
            self._flight.say(severity, text)

    def stream(self, setpoint: "MotionSetpoint | AttitudeSetpoint | None") -> None:
        """Fly in Offboard, with this setpoint sent at every update from now on, as a computer outside does.

        None: send no more. Raises Refused as the flight does.
        """
        self._setpoint = setpoint
        if setpoint is not None:
            self._send_setpoint()
            self.flight.set_mode(Mode.OFFBOARD)

    def offboard(self, setpoint: "MotionSetpoint | AttitudeSetpoint") -> None:
        """A setpoint has come from a computer outside. Raises Refused with the autopilot off."""
        self.flight.offboard(setpoint)
        self._links.setpoint_received = self.time
        # At once: what asks for Offboard may come in the same moment.
        self._links.refresh(self.flight.links, self.flight.sticks, self.time, self.pace)

    # -- an outside controller -------------------------------------------------------------------------------------

    @property
    def is_flown_from_outside(self) -> bool:
        """Whether `set_controls` has taken the actuators from the vehicle's own controller."""
        return self.autopilot and self.airframe.controls_from_outside

    def set_controls(self, controls: "ArrayLike") -> None:
        """Hold these controls (7,) from the next step on: whoever sends them flies, until `take_over`.

        Raises ValueError for a wrong shape or a value that is not finite, and then changes nothing.
        """
        self.airframe.set_controls(controls)
        self.airframe.controls_from_outside = True

    def take_over(self) -> None:
        """Let the vehicle's own controller fly again, from where the vehicle is: in Hold, or disarmed on the ground."""
        if self.is_flown_from_outside:
            self.airframe.controls_from_outside = False
            self._begin_flight()

    # -- inside ----------------------------------------------------------------------------------------------------

    def _update(self) -> None:
        """One turn of all that is not compiled."""
        airframe, flight = self.airframe, self._flight
        tick = airframe.tick
        self._next_update = tick + self._ticks_per_update
        if flight is not None and not airframe.controls_from_outside:
            airframe.look(self._view)
            self._send_setpoint()
            self._links.refresh(flight.links, flight.sticks, airframe.time, self.pace)
            flight.update(self._view)
            if flight.mission.reached:
                self.items_reached += flight.mission.reached
                flight.mission.reached.clear()
        self._script.update(airframe.time)
        if self._recorder is not None and tick % self._ticks_per_row == 0:
            self._recorder.keep(flight)
        for watch in self.watchers:
            watch()

    def _send_setpoint(self) -> None:
        """As a computer outside would, if there is one."""
        if self._setpoint is not None:
            self.offboard(self._setpoint)

    def _begin_flight(self) -> None:
        self.airframe.look(self._view)
        on_ground = self.airframe.snapshot().on_ground
        view = self._view
        on_wing = view.airspeed >= WING_BORNE and math.hypot(view.vn, view.ve) >= STANDING
        self.flight.begin(view, airborne=not on_ground, cruise=on_wing)

    def _tell(self, severity: int, text: str) -> None:
        if self.listener is not None:
            self.listener(severity, text)

    def _environment(self) -> np.ndarray:
        """The Earth at home."""
        home = self.scenario.home
        return make_environment(
            self.scenario.earth,
            latitude=math.radians(home.latitude),
            longitude=math.radians(home.longitude),
            height_ellipsoid=home.altitude,
        )

    def _start(self, start: "str | Path | Start | ArrayLike", environment: np.ndarray) -> Start:
        if isinstance(start, Start):
            return start
        if isinstance(start, str | Path):
            return start_at(str(start), self.aircraft, environment, math.radians(self.scenario.home.heading))
        state = np.array(start, dtype=np.float64)
        if state.shape != (STATE_COUNT,):
            msg = f"start: expected a name, a file or a state of {STATE_COUNT} numbers, got an array of {state.shape}"
            raise ValueError(msg)
        controls = np.zeros(CONTROL_COUNT)
        controls[TILT_COMMAND:] = state[TILT:]
        return Start(state, controls, "in a given state")
