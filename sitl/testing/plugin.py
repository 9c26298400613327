"""The pytest plugin: the fixtures `tiltwing_sitl` and `tiltwing_sitl_factory`, their marker and their options.

pytest loads this in every run of everybody who has the package, so it imports next to nothing until a test asks for a
vehicle. docs/pytest-plugin.md describes it.
"""

from collections.abc import Callable, Generator
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from sitl.testing.vehicle import SitlVehicle

MARKER = "tiltwing_sitl"
LAST_CHARACTERS = 4000  # of a vehicle's log, in the report of a failed test

# Options of the command line and of the configuration file: name, what its values are, what for.
_OPTIONS: dict[str, tuple[Callable[[str], Any], str, str]] = {
    "speed": (str, "N|max", "times real time that vehicles fly at"),
    "seed": (int, "N", "where random streams of vehicles and of their wires begin"),
    "identity": (str, "NAME", "autopilot that vehicles appear as: px4, ardupilot or generic"),
    "start_timeout": (float, "S", "wall seconds that a vehicle may take to start"),
}
_vehicles = pytest.StashKey[list["SitlVehicle"]]()


def pytest_addoption(parser: pytest.Parser) -> None:
    """--tiltwing-speed and the like, and their keys in the configuration file."""
    group = parser.getgroup("tiltwing-sitl", "tilt-wing vehicles to test MAVLink clients with")
    for name, (kind, metavar, purpose) in _OPTIONS.items():
        option = f"--tiltwing-{name.replace('_', '-')}"
        group.addoption(option, type=kind, metavar=metavar, help=f"{purpose}, unless a test says otherwise")
        parser.addini(f"tiltwing_{name}", help=f"as {option}", default=None)


def pytest_configure(config: pytest.Config) -> None:
    """Describe the marker."""
    config.addinivalue_line("markers", f"{MARKER}(**options): what the vehicle of the test is started with.")


@pytest.fixture(scope="session")
def tiltwing_sitl_options(pytestconfig: pytest.Config) -> dict[str, Any]:
    """Options of the command line and the configuration file, for `SitlVehicle(**options)` in fixtures of one's own."""
    options: dict[str, Any] = {}
    for name, (kind, _, _) in _OPTIONS.items():
        value = pytestconfig.getoption(f"tiltwing_{name}")
        written = pytestconfig.getini(f"tiltwing_{name}")
        if value is None and written:
            try:
                value = kind(written)
            except ValueError:
                msg = f"tiltwing_{name}: expected {kind.__name__}, got {written!r}"
                raise pytest.UsageError(msg) from None
        if value is not None:
            options[name] = value
    return options


@pytest.fixture
def tiltwing_sitl_factory(
    request: pytest.FixtureRequest, tiltwing_sitl_options: dict[str, Any]
) -> Callable[..., "SitlVehicle"]:
    """Starts vehicles, as many as the test calls for: `tiltwing_sitl_factory(system_id=2, at="trim:20")`.

    Options go before those of the marker, and these before those of the command line. All vehicles end with the test.
    """
    from sitl.testing.vehicle import SitlVehicle

    options = dict(tiltwing_sitl_options)
    for marker in reversed(list(request.node.iter_markers(MARKER))):
        if marker.args:
            msg = f"{MARKER}: expected options with their names, as in speed=10, got {marker.args}"
            raise pytest.UsageError(msg)
        options.update(marker.kwargs)
    vehicles = request.node.stash.setdefault(_vehicles, [])

    def start(**more: Any) -> SitlVehicle:
        __tracebackhide__ = True
        vehicle = SitlVehicle(**{**options, **more})
        vehicles.append(vehicle)
        # One by one, so that each is closed whatever becomes of the others.
        request.addfinalizer(vehicle.close)
        return vehicle.start()

    return start


@pytest.fixture
def tiltwing_sitl(tiltwing_sitl_factory: Callable[..., "SitlVehicle"]) -> "SitlVehicle":
    """A vehicle that has just started, for this test alone; the marker of the same name gives its options."""
    return tiltwing_sitl_factory()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Show what the vehicles of a failed test have printed."""
    report = yield
    if report.failed:
        for vehicle in item.stash.get(_vehicles, []):
            if vehicle.log:
                title = f"Log of {MARKER}, system {vehicle.system_id}"
                report.sections.append((title, vehicle.log[-LAST_CHARACTERS:]))
    return report
