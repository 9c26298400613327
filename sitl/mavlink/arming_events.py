"""What speaks against arming, as events: each of the flight's reasons with its numbers, and the part it is about.

The flight gives reasons as texts; here is the event that each of them is, told by the way the text begins and with the
numbers in it as arguments. The report is libevents' protocol of health and arming checks:
https://github.com/mavlink/libevents#event-groups.
"""

import re
from collections.abc import Sequence
from enum import IntEnum
from typing import NamedTuple

from sitl.flight.arming import ARMABLE, ORDERED
from sitl.flight.flight import Flight
from sitl.flight.messages import Severity
from sitl.flight.mode import Mode
from sitl.mavlink.event_definitions import EVENTS, Component, Event, add_events

__all__ = ["Judge", "Report"]

IN_FLIGHT = (Mode.LAND, Mode.RETURN, Mode.ORBIT)  # modes that need the air
ALL_MODES = sum(1 << mode for mode in Mode)
PRESENT = sum(1 << component for component in Component if component != Component.NONE)
CHUNK = 0


class _About(IntEnum):
    """What a reason is about."""

    VEHICLE = 0
    GROUND = 1  # how it stands, of no interest in flight
    MODE = 2  # the mode in which the flight would begin


class _Check(NamedTuple):
    """A reason: the texts it has, with its numbers in groups, and its event."""

    text: re.Pattern[str]
    event: Event
    component: Component
    about: _About


_Reason = tuple[_Check, tuple[float, ...]]


class Report(NamedTuple):
    """The health of the vehicle: events with their arguments, and what tells whether it is another than the last."""

    events: list[tuple[Event, tuple[float, ...]]]
    key: tuple[object, ...]


def _check(
    name: str, text: str, message: str, component: Component, about: _About = _About.VEHICLE, numbers: int = 0
) -> _Check:
    arguments = (
        ("modes", "navigation_mode_group_t"),
        ("health_component_index", "uint8_t"),
        *((f"value{number}", "float") for number in range(1, numbers + 1)),
    )
    event = Event(f"check_{name}", message, arguments, level=Severity.ERROR, group="arming_check")
    add_events(event)
    return _Check(re.compile(text), event, component, about)


_NUMBER = r"(-?[\d.]+)"
_CHECKS = (
    _check(
        "unknown",
        "position and attitude are not known",
        "Position and attitude are not known",
        Component.ATTITUDE_ESTIMATE,
    ),
    _check("on_ground", "not on the ground", "Not on the ground", Component.SYSTEM, _About.GROUND),
    _check(
        "roll",
        rf"not level: roll {_NUMBER} deg, at most {_NUMBER} deg",
        "Not level: roll {3:.0} deg, at most {4:.0} deg",
        Component.ATTITUDE_ESTIMATE,
        _About.GROUND,
        2,
    ),
    _check(
        "pitch",
        rf"not level: pitch {_NUMBER} deg, at most {_NUMBER} deg",
        "Not level: pitch {3:.0} deg, at most {4:.0} deg",
        Component.ATTITUDE_ESTIMATE,
        _About.GROUND,
        2,
    ),
    _check(
        "turning",
        rf"turning at {_NUMBER} deg/s, at most {_NUMBER} deg/s",
        "Turning at {3:.0} deg/s, at most {4:.0} deg/s",
        Component.GYRO,
        _About.GROUND,
        2,
    ),
    _check(
        "moving",
        rf"moving at {_NUMBER} m/s, at most {_NUMBER} m/s",
        "Moving at {3:.1m/s}, at most {4:.1m/s}",
        Component.LOCAL_POSITION_ESTIMATE,
        _About.GROUND,
        2,
    ),
    _check("fence", "outside the geofence", "Outside the geofence", Component.GLOBAL_POSITION_ESTIMATE),
    _check("left_motor", "left motor failed: not repaired", "Left motor failed", Component.MOTORS_ESCS),
    _check("right_motor", "right motor failed: not repaired", "Right motor failed", Component.MOTORS_ESCS),
    _check("tail_motor", "tail motor failed: not repaired", "Tail motor failed", Component.MOTORS_ESCS),
    _check(
        "tilt_servo",
        rf"tilt servo stuck at {_NUMBER} deg: not repaired",
        "Tilt servo stuck at {3:.0} deg",
        Component.MOTORS_ESCS,
        numbers=1,
    ),
    _check(
        "wing",
        rf"wing at {_NUMBER} deg though told to be at {_NUMBER} deg",
        "Wing at {3:.0} deg though told to be at {4:.0} deg",
        Component.MOTORS_ESCS,
        _About.GROUND,
        2,
    ),
    _check(
        "battery_charge",
        rf"battery at {_NUMBER} %, at least {_NUMBER} %",
        "Battery at {3:.1} %, at least {4:.1} %",
        Component.BATTERY,
        numbers=2,
    ),
    _check(
        "battery_voltage",
        rf"battery at {_NUMBER} V, empty at {_NUMBER} V",
        "Battery at {3:.1} V, empty at {4:.1} V",
        Component.BATTERY,
        numbers=2,
    ),
    *(
        _check(
            f"order_{names[0].lower()}",
            f"parameters: expected {names[0]} ",
            "Expected " + " \\<= ".join(f"<param>{name}</param>" for name in names),
            Component.SYSTEM,
        )
        for names in ORDERED
    ),
    _check(
        "mode",
        r"\w+ does not begin a flight",
        "This mode does not begin a flight",
        Component.NONE,
        _About.MODE,
    ),
    _check("no_mission", "no mission", "No mission", Component.MISSION, _About.MODE),
    _check("mission", "the mission cannot be flown", "The mission cannot be flown", Component.MISSION, _About.MODE),
    _check("manual", r"\w+ needs manual control", "No manual control", Component.REMOTE_CONTROL, _About.MODE),
    _check(
        "throttle_low",
        "throttle stick is not",
        "Throttle stick is not at its lowest",
        Component.REMOTE_CONTROL,
        _About.MODE,
    ),
    _check(
        "throttle_climb",
        "throttle stick asks",
        "Throttle stick asks to climb",
        Component.REMOTE_CONTROL,
        _About.MODE,
    ),
)
_NO_BEGINNING = (next(check for check in _CHECKS if check.event.name == "check_mode"), ())
_OTHER = _check("other", "", "Not ready: see the text messages", Component.SYSTEM)


