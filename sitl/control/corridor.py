"""The flying code at points of the corridor from hover to cruise: settled, differentiated, its loops opened.

Nothing is modelled twice: plant and laws are the compiled functions that fly. At each point the closed loop flies
until it has settled, then both are differentiated there, memory of the laws included.
"""

import functools
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np

from sitl.control.design import Design
from sitl.control.laws import control_step
from sitl.control.linear import (
    AIRFLOW,
    CHART,
    ClosedLoop,
    LinearSystem,
    chart_from_state,
    chart_steps,
    close_loop,
    differentiate,
    linear_plant,
    margins_of,
)
from sitl.control.margins import Margins
from sitl.control.records import ESTIMATE, MEMORY, NO_LEVEL, SETPOINT, STATUS, Horizontal, Level, Vertical, Yaw
from sitl.control.translation import LEAST_LACK
from sitl.control.truth import true_estimate
from vehicle_model.aircraft import Aircraft
from vehicle_model.compiled import compiled_loop
from vehicle_model.dynamics import derivative
from vehicle_model.force_columns import COLUMNS
from vehicle_model.force_map import stall_speed
from vehicle_model.integrate import rk4_step
from vehicle_model.records import OUTPUTS
from vehicle_model.rotation import quaternion_from_euler
from vehicle_model.state import CONTROL_COUNT, CONTROL_NAMES, QUATERNION, RATES, ROTOR_SPEED, VELOCITY
from vehicle_model.trim import TrimError, still_air, trim_level

__all__ = ["CLIMBS", "CorridorFlight", "PointAnalysis", "airspeeds", "analyse", "analyse_point", "corridor"]

RATE = 400  # [Hz]
DELAY = 1  # a command acts so many ticks after the estimate it is made of (`fly`), and is held for one
SETTLING = 20.0  # [s]
AIRSPEED_STEP = 1.0 / 8.55  # over the stall speed
AIRSPEED_COUNT = 17
TRANSITION = (5, 9)  # steps between which airspeeds are closer together
CLIMBS = (-2.0, 0.0, 2.0)  # [m/s]
SETTLED = 0.01  # [m/s^2, rad/s^2]
SPEED_HELD, CLIMB_HELD = 1.0, 0.2  # [m/s]
NEUTRAL = 1e-3  # growth [1/s] that counts as none
COARSE = 30  # frequencies per decade
FAR = 1e5  # ends of legs [m]

# What the laws read, as the plant's coordinates name it, and what they remember.
READS = (*CHART, *AIRFLOW)
MEMORIES = tuple(f"{name}{i}" for name in MEMORY.names or () for i in range(np.zeros(1, MEMORY)[name][0].size))
REACHED = tuple(COLUMNS.index(name) for name in ("force_forward", "force_down"))
MEMORY_STEP = 1e-4  # m/s, m/s^2, rad, N


@dataclass(frozen=True)
class PointAnalysis:
    """The loops at one point of the corridor."""

    airspeed: float  # [m/s]
    climb: float  # [m/s]
    flown: tuple[float, float]  # ground speed and climb after settling [m/s]
    plant: LinearSystem
    loop: ClosedLoop
    margins: dict[str, Margins]  # by signal
    lack: float  # of force per mass, forward or down, for what the laws ask for [m/s^2]
    unsettled: float  # largest acceleration, linear [m/s^2] or angular [rad/s^2], left after settling
    deviation: float  # largest of the laws' differences, see `differentiate`

    @functools.cached_property
    def actuators_disk(self) -> float:
        """Disk margin of all actuators at once."""
        return margins_of(self.loop, [CONTROL_NAMES])[1][0]

    @property
    def held(self) -> bool:
        """It settled at what was asked, with the force for it; elsewhere the laws keep it off a stall or a limit."""
        speed, climb = self.flown
        settled = self.unsettled < SETTLED and self.lack < LEAST_LACK
        return settled and abs(speed - self.airspeed) < SPEED_HELD and abs(climb - self.climb) < CLIMB_HELD

    @property
    def stable(self) -> bool:
        """No pole grows; altitude, which nothing but the air's density holds where a rate is flown, is no such."""
        return self.loop.growth < NEUTRAL


