"""Events that a scenario waits for, from words such as `landed`, `mode:hold` or `altitude:30`."""

import math
from collections.abc import Callable

from sitl.flight.landed import LandedState
from sitl.flight.mode import Mode
from sitl.flight.regime import Regime
from sitl.scenario.stage import Stage, Trigger, Watch

__all__ = ["parse_trigger"]


def parse_trigger(text: str) -> Trigger:
    """What the words of a `when` wait for. Raises ValueError that says which there are."""
    name, colon, value = text.partition(":")
    if not colon and name in STATES:
        return _while(STATES[name])
    if colon and name in QUANTITIES:
        return _passing(QUANTITIES[name], _number(text, value))
    if colon and name == "mode":
        modes = {mode.name.lower(): mode for mode in Mode}
        if value in modes:
            wanted = modes[value]
            return _while(lambda stage: stage.flight.mode == wanted)
        raise ValueError(f"expected mode: and one of {', '.join(modes)}, got {text!r}")
    if colon and name == "waypoint" and value.isdecimal():
        return _reaching(int(value))
    expected = [*STATES, *(f"{quantity}:NUMBER" for quantity in QUANTITIES), "mode:NAME", "waypoint:INDEX"]
    raise ValueError(f"expected one of {', '.join(expected)}, got {text!r}")


# True for as long as it is so.
STATES: dict[str, Callable[[Stage], bool]] = {
    "armed": lambda stage: stage.flight.armed,
    "disarmed": lambda stage: not stage.flight.armed,
    "airborne": lambda stage: stage.flight.landed != LandedState.ON_GROUND,
    "landed": lambda stage: stage.flight.landed == LandedState.ON_GROUND,
    "cruise": lambda stage: stage.flight.regime == Regime.CRUISE,
    "hover": lambda stage: stage.flight.regime == Regime.HOVER,
    "mission_finished": lambda stage: stage.flight.mission.finished,
}

# Numbers that are passed, upwards or downwards.
QUANTITIES: dict[str, Callable[[Stage], float]] = {
    "altitude": lambda stage: -stage.flight.view.down,  # above the origin [m]
    "airspeed": lambda stage: stage.flight.view.airspeed,  # [m/s]
    "battery": lambda stage: 100.0 * stage.flight.view.battery_remaining,  # [%]
}


def _while(condition: Callable[[Stage], bool]) -> Trigger:
    def begin(stage: Stage) -> Watch:
        return lambda: condition(stage)

    return begin


def _passing(quantity: Callable[[Stage], float], level: float) -> Trigger:
    """The quantity passes the level, from whichever side it is on when the step's turn comes."""

    def begin(stage: Stage) -> Watch:
        was_below = quantity(stage) < level
        return lambda: (quantity(stage) < level) != was_below

    return begin


def _reaching(item: int) -> Trigger:
    """A mission item is reached after the step's turn has come."""

    def begin(stage: Stage) -> Watch:
        heard = len(stage.items_reached)
        return lambda: item in stage.items_reached[heard:]

    return begin


def _number(text: str, value: str) -> float:
    try:
        number = float(value)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise ValueError(f"expected a number after the colon, got {text!r}")
    return number
