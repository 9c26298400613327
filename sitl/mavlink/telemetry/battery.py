"""The battery: BATTERY_STATUS, BATTERY_INFO and, for older ground stations, SMART_BATTERY_INFO.

https://mavlink.io/en/services/battery.html. It has one id, feeds all there is, and its cells are all alike.
"""

import math
from functools import cache
from typing import Any

from sitl.flight.flight import Flight
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.telemetry.context import Context
from sitl.snapshot import Snapshot
from vehicle_model.aircraft_tables import Battery
from vehicle_model.battery import open_circuit_voltage

__all__ = ["battery_info", "battery_status", "charge_state", "smart_battery_info"]

ID = 0
CELL_FIELDS, MORE_CELL_FIELDS = 10, 4
NO_CELL, NO_MORE_CELL = 0xFFFF, 0
MOST_MILLIVOLTS = 0xFFFE  # that one cell's field can hold
UNKNOWN_TEMPERATURE = 0x7FFF
NOT_MEASURED = -1
UNKNOWN_TIME = 0
LEAST_CURRENT = 0.05  # from which it makes sense to say how long the charge lasts [A]
LONGEST = 0x7FFFFFFF  # [s]
HEALTHY = 100  # [%]: it does not age
UNKNOWN_CYCLES = 0xFFFF
UNKNOWN_VOLTAGE = 0xFFFF  # of a cell
SECONDS_PER_HOUR = 3600.0
LEVELS = (
    ("BAT_EMERGEN_THR", mav.MAV_BATTERY_CHARGE_STATE_EMERGENCY),
    ("BAT_CRIT_THR", mav.MAV_BATTERY_CHARGE_STATE_CRITICAL),
    ("BAT_LOW_THR", mav.MAV_BATTERY_CHARGE_STATE_LOW),
)


def battery_status(snapshot: Snapshot, context: Context) -> tuple[Any, ...]:
    """BATTERY_STATUS: cells [mV], current [cA], charge used [mAh], what is left [%] and for how long [s].

    A source that never empties says neither what was used nor what is left.
    """
    battery = context.simulation.aircraft.battery
    remaining, current = snapshot.battery_remaining, snapshot.battery_current
    used, share, lasts = NOT_MEASURED, NOT_MEASURED, UNKNOWN_TIME
    if remaining is not None:
        used = round((1.0 - remaining) * battery.capacity / SECONDS_PER_HOUR * 1e3)
        share = round(remaining * 100.0)
        if current > LEAST_CURRENT:
            lasts = min(round(remaining * battery.capacity / current), LONGEST)
    cells, more_cells = _cells(snapshot.battery_voltage, battery.cells)
    return (
        ID,
        mav.MAV_BATTERY_FUNCTION_ALL,
        mav.MAV_BATTERY_TYPE_LIPO,
        UNKNOWN_TEMPERATURE,
        *cells,
        round(current * 100.0),
        used,
        NOT_MEASURED,
        share,
        lasts,
        charge_state(remaining, context.flight),
        *more_cells,
        mav.MAV_BATTERY_MODE_UNKNOWN,
        0,
    )


def battery_info(_: Snapshot, context: Context) -> tuple[Any, ...]:
    """BATTERY_INFO: chemistry, cells, voltages [V] and capacity [Ah] of the aircraft's file; it is new."""
    return _info(context.simulation.aircraft.battery)


def smart_battery_info(_: Snapshot, context: Context) -> tuple[Any, ...]:
    """SMART_BATTERY_INFO: what BATTERY_INFO says of capacity [mAh] and cells, in its older units; the rest unknown."""
    battery = context.simulation.aircraft.battery
    capacity = round(battery.capacity / SECONDS_PER_HOUR * 1e3)
    return (
        ID,
        mav.MAV_BATTERY_FUNCTION_ALL,
        mav.MAV_BATTERY_TYPE_LIPO,
        capacity,
        capacity,
        UNKNOWN_CYCLES,
        *(b"", b""),
        0,
        *(UNKNOWN_VOLTAGE, UNKNOWN_VOLTAGE),
        round(open_circuit_voltage(1.0, 0.0) * 1e3),
        round(open_circuit_voltage(1.0, 1.0) * 1e3),
        battery.cells,
        *(0, 0),
        b"",
    )


def charge_state(remaining: float | None, flight: Flight | None) -> int:
    """MAV_BATTERY_CHARGE_STATE of a share 0..1 of the charge, by the flight's thresholds."""
    if remaining is None or flight is None:
        return mav.MAV_BATTERY_CHARGE_STATE_UNDEFINED
    for name, state in LEVELS:
        if remaining < flight.parameters[name]:
            return state
    return mav.MAV_BATTERY_CHARGE_STATE_OK


@cache
def _info(battery: Battery) -> tuple[Any, ...]:
    empty, full = open_circuit_voltage(1.0, 0.0), open_circuit_voltage(1.0, 1.0)
    capacity = battery.capacity / SECONDS_PER_HOUR
    return (
        ID,
        mav.MAV_BATTERY_FUNCTION_ALL,
        mav.MAV_BATTERY_TYPE_LIPO,
        HEALTHY,
        battery.cells,
        UNKNOWN_CYCLES,
        *(0, 0.0, 0.0),
        empty,
        full,
        0.0,
        battery.voltage,
        *(0.0, 0.0),
        capacity,
        capacity,
        *(b"", b"", b""),
    )


def _cells(voltage: float, count: int) -> tuple[list[int], list[int]]:
    """The fields of BATTERY_STATUS for a pack's voltage [V], one a cell; of a pack with too many, in the first ones."""
    if count <= CELL_FIELDS + MORE_CELL_FIELDS:
        cell = min(max(round(voltage / count * 1e3), 1), MOST_MILLIVOLTS)
        first, more = min(count, CELL_FIELDS), max(count - CELL_FIELDS, 0)
        return (
            [cell] * first + [NO_CELL] * (CELL_FIELDS - first),
            [cell] * more + [NO_MORE_CELL] * (MORE_CELL_FIELDS - more),
        )
    whole = max(round(voltage * 1e3), 0)
    fields = min(math.ceil(whole / MOST_MILLIVOLTS) or 1, CELL_FIELDS)
    cells = [min(whole - i * MOST_MILLIVOLTS, MOST_MILLIVOLTS) for i in range(fields)]
    return cells + [NO_CELL] * (CELL_FIELDS - fields), [NO_MORE_CELL] * MORE_CELL_FIELDS
