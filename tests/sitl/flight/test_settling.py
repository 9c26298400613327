"""Thrust goes once the ground carries, and comes back at once when it does not."""

from itertools import pairwise

import pytest

from sitl.flight.demand import Demand
from sitl.flight.settling import Settling
from sitl.flight.view import View


@pytest.fixture
def sinking():
    demand = Demand()
    demand.velocity((0.0, 0.0, 0.4))
    return demand


def run(settling, demand, view, seconds, *, contact):
    limits = []
    for _ in range(round(seconds / 0.02)):
        view.time += 0.02
        demand.limit_thrust(1.0)  # as every new demand does
        settling.update(view, contact, demand)
        limits.append(float(demand.record[0]["thrust_limit"]))
        view.thrust = min(view.thrust, limits[-1])
    return limits


def test_thrust_ramps_down_from_what_it_is(sinking):
    limits = run(Settling(), sinking, View(thrust=0.5), 0.3, contact=True)
    assert limits[0] == pytest.approx(0.46)
    assert limits[-1] == 0.0
    assert all(a - b <= 0.0401 for a, b in pairwise(limits))


def test_thrust_is_back_when_contact_is_lost(sinking):
    settling, view = Settling(), View(thrust=0.5)
    run(settling, sinking, view, 0.1, contact=True)
    assert run(settling, sinking, view, 0.02, contact=False) == [1.0]


def test_climb_from_the_ground_has_all_thrust():
    demand = Demand()
    demand.velocity((0.0, 0.0, -0.5))
    assert run(Settling(), demand, View(thrust=0.0), 0.1, contact=True) == [1.0] * 5
