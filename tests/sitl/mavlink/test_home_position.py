"""Home and the local frame's origin on the map."""

import math
from collections.abc import Iterator
from typing import Any

import pytest

from sitl.mavlink.dialect import tiltwing as mav
from tests.sitl.mavlink.in_memory import Desk, MemoryLink, Station
from tests.sitl.mavlink.telemetry.observed import Observed

ACCEPTED = mav.MAV_RESULT_ACCEPTED
ORIGIN = mav.MAV_CMD_DO_SET_GLOBAL_ORIGIN


def test_home_begins_at_the_origin_with_the_heading_of_the_start() -> None:
    observed = Observed(home=(-33.5, 151.25, 20.5, 60.0))
    m = observed.sent("HOME_POSITION")
    assert (m.latitude, m.longitude, m.altitude) == (-335000000, 1512500000, 20500)
    assert (m.x, m.y, m.z, m.time_usec) == (0.0, 0.0, 0.0, 0)
    assert m.q == pytest.approx([math.cos(math.radians(30.0)), 0.0, 0.0, math.sin(math.radians(30.0))])
    assert all(map(math.isnan, (m.approach_x, m.approach_y, m.approach_z)))


@pytest.mark.parametrize("earth", ["flat", "wgs84"])
def test_home_moves_and_the_origin_stays(earth: str) -> None:
    observed = Observed(earth=earth, home=(47.0, 8.0, 500.0, 0.0))
    observed.flight.set_home(47.01, 8.02, 530.0)
    observed.fly(0.1)
    home, origin = observed.sent("HOME_POSITION"), observed.sent("GPS_GLOBAL_ORIGIN")
    assert (home.latitude, home.longitude, home.altitude) == pytest.approx((470100000, 80200000, 530000), abs=1)
    assert home.x == pytest.approx(1112.0, abs=3.0)  # a hundredth of a degree of latitude
    assert home.y == pytest.approx(1519.0, abs=6.0)  # two of longitude at 47 deg
    assert home.z == pytest.approx(-30.0)
    assert (origin.latitude, origin.longitude, origin.altitude) == (470000000, 80000000, 500000)
    assert origin.time_usec == 100000


def test_without_an_autopilot_home_is_the_origin() -> None:
    m = Observed(autopilot=False).sent("HOME_POSITION")
    assert (m.latitude, m.longitude, m.altitude) == (473977420, 85455940, 488000)


@pytest.fixture
def two() -> Iterator[tuple[Desk, Station]]:
    """A vehicle on the ground, its first station, and another on a link of its own."""
    desk = Desk(links=[MemoryLink("one"), MemoryLink("other")])
    other = desk.join(250, 190, link=1)
    desk.advance(0.5)
    yield desk, other
    desk.close()


def only(station: Desk | Station, name: str) -> Any:
    """The latest message of a kind."""
    return station.of(name)[-1]


def test_home_that_is_set_is_told_everybody_at_once(two: tuple[Desk, Station]) -> None:
    desk, other = two
    for station in (desk, other):
        station.received.clear()
    desk.send("COMMAND_INT", command=mav.MAV_CMD_DO_SET_HOME, frame=0, x=474000000, y=85500000, z=500.0)
    desk.advance(0.04)
    for station in (desk, other):
        home = only(station, "HOME_POSITION")
        assert (home.latitude, home.longitude, home.altitude) == pytest.approx((474000000, 85500000, 500000), abs=1)


def test_the_older_message_sets_home_too_or_says_why_not(two: tuple[Desk, Station]) -> None:
    desk, other = two
    desk.send("SET_HOME_POSITION", latitude=474000000, longitude=85500000, altitude=510000, q=[1.0, 0.0, 0.0, 0.0])
    desk.advance(0.04)
    assert only(other, "HOME_POSITION").altitude == 510000
    desk.send("SET_HOME_POSITION", latitude=2**31 - 1, longitude=85500000, altitude=520000, q=[1.0, 0.0, 0.0, 0.0])
    desk.advance(0.04)
    assert only(other, "HOME_POSITION").altitude == 510000
    assert "home: expected latitude" in desk.texts[-1]


def test_home_moves_with_the_place_where_a_flight_begins_and_that_is_told(two: tuple[Desk, Station]) -> None:
    desk, other = two
    desk.simulation.flight.set_home(47.4, 8.55, 480.0)
    desk.advance(0.1)
    other.received.clear()
    assert desk.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1).result == ACCEPTED
    desk.advance(0.04)
    home = only(other, "HOME_POSITION")
    assert (home.latitude, home.longitude) == pytest.approx((473977420, 85455940), abs=2)


