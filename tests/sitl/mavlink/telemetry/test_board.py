"""The board's supplies, memory, storage and links."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from sitl.mavlink.dialect import tiltwing as mav
from sitl.snapshot import Snapshot
from tests.sitl.mavlink.telemetry.observed import Observed

Moment = Callable[..., Snapshot]


@pytest.fixture
def observed() -> Observed:
    return Observed()


def test_regulators_hold_their_voltage_as_long_as_the_battery_has_more(moment: Moment, observed: Observed) -> None:
    full, empty = moment(battery_voltage=44.0), moment(battery_voltage=2.5)
    power = observed.sent("POWER_STATUS", full)
    assert (power.Vcc, power.Vservo, power.flags) == (5000, 5000, 1 | 2)  # brick and servo supply valid
    assert observed.sent("POWER_STATUS", empty).Vcc == 2500
    assert (observed.sent("HWSTATUS", full).Vcc, observed.sent("HWSTATUS", full).I2Cerr) == (5000, 0)
    mcu = observed.sent("MCU_STATUS", full)
    assert (mcu.id, mcu.MCU_voltage, mcu.MCU_voltage_min, mcu.MCU_voltage_max) == (0, 3300, 3300, 3300)
    assert mcu.MCU_temperature == 1135  # of the air, 284.5 K


def test_free_memory_is_that_of_the_computer(observed: Observed) -> None:
    m = observed.sent("MEMINFO")
    assert m.brkval == 0
    assert m.freemem == 65535
    assert 1e6 < m.freemem32 <= 0xFFFFFFFF


def test_storage_is_the_disk_that_files_are_kept_on(observed: Observed, tmp_path: Path) -> None:
    nothing = observed.sent("STORAGE_INFORMATION")
    assert (nothing.status, nothing.total_capacity) == (mav.STORAGE_STATUS_EMPTY, 0.0)
    observed.context.storage = tmp_path
    m, disk = observed.sent("STORAGE_INFORMATION"), shutil.disk_usage(tmp_path)
    assert (m.storage_id, m.storage_count, m.status) == (1, 1, mav.STORAGE_STATUS_READY)
    assert m.total_capacity == pytest.approx(disk.total / 2**20)
    assert m.used_capacity == pytest.approx(disk.used / 2**20, rel=1e-2)
    assert m.available_capacity == pytest.approx(disk.free / 2**20, rel=1e-2)
    assert (m.read_speed, m.write_speed, m.name) == (0.0, 0.0, "")
    observed.context.storage = tmp_path / "gone"
    assert observed.sent("STORAGE_INFORMATION").status == mav.STORAGE_STATUS_NOT_SUPPORTED


def test_link_node_status_counts_all_links(moment: Moment, observed: Observed) -> None:
    context = observed.context
    context.sent, context.received, context.malformed, context.dropped = 2**32 + 7, 300, 70000, 65536 + 9
    context.send_rate, context.receive_rate = 21000.4, 512.0
    m = observed.sent("LINK_NODE_STATUS", moment())
    assert (m.timestamp, m.tx_buf, m.rx_buf) == (12348, 100, 100)
    assert (m.tx_rate, m.rx_rate) == (21000, 512)
    assert (m.messages_sent, m.messages_received, m.messages_lost) == (7, 300, 0)  # counters wrap around
    assert (m.rx_parse_err, m.tx_overflows, m.rx_overflows) == (65535, 9, 0)


def test_there_are_no_relays(moment: Moment, observed: Observed) -> None:
    m = observed.sent("RELAY_STATUS", moment())
    assert (m.time_boot_ms, m.on, m.present) == (12348, 0, 0)
