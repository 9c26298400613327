"""A vehicle in a process of its own for clients to fly, and an observer beside them who sees what it really does.

The client has a link to itself, straight from socket to socket. The observer and what begins the flight anew are on
another one.
"""

import math
import time
from collections.abc import Callable
from types import TracebackType
from typing import Any, Self

from sitl.testing import SitlVehicle
from sitl.testing.ports import LOOPBACK, reserve_port

__all__ = ["DEADLINE", "HOME", "FlownVehicle", "place", "until"]

DEADLINE = 60.0  # [s], wall time: far more than anything takes that has one
LOOK = 0.01  # how often a condition is looked at [s]
HOME = (47.397742, 8.545594, 488.0)  # latitude and longitude [deg], altitude above mean sea level [m]
METRES_PER_DEGREE = math.radians(6378137.0)


def place(north: float, east: float) -> tuple[float, float]:
    """Latitude and longitude [deg] of a place so far from home [m]; to a thousandth of the way."""
    latitude, longitude, _ = HOME
    return latitude + north / METRES_PER_DEGREE, longitude + east / METRES_PER_DEGREE / math.cos(math.radians(latitude))


def until(condition: Callable[[], Any], timeout: float = DEADLINE) -> Any:
    """What the condition gives, as soon as that is true. Fails after `timeout` wall seconds."""
    end = time.monotonic() + timeout
    while not (value := condition()):
        assert time.monotonic() < end, "the condition never came true"
        time.sleep(LOOK)
    return value


class FlownVehicle:
    """A vehicle, flying several times as fast as real time.

    Attributes:
        port: of the loopback, that it sends to; for the client under test.
        sitl: what started it.
    """

    def __init__(self, *arguments: str, streams: str = "onboard", **options: Any) -> None:
        """`arguments` are more of its command line, `options` those of `SitlVehicle`, `streams` those of the client."""
        self.port, self._guard = reserve_port()
        link = f"--link=udpout:{LOOPBACK}:{self.port},{streams}"
        given = {"speed": 8, "streams": "minimal", **options}
        self.sitl = SitlVehicle(arguments=(link, *arguments), **given)
        self._observer: Any = None

    def __enter__(self) -> Self:
        """Start; at the end of the with block end."""
        try:
            self.sitl.__enter__()
        except BaseException:
            self._guard.close()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """See __enter__."""
        self._guard.close()
        self.sitl.__exit__(kind, error, trace)

    @property
    def mavsdk(self) -> str:
        """Connection string of MAVSDK."""
        return f"udpin://{LOOPBACK}:{self.port}"

    @property
    def pymavlink(self) -> str:
        """Connection string of pymavlink and what is made with it."""
        return f"udpin:{LOOPBACK}:{self.port}"

    @property
    def observer(self) -> Any:
        """A pymavlink connection on the other link."""
        if self._observer is None:
            self._observer = self.sitl.connect()
        return self._observer

    def reset(self, start: str | None = None) -> None:
        """Begin anew, on the ground or in flight (`trim:AIRSPEED`); parameters and plans stay."""
        self.sitl.reset(start)

    def seen(self, name: str, condition: Callable[[Any], bool] = lambda _: True, timeout: float = DEADLINE) -> Any:
        """The next message of a kind that the observer gets and that fulfils a condition."""
        end = time.monotonic() + timeout
        while time.monotonic() < end:
            message = self.observer.recv_match(type=name, blocking=True, timeout=1.0)
            if message is not None and condition(message):
                return message
        message = f"no such {name} within {timeout:g} s"
        raise AssertionError(message)
