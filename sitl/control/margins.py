"""Stability margins of one loop, or of several at once, from their frequency response.

L is the open loop in the sense of negative feedback: the closed loop meets its limit where 1 + L = 0. All margins are
those of a closed loop that is stable: how much gain, phase or delay it bears before L passes through -1.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "GAIN_GOAL", "PHASE_GOAL", "Complexes", "Margins", "frequency_grid", "loop_margins", "multiloop_disk_margin",
]  # fmt: skip

Complexes = NDArray[np.complexfloating[Any, Any]]

GAIN_GOAL = 6.0  # that a loop is designed to bear at least [dB]
PHASE_GOAL = math.radians(45.0)

LOWEST_FREQUENCY = 1e-2  # of the grid [rad/s]: slower than anything the laws do
# Where L is this near to real at the lowest frequency, it is taken to be so at standstill, too.
NEARLY_REAL = 0.1
PERRON_ROUNDS = 50


@dataclass(frozen=True)
class Margins:
    """What one loop bears. Infinite (`gain_down`: zero) where no change of that kind makes it unstable.

    `disk` is the symmetric disk margin alpha of Seiler, Packard and Gahinet, "An Introduction to Disk Margins", IEEE
    Control Systems Magazine 2020, doi:10.1109/MCS.2020.3005277 (skew 0): gain and phase may change together by any
    complex factor in the disk through (2 - alpha)/(2 + alpha) and (2 + alpha)/(2 - alpha); 2 at most.
    """

    gain_up: float  # factor by which the loop's gain may grow
    gain_down: float  # factor to which it may shrink
    phase: float  # lead or lag, whichever is less [rad]
    delay: float  # more of it [s]
    disk: float
    crossover: float  # highest frequency with |L| = 1; not a number without one [rad/s]
    worst_frequency: float  # where the disk margin is met [rad/s]

    @property
    def gain_db(self) -> float:
        """The nearer of the two gain margins [dB]."""
        down = math.inf if self.gain_down == 0.0 else -20.0 * math.log10(self.gain_down)
        return min(20.0 * math.log10(self.gain_up), down)

    @property
    def disk_gain_db(self) -> float:
        """Gain change, up and down, that the disk margin guarantees with no change of phase [dB]."""
        return math.inf if self.disk >= 2.0 else 20.0 * math.log10((2.0 + self.disk) / (2.0 - self.disk))

    @property
    def disk_phase(self) -> float:
        """Phase change, lead and lag, that the disk margin guarantees with no change of gain [rad]."""
        return 2.0 * math.atan(0.5 * self.disk)


def frequency_grid(dt: float, poles: Complexes, per_decade: int = 80) -> np.ndarray:
    """Frequencies [rad/s] up to that of half the sampling rate, closer together about the poles of the closed loop.

    A peak is as wide as its pole's distance from the unit circle: five points of the grid lie across it.
    """
    highest = math.pi / dt
    count = math.ceil(per_decade * math.log10(highest / LOWEST_FREQUENCY))
    points = [np.geomspace(LOWEST_FREQUENCY, highest, count)]
    oscillating = poles[(poles.imag > 0.0) & (np.abs(poles) > 0.1)]
    roots = np.log(oscillating) / dt
    points += [np.abs(roots.imag) + share * roots.real for share in (-1.0, -0.5, 0.0, 0.5, 1.0)]
    grid = np.unique(np.concatenate(points))
    return grid[(grid >= LOWEST_FREQUENCY) & (grid <= highest)]


def loop_margins(omega: np.ndarray, loop: Complexes, dt: float) -> Margins:
    """Margins of a sampled loop from its response L(exp(j omega dt)) at ascending frequencies [rad/s], both shape (n,).

    Between the samples it is interpolated, so the grid must be fine enough to show every turn of L
    (`frequency_grid`). Raises ValueError for fewer than two samples or frequencies that do not ascend.
    """
    if omega.size < 2 or loop.shape != omega.shape or not (np.diff(omega) > 0.0).all():
        raise ValueError(
            f"loop response: expected at least two ascending frequencies with one value each, got {omega.size} "
            f"frequencies and {loop.size} values"
        )
    gains = -1.0 / _negative_real_crossings(omega, loop, dt)
    frequencies, phases = _unit_crossings(omega, loop)
    nearest, where = _nearest_to_minus_one(omega, loop)
    difference = np.abs((1.0 - nearest) / (1.0 + nearest))  # S - T
    worst = int(np.argmax(difference))
    return Margins(
        gain_up=float(gains[gains >= 1.0].min(initial=math.inf)),
        gain_down=float(gains[gains < 1.0].max(initial=0.0)),
        phase=float(np.abs(phases).min(initial=math.inf)),
        delay=float((np.mod(phases, 2.0 * math.pi) / frequencies).min(initial=math.inf)),
        disk=float(2.0 / difference[worst]),
        crossover=float(frequencies.max()) if frequencies.size else math.nan,
        worst_frequency=float(where[worst]),
    )


def _negative_real_crossings(omega: np.ndarray, loop: Complexes, dt: float) -> np.ndarray:
    """Values of L where it meets the negative real axis."""
    before, after = loop[:-1], loop[1:]
    index = np.flatnonzero((before.imag >= 0.0) != (after.imag >= 0.0))
    before, after = before[index], after[index]
    # Where L is large it turns fast, by way of infinity: there 1/L is straight between the samples.
    large = _both_large(before, after)
    before, after = _inverted(before, large), _inverted(after, large)
    share = before.imag / (before.imag - after.imag)
    values = before.real + share * (after.real - before.real)
    values[large] = 1.0 / values[large]
    # The responses of negative frequencies are the mirror image: L is real at standstill and at half the sampling rate.
    ends = [loop[0]] if abs(loop[0].imag) < NEARLY_REAL * abs(loop[0].real) else []
    if omega[-1] * dt > math.pi * (1.0 - 1e-9):
        ends.append(loop[-1])
    values = np.concatenate([values, np.real(ends)])
    return values[values < 0.0]


def _both_large(before: Complexes, after: Complexes) -> np.ndarray:
    """Pieces between two samples that stay outside the unit circle, for all that is known."""
    return (np.abs(before) > 1.0) & (np.abs(after) > 1.0)


def _inverted(values: Complexes, chosen: np.ndarray) -> Complexes:
    """The values, the chosen ones inverted."""
    return np.divide(1.0, values, out=values.copy(), where=chosen)


def _unit_crossings(omega: np.ndarray, loop: Complexes) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies [rad/s] where |L| = 1, and how far the phase of L is there from that of -1, -pi..pi [rad]."""
    size = np.log(np.maximum(np.abs(loop), 1e-300))
    index = np.flatnonzero((size[:-1] >= 0.0) != (size[1:] >= 0.0))
    share = size[index] / (size[index] - size[index + 1])
    frequencies = omega[index] * (omega[index + 1] / omega[index]) ** share
    turn = np.angle(loop[index + 1] / loop[index])
    phase = np.angle(loop[index]) + share * turn + math.pi
    return frequencies, np.mod(phase + math.pi, 2.0 * math.pi) - math.pi


