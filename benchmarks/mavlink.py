"""The running vehicle among ground stations: transfers, answers while it is busy, a crowd, the cost of telemetry."""

import multiprocessing
import tempfile
import time
from multiprocessing.synchronize import Event
from pathlib import Path

import ftp
import psutil
import transfers
from figures import Figure
from realtime import quantile
from station import Station, free_port, listen
from vehicle import Vehicle

__all__ = ["measure"]

FLYING = "--at=trim:20"
COMMANDS = 400
BETWEEN = 0.015  # commands [s]
UNKNOWN = 31999  # MAV_CMD that nobody has: answered UNSUPPORTED
LARGE = 16 << 20  # of the file that is downloaded meanwhile [bytes]
CROWD_SECONDS = 10.0
CONNECTIONS, DATAGRAMS = 4, 5  # stations that listen
STATIONS = 3  # that telemetry goes to
SECONDS = 10.0  # of each measurement of the processor's time
SETTLING = 3.0
ROUNDS = 3


def measure() -> list[Figure]:
    """All of these."""
    return [*transfers.measure(), *acknowledgements(), *crowd(), telemetry()]


def acknowledgements() -> list[Figure]:
    """How long commands wait for their COMMAND_ACK while another client downloads a file by bursts [ms]."""
    ports = free_port(), free_port()
    with tempfile.TemporaryDirectory() as state:
        files = Path(state, "files")
        files.mkdir()
        (files / "large.bin").write_bytes(bytes(LARGE))
        links = (f"--link=udpin:{port}" for port in ports)
        with Vehicle(*links, FLYING, "--state", state) as vehicle:
            vehicle.receive()
            stopped = multiprocessing.Event()
            load = multiprocessing.Process(target=download_until, args=(ports[1], stopped))
            load.start()
            delays = sorted(answer_times(Station(ports[0])))
            stopped.set()
            load.join()
            if load.exitcode:
                raise RuntimeError("the download meanwhile has failed")
    return [
        Figure(f"COMMAND_ACK while a file is downloaded, {name}", value * 1e3, "ms", goal, at_most=True)
        for name, value, goal in (
            ("p50", quantile(delays, 0.5), None),
            ("p99", quantile(delays, 0.99), 100.0),
            ("max", delays[-1], None),  # where others share the machine it is theirs as much as ours
        )
    ]


def answer_times(station: Station) -> list[float]:
    """Seconds from each of many commands to its acknowledgement."""
    delays: list[float] = []
    answers: list[int] = []
    station.watch("COMMAND_ACK", lambda message: answers.append(message.command))
    for number in range(COMMANDS):
        station.send("COMMAND_LONG", command=UNKNOWN, param1=number)
        delays.append(station.until(lambda: len(answers) > number))  # noqa: B023  (called at once)
        time.sleep(BETWEEN)
    return delays


def download_until(port: int, stopped: Event) -> None:
    """Download the file again and again."""
    station = Station(port, system=254)
    client = ftp.Client(station.socket, is_stream=False)
    client.ask(ftp.RESET)
    while not stopped.is_set():
        client.download("/large.bin")


def crowd() -> list[Figure]:
    """What nine stations miss while a tenth never reads and an eleventh has gone, in real time."""
    ports = free_port(), free_port()
    with Vehicle(f"--link=udpin:{ports[0]}", f"--link=tcpin:{ports[1]}", FLYING) as vehicle:
        vehicle.receive()
        stations = [Station(ports[0], system=100 + number) for number in range(DATAGRAMS)]
        stations += [Station(ports[1], "tcp", system=150 + number) for number in range(CONNECTIONS)]
        full = Station(ports[1], "tcp", system=200, receive_buffer=4096)
        Station(ports[0], system=201).socket.close()
        for station in stations:
            station.until(lambda: station.heard)  # noqa: B023  (called at once)
        listen(stations, CROWD_SECONDS)
        heard = min(station.heard for station in stations)
        missed = sum(station.missed for station in stations)
        full.socket.close()
        for station in stations:
            station.socket.close()
    name = f"messages missed by {len(stations)} stations beside one that never reads"
    return [
        Figure(name, missed, "messages", 0.0, at_most=True),
        Figure("messages each of them has heard, at least", heard / CROWD_SECONDS, "per s"),
    ]


def telemetry() -> Figure:
    """Processor time [% of a core] of the default streams to three ground stations: with them less without them."""
    port = free_port()
    more: list[float] = []
    for _ in range(ROUNDS):
        with Vehicle(FLYING, f"--link=tcpin:{port}", count=0) as vehicle:
            without = share(vehicle)
        with Vehicle(FLYING, count=STATIONS) as vehicle:
            vehicle.receive()
            more.append(share(vehicle) - without)
    name = f"default telemetry to {STATIONS} ground stations"
    return Figure(name, sorted(more)[ROUNDS // 2] * 100.0, "% of core", 5.0, at_most=True)


def share(vehicle: Vehicle) -> float:
    """Share of a core that the process takes."""
    time.sleep(SETTLING)
    psutil.Process(vehicle.process.pid).status()  # raises if it has ended
    wall, spent = time.monotonic(), vehicle.cpu_seconds()
    time.sleep(SECONDS)
    return (vehicle.cpu_seconds() - spent) / (time.monotonic() - wall)
