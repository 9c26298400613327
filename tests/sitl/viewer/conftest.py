"""A short real flight, and a reader for what a recording holds of it."""

import math
import os
import signal
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from sitl.airframe import Airframe
from sitl.snapshot import Snapshot
from sitl.viewer import Viewer, open_viewer
from vehicle_model.aircraft import Aircraft, load_aircraft
from vehicle_model.earth import make_environment
from vehicle_model.state import CONTROL_NAMES, POSITION
from vehicle_model.trim import trim_level

Columns = dict[str, np.ndarray]


@pytest.fixture(scope="session")
def aircraft() -> Aircraft:
    return load_aircraft()


@pytest.fixture(scope="session")
def flight(aircraft: Aircraft) -> list[Snapshot]:
    """Three seconds at 50 Hz, 60 m up in a wind, in which everything moves: tilt, flaps, rotors, attitude."""
    environment = make_environment(
        "flat",
        latitude=math.radians(47.4),
        longitude=math.radians(8.5),
        height_ellipsoid=488.0,
        wind_ned=(2.0, -3.0, 0.5),
    )
    trim = trim_level(aircraft, 12.0)
    state = trim.state.copy()
    state[POSITION : POSITION + 3] = [40.0, -25.0, -60.0]
    airframe = Airframe(aircraft, environment, state, trim.controls, drains=False)
    snapshots = [airframe.snapshot()]
    for step in range(150):
        controls = trim.controls.copy()
        controls[CONTROL_NAMES.index("tilt")] += 0.1 * math.sin(step / 20.0)
        controls[CONTROL_NAMES.index("aileron_left")] += 0.05 * math.sin(step / 10.0)
        controls[CONTROL_NAMES.index("aileron_right")] -= 0.03 * math.sin(step / 10.0)
        controls[CONTROL_NAMES.index("elevator")] += 0.02
        airframe.set_controls(controls)
        airframe.advance(8)
        snapshots.append(airframe.snapshot())
    return snapshots


@pytest.fixture(scope="session")
def recorded(
    aircraft: Aircraft, flight: list[Snapshot], tmp_path_factory: pytest.TempPathFactory
) -> dict[str, Columns]:
    """The flight as a saved recording gives it back."""
    file = tmp_path_factory.mktemp("viewer") / "flight.rrd"
    viewer = open_viewer(f"save:{file}", aircraft, map=False)
    for index, snapshot in enumerate(flight):
        viewer.offer(snapshot)
        if index == 50:
            viewer.text(4, "fifty")
    viewer.close(deadline=30.0)
    assert viewer.dropped == 0
    return _read(file)


@pytest.fixture(scope="session")
def read_recording() -> Callable[[Path], dict[str, Columns]]:
    """Reads a recording: entity path -> column name -> values over all rows."""
    return _read


def _read(file: Path) -> dict[str, Columns]:
    """Entity path -> column name -> values over all rows; lists per row are joined to (rows, ...) arrays."""
    from rerun.chunk import RrdReader

    pieces: dict[str, dict[str, list[np.ndarray]]] = {}
    for chunk in RrdReader(file).stream():
        batch = chunk.to_record_batch()
        entity = pieces.setdefault(chunk.entity_path, {})
        for name in batch.schema.names:
            if name != "rerun.controls.RowId":
                entity.setdefault(name, []).append(_plain(batch.column(name)))
    return {path: {name: _joined(parts) for name, parts in entity.items()} for path, entity in pieces.items()}


def _joined(parts: list[np.ndarray]) -> np.ndarray:
    """Blocks of rows as one array; flat where the rows differ in length, as pieces of the trail do."""
    alike = len({part.shape[1:] for part in parts}) == 1
    return np.concatenate(parts if alike else [part.ravel() for part in parts])


def _plain(column) -> np.ndarray:
    """Arrow column as an array: rows first, then components per row, then vector elements."""
    import pyarrow as pa

    if pa.types.is_duration(column.type) or pa.types.is_timestamp(column.type):
        return column.cast(pa.int64()).to_numpy() * 1e-9
    shape = [len(column)]
    while pa.types.is_list(column.type) or pa.types.is_fixed_size_list(column.type):
        column = column.flatten()
        shape.append(len(column) // max(1, math.prod(shape)))
    values = np.array(column.to_pylist()) if pa.types.is_string(column.type) else column.to_numpy(zero_copy_only=False)
    return values.reshape(shape) if values.size == math.prod(shape) else values


@pytest.fixture(scope="session")
def wait_until() -> Callable[[Callable[[], bool], str], None]:
    """Poll until a condition holds; fail with what was waited for after half a minute."""

    def wait(condition: Callable[[], bool], what: str) -> None:
        end = time.monotonic() + 30.0
        while not condition():
            assert time.monotonic() < end, f"not within 30 s: {what}"
            time.sleep(0.01)

    return wait


@pytest.fixture(scope="session")
def frozen_viewer(
    aircraft: Aircraft, wait_until: Callable[[Callable[[], bool], str], None]
) -> Callable[[Path], Viewer]:
    """Opens a viewer that saves to a file, and stops its process once it runs."""

    def freeze(file: Path) -> Viewer:
        viewer = open_viewer(f"save:{file}", aircraft, map=False)
        assert viewer.process is not None
        process = viewer.process
        wait_until(lambda: file.stat().st_size > 0 or process.poll() is not None, "the viewer process starts to write")
        os.kill(process.pid, signal.SIGSTOP)
        return viewer

    return freeze
