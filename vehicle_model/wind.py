"""Wind that changes with height and time: a steady wind in the boundary layer of the ground, and discrete gusts.

Steady wind: the logarithmic profile of MIL-F-8785C for the mean wind at low altitude,
u(h) = u_ref ln(h/z0)/ln(h_ref/z0), h_ref = 20 ft. Its z0 is 0.15 ft for terminal flight phases (category C), 2 ft for
the others. It holds from 3 to 1000 ft; beyond, the wind is that of the nearer end. The vertical part has no profile.

Gusts: w = A/2 (1 - cos(2 pi s/L)) for 0 <= s <= L, the shape of CS-25.341 with L twice its gradient distance H. s is
how far the vehicle has come into the gust since its start: in flight the gust stands still in the air and the vehicle
flies through it; one that stands on the ground or drifts with little airspeed is passed by it at the speed of the wind;
and in a calm it passes at 1 m/s, so that every gust ends.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vehicle_model.compiled import compiled
from vehicle_model.records import MAX_GUSTS, WIND

__all__ = ["REFERENCE_HEIGHT", "TERMINAL_ROUGHNESS", "Gust", "gust_shape", "make_wind", "shear_factor", "wind_step"]

_FOOT = 0.3048
REFERENCE_HEIGHT = 20.0 * _FOOT  # [m]
TERMINAL_ROUGHNESS = 0.15 * _FOOT  # z0 of take-off, approach and landing [m]
LOWEST, HIGHEST = 3.0 * _FOOT, 1000.0 * _FOOT  # where the profile holds [m]
LEAST_SPEED = 1.0  # at which a gust passes [m/s]


@dataclass(frozen=True)
class Gust:
    """One-minus-cosine gust: when it begins [s], its length [m], what it adds at its middle (NED, blowing to) [m/s]."""

    start: float
    length: float
    amplitude_ned: tuple[float, float, float]


def make_wind(
    steady_ned: Sequence[float] = (0.0, 0.0, 0.0),
    *,
    reference_height: float = REFERENCE_HEIGHT,
    roughness: float = 0.0,
    gusts: Sequence[Gust] = (),
) -> np.ndarray:
    """WIND array of shape (1,), writable: a steady wind (NED, blowing to) [m/s], its profile and up to eight gusts.

    The steady wind is that at `reference_height` above the ground [m]. `roughness` is z0 [m]; 0 means the same wind at
    every height. Raises ValueError for values that are not finite, a roughness or reference height the profile has
    not, a gust of no length, or too many gusts.
    """
    _check_vector("steady_ned", steady_ned)
    if not 0.0 <= roughness < LOWEST:
        raise ValueError(f"roughness: expected 0 to less than {LOWEST:g} m, got {roughness:g} m")
    if not LOWEST <= reference_height <= HIGHEST:
        raise ValueError(f"reference_height: expected {LOWEST:g} to {HIGHEST:g} m, got {reference_height:g} m")
    if len(gusts) > MAX_GUSTS:
        raise ValueError(f"gusts: expected at most {MAX_GUSTS}, got {len(gusts)}")
    wind = np.zeros(1, WIND)
    record = wind[0]
    record["steady_ned"] = steady_ned
    record["reference_height"] = reference_height
    record["roughness"] = roughness
    record["gust_count"] = len(gusts)
    for index, gust in enumerate(gusts):
        if not math.isfinite(gust.start):
            raise ValueError(f"gusts[{index}].start: expected a time in s, got {gust.start}")
        if not 0.0 < gust.length < math.inf:
            raise ValueError(f"gusts[{index}].length: expected a length above 0 m, got {gust.length:g} m")
        _check_vector(f"gusts[{index}].amplitude_ned", gust.amplitude_ned)
        record["gusts"][index] = (gust.start, gust.length, gust.amplitude_ned, 0.0)
    return wind


def _check_vector(name: str, vector: Sequence[float]) -> None:
    if len(vector) != 3 or not all(math.isfinite(component) for component in vector):
        raise ValueError(f"{name}: expected three finite numbers in m/s (north, east, down), got {vector}")


@compiled
def shear_factor(height_above_ground: float, reference_height: float, roughness: float) -> float:
    """Horizontal wind at a height over that at the reference height [m], by the profile in the module's head."""
    if roughness <= 0.0:
        return 1.0
    height = min(max(height_above_ground, LOWEST), HIGHEST)
    return math.log(height / roughness) / math.log(reference_height / roughness)


@compiled
def gust_shape(distance: float, length: float) -> float:
    """Share 0..1 of its amplitude that a gust of a `length` [m] has a `distance` [m] into it; 0 outside."""
    if distance <= 0.0 or distance >= length:
        return 0.0
    return 0.5 * (1.0 - math.cos(2.0 * math.pi * distance / length))


@compiled
def wind_step(wind, time: float, height_above_ground: float, airspeed: float, dt: float, environment) -> None:
    """Put the wind of the moment `time` [s] into the ENVIRONMENT array `environment`, `dt` [s] after the last call.

    `wind` is a WIND array of shape (1,), which keeps how far each gust has passed; a time before a gust's start readies
    it again. `height_above_ground` [m] and true `airspeed` [m/s] are those of the vehicle.
    """
    air = wind[0]
    factor = shear_factor(height_above_ground, air.reference_height, air.roughness)
    north = factor * air.steady_ned[0]
    east = factor * air.steady_ned[1]
    down = air.steady_ned[2]
    passing = max(airspeed, math.sqrt(north * north + east * east + down * down), LEAST_SPEED)
    for i in range(air.gust_count):
        gust = air.gusts[i]
        if time <= gust.start:
            gust.distance = 0.0
        elif gust.distance < gust.length:
            gust.distance += passing * min(dt, time - gust.start)
            share = gust_shape(gust.distance, gust.length)
            north += share * gust.amplitude_ned[0]
            east += share * gust.amplitude_ned[1]
            down += share * gust.amplitude_ned[2]
    world = environment[0]
    world.wind_ned[0] = north
    world.wind_ned[1] = east
    world.wind_ned[2] = down
