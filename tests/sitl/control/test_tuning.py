"""Gains tuned to margins: what is enough stays, what falls short is reshaped, what stays short is named."""

from dataclasses import replace
from pathlib import Path

import pytest

from sitl.control.corridor import CorridorFlight, airspeeds, analyse_point, corridor
from sitl.control.design import Design, design_with
from sitl.control.shape import DEFAULT_SHAPE, Shape
from sitl.control.tuning import TUNED, counts, missed, tuned
from tests.sitl.control.flown import aircraft, design
from tests.sitl.control.smaller import write_smaller
from vehicle_model.aircraft import load_aircraft
from vehicle_model.force_map import stall_speed


def shaped(shape: Shape) -> Design:
    """The paper's aircraft with another shape."""
    return design_with(aircraft(), design().table, design().axes, shape)


def test_the_papers_aircraft_keeps_the_default_shape() -> None:
    assert design().shape == DEFAULT_SHAPE
    assert design().missed == ()
    assert design().schedule.tobytes() == shaped(DEFAULT_SHAPE).schedule.tobytes()


def test_what_falls_short_is_named_worst_first() -> None:
    hasty = shaped(Shape(rate=0.9, wing_borne_attitude=0.7))
    points = [analyse_point(aircraft(), hasty, 25.0, 0.0)]
    found = missed(points)
    assert found
    assert all(text.split(" ")[0] in points[0].margins and "at 25 m/s: " in text for text in found)
    worst = min(points[0].margins.values(), key=lambda each: min(each.gain_db / 6.0, each.phase / 0.785))
    assert f"{worst.gain_db:.1f} dB" in " ".join(found[:2])
    swinging = replace(points[0], unsettled=1.0, loop=analyse_point(aircraft(), shaped(Shape(rate=2.5)), 0.0, 0.0).loop)
    assert missed([swinging]) == ("unstable at 25 m/s",)


def test_a_point_that_the_wing_does_not_bear_counts_for_nothing() -> None:
    """Level flight is 12 m/s; sinking at 2 m/s there would stall the wing, and the laws go faster instead."""
    point = analyse_point(aircraft(), design(), 12.0, -2.0)
    assert point.flown[0] > 12.5
    assert not point.held
    assert not counts(point)
    assert missed([point]) == ()


def test_loops_reopened_with_another_design_are_those_it_has_when_flown() -> None:
    other = shaped(Shape(rate=0.36, upwash_filter=0.7, wing_borne_vertical=0.2, rate_integral=0.1))
    flight = CorridorFlight(aircraft(), design(), 22.0, 2.0)
    foretold = flight.reopened(flight.analyse(), other).margins
    for name, margins in analyse_point(aircraft(), other, 22.0, 2.0).margins.items():
        assert min(foretold[name].gain_db, 30.0) == pytest.approx(min(margins.gain_db, 30.0), abs=0.2), name
        assert min(foretold[name].phase, 2.0) == pytest.approx(min(margins.phase, 2.0), abs=0.02), name


def test_an_aircraft_that_falls_short_is_reshaped_until_it_does_not() -> None:
    """Slower servos and more inertia: roll and pitch lack up to 3 dB at speed with the default shape."""
    mass = aircraft().mass_properties
    sluggish = aircraft().with_values({
        "mass_properties.ixx": 1.4 * mass.ixx, "mass_properties.iyy": 1.5 * mass.iyy,
        "mass_properties.izz": 1.4 * mass.izz,
        "servos.aileron.time_constant": 0.07, "servos.elevator.time_constant": 0.07,
    })  # fmt: skip
    points, told = [(16.0, 0.0), (30.0, 0.0), (30.0, 2.0)], []
    table, axes = design().table, design().axes  # of the same mass and wing: the map is the same
    before = [analyse_point(sluggish, design_with(sluggish, table, axes, DEFAULT_SHAPE), *point) for point in points]
    assert missed(before)
    made = tuned(sluggish, table, axes, told.append, points)
    assert made.missed == ()
    assert missed([analyse_point(sluggish, made, *point) for point in points]) == ()
    for name, (low, high) in TUNED.items():
        assert low <= getattr(made.shape, name) <= high, name
    assert any("loops short" in line for line in told)
    assert told[-1] == "gains: all loops have their margins"
    again = tuned(sluggish, table, axes, None, points)
    assert again.shape == made.shape  # bit for bit


def test_what_cannot_be_reached_is_kept_as_near_as_it_comes_and_named() -> None:
    """Servos of a third of a second: no loop around them is fast enough for what flies so fast."""
    lame = aircraft().with_values({"servos.aileron.time_constant": 0.33, "servos.elevator.time_constant": 0.33})
    points = [(25.0, 0.0)]
    made = tuned(lame, design().table, design().axes, None, points)
    assert made.missed
    assert made.missed == missed([analyse_point(lame, made, 25.0, 0.0)])
    assert "out of reach" in made.summary


def test_a_smaller_aircraft_has_a_slower_corridor(tmp_path: Path) -> None:
    """Froude: speeds go with the square root of the size."""
    write_smaller(tmp_path / "smaller.toml", 0.64)
    smaller = load_aircraft(tmp_path / "smaller.toml")
    assert smaller.mass_properties.mass == pytest.approx(0.64**3 * aircraft().mass_properties.mass)
    assert stall_speed(smaller) == pytest.approx(0.8 * stall_speed(aircraft()), rel=1e-6)
    assert airspeeds(aircraft())[:3] == (0.0, 2.0, 4.0)
    assert airspeeds(smaller) == pytest.approx([0.8 * speed for speed in airspeeds(aircraft())], abs=0.06)
    assert set(corridor(smaller)) <= set(corridor(smaller, 4))
