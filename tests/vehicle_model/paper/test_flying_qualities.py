"""Levels of MIL-F-8785C at the specification's own boundaries, and for the poles that the paper prints."""

import math

import pytest

from vehicle_model.linearise import Mode
from vehicle_model.paper.flying_qualities import CATEGORIES, Category, level
from vehicle_model.paper.printed import TABLE_1


def oscillation(name: str, damping: float, omega: float) -> Mode:
    return Mode(name, -damping * omega, omega * math.sqrt(1.0 - damping**2))


def of_paper(name: str) -> Mode:
    return Mode(name, TABLE_1[name].real, TABLE_1[name].imag)


def test_the_papers_short_period_is_level_2_in_cruise_and_3_elsewhere() -> None:
    assert [level(of_paper("short_period"), category) for category in CATEGORIES] == [3, 2, 3]


def test_the_papers_phugoid_is_level_1() -> None:
    assert [level(of_paper("phugoid"), category) for category in CATEGORIES] == [1, 1, 1]


@pytest.mark.parametrize(
    ("damping", "category", "expected"),
    [(0.36, "A", 1), (0.34, "A", 2), (0.24, "A", 3), (0.14, "A", 4), (0.31, "B", 1), (0.29, "B", 2), (0.19, "B", 3)],
)
def test_short_period_damping_boundaries(damping: float, category: Category, expected: int) -> None:
    assert level(oscillation("short_period", damping, 5.0), category) == expected


@pytest.mark.parametrize(("damping", "expected"), [(0.041, 1), (0.039, 2), (-0.01, 3), (-0.1, 4)])
def test_phugoid_boundaries_with_a_time_to_double_of_55_s(damping: float, expected: int) -> None:
    assert level(oscillation("phugoid", damping, 0.45), "B") == expected


@pytest.mark.parametrize(
    ("damping", "omega", "expected"), [(0.2, 3.0, 1), (0.18, 3.0, 2), (0.2, 0.9, 2), (0.01, 3.0, 3), (0.2, 0.3, 4)]
)
def test_dutch_roll_needs_damping_and_frequency_and_their_product(damping: float, omega: float, expected: int) -> None:
    assert level(oscillation("dutch_roll", damping, omega), "A") == expected


@pytest.mark.parametrize(("constant", "expected"), [(0.9, 1), (1.3, 2), (9.0, 3), (11.0, 4)])
def test_roll_time_constant_boundaries(constant: float, expected: int) -> None:
    assert level(Mode("roll", -1.0 / constant, 0.0), "C") == expected


@pytest.mark.parametrize(("double", "expected"), [(13.0, 1), (11.0, 2), (7.0, 3), (3.0, 4)])
def test_spiral_time_to_double_boundaries(double: float, expected: int) -> None:
    assert level(Mode("spiral", math.log(2.0) / double, 0.0), "C") == expected


def test_a_stable_spiral_is_level_1_and_a_diverging_roll_beyond_3() -> None:
    assert level(Mode("spiral", -0.01, 0.0), "B") == 1
    assert level(Mode("roll", 0.5, 0.0), "B") == 4
