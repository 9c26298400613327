"""Motors: speeds in rpm, voltages, and the current each controller draws from the battery."""

import math
from collections.abc import Callable

import pytest

from sitl.mavlink.dialect import tiltwing as mav
from sitl.snapshot import Snapshot
from tests.sitl.mavlink.telemetry.observed import Observed

Moment = Callable[..., Snapshot]


@pytest.fixture
def observed() -> Observed:
    return Observed()


@pytest.fixture
def powered(moment: Moment) -> Snapshot:
    snapshot = moment(battery_voltage=40.0)
    snapshot.outputs["electrical_power"] = (800.0, 760.0, -20.0)  # [W]; the tail motor brakes
    return snapshot


def test_esc_status(observed: Observed, powered: Snapshot) -> None:
    m = observed.sent("ESC_STATUS", powered)
    assert (m.index, m.time_usec) == (0, 12347500)
    assert m.rpm == [round(speed * 60.0 / math.tau) for speed in (600.0, 590.0, -300.0)] + [0]
    assert m.voltage == [40.0, 40.0, 40.0, 0.0]
    assert m.current == [20.0, 19.0, -0.5, 0.0]


def test_esc_info(observed: Observed, powered: Snapshot) -> None:
    m = observed.sent("ESC_INFO", powered)
    assert (m.index, m.count, m.info, m.connection_type) == (0, 3, 0b111, mav.ESC_CONNECTION_TYPE_PPM)
    assert m.counter == round(12.3475 * 50.0)
    assert (m.failure_flags, m.error_count, m.temperature) == ([0] * 4, [0] * 4, [32767] * 4)
    observed.flight.actuators.faults = ("right motor failed", "tilt servo stuck at 20 deg")
    assert observed.sent("ESC_INFO", powered).failure_flags == [0, mav.ESC_FAILURE_MOTOR_STUCK, 0, 0]


def test_esc_telemetry_has_no_signs(observed: Observed, powered: Snapshot) -> None:
    m = observed.sent("ESC_TELEMETRY_1_TO_4", powered)
    assert m.voltage == [4000, 4000, 4000, 0]
    assert m.current == [2000, 1900, 0, 0]
    assert m.rpm == [5730, 5634, 2865, 0]
    assert m.count == [617, 617, 617, 0]
    assert (m.temperature, m.totalcurrent) == ([0] * 4, [0] * 4)
    others = observed.sent("ESC_TELEMETRY_5_TO_8", powered)
    assert (others.rpm, others.voltage, others.count) == ([0] * 4, [0] * 4, [0] * 4)


def test_rpm_is_of_the_wings_rotors(observed: Observed, powered: Snapshot) -> None:
    m = observed.sent("RPM", powered)
    assert (m.rpm1, m.rpm2) == pytest.approx((600.0 * 30.0 / math.pi, 590.0 * 30.0 / math.pi))


def test_raw_rpm_takes_the_motors_in_turn(observed: Observed, powered: Snapshot) -> None:
    told = [observed.sent("RAW_RPM", powered) for _ in range(4)]
    assert [m.index for m in told] == [0, 1, 2, 0]
    assert told[2].frequency == pytest.approx(-300.0 * 30.0 / math.pi)


def test_currents_and_the_boards_make_up_the_batterys() -> None:
    observed = Observed(start="trim:20")
    observed.fly(5.0)
    avionics = observed.simulation.aircraft.battery.avionics_power
    snapshot = observed.simulation.snapshot()
    drawn = sum(observed.sent("ESC_STATUS", snapshot).current) + avionics / snapshot.battery_voltage
    assert drawn == pytest.approx(snapshot.battery_current, rel=0.02)


def test_an_empty_battery_does_not_divide_by_zero(observed: Observed, moment: Moment) -> None:
    assert observed.sent("ESC_STATUS", moment(battery_voltage=0.0)).current == [0.0] * 4