def test_the_origin_is_put_elsewhere_and_told_everybody_exactly_as_it_was_given(two: tuple[Desk, Station]) -> None:
    """MAVSDK's set_gps_global_origin waits for equal numbers."""
    desk, other = two
    desk.send("SET_GPS_GLOBAL_ORIGIN", latitude=473970001, longitude=85450003, altitude=470007)
    for station in (desk, other):
        told = only(station, "GPS_GLOBAL_ORIGIN")
        assert (told.latitude, told.longitude, told.altitude) == (473970001, 85450003, 470007)
    desk.received.clear()
    desk.advance(2.1)
    local, home, odometry = (only(desk, name) for name in ("LOCAL_POSITION_NED", "HOME_POSITION", "ODOMETRY"))
    # 742e-7 deg of latitude north of it, 594e-7 of longitude east, and 17.993 m above.
    assert (home.x, home.y, home.z) == pytest.approx((82.5, 44.8, -17.993), abs=0.1)
    gear = desk.simulation.snapshot().position_ned[2]
    assert (local.x, local.y, local.z) == pytest.approx((home.x, home.y, home.z + gear), abs=0.01)
    assert (odometry.x, odometry.y, odometry.z) == pytest.approx((local.x, local.y, local.z), abs=0.01)
    assert odometry.reset_counter == 1
    assert only(desk, "ALTITUDE").altitude_local == pytest.approx(-local.z, abs=0.01)
    assert only(desk, "HOME_POSITION").latitude == 473977420  # home has not moved


def test_the_newer_command_moves_the_origin_in_its_frame_only(two: tuple[Desk, Station]) -> None:
    desk, other = two
    place = {"command": ORIGIN, "x": 473970000, "y": 85450000, "z": 470.0}
    desk.send("COMMAND_INT", frame=mav.MAV_FRAME_GLOBAL_RELATIVE_ALT, **place)
    assert only(desk, "COMMAND_ACK").result == mav.MAV_RESULT_COMMAND_UNSUPPORTED_MAV_FRAME
    assert only(other, "GPS_GLOBAL_ORIGIN").latitude == 473977420  # told all the same
    desk.send("COMMAND_INT", frame=mav.MAV_FRAME_GLOBAL, **place)
    assert only(desk, "COMMAND_ACK").result == ACCEPTED
    told = only(other, "GPS_GLOBAL_ORIGIN")
    assert (told.latitude, told.longitude, told.altitude) == (473970000, 85450000, 470000)
    assert desk.command(ORIGIN, *[math.nan] * 4, 47.4, 8.5, 480.0).result == ACCEPTED
    assert only(other, "GPS_GLOBAL_ORIGIN").altitude == 480000


@pytest.mark.parametrize(
    "place", [(math.nan, 8.5, 480.0), (91.0, 8.5, 480.0), (47.4, 8.5, math.inf), (-47.0, 8.5, 0.0)]
)
def test_an_origin_that_is_none_is_denied(two: tuple[Desk, Station], place: tuple[float, float, float]) -> None:
    desk, _ = two
    assert desk.command(ORIGIN, *[math.nan] * 4, *place).result == mav.MAV_RESULT_DENIED
    assert desk.texts[-1].startswith("origin: expected")
    assert only(desk, "GPS_GLOBAL_ORIGIN").latitude == 473977420


def test_in_flight_the_origin_stays(two: tuple[Desk, Station]) -> None:
    desk, _ = two
    desk.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1)
    assert desk.command(ORIGIN, *[math.nan] * 4, 47.4, 8.5, 480.0).result == mav.MAV_RESULT_TEMPORARILY_REJECTED
    desk.send("SET_GPS_GLOBAL_ORIGIN", latitude=474000000, longitude=85000000, altitude=470000)
    assert only(desk, "GPS_GLOBAL_ORIGIN").latitude == 473977420
    assert "stays where it is" in desk.texts[-1]


def test_a_restart_puts_the_origin_back(two: tuple[Desk, Station]) -> None:
    desk, _ = two
    desk.send("SET_GPS_GLOBAL_ORIGIN", latitude=474000000, longitude=85000000, altitude=470000)
    assert desk.command(mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1).result == ACCEPTED
    desk.received.clear()
    desk.advance(0.1)
    desk.command(mav.MAV_CMD_REQUEST_MESSAGE, mav.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN)
    assert only(desk, "GPS_GLOBAL_ORIGIN").latitude == 473977420
