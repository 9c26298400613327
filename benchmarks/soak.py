"""A simulated day as fast as possible, stations coming, going, asking and one of them never reading: memory stays flat.

`make soak`, or `python benchmarks/soak.py --hours 6`. Time in the air begins anew whenever a flight has ended, so that
there is always one to tell of.
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Callable
from itertools import cycle

import psutil
from figures import Figure, as_text
from pymavlink.dialects.v20 import common
from station import Station, free_port, listen
from transfers import BySocket, mission
from vehicle import Vehicle

__all__ = ["soak"]

BEGIN_ANEW = common.MAV_CMD_USER_2  # docs/mavlink.md; 2: in level flight at an airspeed
TRIMMED, AIRSPEED = 2.0, 20.0
WARM = 0.1  # share of the time after which memory must not grow any more
MOST_GROWTH = 5.0  # [%]
EACH = 0.5  # between two tasks, and looks at the memory [s], wall time
FLIGHT = 3600.0  # simulated [s], after which another flight begins


class Day:
    """The vehicle's simulated time over all its flights, from what a station hears."""

    def __init__(self, station: Station) -> None:
        self.before = self.now = 0.0
        station.watch("SYSTEM_TIME", lambda message: self._take(message.time_boot_ms * 1e-3))

    @property
    def total(self) -> float:
        """Simulated seconds flown."""
        return self.before + self.now

    def _take(self, boot: float) -> None:
        if boot < self.now:
            self.before += self.now
        self.now = boot


def soak(hours: float, say: Callable[[str], None] = print) -> list[Figure]:
    """Fly so many simulated hours; tells of the memory [MB] now and then, and reports it."""
    ports = free_port(), free_port()
    seen: list[tuple[float, float]] = []  # simulated time [s] and resident memory [MB]
    with tempfile.TemporaryDirectory() as state:
        links = f"--link=udpin:{ports[0]}", f"--link=tcpin:{ports[1]}", "--state", state
        with Vehicle(*links, "--at=trim:20", "--speed=max", streams=("normal", "onboard", "minimal")) as vehicle:
            vehicle.receive()
            process = psutil.Process(vehicle.process.pid)
            listener = Station(ports[0], system=200)
            stations = [listener, *(Station(ports[1], "tcp", system=201 + number) for number in range(2))]
            Station(ports[1], "tcp", system=210, receive_buffer=4096)
            day = Day(listener)
            begin = time.monotonic()
            told = 0.0
            for task in cycle(tasks(ports[0])):
                listen(stations, EACH)
                task()
                seen.append((day.total, process.memory_info().rss / 1e6))
                if day.now > FLIGHT:
                    listener.send("COMMAND_LONG", command=BEGIN_ANEW, param1=TRIMMED, param2=AIRSPEED)
                if day.total > told:
                    told += hours * 360.0
                    say(f"{day.total / 3600.0:6.2f} h flown, {seen[-1][1]:.1f} MB, {time.monotonic() - begin:.0f} s")
                if day.total >= hours * 3600.0:
                    break
            elapsed = time.monotonic() - begin
            missed = sum(station.missed for station in stations[1:])
    warm = [memory for when, memory in seen if when >= WARM * hours * 3600.0]
    growth = (max(warm[-len(warm) // 10 :]) / warm[0] - 1.0) * 100.0
    return [
        Figure("flown", day.total / 3600.0, "h"),
        Figure("as fast as", day.total / elapsed, "x real"),
        Figure("memory once warm", warm[0], "MB"),
        Figure("memory at the end", warm[-1], "MB"),
        Figure("growth of the memory, once warm", growth, "%", MOST_GROWTH, at_most=True),
        Figure("messages missed by stations on TCP", missed, "messages"),
    ]


def tasks(port: int) -> list[Callable[[], object]]:
    """What one more station does, which is another one each time."""
    numbers = iter(range(1 << 30))

    def visit(do: Callable[[BySocket], object]) -> Callable[[], object]:
        def task() -> None:
            client = BySocket(port, system=1 + 10 + next(numbers) % 180)
            try:
                do(client)
            except TimeoutError:
                pass  # a list or a mission that a full buffer has torn
            finally:
                client.close()

        return task

    items = mission()[:50]
    return [
        visit(lambda client: client.list_parameters()),
        visit(lambda client: client.upload([*items[:-1], mission()[-1]])),
        visit(lambda client: client.command(31999)),
    ]


def main() -> int:
    """Exit code 1 if memory grew."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hours", type=float, default=24.0, help="simulated [24]")
    figures = soak(parser.parse_args().hours)
    for figure in figures:
        print(as_text(figure))
    return int(any(figure.met is False for figure in figures))


if __name__ == "__main__":
    sys.exit(main())
