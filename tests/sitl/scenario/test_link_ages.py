"""Silence of links is measured in the time of those who are silent."""

import pytest

from sitl.flight.failsafe import Links
from sitl.flight.manual_input import Sticks
from sitl.scenario.link_ages import LinkAges


@pytest.mark.parametrize("pace", [0.5, 1.0, 10.0])
def test_who_speaks_is_as_old_as_by_his_own_clock(pace: float) -> None:
    ages, links, sticks = LinkAges(), Links(), Sticks()
    ages.station_received, ages.setpoint_received, sticks.received = 100.0, 104.0, 105.0
    ages.refresh(links, sticks, 110.0, pace)
    assert (links.ground_station, links.offboard, links.manual_control) == (10.0 / pace, 6.0 / pace, 5.0 / pace)


def test_what_a_scenario_cuts_is_silent_by_its_own_time() -> None:
    ages, links = LinkAges(), Links()
    ages.switch("ground_station", up=False, time=100.0)
    ages.refresh(links, Sticks(), 110.0, 10.0)
    assert links.ground_station == 10.0
