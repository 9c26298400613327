"""Sensors that feel the motion and the air: inertial units, pressures, airspeed, vibration.

They are ideal, and all of a kind read the same: the readings of HIL_SENSOR in each message's own units.
"""

from typing import Any

from sitl.hil.air_data import equivalent_airspeed
from sitl.hil.hil_messages import MILLI_G, hil_sensor
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.telemetry.context import Context, boot_ms, boot_us
from sitl.snapshot import Snapshot

__all__ = ["airspeed", "highres_imu", "raw_imu", "scaled_imu", "scaled_pressure", "vibration"]

FIRST = 0  # of the sensors of one kind
MOTION = slice(1, 10)  # where things stand in HIL_SENSOR: specific force, turn rates, magnetic field
PRESSURE, PITOT_PRESSURE, TEMPERATURE = 10, 11, 13

# HIGHRES_IMU has the fields of HIL_SENSOR, in the same order and units.
highres_imu = hil_sensor


def scaled_imu(snapshot: Snapshot, context: Context) -> tuple[Any, ...]:
    """SCALED_IMU, SCALED_IMU2, SCALED_IMU3: mG, mrad/s, mgauss (body axes), temperature [cdegC]."""
    readings = hil_sensor(snapshot, context)
    return (boot_ms(snapshot), *_scaled(readings), _temperature(readings))


def raw_imu(snapshot: Snapshot, context: Context) -> tuple[Any, ...]:
    """RAW_IMU: in the units of SCALED_IMU, as ground stations take it."""
    readings = hil_sensor(snapshot, context)
    return (boot_us(snapshot), *_scaled(readings), FIRST, _temperature(readings))


def scaled_pressure(snapshot: Snapshot, context: Context) -> tuple[Any, ...]:
    """SCALED_PRESSURE, SCALED_PRESSURE2: static and differential pressure [hPa], temperature of both [cdegC]."""
    readings = hil_sensor(snapshot, context)
    temperature = _temperature(readings)
    return (boot_ms(snapshot), readings[PRESSURE], readings[PITOT_PRESSURE], temperature, temperature)


def airspeed(snapshot: Snapshot, context: Context) -> tuple[Any, ...]:
    """AIRSPEED: calibrated airspeed along the body [m/s], temperature [cdegC], differential pressure [hPa]."""
    along = max(float(snapshot.outputs["velocity_air_body"][0]), 0.0)
    readings = hil_sensor(snapshot, context)
    return (
        FIRST,
        equivalent_airspeed(along, snapshot.density),
        _temperature(readings),
        readings[PITOT_PRESSURE],
        mav.AIRSPEED_SENSOR_USING,
    )


def vibration(snapshot: Snapshot, _: Context) -> tuple[Any, ...]:
    """VIBRATION: none in a rigid aircraft with balanced propellers, and no reading is ever cut off."""
    return (boot_us(snapshot), 0.0, 0.0, 0.0, 0, 0, 0)


def _scaled(readings: tuple[Any, ...]) -> tuple[int, ...]:
    """Specific force [mG], turn rates [mrad/s] and magnetic field [mgauss], body axes."""
    ax, ay, az, p, q, r, mx, my, mz = readings[MOTION]
    return (
        round(ax / MILLI_G), round(ay / MILLI_G), round(az / MILLI_G),
        round(p * 1e3), round(q * 1e3), round(r * 1e3),
        round(mx * 1e3), round(my * 1e3), round(mz * 1e3),
    )  # fmt: skip


def _temperature(readings: tuple[Any, ...]) -> int:
    """Of the air [cdegC], where 0 would mean that nobody knows it."""
    return round(readings[TEMPERATURE] * 100.0) or 1
