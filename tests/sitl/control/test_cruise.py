"""What cruise must show (issue 3): height, track and airspeed held from 15 to 30 m/s, circles flown as drawn."""

import math

import numpy as np
import pytest

from tests.sitl.control.flown import Flown, at_a_limit, turned

HEIGHT = 100.0
GRAVITY = 9.80665
AIRSPEEDS = [15.0, 17.0, 20.0, 25.0, 30.0]


@pytest.mark.parametrize("wind", [(0.0, 8.0, 0.0), (0.0, -8.0, 0.0), (-8.0, 0.0, 0.0), (8.0, 0.0, 0.0)])
@pytest.mark.parametrize("airspeed", AIRSPEEDS)
def test_a_leg_in_8_m_s_of_wind_is_held_within_1_m_of_height_and_3_m_of_track(
    airspeed: float, wind: tuple[float, float, float]
) -> None:
    flown = Flown(airspeed, height=HEIGHT, wind=wind)
    flown.demand.leg((0.0, 0.0, -HEIGHT), (9000.0, 0.0, -HEIGHT), speed=airspeed, cruise=True)
    flown.fly(25.0)
    settled = flown.time
    flown.fly(40.0)
    leg = flown.history(settled)
    assert np.abs(leg["position"][:, 2] + HEIGHT).max() < 1.0
    assert np.abs(leg["position"][:, 1]).max() < 3.0
    np.testing.assert_allclose(leg["airspeed"], airspeed, atol=0.5)
    # The wind triangle: the nose is turned into the wind by what the track asks for, and there is no sideslip.
    crab = math.asin(-wind[1] / airspeed)
    assert np.degrees(np.abs(turned(leg["euler"][:, 2], crab))).max() < 1.0
    along = wind[0] + math.sqrt(airspeed**2 - wind[1] ** 2)
    np.testing.assert_allclose(leg["velocity"][:, 0], along, atol=0.5)
    assert max(at_a_limit(leg).values()) < 1.0
    assert leg["wetted_margin"].min() > 0.0


@pytest.mark.parametrize("sense", [1.0, -1.0])
@pytest.mark.parametrize("airspeed", AIRSPEEDS)
def test_a_circle_of_30_degrees_of_bank_is_flown_at_its_radius_coordinated(airspeed: float, sense: float) -> None:
    """V^2/(g R) = tan(bank) in a calm."""
    radius = airspeed**2 / (GRAVITY * math.tan(math.radians(30.0)))
    flown = Flown(airspeed, height=HEIGHT)
    flown.demand.circle((0.0, sense * radius, -HEIGHT), sense * radius, speed=airspeed, cruise=True)
    flown.fly(30.0)
    settled = flown.time
    flown.fly(2.0 * math.pi * radius / airspeed)
    circle = flown.history(settled)
    off = np.hypot(circle["position"][:, 0], circle["position"][:, 1] - sense * radius) - radius
    assert np.abs(off).max() < 1.0
    assert np.abs(circle["position"][:, 2] + HEIGHT).max() < 1.0
    np.testing.assert_allclose(np.degrees(sense * circle["euler"][:, 0]), 30.0, atol=1.5)
    np.testing.assert_allclose(circle["airspeed"], airspeed, atol=0.2)
    course = np.arctan2(circle["velocity"][:, 1], circle["velocity"][:, 0])
    sideslip = (course - circle["euler"][:, 2] + math.pi) % (2.0 * math.pi) - math.pi
    assert np.degrees(np.abs(sideslip)).max() < 3.0
    np.testing.assert_allclose(circle["rates"][:, 2] * sense > 0.0, True)  # clockwise if the radius is positive


@pytest.mark.parametrize("airspeed", [20.0, 30.0])
def test_a_climb_of_3_m_s_is_flown_at_its_rate_and_airspeed_and_ends_at_its_height(airspeed: float) -> None:
    flown = Flown(airspeed, height=HEIGHT)
    flown.demand.limits(climb_rate=3.0, sink_rate=2.0, max_bank=math.radians(35.0))
    flown.demand.leg((0.0, 0.0, -HEIGHT), (9000.0, 0.0, -HEIGHT), speed=airspeed, cruise=True)
    flown.fly(5.0)
    start = flown.time
    flown.demand.leg((0.0, 0.0, -HEIGHT), (9000.0, 0.0, -HEIGHT - 40.0), speed=airspeed, cruise=True)
    flown.fly(30.0)
    climb = flown.history(start)
    steady = climb[(climb["time"] > start + 4.0) & (climb["position"][:, 2] > -HEIGHT - 30.0)]
    np.testing.assert_allclose(steady["velocity"][:, 2], -3.0, atol=0.2)
    np.testing.assert_allclose(climb["airspeed"], airspeed, atol=0.7)
    assert climb["position"][:, 2].min() > -HEIGHT - 41.0
    np.testing.assert_allclose(climb[-1]["position"][2], -HEIGHT - 40.0, atol=0.1)


def test_a_speed_demand_is_followed_from_30_down_to_15_m_s_and_up_again() -> None:
    flown = Flown(30.0, height=HEIGHT)
    for speed in (30.0, 15.0, 30.0):
        flown.demand.leg((0.0, 0.0, -HEIGHT), (9000.0, 0.0, -HEIGHT), speed=speed, cruise=True)
        flown.until(lambda row, speed=speed: abs(row["airspeed"] - speed) < 0.3, timeout=40.0)
    flown.fly(10.0)
    assert flown.now["airspeed"] == pytest.approx(30.0, abs=0.1)
    assert np.abs(flown.history()["position"][:, 2] + HEIGHT).max() < 1.0