def _nearest_to_minus_one(omega: np.ndarray, loop: Complexes) -> tuple[Complexes, np.ndarray]:
    """On each straight piece between two samples the point nearest to -1, and its frequency [rad/s].

    It is straight in L, or in 1/L where L is large; there it is the point of 1/L that is nearest.
    """
    large = _both_large(loop[:-1], loop[1:])
    before, after = _inverted(loop[:-1], large), _inverted(loop[1:], large)
    step = after - before
    length = np.maximum((step * step.conj()).real, 1e-300)
    share = np.clip(-((1.0 + before) * step.conj()).real / length, 0.0, 1.0)
    return _inverted(before + share * step, large), omega[:-1] + share * np.diff(omega)


def multiloop_disk_margin(sensitivity: Complexes) -> float:
    """Disk margin alpha that several loops bear at once, each with a change of its own; skew 0.

    `sensitivity` (m, n, n) is that of the n loops opened together, at m frequencies. alpha = 2 / max mu(S - T) with
    the structured singular value's upper bound sigma(D (S - T) / D), D from the Perron vectors of |S - T| (Safonov,
    IEE Proc. D 1982): the margin is at least what is returned.
    """
    n = sensitivity.shape[-1]
    difference = 2.0 * sensitivity - np.eye(n)
    size = np.abs(difference) + 1e-12  # positive: the Perron vectors exist and have no zeros
    right, left = np.ones((len(size), n, 1)), np.ones((len(size), n, 1))
    for _ in range(PERRON_ROUNDS):
        right = size @ right
        right /= right.max(axis=1, keepdims=True)
        left = size.swapaxes(1, 2) @ left
        left /= left.max(axis=1, keepdims=True)
    scale = np.sqrt(left / right)
    scaled = scale * difference / scale.swapaxes(1, 2)
    return float(2.0 / np.linalg.norm(scaled, 2, axis=(1, 2)).max())
