"""Check cases as files: a bare body, where it starts on which Earth, and what its flight must have come to.

A case is a TOML file in which every number has a unit and a source, as in an aircraft file:

    title           = "Dropped sphere"
    source          = "where the numbers are from"
    earth           = "wgs84"                       # or "round", "flat"
    rotating        = true
    wind_ned        = { value = [0, 0, 0], unit = "m/s" }       # blowing to
    duration        = { value = 30, unit = "s" }
    time_step       = { value = 0.01, unit = "s" }
    sample_interval = { value = 1, unit = "s" }

then the tables [body] and [initial], and any number of

    [[expected]]
    quantity  = "height_ellipsoid"                  # one of EXPECTED
    time      = { value = 30, unit = "s" }
    value     = { value = 4754.5, unit = "m" }
    tolerance = { value = 0.1, unit = "m" }
"""

import tomllib
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec
import numpy as np

from vehicle_model.aircraft_schema import Quantity, SchemaError, decode
from vehicle_model.toml_lines import Keys, entry_lines, line_of

__all__ = ["EXPECTED", "Body", "Case", "CaseFileError", "Expected", "Initial", "read_case"]

Vector = tuple[float, float, float]
Time = Annotated[float, Quantity("s", 0, 1e5)]
Step = Annotated[float, Quantity("s", 1e-5, 1e5)]
Inertia = Annotated[float, Quantity("kg m^2", 1e-9, 1e9)]
Product = Annotated[float, Quantity("kg m^2", -1e9, 1e9)]
Derivative = Annotated[float, Quantity("1/rad", -1e3, 1e3)]
Height = Annotated[float, Quantity("m", -1e4, 1e9)]
Angle = Annotated[float, Quantity("deg", -360, 360)]
Velocity = Annotated[Vector, Quantity("m/s", -2e4, 2e4)]
Rates = Annotated[Vector, Quantity("deg/s", -1e5, 1e5)]


class CaseFileError(ValueError):
    """A check case cannot be used. One line: `FILE:LINE: entry: what was expected, what was found`."""


class Body(msgspec.Struct, frozen=True):
    """A rigid body with drag against its motion through the air and damping of its rotation, in body axes."""

    mass: Annotated[float, Quantity("kg", 1e-6, 1e9)]
    ixx: Inertia
    iyy: Inertia
    izz: Inertia
    ixy: Product  # integral of x y dm, and so on
    ixz: Product
    iyz: Product
    reference_area: Annotated[float, Quantity("m^2", 0, 1e6)]
    reference_span: Annotated[float, Quantity("m", 0, 1e3)]
    reference_chord: Annotated[float, Quantity("m", 0, 1e3)]
    drag_coefficient: Annotated[float, Quantity("1", 0, 1e3)]
    roll_damping: Derivative  # Clp, per p b/2V
    pitch_damping: Derivative  # Cmq, per q c/2V
    yaw_damping: Derivative  # Cnr, per r b/2V

    @property
    def inertia(self) -> np.ndarray:
        """Inertia tensor (3, 3) [kg m^2]."""
        return np.array([
            [self.ixx, -self.ixy, -self.ixz],
            [-self.ixy, self.iyy, -self.iyz],
            [-self.ixz, -self.iyz, self.izz],
        ])  # fmt: skip


class Initial(msgspec.Struct, frozen=True):
    """Where and how the body starts; velocity is relative to the Earth, body rates are inertial."""

    latitude: Annotated[float, Quantity("deg", -90, 90)]  # geodetic
    longitude: Angle
    height_ellipsoid: Height
    velocity_ned: Velocity
    roll: Angle
    pitch: Annotated[float, Quantity("deg", -90, 90)]
    yaw: Angle
    rates: Rates


class Expected(msgspec.Struct, frozen=True):
    """A quantity at a time; the subclasses give value and tolerance their dimension. Vectors compare by component."""

    quantity: str
    time: Time


class ExpectedHeight(Expected, frozen=True):
    """Of a length."""

    value: Height
    tolerance: Annotated[float, Quantity("m", 0, 1e6)]


class ExpectedAngle(Expected, frozen=True):
    """Of an angle, compared modulo a turn."""

    value: Angle
    tolerance: Annotated[float, Quantity("deg", 0, 360)]


class ExpectedEuler(Expected, frozen=True):
    """Of roll, pitch and yaw, compared modulo a turn."""

    value: Annotated[Vector, Quantity("deg", -360, 360)]
    tolerance: Annotated[float, Quantity("deg", 0, 360)]


class ExpectedVelocity(Expected, frozen=True):
    """Of a velocity vector."""

    value: Velocity
    tolerance: Annotated[float, Quantity("m/s", 0, 1e4)]


class ExpectedRates(Expected, frozen=True):
    """Of roll, pitch and yaw rate."""

    value: Rates
    tolerance: Annotated[float, Quantity("deg/s", 0, 1e5)]


