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


def _density_exponent(lapse: float, base_temperature: float) -> float:
    """Exponent of the density of a layer, from hydrostatic balance, eqs (33a) and (33b) over the gas law.

    rho/rho_base is (T/T_base)^exponent, or exp(exponent climb) where temperature is constant [1/m].
    """
    if lapse == 0.0:
        return -GRAVITY / (GAS_CONSTANT * base_temperature)
    return -GRAVITY / (GAS_CONSTANT * lapse) - 1.0


def _layers() -> tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]:
    """Temperature and density at the base of each layer, from the ground up, and its density exponent."""
    temperatures = [SEA_LEVEL_TEMPERATURE]
    densities = [SEA_LEVEL_PRESSURE / (GAS_CONSTANT * SEA_LEVEL_TEMPERATURE)]
    exponents: list[float] = []
    for layer, lapse in enumerate(LAYER_LAPSE):
        exponents.append(_density_exponent(lapse, temperatures[-1]))
        if layer + 1 < len(LAYER_HEIGHT):
            climb = LAYER_HEIGHT[layer + 1] - LAYER_HEIGHT[layer]
            top = temperatures[-1] + lapse * climb
            ratio = (top / temperatures[-1]) ** exponents[-1] if lapse else math.exp(exponents[-1] * climb)
            temperatures.append(top)
            densities.append(densities[-1] * ratio)
    return tuple(temperatures), tuple(densities), tuple(exponents)


LAYER_TEMPERATURE, LAYER_DENSITY, LAYER_EXPONENT = _layers()
LAYER_RELATIVE_LAPSE = tuple(lapse / base for lapse, base in zip(LAYER_LAPSE, LAYER_TEMPERATURE, strict=True))


@compiled
def geopotential_height(height: float) -> float:
    """Geopotential height H = r0 h/(r0 + h) of a geometric height [m], kept to where the standard is defined."""
    return min(max(EARTH_RADIUS * height / (EARTH_RADIUS + height), LOWEST), HIGHEST)


@compiled
def layer_of(geopotential: float) -> int:
    """Number of the layer at a geopotential height [m], the lowest being 0."""
    layer = 0
    while layer + 1 < len(LAYER_HEIGHT) and geopotential >= LAYER_HEIGHT[layer + 1]:
        layer += 1
    return layer


@compiled
def air_density(height: float) -> float:
    """Density [kg/m^3] at a geometric height [m]; every right-hand side asks for it, so it has no division to spare."""
    geopotential = geopotential_height(height)
    layer = layer_of(geopotential)
    climb = geopotential - LAYER_HEIGHT[layer]
    if LAYER_LAPSE[layer] != 0.0:
        climb = math.log(1.0 + LAYER_RELATIVE_LAPSE[layer] * climb)
    return LAYER_DENSITY[layer] * math.exp(LAYER_EXPONENT[layer] * climb)


@compiled
def atmosphere(height: float) -> tuple[float, float, float, float]:
    """Air at a geometric height above mean sea level [m].

    Returns temperature [K], pressure [Pa], density [kg/m^3] and speed of sound [m/s]. Below -5 km and above 86 km,
    where the standard's layers end, the values stay those of the end.
    """
    geopotential = geopotential_height(height)
    layer = layer_of(geopotential)
    temperature = LAYER_TEMPERATURE[layer] + LAYER_LAPSE[layer] * (geopotential - LAYER_HEIGHT[layer])
    density = air_density(height)
    pressure = density * GAS_CONSTANT * temperature
    return temperature, pressure, density, math.sqrt(HEAT_RATIO * GAS_CONSTANT * temperature)
