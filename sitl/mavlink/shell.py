"""The commands of the vehicle's console: to look at it, and to change what can be changed by hand.

Names and forms are those of PX4's console where it has the same.
"""

import math
import platform
import time
from collections.abc import Callable, Iterable, Sequence
from enum import Enum
from fnmatch import fnmatchcase
from typing import Any

from sitl.flight.flight import Flight
from sitl.flight.mode import Mode
from sitl.flight.parameters import Definition
from sitl.flight.refused import Refused
from sitl.mavlink.mavlink_version import autopilot_version
from sitl.mavlink.service import Exchange
from sitl.snapshot import Snapshot
from vehicle_model.state import CONTROL_NAMES

__all__ = ["Shell"]

RECENT = 20  # messages of dmesg


class _UsageError(Exception):
    """A command that is not as it should be; the text says what was expected."""


class Shell:
    """Carries out command lines. Whatever comes is answered, with one line of text if it cannot be done."""

    def __init__(self, exchange: Exchange) -> None:
        """Look at the vehicle, and command it, through `exchange`."""
        self._exchange = exchange
        self._commands: dict[str, tuple[str, Callable[[Sequence[str]], Iterable[str]]]] = {
            "commander": ("status | arm [-f] | disarm [-f] | takeoff | land | transition | mode NAME", self._commander),
            "dmesg": ("what the pilot was told lately", self._dmesg),
            "help": ("this list", self._help),
            "listener": ("TOPIC: one look at it; without a topic: which there are", self._listener),
            "mavlink": ("status: counters of all links", self._mavlink),
            "mission": ("what is loaded, and how far it has got", self._mission),
            "param": ("show [NAME with * and ?] | set NAME VALUE | reset NAME", self._param),
            "reboot": ("begin anew, while disarmed", self._reboot),
            "status": ("the vehicle at a glance", self._status),
            "tilt": ("angle of the wing", self._tilt),
            "top": ("time and what the process uses", self._top),
            "ver": ("what this is", self._ver),
        }

    def run(self, line: str) -> str:
        """What a command line answers: lines, each with its end."""
        name, *arguments = line.split() or [""]
        if not name:
            return ""
        if name not in self._commands:
            return f"{name[:40]}: command not found, `help` lists all\n"
        try:
            lines = list(self._commands[name][1](arguments))
        except _UsageError as error:
            lines = [f"{name}: expected {error}"]
        except Refused as refused:
            lines = [f"{name}: {refused.reason}"]
        except ValueError as error:  # a parameter out of its range
            lines = [f"{name}: {error}"]
        return "".join(f"{text}\n" for text in lines)

    @property
    def _flight(self) -> Flight:
        """Raises Refused when there is none."""
        return self._exchange.simulation.flight

    def _snapshot(self) -> Snapshot:
        return self._exchange.simulation.snapshot()

    # -- looking -------------------------------------------------------------------------------------------------

    def _help(self, _: Sequence[str]) -> Iterable[str]:
        return [f"{name:<10}{what}" for name, (what, _) in self._commands.items()]

    def _ver(self, _: Sequence[str]) -> Iterable[str]:
        exchange = self._exchange
        fields: dict[str, Any] = autopilot_version(exchange.system, exchange.identity)
        version = int(fields["flight_sw_version"])
        return [
            "HW arch: SITL",
            f"FW version: tiltwing-sitl {version >> 24}.{version >> 16 & 0xFF}.{version >> 8 & 0xFF}",
            f"Model hash: {bytes(fields['flight_custom_version']).hex()}",
            f"Aircraft: {exchange.simulation.aircraft.name}",
            f"Speaks like: {exchange.identity.name}",
            f"OS: {platform.system()} {platform.release()}, Python {platform.python_version()}",
        ]

    def _top(self, _: Sequence[str]) -> Iterable[str]:
        speed = self._exchange.speed
        return [
            f"Simulated: {self._exchange.simulation.time:.2f} s, "
            + (f"{speed:g} x real time" if math.isfinite(speed) else "as fast as possible"),
            f"Processor: {time.process_time():.1f} s in all",
        ]

    def _status(self, _: Sequence[str]) -> Iterable[str]:
        s = self._snapshot()
        north, east, down = s.velocity_ned
        roll, pitch, yaw = (math.degrees(angle) for angle in (s.roll, s.pitch, s.yaw))
        ground_speed = math.hypot(north, east)
        remaining = "never empties" if s.battery_remaining is None else f"{100.0 * s.battery_remaining:.0f} %"
        return [
            *self._flight_state(s),
            f"Position: {math.degrees(s.latitude):.7f} {math.degrees(s.longitude):.7f} deg, {s.altitude_msl:.1f} m MSL",
            f"Attitude: roll {roll:.1f}, pitch {pitch:.1f}, yaw {yaw:.1f} deg",
            f"Speed: {s.airspeed:.1f} m/s through the air, {ground_speed:.1f} m/s over ground, {-down:+.1f} m/s up",
            *self._tilt(()),
            f"Battery: {s.battery_voltage:.1f} V, {s.battery_current:.1f} A, {remaining}",
        ]

    def _flight_state(self, snapshot: Snapshot) -> Iterable[str]:
        if snapshot.mode is None:
            return [f"Flown from outside or not at all, {'on the ground' if snapshot.on_ground else 'in the air'}"]
        flight = self._flight
        armed = "Armed" if flight.armed else "Disarmed"
        lines = [f"{armed}, mode {flight.mode.title}, {_words(flight.landed)}, {_words(flight.regime)}"]
        lines += [f"Failsafe: {_words(cause)}" for cause in flight.failsafes.causes]
        lines += [f"Not armed: {problem}" for problem in flight.arming_problems if not flight.armed]
        return lines

    def _tilt(self, _: Sequence[str]) -> Iterable[str]:
        s = self._snapshot()
        command = math.degrees(float(s.controls[3]))
        return [f"Tilt: {math.degrees(s.tilt):.1f} deg, command {command:.1f} deg (0 cruise, 90 hover)"]

    def _mission(self, _: Sequence[str]) -> Iterable[str]:
        mission = self._flight.mission
        if not mission.items:
            return ["No mission"]
        state = "finished" if mission.finished else "paused" if mission.paused else "at"
        return [f"{len(mission.items)} items, {state} item {mission.current}"] + [
            f"{index}: command {int(item.command)}" for index, item in enumerate(mission.items)
        ]

    def _dmesg(self, _: Sequence[str]) -> Iterable[str]:
        kept = list(self._flight.messages.kept)[-RECENT:]
        lines = [f"[{message.time:9.2f}] {message.severity.name}: {message.text}" for message in kept]
        return lines or ["Nothing yet"]

    def _mavlink(self, _: Sequence[str]) -> Iterable[str]:
        for link in self._exchange.links:
            counters = ", ".join(f"{name} {count}" for name, count in link.statistics().items())
            yield f"{link.spec.text}: {len(link.audience)} peers, {counters}"

    def _listener(self, arguments: Sequence[str]) -> Iterable[str]:
        if not arguments:
            return sorted(TOPICS)
        topic = TOPICS.get(arguments[0])
        if topic is None:
            msg = f"one of {', '.join(sorted(TOPICS))}, got {arguments[0][:40]}"
            raise _UsageError(msg)
        snapshot = self._snapshot()
        fields = {"timestamp": round(snapshot.time * 1e6)} | topic(snapshot)
        return [f"TOPIC: {arguments[0]}", *(f"    {name}: {_shown(value)}" for name, value in fields.items())]

    # -- changing ------------------------------------------------------------------------------------------------

    def _param(self, arguments: Sequence[str]) -> Iterable[str]:
        parameters = self._flight.parameters
        match arguments:
            case ["show"] | ["show", _]:
                pattern = arguments[1].upper() if len(arguments) > 1 else "*"
                names = [name for name in parameters.names() if fnmatchcase(name, pattern)]
            case ["set", name, value]:
                definition = parameters.definition(name.upper())
                parameters.set(definition.name, _number(definition, value))
                names = [definition.name]
            case ["reset", name]:
                definition = parameters.definition(name.upper())
                parameters.set(definition.name, definition.default)
                names = [definition.name]
            case _:
                raise _UsageError(self._commands["param"][0])
        return [f"{name}: {parameters[name]:.7g}{_unit(parameters.definition(name))}" for name in names]

    def _commander(self, arguments: Sequence[str]) -> Iterable[str]:
        if list(arguments) == ["status"]:
            return self._status(())
        flight = self._flight
        match arguments:
            case ["arm"] | ["arm", "-f"]:
                flight.arm(force=len(arguments) > 1)
            case ["disarm"] | ["disarm", "-f"]:
                flight.disarm(force=len(arguments) > 1)
            case ["takeoff"]:
                flight.takeoff()
            case ["land"]:
                flight.land()
            case ["transition"]:
                flight.transition(not flight.regime.wing_borne)
            case ["mode", name] if name.upper() in Mode.__members__:
                flight.set_mode(Mode[name.upper()])
            case ["mode", *_]:
                raise _UsageError(f"mode {' | '.join(mode.name.lower() for mode in Mode)}")
            case _:
                raise _UsageError(self._commands["commander"][0])
        return self._flight_state(self._snapshot())

    def _reboot(self, _: Sequence[str]) -> Iterable[str]:
        if self._snapshot().armed:
            raise Refused("only while disarmed")
        self._exchange.request_restart()
        return ["Beginning anew"]


