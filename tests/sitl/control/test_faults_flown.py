"""Flying on with a fault (issue 3): a motor that lost 20 % of its thrust, a tilt servo stuck at 45 deg."""

import functools
import math

import numpy as np
import pytest

from tests.sitl.control.flown import Flown, at_a_limit

HEIGHT = 80.0
STUCK = math.radians(45.0)
LEFT, RIGHT, TAIL = 0, 1, 2


@pytest.mark.parametrize("rotor", [LEFT, RIGHT, TAIL])
def test_hover_goes_on_with_a_fifth_of_a_rotors_thrust_lost(rotor: int) -> None:
    flown = Flown(height=HEIGHT)
    flown.demand.point((0.0, 0.0, -HEIGHT), speed=5.0)
    flown.demand.heading(0.0)
    flown.fly(5.0)
    failed = flown.time
    flown.airframe.lose_thrust(rotor, 0.2)
    flown.fly(25.0)
    rows = flown.history(failed)
    assert np.linalg.norm(rows["position"] - (0.0, 0.0, -HEIGHT), axis=1).max() < 3.0
    assert np.degrees(np.abs(rows["euler"])).max() < 15.0
    np.testing.assert_allclose(flown.now["position"], (0.0, 0.0, -HEIGHT), atol=0.1)
    assert max(at_a_limit(rows).values()) < 1.0
    if rotor != TAIL:
        assert flown.now["throttle"][rotor] > 1.1 * flown.now["throttle"][1 - rotor]


@pytest.mark.parametrize("rotor", [LEFT, RIGHT, TAIL])
def test_with_the_loss_in_cruise_it_still_comes_back_to_hover_at_a_point(rotor: int) -> None:
    flown = Flown(20.0, height=HEIGHT)
    flown.demand.leg((0.0, 0.0, -HEIGHT), (3000.0, 0.0, -HEIGHT), speed=20.0, cruise=True)
    flown.fly(5.0)
    failed = flown.time
    flown.airframe.lose_thrust(rotor, 0.2)
    flown.fly(10.0)
    point = (float(flown.now["position"][0]) + 600.0, 0.0, -HEIGHT)
    flown.demand.point(point, speed=20.0, cruise=True)
    flown.fly(70.0)
    rows = flown.history(failed)
    assert np.abs(rows["position"][:, 2] + HEIGHT).max() < 5.0
    assert np.abs(rows["position"][:, 1]).max() < 3.0
    assert np.degrees(np.abs(rows["euler"])).max() < 15.0
    assert rows["wetted_margin"].min() > 0.0
    np.testing.assert_allclose(flown.now["position"], point, atol=0.5)
    assert math.degrees(flown.now["tilt"]) > 70.0


@functools.cache
def stuck(how: str, wind: tuple[float, float, float]) -> np.ndarray:
    """80 s with the wing stuck at 45 deg, caught there braking or driven there in hover.

    After 20 s told to sink at 0.5 m/s, nose into the wind.
    """
    flown = Flown(0.0 if how == "hover" else 20.0, height=HEIGHT, wind=wind)
    if how == "hover":
        flown.demand.point((0.0, 0.0, -HEIGHT), speed=5.0)
        flown.fly(5.0)
        flown.airframe.stick_servo(0, STUCK)
    else:
        flown.demand.leg((0.0, 0.0, -HEIGHT), (3000.0, 0.0, -HEIGHT), speed=20.0, cruise=True)
        flown.fly(5.0)
        flown.demand.point((float(flown.now["position"][0]) + 500.0, 0.0, -HEIGHT), speed=20.0, cruise=True)
        flown.until(lambda row: row["tilt"] > STUCK, timeout=60.0)
        flown.airframe.stick_servo(0)
    failed = flown.time
    flown.fly(20.0)
    flown.demand.velocity((0.0, 0.0, 0.5))
    flown.demand.heading(math.atan2(-wind[1], -wind[0]) if any(wind) else 0.0)
    flown.fly(60.0)
    rows = flown.history(failed)
    assert math.degrees(rows["tilt"][-1]) == pytest.approx(45.0, abs=1.0)
    return rows


CASES = [(how, wind) for how in ("braking", "hover") for wind in ((0.0, 0.0, 0.0), (5.0, 0.0, 0.0), (-5.0, 3.0, 0.0))]


@pytest.mark.parametrize(("how", "wind"), CASES)
def test_with_the_tilt_stuck_at_45_degrees_the_attitude_is_kept(how: str, wind: tuple[float, float, float]) -> None:
    rows = stuck(how, wind)
    roll, pitch = np.degrees(np.abs(rows["euler"][:, :2])).max(axis=0)
    assert roll < 40.0  # it may turn round for its point or for its descent: no further than any turn, 35 deg
    assert pitch < 30.0
    assert max(at_a_limit(rows).values()) < 1.0


@pytest.mark.parametrize(("how", "wind"), CASES)
def test_with_the_tilt_stuck_at_45_degrees_it_sinks_as_told(how: str, wind: tuple[float, float, float]) -> None:
    """Below 0.6 m/s is a touch-down that the issue allows; the gear sees the mean of the last half minute's swings."""
    late = stuck(how, wind)[-1500:]
    sinking = late["velocity"][:, 2]
    assert 0.2 < sinking.mean() < 0.6
    assert sinking.min() > 0.1
    assert sinking.max() < 0.8
