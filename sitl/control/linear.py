"""Discrete linear models of plant and controller by central differences of the code that flies, and loops made of them.

The loop is y = C x (what the controller reads), u and its memory m from y, then x from u, once a tick:

    x+ = A x + B u,  y = C x        m+ = F m + G y,  u = H m + K y

Every signal of y and u is a place where the loop can be opened. Of the closed loop with a disturbance d added to each
signal on its way, the response T from d to the signals before the additions gives all of them at once: with signal i
opened and all others closed, L_i = 1/(1 + T_ii) - 1, and I + T is the sensitivity of several opened together.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sitl.control.margins import Complexes, Margins, frequency_grid, loop_margins, multiloop_disk_margin
from vehicle_model.integrate import rk4_step
from vehicle_model.rotation import body_to_ned, euler_from_quaternion, ned_to_body, quaternion_from_euler
from vehicle_model.state import (
    CONTROL_NAMES,
    POSITION,
    QUATERNION,
    RATES,
    STATE_COUNT,
    STATE_NAMES,
    VELOCITY,
)

__all__ = [
    "AIRFLOW", "CHART", "ClosedLoop", "LinearSystem", "chart_from_state", "close_loop", "differentiate", "linear_plant",
    "margins_of", "state_from_chart",
]  # fmt: skip

# Coordinates of the plant's state about a point of flight: as sensors see it, and with no constraint between them.
CHART = ("north", "east", "down", "vn", "ve", "vd", "roll", "pitch", "yaw", *STATE_NAMES[RATES:])
AIRFLOW = ("air_north", "air_east", "air_down")  # velocity through the air, as an air-data probe sees it
MOTION, ATTITUDE, REST = 3, 6, 9  # where velocity over the ground, attitude and all else begin
# Large enough to stand out of rounding errors, small enough for the equations to be straight.
_STEPS = {"rotor": 1e-2, "north": 1e-2, "east": 1e-2, "down": 1e-2, "vn": 1e-4, "ve": 1e-4, "vd": 1e-4}
_FINE = 1e-5  # angles, rates, throttles


@dataclass(frozen=True)
class LinearSystem:
    """x+ = A x + B u, y = C x + D u, once a tick; names for its inputs and outputs."""

    a: np.ndarray  # (n, n)
    b: np.ndarray  # (n, m)
    c: np.ndarray  # (p, n)
    d: np.ndarray  # (p, m)
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]


@dataclass(frozen=True)
class ClosedLoop:
    """The closed loop from a disturbance on each of its signals to those signals before it, once every `dt` seconds.

    Only the states that signals can reach and that can reach signals are left in it.
    """

    system: LinearSystem
    dt: float

    @property
    def signals(self) -> tuple[str, ...]:
        """Where the loop can be opened: what the controller reads, then what it commands."""
        return self.system.outputs

    @property
    def poles(self) -> np.ndarray:
        """Eigenvalues per tick; stable within the unit circle."""
        return np.linalg.eigvals(self.system.a)

    @property
    def growth(self) -> float:
        """Real part of the least stable pole in continuous time [1/s]."""
        largest = float(np.abs(self.poles).max(initial=0.0))
        return float(np.log(max(largest, 1e-300)) / self.dt)

    def sensitivity(self, omega: np.ndarray, signals: Sequence[str] | None = None) -> Complexes:
        """S (m, k, k) at m frequencies [rad/s] of the k given signals (default: all) opened together."""
        chosen = [self.signals.index(name) for name in (self.signals if signals is None else signals)]
        system = self.system
        shifted = np.exp(1j * omega * self.dt)[:, None, None] * np.eye(len(system.a)) - system.a
        response = system.c[chosen] @ np.linalg.solve(shifted, system.b[None, :, chosen])
        return np.eye(len(chosen), dtype=np.complex128) + response + system.d[np.ix_(chosen, chosen)]


def differentiate(
    function: Callable[[np.ndarray], np.ndarray], at: np.ndarray, steps: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Jacobian (m, n) of a function of (n,) by central differences with a step for each input.

    Also returns by input (n,) how far the function is from straight, as a share of the column's largest element: the
    difference of the slopes to either side and that to half a step. It is near zero where the function is smooth about
    the point, of order one where a limit or a switch lies within a step.
    """
    columns: list[np.ndarray] = []
    deviation = np.zeros(at.size)
    centre = function(at)
    for j, size in enumerate(steps):
        step = np.zeros(at.size)
        step[j] = size
        above, below = (function(at + step) - centre) / size, (centre - function(at - step)) / size
        column = 0.5 * (above + below)
        finer = (function(at + 0.5 * step) - function(at - 0.5 * step)) / size
        largest = float(np.abs(column).max(initial=0.0))
        if largest > 0.0:
            deviation[j] = np.maximum(np.abs(above - below), np.abs(finer - column)).max() / largest
        columns.append(column)
    return np.column_stack(columns), deviation


def chart_from_state(state: np.ndarray) -> np.ndarray:
    """Coordinates (19,) of a state (20,): NED position, velocity over the ground, roll, pitch, yaw, the rest."""
    quaternion = state[QUATERNION:RATES]
    velocity = body_to_ned(*quaternion, *state[VELOCITY:QUATERNION])
    return np.concatenate([state[POSITION:VELOCITY], velocity, euler_from_quaternion(*quaternion), state[RATES:]])


def state_from_chart(chart: np.ndarray) -> np.ndarray:
    """State (20,) at coordinates (19,); the inverse of `chart_from_state`."""
    state = np.empty(STATE_COUNT)
    quaternion = quaternion_from_euler(*chart[ATTITUDE:REST])
    state[POSITION:VELOCITY] = chart[:MOTION]
    state[VELOCITY:QUATERNION] = ned_to_body(*quaternion, *chart[MOTION:ATTITUDE])
    state[QUATERNION:RATES] = quaternion
    state[RATES:] = chart[REST:]
    return state


