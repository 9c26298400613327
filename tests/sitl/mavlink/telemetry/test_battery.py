"""The battery's messages against its file and the definitions' rules for unused fields."""

from collections.abc import Callable

import pytest

from sitl.mavlink.dialect import tiltwing as mav
from sitl.snapshot import Snapshot
from tests.sitl.mavlink.telemetry.observed import Observed
from vehicle_model.aircraft import Aircraft

Moment = Callable[..., Snapshot]


@pytest.fixture
def observed() -> Observed:
    return Observed()


def test_battery_status_of_twelve_cells(moment: Moment, observed: Observed) -> None:
    m = observed.sent("BATTERY_STATUS", moment(battery_voltage=45.6, battery_current=31.25, battery_remaining=0.625))
    assert (m.id, m.battery_function, m.type) == (0, mav.MAV_BATTERY_FUNCTION_ALL, mav.MAV_BATTERY_TYPE_LIPO)
    assert m.voltages == [3800] * 10
    assert m.voltages_ext == [3800, 3800, 0, 0]
    assert (m.current_battery, m.current_consumed, m.battery_remaining) == (3125, 6000, 62)  # of 16 Ah
    assert m.time_remaining == round(10.0 / 31.25 * 3600)  # 10 Ah left
    assert (m.temperature, m.energy_consumed, m.mode, m.fault_bitmask) == (32767, -1, 0, 0)


def test_a_source_that_never_empties_says_neither_used_nor_left(moment: Moment, observed: Observed) -> None:
    m = observed.sent("BATTERY_STATUS", moment(battery_voltage=44.4, battery_remaining=None))
    assert (m.current_consumed, m.battery_remaining, m.time_remaining) == (-1, -1, 0)
    assert m.charge_state == mav.MAV_BATTERY_CHARGE_STATE_UNDEFINED


@pytest.mark.parametrize(
    ("remaining", "state"), [(0.5, "OK"), (0.19, "LOW"), (0.11, "CRITICAL"), (0.05, "EMERGENCY"), (0.0, "EMERGENCY")]
)
def test_charge_state_follows_the_flights_thresholds(
    moment: Moment, observed: Observed, remaining: float, state: str
) -> None:
    observed.flight.parameters.load({"BAT_LOW_THR": 0.2, "BAT_CRIT_THR": 0.12, "BAT_EMERGEN_THR": 0.07})
    m = observed.sent("BATTERY_STATUS", moment(battery_voltage=40.0, battery_remaining=remaining))
    assert m.charge_state == getattr(mav, f"MAV_BATTERY_CHARGE_STATE_{state}")


@pytest.mark.parametrize(
    ("cells", "voltage", "first", "more"),
    [
        (4, 16.0, [4000] * 4 + [65535] * 6, [0] * 4),
        (10, 40.0, [4000] * 10, [0] * 4),
        (14, 56.0, [4000] * 10, [4000] * 4),
        (15, 60.0, [60000] + [65535] * 9, [0] * 4),  # too many: the whole in the first
        (100, 400.0, [65534] * 6 + [6796] + [65535] * 3, [0] * 4),  # 6 x 65.534 V + 6.796 V
    ],
)
def test_cells_fill_their_fields_as_the_definition_says(
    moment: Moment, aircraft: Aircraft, cells: int, voltage: float, first: list[int], more: list[int]
) -> None:
    observed = Observed(
        aircraft=aircraft.with_values({"battery.cells": cells, "battery.voltage": voltage}), autopilot=False
    )
    m = observed.sent("BATTERY_STATUS", moment(battery_voltage=voltage))
    assert m.voltages == first
    assert m.voltages_ext == more


def test_an_empty_battery_still_measures_something(moment: Moment, observed: Observed) -> None:
    m = observed.sent("BATTERY_STATUS", moment(battery_voltage=0.0, battery_remaining=0.0, battery_current=0.0))
    assert m.voltages_ext == [1, 1, 0, 0]  # zero would be no cell
    assert (m.battery_remaining, m.time_remaining) == (0, 0)


def test_battery_info_is_the_aircrafts_file(observed: Observed) -> None:
    m = observed.sent("BATTERY_INFO")
    assert (m.id, m.battery_function, m.type, m.cells_in_series) == (0, 1, 1, 12)
    assert (m.design_capacity, m.full_charge_capacity, m.nominal_voltage) == pytest.approx((16.0, 16.0, 44.4))
    # Chen and Rincon-Mora (2006): 3.685 - 1.031 and 3.685 + 0.2156 - 0.1178 + 0.3201 V.
    assert (m.resting_minimum_voltage, m.charging_maximum_voltage) == pytest.approx((2.654, 4.1029))
    assert (m.state_of_health, m.cycle_count, m.weight) == (100, 65535, 0)
    assert (m.discharge_minimum_voltage, m.charging_minimum_voltage, m.charging_maximum_current) == (0.0, 0.0, 0.0)
    assert (m.discharge_maximum_current, m.discharge_maximum_burst_current) == (0.0, 0.0)
    assert (m.manufacture_date, m.serial_number, m.name) == ("", "", "")


def test_older_ground_stations_hear_the_same_of_it(observed: Observed) -> None:
    m = observed.sent("SMART_BATTERY_INFO")
    assert (m.id, m.battery_function, m.type, m.cells_in_series) == (0, 1, 1, 12)
    assert (m.capacity_full_specification, m.capacity_full, m.cycle_count, m.weight) == (16000, 16000, 65535, 0)
    assert (m.resting_minimum_voltage, m.charging_maximum_voltage) == (2654, 4103)
    assert (m.discharge_minimum_voltage, m.charging_minimum_voltage) == (65535, 65535)
    assert (m.discharge_maximum_current, m.discharge_maximum_burst_current) == (0, 0)
    assert (m.serial_number, m.device_name, m.manufacture_date) == ("", "", "")


def test_a_flight_empties_it() -> None:
    observed = Observed(start="trim:20")
    before = observed.sent("BATTERY_STATUS")
    observed.fly(10.0)
    after = observed.sent("BATTERY_STATUS")
    drawn = after.current_battery / 100.0 * 10.0 / 3.6  # mAh
    assert after.current_consumed - before.current_consumed == pytest.approx(drawn, rel=0.2)
