"""Motors and servos moved one by one while disarmed, to see that each does what it should."""

from sitl.flight.view import View
from vehicle_model.state import CONTROL_COUNT, TILT_COMMAND

__all__ = ["ActuatorTest"]


class ActuatorTest:
    """What is being tried, until when. Times are simulated [s]."""

    def __init__(self) -> None:
        self._moves: dict[int, list[tuple[float, float, float]]] = {}  # begin, end and value, by control

    def add(self, control: int, value: float, begin: float, seconds: float) -> None:
        """Give a control (as in `vehicle_model.state`: throttle or angle [rad]) a value for a while.

        What was wanted of it at that time and later is forgotten.
        """
        moves = [move for move in self._moves.get(control, ()) if move[1] <= begin]
        if seconds > 0.0:
            moves.append((begin, begin + seconds, value))
        self._moves[control] = moves

    def stop(self) -> None:
        """Try nothing any more."""
        self._moves.clear()

    def controls(self, view: View) -> list[float] | None:
        """Controls (7,) to ask for now, the rest standing still; None when nothing is tried."""
        if not self._moves:
            return None
        time = view.time
        controls = [0.0] * CONTROL_COUNT
        controls[TILT_COMMAND] = view.tilt_command
        for control, moves in list(self._moves.items()):
            waiting = [move for move in moves if move[1] > time]
            if not waiting:
                del self._moves[control]
                continue
            self._moves[control] = waiting
            begin, _, value = waiting[0]
            if begin <= time:
                controls[control] = value
        return controls if self._moves else None
