"""What a campaign varies: one case is a wind, a heading and an aircraft that differs from the one its laws know.

Case k of a seed is the same in a campaign of any size, and each source of chance has a stream of its own, so that one
more of them would change nothing in the others.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from vehicle_model.aircraft import Aircraft

__all__ = ["AERODYNAMICS", "Case", "Scatter", "draw_case", "scattered_aircraft"]

# Every aerodynamic coefficient that the equations have: slopes, drags, where and how lift breaks down, flaps, wakes.
_SECTION = ("lift_slope", "stall_angle", "plate_lift", "plate_drag", "zero_lift_drag", "induced_drag")
AERODYNAMICS = (
    *(f"wing.{name}" for name in (*_SECTION, "aileron_effectiveness", "wake_factor")),
    *(f"tail.horizontal.{name}" for name in (*_SECTION, "elevator_effectiveness", "downwash_factor")),
    *(f"tail.vertical.{name}" for name in _SECTION),
    *(
        f"rotors.{rotor}.{name}"
        for rotor in ("wing", "tail")
        for name in ("lift_slope", "profile_drag", "induced_power_factor")
    ),
    *(f"fuselage.drag_area.{axis}" for axis in "xyz"),
)
# What no scatter may pass: a wake is at most twice the induced velocity, momentum theory's power is the least, and more
# than 2.2 no aircraft file takes for a plate.
_LIMITS = {"wake_factor": (0.0, 2.0), "induced_power_factor": (1.0, math.inf), "plate_drag": (0.8, 2.2)}


@dataclass(frozen=True)
class Scatter:
    """Greatest deviations; each is drawn evenly between its negative and itself."""

    wind: float = 10.0  # speed, from any direction [m/s]
    mass: float = 0.10  # share; the moments of inertia go with it
    centre_of_mass: float = 0.02  # along each axis [m]
    aerodynamics: float = 0.15  # share of each coefficient, all independent


@dataclass(frozen=True)
class Case:
    """One flight of a campaign; SI and radians."""

    seed: int  # of the campaign
    number: int
    wind_ned: tuple[float, float, float]  # steady, blowing to [m/s]
    heading: float  # at the start [rad]
    mass: float  # factor
    centre_of_mass: tuple[float, float, float]  # shift, body axes [m]
    aerodynamics: Mapping[str, float]  # factor by path in the aircraft file


def draw_case(seed: int, number: int, scatter: Scatter) -> Case:
    """Case of this number in the campaign of this seed, both 0 or more."""
    streams = np.random.SeedSequence(seed, spawn_key=(number,)).spawn(5)
    wind, heading, mass, centre, aerodynamics = map(np.random.default_rng, streams)
    speed, direction = wind.uniform(0.0, scatter.wind), wind.uniform(0.0, 2.0 * math.pi)
    share = scatter.aerodynamics
    x, y, z = centre.uniform(-scatter.centre_of_mass, scatter.centre_of_mass, 3).tolist()
    return Case(
        seed=seed,
        number=number,
        wind_ned=(speed * math.cos(direction), speed * math.sin(direction), 0.0),
        heading=heading.uniform(0.0, 2.0 * math.pi),
        mass=1.0 + mass.uniform(-scatter.mass, scatter.mass),
        centre_of_mass=(x, y, z),
        aerodynamics={path: 1.0 + aerodynamics.uniform(-share, share) for path in AERODYNAMICS},
    )


def scattered_aircraft(nominal: Aircraft, case: Case) -> Aircraft:
    """The aircraft that flies the case; left and right side stay alike, as the aircraft file has them.

    Raises ValueError where the nominal aircraft is so near an end of what is plausible that a scattered value is not.
    """
    properties = nominal.mass_properties
    centre = np.add(properties.centre_of_mass, case.centre_of_mass)
    values: dict[str, Any] = {
        f"mass_properties.{name}": getattr(properties, name) * case.mass
        for name in ("mass", "ixx", "iyy", "izz", "ixz")
    }
    values |= {f"mass_properties.centre_of_mass.{axis}": float(centre[i]) for i, axis in enumerate("xyz")}
    for path, factor in case.aerodynamics.items():
        lowest, highest = _LIMITS.get(path.rpartition(".")[2], (-math.inf, math.inf))
        values[path] = min(max(_value(nominal, path) * factor, lowest), highest)
    return nominal.with_values(values)


def _value(aircraft: Aircraft, path: str) -> float:
    """The value at a dotted path; x, y, z are the components of a vector."""
    value: Any = aircraft
    for name in path.split("."):
        value = value["xyz".index(name)] if name in ("x", "y", "z") else getattr(value, name)
    return value
