"""What a scenario's `do` can be: commands to the flight, as a pilot would give them, and blows of fate.

Each is a form, such as `takeoff [HEIGHT]`, and what it does; docs/scenario.md lists them for users.
"""

import math
from collections.abc import Callable, Sequence
from functools import partial

from sitl.flight.mode import Mode
from sitl.flight.offboard import MotionSetpoint
from sitl.flight.parameters import Parameters
from sitl.scenario.link_ages import LINKS
from sitl.scenario.stage import Action, Stage
from sitl.scenario.words import Argument, arguments
from vehicle_model.state import SERVO_NAMES

__all__ = ["FORMS", "parse_action"]


def parse_action(text: str) -> Action:
    """What the words of a `do` do. Raises ValueError that says which there are, or what form this one has."""
    words = text.split()
    forms = [form for form in FORMS if form.split()[0] == (words or [""])[0]]
    if not forms:
        names = dict.fromkeys(form.split()[0] for form in FORMS)
        raise ValueError(f"expected one of {', '.join(names)}, got {text!r}")
    for form in forms:
        values = arguments(form, words)
        if values is not None:
            return partial(_carry_out, FORMS[form], _checked(words, values))
    raise ValueError(f"expected {' or '.join(map(repr, forms))}, got {text!r}")


def _carry_out(action: Callable[..., None], values: Sequence[Argument], stage: Stage) -> None:
    action(stage, *values)


def _checked(words: Sequence[str], values: list[Argument]) -> list[Argument]:
    """The values, after what can be said about them before the flight. Raises ValueError."""
    match words[0], values:
        case "parameter", [str(name), float(value)]:
            Parameters().set(name, value)
        case "fail", ["motor", str(), float(loss)] if not 0.0 <= loss <= 1.0:
            raise ValueError(f"expected a share of the thrust from 0 to 1, got {loss:g}")
        case _:
            pass
    return values


def _arm(stage: Stage, force: str = "") -> None:
    stage.flight.arm(force=bool(force))


def _disarm(stage: Stage, force: str = "") -> None:
    stage.flight.disarm(force=bool(force))


def _takeoff(stage: Stage, height: float | None = None) -> None:
    stage.flight.takeoff(height)


def _transition(stage: Stage, regime: str) -> None:
    stage.flight.transition(regime == "cruise")


def _mode(stage: Stage, name: str) -> None:
    stage.flight.set_mode(Mode[name.upper()])


def _mission(stage: Stage, what: str, item: float | None = None) -> None:
    if what == "start":
        stage.flight.start_mission(int(item or 0))
    elif what == "pause":
        stage.flight.pause()
    else:
        stage.flight.resume()


def _goto(stage: Stage, north: float, east: float, down: float, speed: float | None = None) -> None:
    stage.flight.go_to(north, east, down, speed=speed)


def _heading(stage: Stage, heading_deg: float) -> None:
    view = stage.flight.view
    stage.flight.go_to(view.north, view.east, view.down, heading=math.radians(heading_deg))


def _velocity(stage: Stage, north: float, east: float, down: float) -> None:
    stage.stream(MotionSetpoint(velocity=(north, east), down_rate=down))


def _orbit(stage: Stage, north: float, east: float, radius: float, speed: float | None = None) -> None:
    stage.flight.orbit((north, east), radius, speed)


def _speed(stage: Stage, speed: float) -> None:
    if stage.flight.regime.wing_borne:
        stage.flight.change_speed(airspeed=speed)
    else:
        stage.flight.change_speed(ground_speed=speed)


def _altitude(stage: Stage, height: float) -> None:
    stage.flight.change_altitude(stage.flight.home.altitude + height)


def _link(stage: Stage, name: str, state: str) -> None:
    stage.set_link(name, up=state == "up")


def _fail_motor(stage: Stage, _: str, name: str, loss: float) -> None:
    stage.fail_motor(name, loss)


def _fail_servo(stage: Stage, name: str, angle_deg: float | None = None) -> None:
    stage.fail_servo(name, None if angle_deg is None else math.radians(angle_deg))


def _wind(stage: Stage, north: float, east: float, down: float = 0.0) -> None:
    stage.set_wind((north, east, down))


def _parameter(stage: Stage, name: str, value: float) -> None:
    stage.flight.parameters.set(name, value)


FORMS: dict[str, Callable[..., None]] = {
    "arm [force]": _arm,
    "disarm [force]": _disarm,
    "takeoff [HEIGHT]": _takeoff,
    "land": lambda stage: stage.flight.land(),
    "return": lambda stage: stage.flight.return_home(),
    "hold": lambda stage: stage.flight.hold(),
    "terminate": lambda stage: stage.flight.terminate(),
    "transition cruise|hover": _transition,
    f"mode {'|'.join(mode.name.lower() for mode in Mode)}": _mode,
    "mission start|pause|resume [ITEM]": _mission,
    "goto NORTH EAST DOWN [SPEED]": _goto,
    "heading DEGREES": _heading,
    "velocity NORTH EAST DOWN": _velocity,
    "orbit NORTH EAST RADIUS [SPEED]": _orbit,
    "speed SPEED": _speed,
    "altitude HEIGHT": _altitude,
    f"link {'|'.join(LINKS)} up|down": _link,
    "fail motor left|right|tail LOSS": _fail_motor,
    f"fail {'|'.join(SERVO_NAMES)} [DEGREES]": _fail_servo,
    "repair": lambda stage: stage.repair(),
    "wind NORTH EAST [DOWN]": _wind,
    "parameter NAME VALUE": _parameter,
}