@compiled_loop
def fly(
    state, controls, following, vehicle, environment, estimates, setpoints, gains, table, axes, schedule, believed,
    memories, statuses, dt: float, ticks: int,
) -> None:  # fmt: skip
    """Fly the closed loop in place; `controls` (7,) are in force, `following` (7,) come next, as in flight."""
    for _ in range(ticks):
        true_estimate(state, vehicle, environment, estimates)
        controls[:] = following
        control_step(estimates, setpoints, gains, table, axes, schedule, believed, memories, statuses, following, dt)
        rk4_step(state, controls, vehicle, environment, dt)


class CorridorFlight:
    """One aircraft under its laws at one point: an airspeed and a climb rate [m/s] in still air."""

    def __init__(self, aircraft: Aircraft, design: Design, airspeed: float, climb: float) -> None:
        self.airspeed, self.climb = airspeed, climb
        self.vehicle, self.design, self.environment = aircraft.vehicle, design, still_air()
        self.estimate, self.setpoint = np.zeros(1, ESTIMATE), np.zeros(1, SETPOINT)
        self.memory, self.status = np.zeros(1, MEMORY), np.zeros(1, STATUS)
        self.memory["level"] = NO_LEVEL
        trim = trim_level(aircraft, airspeed)
        self.state, self.controls, self.following = trim.state.copy(), trim.controls.copy(), trim.controls.copy()
        task = self.setpoint[0]
        task["level"], task["yaw"], task["thrust_limit"] = Level.VELOCITY, Yaw.COURSE, 1.0
        task["horizontal"] = Horizontal.LEG if airspeed else Horizontal.POINT
        task["vertical"] = Vertical.RATE if climb else Vertical.ALTITUDE
        task["position_ned"] = (FAR if airspeed else 0.0, 0.0, 0.0)
        task["velocity_ned"] = (0.0, 0.0, -climb)
        task["cruise"], task["speed"] = airspeed >= design.gains["wing_borne_at"][0], airspeed
        task["climb_rate"], task["sink_rate"], task["max_bank"] = 5.0, 5.0, np.radians(35.0)

    def fly(self, ticks: int) -> None:
        """Fly so many ticks."""
        design = self.design
        fly(
            self.state, self.controls, self.following, self.vehicle, self.environment, self.estimate, self.setpoint,
            design.gains, design.table, design.axes, design.schedule, design.vehicle, self.memory, self.status,
            1.0 / RATE, ticks,
        )  # fmt: skip

    def settle(self) -> float:
        """Fly until settled; returns the largest acceleration left [m/s^2, rad/s^2]."""
        self.fly(round(SETTLING * RATE))
        true_estimate(self.state, self.vehicle, self.environment, self.estimate)
        rate = np.empty(self.state.size)
        derivative(self.state, self.controls, self.vehicle, self.environment, np.zeros(1, OUTPUTS), rate)
        return float(np.abs(np.concatenate([rate[VELOCITY:QUATERNION], rate[RATES:ROTOR_SPEED]])).max())

    def linear_laws(self, design: Design | None = None) -> tuple[LinearSystem, float]:
        """The laws' next memory and controls, about the settled point; and how far from straight they are."""
        design = design or self.design
        estimate, memory = self.estimate.copy(), self.memory.copy()
        controls = np.empty(CONTROL_COUNT)
        remembered = memory.view(np.float64)
        steps = np.concatenate([np.full(len(MEMORIES), MEMORY_STEP), chart_steps(), np.full(len(AIRFLOW), MEMORY_STEP)])
        # The level is a name, not a quantity.
        moving = np.array([not name.startswith("level") for name in (*MEMORIES, *READS)])

        def tick(moved: np.ndarray) -> np.ndarray:
            z = at.copy()
            z[moving] = moved
            remembered[:] = z[: len(MEMORIES)]
            _fill(estimate, z[len(MEMORIES) :])
            control_step(
                estimate, self.setpoint, design.gains, design.table, design.axes, design.schedule, design.vehicle,
                memory, self.status, controls, 1.0 / RATE,
            )  # fmt: skip
            return np.concatenate([remembered[moving[: len(MEMORIES)]], controls])

        airflow = self.estimate[0]["velocity_ned"] - self.estimate[0]["wind_ned"]
        at = np.concatenate([self.memory.view(np.float64), chart_from_state(self.state), airflow])
        jacobian, deviation = differentiate(tick, at[moving], steps[moving])
        n = len(jacobian) - CONTROL_COUNT
        laws = LinearSystem(
            jacobian[:n, :n], jacobian[:n, n:], jacobian[n:, :n], jacobian[n:, n:], READS, CONTROL_NAMES
        )
        return laws, float(deviation.max())

    def analyse(self) -> PointAnalysis:
        """Settle, and open the loops."""
        unsettled = self.settle()
        plant = linear_plant(self.vehicle, self.environment, self.state, self.controls, 1.0 / RATE)
        laws, deviation = self.linear_laws()
        loop = close_loop(plant, laws, 1.0 / RATE, delay=DELAY)
        north, east, down = (float(v) for v in self.estimate["velocity_ned"][0])
        flown = (math.hypot(north, east), -down)
        reached, asked = self.status[0]["node"][list(REACHED)], self.status[0]["force_demand"]
        lack = float(np.abs(reached - asked).max())
        margins, _ = margins_of(loop)
        return PointAnalysis(self.airspeed, self.climb, flown, plant, loop, margins, lack, unsettled, deviation)

    def reopened(self, point: PointAnalysis, design: Design) -> PointAnalysis:
        """The loops that another design would have where this one settled: gains do not move a point of rest.

        Fewer frequencies are looked at, for speed.
        """
        laws, deviation = self.linear_laws(design)
        loop = close_loop(point.plant, laws, 1.0 / RATE, delay=DELAY)
        margins, _ = margins_of(loop, per_decade=COARSE)
        return replace(point, loop=loop, margins=margins, deviation=deviation)


