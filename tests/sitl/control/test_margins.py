"""Margins of textbook loops against their closed forms."""

import math

import numpy as np
import pytest

from sitl.control.margins import Margins, frequency_grid, loop_margins, multiloop_disk_margin

NO_POLES = np.empty(0, np.complex128)


def sampled(dt: float, loop) -> Margins:
    """Margins of a loop given as a function of z."""
    omega = frequency_grid(dt, NO_POLES)
    return loop_margins(omega, loop(np.exp(1j * omega * dt)), dt)


def continuous(loop) -> Margins:
    """Margins of a loop given as a function of s: the sampling rate is beyond the grid."""
    omega = frequency_grid(1e-4, NO_POLES)
    return loop_margins(omega, loop(1j * omega), 1e-5)


def test_third_order_lag_has_its_gain_margin_of_three_halves() -> None:
    # Ogata's and everybody's: 4/(s(s+1)(s+2)) meets the real axis at w = sqrt 2 with L = -4/6.
    found = continuous(lambda s: 4.0 / (s * (s + 1.0) * (s + 2.0)))
    assert found.gain_up == pytest.approx(1.5, rel=1e-3)
    assert found.gain_down == 0.0
    w2 = np.roots([1.0, 5.0, 4.0, -16.0])  # |L| = 1: w^2 (w^2 + 1)(w^2 + 4) = 16
    crossover = math.sqrt(w2[np.isreal(w2) & (w2.real > 0.0)].real[0])
    phase = math.pi / 2.0 - math.atan(crossover) - math.atan(crossover / 2.0)
    assert found.crossover == pytest.approx(crossover, rel=1e-4)
    assert found.phase == pytest.approx(phase, rel=2e-3)
    assert found.delay == pytest.approx(phase / crossover, rel=2e-3)


def test_unstable_pole_limits_the_gain_from_below_too() -> None:
    # 3k/((s - 1)(s/20 + 1)^2): s^3 + 39 s^2 + 360 s - 400 + 1200 k; Routh: 1/3 < k < (39 * 360 + 400)/1200
    found = continuous(lambda s: 3.0 / ((s - 1.0) * (0.05 * s + 1.0) ** 2))
    assert found.gain_down == pytest.approx(1.0 / 3.0, rel=1e-3)
    assert found.gain_up == pytest.approx((39.0 * 360.0 + 400.0) / 1200.0, rel=2e-3)


def test_sampled_integrator_oscillates_at_half_the_sampling_rate() -> None:
    # k dt/(z - 1) is unstable beyond k dt = 2, at z = -1: the margin lies at the very end of the grid.
    found = sampled(0.01, lambda z: 0.5 / (z - 1.0))
    assert found.gain_up == pytest.approx(4.0, rel=1e-9)
    # |z - 1| = 2 sin(w dt/2) = 0.5; the phase of 1/(z - 1) is -pi/2 - w dt/2
    angle = 2.0 * math.asin(0.25)
    assert found.crossover == pytest.approx(angle / 0.01, rel=1e-4)
    assert found.phase == pytest.approx(math.pi / 2.0 - angle / 2.0, rel=1e-4)


def test_each_tick_of_delay_takes_its_share_of_the_delay_margin() -> None:
    found = [sampled(0.0025, lambda z, n=n: 0.05 / (z - 1.0) / z**n) for n in (0, 1, 5)]
    assert found[0].delay - found[1].delay == pytest.approx(0.0025, rel=1e-3)
    assert found[0].delay - found[2].delay == pytest.approx(0.0125, rel=1e-3)


def test_double_integrator_with_lead_bears_any_gain() -> None:
    found = continuous(lambda s: (1.0 + s) / s**2)
    assert found.gain_up == math.inf
    assert found.gain_db > 60.0
    crossover = math.sqrt((1.0 + math.sqrt(5.0)) / 2.0)  # w^4 = 1 + w^2
    assert found.crossover == pytest.approx(crossover, rel=1e-4)
    assert found.phase == pytest.approx(math.atan(crossover), rel=1e-3)


def test_a_loop_that_never_reaches_one_bears_any_phase_and_delay() -> None:
    found = continuous(lambda s: 0.5 / (s + 1.0))
    assert found.phase == math.inf
    assert found.delay == math.inf
    assert math.isnan(found.crossover)


def test_disk_margin_of_an_integrator_is_the_whole_disk() -> None:
    # |S - T| = |(s - 1)/(s + 1)| = 1 at every frequency
    found = continuous(lambda s: 1.0 / s)
    assert found.disk == pytest.approx(2.0, rel=1e-9)
    assert found.disk_phase == pytest.approx(math.pi / 2.0, rel=1e-9)


