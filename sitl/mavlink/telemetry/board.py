"""The flight controller's board: power, processor, memory, storage, relays, and what its links carry.

Its regulators are ideal and fed by the battery, it is as warm as the air; memory and storage are the computer's.
"""

import os
from typing import Any

from sitl.hil.hil_messages import ZERO_CELSIUS
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.telemetry.context import Context, boot_ms
from sitl.snapshot import Snapshot

__all__ = [
    "hw_status", "link_node_status", "mcu_status", "mem_info", "power_status", "relay_status", "storage_information",
]  # fmt: skip

RAIL, CORE = 5.0, 3.3  # [V]
FIRST = 0  # of the processors
STORAGE = 1  # of one
MIB = 1024.0 * 1024.0
LARGEST_16, LARGEST_32 = 0xFFFF, 0xFFFFFFFF
BUFFERS_FREE = 100  # [%]: what a socket does not take at once is dropped, nothing waits


def power_status(snapshot: Snapshot, _: Context) -> tuple[Any, ...]:
    """POWER_STATUS: rails of the board and of the servos [mV], both from the battery."""
    rail = _millivolts(RAIL, snapshot)
    return (rail, rail, mav.MAV_POWER_STATUS_BRICK_VALID | mav.MAV_POWER_STATUS_SERVO_VALID)


def hw_status(snapshot: Snapshot, _: Context) -> tuple[Any, ...]:
    """HWSTATUS: rail of the board [mV], errors on its bus."""
    return (_millivolts(RAIL, snapshot), 0)


def mcu_status(snapshot: Snapshot, _: Context) -> tuple[Any, ...]:
    """MCU_STATUS: temperature [cdegC], voltage and its range [mV]."""
    core = _millivolts(CORE, snapshot)
    return (FIRST, round((snapshot.temperature - ZERO_CELSIUS) * 100.0), core, core, core)


def mem_info(_: Snapshot, __: Context) -> tuple[Any, ...]:
    """MEMINFO: free memory of the computer [bytes], in both fields as much as they hold."""
    free = os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    return (0, min(free, LARGEST_16), min(free, LARGEST_32))


def storage_information(snapshot: Snapshot, context: Context) -> tuple[Any, ...]:
    """STORAGE_INFORMATION: the disk that files are kept on [MiB]; none while nothing is kept."""
    total = used = available = 0.0
    status = mav.STORAGE_STATUS_EMPTY
    if context.storage is not None:
        try:
            disk = os.statvfs(context.storage)
        except OSError:  # the folder has been taken away
            status = mav.STORAGE_STATUS_NOT_SUPPORTED
        else:
            status = mav.STORAGE_STATUS_READY
            total = disk.f_blocks * disk.f_frsize / MIB
            used = (disk.f_blocks - disk.f_bfree) * disk.f_frsize / MIB
            available = disk.f_bavail * disk.f_frsize / MIB
    return (
        boot_ms(snapshot),
        STORAGE,
        STORAGE,
        status,
        total,
        used,
        available,
        *(0.0, 0.0),
        mav.STORAGE_TYPE_HD,
        b"",
        mav.STORAGE_USAGE_FLAG_LOGS,
    )


def relay_status(snapshot: Snapshot, _: Context) -> tuple[Any, ...]:
    """RELAY_STATUS: there are none."""
    return (boot_ms(snapshot), 0, 0)


def link_node_status(snapshot: Snapshot, context: Context) -> tuple[Any, ...]:
    """LINK_NODE_STATUS: what has come and gone over all links; gaps in the numbers of others are not counted."""
    return (
        round(snapshot.time * 1e3),
        BUFFERS_FREE,
        BUFFERS_FREE,
        round(context.send_rate),
        round(context.receive_rate),
        min(context.malformed, LARGEST_16),
        context.dropped & LARGEST_16,
        0,
        context.sent & LARGEST_32,
        context.received & LARGEST_32,
        0,
    )


def _millivolts(voltage: float, snapshot: Snapshot) -> int:
    return round(min(voltage, snapshot.battery_voltage) * 1e3)
