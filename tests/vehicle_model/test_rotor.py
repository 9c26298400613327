"""The propeller against measured thrust, closed forms, momentum theory and other authors' equations."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq

from vehicle_model.records import ROTOR
from vehicle_model.rotor import disk_flow, induced_by_share, induced_velocity, rotor_loads

DENSITY = 1.225

# UIUC Propeller Database, Vol. 1 (Brandt, Deters, Ananda, Dantsker, Selig): APC Slow-Flyer 10x4.7, (J, CT).
STATIC_6528 = [(0.0, 0.1299)]
RPM_6512 = [
    (0.089, 0.1201), (0.134, 0.1129), (0.176, 0.1059), (0.225, 0.0974), (0.266, 0.0895),
    (0.308, 0.0833), (0.357, 0.0743), (0.395, 0.0669), (0.445, 0.0562),
]  # fmt: skip
RPM_6020 = [(0.408, 0.0624), (0.458, 0.0519), (0.507, 0.0405), (0.551, 0.0296), (0.601, 0.0160), (0.652, 0.0017)]


def propeller(
    radius: float, twist: float, lift: float, profile_drag: float = 0.02, induced_power_factor: float = 1.0
) -> np.void:
    """ROTOR record with the numbers of eq. (3); `lift` is a0 b c_r [m]."""
    rotor = np.zeros(1, ROTOR)[0]
    rotor["radius"], rotor["twist"], rotor["thrust_factor"] = radius, twist, 1.0
    rotor["lift_slope"], rotor["blades"], rotor["blade_chord"] = 5.7, 2.0, lift / 11.4
    rotor["profile_drag"], rotor["induced_power_factor"] = profile_drag, induced_power_factor
    return rotor


APC_10X47 = propeller(0.127, 0.4251, 0.2260)
SPEED = 600.0  # [rad/s]
AREA = math.pi * 0.127**2
STATIC_THRUST, _, STATIC_INDUCED = rotor_loads(APC_10X47, SPEED, 0.0, 0.0, DENSITY)

climb = st.floats(-40.0, 0.0)
axial = st.floats(-40.0, 40.0)
edgewise = st.floats(0.0, 40.0)
speed = st.floats(50.0, 1200.0)


def root(function: Callable[[float], float], low: float, high: float) -> float:
    return float(brentq(function, low, high, xtol=1e-14))  # pyright: ignore[reportArgumentType]


def blade_velocity(axial: float, speed: float) -> float:
    """v_b of eq. (3) for the 10x4.7."""
    return axial + 2.0 / 3.0 * speed * 0.127 * 0.75 * 0.4251


def coupling(speed: float) -> float:
    """The factor w a0 b c_r / (8 pi) of eq. (7) for the 10x4.7."""
    return speed * 0.2260 / (8.0 * math.pi)


def test_thrust_coefficient_is_within_0_003_of_wind_tunnel_data() -> None:
    worst = 0.0
    for rpm, points in ((6528.0, STATIC_6528), (6512.0, RPM_6512), (6020.0, RPM_6020)):
        turns = rpm / 60.0
        for advance_ratio, measured in points:
            thrust, _, _ = rotor_loads(APC_10X47, 2.0 * math.pi * turns, -advance_ratio * turns * 0.254, 0.0, DENSITY)
            worst = max(worst, abs(thrust / (DENSITY * turns**2 * 0.254**4) - measured))
    assert worst < 0.003


@given(climb, speed)
def test_axial_climb_has_the_closed_solution_of_the_quadratic(axial: float, speed: float) -> None:
    c, v_b = coupling(speed), blade_velocity(axial, speed)
    if v_b < 1e-6:
        return
    expected = 0.5 * (-(-axial + c) + math.sqrt((-axial + c) ** 2 + 4.0 * c * v_b))
    assert induced_velocity(axial, 0.0, v_b, c) == pytest.approx(expected, rel=1e-10, abs=1e-12)


@given(climb, edgewise, speed)
def test_equations_3_to_8_hold_at_the_solution_in_oblique_flow(axial: float, edgewise: float, speed: float) -> None:
    thrust, _, v_i = rotor_loads(APC_10X47, speed, axial, edgewise, DENSITY)
    v_b = blade_velocity(axial, speed)
    if v_b < 0.0:
        return
    blade_element = 0.25 * (v_b - v_i) * speed * 0.127**2 * DENSITY * 0.2260
    resultant = math.sqrt(edgewise**2 + (axial - v_i) ** 2)
    momentum = 2.0 * DENSITY * AREA * v_i * resultant
    assert 0.0 <= v_i <= v_b
    assert thrust == pytest.approx(blade_element, rel=1e-9, abs=1e-9)
    assert thrust == pytest.approx(momentum, rel=1e-9, abs=1e-9)


@given(climb, edgewise, st.floats(200.0, 1200.0))
def test_agrees_with_the_fixed_point_of_heffley_and_mnich(axial: float, edgewise: float, speed: float) -> None:
    thrust, _, v_i = rotor_loads(APC_10X47, speed, axial, edgewise, DENSITY)
    w_b = axial + 2.0 / 3.0 * speed * 0.127 * 0.75 * 0.4251
    if w_b <= 0.5:  # the publication's rotor pushes
        return
    theirs, guess = 0.0, 0.5 * w_b
    for _ in range(400):
        theirs = (w_b - guess) * DENSITY * speed * 0.127**2 * 0.2260 / 4.0
        half = 0.5 * (edgewise**2 + axial * (axial - 2.0 * guess))
        passed = math.sqrt(max(math.sqrt(half**2 + (theirs / (2.0 * DENSITY * AREA)) ** 2) - half, 0.0))
        guess = 0.6 * guess + 0.4 * passed  # relaxed, so that it converges everywhere
    assert v_i == pytest.approx(guess, rel=1e-6, abs=1e-9)
    assert thrust == pytest.approx(theirs, rel=1e-6, abs=1e-9)


def hovering_at(sink: float) -> float:
    """Induced velocity of a disk that carries a fixed thrust while it sinks; both in hover induced velocities."""
    return root(lambda v: v * disk_flow(sink, v)[0] - 1.0, 0.01, 5.0)


def test_vortex_ring_follows_leishmans_curve() -> None:
    # Principles of Helicopter Aerodynamics, eq. (2.96) with kappa = 1: v_i/v_h of a fixed thrust, x = climb rate/v_h.
    def leishman(sink: float) -> float:
        x = -sink
        return 1.0 - 1.125 * x - 1.372 * x**2 - 1.718 * x**3 - 0.655 * x**4

    for sink in np.linspace(0.0, 1.75, 71):
        assert hovering_at(sink) == pytest.approx(leishman(sink), rel=0.07)
    # Then the induced velocity drops so fast that the sink rate at which it has a value is what can be compared.
    for induced in np.linspace(1.1, 1.7, 13):
        theirs = root(lambda sink, induced=induced: leishman(sink) - induced, 1.5, 2.0)
        ours = root(lambda sink, induced=induced: hovering_at(sink) - induced, 1.5, 2.0)
        assert ours == pytest.approx(theirs, abs=0.17)


@given(st.floats(2.001, 10.0))
def test_windmill_brake_state_is_momentum_theory(sink: float) -> None:
    assert hovering_at(sink) == pytest.approx(0.5 * sink - math.sqrt(0.25 * sink**2 - 1.0), rel=1e-9)


@given(st.floats(-3.0, 5.0), st.floats(0.05, 4.0))
def test_disk_flow_has_the_derivative_it_returns_and_no_jump(axial: float, induced: float) -> None:
    step = 1e-6
    above, _ = disk_flow(axial, induced + step)
    below, _ = disk_flow(axial, induced - step)
    flow, slope = disk_flow(axial, induced)
    assert (above - below) / (2.0 * step) == pytest.approx(slope, abs=2e-3)
    assert 0.5 * (above + below) == pytest.approx(flow, abs=1e-8)


@given(axial, edgewise, speed)
def test_induced_velocity_is_the_only_root_of_momentum_against_blade_element(
    axial: float, edgewise: float, speed: float
) -> None:
    c, v_b = coupling(speed), blade_velocity(axial, speed)
    if v_b < 1e-3:
        return
    found = induced_velocity(axial, edgewise, v_b, c)

    def excess(v: float) -> float:
        return v * math.hypot(edgewise, disk_flow(axial, v)[0]) - c * (v_b - v)

    assert abs(excess(found)) < 1e-8 * (c * v_b + v_b * v_b)
    below = [excess(share * found) for share in np.linspace(0.0, 0.999, 60)]
    above = [excess(found + share * (v_b - found)) for share in np.linspace(0.001, 1.0, 60)]
    assert max(below) < 0.0 < min(above)


@pytest.mark.parametrize("edgewise", [0.0, 1.0, 5.0, 15.0, 40.0])
def test_thrust_and_torque_have_no_jump_from_fast_climb_to_fast_descent(edgewise: float) -> None:
    step = 0.005
    loads = np.array([rotor_loads(APC_10X47, SPEED, each, edgewise, DENSITY) for each in np.arange(-40.0, 40.0, step)])
    static_torque = rotor_loads(APC_10X47, SPEED, 0.0, 0.0, DENSITY)[1]
    assert np.isfinite(loads).all()
    # Blade-element thrust alone changes by this much with the axial velocity; the induced velocity may add as much.
    steepest = 0.25 * SPEED * 0.127**2 * DENSITY * 0.2260
    assert np.abs(np.diff(loads[:, 0])).max() < 2.5 * steepest * step
    # Torque is thrust times (v_i - v_z)/w: at 40 m/s its slope is that of thrust times 40 m/s over the speed.
    assert np.abs(np.diff(loads[:, 1])).max() < max(0.03 * static_torque, 2.5 * steepest * step * 80.0 / SPEED)


@given(axial, st.floats(0.0, 39.0), st.floats(100.0, 1200.0))
def test_edgewise_flow_is_felt_without_a_jump(axial: float, edgewise: float, speed: float) -> None:
    near = rotor_loads(APC_10X47, speed, axial, edgewise, DENSITY)[0]
    next_to = rotor_loads(APC_10X47, speed, axial, edgewise + 1e-5, DENSITY)[0]
    assert abs(next_to - near) < 1e-3 * STATIC_THRUST


@given(axial, edgewise, speed)
def test_running_backwards_is_the_mirror_image(axial: float, edgewise: float, speed: float) -> None:
    thrust, torque, induced = rotor_loads(APC_10X47, speed, axial, edgewise, DENSITY)
    assert rotor_loads(APC_10X47, -speed, -axial, edgewise, DENSITY) == (-thrust, -torque, -induced)


# The same propeller's power coefficient, (J, CP); in hover at 6528 rpm.
POWER_6512 = [
    (0.0, 0.0531), (0.089, 0.0523), (0.134, 0.0512), (0.176, 0.0500), (0.225, 0.0483), (0.266, 0.0465),
    (0.308, 0.0454), (0.357, 0.0434), (0.395, 0.0414), (0.445, 0.0381),
]  # fmt: skip
POWER_6020 = [(0.408, 0.0397), (0.458, 0.0366), (0.507, 0.0331), (0.551, 0.0297), (0.601, 0.0254), (0.652, 0.0207)]


def test_power_coefficient_is_within_0_007_of_wind_tunnel_data() -> None:
    # Real chord, and the two numbers of the aircraft file that were calibrated to these points.
    rotor = propeller(0.127, 0.4251, 0.2260, 0.03, 1.15)
    rotor["blade_chord"] = 0.197 * 0.127
    rotor["lift_slope"] = 0.2260 / (2.0 * 0.197 * 0.127)
    errors = []
    for rpm, points in ((6512.0, POWER_6512), (6020.0, POWER_6020)):
        n = rpm / 60.0
        for advance, expected in points:
            _, torque, _ = rotor_loads(rotor, 2.0 * math.pi * n, -advance * n * 0.254, 0.0, DENSITY)
            errors.append(2.0 * math.pi * n * torque / (DENSITY * n**3 * 0.254**5) - expected)
    assert max(map(abs, errors)) < 0.007
    assert np.sqrt(np.mean(np.square(errors))) < 0.0035


def test_torque_passes_through_zero_speed_without_a_jump() -> None:
    for through in (-20.0, -8.0, 3.0):
        before, at, after = (rotor_loads(APC_10X47, speed, through, 5.0, DENSITY)[1] for speed in (-1e-6, 0.0, 1e-6))
        assert at == 0.0
        assert abs(after - before) < 1e-6


@given(climb, edgewise, speed)
def test_shaft_power_is_at_least_the_useful_power_and_more_by_the_profile_power(
    axial: float, edgewise: float, speed: float
) -> None:
    thrust, torque, v_i = rotor_loads(APC_10X47, speed, axial, edgewise, DENSITY)
    tip_speed = speed * 0.127
    if thrust < 0.0 or tip_speed < -axial:
        return  # below that blade-element theory has ended
    power = torque * speed
    assert power >= thrust * -axial
    blade_area = 2.0 * float(APC_10X47["blade_chord"]) * 0.127
    # Leishman eqs (5.17)-(5.21): CP0 = sigma cd0/8 (1 + 4.65 mu^2), which the root under the sum of squares nears.
    profile = 0.125 * DENSITY * blade_area * 0.02 * tip_speed**3
    ratio = (power - thrust * (v_i - axial)) / profile
    mu = edgewise / tip_speed
    assert ratio == pytest.approx(1.0 + 4.65 * mu**2, rel=0.02 + 4.65**2 * mu**4)
    assert ratio >= 1.0 - 1e-9


@given(axial, edgewise, speed, st.floats(0.1, 1.3))
def test_loads_are_proportional_to_density(axial: float, edgewise: float, speed: float, density: float) -> None:
    thrust, torque, induced = rotor_loads(APC_10X47, speed, axial, edgewise, 1.0)
    thin_thrust, thin_torque, thin_induced = rotor_loads(APC_10X47, speed, axial, edgewise, density)
    assert thin_thrust == pytest.approx(density * thrust, rel=1e-12)
    assert thin_torque == pytest.approx(density * torque, rel=1e-12)
    assert thin_induced == induced


# Wake of a disk of 0.2 m radius: (V [m/s], T [N], far-wake and disk velocity [m/s] of momentum theory).
WAKES = [
    (0.0, 25.0, 18.02, 9.01),
    (10.0, 20.0, 18.97, 14.48),
    (20.0, 15.0, 24.39, 22.20),
    (30.0, 6.0, 31.27, 30.64),
]


@pytest.mark.parametrize(("airspeed", "thrust", "far_wake", "disk"), WAKES)
def test_slipstream_has_momentum_theorys_speed_at_the_disk_and_far_behind(
    airspeed: float, thrust: float, far_wake: float, disk: float
) -> None:
    rotor = propeller(0.2, 0.6, 0.18)
    speed = root(lambda each: rotor_loads(rotor, each, -airspeed, 0.0, DENSITY)[0] - thrust, 50.0, 2000.0)
    _, _, v_i = rotor_loads(rotor, speed, -airspeed, 0.0, DENSITY)
    assert airspeed + v_i == pytest.approx(disk, abs=0.006)
    assert airspeed + 2.0 * v_i == pytest.approx(far_wake, abs=0.006)
    mass_flow = DENSITY * math.pi * 0.2**2 * (airspeed + v_i)
    assert mass_flow * 2.0 * v_i == pytest.approx(thrust, rel=1e-9)
    contraction = math.sqrt((airspeed + v_i) / (airspeed + 2.0 * v_i))
    assert 1.0 / math.sqrt(2.0) - 1e-9 <= contraction <= 1.0


@given(speed, climb, st.floats(0.1, 5.0))
def test_climb_takes_thrust_away_until_there_is_neither_thrust_nor_wake(
    speed: float, axial: float, more: float
) -> None:
    here, _, induced = rotor_loads(APC_10X47, speed, axial, 0.0, DENSITY)
    faster, _, _ = rotor_loads(APC_10X47, speed, axial - more, 0.0, DENSITY)
    assert faster < here
    zero_thrust = -0.5 * speed * 0.127 * 0.4251
    thrust, _, none = rotor_loads(APC_10X47, speed, zero_thrust, 0.0, DENSITY)
    assert (thrust, none) == (pytest.approx(0.0, abs=1e-9), pytest.approx(0.0, abs=1e-9))
    assert induced > none or axial < zero_thrust


def test_hover_is_the_momentum_theory_of_the_static_thrust() -> None:
    assert pytest.approx(math.sqrt(STATIC_THRUST / (2.0 * DENSITY * AREA)), rel=1e-9) == STATIC_INDUCED


def test_a_stopped_rotor_makes_no_thrust_and_without_axial_flow_no_torque() -> None:
    for axial in (0.0, 7.0, -7.0):
        thrust, _, induced = rotor_loads(APC_10X47, 0.0, axial, 3.0, DENSITY)
        assert (thrust, induced) == (0.0, 0.0)
    assert rotor_loads(APC_10X47, 0.0, 0.0, 3.0, DENSITY)[1] == 0.0


def test_bad_numbers_come_out_as_nan_and_do_not_hang() -> None:
    assert math.isnan(rotor_loads(APC_10X47, math.nan, 0.0, 0.0, DENSITY)[0])
    assert math.isnan(rotor_loads(APC_10X47, SPEED, math.nan, 0.0, DENSITY)[0])
    assert not math.isfinite(rotor_loads(APC_10X47, SPEED, 0.0, math.inf, DENSITY)[1])


@given(speed, axial, edgewise, st.floats(0.0, 0.999))
def test_a_damaged_propeller_loses_that_share_of_thrust_and_no_torque(
    speed: float, axial: float, edgewise: float, share: float
) -> None:
    damaged = propeller(0.127, 0.4251, 0.2260)
    damaged["thrust_factor"] = share
    healthy_thrust, healthy_torque, _ = rotor_loads(APC_10X47, speed, axial, edgewise, DENSITY)
    thrust, torque, induced = rotor_loads(damaged, speed, axial, edgewise, DENSITY)
    assert thrust == pytest.approx(share * healthy_thrust, rel=1e-12)
    assert torque == healthy_torque
    # The wake carries away exactly the momentum of the thrust that is left: T = 2 rho A v_i v'.
    if thrust != 0.0:
        direction = math.copysign(1.0, thrust)
        flow, _ = disk_flow(direction * axial, abs(induced))
        momentum = 2.0 * DENSITY * AREA * abs(induced) * math.hypot(edgewise, flow)
        assert momentum == pytest.approx(abs(thrust), rel=1e-4, abs=1e-4)


def test_in_hover_the_wake_of_a_damaged_propeller_goes_with_the_root_of_its_thrust() -> None:
    assert induced_by_share(0.0, 0.0, 9.0, 0.64) == pytest.approx(9.0 * 0.8, rel=1e-9)
    assert induced_by_share(0.0, 0.0, -9.0, 0.64) == pytest.approx(-9.0 * 0.8, rel=1e-9)
    assert induced_by_share(-20.0, 0.0, 9.0, 1.0) == pytest.approx(9.0, rel=1e-9)
