"""Flies a check case: a bare body through the same equations and integrator as the aircraft, compared with a source.

The body is a VEHICLE without rotors, surfaces or landing gear; what is left of the model is the Earth, the air,
rigid-body motion, drag and damping. `vehicle_model.check_case_file` says how a case is written down.
"""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vehicle_model.atmosphere import atmosphere
from vehicle_model.check_case_file import Body, Case, CaseFileError, read_case
from vehicle_model.earth import make_environment
from vehicle_model.integrate import advance
from vehicle_model.records import VEHICLE
from vehicle_model.rigid_body import local_motion
from vehicle_model.rotation import euler_from_quaternion, ned_to_body, quaternion_from_euler
from vehicle_model.state import QUATERNION, RATES, VELOCITY, blank_controls, blank_state
from vehicle_model.units import UNITS

__all__ = ["CaseFileError", "CaseResult", "Check", "bare_body", "fly", "run_case"]

ANGLES = {"latitude", "longitude", "euler"}
PRINTED = {
    "height_ellipsoid": "m", "latitude": "deg", "longitude": "deg", "velocity_ned": "m/s", "euler": "deg",
    "rates": "deg/s", "density": "kg/m^3", "speed_of_sound": "m/s",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Check:
    """An expected value beside the flown one, SI and radians; `difference` is the largest of a vector's components."""

    quantity: str
    time: float
    expected: float | tuple[float, float, float]
    flown: np.ndarray
    difference: float
    tolerance: float

    @property
    def passed(self) -> bool:
        """True within the tolerance; not-a-number never is."""
        return self.difference <= self.tolerance

    def __str__(self) -> str:
        """One line; angles in degrees."""
        unit = PRINTED[self.quantity]
        factor = UNITS[unit].factor
        flown = ", ".join(f"{component / factor:.9g}" for component in np.atleast_1d(self.flown))
        return (
            f"{'ok  ' if self.passed else 'FAIL'} {self.time:8g} s  {self.quantity:16} {flown} {unit},"
            f" off by {self.difference / factor:.2g} (tolerance {self.tolerance / factor:.2g})"
        )


@dataclass(frozen=True, slots=True)
class CaseResult:
    """The flight of a case, sampled (N samples), and its checks. SI and radians.

    `velocity_ned` (relative to the Earth) and `euler` (roll, pitch, yaw) are against the local geodetic axes; `rates`
    (inertial) in body axes; `position_ned` in the tangent frame of the start.
    """

    title: str
    time: np.ndarray  # (N,)
    position_ned: np.ndarray  # (N, 3)
    latitude: np.ndarray  # (N,)
    longitude: np.ndarray  # (N,)
    height_ellipsoid: np.ndarray  # (N,)
    velocity_ned: np.ndarray  # (N, 3)
    euler: np.ndarray  # (N, 3)
    rates: np.ndarray  # (N, 3)
    temperature: np.ndarray  # (N,)
    pressure: np.ndarray  # (N,)
    density: np.ndarray  # (N,)
    speed_of_sound: np.ndarray  # (N,)
    checks: tuple[Check, ...]

    @property
    def passed(self) -> bool:
        """True if every expected value was met."""
        return all(check.passed for check in self.checks)

    def __str__(self) -> str:
        """Where the body ended, then a line for each check."""
        roll, pitch, yaw = np.degrees(self.euler[-1])
        north, east, down = self.velocity_ned[-1]
        place = (
            f"latitude {math.degrees(self.latitude[-1]):.9f} deg, longitude {math.degrees(self.longitude[-1]):.9f} deg"
        )
        lines = [
            self.title,
            f"after {self.time[-1]:g} s: {place}, height {self.height_ellipsoid[-1]:.4f} m",
            f"  velocity north {north:.5f}, east {east:.5f}, down {down:.5f} m/s",
            f"  roll {roll:.5f}, pitch {pitch:.5f}, yaw {yaw:.5f} deg",
            *map(str, self.checks),
            f"{sum(check.passed for check in self.checks)} of {len(self.checks)} checks passed",
        ]
        return "\n".join(lines)


def bare_body(body: Body) -> np.ndarray:
    """VEHICLE array of shape (1,), read-only, of a body with isotropic drag and damping and nothing that moves."""
    vehicle = np.zeros(1, VEHICLE)
    record = vehicle[0]
    record["mass"] = body.mass
    record["inertia"] = body.inertia
    record["inertia_inverse"] = np.linalg.inv(body.inertia)
    record["fuselage_drag_area"] = body.drag_coefficient * body.reference_area
    record["damping_area"] = body.reference_area
    record["damping_span"] = body.reference_span
    record["damping_chord"] = body.reference_chord
    record["roll_damping"] = body.roll_damping
    record["pitch_damping"] = body.pitch_damping
    record["yaw_damping"] = body.yaw_damping
    record["servos"]["time_constant"] = 1.0  # no servo is there to move, but its lag divides
    vehicle.flags.writeable = False
    return vehicle


def run_case(path: Path | str) -> CaseResult:
    """Read, fly and check a case; raises CaseFileError if the file cannot be used."""
    return fly(read_case(path))


def fly(case: Case) -> CaseResult:
    """Fly a case with the aircraft's own RK4 step and compare it with what it expects."""
    start = case.initial
    environment = make_environment(
        case.earth,
        latitude=start.latitude,
        longitude=start.longitude,
        height_ellipsoid=start.height_ellipsoid,
        wind_ned=case.wind_ned,
        rotating=case.rotating,
    )
    attitude = quaternion_from_euler(start.roll, start.pitch, start.yaw)
    state = blank_state()
    state[VELOCITY : VELOCITY + 3] = ned_to_body(*attitude, *start.velocity_ned)
    state[QUATERNION : QUATERNION + 4] = attitude
    state[RATES : RATES + 3] = start.rates

    vehicle, controls = bare_body(case.body), blank_controls()
    states = np.empty((case.samples, len(state)))
    for sample in range(case.samples):
        if sample > 0:
            advance(state, controls, vehicle, environment, case.time_step, case.steps_per_sample)
        states[sample] = state

    geodetic, velocity, attitudes = (
        np.array(rows) for rows in zip(*(local_motion(row, environment[0]) for row in states), strict=True)
    )
    air = np.array([atmosphere(height) for height in geodetic[:, 2]])
    flown = {
        "latitude": geodetic[:, 0],
        "longitude": geodetic[:, 1],
        "height_ellipsoid": geodetic[:, 2],
        "velocity_ned": velocity,
        "euler": np.array([euler_from_quaternion(q[0], q[1], q[2], q[3]) for q in attitudes]),
        "rates": states[:, RATES : RATES + 3],
        "density": air[:, 2],
        "speed_of_sound": air[:, 3],
    }
    return CaseResult(
        title=case.title,
        time=case.sample_interval * np.arange(case.samples),
        position_ned=states[:, :3],
        temperature=air[:, 0],
        pressure=air[:, 1],
        checks=_checks(case, flown),
        **flown,
    )


def _checks(case: Case, flown: dict[str, np.ndarray]) -> tuple[Check, ...]:
    checks: list[Check] = []
    for expected in case.expected:
        value = flown[expected.quantity][round(expected.time / case.sample_interval)]
        difference = np.subtract(value, expected.value)
        if expected.quantity in ANGLES:
            difference -= 2.0 * math.pi * np.round(difference / (2.0 * math.pi))
        checks.append(
            Check(
                quantity=expected.quantity,
                time=expected.time,
                expected=expected.value,
                flown=value,
                difference=float(np.max(np.abs(difference))),
                tolerance=expected.tolerance,
            )
        )
    return tuple(checks)
