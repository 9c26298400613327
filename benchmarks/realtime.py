"""How punctual the running vehicle is at 400 Hz, and what it costs.

Each tick is made visible: HIL_STATE_QUATERNION at 400 Hz carries its simulated time, and the kernel stamps its arrival
at our socket. A tick is late by how much more its arrival lags its simulated time than the earliest tick's does.
"""

import time
from collections.abc import Sequence

from figures import Figure
from pymavlink.dialects.v20 import common
from vehicle import HIL_STATE_QUATERNION, Vehicle, sim_time

__all__ = ["measure"]

SECONDS = 15.0
PERIOD = 1.0 / 400.0
SETTLING = 2.0  # of the start, not counted


def measure() -> list[Figure]:
    """Lateness of the ticks with recording on; then the CPU share with default telemetry and recording."""
    return [*jitter(), cpu_share()]


def jitter() -> list[Figure]:
    """Quantiles of the ticks' lateness [us], ticks more than a period late, ticks never seen."""
    with Vehicle("--at=trim:30", "--rerun=save:flight.rrd") as vehicle:
        stream = vehicle.messages(HIL_STATE_QUATERNION)
        _, _, source = next(stream)
        command = common.MAVLink_command_long_message(
            0, 0, common.MAV_CMD_SET_MESSAGE_INTERVAL, 0, HIL_STATE_QUATERNION, PERIOD * 1e6, 0, 0, 0, 0, 0
        )
        sender = common.MAVLink(None, srcSystem=255, srcComponent=190)
        vehicle.sockets[0].sendto(command.pack(sender), source)
        begin = time.time() + SETTLING
        lag: dict[int, float] = {}
        for arrival, payload, _ in stream:
            if arrival >= begin:
                lag[round(sim_time(payload) / PERIOD)] = arrival - sim_time(payload)
            if arrival >= begin + SECONDS:
                break
    earliest = min(lag.values())
    late = sorted(value - earliest for value in lag.values())
    unseen = max(lag) - min(lag) + 1 - len(lag)
    return [
        Figure("tick lateness at 400 Hz, p50", quantile(late, 0.50) * 1e6, "us", at_most=True),
        Figure("tick lateness at 400 Hz, p99", quantile(late, 0.99) * 1e6, "us", at_most=True),
        Figure("tick lateness at 400 Hz, max", late[-1] * 1e6, "us", at_most=True),
        Figure("ticks later than one period", sum(value > PERIOD for value in late), f"of {len(late)}", at_most=True),
        Figure("ticks never seen", unseen, f"of {len(late)}", goal=0.0, at_most=True),
    ]


def cpu_share() -> Figure:
    """Share of one core [%] with the default streams to two links and Rerun saving."""
    with Vehicle("--at=trim:30", "--rerun=save:flight.rrd", count=2) as vehicle:
        next(vehicle.messages(HIL_STATE_QUATERNION))
        time.sleep(SETTLING)
        wall, cpu = time.monotonic(), vehicle.cpu_seconds()
        time.sleep(SECONDS)
        share = (vehicle.cpu_seconds() - cpu) / (time.monotonic() - wall)
    return Figure("share of a core, default telemetry to 2 links, Rerun saving", share * 100.0, "%", 8.0, at_most=True)


def quantile(ranked: Sequence[float], fraction: float) -> float:
    """The value that `fraction` of the ranked values do not exceed."""
    return ranked[min(len(ranked) - 1, int(fraction * len(ranked)))]
