"""One-minus-cosine gusts (issue 3): no stall from 20 m/s on; slower or in transition it may stall but recovers."""

import functools

import numpy as np
import pytest

from tests.sitl.control.flown import Flown
from vehicle_model.wind import Gust

Vector = tuple[float, float, float]
HEIGHT = 100.0
LENGTH = 50.0  # [m]
UP, DOWN, HEAD_ON = (0.0, 0.0, -4.0), (0.0, 0.0, 4.0), (-8.0, 0.0, 0.0)
MEETS = 20.0  # [s]


@functools.cache
def through(airspeed: float, gust: Vector) -> np.ndarray:
    """The flight north from half a second before a gust to 20 s later."""
    flown = Flown(airspeed, height=HEIGHT, gusts=[Gust(MEETS, LENGTH, gust)])
    flown.demand.leg((0.0, 0.0, -HEIGHT), (9000.0, 0.0, -HEIGHT), speed=airspeed, cruise=airspeed >= 15.0)
    flown.fly(MEETS + 20.0)
    return flown.history(MEETS - 0.5)


@pytest.mark.parametrize("gust", [UP, DOWN, HEAD_ON])
@pytest.mark.parametrize("airspeed", [20.0, 25.0, 30.0])
def test_from_20_m_s_on_every_strip_stays_below_its_maximum_lift(airspeed: float, gust: Vector) -> None:
    rows = through(airspeed, gust)
    assert rows["margin"].min() > 0.0
    # It was felt: the gust is there, and shifts the angle of attack or the airspeed.
    felt = rows["margin"].max() - rows["margin"].min() if gust[2] else np.radians(np.ptp(rows["airspeed"]))
    assert np.degrees(felt) > 1.0
    assert np.abs(rows["position"][:, 2] + HEIGHT).max() < 3.0


@pytest.mark.parametrize("gust", [UP, DOWN, HEAD_ON])
@pytest.mark.parametrize("airspeed", [10.0, 13.0])
def test_slower_the_gust_may_stall_the_wing_but_less_than_30_m_are_lost(airspeed: float, gust: Vector) -> None:
    rows = through(airspeed, gust)
    assert (rows["position"][:, 2] + HEIGHT).max() < 30.0
    assert_recovered(rows, airspeed)


@pytest.mark.parametrize("gust", [UP, DOWN, HEAD_ON])
@pytest.mark.parametrize("start", [2.0, 4.0, 6.0])
def test_a_gust_in_the_middle_of_the_front_transition_costs_less_than_30_m(start: float, gust: Vector) -> None:
    flown = Flown(height=HEIGHT, gusts=[Gust(start, LENGTH, gust)])
    flown.demand.leg((0.0, 0.0, -HEIGHT), (9000.0, 0.0, -HEIGHT), speed=25.0, cruise=True)
    flown.fly(40.0)
    rows = flown.history()
    met = rows[round(start / 0.02)]["airspeed"]
    assert 2.0 < met < 20.0  # in transition indeed
    assert (rows["position"][:, 2] + HEIGHT).max() < 30.0
    assert_recovered(rows, 25.0)


def assert_recovered(rows: np.ndarray, airspeed: float) -> None:
    """In the end it flies on as before the gust, and never was near rolling over."""
    last = rows[-1]
    assert last["airspeed"] == pytest.approx(airspeed, abs=0.3)
    assert last["position"][2] == pytest.approx(-HEIGHT, abs=0.5)
    assert last["wetted_margin"] > 0.0
    assert np.degrees(np.abs(rows["euler"][:, :2])).max() < 20.0
