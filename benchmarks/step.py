"""One integration step of one vehicle against JSBSim's C172, and a batch of ten thousand vehicles.

Times are CPU time of this process on one core. Ours and the peer's are measured in turns, a few milliseconds each, so
that a busy or throttled machine slows both; the ratio is the median of the ratios of neighbours.
"""

import os
import statistics
import tempfile
from collections.abc import Callable
from functools import partial
from typing import Literal

import jsbsim
import numpy as np
from figures import Figure, cpu_time

from vehicle_model.aircraft import load_aircraft
from vehicle_model.earth import make_environment
from vehicle_model.integrate import advance, advance_ab2, advance_batch, rk4_step
from vehicle_model.trim import Trim, trim_level

__all__ = ["measure"]

ROUNDS = 40
CALLS = 1000
DT = 0.0025
BATCH = 10_000


def cessna() -> Callable[[], object]:
    """The step of JSBSim's C172 in the cruise that ships with it as a script: autopilot on, engine running."""
    os.environ["JSBSIM_DEBUG"] = "0"
    fdm = jsbsim.FGFDMExec(None)
    with tempfile.TemporaryDirectory() as folder:  # the model opens a file for its own output
        fdm.set_output_path(folder)
        fdm.load_script("scripts/c172_cruise_8K.xml")
        if not fdm.run_ic():
            raise RuntimeError("JSBSim could not start its script c172_cruise_8K")
    fdm.disable_output()
    for _ in range(3000):  # past the script's gusts and changes of set point
        fdm.run()
    if not 3500.0 < fdm["position/h-sl-ft"] < 9000.0:
        raise RuntimeError("JSBSim's C172 does not hold its altitude: the figure would not be one of cruise")
    return fdm.run


def measure() -> list[Figure]:
    """One step called from Python beside JSBSim's, the step inside compiled code, and the batch."""
    aircraft = load_aircraft()
    trim = trim_level(aircraft, 20.0)
    flat, single = against_peer(aircraft.vehicle, trim, world("flat"))
    curved, _ = against_peer(aircraft.vehicle, trim, world("wgs84"))
    figures = [*flat, *curved]
    for name, stepper in (("RK4", advance), ("Adams-Bashforth 2", advance_ab2)):
        state = trim.state.copy()
        arguments = (state, trim.controls, aircraft.vehicle, world("flat"), DT)
        stepper(*arguments, 1)
        each = statistics.median(cpu_time(partial(stepper, *arguments, CALLS), 1) / CALLS for _ in range(ROUNDS))
        figures.append(Figure(f"{name} steps a second inside compiled code", 1.0 / each, "1/s"))
    figures.append(batch(trim.state, trim.controls, aircraft.vehicle, world("flat"), single))
    return figures


def world(earth: Literal["flat", "wgs84"]) -> np.ndarray:
    """The flight's surroundings: some height, some wind."""
    return make_environment(
        earth, latitude=0.8273, longitude=0.1492, height_ellipsoid=500.0, wind_ned=(3.0, -2.0, 0.0), ground_height=0.0
    )


def against_peer(vehicle: np.ndarray, trim: Trim, environment: np.ndarray) -> tuple[list[Figure], float]:
    """A step called from Python and its ratio to JSBSim's; and our steps per second."""
    is_flat = environment["earth"][0] == 0  # as in the paper and in the process unless told otherwise
    earth = "flat Earth" if is_flat else "WGS-84"
    state = trim.state.copy()
    ours, theirs = partial(rk4_step, state, trim.controls, vehicle, environment, DT), cessna()
    ours()
    own, peer = [], []
    for _ in range(ROUNDS):
        state[:] = trim.state
        own.append(cpu_time(ours, CALLS))
        peer.append(cpu_time(theirs, CALLS))
    ratio = statistics.median(b / a for a, b in zip(own, peer, strict=True))
    mine = statistics.median(own)
    return [
        Figure(f"RK4 step, full vehicle, {earth}, called from Python", mine * 1e6, "us", at_most=True,
               peer="JSBSim c172_cruise_8K", peer_value=statistics.median(peer) * 1e6),
        Figure(f"times faster than JSBSim's C172 step, {earth} (median of pairs)", ratio, "x",
               goal=3.5 if is_flat else None),
    ], 1.0 / mine  # fmt: skip


def batch(
    state: np.ndarray, controls: np.ndarray, vehicle: np.ndarray, environment: np.ndarray, single: float
) -> Figure:
    """Vehicle-steps per second and core of ten thousand vehicles that all fly differently."""
    random = np.random.default_rng(1)
    states = np.tile(state, (BATCH, 1))
    states[:, 3:6] += random.normal(0.0, 1.0, (BATCH, 3))
    states[:, 10:13] += random.normal(0.0, 0.05, (BATCH, 3))
    commands = np.tile(controls, (BATCH, 1))
    advance_batch(states, commands, vehicle, environment, DT, 1)
    steps = 4
    each = statistics.median(
        cpu_time(lambda: advance_batch(states, commands, vehicle, environment, DT, steps), 1) / (BATCH * steps)
        for _ in range(10)
    )
    if not np.isfinite(states).all():
        raise RuntimeError("a vehicle of the batch diverged: the figure would not be one of flight")
    return Figure(
        f"batch of {BATCH:,}: RK4 vehicle-steps per second and core", 1.0 / each, "1/s", goal=400_000.0,
        peer="one at a time from Python", peer_value=single,
    )  # fmt: skip
