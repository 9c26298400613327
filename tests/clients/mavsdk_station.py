"""MAVSDK 4 connected to a vehicle: its plugins, and its calls that report progress."""

import math
import threading
from collections.abc import Callable
from typing import Any

from mavsdk import ComponentType, Configuration, Mavsdk
from mavsdk.plugins.action import Action
from mavsdk.plugins.telemetry import FlightMode, LandedState, Telemetry

from tests.clients.vehicle import DEADLINE, FlownVehicle, until

__all__ = ["MavsdkStation", "finished"]


class MavsdkStation:
    """A ground station made of MAVSDK's native library.

    Attributes:
        action, telemetry: the plugins that nearly every test needs.
        texts: what the vehicle has told the pilot.
    """

    def __init__(self, vehicle: FlownVehicle) -> None:
        """Connect; fails if no autopilot is found."""
        self.vehicle = vehicle
        self._mavsdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
        self._mavsdk.add_any_connection(vehicle.mavsdk)
        self._system = self._mavsdk.first_autopilot(DEADLINE)
        assert self._system is not None
        self._plugins: dict[type, Any] = {}
        self.action = self.plugin(Action)
        self.telemetry = self.plugin(Telemetry)
        self.texts: list[str] = []
        self.telemetry.subscribe_status_text(lambda said, _: self.texts.append(said.text))
        until(self.telemetry.health_all_ok)

    def plugin(self, kind: type) -> Any:
        """One of MAVSDK's plugins."""
        if kind not in self._plugins:
            self._plugins[kind] = kind(self._system)
        return self._plugins[kind]

    def close(self) -> None:
        """End it, and all its threads."""
        self._mavsdk.destroy()

    def begin(self, start: str = "ground") -> None:
        """Let the vehicle begin anew, and wait until the station has seen it."""
        self.vehicle.reset(start)
        flies = start != "ground"
        until(lambda: self.telemetry.armed() == flies and self.telemetry.in_air() == flies)
        self.texts.clear()

    def take_off(self, height: float) -> None:
        """Arm, climb to a height above home [m], and hold."""
        self.action.set_takeoff_altitude(height)
        self.action.arm()
        self.action.takeoff()
        until(lambda: self.telemetry.landed_state() == LandedState.IN_AIR and self.telemetry.armed())
        self.wait_for_mode(FlightMode.HOLD)

    def wait_for_mode(self, mode: FlightMode) -> None:
        """Until the heartbeat, once a wall second, tells this mode."""
        until(lambda: self.telemetry.flight_mode() == mode)

    @property
    def height(self) -> float:
        """Height above home [m]."""
        return self.telemetry.position().relative_altitude_m

    def at(self, north: float, east: float, height: float, within: float = 1.0) -> bool:
        """Whether the vehicle is at a place near home [m]."""
        position = self.telemetry.position_velocity_ned().position
        return math.dist((position.north_m, position.east_m, -position.down_m), (north, east, height)) < within


def finished(start: Callable[..., None], *arguments: Any) -> list[tuple[str, Any]]:
    """Names of the results, and data, that one of MAVSDK's calls with progress gives until it has ended."""
    reports: list[tuple[str, Any]] = []
    ended = threading.Event()

    def report(result: Any, data: Any = None, _: Any = None) -> None:
        reports.append((result.name, data))
        if result.name != "NEXT":
            ended.set()

    start(*arguments, report)
    assert ended.wait(DEADLINE), f"{start.__name__} did not end: {reports[-3:]}"
    return reports
