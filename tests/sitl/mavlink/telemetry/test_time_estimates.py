"""Estimated times against the flights they are made for."""

import math

import pytest

from sitl.flight.manoeuvres import landing_rate
from sitl.flight.mission_items import MissionItem
from sitl.flight.mode import Mode
from sitl.flight.parameters import Parameters
from sitl.mavlink.telemetry.time_estimates import landing_time
from tests.sitl.mavlink.telemetry.observed import Observed

UNKNOWN = -1


def estimates(observed: Observed) -> tuple[int, ...]:
    """Return, land, next item, end of mission, action."""
    m = observed.sent("TIME_ESTIMATE_TO_TARGET")
    return (m.safe_return, m.land, m.mission_next_item, m.mission_end, m.commanded_action)


def time_until_disarmed(observed: Observed) -> float:
    begun = observed.simulation.time
    assert observed.simulation.run_until(lambda s: not s.flight.armed, timeout=600.0)
    return observed.simulation.time - begun


def test_on_the_ground_and_flown_from_outside_nothing_is_estimated() -> None:
    assert estimates(Observed()) == (UNKNOWN,) * 5
    assert estimates(Observed(autopilot=False)) == (UNKNOWN,) * 5
    outside = Observed(start="trim:20")
    outside.simulation.set_controls(outside.simulation.controls)
    assert estimates(outside) == (UNKNOWN,) * 5


@pytest.mark.parametrize("height", [-1.0, 0.0, 1.0, 3.0, 5.0, 8.0, 60.0])
def test_landing_time_is_the_landing_rate_added_up(height: float) -> None:
    parameters = Parameters()
    steps = 200_000
    heights = (max(height, 0.0) * (i + 0.5) / steps for i in range(steps))
    added = sum(max(height, 0.0) / steps / landing_rate(parameters, h, parameters["MPC_Z_V_AUTO_DN"]) for h in heights)
    assert landing_time(parameters, height) == pytest.approx(added, rel=1e-6, abs=1e-9)


def test_a_return_takes_about_as_long_as_estimated() -> None:
    observed = Observed(start="trim:20")
    observed.fly(30.0)
    observed.flight.return_home()
    observed.fly(0.1)
    home, _, _, _, action = estimates(observed)
    assert action == home
    assert home == pytest.approx(time_until_disarmed(observed), rel=0.35)


def test_a_landing_from_hover_takes_about_as_long_as_estimated() -> None:
    observed = Observed()
    observed.flight.takeoff(20.0)
    observed.flight.arm()
    while observed.flight.mode != Mode.HOLD:
        observed.fly(0.5)
    observed.flight.land()
    observed.fly(0.1)
    _, land, _, _, action = estimates(observed)
    assert action == land
    assert land == pytest.approx(time_until_disarmed(observed), rel=0.2)


def test_a_take_off_counts_down() -> None:
    observed = Observed()
    observed.flight.takeoff(15.0)
    observed.flight.arm()
    while not observed.flight.flying:
        observed.fly(0.1)
    climb = observed.flight.parameters["MPC_TKO_SPEED"]
    assert estimates(observed)[4] == pytest.approx(15.0 / climb, abs=1.0)
    observed.fly(5.0)
    assert estimates(observed)[4] == pytest.approx((15.0 - observed.flight.height) / climb, abs=1.0)


def test_a_go_to_is_its_distance_at_the_hover_speed() -> None:
    observed = Observed()
    observed.flight.takeoff(20.0)
    observed.flight.arm()
    while observed.flight.mode != Mode.HOLD:
        observed.fly(0.5)
    observed.flight.go_to(100.0, 0.0, -20.0, speed=4.0)
    observed.fly(0.1)
    assert estimates(observed)[2:] == (UNKNOWN, UNKNOWN, 25)


def test_a_mission_counts_its_legs_waits_and_landing() -> None:
    observed = Observed(start="trim:20")
    metres = 111_195.0  # per degree on a sphere of the Earth's mean radius
    items = [
        MissionItem(16, x=47.397742 + 1000.0 / metres, y=8.545594, z=100.0),
        MissionItem(178, param1=0.0, param2=20.0),  # an item without a place
        MissionItem(19, param1=30.0, x=47.397742 + 2000.0 / metres, y=8.545594, z=100.0),
        MissionItem(20),
    ]
    observed.flight.load_mission(items)
    observed.flight.start_mission()
    observed.fly(1.0)
    snapshot = observed.simulation.snapshot()
    speed = observed.flight.parameters["FW_AIRSPD_TRIM"]
    first = math.hypot(1000.0 - snapshot.position_ned[0], snapshot.position_ned[1]) / speed
    _, _, next_item, end, action = estimates(observed)
    assert next_item == pytest.approx(first, abs=1.0)
    after = (1000.0 + 2000.0) / speed + 30.0 + landing_time(observed.flight.parameters, 100.0)
    assert end == pytest.approx(first + after, abs=2.0)
    assert action == UNKNOWN


def test_a_circle_never_ends() -> None:
    observed = Observed(start="trim:20")
    observed.fly(0.1)
    assert estimates(observed)[2:] == (UNKNOWN, UNKNOWN, UNKNOWN)
