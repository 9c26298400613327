"""Home and the local frame's origin on the map."""

import math

import pytest

from tests.sitl.mavlink.observed import Observed


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
