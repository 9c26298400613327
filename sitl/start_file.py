"""The start file: a flight's beginning as people write it, read and checked against the aircraft that is to fly it.

docs/start-file.md tells users about it; `sitl.start` makes a state of it.
"""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import msgspec
import numpy as np

from sitl.toml_file import TableError, numbers, read_table, typed
from vehicle_model.earth import height_above_ellipsoid

if TYPE_CHECKING:
    from vehicle_model.aircraft import Aircraft

__all__ = ["RPM", "TRIM_HEIGHT", "StartError", "StartFile", "read_start_file"]

TRIM_HEIGHT = 100.0  # above home [m]: room for a phugoid
RPM = 2.0 * math.pi / 60.0  # [rad/s]
ROUNDING = 1e-9  # of a limit turned into the file's units


class StartError(ValueError):
    """The flight cannot begin as asked for."""


Vector = tuple[float, float, float]
Angle = Annotated[float, msgspec.Meta(ge=-360.0, le=360.0)]


class StartFile(msgspec.Struct, frozen=True):
    """A start as people write it: degrees and RPM, axes of home. What is not given is zero, or as said here."""

    position_ned: Vector = (0.0, 0.0, -TRIM_HEIGHT)  # from home [m]
    velocity_body: Vector = (0.0, 0.0, 0.0)  # relative to the Earth, forward, right, down [m/s]
    attitude_deg: tuple[Angle, Angle, Angle] | None = None  # roll, pitch, yaw; level with the heading of home
    rates_deg_s: Vector = (0.0, 0.0, 0.0)  # relative to the Earth, about the body axes
    rotor_rpm: Vector = (0.0, 0.0, 0.0)  # left, right, tail
    tilt_deg: float = 90.0
    aileron_deg: tuple[float, float] = (0.0, 0.0)  # left, right
    elevator_deg: float = 0.0
    throttle: Vector = (0.0, 0.0, 0.0)  # left, right, tail


def read_start_file(path: Path, aircraft: "Aircraft", environment: np.ndarray) -> StartFile:
    """Read a start file and check it against the aircraft and the ground (one ENVIRONMENT record).

    Raises StartError with one line that names the file, the key and what was expected.
    """
    try:
        given = typed(read_table(path), StartFile)
        _check(given, aircraft, environment)
    except TableError as error:
        msg = f"{path}: {error}"
        raise StartError(msg) from None
    return given


def _check(given: StartFile, aircraft: "Aircraft", environment: np.ndarray) -> None:
    """Raise TableError for what the aircraft cannot do, or a place below the ground."""
    ranges = _ranges(aircraft)
    for key, value in numbers(msgspec.structs.asdict(given)):
        if key in ranges:
            lowest, highest = ranges[key]
            if not lowest - ROUNDING <= value <= highest + ROUNDING:
                msg = f"{key}: expected {lowest:.6g} to {highest:.6g}, which the aircraft allows, got {value:.6g}"
                raise TableError(msg)
    home = environment[0]
    above_ground = float(height_above_ellipsoid(*given.position_ned, home) - home["ground_height"])
    if above_ground < 0.0:
        msg = f"position_ned: expected a place above the ground, got one {-above_ground:.6g} m below it"
        raise TableError(msg)


def _ranges(aircraft: "Aircraft") -> dict[str, tuple[float, float]]:
    """What the aircraft can do, in the file's units: servos' travel, motors' throttle and speed without load."""
    craft = aircraft.vehicle[0]
    ranges = {}
    for number, rotor in enumerate(craft["rotors"][: int(craft["rotor_count"])]):
        backwards = float(rotor["min_throttle"])
        no_load_rpm = float(rotor["battery_voltage"] / rotor["torque_constant"]) / RPM
        ranges[f"throttle[{number}]"] = (backwards, 1.0)
        ranges[f"rotor_rpm[{number}]"] = (backwards * no_load_rpm, no_load_rpm)
    servos = ("tilt_deg", "aileron_deg[0]", "aileron_deg[1]", "elevator_deg")
    for key, servo in zip(servos, craft["servos"], strict=True):
        ranges[key] = (math.degrees(servo["minimum"]), math.degrees(servo["maximum"]))
    return ranges
