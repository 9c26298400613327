"""The aircraft: what its file says, as typed SI values and as the VEHICLE record of the compiled equations."""

from collections.abc import Mapping, Sequence
from functools import cached_property
from importlib import resources
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import numpy.typing as npt

from vehicle_model.aircraft_checks import check_consistency
from vehicle_model.aircraft_file import AircraftFileError, read_tables, write_values
from vehicle_model.aircraft_record import ROTOR_NAMES, surface_names, vehicle_record
from vehicle_model.aircraft_schema import SchemaError, replace
from vehicle_model.aircraft_tables import AircraftTables
from vehicle_model.channels import Channel, channels_of

__all__ = ["Aircraft", "AircraftFileError", "Channel", "load_aircraft", "write_values"]


class Aircraft(AircraftTables, frozen=True, kw_only=True, dict=True):
    """An aircraft: the tables of its file (`wing`, `rotors`, ...; SI and radians) and what follows from them."""

    source_file: Path

    @cached_property
    def vehicle(self) -> npt.NDArray[np.void]:
        """Parameters for the compiled equations: VEHICLE array of shape (1,), read-only."""
        return vehicle_record(self)

    @cached_property
    def channels(self) -> tuple[Channel, ...]:
        """Output channels of a flight controller, ascending by number."""
        return channels_of(self)

    @property
    def rotor_names(self) -> tuple[str, ...]:
        """Names of the rotors in the order of VEHICLE."""
        return ROTOR_NAMES

    @property
    def surface_names(self) -> tuple[str, ...]:
        """Names of the surfaces in the order of VEHICLE."""
        return surface_names(self)

    @property
    def wing_strips(self) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
        """Indices of the wing's strips in the order of VEHICLE: those in the slipstream, those outside it."""
        craft = self.vehicle[0]
        surfaces = craft["surfaces"][: craft["surface_count"]]
        tilts, wetted = surfaces["tilts"] == 1, surfaces["rotor"] >= 0
        return np.flatnonzero(tilts & wetted), np.flatnonzero(tilts & ~wetted)

    def normalised_outputs(self, controls: Sequence[float] | npt.NDArray[np.float64]) -> list[float]:
        """What a flight controller would send for these controls (7,): normalised values, channel 1 first.

        Each is limited to its channel's range; a number that no channel has is 0. Raises ValueError for a control that
        is not finite.
        """
        outputs = [0.0] * self.channels[-1].number
        for channel in self.channels:
            outputs[channel.number - 1] = channel.to_normalised(float(controls[channel.index]))
        return outputs

    def with_values(self, values: Mapping[str, Any]) -> "Aircraft":
        """The aircraft with some values replaced, by dotted path as in the file, in SI and radians.

        Tables of an array go by name or index, components of a vector by x, y, z:
        `{"wing.incidence": 0.03, "wing.strips.wetted.width": 0.41, "mass_properties.centre_of_mass.x": 0.01}`.
        Raises ValueError for an unknown path or a value that is implausible, alone or beside the others.
        """
        aircraft = self
        try:
            for path, value in values.items():
                aircraft = replace(aircraft, path.split("."), value)
            check_consistency(aircraft)
        except SchemaError as error:
            raise ValueError(str(error)) from None
        return aircraft


def load_aircraft(path: Path | str | None = None) -> Aircraft:
    """Read and check an aircraft file; the one that comes with the package if `path` is None.

    Raises AircraftFileError, whose one line names the file, the line, the entry and what was expected.
    """
    file = Path(str(resources.files("vehicle_model") / "hong2013.toml")) if path is None else Path(path)
    tables = read_tables(file)
    return Aircraft(**msgspec.structs.asdict(tables), source_file=file)
