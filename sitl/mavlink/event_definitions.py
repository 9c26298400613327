"""The events that the vehicle sends: their names, arguments and texts, as ground stations find them in its metadata.

https://mavlink.io/en/services/events.html and https://github.com/mavlink/libevents, whose schema the metadata follow.
An event's number is the component's id in the upper eight bits and a hash of its name (FNV-1a, as PX4's tools make it)
in the lower 24. Arguments follow one another without gaps, little-endian.
"""

import struct
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from typing import Any, Final

from sitl.flight.failsafe import ENDED, RAISED, Action, Cause
from sitl.flight.messages import Severity
from sitl.flight.mode import Mode
from sitl.flight.regime import Regime
from sitl.mavlink.identity import Identity

__all__ = [
    "EVENTS", "PROTOCOL", "Actuator", "Component", "DisarmReason", "Event",
    "add_events", "event_metadata", "log_levels",
]  # fmt: skip

NAMESPACE: Final = "tiltwing"
PROTOCOL: Final = 8  # log level of events that are not to be shown
SCHEMA_VERSION: Final = 2
MOST_BYTES: Final = 40  # of arguments in an EVENT
FORMATS: Final = {
    "uint8_t": "B", "int8_t": "b", "uint16_t": "H", "int16_t": "h", "uint32_t": "I", "int32_t": "i", "float": "f",
}  # fmt: skip


class DisarmReason(IntEnum):
    """Why the motors stopped."""

    COMMAND = 0
    FORCE = 1
    LANDED = 2
    NO_TAKEOFF = 3
    FAILSAFE = 4


class Actuator(IntEnum):
    """What can fail."""

    LEFT_MOTOR = 0
    RIGHT_MOTOR = 1
    TAIL_MOTOR = 2
    TILT_SERVO = 3
    OTHER = 255


class Component(IntEnum):
    """Parts of the vehicle whose health is told: bits by PX4's names and numbers."""

    NONE = 0
    ABSOLUTE_PRESSURE = 1
    DIFFERENTIAL_PRESSURE = 2
    GPS = 3
    REMOTE_CONTROL = 7
    MOTORS_ESCS = 8
    BATTERY = 11
    ATTITUDE_ESTIMATE = 16
    LOCAL_POSITION_ESTIMATE = 17
    MISSION = 18
    SYSTEM = 20
    GLOBAL_POSITION_ESTIMATE = 24
    MAGNETOMETER = 27
    ACCEL = 28
    GYRO = 29


@dataclass(frozen=True)
class _Enumeration:
    """Numbers with a name and a text each; of a bitfield a number's bit stands for it."""

    kind: str
    entries: Mapping[int, tuple[str, str]]
    is_bitfield: bool = False

    def metadata(self) -> dict[str, Any]:
        entries = {str(number): {"name": name, "description": text} for number, (name, text) in self.entries.items()}
        bits = {"is_bitfield": True, "separator": ", "} if self.is_bitfield else {}
        return {"type": self.kind, **bits, "entries": entries}


@dataclass(frozen=True)
class Event:
    """One kind of event. `arguments` are names and types; {1} in a text stands for the first of them.

    `kind` is a type within a group, as libevents defines them.
    """

    name: str
    message: str
    arguments: tuple[tuple[str, str], ...] = ()
    level: int = Severity.INFO
    group: str = "default"
    kind: str = ""

    def id(self, component: int) -> int:
        """Its number, sent by a component."""
        return component << 24 | _fnv1a(self.name) & 0xFFFFFF

    def packed(self, *values: float) -> bytes:
        """Arguments as they are sent; raises struct.error for values that do not fit."""
        return self._struct.pack(*values)

    @cached_property
    def _struct(self) -> struct.Struct:
        kinds = (_ENUMERATIONS[kind].kind if kind in _ENUMERATIONS else kind for _, kind in self.arguments)
        made = struct.Struct("<" + "".join(FORMATS[kind] for kind in kinds))
        assert made.size <= MOST_BYTES, self.name
        return made

    def metadata(self) -> dict[str, Any]:
        """Its entry in the metadata."""
        entry: dict[str, Any] = {"name": self.name, "message": self.message}
        if self.kind:
            entry["type"] = self.kind
        if self.arguments:
            entry["arguments"] = [{"name": name, "type": kind} for name, kind in self.arguments]
        return entry


def log_levels(level: int) -> int:
    """The field of EVENT: the level for logs in the upper four bits, that for people in the lower ones."""
    return level << 4 | level


def _fnv1a(text: str) -> int:
    """32-bit FNV-1a hash."""
    value = 0x811C9DC5
    for byte in text.encode():
        value = (value ^ byte) * 0x01000193 & 0xFFFFFFFF
    return value


def _numbers(kind: str, enumeration: type[IntEnum], texts: Mapping[Any, str] | None = None) -> _Enumeration:
    """An enumeration of ours; its texts are the names unless they are given."""
    entries = {
        int(member): (member.name.lower(), (texts or {}).get(member) or member.name.replace("_", " ").capitalize())
        for member in enumeration
    }
    return _Enumeration(kind, entries)


def _bits(numbers: _Enumeration) -> _Enumeration:
    return _Enumeration("uint32_t", {1 << number: entry for number, entry in numbers.entries.items()}, is_bitfield=True)


