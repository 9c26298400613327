"""An elevator step as the model computed it and as a vehicle told it, and how far the two are apart.

The columns are the paper's (Figs 11-12): u and w along the body axes, q, theta; and the velocity in the vertical plane
of the initial heading, which is what the message carries.
"""

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from gcs_scripts.errors import GroundError

__all__ = [
    "Deviation", "Reference", "Response", "check_start", "compare", "read_reference", "response",
]  # fmt: skip

ANGLE_SHARE = 0.01  # theta and q may differ by this share of their largest excursion
VELOCITY_QUANTUM = 0.01  # of HIL_STATE_QUATERNION [m/s]
START_VELOCITY = 0.5  # [m/s]; a vehicle further from the reference's beginning flies something else
START_ALTITUDE = 5.0  # [m]: 0.05 % of the air's density
ACTUATORS = 16


@dataclass(frozen=True)
class Response:
    """A flight; arrays (n,). Velocities are relative to the Earth."""

    time: np.ndarray  # [s]
    u: np.ndarray  # body axes [m/s]
    w: np.ndarray
    q: np.ndarray  # [deg/s]
    theta: np.ndarray  # [deg]
    ahead: np.ndarray  # horizontal, in the initial heading [m/s]
    across: np.ndarray  # horizontal, to the right of it [m/s]
    down: np.ndarray  # [m/s]

    def shifted(self, by: float) -> "Response":
        """The same flight with its times moved [s]."""
        return replace(self, time=self.time + by)


@dataclass(frozen=True)
class Reference(Response):
    """What the flight should be, and the servo outputs (normalised, channel 1 first) that make it so."""

    step_time: float  # [s]
    rate: float  # steps a second [Hz]
    altitude: float  # above mean sea level, at the beginning [m]
    outputs_before: tuple[float, ...]
    outputs_after: tuple[float, ...]


@dataclass(frozen=True)
class Deviation:
    """By how much one quantity of a flight differs from the reference at most, and when."""

    name: str
    unit: str
    largest: float
    time: float  # [s]
    limit: float
    reason: str  # why that is the limit

    @property
    def passed(self) -> bool:
        """Whether the limit is kept."""
        return self.largest <= self.limit


