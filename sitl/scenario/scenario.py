"""The scenario file: read, checked as far as it can be without an aircraft, and made a `Scenario`.

Together with an aircraft file and a seed a scenario says everything about a run: the same three give the same flight.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

import msgspec
import numpy as np

from sitl.flight.parameters import Parameters
from sitl.home import PX4_HOME, Home, home_from
from sitl.scenario.actions import parse_action
from sitl.scenario.script import Step
from sitl.scenario.triggers import parse_trigger
from sitl.toml_file import TableError, read_table, typed
from vehicle_model.wind import Gust, make_wind

__all__ = ["Earth", "Scenario", "ScenarioError", "Wind", "load_scenario"]

Earth = Literal["flat", "round", "wgs84"]
Vector = tuple[float, float, float]
Seconds = Annotated[float, msgspec.Meta(ge=0.0)]
Parsed = TypeVar("Parsed")


class ScenarioError(ValueError):
    """A scenario is no use; the text is one line."""


@dataclass(frozen=True)
class Wind:
    """Wind as `vehicle_model.wind` has it: steady (NED, blowing to) [m/s], roughness of the ground [m], gusts."""

    steady_ned: Vector = (0.0, 0.0, 0.0)
    roughness: float = 0.0
    gusts: tuple[Gust, ...] = ()

    def record(self) -> np.ndarray:
        """A WIND array of its own for a flight. Raises ValueError for what is no such wind."""
        return make_wind(self.steady_ned, roughness=self.roughness, gusts=self.gusts)


@dataclass(frozen=True)
class Scenario:
    """All of a flight that is neither aircraft nor program; units are those of the file, degrees and metres."""

    start: str = "ground"  # as `sitl.start.start_at` takes it
    home: Home = PX4_HOME
    earth: Earth = "flat"
    seed: int = 0
    aircraft: Path | None = None  # None: the one that comes with the package
    wind: Wind = Wind()
    parameters: Mapping[str, float] = field(default_factory=dict[str, float])
    mission: Path | None = None  # a QGroundControl plan
    links_enforced: bool = False  # failsafes of lost links act also where time runs as fast as it can
    steps: tuple[Step, ...] = ()

    def with_arguments(
        self,
        *,
        seed: int | None = None,
        wind: Sequence[float] | None = None,
        home: Sequence[float] | None = None,
        earth: Earth | None = None,
        parameters: Mapping[str, float] | None = None,
    ) -> "Scenario":
        """The scenario with what is not None in its place: `wind` is the steady one, `parameters` come on top.

        Raises ValueError for values that are no such thing.
        """
        changed = self
        if seed is not None:
            changed = replace(changed, seed=seed)
        if wind is not None:
            north, east, down = wind
            changed = replace(changed, wind=replace(self.wind, steady_ned=(north, east, down)))
        if home is not None:
            changed = replace(changed, home=home_from(home))
        if earth is not None:
            changed = replace(changed, earth=earth)
        if parameters is not None:
            changed = replace(changed, parameters={**self.parameters, **parameters})
        return changed


class _Gust(msgspec.Struct, frozen=True):
    """`[[wind.gusts]]`."""

    time: Seconds
    length: float
    amplitude_ned: Vector


class _Wind(msgspec.Struct, frozen=True):
    """`[wind]`."""

    steady_ned: Vector = (0.0, 0.0, 0.0)
    roughness: float = 0.0
    gusts: tuple[_Gust, ...] = ()


class _Command(msgspec.Struct, frozen=True):
    """`[[commands]]`."""

    do: str
    at: Seconds | None = None
    when: str | None = None
    after: Seconds = 0.0


class _File(msgspec.Struct, frozen=True):
    """The whole of a scenario file."""

    start: str = "ground"
    home: tuple[float, float, float, float] = PX4_HOME
    earth: Earth = "flat"
    seed: Annotated[int, msgspec.Meta(ge=0)] = 0
    aircraft: str | None = None
    mission: str | None = None
    links_enforced: bool = False
    wind: _Wind = _Wind()
    parameters: dict[str, float] = {}
    commands: tuple[_Command, ...] = ()


def load_scenario(path: Path | str) -> Scenario:
    """Read a scenario file.

    Files that it names (start, aircraft, mission) are looked for beside it. Raises ScenarioError with one line that
    names the file, the key and what was expected.
    """
    file = Path(path)
    try:
        return _scenario(typed(read_table(file), _File), file.parent)
    except TableError as error:
        msg = f"{file}: {error}"
        raise ScenarioError(msg) from None


def _scenario(given: _File, folder: Path) -> Scenario:
    _checked("parameters", Parameters, given.parameters)
    wind = Wind(
        given.wind.steady_ned,
        given.wind.roughness,
        tuple(Gust(gust.time, gust.length, gust.amplitude_ned) for gust in given.wind.gusts),
    )
    _checked("wind", wind.record)
    is_file = given.start != "ground" and not given.start.startswith("trim:")
    return Scenario(
        start=str(_existing("start", folder, given.start)) if is_file else given.start,
        home=_checked("home", home_from, given.home),
        earth=given.earth,
        seed=given.seed,
        aircraft=None if given.aircraft is None else _existing("aircraft", folder, given.aircraft),
        wind=wind,
        parameters=given.parameters,
        mission=None if given.mission is None else _existing("mission", folder, given.mission),
        links_enforced=given.links_enforced,
        steps=tuple(_step(command, f"commands[{index}]") for index, command in enumerate(given.commands)),
    )


def _step(command: _Command, place: str) -> Step:
    if command.at is not None and (command.when is not None or command.after):
        msg = f"{place}: expected either at, or when and after, got both"
        raise TableError(msg)
    return Step(
        text=command.do,
        action=_checked(f"{place}.do", parse_action, command.do),
        at=command.at,
        trigger=None if command.when is None else _checked(f"{place}.when", parse_trigger, command.when),
        after=command.after,
    )


def _existing(key: str, folder: Path, name: str) -> Path:
    path = folder / name
    if not path.is_file():
        problem = "this is a folder" if path.is_dir() else "there is no such file"
        expected = "ground, trim:AIRSPEED or the path of a start file" if key == "start" else "the path of a file"
        msg = f"{key}: expected {expected}, got {name!r}, and {problem}"
        raise TableError(msg)
    return path


def _checked(key: str, parse: Callable[..., Parsed], *values: Any) -> Parsed:
    """What `parse` makes of the values; its ValueError becomes a TableError that names the key."""
    try:
        return parse(*values)
    except ValueError as error:
        text = f"{key}: {error}"
        raise TableError(text) from None
