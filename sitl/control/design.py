"""Designs the control laws for an aircraft: its force map, and gains over the corridor; kept on disk once made.

`sitl.control.shape` says how gains follow from an aircraft, `sitl.control.tuning` what is done where the margins that
they leave are not enough.
"""

import hashlib
import math
from collections.abc import Callable
from dataclasses import astuple, dataclass, fields
from pathlib import Path

import numpy as np

from sitl.control.design_names import COLUMNS as SCHEDULE_COLUMNS
from sitl.control.kept import keep, kept
from sitl.control.margins import GAIN_GOAL, PHASE_GOAL
from sitl.control.records import GAINS
from sitl.control.shape import DEFAULT_SHAPE, Shape, shaped
from vehicle_model.aircraft import Aircraft
from vehicle_model.compiled import CACHE_FOLDER, cache_folder
from vehicle_model.force_columns import COLUMNS
from vehicle_model.force_map import force_grid, force_map
from vehicle_model.records import VEHICLE

__all__ = ["Design", "design_for", "design_with"]


LAWS_FOLDER = cache_folder(Path(__file__).resolve().parent)  # what depends on the laws is kept with their code


@dataclass(frozen=True)
class Design:
    """What the laws need: GAINS (1,), force map and its axes (4, 3), schedule (n_u, columns), VEHICLE (1,).

    `missed` names the loops, each with its place and margins, that have less than the goal; empty where all hold.
    """

    gains: np.ndarray
    table: np.ndarray
    axes: np.ndarray
    schedule: np.ndarray
    vehicle: np.ndarray
    shape: Shape = DEFAULT_SHAPE
    missed: tuple[str, ...] = ()

    @property
    def summary(self) -> str:
        """What was done for the margins, and whether that was enough, in words."""
        changes = [
            f"{field.name} {getattr(self.shape, field.name):.3g} (was {field.default:.3g})"
            for field in fields(Shape)
            if getattr(self.shape, field.name) != field.default
        ]
        text = f"Reshaped for this aircraft: {', '.join(changes)}." if changes else "The default shape is kept."
        if self.missed:
            return f"{text} Margins out of reach in {len(self.missed)} loops: {'; '.join(self.missed)}."
        return f"{text} All loops have {GAIN_GOAL:g} dB and {math.degrees(PHASE_GOAL):g} deg."

    @staticmethod
    def none() -> "Design":
        """Arrays of the right kinds that hold nothing, where compiled code wants a design and there are no laws."""
        axes = np.array([[0.0, 1.0, 2.0]] * 4)
        table = np.zeros((2, 2, 2, 2, len(COLUMNS)))
        return Design(np.zeros(1, GAINS), table, axes, np.zeros((2, len(SCHEDULE_COLUMNS))), np.zeros(1, VEHICLE))


def design_with(aircraft: Aircraft, table: np.ndarray, axes: np.ndarray, shape: Shape) -> Design:
    """The design that follows from an aircraft, its force map with axes (4, 3), and a shape; margins not looked at."""
    gains, schedule = shaped(aircraft, table, axes, shape)
    return Design(gains, table, axes, schedule, aircraft.vehicle.copy(), shape)


def design_for(aircraft: Aircraft, report: Callable[[str], None] | None = None) -> Design:
    """The design for an aircraft, from the user's cache if it has been made before.

    Otherwise it takes some seconds for the map, which depends on the aircraft and the physics alone, and up to a minute
    for gains that keep the margins, which depend on the laws as well. `report` is given lines for a person who waits.
    """
    axes = force_grid(aircraft)
    name = hashlib.sha256(aircraft.vehicle.tobytes() + axes.tobytes()).hexdigest()[:24]
    table = _map(aircraft, axes, name, report)
    file = None if LAWS_FOLDER is None else LAWS_FOLDER / f"design-{name}.npz"
    found = kept(file)
    if found is not None:
        gains = found["gains"].view(GAINS)  # on disk a record's alignment is not kept, and compiled code tells by it
        shape, missed = Shape(*found["shape"].tolist()), tuple(found["missed"].tolist())
        return Design(gains, table, axes, found["schedule"], aircraft.vehicle.copy(), shape, missed)

    from sitl.control.tuning import tuned  # brings scipy and the analysis along, which a start from the cache need not

    design = tuned(aircraft, table, axes, report)
    keep(
        file, gains=design.gains, schedule=design.schedule, shape=np.array(astuple(design.shape)),
        missed=np.array(design.missed, dtype=np.str_),
    )  # fmt: skip
    return design


def _map(aircraft: Aircraft, axes: np.ndarray, name: str, report: Callable[[str], None] | None) -> np.ndarray:
    """The aircraft's force map, kept with the physics that make it."""
    file = None if CACHE_FOLDER is None else CACHE_FOLDER / f"force_map-{name}.npz"
    found = kept(file)
    if found is not None:
        return found["table"]
    if report:
        report("force map: solving for tilt, rotor speed and flap over airflow and force")
    table = force_map(aircraft, axes)
    keep(file, table=table)
    return table
