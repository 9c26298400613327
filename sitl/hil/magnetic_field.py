"""The Earth's magnetic field: World Magnetic Model 2025, by the package pygeomag."""

from datetime import UTC, datetime
from typing import Any

__all__ = ["MagneticField", "in_body_axes"]

# The field is evaluated once for each cell of about 1 km: across one it changes by some 5 nT, far below what a
# magnetometer resolves, and an evaluation costs 0.1 to 0.5 ms.
CELL_ANGLE = 0.01  # [deg]
CELL_HEIGHT = 1000.0  # [m]
MODEL_YEARS = (2025.0, 2030.0)  # that the model is made for
GAUSS_PER_NANOTESLA = 1e-5


class MagneticField:
    """The field around the vehicle on one day."""

    def __init__(self, unix_time: float) -> None:
        """`unix_time`: the day [s since 1970, UTC]; before 2025 and after 2030 the model's nearest day is used."""
        moment = datetime.fromtimestamp(unix_time, UTC)
        start = datetime(moment.year, 1, 1, tzinfo=UTC)
        length = datetime(moment.year + 1, 1, 1, tzinfo=UTC) - start
        self.year = min(max(moment.year + (moment - start) / length, MODEL_YEARS[0]), MODEL_YEARS[1])
        self._model: Any = None
        self._cell: tuple[int, int, int] | None = None
        self._field = (0.0, 0.0, 0.0)

    def ned(self, latitude: float, longitude: float, height_ellipsoid: float) -> tuple[float, float, float]:
        """Field in north, east, down [gauss] at a geodetic place [degrees, m]."""
        cell = (round(latitude / CELL_ANGLE), round(longitude / CELL_ANGLE), round(height_ellipsoid / CELL_HEIGHT))
        if cell != self._cell:
            if self._model is None:
                from pygeomag import GeoMag

                self._model = GeoMag()
            result = self._model.calculate(
                cell[0] * CELL_ANGLE, cell[1] * CELL_ANGLE, cell[2] * CELL_HEIGHT * 1e-3, self.year
            )
            north, east, down = result.x, result.y, result.z
            self._field = (north * GAUSS_PER_NANOTESLA, east * GAUSS_PER_NANOTESLA, down * GAUSS_PER_NANOTESLA)
            self._cell = cell
        return self._field


def in_body_axes(
    vector_ned: tuple[float, float, float], quaternion: tuple[float, float, float, float]
) -> tuple[float, float, float]:
    """A vector given in NED, in body axes; `quaternion` (scalar first, unit) turns body vectors into NED."""
    north, east, down = vector_ned
    w, x, y, z = quaternion
    # v' = v + 2 w (v x r) + 2 r x (r x v), with r the vector part: the inverse turn of q.
    a, b, c = east * z - down * y, down * x - north * z, north * y - east * x
    return (
        north + 2.0 * (w * a + (b * z - c * y)),
        east + 2.0 * (w * b + (c * x - a * z)),
        down + 2.0 * (w * c + (a * y - b * x)),
    )
