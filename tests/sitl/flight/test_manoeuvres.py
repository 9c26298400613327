"""Hold, take-off, landing and orbit: what they ask for that a whole flight does not show."""

import math

import pytest

from sitl.control.records import Yaw
from sitl.flight.demand import Demand
from sitl.flight.landed import LandedState
from sitl.flight.manoeuvres import Hold, Landing, Orbit, landing_rate
from sitl.flight.parameters import Parameters
from sitl.flight.view import View


def test_landing_rate_is_slow_near_the_ground_and_changes_smoothly():
    parameters = Parameters()
    assert landing_rate(parameters, 50.0, 1.5) == 1.5
    assert landing_rate(parameters, 3.0, 1.5) == 0.4
    assert landing_rate(parameters, -5.0, 1.5) == 0.4
    assert landing_rate(parameters, 3.1, 1.5) == pytest.approx(0.43)


@pytest.mark.parametrize("ground", [-4.0, 6.0])
def test_landing_ends_on_the_ground_wherever_it_is(vehicle, ground):
    vehicle.begin(height=20.0)
    vehicle.ground = ground
    vehicle.flight.land()
    vehicle.run_until(lambda: not vehicle.flight.armed, timeout=100.0)
    assert vehicle.view.down == ground


def test_landing_elsewhere_first_flies_there(vehicle):
    vehicle.begin(height=20.0)
    vehicle.flight.land((60.0, 30.0))
    vehicle.run_until(lambda: vehicle.view.down > -18.0)
    assert math.hypot(vehicle.view.north - 60.0, vehicle.view.east - 30.0) < 1.5
    vehicle.run_until(lambda: not vehicle.flight.armed, timeout=100.0)


def test_landing_that_cannot_reach_its_point_descends_all_the_same():
    parameters, demand = Parameters(), Demand()
    landing = Landing(parameters, demand)
    view = View(north=4.0, down=-30.0, tilt=math.pi / 2)
    landing.start(view, (0.0, 0.0), 0.0)
    for tick in range(1500):
        view.time = 0.02 * tick
        landing.update(view, LandedState.IN_AIR)
        assert landing.descending == (view.time > 20.0)


def test_hover_that_cannot_stop_holds_where_it_is_in_the_end():
    parameters, demand = Parameters(), Demand()
    hold = Hold(parameters, demand)
    view = View(down=-30.0, vn=3.0, tilt=math.pi / 2)
    hold.start(view, cruise=False)
    for tick in range(2500):
        view.time, view.north = 0.02 * tick, 0.06 * tick
        hold.update(view)
        assert hold.settled == (view.time > 40.0)


def test_circle_is_widened_where_speed_and_wind_do_not_allow_it():
    demand = Demand()
    hold = Hold(Parameters(), demand)
    view = View(down=-60.0, vn=20.0, airspeed=20.0, wind_east=8.0)
    hold.start(view, cruise=True, radius=-60.0)
    hold.update(view)
    assert demand.record[0]["radius"] == pytest.approx(-114.2, abs=0.1)  # -(28 m/s)^2 / (g tan 35 deg)
    hold.airspeed = 25.0
    hold.update(view)
    assert demand.record[0]["radius"] == pytest.approx(-158.6, abs=0.1)


def test_nose_goes_into_the_wind_if_asked_to(make_vehicle):
    vehicle = make_vehicle(WV_EN=1).begin(height=30.0)
    vehicle.run(1.0)
    assert vehicle.record["yaw"] == Yaw.WEATHERVANE


def test_orbit_in_hover_may_be_as_tight_as_its_speed_allows():
    orbit = Orbit(Parameters(), Demand())
    orbit.start(View(), (0.0, 0.0), -30.0, 20.0, cruise=False, speed=5.0)
    assert orbit.smallest_radius(cruise=False, wind=8.0) == pytest.approx(12.7, abs=0.1)
    assert orbit.smallest_radius(cruise=True, wind=0.0) == pytest.approx(
        20.0**2 / (9.80665 * math.tan(math.radians(35.0)))
    )