def _number(definition: Definition, text: str) -> float:
    try:
        return int(text) if definition.kind == "int" else float(text)
    except ValueError:
        msg = f"a number for {definition.name}, got {text[:40]}"
        raise _UsageError(msg) from None


def _unit(definition: Definition) -> str:
    return "" if definition.unit in {"", "1"} else f" {definition.unit}"


def _words(member: Enum) -> str:
    return member.name.lower().replace("_", " ")


def _shown(value: Any) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(_shown(each) for each in value)}]"
    return f"{value:.7g}" if isinstance(value, float) else str(value)


# What `listener` shows of the vehicle, by PX4's names, in SI units and radians.
TOPICS: dict[str, Callable[[Snapshot], dict[str, Any]]] = {
    "actuator_outputs": lambda s: dict(zip(CONTROL_NAMES, map(float, s.controls), strict=True)),
    "airspeed": lambda s: {"true_airspeed_m_s": s.airspeed},
    "battery_status": lambda s: {
        "voltage_v": s.battery_voltage,
        "current_a": s.battery_current,
        "remaining": s.battery_remaining,
    },
    "vehicle_air_data": lambda s: {
        "baro_pressure_pa": s.pressure,
        "ambient_temperature_k": s.temperature,
        "rho": s.density,
    },
    "vehicle_angular_velocity": lambda s: {"xyz": s.rates},
    "vehicle_attitude": lambda s: {"q": s.quaternion, "roll": s.roll, "pitch": s.pitch, "yaw": s.yaw},
    "vehicle_global_position": lambda s: {
        "lat": f"{math.degrees(s.latitude):.7f}",
        "lon": f"{math.degrees(s.longitude):.7f}",
        "alt": s.altitude_msl,
    },
    "vehicle_local_position": lambda s: {
        **dict(zip("xyz", s.position_ned, strict=True)),
        **dict(zip(("vx", "vy", "vz"), s.velocity_ned, strict=True)),
        "heading": s.yaw,
    },
    "vehicle_status": lambda s: {"armed": s.armed, "mode": s.mode, "landed": s.landed, "regime": s.regime},
    "wind": lambda s: dict(zip(("windspeed_north", "windspeed_east", "windspeed_down"), s.wind_ned, strict=True)),
}