_CAUSES = _numbers("uint8_t", Cause, {**RAISED, Cause.FENCE: "Geofence left", Cause.ACTUATOR: "Actuator failed"})
_ENDS = {cause: ENDED.get(cause, f"{_CAUSES.entries[cause][1]}: over") for cause in Cause}
_REASONS = {
    DisarmReason.COMMAND: "by command",
    DisarmReason.FORCE: "by force",
    DisarmReason.LANDED: "landed",
    DisarmReason.NO_TAKEOFF: "not taken off",
    DisarmReason.FAILSAFE: "failsafe",
}
_COMPONENTS = {
    Component.GPS: "GPS",
    Component.REMOTE_CONTROL: "Manual control",
    Component.MOTORS_ESCS: "Motors and servos",
    Component.ACCEL: "Accelerometer",
    Component.GYRO: "Gyroscope",
}
_ENUMERATIONS: Final[dict[str, _Enumeration]] = {
    "mode_t": _numbers("uint8_t", Mode),
    "regime_t": _numbers(
        "uint8_t", Regime, {Regime.TO_CRUISE: "Transition to cruise", Regime.TO_HOVER: "Transition to hover"}
    ),
    "failsafe_cause_t": _CAUSES,
    "failsafe_causes_t": _bits(_CAUSES),
    "failsafe_end_t": _numbers("uint8_t", Cause, _ENDS),
    "failsafe_action_t": _numbers("uint8_t", Action),
    "disarm_reason_t": _numbers("uint8_t", DisarmReason, _REASONS),
    "actuator_t": _numbers("uint8_t", Actuator),
    "navigation_mode_group_t": _bits(_numbers("uint8_t", Mode)),
    "health_component_t": _bits(_numbers("uint8_t", Component, _COMPONENTS)),
}
_CHUNK = ("chunk_idx", "uint8_t")

EVENTS: Final[dict[str, Event]] = {}


def add_events(*events: Event) -> None:
    """Let there be these events, too."""
    for event in events:
        assert event.name not in EVENTS, event.name
        EVENTS[event.name] = event


add_events(
    Event("vehicle_started", "Vehicle started"),
    Event("mode_changed", "Flight mode: {1}", (("mode", "mode_t"),)),
    Event("regime_changed", "{1}", (("regime", "regime_t"),)),
    Event("armed", "Armed", level=Severity.NOTICE),
    Event("armed_by_force", "Armed by force", level=Severity.WARNING),
    Event(
        "arming_denied",
        "Arming denied",
        (("custom_mode", "uint32_t"),),
        level=Severity.CRITICAL,
        kind="append_health_and_arming_messages",
    ),
    Event("disarmed", "Disarmed: {1}", (("reason", "disarm_reason_t"),), level=Severity.NOTICE),
    Event("takeoff_detected", "Take-off detected"),
    Event("landing_detected", "Landing detected"),
    Event("home_set", "Home set", (("latitude", "int32_t"), ("longitude", "int32_t"), ("altitude", "float"))),
    Event("failsafe_raised", "{1}", (("cause", "failsafe_cause_t"),), level=Severity.WARNING),
    Event("failsafe_ended", "{1}", (("cause", "failsafe_end_t"),)),
    Event(
        "failsafe_action",
        "Failsafe: {1} ({2})",
        (("action", "failsafe_action_t"), ("causes", "failsafe_causes_t")),
        level=Severity.CRITICAL,
    ),
    Event("flight_terminated", "Flight terminated", level=Severity.EMERGENCY),
    Event("actuator_failed", "{1} failed", (("actuator", "actuator_t"),), level=Severity.CRITICAL),
    Event("mission_item_reached", "Mission item {1} reached", (("item", "uint16_t"), ("items", "uint16_t"))),
    Event("mission_paused", "Mission paused after item {1}", (("item", "uint16_t"),)),
    Event("mission_finished", "Mission finished"),
    Event("control_taken", "Servos taken by an outside controller", level=Severity.NOTICE),
    Event("control_returned", "The autopilot flies on", level=Severity.NOTICE),
    Event(
        "arming_check_summary",
        "Arming checks",
        (
            _CHUNK,
            ("error", "health_component_t"),
            ("warning", "health_component_t"),
            ("can_arm", "navigation_mode_group_t"),
            ("can_run", "navigation_mode_group_t"),
        ),
        level=PROTOCOL,
        group="arming_check",
        kind="summary",
    ),
    Event(
        "health_summary",
        "Health",
        (
            _CHUNK,
            ("is_present", "health_component_t"),
            ("error", "health_component_t"),
            ("warning", "health_component_t"),
        ),
        level=PROTOCOL,
        group="health",
        kind="summary",
    ),
)


def event_metadata(component: int, identity: Identity) -> dict[str, Any]:
    """The metadata of all events of a component, for vehicles of an identity: events.json."""
    groups: dict[str, Any] = {}
    for event in EVENTS.values():
        events = groups.setdefault(event.group, {"events": {}})["events"]
        events[str(event.id(component) & 0xFFFFFF)] = event.metadata()
    modes: dict[int, list[int]] = {}
    for number, mode in {entry.number: entry.modes[0] for entry in reversed(identity.modes)}.items():
        modes.setdefault(mode, []).append(number)
    return {
        "version": SCHEMA_VERSION,
        "components": {
            str(component): {
                "namespace": NAMESPACE,
                "enums": {name: enumeration.metadata() for name, enumeration in _ENUMERATIONS.items()},
                "event_groups": groups,
                "supported_protocols": ["health_and_arming_check"],
                "navigation_mode_groups": {"groups": {str(mode): sorted(modes[mode]) for mode in sorted(modes)}},
            }
        },
    }
