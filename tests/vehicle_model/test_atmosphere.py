"""The atmosphere against the printed tables of the 1976 standard and against hydrostatic balance."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vehicle_model.atmosphere import air_density, atmosphere

R0, G0 = 6356766.0, 9.80665


def geometric(geopotential: float) -> float:
    return R0 * geopotential / (R0 - geopotential)


# U.S. Standard Atmosphere, 1976, table I: geometric height [m], T [K], p [Pa], density [kg/m^3], speed of sound [m/s].
TABLE = [
    (0.0, 288.150, 101325.0, 1.22500, 340.294),
    (500.0, 284.900, 95461.3, 1.16727, 338.370),
    (1000.0, 281.651, 89876.3, 1.11166, 336.435),
    (3000.0, 268.659, 70121.2, 0.90925, 328.584),
    (5000.0, 255.676, 54048.3, 0.73643, 320.546),
    (10000.0, 223.252, 26499.9, 0.41351, 299.532),
]


@pytest.mark.parametrize(("height", "temperature", "pressure", "density", "speed_of_sound"), TABLE)
def test_atmosphere_equals_the_standards_table_to_the_printed_digits(
    height: float, temperature: float, pressure: float, density: float, speed_of_sound: float
) -> None:
    t, p, rho, a = atmosphere(height)
    assert t == pytest.approx(temperature, abs=6e-4)
    assert p == pytest.approx(pressure, abs=0.06)
    assert rho == pytest.approx(density, abs=6e-6)
    assert a == pytest.approx(speed_of_sound, abs=6e-4)


# The same, table of layer bases by geopotential height [m]: temperature and pressure.
@pytest.mark.parametrize(
    ("geopotential", "temperature", "pressure"),
    [
        (-5000.0, 320.65, 177687.0),
        (11000.0, 216.65, 22632.06),
        (20000.0, 216.65, 5474.889),
        (32000.0, 228.65, 868.0187),
        (47000.0, 270.65, 110.9063),
        (51000.0, 270.65, 66.93887),
        (71000.0, 214.65, 3.956420),
        (84852.0, 186.946, 0.37338),
    ],
)
@pytest.mark.parametrize("side", [-1e-6, 0.0, 1e-6])
def test_layers_meet_at_the_standards_base_values(
    geopotential: float, temperature: float, pressure: float, side: float
) -> None:
    t, p, _, _ = atmosphere(geometric(geopotential) + side)
    assert t == pytest.approx(temperature, abs=1e-6)
    assert p == pytest.approx(pressure, rel=1e-5)


@given(st.floats(-4990.0, 85900.0))
def test_pressure_balances_the_weight_of_the_air_above(height: float) -> None:
    step = 0.5
    slope = (atmosphere(height + step)[1] - atmosphere(height - step)[1]) / (2.0 * step)
    gravity = G0 * (R0 / (R0 + height)) ** 2
    assert slope == pytest.approx(-air_density(height) * gravity, rel=2e-6)


def test_values_of_the_ends_hold_beyond_them_and_stay_finite() -> None:
    assert atmosphere(1e7) == atmosphere(geometric(84852.0) + 1.0)
    assert atmosphere(-2e4) == atmosphere(geometric(-5000.0) - 1.0)
    assert all(math.isfinite(value) for value in atmosphere(1e9))
