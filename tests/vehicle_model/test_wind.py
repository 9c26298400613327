"""Wind against the formulas of MIL-F-8785C and CS-25.341, and what one gust must do from start to end."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vehicle_model.earth import make_environment
from vehicle_model.wind import (
    REFERENCE_HEIGHT,
    TERMINAL_ROUGHNESS,
    Gust,
    gust_shape,
    make_wind,
    shear_factor,
    wind_step,
)

FOOT = 0.3048
DT = 0.0025


def world() -> np.ndarray:
    return make_environment("flat", latitude=0.8, longitude=0.1, height_ellipsoid=0.0)


def felt(wind: np.ndarray, time: float = 0.0, height: float = 50.0, airspeed: float = 0.0) -> np.ndarray:
    environment = world()
    wind_step(wind, time, height, airspeed, DT, environment)
    return environment["wind_ned"][0]


def history(wind: np.ndarray, airspeed: float, seconds: float) -> np.ndarray:
    """Wind (n, 3) after each step."""
    environment, rows = world(), np.empty((round(seconds / DT), 3))
    for step in range(len(rows)):
        wind_step(wind, (step + 1) * DT, 50.0, airspeed, DT, environment)
        rows[step] = environment["wind_ned"][0]
    return rows


def test_without_roughness_the_wind_is_the_same_at_every_height() -> None:
    wind = make_wind((3.0, -4.0, 0.5))
    for height in (0.0, 2.0, 500.0):
        np.testing.assert_array_equal(felt(wind, height=height), [3.0, -4.0, 0.5])


@pytest.mark.parametrize("feet", [3.0, 10.0, 20.0, 100.0, 1000.0])
def test_profile_is_that_of_the_specification(feet: float) -> None:
    wind = make_wind((6.0, 8.0, 0.5), roughness=TERMINAL_ROUGHNESS)
    speed = 10.0 * math.log(feet / 0.15) / math.log(20.0 / 0.15)
    north, east, down = felt(wind, height=feet * FOOT)
    assert math.hypot(north, east) == pytest.approx(speed, rel=1e-12)
    assert math.atan2(east, north) == pytest.approx(math.atan2(8.0, 6.0), rel=1e-12)
    assert down == 0.5


def test_profile_ends_where_the_specification_does() -> None:
    for beyond, end in ((0.0, 3.0), (-5.0, 3.0), (2000.0, 1000.0)):
        ends = shear_factor(end * FOOT, REFERENCE_HEIGHT, TERMINAL_ROUGHNESS)
        assert shear_factor(beyond * FOOT, REFERENCE_HEIGHT, TERMINAL_ROUGHNESS) == ends


def test_at_its_own_reference_height_the_wind_is_the_stated_one() -> None:
    wind = make_wind((5.0, 0.0, 0.0), reference_height=10.0, roughness=0.03)
    assert felt(wind, height=10.0)[0] == pytest.approx(5.0, rel=1e-12)
    assert felt(wind, height=2.0)[0] == pytest.approx(5.0 * math.log(2.0 / 0.03) / math.log(10.0 / 0.03), rel=1e-12)


@given(st.floats(-10.0, 200.0), st.floats(1.0, 150.0))
def test_gust_has_the_shape_of_the_specification(distance: float, length: float) -> None:
    share = gust_shape(distance, length)
    if 0.0 <= distance <= length:
        # CS-25.341 writes it with the gradient distance H = L/2.
        assert share == pytest.approx(0.5 * (1.0 - math.cos(math.pi * distance / (length / 2.0))), abs=1e-12)
    else:
        assert share == 0.0


def test_gust_peaks_in_its_middle() -> None:
    assert gust_shape(25.0, 50.0) == 1.0


@pytest.mark.parametrize("start", [0.0, 0.5, 0.501])
def test_in_flight_the_gust_runs_with_the_distance_flown_through_the_air(start: float) -> None:
    wind = make_wind((1.0, 2.0, 0.0), gusts=[Gust(start, 50.0, (-8.0, 0.0, 4.0))])
    rows = history(wind, 20.0, 4.0)
    time = DT * np.arange(1, len(rows) + 1)
    distance = 20.0 * (time - start)
    inside = (distance >= 0.0) & (distance <= 50.0)
    share = np.where(inside, 0.5 * (1.0 - np.cos(2.0 * np.pi * distance / 50.0)), 0.0)
    np.testing.assert_allclose(rows, np.array([1.0, 2.0, 0.0]) + share[:, None] * [-8.0, 0.0, 4.0], atol=1e-9)
    assert rows[:, 2].max() == pytest.approx(4.0, abs=1e-3)


@pytest.mark.parametrize(("steady", "airspeed", "passes"), [(5.0, 0.0, 10.0), (0.0, 0.0, 50.0), (5.0, 10.0, 5.0)])
def test_gust_passes_with_airspeed_or_wind_or_at_least_a_metre_a_second(
    steady: float, airspeed: float, passes: float
) -> None:
    wind = make_wind((steady, 0.0, 0.0), gusts=[Gust(0.0, 50.0, (0.0, 0.0, 2.0))])
    rows = history(wind, airspeed, 60.0)
    felt_for = DT * np.count_nonzero(rows[:, 2] > 1e-9)
    assert felt_for == pytest.approx(passes, abs=0.01)


def test_gusts_add_up_and_each_has_its_own_progress() -> None:
    first, second = Gust(0.2, 30.0, (0.0, 3.0, 0.0)), Gust(0.7, 60.0, (0.0, 0.0, 4.0))
    both = history(make_wind(gusts=[first, second]), 20.0, 5.0)
    apart = history(make_wind(gusts=[first]), 20.0, 5.0) + history(make_wind(gusts=[second]), 20.0, 5.0)
    np.testing.assert_allclose(both, apart, atol=1e-12)


def test_a_flight_begun_again_meets_the_gust_again() -> None:
    wind = make_wind(gusts=[Gust(0.5, 50.0, (0.0, 0.0, 4.0))])
    once = history(wind, 20.0, 4.0)
    np.testing.assert_array_equal(history(wind, 20.0, 4.0), once)


def test_wrong_winds_are_refused_by_name() -> None:
    for message, make in (
        ("steady_ned: expected three finite numbers", lambda: make_wind((1.0, 2.0))),
        ("steady_ned: expected three finite numbers", lambda: make_wind((1.0, math.nan, 0.0))),
        ("roughness: expected 0 to less than 0.9144 m, got -1 m", lambda: make_wind(roughness=-1.0)),
        ("roughness: expected 0 to less than 0.9144 m, got 1 m", lambda: make_wind(roughness=1.0)),
        ("reference_height: expected 0.9144 to 304.8 m, got 0.5 m", lambda: make_wind(reference_height=0.5)),
        (r"gusts\[0\].length: expected a length above 0 m, got 0 m",
         lambda: make_wind(gusts=[Gust(0.0, 0.0, (0.0, 0.0, 1.0))])),
        (r"gusts\[1\].amplitude_ned: expected three finite numbers",
         lambda: make_wind(gusts=[Gust(0.0, 9.0, (0.0, 0.0, 1.0)), Gust(0.0, 9.0, (0.0, 0.0, math.inf))])),
        (r"gusts\[0\].start: expected a time in s, got nan",
         lambda: make_wind(gusts=[Gust(math.nan, 9.0, (0.0, 0.0, 1.0))])),
        ("gusts: expected at most 8, got 9", lambda: make_wind(gusts=[Gust(0.0, 9.0, (0.0, 0.0, 1.0))] * 9)),
    ):  # fmt: skip
        with pytest.raises(ValueError, match=message):
            make()
