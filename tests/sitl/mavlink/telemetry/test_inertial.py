"""Readings of the ideal sensors, computed a second time: mG, mrad/s, milligauss, hPa, hundredths of a degree."""

import math
from collections.abc import Callable

import pytest
from pygeomag import GeoMag
from scipy.spatial.transform import Rotation

from sitl.snapshot import Snapshot
from tests.sitl.mavlink.telemetry.observed import EPOCH, Observed

G = 9.80665
YEAR = 2026.0 + 263.0 / 365.0  # EPOCH is a 21st of September

Moment = Callable[..., Snapshot]


@pytest.fixture
def observed() -> Observed:
    return Observed()


def magnetic_field_body(snapshot: Snapshot) -> list[float]:
    """By the World Magnetic Model and scipy's rotations [milligauss]."""
    where = math.degrees(snapshot.latitude), math.degrees(snapshot.longitude), snapshot.height_ellipsoid * 1e-3
    field = GeoMag().calculate(*where, YEAR)
    turn = Rotation.from_quat(snapshot.quaternion, scalar_first=True)
    return (turn.inv().apply([field.x, field.y, field.z]) * 1e-2).tolist()


@pytest.mark.parametrize("name", ["SCALED_IMU", "SCALED_IMU2", "SCALED_IMU3", "RAW_IMU"])
def test_inertial_units_are_in_thousandths(moment: Moment, observed: Observed, name: str) -> None:
    m = observed.sent(name, moment())
    assert (m.xacc, m.yacc, m.zacc) == tuple(round(a / G * 1e3) for a in (0.5, -0.25, -10.5)) == (51, -25, -1071)
    assert (m.xgyro, m.ygyro, m.zgyro) == (10, -20, 30)
    assert (m.xmag, m.ymag, m.zmag) == pytest.approx(magnetic_field_body(moment()), abs=1.0)
    assert m.temperature == 1135  # 284.5 K
    if name == "RAW_IMU":
        assert (m.time_usec, m.id) == (12347500, 0)
    else:
        assert m.time_boot_ms == 12348


def test_a_temperature_of_zero_is_told_as_a_hundredth_for_zero_is_none(moment: Moment, observed: Observed) -> None:
    for name in ("SCALED_IMU", "RAW_IMU", "SCALED_PRESSURE"):
        assert observed.sent(name, moment(temperature=273.15)).temperature == 1


def test_highres_imu(moment: Moment, observed: Observed) -> None:
    m = observed.sent("HIGHRES_IMU", moment())
    assert m.time_usec == 12347500
    assert (m.xacc, m.yacc, m.zacc) == (0.5, -0.25, -10.5)
    assert (m.xgyro, m.ygyro, m.zgyro) == pytest.approx((0.01, -0.02, 0.03))
    gauss = [field * 1e-3 for field in magnetic_field_body(moment())]
    assert (m.xmag, m.ymag, m.zmag) == pytest.approx(gauss, abs=1e-3)
    assert m.abs_pressure == 950.0
    assert m.diff_pressure == pytest.approx(0.5 * 1.16 * 18.0**2 / 100.0)
    assert m.pressure_alt == pytest.approx(540.3, abs=0.2)  # standard atmosphere (1976), table
    assert m.temperature == pytest.approx(11.35)
    assert (m.fields_updated, m.id) == (0x1FFF, 0)


@pytest.mark.parametrize("name", ["SCALED_PRESSURE", "SCALED_PRESSURE2"])
def test_pressures(moment: Moment, observed: Observed, name: str) -> None:
    m = observed.sent(name, moment())
    assert (m.time_boot_ms, m.press_abs, m.temperature, m.temperature_press_diff) == (12348, 950.0, 1135, 1135)
    assert m.press_diff == pytest.approx(1.87920)


def test_air_from_behind_is_less_pressure_and_no_airspeed(moment: Moment, observed: Observed) -> None:
    snapshot = moment()
    snapshot.outputs["velocity_air_body"] = (-18.0, 1.5, 2.5)
    assert observed.sent("SCALED_PRESSURE", snapshot).press_diff == pytest.approx(-1.87920)
    assert observed.sent("AIRSPEED", snapshot).airspeed == 0.0


def test_airspeed_is_calibrated_and_along_the_body(moment: Moment, observed: Observed) -> None:
    m = observed.sent("AIRSPEED", moment())
    assert m.airspeed == pytest.approx(math.sqrt(2.0 * m.raw_press * 100.0 / 1.225))
    assert m.raw_press == pytest.approx(1.87920)
    assert (m.id, m.temperature, m.flags) == (0, 1135, 2)  # in use, well


def test_vibration(moment: Moment, observed: Observed) -> None:
    m = observed.sent("VIBRATION", moment())
    assert m.time_usec == 12347500
    assert (m.vibration_x, m.vibration_y, m.vibration_z) == (0.0, 0.0, 0.0)
    assert (m.clipping_0, m.clipping_1, m.clipping_2) == (0, 0, 0)


def test_epoch_is_in_the_year_that_the_field_is_compared_for() -> None:
    from datetime import UTC, datetime

    assert datetime.fromtimestamp(EPOCH, UTC).timetuple()[:3] == (2026, 9, 21)
