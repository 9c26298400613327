"""What a flight leaves behind for reports and campaigns: one row for each recorded moment, in an array that grows.

SI and radians, NED from home. Rows are written while flying, so they hold numbers only: what they mean for a leg, a
landing or a stall is worked out afterwards.
"""

import numpy as np

__all__ = ["ROW", "History"]

_f = np.float64
_i = np.int64

ROW = np.dtype(
    [
        ("time", _f),  # simulated [s]
        ("state", _f, (20,)),  # as in `vehicle_model.state`
        ("controls", _f, (7,)),  # as there
        ("position_ned", _f, (3,)),  # from home [m]
        ("velocity_ned", _f, (3,)),  # over the ground [m/s]
        ("euler", _f, (3,)),  # roll, pitch, yaw [rad]
        ("airspeed", _f),  # true [m/s]
        ("wind_ned", _f, (3,)),  # blowing to [m/s]
        ("height_above_ground", _f),  # of the centre of mass [m]
        ("stall_margin_wetted", _f),  # smallest of the wing's strips in the slipstream; negative: stalled [rad]
        ("stall_margin_outer", _f),  # smallest of those outside it [rad]
        ("tilt", _f),  # [rad]
        ("tilt_command", _f),  # [rad]
        ("power", _f),  # electrical, from the battery [W]
        ("voltage", _f),  # of the battery under load [V]
        ("current", _f),  # [A]
        ("battery_remaining", _f),  # 0..1
        ("contact", _i),  # 1: a point of the landing gear bears load
        ("armed", _i),
        ("mode", _i),  # sitl.flight.mode.Mode
        ("regime", _i),  # sitl.flight.regime.Regime
        ("landed", _i),  # sitl.flight.landed.LandedState
        ("mission_item", _i),  # current one, counted from 0; -1 without a mission
        # The setpoint of the control laws, as in `sitl.control.records.SETPOINT`.
        ("level", _i),
        ("horizontal", _i),
        ("vertical", _i),
        ("cruise", _i),
        ("start_ned", _f, (3,)),  # of the leg [m]
        ("target_ned", _f, (3,)),  # point, end of the leg or centre of the circle [m]
        ("radius", _f),  # of the circle [m]
    ],
    align=True,
)


class History:
    """Rows of ROW in the order of flight.

    Args:
        capacity: rows to make room for at first; the array doubles when it is full.
    """

    def __init__(self, capacity: int = 4096) -> None:
        if capacity < 1:
            msg = f"capacity: expected room for at least 1 row, got {capacity}"
            raise ValueError(msg)
        self._rows = np.zeros(capacity, ROW)
        self._count = 0

    def __len__(self) -> int:
        """Rows recorded so far."""
        return self._count

    @property
    def rows(self) -> np.ndarray:
        """What has been recorded, shape (n,); a view that the next `new_row` may leave behind."""
        return self._rows[: self._count]

    def new_row(self) -> np.ndarray:
        """The next row to be written, shape (1,), all zero: an array, as compiled code takes it."""
        if self._count == len(self._rows):
            grown = np.zeros(2 * len(self._rows), ROW)
            grown[: self._count] = self._rows
            self._rows = grown
        self._count += 1
        return self._rows[self._count - 1 : self._count]