class Judge:
    """Judges the health of a vehicle, and what it may do."""

    def __init__(self) -> None:
        self._mission_key: tuple[object, ...] = ()
        self._mission_reasons: list[_Reason] = []

    def report(self, flight: Flight) -> Report:
        """All that speaks against arming now, in whatever mode."""
        common = [reason for reason in _found(flight, Mode.HOLD) if reason[0].about != _About.MODE]
        found = {mode: common + self._of_mode(flight, mode) for mode in Mode}
        modes: dict[_Reason, int] = {}
        for mode, reasons in found.items():
            for reason in reasons:
                # That a mode begins no flight is a problem only in the one in which somebody might want to begin.
                if reason != _NO_BEGINNING or (mode == flight.mode and not flight.flying):
                    modes[reason] = modes.get(reason, 0) | 1 << mode
        can_arm = sum(1 << mode for mode in Mode if not found[mode])
        can_run = sum(1 << mode for mode in Mode if _can_run(mode, found[mode], flying=flight.flying))
        errors = 0
        for check, _ in modes:
            if check.about != _About.MODE:
                errors |= 1 << check.component
        told = [(check.event, (mask, check.component, *numbers)) for (check, numbers), mask in modes.items()]
        summary = (EVENTS["arming_check_summary"], (CHUNK, errors, 0, can_arm, can_run))
        health = (EVENTS["health_summary"], (CHUNK, PRESENT, errors, 0))
        key = (can_arm, can_run, tuple(sorted((check.event.name, mask) for (check, _), mask in modes.items())))
        return Report([summary, *told, health], key)

    def _of_mode(self, flight: Flight, mode: Mode) -> "list[_Reason]":
        """What speaks against beginning a flight in a mode."""
        if mode not in ARMABLE:
            return [_NO_BEGINNING]
        if mode == Mode.MISSION:
            # To judge a long mission takes long, so it is done once for each.
            home, fence, parameters = flight.home, flight.fence, flight.parameters
            place = (home.north, home.east, home.down)
            values = tuple(parameters[name] for name in parameters.names())
            key = (flight.mission.items, fence.polygons, fence.circles, fence.enabled, place, values)
            if key != self._mission_key:
                self._mission_key = key
                self._mission_reasons = _modes_own(flight, mode)
            return self._mission_reasons
        return _modes_own(flight, mode) if mode.by_sticks else []


def _modes_own(flight: Flight, mode: Mode) -> list[_Reason]:
    return [reason for reason in _found(flight, mode) if reason[0].about == _About.MODE]


def _found(flight: Flight, mode: Mode) -> list[_Reason]:
    """What speaks against arming in a mode, with its numbers; in flight what speaks against the vehicle."""
    reasons: list[_Reason] = []
    for text in flight.check_arming(mode):
        check = next((check for check in _CHECKS if check.text.match(text)), _OTHER)
        match = check.text.match(text)
        if match is not None and not (flight.flying and check.about == _About.GROUND):
            reasons.append((check, tuple(float(number) for number in match.groups())))
    return reasons


def _can_run(mode: Mode, reasons: Sequence[_Reason], *, flying: bool) -> bool:
    """Whether the vehicle can fly in a mode once it flies."""
    if mode in IN_FLIGHT:
        return flying
    return not any(reason[0].about == _About.MODE and reason != _NO_BEGINNING for reason in reasons)
