"""Units that aircraft files and check cases may use, their dimension and their size in SI."""

import math
from typing import NamedTuple

__all__ = ["UNITS", "Unit"]


class Unit(NamedTuple):
    """A unit: what it measures (as a noun phrase for messages) and how much of the SI unit it is."""

    dimension: str
    factor: float


_DEGREE = math.pi / 180
_RPM = 2 * math.pi / 60  # rad/s
_FOOT = 0.3048  # m
_SLUG = 0.45359237 * 9.80665 / _FOOT  # kg: what a pound-force accelerates by a foot per second squared

UNITS: dict[str, Unit] = {
    "1": Unit("a plain number", 1.0),
    "%": Unit("a plain number", 0.01),
    "m": Unit("a length", 1.0),
    "cm": Unit("a length", 1e-2),
    "mm": Unit("a length", 1e-3),
    "in": Unit("a length", 0.0254),
    "ft": Unit("a length", _FOOT),
    "m^2": Unit("an area", 1.0),
    "dm^2": Unit("an area", 1e-2),
    "cm^2": Unit("an area", 1e-4),
    "ft^2": Unit("an area", _FOOT**2),
    "kg": Unit("a mass", 1.0),
    "g": Unit("a mass", 1e-3),
    "slug": Unit("a mass", _SLUG),
    "kg m^2": Unit("a moment of inertia", 1.0),
    "kg cm^2": Unit("a moment of inertia", 1e-4),
    "g m^2": Unit("a moment of inertia", 1e-3),
    "g cm^2": Unit("a moment of inertia", 1e-7),
    "slug ft^2": Unit("a moment of inertia", _SLUG * _FOOT**2),
    "kg/m^3": Unit("a density", 1.0),
    "slug/ft^3": Unit("a density", _SLUG / _FOOT**3),
    "m/s": Unit("a velocity", 1.0),
    "ft/s": Unit("a velocity", _FOOT),
    "rad": Unit("an angle", 1.0),
    "deg": Unit("an angle", _DEGREE),
    "rad/s": Unit("an angular rate", 1.0),
    "deg/s": Unit("an angular rate", _DEGREE),
    "rpm": Unit("an angular rate", _RPM),
    "1/rad": Unit("a slope", 1.0),
    "1/deg": Unit("a slope", 1 / _DEGREE),
    "s": Unit("a time", 1.0),
    "ms": Unit("a time", 1e-3),
    "us": Unit("a time", 1e-6),
    "N/m": Unit("a stiffness", 1.0),
    "kN/m": Unit("a stiffness", 1e3),
    "N/mm": Unit("a stiffness", 1e3),
    "N s/m": Unit("a damping", 1.0),
    "V": Unit("a voltage", 1.0),
    "A": Unit("a current", 1.0),
    "mA": Unit("a current", 1e-3),
    "A s": Unit("a charge", 1.0),
    "A h": Unit("a charge", 3600.0),
    "mA h": Unit("a charge", 3.6),
    "W": Unit("a power", 1.0),
    "kW": Unit("a power", 1e3),
    "ohm": Unit("a resistance", 1.0),
    "mohm": Unit("a resistance", 1e-3),
    "rad/s/V": Unit("a motor velocity constant", 1.0),
    "rpm/V": Unit("a motor velocity constant", _RPM),
    "rad/s^2": Unit("a squared rate per angle", 1.0),  # (rad/s)^2 per rad
    "rpm^2/deg": Unit("a squared rate per angle", _RPM**2 / _DEGREE),
}
