"""What the flight does by itself when something goes wrong: causes, the actions set for them, and which one wins.

A cause raises an alarm. The gravest alarm acts, once; Return and Land for a lost link or an emptying battery are
preceded by COM_FAIL_ACT_T seconds of Hold, in which the pilot may step in, or the link come back and the flight go on.
A pilot who chooses another mode takes over from all alarms of that moment. Enumerations of the parameters are PX4's.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum

from sitl.flight.debounce import Debounce
from sitl.flight.messages import Severity
from sitl.flight.mode import Mode
from sitl.flight.parameters import Parameters
from sitl.flight.view import View

__all__ = ["NOTHING", "Action", "Cause", "Failsafes", "Links", "Reaction"]

CHARGE_HYSTERESIS = 0.01  # of the charge: it rises a little when propellers drive their motors


class Action(IntEnum):
    """What to do about a cause, from the mildest to the gravest."""

    NONE = 0
    WARN = 1
    POSITION = 2  # modes that hand over to a pilot's sticks
    ALTITUDE = 3
    STABILIZED = 4
    HOLD = 5
    RETURN = 6
    LAND = 7
    DISARM = 8
    TERMINATE = 9


class Cause(IntEnum):
    """What can go wrong."""

    GROUND_STATION = 0
    MANUAL_CONTROL = 1
    OFFBOARD = 2
    FENCE = 3
    BATTERY_LOW = 4
    BATTERY_CRITICAL = 5
    BATTERY_EMERGENCY = 6
    ACTUATOR = 7
    ATTITUDE = 8


@dataclass(slots=True)
class Links:
    """How long ago the other ends were heard [s of the vehicle's time]; None: never.

    Their owner turns wall time into the vehicle's (times the requested speed) and says with `enforced` whether silence
    counts at all: as fast as possible it does only if the scenario says so.
    """

    ground_station: float | None = None
    manual_control: float | None = None
    offboard: float | None = None
    enforced: bool = True


@dataclass(frozen=True, slots=True)
class Reaction:
    """What is to be done now, once.

    `mode` is the mode to fly in from now on, None to stay in the present one; with Action.DISARM the motors stop.
    Action.NONE with a mode means that the flight interrupted by Hold goes on.
    """

    action: Action
    cause: Cause | None = None
    text: str = ""
    mode: Mode | None = None


NOTHING = Reaction(Action.NONE)

LINKS = frozenset({Cause.GROUND_STATION, Cause.MANUAL_CONTROL, Cause.OFFBOARD})
ENDS_WITH_FLIGHT = (Cause.FENCE, Cause.ATTITUDE, Cause.OFFBOARD)
DELAYED = LINKS | {Cause.BATTERY_CRITICAL}

MODES = {
    Action.POSITION: Mode.POSITION,
    Action.ALTITUDE: Mode.ALTITUDE,
    Action.STABILIZED: Mode.STABILIZED,
    Action.HOLD: Mode.HOLD,
    Action.RETURN: Mode.RETURN,
    Action.LAND: Mode.LAND,
    Action.TERMINATE: Mode.TERMINATION,
}
# What a vehicle in these modes does already: a milder action, or the same, changes nothing (but Hold at the fence).
DONE_BY = {
    Mode.HOLD: Action.HOLD,
    Mode.RETURN: Action.RETURN,
    Mode.LAND: Action.LAND,
    Mode.TERMINATION: Action.TERMINATE,
}

LINK_ACTIONS = {  # NAV_DLL_ACT, NAV_RCL_ACT
    0: Action.WARN,
    1: Action.HOLD,
    2: Action.RETURN,
    3: Action.LAND,
    5: Action.TERMINATE,
    6: Action.DISARM,
}
OFFBOARD_ACTIONS = (  # COM_OBL_RC_ACT
    Action.POSITION, Action.ALTITUDE, Action.STABILIZED, Action.RETURN,
    Action.LAND, Action.HOLD, Action.TERMINATE, Action.DISARM,
)  # fmt: skip
FENCE_ACTIONS = (  # GF_ACTION
    Action.NONE, Action.WARN, Action.HOLD, Action.RETURN, Action.TERMINATE, Action.LAND,
)  # fmt: skip
ACTUATOR_ACTIONS = (  # COM_ACT_FAIL_ACT
    Action.WARN, Action.HOLD, Action.LAND, Action.RETURN, Action.TERMINATE,
)  # fmt: skip
CRITICAL_ACTIONS = {0: Action.WARN, 2: Action.LAND, 3: Action.RETURN}  # COM_LOW_BAT_ACT
EMERGENCY_ACTIONS = {0: Action.WARN, 2: Action.LAND, 3: Action.LAND}

RAISED = {
    Cause.GROUND_STATION: "Ground station lost",
    Cause.MANUAL_CONTROL: "Manual control lost",
    Cause.OFFBOARD: "Offboard setpoints lost",
    Cause.BATTERY_LOW: "Battery low",
    Cause.BATTERY_CRITICAL: "Battery critical",
    Cause.BATTERY_EMERGENCY: "Battery nearly empty",
    Cause.ATTITUDE: "Attitude lost",
}
ENDED = {
    Cause.GROUND_STATION: "Ground station is back",
    Cause.MANUAL_CONTROL: "Manual control is back",
    Cause.OFFBOARD: "Offboard setpoints are back",
    Cause.FENCE: "Inside the geofence again",
    Cause.ATTITUDE: "Attitude regained",
}


class _Alarm:
    """A cause that is present."""

    __slots__ = ("acknowledged", "action", "begun", "cause", "done", "text")

    def __init__(self, cause: Cause, action: Action, text: str) -> None:
        self.cause = cause
        self.action = action
        self.text = text
        self.done = Action.NONE  # what has been done about it
        self.begun = math.nan  # when it first could act: the delay counts from there [s]
        self.acknowledged = False  # the pilot has taken over


class Failsafes:
    """Watches for causes and says what to do about the gravest."""

    def __init__(self, parameters: Parameters, say: Callable[[int, str], None]) -> None:
        """`say` takes a MAV_SEVERITY and a line for the pilot."""
        self._parameters = parameters
        self._say = say
        self._alarms: dict[Cause, _Alarm] = {}
        self._faults: tuple[str, ...] = ()
        self._interrupted: Mode | None = None
        self._rolled = Debounce()
        self._pitched = Debounce()

    @property
    def causes(self) -> tuple[Cause, ...]:
        """What is wrong now, in the order of appearance."""
        return tuple(self._alarms)

    @property
    def action(self) -> Action:
        """The gravest action taken and not overridden by the pilot."""
        return max((alarm.done for alarm in self._alarms.values() if not alarm.acknowledged), default=Action.NONE)

    def pilot_took_over(self) -> None:
        """The pilot has chosen a mode: what is wrong at this moment asks for nothing more. Termination stands."""
        self._interrupted = None
        self._alarms.pop(Cause.OFFBOARD, None)
        for alarm in self._alarms.values():
            alarm.acknowledged = alarm.action != Action.TERMINATE

    def update(
        self,
        view: View,
        links: Links,
        *,
        mode: Mode,
        armed: bool,
        on_ground: bool,
        breach: str | None = None,
        faults: tuple[str, ...] = (),
    ) -> Reaction:
        """Judge the present moment; returns what to do now, NOTHING most of the time.

        `breach` tells where the geofence is left, `faults` are those of the ActuatorWatch. On the ground and disarmed
        there are warnings only.
        """
        flying = armed and not on_ground
        if not flying:
            self._stand_by(mode)
        self._judge_links(links, mode)
        self._judge_battery(view.battery_remaining)
        self._judge(Cause.FENCE, flying and breach is not None, breach or "")
        if faults != self._faults:  # one more, or all repaired: another case
            self._faults = faults
            self._alarms.pop(Cause.ACTUATOR, None)
        self._judge(Cause.ACTUATOR, bool(faults), faults[-1].capitalize() if faults else "")
        self._judge(Cause.ATTITUDE, self._attitude_lost(view, flying and mode not in (Mode.MANUAL, Mode.TERMINATION)))
        if flying and (self._alarms or self._interrupted is not None):
            return self._react(view.time, mode)
        return NOTHING

    def _stand_by(self, mode: Mode) -> None:
        """No flight is under way: forget what ends with it, and let what remains act anew in the next."""
        self._interrupted = None
        for cause in ENDS_WITH_FLIGHT[:-1] if mode == Mode.OFFBOARD else ENDS_WITH_FLIGHT:
            self._alarms.pop(cause, None)
        for alarm in self._alarms.values():
            alarm.acknowledged, alarm.done, alarm.begun = False, Action.NONE, math.nan

    def _judge_links(self, links: Links, mode: Mode) -> None:
        parameters = self._parameters
        ages = (links.ground_station, links.manual_control, links.offboard) if links.enforced else (None, None, None)
        station, manual, offboard = ages
        self._judge(Cause.GROUND_STATION, station is not None and station > parameters["COM_DL_LOSS_T"])
        has_pilot = manual is not None and manual <= parameters["COM_RC_LOSS_T"]
        lost = manual is not None and not has_pilot
        self._judge(Cause.MANUAL_CONTROL, lost and (Cause.MANUAL_CONTROL in self._alarms or self._needs_sticks(mode)))
        # Once raised it stays raised in the mode that it leads to.
        lost = offboard is None or offboard > parameters["COM_OF_LOSS_T"]
        began = mode == Mode.OFFBOARD or Cause.OFFBOARD in self._alarms
        self._judge(Cause.OFFBOARD, links.enforced and lost and began, has_pilot=has_pilot)

    def _judge_battery(self, remaining: float) -> None:
        parameters = self._parameters
        alarms = self._alarms
        for cause, name in (
            (Cause.BATTERY_LOW, "BAT_LOW_THR"),
            (Cause.BATTERY_CRITICAL, "BAT_CRIT_THR"),
            (Cause.BATTERY_EMERGENCY, "BAT_EMERGEN_THR"),
        ):
            self._judge(cause, remaining < parameters[name] + (CHARGE_HYSTERESIS if cause in alarms else 0.0))

    def _attitude_lost(self, view: View, watched: bool) -> bool:
        parameters = self._parameters
        roll, pitch = parameters["FD_FAIL_R"], parameters["FD_FAIL_P"]
        rolled = watched and roll > 0.0 and abs(view.roll) > math.radians(roll)
        pitched = watched and pitch > 0.0 and abs(view.pitch) > math.radians(pitch)
        return (
            self._rolled.held(rolled, view.time) >= parameters["FD_FAIL_R_TTRI"]
            or self._pitched.held(pitched, view.time) >= parameters["FD_FAIL_P_TTRI"]
        )

    def _needs_sticks(self, mode: Mode) -> bool:
        """Whether loss of manual control matters in this mode (COM_RCL_EXCEPT)."""
        if mode.by_sticks:
            return True
        bit = {Mode.MISSION: 1, Mode.OFFBOARD: 4}.get(mode, 2)
        return not int(self._parameters["COM_RCL_EXCEPT"]) & bit

    def _judge(self, cause: Cause, present: bool, text: str = "", has_pilot: bool = False) -> None:
        """Raise or end the alarm of a cause."""
        if present == (cause in self._alarms):
            return
        if not present:
            del self._alarms[cause]
            if cause in ENDED:
                self._say(Severity.INFO, ENDED[cause])
            return
        action = self._action_for(cause, has_pilot)
        if action != Action.NONE:
            self._alarms[cause] = alarm = _Alarm(cause, action, text or RAISED[cause])
            self._say(Severity.WARNING, alarm.text)

    def _action_for(self, cause: Cause, has_pilot: bool) -> Action:
        """What the parameters say."""
        parameters = self._parameters
        match cause:
            case Cause.GROUND_STATION:
                return LINK_ACTIONS[int(parameters["NAV_DLL_ACT"])]
            case Cause.MANUAL_CONTROL:
                return LINK_ACTIONS[int(parameters["NAV_RCL_ACT"])]
            case Cause.OFFBOARD:
                action = OFFBOARD_ACTIONS[int(parameters["COM_OBL_RC_ACT"])]
                return action if has_pilot else max(action, Action.HOLD)
            case Cause.FENCE:
                return FENCE_ACTIONS[int(parameters["GF_ACTION"])]
            case Cause.BATTERY_LOW:
                return Action.WARN
            case Cause.BATTERY_CRITICAL:
                return CRITICAL_ACTIONS[int(parameters["COM_LOW_BAT_ACT"])]
            case Cause.BATTERY_EMERGENCY:
                return EMERGENCY_ACTIONS[int(parameters["COM_LOW_BAT_ACT"])]
            case Cause.ACTUATOR:
                return ACTUATOR_ACTIONS[int(parameters["COM_ACT_FAIL_ACT"])]
            case Cause.ATTITUDE:
                return Action.TERMINATE if parameters["CBRK_FLIGHTTERM"] == 0 else Action.LAND

    def _react(self, time: float, mode: Mode) -> Reaction:
        """Let the gravest alarm act, or an interrupted flight go on."""
        gravest: _Alarm | None = None
        for alarm in self._alarms.values():
            if not alarm.acknowledged and (gravest is None or alarm.action > gravest.action):
                gravest = alarm
        if gravest is None or gravest.action == Action.WARN:
            return self._go_on(mode)
        if math.isnan(gravest.begun):
            gravest.begun = time
        action = gravest.action
        wait = self._parameters["COM_FAIL_ACT_T"] if gravest.cause in DELAYED else 0.0
        waits = Action.RETURN <= action <= Action.LAND and time - gravest.begun < wait
        if waits:
            action = Action.HOLD
        if action <= gravest.done:
            return NOTHING
        gravest.done = action
        already = DONE_BY.get(mode, Action.NONE)
        # Who holds may be on his way somewhere: at the fence Hold stops him where he is.
        acts = action > already or (gravest.cause == Cause.FENCE and action == already == Action.HOLD)
        coming = waits and gravest.action > already
        steps = [action.name.capitalize()] if acts else []
        if coming:
            steps.append(f"{gravest.action.name.capitalize()} in {wait:g} s")
        if not steps:
            return NOTHING
        text = f"{gravest.text}: {', '.join(steps)}"
        self._say(Severity.CRITICAL, text)
        if not acts:
            return NOTHING
        self._interrupted = mode if waits and gravest.cause in LINKS else None
        return Reaction(action, gravest.cause, text, MODES.get(action))

    def _go_on(self, mode: Mode) -> Reaction:
        """Resume what a lost link interrupted, now that it is back in time."""
        interrupted, self._interrupted = self._interrupted, None
        if interrupted is None or mode != Mode.HOLD:
            return NOTHING
        text = f"{interrupted.title} goes on"
        self._say(Severity.INFO, text)
        return Reaction(Action.NONE, text=text, mode=interrupted)
