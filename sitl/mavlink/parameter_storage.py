"""What is kept of parameters from one run to the next: every value that somebody has set, in a file of QGC's format.

A value that has been set goes before the default of a later run, and the scenario and the command line of that run go
before it; they are not stored themselves.
"""

from typing import TYPE_CHECKING, Final

from sitl.flight.parameter_file import ParameterFileError, as_params, entries
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.state_folder import StateError

if TYPE_CHECKING:
    from collections.abc import Container

    from sitl.flight.parameters import Parameters
    from sitl.mavlink.service import Exchange
    from sitl.mavlink.timers import Timer

__all__ = ["ParameterStorage"]

FILE: Final = "parameters.params"
SAVE_DELAY = 0.5  # so that many changes at once are one write [s], wall time


class ParameterStorage:
    """The values in store.

    What goes wrong with the file is told everybody in one line, and never stops the flight.
    """

    def __init__(self, exchange: "Exchange") -> None:
        """Keep them in the state folder of `exchange`."""
        self._exchange = exchange
        self._values: dict[str, float] = {}
        self._timer: Timer | None = None

    def load(self, parameters: "Parameters", *, but: "Container[str]" = ()) -> bool:
        """Set the parameters that are in store, but these; what the file has that is no use any more is left out.

        Returns whether the file could be read; with none there is nothing in store.
        """
        self._values = {}
        useless: list[str] = []
        stored = self._read()
        for name, value in stored or ():
            try:
                if name in but:
                    parameters.definition(name)
                else:
                    parameters.set(name, value)
            except ValueError as error:
                useless.append(str(error))
            else:
                self._values[name] = value
        if useless:
            more = f" (and {len(useless) - 1} more)" if len(useless) > 1 else ""
            self._warn(f"{FILE}: left out {useless[0]}{more}")
        return stored is not None

    def keep(self, name: str, value: float) -> None:
        """Put one value in store, on the disk soon."""
        self._values[name] = value
        if self._timer is None:
            self._timer = self._exchange.after(SAVE_DELAY, self.flush)

    def keep_all(self, parameters: "Parameters") -> bool:
        """Put every value in store that is not the default, and save."""
        self._values |= {
            definition.name: parameters[definition.name]
            for definition in parameters.definitions
            if parameters[definition.name] != definition.default
        }
        return self.save()

    def clear(self, *, but: "Container[str]" = ()) -> bool:
        """Have nothing in store but these, and save."""
        self._values = {name: value for name, value in self._values.items() if name in but}
        return self.save()

    def flush(self) -> None:
        """Put on the disk what is not there yet."""
        if self._timer is not None:
            self.save()

    def save(self) -> bool:
        """Put what is in store on the disk; returns whether it is there."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        try:
            self._exchange.state.write(FILE, as_params(self._values, self._exchange.system).encode())
        except StateError as error:
            self._warn(f"Parameters are not stored: {error}")
            return False
        return True

    def _read(self) -> list[tuple[str, float]] | None:
        """What the file says; a damaged one is set aside, and None returned."""
        state = self._exchange.state
        try:
            data = state.read(FILE)
            if data is None:
                return []
            try:
                return [(name, value) for _, name, value in entries(data, FILE)]
            except ParameterFileError as error:
                self._warn(f"{error}; set aside as {state.set_aside(FILE)}, nothing in store")
        except StateError as error:
            self._warn(f"Nothing in store: {error}")
        return None

    def _warn(self, text: str) -> None:
        self._exchange.statustext(mav.MAV_SEVERITY_WARNING, text)
