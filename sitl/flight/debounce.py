"""A condition counts once it has held for some time: the timer that landing, failsafes and fault watches share."""

__all__ = ["Debounce"]


class Debounce:
    """How long a condition has held without a break, in simulated time."""

    __slots__ = ("_since",)

    def __init__(self) -> None:
        self._since = -1.0  # time since which it holds [s], negative if it does not; simulated time never is

    def held(self, condition: bool, time: float) -> float:
        """Seconds for which `condition` has held, now being `time` [s]; -1 if it does not hold."""
        if not condition:
            self._since = -1.0
            return -1.0
        if self._since < 0.0 or time < self._since:  # time goes back when a simulation is begun anew
            self._since = time
        return time - self._since
