"""Compiles the numeric core ahead of time, so that nobody waits later: `python -m vehicle_model.warm`.

Each function below calls entry points of the core the way users of the package do, on the paper's aircraft: Numba
compiles for the types of the arguments, and a read-only array, a record or an integer are types of their own.
"""

import shutil
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from vehicle_model.aircraft import Aircraft, load_aircraft
from vehicle_model.atmosphere import air_density, atmosphere, geopotential_height
from vehicle_model.battery import battery_step, make_battery
from vehicle_model.compiled import CACHE_FOLDER, WARM_MARK, is_warm
from vehicle_model.earth import (
    geodetic,
    gravitation,
    height_above_ellipsoid,
    local_axes,
    make_environment,
    ned_from_geodetic,
)
from vehicle_model.elevator_step import stepped_controls
from vehicle_model.integrate import advance, advance_ab2, advance_batch, observe, rk4_step, time_history
from vehicle_model.linearise import linearise
from vehicle_model.records import OUTPUTS
from vehicle_model.rotation import (
    body_to_ned,
    cross,
    euler_from_quaternion,
    ned_to_body,
    quaternion_conjugate,
    quaternion_from_euler,
    quaternion_multiply,
    quaternion_normalise,
    quaternion_rate,
)
from vehicle_model.state import STATE_COUNT, blank_controls, blank_state
from vehicle_model.trim import trim_level
from vehicle_model.wind import make_wind, wind_step

__all__ = ["main", "warm_up"]

KEPT_FOLDERS = 16  # caches of other sources that stay: of other checkouts, branches and versions


def _flight(aircraft: Aircraft, environment: np.ndarray) -> None:
    """Stepping, observing and recording one vehicle."""
    state, controls, vehicle = blank_state(), blank_controls(), aircraft.vehicle
    advance(state, controls, vehicle, environment, 0.001, 1)
    rk4_step(state, controls, vehicle, environment, 0.001)
    observe(state, controls, vehicle, environment, np.zeros(1, OUTPUTS), np.empty(STATE_COUNT))
    time_history(state, controls[np.newaxis], vehicle, environment, 0.001, 1, np.empty((1, STATE_COUNT)))


def _batches(aircraft: Aircraft, environment: np.ndarray) -> None:
    """Many vehicles, and the cheaper integrator."""
    state, controls, vehicle = blank_state(), blank_controls(), aircraft.vehicle
    advance_ab2(state, controls, vehicle, environment, 0.001, 2)
    advance_batch(state[np.newaxis], controls[np.newaxis], vehicle, environment, 0.001, 1)


def _analysis(aircraft: Aircraft, environment: np.ndarray) -> None:
    """Trim, linear models and the elevator step; they also call compiled functions on single records."""
    del environment  # trim brings its own still air
    trim = trim_level(aircraft, 30.0)
    linearise(aircraft, trim, "throttle")
    linearise(aircraft, trim, "power")
    stepped_controls(aircraft, trim, 0.01)


def _surroundings(aircraft: Aircraft, environment: np.ndarray) -> None:
    """What changes slowly around the equations of motion: battery and wind."""
    battery_step(make_battery(aircraft.battery), aircraft.vehicle.copy(), np.zeros(1, OUTPUTS), 0.001)
    wind_step(make_wind(), 0.0, 10.0, 20.0, 0.001, environment)


def _geometry(aircraft: Aircraft, environment: np.ndarray) -> None:
    """Rotations, places on the Earth and the air, one at a time."""
    del aircraft
    quaternion = quaternion_from_euler(0.1, 0.2, 0.3)
    euler_from_quaternion(*quaternion)
    quaternion_multiply(*quaternion, *quaternion_conjugate(*quaternion))
    quaternion_normalise(*quaternion)
    quaternion_rate(*quaternion, 0.1, 0.2, 0.3)
    cross(body_to_ned(*quaternion, 1.0, 2.0, 3.0), ned_to_body(*quaternion, 1.0, 2.0, 3.0))
    record = environment[0]
    ned_from_geodetic(*geodetic(1.0, 2.0, 3.0, record), record)
    local_axes(1.0, 2.0, 3.0, record)
    gravitation(1.0, 2.0, 3.0, record)
    height_above_ellipsoid(1.0, 2.0, 3.0, record)
    atmosphere(100.0)
    air_density(geopotential_height(100.0))


STAGES = (
    ("flight", _flight),
    ("batches", _batches),
    ("trim and linear models", _analysis),
    ("battery and wind", _surroundings),
    ("rotations, Earth and air", _geometry),
)


def warm_up(report: Callable[[str], None] | None = None) -> None:
    """Compile every entry point into the cache and mark it complete; at once when that was done before.

    `report` is given a line before each stage, for a person who waits.
    """
    if is_warm():
        return
    aircraft = load_aircraft()
    environment = make_environment("wgs84", latitude=0.8, longitude=0.1, height_ellipsoid=0.0)
    for number, (name, stage) in enumerate(STAGES, 1):
        if report:
            report(f"compiling for this machine, once: {name} ({number} of {len(STAGES)})")
        stage(aircraft, environment)
    if CACHE_FOLDER is not None:
        (CACHE_FOLDER / WARM_MARK).touch()
        _forget_old_folders(CACHE_FOLDER)


def _forget_old_folders(current: Path) -> None:
    """Remove the caches of earlier sources, all but the newest few."""
    others = [folder for folder in current.parent.iterdir() if folder.is_dir() and folder != current]
    others.sort(key=lambda folder: folder.stat().st_mtime, reverse=True)
    for folder in others[KEPT_FOLDERS:]:
        # Another process may be removing it too, or still writing there: what stays goes next time.
        shutil.rmtree(folder, ignore_errors=True)


def main() -> None:
    """Warm the cache, saying so on standard error when it takes a while."""
    if is_warm():
        return
    begin = time.perf_counter()
    warm_up(lambda line: print(line, file=sys.stderr, flush=True))
    print(f"compiled in {time.perf_counter() - begin:.0f} s into {CACHE_FOLDER}", file=sys.stderr)


if __name__ == "__main__":
    main()
