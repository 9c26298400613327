"""An airframe under its laws and a Demand, flown by the tests of this folder, and what it did."""

import functools
import math
from collections.abc import Callable, Sequence

import numpy as np

from sitl.airframe import Airframe
from sitl.control.design import Design, design_for
from sitl.control.design_names import LOWEST_FORCE
from sitl.flight.demand import Demand
from sitl.start import trimmed
from vehicle_model.aircraft import Aircraft, load_aircraft
from vehicle_model.earth import make_environment
from vehicle_model.wind import Gust, make_wind

__all__ = ["PERIOD", "RATE", "Flown", "aircraft", "at_a_limit", "design", "turned"]

RATE = 400  # [Hz]
EVERY = 8  # ticks between two rows of the history
PERIOD = EVERY / RATE  # [s]

ROW = np.dtype(
    [
        ("time", float),  # [s]
        ("position", float, (3,)),  # NED from home [m]
        ("velocity", float, (3,)),  # [m/s]
        ("euler", float, (3,)),  # roll, pitch, yaw [rad]
        ("rates", float, (3,)),  # [rad/s]
        ("airspeed", float),  # [m/s]
        ("tilt", float),  # [rad]
        ("throttle", float, (3,)),  # left, right, tail
        ("rotor_speed", float, (3,)),  # [rad/s]
        ("surface", float, (3,)),  # aileron left and right, elevator [rad]
        ("margin", float),  # least stall margin of the wing's strips [rad]
        ("wetted_margin", float),  # of those in the slipstream
        ("power", float),  # electrical, of all motors [W]
        ("forward", float),  # airspeed along the body, as the laws have it [m/s]
        ("lowest_force", float),  # forward, per mass, that level flight bears there [m/s^2]
    ]
)


@functools.cache
def aircraft() -> Aircraft:
    """The aircraft of all tests."""
    return load_aircraft()


@functools.cache
def design() -> Design:
    """Its laws."""
    return design_for(aircraft())


class Flown:
    """Trimmed level flight at a true airspeed [m/s], height above home [m] and heading [rad], then as `demand` says."""

    def __init__(
        self, airspeed: float = 0.0, *, height: float = 100.0, heading: float = 0.0,
        wind: tuple[float, float, float] = (0.0, 0.0, 0.0), roughness: float = 0.0, gusts: Sequence[Gust] = (),
    ) -> None:  # fmt: skip
        environment = make_environment("flat", latitude=0.8, longitude=0.1, height_ellipsoid=488.0, wind_ned=wind)
        start = trimmed(aircraft(), environment, airspeed, heading, height=height)
        air = make_wind(wind, roughness=roughness, gusts=gusts)
        self.airframe = Airframe(aircraft(), environment, start.state, start.controls, wind=air, design=design())
        self.demand = Demand()
        self.airframe.setpoint = self.demand.record
        wing = aircraft().vehicle[0]["surfaces"]["tilts"] == 1
        self._wing = np.flatnonzero(wing)
        self._wetted = np.flatnonzero(wing & (aircraft().vehicle[0]["surfaces"]["rotor"] >= 0))
        self._rows: list[np.ndarray] = []

    @property
    def time(self) -> float:
        """Simulated [s]."""
        return self.airframe.time

    @property
    def now(self) -> np.void:
        """The last row of the history."""
        return self._rows[-1][0]

    def fly(self, seconds: float) -> None:
        """Go on, keeping a row every PERIOD."""
        for _ in range(round(seconds / PERIOD)):
            self.airframe.advance(EVERY)
            self._keep()

    def until(self, condition: Callable[[np.void], bool], timeout: float) -> float:
        """Go on until a row is as wanted; returns the time that took [s] and fails beyond `timeout` [s]."""
        start = self.time
        while self.time < start + timeout:
            self.fly(PERIOD)
            if condition(self.now):
                return self.time - start
        last = {name: self.now[name].tolist() for name in ROW.names or ()}
        raise AssertionError(f"not within {timeout} s, at {last}")

    def history(self, since: float = 0.0) -> np.ndarray:
        """Rows (n,) of ROW after a time [s]."""
        rows = np.concatenate(self._rows)
        return rows[rows["time"] > since + 0.5 / RATE]

    def _keep(self) -> None:
        seen, status, row = self.airframe.snapshot(), self.airframe.status[0], np.empty(1, ROW)
        margin = seen.outputs["stall_margin"]
        row[0] = (
            seen.time, seen.position_ned, seen.velocity_ned, (seen.roll, seen.pitch, seen.yaw), seen.rates,
            seen.airspeed, seen.tilt, seen.controls[:3], seen.state[13:16], seen.state[17:20],
            margin[self._wing].min(), margin[self._wetted].min(), seen.outputs["electrical_power"].sum(),
            status["airflow_forward"], status["schedule"][LOWEST_FORCE],
        )  # fmt: skip
        self._rows.append(row)


def turned(angle: np.ndarray, towards: float) -> np.ndarray:
    """Angles less `towards` [rad], within half a turn of zero."""
    return (angle - towards + math.pi) % (2.0 * math.pi) - math.pi


def at_a_limit(history: np.ndarray) -> dict[str, float]:
    """Longest time [s] that each actuator but the tilt stayed within 0.1 % of an end of its travel."""
    servos = aircraft().vehicle[0]["servos"]
    throttle, surface = history["throttle"], history["surface"]
    full = {
        "throttle_left": (throttle[:, 0] <= 0.0) | (throttle[:, 0] >= 0.999),
        "throttle_right": (throttle[:, 1] <= 0.0) | (throttle[:, 1] >= 0.999),
        "throttle_tail": np.abs(throttle[:, 2]) >= 0.999,
    }
    for k, name in enumerate(("aileron_left", "aileron_right", "elevator")):
        low, high = float(servos["minimum"][1 + k]), float(servos["maximum"][1 + k])
        full[name] = (surface[:, k] >= 0.999 * high) | (surface[:, k] <= 0.999 * low)
    return {name: longest(condition) * PERIOD for name, condition in full.items()}


def longest(condition: np.ndarray) -> int:
    """Length of the longest run of True."""
    ends = np.flatnonzero(np.diff(np.concatenate([[0], condition.astype(int), [0]])))
    return int((ends[1::2] - ends[::2]).max()) if ends.size else 0
