"""Lift and drag of a strip: limits of thin airfoils and flat plates, continuity, signs and the maximum of lift."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vehicle_model.aircraft import load_aircraft
from vehicle_model.records import SURFACE
from vehicle_model.surface import coefficients, max_lift_angle, strip_force

AIRCRAFT = load_aircraft()
SURFACES = dict(zip(AIRCRAFT.surface_names, AIRCRAFT.vehicle[0]["surfaces"].copy(), strict=False))
WING = next(surface for name, surface in SURFACES.items() if name.startswith("left"))
ALL = list(SURFACES.items())

angle = st.floats(-math.pi, math.pi)


def lift_drag(surface: np.void, angle: float, flap: float = 0.0) -> tuple[float, float]:
    return coefficients(surface, math.sin(angle), math.cos(angle), flap)


def flapped() -> np.void:
    surface = np.array([WING], SURFACE)[0]
    surface["flap_effectiveness"] = 0.5
    return surface


@pytest.mark.parametrize("surface", [each for _, each in ALL], ids=[name for name, _ in ALL])
def test_square_to_the_flow_it_is_a_flat_plate(surface: np.void) -> None:
    for normal in (0.5 * math.pi, -0.5 * math.pi):
        lift, drag = lift_drag(surface, normal)
        assert abs(lift) < 1e-12
        assert 1.2 <= drag <= 2.0  # Hoerner; Khan and Nahon: 1.98 for a plate of infinite span, 1.2 for a square one
    for reversed_flow in (math.pi, -math.pi):
        lift, drag = lift_drag(surface, reversed_flow)
        assert abs(lift) < 1e-12
        assert 0.0 < drag < 0.1


@given(angle)
def test_curves_mirror_about_zero_angle(angle: float) -> None:
    lift, drag = lift_drag(WING, angle)
    mirrored_lift, mirrored_drag = lift_drag(WING, -angle)
    assert (mirrored_lift, mirrored_drag) == (-lift, drag)
    assert drag > 0.0


def test_attached_flow_has_the_lift_slope_and_a_parabolic_polar() -> None:
    for degrees in (-6.0, -1.0, 0.5, 4.0):
        lift, drag = lift_drag(WING, math.radians(degrees))
        assert lift == pytest.approx(float(WING["lift_slope"]) * math.sin(math.radians(degrees)), rel=1e-12)
        assert drag == pytest.approx(float(WING["zero_lift_drag"] + WING["induced_drag"] * lift**2), rel=1e-12)


def test_separated_flow_is_sin_2_alpha() -> None:
    for degrees in (45.0, 60.0, 120.0, 150.0):
        lift, drag = lift_drag(WING, math.radians(degrees))
        assert lift == pytest.approx(float(WING["plate_lift"]) * math.sin(math.radians(2.0 * degrees)), abs=1e-12)
        assert drag == pytest.approx(
            float(WING["zero_lift_drag"] + WING["plate_drag"] * math.sin(math.radians(degrees)) ** 2)
        )


@pytest.mark.parametrize("surface", [each for _, each in ALL], ids=[name for name, _ in ALL])
def test_curves_slopes_and_curvatures_have_no_jump_over_the_full_circle(surface: np.void) -> None:
    step = math.radians(0.002)
    angles = np.arange(-math.pi, math.pi, step)
    curves = np.array([lift_drag(surface, each) for each in angles])
    curves = np.vstack([curves, curves[:3]])  # round the circle
    slopes = np.diff(curves, axis=0) / step
    bends = np.diff(slopes, axis=0) / step
    # Each may change from one sample to the next by no more than its own derivative lets it: a jump would not shrink
    # with the step. A blend of half width h has curvature of the order of CL/h^2 and third derivative of CL/h^3.
    width = 0.5 * float(surface["stall_sine_span"])
    top = float(np.abs(curves).max())
    assert np.abs(np.diff(curves, axis=0)).max() < 10.0 * top / width * step
    assert np.abs(np.diff(slopes, axis=0)).max() < 20.0 * top / width**2 * step
    assert np.abs(np.diff(bends, axis=0)).max() < 120.0 * top / width**3 * step


def test_lift_has_a_maximum_yet_does_not_vanish_beyond_it() -> None:
    peak_angle = max_lift_angle(WING)
    peak = lift_drag(WING, peak_angle)[0]
    after = [lift_drag(WING, math.radians(each))[0] for each in np.arange(math.degrees(peak_angle) + 1.0, 60.0, 0.5)]
    assert max(after) < peak
    assert min(after) > 0.4 * peak  # the "stall-less" wing of Figs 7-8 of the paper
    assert math.radians(10.0) < peak_angle < math.radians(35.0)
    assert 0.9 < peak < 2.0


@pytest.mark.parametrize("surface", [each for _, each in ALL], ids=[name for name, _ in ALL])
def test_max_lift_angle_is_where_lift_is_greatest(surface: np.void) -> None:
    angles = np.radians(np.arange(0.0, 50.0, 0.01))
    lifts = np.array([lift_drag(surface, each)[0] for each in angles])
    assert max_lift_angle(surface) == pytest.approx(angles[lifts.argmax()], abs=math.radians(0.02))
    assert float(surface["max_lift_angle"]) == pytest.approx(max_lift_angle(surface), abs=1e-12)


def test_a_flap_shifts_attached_lift_and_is_not_felt_in_separated_flow() -> None:
    surface, flap = flapped(), math.radians(10.0)
    for degrees in (-4.0, 0.0, 5.0):
        a = math.radians(degrees)
        change = lift_drag(surface, a, flap)[0] - lift_drag(surface, a)[0]
        assert change == pytest.approx(float(surface["lift_slope"]) * 0.5 * flap * math.cos(a), rel=1e-9)
    for degrees in (60.0, 90.0, -120.0, 180.0):
        assert lift_drag(surface, math.radians(degrees), flap) == lift_drag(surface, math.radians(degrees))


@given(st.floats(1.0, 40.0), angle)
def test_force_is_lift_across_and_drag_along_the_motion(speed: float, angle: float) -> None:
    along, across = speed * math.cos(angle), speed * math.sin(angle)
    force_along, force_across, _ = strip_force(WING, along, across, 0.0, 1.1)
    lift, drag = lift_drag(WING, angle)
    scale = 0.5 * 1.1 * speed**2 * float(WING["area"])
    assert (force_along * along + force_across * across) / speed == pytest.approx(-scale * drag, rel=1e-9)
    # Lift points to the upper side (against the normal), square to the motion.
    assert (force_along * across - force_across * along) / speed == pytest.approx(scale * lift, rel=1e-9, abs=1e-9)


def test_centre_of_pressure_moves_from_the_quarter_point_to_the_middle_and_on() -> None:
    chord = float(WING["chord"])
    for degrees, from_quarter in ((0.0, 0.0), (90.0, 0.25), (-90.0, 0.25), (180.0, 0.5)):
        a = math.radians(degrees)
        behind = strip_force(WING, 10.0 * math.cos(a), 10.0 * math.sin(a), 0.0, 1.2)[2]
        assert behind == pytest.approx(from_quarter * chord, abs=1e-12)


def test_no_motion_no_force() -> None:
    assert strip_force(WING, 0.0, 0.0, 0.3, 1.2) == (0.0, 0.0, 0.0)