class ExpectedDensity(Expected, frozen=True):
    """Of the air."""

    value: Annotated[float, Quantity("kg/m^3", 0, 10)]
    tolerance: Annotated[float, Quantity("kg/m^3", 0, 10)]


class ExpectedSpeed(Expected, frozen=True):
    """Of a speed."""

    value: Annotated[float, Quantity("m/s", 0, 2e4)]
    tolerance: Annotated[float, Quantity("m/s", 0, 1e4)]


EXPECTED: dict[str, type[Expected]] = {
    "height_ellipsoid": ExpectedHeight,
    "latitude": ExpectedAngle,
    "longitude": ExpectedAngle,
    "velocity_ned": ExpectedVelocity,  # relative to the Earth, in the local geodetic axes
    "euler": ExpectedEuler,  # against the local geodetic axes
    "rates": ExpectedRates,  # inertial, body axes
    "density": ExpectedDensity,
    "speed_of_sound": ExpectedSpeed,
}


class Case(msgspec.Struct, frozen=True):
    """A check case in SI and radians."""

    title: str
    earth: Literal["flat", "round", "wgs84"]
    rotating: bool
    wind_ned: Annotated[Vector, Quantity("m/s", -500, 500)]
    duration: Time
    time_step: Step
    sample_interval: Step
    body: Body
    initial: Initial
    _expected: tuple[Any, ...] = ()

    @property
    def expected(self) -> tuple[Any, ...]:
        """What the flight must have come to; each an instance of one of EXPECTED."""
        return self._expected

    @property
    def steps_per_sample(self) -> int:
        """Integration steps from one sample to the next."""
        return round(self.sample_interval / self.time_step)

    @property
    def samples(self) -> int:
        """Number of samples, that at the start included."""
        return round(self.duration / self.sample_interval) + 1


def read_case(path: Path | str) -> Case:
    """Read and check a case; raises CaseFileError, whose one line names file, line, entry and what was expected."""
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
        document = tomllib.loads(text)
    except OSError as error:
        raise CaseFileError(f"{path}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise CaseFileError(f"{path}: expected UTF-8 text: {error.reason}") from None
    except tomllib.TOMLDecodeError as error:
        raise CaseFileError(f"{path}: not valid TOML: {error}") from None
    try:
        return _case(document)
    except SchemaError as error:
        raise CaseFileError(f"{path}:{line_of(entry_lines(text), error.keys)}: {error}") from None


def _case(document: dict[str, Any]) -> Case:
    entries = document.pop("expected", [])
    case = decode(Case, document)
    if not isinstance(entries, list) or not all(isinstance(entry, dict) for entry in entries):
        raise SchemaError(("expected",), "expected tables [[expected]]")
    case = msgspec.structs.replace(
        case, _expected=tuple(_expected(entry, index, document.get("source")) for index, entry in enumerate(entries))
    )
    _check_consistency(case)
    return case


def _expected(entry: dict[str, Any], index: int, source: str | None) -> Expected:
    keys: Keys = ("expected", index)
    quantity = entry.get("quantity")
    if quantity not in EXPECTED:
        found = "none" if quantity is None else repr(quantity)
        raise SchemaError((*keys, "quantity"), f"expected one of {', '.join(EXPECTED)}, got {found}")
    return decode(EXPECTED[quantity], entry, keys, source)


def _check_consistency(case: Case) -> None:
    """What no entry can tell alone: a body that can exist, samples on steps, expectations on samples."""
    principal = np.linalg.eigvalsh(case.body.inertia)
    if principal[0] <= 0.0 or principal[2] > (principal[0] + principal[1]) * (1.0 + 1e-9):
        raise SchemaError(
            ("body",),
            "expected moments of inertia that a body can have, each principal one positive and at most the sum of the"
            f" others, got {', '.join(f'{moment:.6g}' for moment in principal)} kg m^2",
        )
    if case.rotating and case.earth == "flat":
        raise SchemaError(("rotating",), 'expected false where earth = "flat"')
    if not _is_multiple(case.sample_interval, case.time_step):
        raise SchemaError(("sample_interval",), f"expected a multiple of time_step, {case.time_step:g} s")
    if not _is_multiple(case.duration, case.sample_interval):
        raise SchemaError(("duration",), f"expected a multiple of sample_interval, {case.sample_interval:g} s")
    for index, expected in enumerate(case.expected):
        if not _is_multiple(expected.time, case.sample_interval) or expected.time > case.duration * (1.0 + 1e-9):
            raise SchemaError(
                ("expected", index, "time"),
                f"expected a multiple of sample_interval, {case.sample_interval:g} s, up to {case.duration:g} s",
            )


def _is_multiple(time: float, step: float) -> bool:
    return abs(time / step - round(time / step)) < 1e-6