def chart_steps() -> np.ndarray:
    """Differencing steps (19,) of the coordinates [m, m/s, rad, rad/s]."""
    return np.array([_STEPS.get(name.split("_")[0], _FINE) for name in CHART])


def linear_plant(
    vehicle: np.ndarray, environment: np.ndarray, state: np.ndarray, controls: np.ndarray, dt: float
) -> LinearSystem:
    """One tick of the vehicle with the controls held, about a state (20,) and controls (7,), in the coordinates CHART.

    Outputs are the coordinates and the velocity through the air, NED [m/s].
    Nothing depends on where the vehicle is, so the point need not
    be one of rest: steady flight in any direction will do. Heading must be where roll, pitch and yaw are defined.
    """

    def tick(x: np.ndarray) -> np.ndarray:
        moved = state_from_chart(x[: len(CHART)])
        rk4_step(moved, x[len(CHART) :], vehicle, environment, dt)
        return chart_from_state(moved)

    chart = chart_from_state(state)
    steps = np.concatenate([chart_steps(), np.full(len(controls), _FINE)])
    jacobian, _ = differentiate(tick, np.concatenate([chart, controls]), steps)
    a, b = jacobian[:, : len(CHART)], jacobian[:, len(CHART) :]
    c = np.vstack([np.eye(len(CHART)), np.eye(len(CHART))[MOTION:ATTITUDE]])  # the wind is steady
    d = np.zeros((len(c), len(controls)))
    return LinearSystem(a, b, c, d, CONTROL_NAMES, (*CHART, *AIRFLOW))


def close_loop(plant: LinearSystem, controller: LinearSystem, dt: float, *, delay: int = 0) -> ClosedLoop:
    """Plant and controller as one loop; `delay` more ticks pass between the controller and the actuators.

    With no delay a command made of the state at a tick acts until the next tick. Raises ValueError unless the plant's
    outputs are the controller's inputs and the other way round, and the plant has no direct feedthrough.
    """
    if plant.outputs != controller.inputs or controller.outputs != plant.inputs:
        raise ValueError(
            f"closed loop: expected the controller from {plant.outputs} to {plant.inputs}, got one from "
            f"{controller.inputs} to {controller.outputs}"
        )
    if plant.d.any():
        raise ValueError("closed loop: expected a plant whose outputs follow from its state alone, got feedthrough")
    # What the controller does not read is no place to open the loop, and must not keep its states in it.
    read = np.flatnonzero(controller.b.any(axis=0) | controller.d.any(axis=0))
    plant = replace(plant, c=plant.c[read], outputs=tuple(plant.outputs[i] for i in read))
    controller = replace(controller, b=controller.b[:, read], d=controller.d[:, read], inputs=plant.outputs)
    n, m = len(plant.a), len(controller.a)
    reads, commands = len(plant.outputs), len(plant.inputs)
    # States: plant, memory, then the commands on their way, the one that acts now first.
    size = n + m + delay * commands
    a, b = np.zeros((size, size)), np.zeros((size, reads + commands))
    c, d = np.zeros((reads + commands, size)), np.zeros((reads + commands, reads + commands))
    c[:reads, :n] = plant.c
    made = np.zeros((commands, size))  # what the controller commands, made of the state
    made[:, :n], made[:, n : n + m] = controller.d @ plant.c, controller.c
    acts = made
    if delay:
        queue = np.eye(size)[n + m :]
        acts = queue[:commands]
        a[n + m : size - commands] = queue[commands:]
        a[size - commands :] = made
        b[size - commands :, :reads] = controller.d
    c[reads:] = acts
    a[:n, :n] = plant.a
    a[:n] += plant.b @ acts
    b[:n, reads:] = plant.b
    a[n : n + m, :n], a[n : n + m, n : n + m] = controller.b @ plant.c, controller.a
    b[n : n + m, :reads] = controller.b
    if not delay:
        b[:n, :reads] = plant.b @ controller.d
        d[reads:, :reads] = controller.d
    kept = _connected(a, b, c)
    signals = plant.outputs + plant.inputs
    return ClosedLoop(LinearSystem(a[np.ix_(kept, kept)], b[kept], c[:, kept], d, signals, signals), dt)


def _connected(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Indices of the states that an input can reach and that can reach an output."""
    paths = a != 0.0
    reached, reaching = (b != 0.0).any(axis=1), (c != 0.0).any(axis=0)
    for _ in range(len(a)):
        reached = reached | paths[:, reached].any(axis=1)
        reaching = reaching | paths[reaching].any(axis=0)
    return np.flatnonzero(reached & reaching)


def margins_of(
    loop: ClosedLoop, groups: Sequence[Sequence[str]] = (), *, per_decade: int = 80
) -> tuple[dict[str, Margins], list[float]]:
    """Margins of the loop opened at each of its signals, and the disk margin of each group of them at once.

    `per_decade` is how many frequencies are looked at, beside those about the poles.
    """
    omega = frequency_grid(loop.dt, loop.poles, per_decade)
    sensitivity = loop.sensitivity(omega)
    places = {name: i for i, name in enumerate(loop.signals)}
    single = {name: loop_margins(omega, 1.0 / sensitivity[:, i, i] - 1.0, loop.dt) for name, i in places.items()}
    chosen = [[places[name] for name in group] for group in groups]
    return single, [multiloop_disk_margin(sensitivity[:, group][:, :, group]) for group in chosen]
