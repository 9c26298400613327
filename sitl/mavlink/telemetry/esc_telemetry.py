"""The motors' speed controllers: ESC_STATUS, ESC_INFO, and ArduPilot's ESC_TELEMETRY and RPM.

Motors count as the channels do: left, right, tail. Speed controllers report all of it by themselves, ideally.
"""

import math
from typing import Any

from sitl.flight.actuator_watch import MOTORS
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.telemetry.context import Context, boot_us
from sitl.snapshot import Snapshot
from vehicle_model.state import ROTOR_SPEED

__all__ = ["esc_info", "esc_status", "esc_telemetry_1_to_4", "esc_telemetry_5_to_8", "raw_rpm", "rpm"]

COUNT = len(MOTORS)
FIRST = 0  # motor of a message
FIELDS = 4  # motors that one message has room for
UNUSED = FIELDS - COUNT
RPM = 30.0 / math.pi  # per rad/s
ONLINE = (1 << COUNT) - 1
UNKNOWN_TEMPERATURE = 0x7FFF
REPORTS = 50.0  # of each controller [1/s]
LARGEST_16 = 0xFFFF


def esc_status(snapshot: Snapshot, _: Context) -> tuple[Any, ...]:
    """ESC_STATUS: speed [rpm], negative in reverse; voltage [V]; current from the battery [A]."""
    unused = (0,) * UNUSED
    voltage = snapshot.battery_voltage
    return (
        FIRST,
        boot_us(snapshot),
        *(round(speed * RPM) for speed in _speeds(snapshot)),
        *unused,
        *(voltage,) * COUNT,
        *unused,
        *_currents(snapshot),
        *unused,
    )


def esc_info(snapshot: Snapshot, context: Context) -> tuple[Any, ...]:
    """ESC_INFO: how many there are, how they are connected, what has failed."""
    flight = context.flight
    faults = () if flight is None else flight.actuators.faults
    stuck = (mav.ESC_FAILURE_MOTOR_STUCK if any(motor in fault for fault in faults) else 0 for motor in MOTORS)
    return (
        FIRST,
        boot_us(snapshot),
        _reports(snapshot),
        COUNT,
        mav.ESC_CONNECTION_TYPE_PPM,
        ONLINE,
        *stuck,
        *(0,) * UNUSED,
        *(0,) * FIELDS,
        *(UNKNOWN_TEMPERATURE,) * FIELDS,
    )


def esc_telemetry_1_to_4(snapshot: Snapshot, _: Context) -> tuple[Any, ...]:
    """ESC_TELEMETRY_1_TO_4: voltage [cV], current [cA], speed [rpm], all without sign; reports counted.

    Temperature and charge are not measured: 0.
    """
    unused = (0,) * UNUSED
    reports = _reports(snapshot)
    return (
        *(0,) * FIELDS,
        *(round(snapshot.battery_voltage * 100.0),) * COUNT,
        *unused,
        *(round(max(current, 0.0) * 100.0) for current in _currents(snapshot)),
        *unused,
        *(0,) * FIELDS,
        *(round(abs(speed) * RPM) for speed in _speeds(snapshot)),
        *unused,
        *(reports,) * COUNT,
        *unused,
    )


def esc_telemetry_5_to_8(_: Snapshot, __: Context) -> tuple[Any, ...]:
    """ESC_TELEMETRY_5_TO_8: there are none, and nothing was ever heard of them."""
    return (0,) * (6 * FIELDS)


def rpm(snapshot: Snapshot, _: Context) -> tuple[Any, ...]:
    """RPM: of the wing's rotors, left and right [rpm]."""
    left, right, _tail = _speeds(snapshot)
    return (left * RPM, right * RPM)


def raw_rpm(snapshot: Snapshot, context: Context) -> tuple[Any, ...]:
    """RAW_RPM: speed of one motor [rpm], the next one with each message."""
    motor = context.next_motor
    context.next_motor = (motor + 1) % COUNT
    return (motor, _speeds(snapshot)[motor] * RPM)


def _speeds(snapshot: Snapshot) -> list[float]:
    """Of the rotors [rad/s]."""
    return snapshot.state[ROTOR_SPEED : ROTOR_SPEED + COUNT].tolist()


def _currents(snapshot: Snapshot) -> list[float]:
    """That the controllers draw from the battery [A], negative while a motor brakes."""
    voltage = max(snapshot.battery_voltage, 1e-3)
    return [power / voltage for power in snapshot.outputs["electrical_power"].tolist()]


def _reports(snapshot: Snapshot) -> int:
    return round(snapshot.time * REPORTS) & LARGEST_16
