"""Sticks: ranges and dead zone."""

import math

import pytest

from sitl.flight.manual_input import ManualInput, past_dead_zone


@pytest.mark.parametrize(
    ("stick", "message"),
    [
        ({"forward": 1.1}, "manual input forward: expected -1 to 1, got 1.1"),
        ({"throttle": -0.1}, "manual input throttle: expected 0 to 1, got -0.1"),
        ({"turn": math.nan}, "manual input turn: expected -1 to 1, got nan"),
        ({"tilt": 2.0}, "manual input tilt: expected 0 to 1, got 2.0"),
    ],
)
def test_sticks_out_of_range_are_errors(stick, message):
    with pytest.raises(ValueError, match=message):
        ManualInput(**stick)


def test_dead_zone_is_silent_continuous_and_reaches_the_ends():
    assert past_dead_zone(0.1) == past_dead_zone(-0.1) == 0.0
    assert past_dead_zone(0.1001) == pytest.approx(0.0, abs=1e-3)
    assert past_dead_zone(1.0) == 1.0
    assert past_dead_zone(-1.0) == -1.0


def test_throttle_counts_from_its_centre():
    assert ManualInput(throttle=0.5).up == 0.0
    assert ManualInput(throttle=1.0).up == 1.0
    assert ManualInput(throttle=0.0).up == -1.0
