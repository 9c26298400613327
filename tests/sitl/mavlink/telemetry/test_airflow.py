"""Wind and the angles of the airflow: from where, to where, and which sign."""

import math
from collections.abc import Callable

import pytest

from sitl.snapshot import Snapshot
from tests.sitl.mavlink.telemetry.observed import Observed

Moment = Callable[..., Snapshot]


@pytest.fixture
def observed() -> Observed:
    return Observed()


def test_wind_cov_blows_to(moment: Moment, observed: Observed) -> None:
    m = observed.sent("WIND_COV", moment())
    assert (m.time_usec, m.wind_x, m.wind_y, m.wind_z, m.wind_alt) == (12347500, 1.0, -2.0, 0.0, 512.25)
    assert math.isnan(m.var_horiz)
    assert math.isnan(m.var_vert)
    assert (m.horiz_accuracy, m.vert_accuracy) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("wind", "direction", "speed"),
    [
        ((1.0, -2.0, 0.5), 116.565, math.sqrt(5.0)),  # blows to north and west: from south-east
        ((-3.0, 0.0, 0.0), 0.0, 3.0),  # a north wind
        ((0.0, 4.0, 0.0), 270.0, 4.0),  # a west wind
        ((0.0, 0.0, -1.0), 0.0, 0.0),
    ],
)
def test_wind_comes_from(
    moment: Moment, observed: Observed, wind: tuple[float, float, float], direction: float, speed: float
) -> None:
    m = observed.sent("WIND", moment(wind_ned=wind))
    assert (m.direction, m.speed, m.speed_z) == pytest.approx((direction, speed, wind[2]), abs=1e-3)


def test_angles_of_attack_and_sideslip(moment: Moment, observed: Observed) -> None:
    m = observed.sent("AOA_SSA", moment())
    assert m.time_usec == 12347500
    assert pytest.approx(math.degrees(math.atan(2.5 / 18.0))) == m.AOA
    assert pytest.approx(math.degrees(math.asin(1.5 / math.sqrt(18.0**2 + 1.5**2 + 2.5**2)))) == m.SSA


def test_without_air_there_are_no_angles(moment: Moment, observed: Observed) -> None:
    snapshot = moment()
    snapshot.outputs["velocity_air_body"] = (-0.01, 0.0, 0.05)
    m = observed.sent("AOA_SSA", snapshot)
    assert (m.AOA, m.SSA) == (0.0, 0.0)


def test_the_wind_is_known_on_the_ground_too() -> None:
    m = Observed(wind=(2.0, -1.0, 0.0)).sent("WIND_COV")
    assert (m.wind_x, m.wind_y) == pytest.approx((2.0, -1.0))
