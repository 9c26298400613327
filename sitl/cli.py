"""The command line: `tiltwing-sitl` and `python -m sitl`.

Options are checked here, before anything heavy is imported, so that a typing error is answered at once.
"""

import math
import sys
from enum import StrEnum
from pathlib import Path
from typing import Annotated, NamedTuple

import typer

__all__ = ["Home", "Options", "main"]

PROGRAM = "tiltwing-sitl"


class Home(NamedTuple):
    """Origin of the flight: geodetic degrees, metres above mean sea level, degrees from north."""

    latitude: float
    longitude: float
    altitude: float
    heading: float


class Earth(StrEnum):
    """Shapes of the Earth that `vehicle_model.earth` knows."""

    FLAT = "flat"
    ROUND = "round"
    WGS84 = "wgs84"


class Options(NamedTuple):
    """One command line, checked and in the units people type (degrees, metres, seconds)."""

    at: str
    links: tuple[str, ...]
    home: Home
    wind: tuple[float, float, float]
    earth: str
    speed: float
    seed: int
    aircraft: Path | None
    system_id: int
    instance: int
    servos: int | None
    wait_servos: bool
    servo_timeout: float
    lockstep: bool
    rate: int
    duration: float
    rerun: str
    realtime_priority: bool


PX4_HOME = "47.397742,8.545594,488,0"  # where PX4's simulators start, Zurich


def _numbers(text: str, counts: tuple[int, ...], form: str) -> list[float]:
    """Comma-separated finite numbers; `counts` says how many there may be."""
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        values = []
    if len(values) not in counts or not all(math.isfinite(value) for value in values):
        msg = f"expected {form}, got {text!r}"
        raise typer.BadParameter(msg)
    return values


def _home(text: str) -> Home:
    home = Home(*_numbers(text, (4,), "LAT,LON,ALT,HDG in degrees and metres"))
    limits = Home(89.9, 180.0, 20000.0, 360.0)
    for name, value, limit in zip(Home._fields, home, limits, strict=True):
        if abs(value) > limit:
            msg = f"expected a {name} within +-{limit:g}, got {value:g}"
            raise typer.BadParameter(msg)
    return home


def _wind(text: str) -> tuple[float, float, float]:
    north, east, *rest = _numbers(text, (2, 3), "N,E or N,E,D in m/s")
    return north, east, rest[0] if rest else 0.0


def _speed(text: str) -> float:
    if text == "max":
        return math.inf
    try:
        speed = float(text)
    except ValueError:
        speed = math.nan
    if not 0.0 < speed < math.inf:
        msg = f"expected a positive number or max, got {text!r}"
        raise typer.BadParameter(msg)
    return speed


app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


@app.command(name=PROGRAM, context_settings={"help_option_names": ["-h", "--help"]})
def _command(
    at: Annotated[str, typer.Option(metavar="ground|trim:M_S|FILE", help="Where the flight begins.")] = "ground",
    link: Annotated[
        list[str] | None,
        typer.Option(
            metavar="LINK",
            help="MAVLink connection: udpout:HOST:PORT, udpin:[HOST:]PORT, tcpin:[HOST:]PORT; may be repeated. "
            "[default: udpout:127.0.0.1:14550 for ground stations and udpout:127.0.0.1:14540 for SDKs]",
        ),
    ] = None,
    home: Annotated[Home, typer.Option(parser=_home, metavar="LAT,LON,ALT,HDG", help="Degrees and metres.")] = PX4_HOME,  # type: ignore[assignment]
    wind: Annotated[
        tuple, typer.Option(parser=_wind, metavar="N,E[,D]", help="Steady wind, blowing to [m/s].")
    ] = "0,0",  # type: ignore[assignment]
    earth: Annotated[Earth, typer.Option(help="Shape of the Earth.")] = Earth.FLAT,
    speed: Annotated[float, typer.Option(parser=_speed, metavar="N|max", help="Times real time.")] = "1",  # type: ignore[assignment]
    seed: Annotated[int, typer.Option(min=0, help="Of everything random.")] = 0,
    aircraft: Annotated[Path | None, typer.Option(metavar="FILE", help="Aircraft file. [default: hong2013.toml]")] = None,
    sysid: Annotated[int, typer.Option(min=1, max=255, help="MAVLink system id.")] = 1,
    instance: Annotated[
        int, typer.Option("-i", "--instance", min=0, max=254, help="Shifts all ports and the system id by N.", metavar="N")
    ] = 0,
    servos: Annotated[
        int | None, typer.Option(min=1, max=255, metavar="SYSID", help="Take servo outputs from this system only.")
    ] = None,
    wait_servos: Annotated[bool, typer.Option("--wait-servos", help="Hold time still until the first servo output.")] = False,
    servo_timeout: Annotated[float, typer.Option(min=0.0, help="Silence after which servos are stale [s].")] = 0.5,
    lockstep: Annotated[
        bool, typer.Option("--lockstep", help="Each HIL_ACTUATOR_CONTROLS advances one step of 1/rate; time waits for it.")
    ] = False,
    rate: Annotated[int, typer.Option(min=50, max=10000, help="Integration steps per second [Hz].")] = 400,
    duration: Annotated[float | None, typer.Option(min=0.0, metavar="S", help="End after S simulated seconds.")] = None,
    rerun: Annotated[
        str, typer.Option(metavar="web|spawn|connect:URL|save:FILE.rrd|off", help="Show the flight in Rerun.")
    ] = "off",
    realtime_priority: Annotated[
        bool, typer.Option("--realtime-priority", help="Ask for SCHED_FIFO scheduling (needs permission).")
    ] = False,
) -> Options:
    """Fly a tilt-wing UAV that speaks MAVLink, in real time, until Ctrl-C."""
    if sysid + instance > 255:
        msg = f"system id {sysid} + instance {instance} is more than 255"
        raise typer.BadParameter(msg)
    return Options(
        at, tuple(link or ()), home, wind, earth.value, speed, seed, aircraft, sysid + instance, instance, servos,
        wait_servos, servo_timeout, lockstep, rate, math.inf if duration is None else duration, rerun, realtime_priority,
    )  # fmt: skip
