"""What instruments make of the air: pressure altitude and equivalent airspeed, by the standard atmosphere."""

import math

__all__ = ["equivalent_airspeed", "pressure_altitude"]

SEA_LEVEL_PRESSURE = 101325.0  # US Standard Atmosphere 1976 [Pa]
SEA_LEVEL_TEMPERATURE = 288.15  # [K]
SEA_LEVEL_DENSITY = 1.225  # [kg/m^3]
LAPSE_RATE = 0.0065  # of the troposphere [K/m]
PRESSURE_EXPONENT = 0.190263  # R L / g of the troposphere


def pressure_altitude(pressure: float) -> float:
    """Altitude [m] at which the standard atmosphere has this static pressure [Pa]; troposphere."""
    return SEA_LEVEL_TEMPERATURE / LAPSE_RATE * (1.0 - (pressure / SEA_LEVEL_PRESSURE) ** PRESSURE_EXPONENT)


def equivalent_airspeed(airspeed: float, density: float) -> float:
    """Equivalent airspeed [m/s], which an airspeed indicator shows, of a true one [m/s] at a density [kg/m^3]."""
    return airspeed * math.sqrt(density / SEA_LEVEL_DENSITY)
