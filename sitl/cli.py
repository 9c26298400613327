"""The command line: `tiltwing-sitl` and `python -m sitl`.

Options are checked here, before anything heavy is imported, so that a typing error is answered at once.
"""

import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal, NamedTuple

import typer
from typer.exceptions import TyperException

from sitl.flight.view import EVENTS_RATE
from sitl.home import Home, home_from

__all__ = ["Options", "main", "parse_options"]

PROGRAM = "tiltwing-sitl"


class Options(NamedTuple):
    """One command line, checked; in the units people type (degrees, metres, seconds).

    What is None was not given and is as the scenario has it, which says what it is without a scenario file, too.
    """

    scenario: Path | None
    at: str | None
    autopilot: bool
    links: tuple[str, ...]
    identity: str
    parameters: tuple[str, ...]  # NAME=VALUE
    parameter_files: tuple[Path, ...]
    state: Path | None
    signing_key: Path | None
    tlog: Path | None
    home: Home | None
    wind: tuple[float, float, float] | None
    earth: Literal["flat", "round", "wgs84"] | None
    speed: float  # inf for "max"
    seed: int | None
    aircraft: Path | None
    system_id: int | None  # instance included; None: the parameter MAV_SYS_ID
    instance: int
    servos: int | None
    wait_servos: bool
    servo_timeout: float
    lockstep: bool
    rate: int
    duration: float  # inf without end
    rerun: str
    no_map: bool
    realtime_priority: bool


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the vehicle as the command line says; returns the exit code.

    0 at the end of `--duration`, 1 for a flight that could not begin or diverged, 2 for a wrong option, and
    130 or 143 after Ctrl-C or SIGTERM, as shells expect.
    """
    try:
        options = parse_options(arguments)
        if options is None:
            return 0
        from sitl.launch import LaunchError, fly

        try:
            return fly(options)
        except LaunchError as error:
            print(f"{PROGRAM}: {error}", file=sys.stderr)
            return error.exit_code
    except TyperException as error:
        print(f"{PROGRAM}: {error.format_message()} (see --help)", file=sys.stderr)
        return 2
    except KeyboardInterrupt:  # before the flight has begun; later ones it handles itself
        return 130


def parse_options(arguments: Sequence[str] | None = None) -> Options | None:
    """Options of a command line (default: that of the process), or None if it only asked for help.

    Raises TyperException, with one line that names the option and what was expected.
    """
    parsed = _application(arguments, prog_name=PROGRAM, standalone_mode=False)
    return parsed if isinstance(parsed, Options) else None


_application = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


@_application.command(name=PROGRAM, context_settings={"help_option_names": ["-h", "--help"]})
def _command(
    scenario: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Start, home, wind, parameters, mission and events of the flight; options go before it.",
        ),
    ] = None,
    at: Annotated[
        str | None,
        typer.Option(
            metavar="ground|trim:AIRSPEED|FILE",
            help="Begin on the ground, in level flight (airspeed in m/s), or as in a file. [default: ground]",
        ),
    ] = None,
    autopilot: Annotated[
        Literal["on", "off"],
        typer.Option(
            help="Flight controller on board; off: controls are held, for an outside controller to send them."
        ),
    ] = "on",
    link: Annotated[
        list[str] | None,
        typer.Option(
            metavar="LINK",
            help="MAVLink connection, may be repeated: udpout:HOST:PORT, udpin:[HOST:]PORT, tcpin:[HOST:]PORT or "
            "tcpout:HOST:PORT, then ,normal ,onboard ,viewer ,minimal or ,highlatency, ,trusted, ,single. [default: "
            "udpout:127.0.0.1:14550 for ground stations and udpout:127.0.0.1:14540 for SDKs]",
        ),
    ] = None,
    identity: Annotated[
        Literal["px4", "ardupilot", "generic"], typer.Option(help="Autopilot that ground stations take it for.")
    ] = "px4",
    param: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=VALUE", help="Parameter of the flight controller, may be repeated."),
    ] = None,
    params: Annotated[
        list[Path] | None,
        typer.Option(metavar="FILE", help="Parameters, as QGroundControl or MAVProxy save them; may be repeated."),
    ] = None,
    state: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Keep parameters, missions, logs and files there. [default: nowhere]"),
    ] = None,
    signing_key: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Sign MAVLink with the key in this file, and believe no other.")
    ] = None,
    tlog: Annotated[Path | None, typer.Option(metavar="FILE", help="Record all MAVLink traffic.")] = None,
    home: Annotated[
        str | None,
        typer.Option(metavar="LAT,LON,ALT,HDG", help="Degrees and metres. [default: 47.397742,8.545594,488,0]"),
    ] = None,
    wind: Annotated[
        str | None, typer.Option(metavar="N,E[,D]", help="Steady wind in m/s, blowing to. [default: 0,0]")
    ] = None,
    earth: Annotated[
        Literal["flat", "round", "wgs84"] | None, typer.Option(help="Shape of the Earth. [default: flat]")
    ] = None,
    speed: Annotated[str, typer.Option(metavar="N|max", help="Times real time.")] = "1",
    seed: Annotated[
        int | None, typer.Option(metavar="N", min=0, help="Where random streams begin. [default: 0]")
    ] = None,
    aircraft: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Aircraft file. [default: the paper's, hong2013.toml]")
    ] = None,
    sysid: Annotated[
        int | None,
        typer.Option(metavar="ID", min=1, max=255, help="MAVLink system id. [default: parameter MAV_SYS_ID, 1]"),
    ] = None,
    instance: Annotated[
        int, typer.Option("-i", "--instance", metavar="N", min=0, max=254, help="Shift ports and system id by N.")
    ] = 0,
    servos: Annotated[
        int | None, typer.Option(metavar="ID", min=1, max=255, help="Take servo outputs from this system only.")
    ] = None,
    wait_servos: Annotated[
        bool, typer.Option("--wait-servos", help="Hold time still until the first servo output.")
    ] = False,
    servo_timeout: Annotated[
        float, typer.Option(metavar="S", min=0.01, max=60.0, help="Servo outputs older than this are stale.")
    ] = 0.5,
    lockstep: Annotated[
        bool, typer.Option("--lockstep", help="Each HIL_ACTUATOR_CONTROLS is one step of 1/rate; no autopilot.")
    ] = False,
    rate: Annotated[
        int, typer.Option(metavar="HZ", min=50, max=10000, help="Integration steps per second, a multiple of 50.")
    ] = 400,
    duration: Annotated[
        float | None, typer.Option(metavar="S", min=0.0, help="End after so many simulated seconds.")
    ] = None,
    rerun: Annotated[
        str, typer.Option(metavar="web|spawn|connect:URL|save:FILE.rrd|off", help="Show the flight in Rerun.")
    ] = "off",
    no_map: Annotated[
        bool, typer.Option("--no-map", help="Leave out the viewer's map, whose tiles come from the internet.")
    ] = False,
    realtime_priority: Annotated[
        bool, typer.Option("--realtime-priority", help="Run with SCHED_FIFO where the system permits it.")
    ] = False,
) -> Options:
    """Fly a tilt-wing UAV that speaks MAVLink, until Ctrl-C."""
    system = (sysid or 1) + instance
    if system > 255:
        _refuse("--instance", f"expected a system id up to 255, got {sysid or 1} + {instance}")
    if duration is not None and not math.isfinite(duration):
        _refuse("--duration", f"expected finite seconds, got {duration}")
    factor = _speed(speed)
    if lockstep and factor != 1.0:
        _refuse("--lockstep", f"expected no --speed with it, for the outside controller drives time, got {speed}")
    if lockstep and wait_servos:
        _refuse("--lockstep", "expected no --wait-servos with it, for time always waits for the outside controller")
    return Options(
        scenario=scenario,
        at=at,
        autopilot=autopilot == "on" and not lockstep,
        links=tuple(link or ()),
        identity=identity,
        parameters=tuple(param or ()),
        parameter_files=tuple(params or ()),
        state=state,
        signing_key=signing_key,
        tlog=tlog,
        home=None if home is None else _home(home),
        wind=None if wind is None else _wind(wind),
        earth=earth,
        speed=factor,
        seed=seed,
        aircraft=aircraft,
        system_id=None if sysid is None and instance == 0 else system,
        instance=instance,
        servos=servos,
        wait_servos=wait_servos,
        servo_timeout=servo_timeout,
        lockstep=lockstep,
        rate=_rate(rate),
        duration=math.inf if duration is None else duration,
        rerun=rerun,
        no_map=no_map,
        realtime_priority=realtime_priority,
    )


def _refuse(option: str, text: str) -> None:
    raise typer.BadParameter(text, param_hint=f"'{option}'")


def _rate(rate: int) -> int:
    if rate % EVENTS_RATE:
        _refuse("--rate", f"expected a multiple of {EVENTS_RATE} steps per second, got {rate}")
    return rate


def _numbers(option: str, text: str, form: str, *counts: int) -> list[float]:
    """Comma-separated finite numbers; `counts` says how many there may be."""
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        values = []
    if len(values) not in counts or not all(map(math.isfinite, values)):
        _refuse(option, f"expected {form}, got {text!r}")
    return values


def _home(text: str) -> Home:
    numbers = _numbers("--home", text, "LAT,LON,ALT,HDG in degrees and metres", 4)
    try:
        return home_from(numbers)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="'--home'") from None


def _wind(text: str) -> tuple[float, float, float]:
    north, east, *down = _numbers("--wind", text, "N,E or N,E,D in m/s", 2, 3)
    return north, east, down[0] if down else 0.0


def _speed(text: str) -> float:
    if text == "max":
        return math.inf
    (speed,) = _numbers("--speed", text, "a positive number or max", 1)
    if speed <= 0.0:
        _refuse("--speed", f"expected a positive number or max, got {text!r}")
    return speed
