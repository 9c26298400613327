"""The air at rest: US Standard Atmosphere 1976, from 5 km below sea level to 86 km.

Temperature is piecewise linear in geopotential height and pressure follows from hydrostatic balance, so each layer
has a closed form. Source: U.S. Standard Atmosphere, 1976 (NOAA-S/T 76-1562), sections 1.2 and 1.3.
"""

import math

from vehicle_model.compiled import compiled

__all__ = ["air_density", "atmosphere"]

GRAVITY = 9.80665  # g0 [m/s^2]
EARTH_RADIUS = 6356766.0  # r0, of the geopotential height [m]
GAS_CONSTANT = 8314.32 / 28.9644  # of air, R*/M0 of the 1976 standard [J/(kg K)]
HEAT_RATIO = 1.4
SEA_LEVEL_TEMPERATURE = 288.15  # [K]
SEA_LEVEL_PRESSURE = 101325.0  # [Pa]

# Layers by the geopotential height of their base [m] and their lapse rate dT/dH [K/m]; the last is where they end.
LAYER_HEIGHT = (0.0, 11000.0, 20000.0, 32000.0, 47000.0, 51000.0, 71000.0)
LAYER_LAPSE = (-0.0065, 0.0, 0.001, 0.0028, 0.0, -0.0028, -0.002)
LOWEST = -5000.0
HIGHEST = 84852.0


def _pressure_ratio(lapse: float, base_temperature: float, climb: float) -> float:
    """p/p_base after a climb [m, geopotential] through a layer: hydrostatic balance, eqs (33a) and (33b)."""
    if lapse == 0.0:
        return math.exp(-GRAVITY * climb / (GAS_CONSTANT * base_temperature))
    # A power as exp and log, which cost half of it: this runs in every right-hand side.
    return math.exp(-GRAVITY / (GAS_CONSTANT * lapse) * math.log(1.0 + lapse * climb / base_temperature))


def _layer_bases() -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Temperature and pressure at the base of each layer, from the ground up."""
    temperatures, pressures = [SEA_LEVEL_TEMPERATURE], [SEA_LEVEL_PRESSURE]
    for layer in range(len(LAYER_HEIGHT) - 1):
        climb = LAYER_HEIGHT[layer + 1] - LAYER_HEIGHT[layer]
        pressures.append(pressures[-1] * _pressure_ratio(LAYER_LAPSE[layer], temperatures[-1], climb))
        temperatures.append(temperatures[-1] + LAYER_LAPSE[layer] * climb)
    return tuple(temperatures), tuple(pressures)


LAYER_TEMPERATURE, LAYER_PRESSURE = _layer_bases()
pressure_ratio = compiled(_pressure_ratio)


@compiled
def geopotential_height(height: float) -> float:
    """Geopotential height H = r0 h/(r0 + h) of a geometric height [m], kept to where the standard is defined."""
    return min(max(EARTH_RADIUS * height / (EARTH_RADIUS + height), LOWEST), HIGHEST)


@compiled
def atmosphere(height: float) -> tuple[float, float, float, float]:
    """Air at a geometric height above mean sea level [m].

    Returns temperature [K], pressure [Pa], density [kg/m^3] and speed of sound [m/s]. Below -5 km and above 86 km,
    where the standard's layers end, the values stay those of the end.
    """
    geopotential = geopotential_height(height)
    layer = 0
    while layer + 1 < len(LAYER_HEIGHT) and geopotential >= LAYER_HEIGHT[layer + 1]:
        layer += 1
    climb = geopotential - LAYER_HEIGHT[layer]
    temperature = LAYER_TEMPERATURE[layer] + LAYER_LAPSE[layer] * climb
    pressure = LAYER_PRESSURE[layer] * pressure_ratio(LAYER_LAPSE[layer], LAYER_TEMPERATURE[layer], climb)
    density = pressure / (GAS_CONSTANT * temperature)
    return temperature, pressure, density, math.sqrt(HEAT_RATIO * GAS_CONSTANT * temperature)


@compiled
def air_density(height: float) -> float:
    """Density [kg/m^3] at a geometric height [m]; inlined, it costs no more than the one power it needs."""
    return atmosphere(height)[2]
