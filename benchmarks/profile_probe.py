"""Asks a running vehicle what a ground station can ask: what it streams, what it sends on request, what it obeys."""

import math
import time
from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

from station import Station, free_port
from vehicle import Vehicle

from sitl.mavlink.codec import codec
from sitl.mavlink.dialect import tiltwing as mav

__all__ = ["Probe", "Reply"]

NAMES = {number: message.msgname for number, message in mav.mavlink_map.items()}
RESULTS = {number: entry.name.removeprefix("MAV_RESULT_") for number, entry in mav.enums["MAV_RESULT"].items()}
SETTLING = 3.0  # of the start, not counted [s]
PATIENCE = 5.0  # with an answer [s]
AFTER = 0.2  # in which a message follows its acknowledgement, or goes before it [s]


class Reply(NamedTuple):
    """Answer to a command: the result, how long it took [s], and whether a message that was asked for has come."""

    result: str
    seconds: float
    came: bool = False


class Probe:
    """One vehicle, heard on links with these sets of streams, and asked on one of its own.

    Attributes:
        station: asks.
    """

    def __init__(self, *options: str, streams: Iterable[str] = (), asks: str = "normal") -> None:
        """Start the vehicle with these command line options; `asks` are the streams of the link of one's own."""
        port = free_port()
        ports = {name: free_port() for name in streams}
        links = [f"--link=udpin:{number},{name}" for name, number in ports.items()]
        self.vehicle = Vehicle(f"--link=udpin:{port},{asks}", *links, *options, count=1)
        self.vehicle.receive()
        self.station = Station(port)
        self._listeners = {name: Station(number, system=240) for name, number in ports.items()}
        self._replies: list[Any] = []
        self.station.watch("COMMAND_ACK", self._replies.append)
        self.wait(SETTLING)

    def __enter__(self) -> "Probe":
        """End the vehicle with the block."""
        return self

    def __exit__(self, *error: Any) -> None:
        """See __enter__."""
        for station in (self.station, *self._listeners.values()):
            station.socket.close()
        self.vehicle.__exit__(*error)

    def wait(self, seconds: float) -> None:
        """Listen on all links for so long; greet on all, or the vehicle forgets."""
        stations = (self.station, *self._listeners.values())
        end = time.monotonic() + seconds
        greeted = -math.inf
        while (now := time.monotonic()) < end:
            if now - greeted > 1.0:
                greeted = now
                for station in stations:
                    station.greet()
            for station in stations:
                station.listen()
            time.sleep(0.005)

    def rates(self, seconds: float) -> dict[str, dict[str, float]]:
        """Messages per second of each link, by name."""
        counts: dict[str, Counter[int]] = {}
        for name, station in {"": self.station, **self._listeners}.items():
            counts[name] = Counter()
            station.tally = counts[name]
        begin = time.monotonic()
        self.wait(seconds)
        elapsed = time.monotonic() - begin
        for station in (self.station, *self._listeners.values()):
            station.tally = None
        return {
            link: {NAMES[number]: count / elapsed for number, count in counted.items()}
            for link, counted in counts.items()
        }

    def command(self, command: int, *params: float) -> Reply:
        """Send a COMMAND_LONG, parameters left out unset; its final answer."""
        padded = [*params, *[math.nan] * (7 - len(params))]
        named = {f"param{number}": value for number, value in enumerate(padded, start=1)}
        self._replies.clear()
        begin = time.perf_counter()
        self.station.send("COMMAND_LONG", command=command, **named)
        try:
            self.station.until(lambda: any(reply.command == command for reply in self._replies), PATIENCE)
        except TimeoutError:
            return Reply("no answer", PATIENCE)
        return Reply(RESULTS[self._replies[0].result], time.perf_counter() - begin)

    def request(self, name: str) -> Reply:
        """REQUEST_MESSAGE of the first of its kind."""
        came: list[Any] = []
        self.station.watch(name, came.append)
        which = {"AVAILABLE_MODES": 0.0, "MESSAGE_INTERVAL": float(mav.MAVLINK_MSG_ID_ATTITUDE)}
        reply = self.command(mav.MAV_CMD_REQUEST_MESSAGE, float(codec(name).id), which.get(name, math.nan))
        if not came:
            self.wait(AFTER)
        self.station.forget(name)
        return reply._replace(came=bool(came))

    def requests(self, names: Iterable[str]) -> dict[str, Reply]:
        """REQUEST_MESSAGE of each; `not in the dialect` for what we have no definition of."""
        known = {message.msgname for message in mav.mavlink_map.values()}
        replies: dict[str, Reply] = {}
        for name in names:
            replies[name] = self.request(name) if name in known else Reply("not in the dialect", 0.0)
        return replies

    def exchange(self, name: str, answer: str, fields: Mapping[str, Any], patience: float = PATIENCE) -> Any:
        """Send a message, and the first answer of this name; None if none comes."""
        came: list[Any] = []
        self.station.watch(answer, came.append)
        self.station.send(name, **fields)
        try:
            self.station.until(lambda: came, patience)
        except TimeoutError:
            return None
        finally:
            self.station.forget(answer)
            self.station.watch("COMMAND_ACK", self._replies.append)
        return came[0]
