"""Vehicles that clients fly: one process for the tests of a module, each test beginning on the ground."""

from collections.abc import Generator, Iterator
from typing import TYPE_CHECKING, Any

import pytest

from tests.clients.vehicle import FlownVehicle

if TYPE_CHECKING:
    from tests.clients.mavsdk_station import MavsdkStation

LAST_CHARACTERS = 3000  # of a vehicle's log, in the report of a failed test


@pytest.fixture(scope="module")
def vehicle_options() -> dict[str, Any]:
    """Options of `FlownVehicle` for the tests of a module."""
    return {}


@pytest.fixture(scope="module")
def vehicle(vehicle_options: dict[str, Any]) -> Iterator[FlownVehicle]:
    with FlownVehicle(**vehicle_options) as started:
        yield started


@pytest.fixture(scope="module")
def connected_station(vehicle: FlownVehicle) -> "Iterator[MavsdkStation]":
    from tests.clients.mavsdk_station import MavsdkStation

    station = MavsdkStation(vehicle)
    yield station
    station.close()


@pytest.fixture
def station(connected_station: "MavsdkStation") -> "MavsdkStation":
    """MAVSDK, the vehicle on the ground and disarmed."""
    connected_station.begin()
    return connected_station


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Show what the vehicle of a failed test has printed."""
    report = yield
    vehicle = getattr(item, "funcargs", {}).get("vehicle")
    if report.failed and vehicle is not None:
        report.sections.append(("Log of the vehicle", vehicle.sitl.log[-LAST_CHARACTERS:]))
    return report