def test_disk_margin_is_that_of_the_paper_s_example() -> None:
    # Seiler, Packard, Gahinet 2020, example with L = 25/(s^3 + 10 s^2 + 10 s + 10): alpha = 0.46, gain 0.63..1.59,
    # phase +-25.8 deg; the classical margins are 3.6 and 29.1 deg.
    found = continuous(lambda s: 25.0 / (s**3 + 10.0 * s**2 + 10.0 * s + 10.0))
    assert found.disk == pytest.approx(0.46, abs=0.005)
    assert 10.0 ** (found.disk_gain_db / 20.0) == pytest.approx(1.59, abs=0.01)
    assert math.degrees(found.disk_phase) == pytest.approx(25.8, abs=0.2)
    assert found.gain_up == pytest.approx(3.6, abs=0.01)
    assert math.degrees(found.phase) == pytest.approx(29.1, abs=0.1)


def test_disk_guarantees_less_than_gain_and_phase_alone() -> None:
    for k in (0.5, 1.0, 2.0, 4.0, 5.5):
        found = continuous(lambda s, k=k: k / (s * (s + 1.0) * (s + 2.0)))
        assert found.disk_gain_db <= found.gain_db
        assert found.disk_phase <= found.phase * (1.0 + 1e-3)


def test_a_narrow_resonance_between_the_points_of_the_grid_is_found() -> None:
    dt, w0, damping = 0.0025, 123.4, 1e-4

    def loop(z: np.ndarray) -> np.ndarray:
        s = np.log(z) / dt
        return 2.0 * damping * w0 * 0.5 * s / (s**2 + 2.0 * damping * w0 * s + w0**2)

    pole = np.array([np.exp(dt * w0 * complex(-damping, math.sqrt(1.0 - damping**2)))])
    omega = frequency_grid(dt, pole)
    assert np.abs(loop(np.exp(1j * omega * dt))).max() == pytest.approx(0.5, rel=1e-3)


def test_grid_ends_at_half_the_sampling_rate() -> None:
    omega = frequency_grid(0.0025, np.array([0.99 + 0.05j, 0.99 - 0.05j]))
    assert omega[-1] == pytest.approx(math.pi / 0.0025, rel=1e-12)
    assert (np.diff(omega) > 0.0).all()


def test_separate_loops_bear_together_what_the_worst_bears_alone() -> None:
    s = 1j * np.geomspace(1e-2, 1e3, 2000)
    loops = [k / (s * (s + 1.0) * (s + 2.0)) for k in (1.0, 4.0)]
    sensitivity = np.zeros((s.size, 2, 2), np.complex128)
    for i, loop in enumerate(loops):
        sensitivity[:, i, i] = 1.0 / (1.0 + loop)
    alone = continuous(lambda s: 4.0 / (s * (s + 1.0) * (s + 2.0))).disk
    assert multiloop_disk_margin(sensitivity) == pytest.approx(alone, rel=1e-3)


def test_coupled_loops_bear_less_together_than_each_alone() -> None:
    # Doyle's spinning body: each loop alone, the other closed, is 1/s and bears the whole disk; together hardly any.
    s = 1j * np.geomspace(1e-3, 1e4, 3000)
    a = 10.0
    plant = (
        np.array([[s - a**2, a * (s + 1.0)], [-a * (s + 1.0), s - a**2]]).transpose(2, 0, 1)
        / (s**2 + a**2)[:, None, None]
    )
    sensitivity = np.linalg.inv(np.eye(2) + plant)
    for i in (0, 1):
        loop = 1.0 / sensitivity[:, i, i] - 1.0
        assert loop_margins(np.abs(s), loop, 1e-4).disk == pytest.approx(2.0, rel=1e-6)
    together = multiloop_disk_margin(sensitivity)
    assert together < 0.2
    # mu lies between spectral radius and bound: the margin is at least what is said, and cannot be far above it
    radius = np.abs(np.linalg.eigvals(2.0 * sensitivity - np.eye(2))).max()
    assert together <= 2.0 / radius * (1.0 + 1e-9)


def test_a_resonance_between_two_samples_is_no_crossing_near_minus_one() -> None:
    # 3 / (1 - w^2) turns from far right to far left by way of infinity, and meets -1 nowhere near w = 1
    omega = np.array([0.5, 0.9, 0.97, 1.04, 1.1, 1.5])
    loop = 3.0 / (1.0 - omega**2 + 0.002j * omega)
    margins = loop_margins(omega, loop, 1e-3)
    assert margins.gain_up == math.inf
    assert margins.gain_down < 0.05
    ends = np.abs((1.0 - loop) / (1.0 + loop)).max()  # S - T where it was sampled
    assert margins.disk == pytest.approx(2.0 / ends, rel=0.01)


def test_frequencies_that_do_not_ascend_are_refused() -> None:
    with pytest.raises(ValueError, match="ascending frequencies"):
        loop_margins(np.array([2.0, 1.0]), np.array([1j, 1j]), 0.01)
