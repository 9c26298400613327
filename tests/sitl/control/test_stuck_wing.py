"""A wing stuck at an angle: where level flight is left, checked by another trim and by flying it, and where none is."""

import functools
import math

import pytest

from sitl.control.laws import STUCK_PITCH
from sitl.control.stuck_wing import BALANCED, CASES, StuckCase, StuckFlight, stuck_wing, stuck_wing_section
from tests.sitl.control.flown import Flown, aircraft
from vehicle_model.aircraft import Aircraft
from vehicle_model.steady_flight import trim_steady

STRAIGHT, ONE_WEAK_MOTOR, DROOPED = CASES
EDGE = math.radians(0.2)  # how near its ends the pitch is found, and how far the tail rotor's part moves it


@functools.cache
def weak(share: float) -> Aircraft:
    """The aircraft with a share of its wing motors' power."""
    return aircraft().with_values({"rotors.wing.motor.max_power": share * aircraft().rotors.wing.motor.max_power})


@functools.cache
def level(degrees: float, case: StuckCase = STRAIGHT) -> tuple[StuckFlight, StuckFlight]:
    """Slowest and fastest level flight, which there must be."""
    wing = stuck_wing(aircraft(), math.radians(degrees), case)
    assert wing.slowest is not None
    assert wing.fastest is not None
    assert wing.least_sink is None
    assert wing.unbalanced < BALANCED
    return wing.slowest, wing.fastest


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
@pytest.mark.parametrize("degrees", [15.0, 45.0, 90.0])
def test_the_flights_found_balance_level_within_the_pitch_that_the_laws_give(degrees: float, case: StuckCase) -> None:
    for flight in level(degrees, case):
        assert flight.residual < BALANCED
        assert flight.sink == 0.0
        assert abs(flight.pitch) <= STUCK_PITCH + 1e-9


def test_at_45_degrees_it_flies_from_a_walk_with_the_nose_up_to_14_m_s_with_the_nose_down() -> None:
    slow, fast = level(45.0)
    assert slow.ahead == pytest.approx(3.15, abs=0.05)
    assert slow.pitch == pytest.approx(STUCK_PITCH, abs=EDGE)
    assert fast.pitch == pytest.approx(-STUCK_PITCH, abs=EDGE)


@pytest.mark.parametrize("degrees", [30.0, 45.0])
def test_the_trim_in_six_axes_has_the_same_pitch_at_the_slow_end_and_needs_more_below_it(degrees: float) -> None:
    """`trim_steady` has its own balance and a tail rotor tied to the elevator; its pitch is free, nearest to level."""
    slow, _ = level(degrees)
    angle = math.radians(degrees)
    there, slower = (trim_steady(aircraft(), slow.ahead - less, tilt=angle, pitch=None) for less in (0.0, 0.3))
    assert there.pitch == pytest.approx(slow.pitch, abs=math.radians(0.5))
    assert slower.pitch > STUCK_PITCH + math.radians(0.3)
    assert float(there.outputs["shaft_power"].sum()) == pytest.approx(slow.power, rel=0.02)


@pytest.mark.parametrize("degrees", [45.0, 60.0, 105.0])
def test_the_vehicle_told_to_stand_still_flies_at_the_end_nearest_to_it(degrees: float) -> None:
    slow, fast = level(degrees)
    nearest = slow if slow.ahead > 0.0 else fast
    flown = Flown(height=80.0)
    flown.demand.point((0.0, 0.0, -80.0), speed=5.0)
    flown.demand.heading(0.0)
    flown.fly(3.0)
    flown.airframe.stick_servo(0, math.radians(degrees))
    flown.demand.velocity((0.0, 0.0, 0.0))
    flown.fly(40.0)
    assert float(flown.now["velocity"][0]) == pytest.approx(nearest.ahead, abs=0.2)
    assert abs(flown.now["velocity"][2]) < 0.1
    assert float(flown.now["euler"][1]) == pytest.approx(nearest.pitch, abs=math.radians(0.5))


def test_a_motor_at_80_percent_costs_power_and_not_the_speeds() -> None:
    for healthy, ill in zip(level(45.0), level(45.0, ONE_WEAK_MOTOR), strict=True):
        assert ill.ahead == pytest.approx(healthy.ahead, abs=0.03)
        assert ill.power > 1.1 * healthy.power


def test_drooped_ailerons_turn_the_slipstream_down_and_let_it_fly_slower() -> None:
    assert level(15.0, DROOPED)[0].ahead < level(15.0)[0].ahead - 2.0
    assert level(45.0, DROOPED)[0].ahead < 0.0


def test_without_the_power_for_level_flight_there_is_a_certificate_and_the_least_sink() -> None:
    angle = math.radians(90.0)
    wings = [stuck_wing(weak(share), angle) for share in (0.35, 0.4, 0.5)]
    assert [wing.slowest is None for wing in wings] == [True, True, False]
    weaker, weakest = wings[1], wings[0]
    assert weaker.least_sink is not None
    assert weakest.least_sink is not None
    for wing in (weaker, weakest):
        assert wing.unbalanced > 1000.0 * BALANCED
        assert wing.least_sink is not None
        assert wing.least_sink.residual < BALANCED
        assert abs(wing.least_sink.pitch) <= STUCK_PITCH + 1e-9
    assert 0.0 < weaker.least_sink.sink < weakest.least_sink.sink
    assert weaker.unbalanced < weakest.unbalanced


def test_the_section_says_from_where_to_where_or_how_it_sinks() -> None:
    good = stuck_wing_section([stuck_wing(aircraft(), math.radians(45.0))])
    assert "Level flight exists at every one of these angles" in good
    assert "| 45° | 3.2 m/s (+20°, 2350 W) to 14.3 m/s (-20°, " in good
    bad = stuck_wing_section([stuck_wing(weak(0.4), math.radians(angle)) for angle in (0.0, 90.0)])
    assert "1 of 2 have none" in bad
    assert "| 0° | 15.2 m/s" in bad
    assert "to ≥ 30.0 m/s" in bad
    assert "| 90° | none: least sink 3.5" in bad
    assert "level flight leaves 0.00" in bad


def test_an_angle_outside_the_travel_is_refused() -> None:
    with pytest.raises(ValueError, match=r"angle: expected one of the servo's travel, -5 to 140 deg, got 150 deg"):
        stuck_wing(aircraft(), math.radians(150.0))