def read_reference(path: Path) -> Reference:
    """Read what `python -m vehicle_model step --json` wrote. Raises GroundError."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise GroundError(f"{path}: cannot be read as JSON: {error}") from None
    if not isinstance(content, dict):
        raise GroundError(f"{path}: expected a JSON object, got a {type(content).__name__}")

    def numbers(key: str) -> np.ndarray:
        try:
            values = np.array(content[key], dtype=float)
        except KeyError:
            raise GroundError(f"{path}: {key} is missing; expected what `vehicle_model step --json` writes") from None
        except (TypeError, ValueError):
            values = np.array(math.nan)
        if not np.isfinite(values).all():
            raise GroundError(f"{path}: {key}: expected finite numbers")
        return values

    def scalar(key: str) -> float:
        value = numbers(key)
        if value.ndim != 0:
            raise GroundError(f"{path}: {key}: expected one number")
        return float(value)

    def row(key: str, least: int, most: float) -> np.ndarray:
        values = numbers(key)
        if values.ndim != 1 or not least <= len(values) <= most:
            raise GroundError(f"{path}: {key}: expected a list of {least} to {most:g} numbers")
        return values

    times = row("time_s", 3, math.inf)
    rate, step_time = scalar("rate_hz"), scalar("step_time_s")
    if rate <= 0.0 or (np.diff(times) <= 0.0).any():
        raise GroundError(f"{path}: time_s, rate_hz: expected rising times and a positive rate")
    if not times[0] < step_time < times[-1]:
        raise GroundError(f"{path}: step_time_s: expected a time between {times[0]:g} and {times[-1]:g} s")
    before = row("servo_outputs_before", 1, ACTUATORS)
    after = row("servo_outputs_after", len(before), len(before))
    if (before == after).all():
        raise GroundError(f"{path}: servo_outputs_after: expected a step, got the same as servo_outputs_before")
    count = len(times)
    return Reference(
        time=times,
        u=row("u_m_s", count, count),
        w=row("w_m_s", count, count),
        q=row("q_deg_s", count, count),
        theta=row("theta_deg", count, count),
        ahead=row("velocity_north_m_s", count, count),
        across=row("velocity_east_m_s", count, count),
        down=row("velocity_down_m_s", count, count),
        step_time=step_time,
        rate=rate,
        altitude=scalar("altitude_msl_m"),
        outputs_before=tuple(before.tolist()),
        outputs_after=tuple(after.tolist()),
    )


def response(states: Sequence[Any]) -> Response:
    """Columns of HIL_STATE_QUATERNION messages, in order of their time, which is counted from the first."""
    time_us = np.array([state.time_usec for state in states], dtype=float)
    attitude = np.array([state.attitude_quaternion for state in states], dtype=float)
    a, b, c, d = (attitude / np.linalg.norm(attitude, axis=1, keepdims=True)).T
    north, east, down = np.array([(state.vx, state.vy, state.vz) for state in states], dtype=float).T * VELOCITY_QUANTUM
    # First and third column of the matrix that turns body axes into NED: the body's x and z axes.
    x_axis = (1.0 - 2.0 * (c * c + d * d), 2.0 * (b * c + a * d), 2.0 * (b * d - a * c))
    z_axis = (2.0 * (b * d + a * c), 2.0 * (c * d - a * b), 1.0 - 2.0 * (b * b + c * c))
    heading = math.atan2(x_axis[1][0], x_axis[0][0])
    sine, cosine = math.sin(heading), math.cos(heading)
    return Response(
        time=(time_us - time_us[0]) * 1e-6,
        u=x_axis[0] * north + x_axis[1] * east + x_axis[2] * down,
        w=z_axis[0] * north + z_axis[1] * east + z_axis[2] * down,
        q=np.degrees([state.pitchspeed for state in states]),
        theta=np.degrees(np.arcsin(np.clip(-x_axis[2], -1.0, 1.0))),
        ahead=cosine * north + sine * east,
        across=cosine * east - sine * north,
        down=down,
    )


def check_start(state: Any, reference: Reference) -> None:
    """Raise GroundError unless a HIL_STATE_QUATERNION is about where the reference begins."""
    speed, sinking, altitude = math.hypot(state.vx, state.vy) * 1e-2, state.vz * 1e-2, state.alt * 1e-3
    wanted, sink_wanted = reference.ahead[0], reference.down[0]
    is_near = max(abs(speed - wanted), abs(sinking - sink_wanted)) <= START_VELOCITY
    if not is_near or abs(altitude - reference.altitude) > START_ALTITUDE:
        raise GroundError(
            f"the vehicle is at {altitude:.0f} m above sea level, does {speed:.2f} m/s and sinks {sinking:.2f} m/s;"
            f" the reference begins at {reference.altitude:.0f} m with {wanted:.2f} and {sink_wanted:.2f} m/s"
            f" (`vehicle_model step` takes --altitude {altitude:.0f} and --airspeed)"
        )


def compare(flown: Response, reference: Reference) -> list[Deviation]:
    """Largest deviations of a flight, at its own times, from the reference, linear between the reference's points.

    theta and q are limited to a hundredth of their largest excursion. A velocity is limited to one quantum of the
    message: rounding takes half of one from each component, which turned by any heading is at most 0.71 quanta.
    """
    inside = (flown.time >= reference.time[0] - 1e-6) & (flown.time <= reference.time[-1] + 1e-6)
    times = flown.time[inside]
    found: list[Deviation] = []
    for name, field, unit in (
        ("theta", "theta", "deg"), ("q", "q", "deg/s"), ("velocity ahead", "ahead", "m/s"),
        ("velocity across", "across", "m/s"), ("velocity down", "down", "m/s"),
    ):  # fmt: skip
        expected = getattr(reference, field)
        deviation = np.abs(getattr(flown, field)[inside] - np.interp(times, reference.time, expected))
        worst = int(deviation.argmax())
        if unit == "m/s":
            limit, reason = VELOCITY_QUANTUM, "one quantum of the message"
        else:
            limit, reason = ANGLE_SHARE * float(np.abs(expected - expected[0]).max()), "1 % of its peak"
        found.append(Deviation(name, unit, float(deviation[worst]), float(times[worst]), limit, reason))
    return found