def _fill(estimate: np.ndarray, reads: np.ndarray) -> None:
    """An ESTIMATE of what the laws read, in the order of READS."""
    e = estimate[0]
    e["position_ned"], e["velocity_ned"], e["euler"], e["rates"] = reads[:3], reads[3:6], reads[6:9], reads[9:12]
    e["quaternion"] = quaternion_from_euler(*reads[6:9])
    e["rotor_speed"], e["servo"] = reads[12:15], reads[15:19]
    # The wind is what the airflow leaves of the motion, as an estimator would find it.
    e["wind_ned"], e["airspeed"] = reads[3:6] - reads[19:22], np.linalg.norm(reads[19:22])


def analyse_point(aircraft: Aircraft, design: Design, airspeed: float, climb: float) -> PointAnalysis:
    """Settle the flying code at an airspeed and climb rate [m/s] in still air, and open its loops."""
    return CorridorFlight(aircraft, design, airspeed, climb).analyse()


def airspeeds(aircraft: Aircraft, closer: int = 2) -> tuple[float, ...]:
    """Airspeeds [m/s] of an aircraft's corridor: from hover to 1.9 times its stall speed, as far as it can be trimmed.

    In the transition, where loops change most, they are `closer` times as close together.
    """
    first, last = TRANSITION
    steps = {float(k) for k in range(AIRSPEED_COUNT)} | {first + k / closer for k in range((last - first) * closer)}
    stall = stall_speed(aircraft)
    speeds = (round(k * AIRSPEED_STEP * stall, 1) for k in sorted(steps))
    return tuple(speed for speed in speeds if _can_fly(aircraft, speed))


def _can_fly(aircraft: Aircraft, airspeed: float) -> bool:
    try:
        trim_level(aircraft, airspeed)
    except TrimError:
        return False
    return True


def corridor(aircraft: Aircraft, closer: int = 2) -> list[tuple[float, float]]:
    """Points of an aircraft's corridor: airspeed and climb rate [m/s]; `closer` as for `airspeeds`."""
    return [(airspeed, climb) for airspeed in airspeeds(aircraft, closer) for climb in CLIMBS]


def analyse(
    aircraft: Aircraft, design: Design, watch: Callable[[list[tuple[float, float]]], Iterable[tuple[float, float]]]
) -> list[PointAnalysis]:
    """All points of the corridor; `watch` passes them on and may show progress."""
    return [analyse_point(aircraft, design, airspeed, climb) for airspeed, climb in watch(corridor(aircraft))]
