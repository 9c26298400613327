"""The list of all parameters, and a long mission up and down: seconds on loopback, for two clients.

One is a plain socket, the other pymavlink's connection with its loader of missions. Both answer at once, and ask for
nothing twice, for the loopback loses nothing.
"""

import statistics
import time
from collections.abc import Callable
from typing import Any

from figures import Figure
from pymavlink import mavutil, mavwp
from pymavlink.dialects.v20 import common
from station import Station, free_port
from vehicle import Vehicle

__all__ = ["measure"]

ITEMS = 1000
ROUNDS = 5
PEER_ROUNDS = 2
PATIENCE = 30.0  # [s]
HOME = 473977418, 85455939  # [1e-7 deg]
REQUESTS = ["MISSION_REQUEST", "MISSION_REQUEST_INT"]

Item = dict[str, float]


def measure() -> list[Figure]:
    """Median seconds of each transfer."""
    ports = free_port(), free_port()
    with Vehicle(*(f"--link=udpin:{port}" for port in ports)) as vehicle:
        vehicle.receive()
        clients = BySocket(ports[0]), ByPymavlink(ports[1])
        items = mission()
        count = clients[0].list_parameters()
        tasks: list[tuple[str, float, Callable[[BySocket | ByPymavlink], object]]] = [
            (f"list of all {count} parameters", 0.5, lambda client: client.list_parameters()),
            (f"mission of {ITEMS} items up", 1.0, lambda client: client.upload(items)),
            (f"mission of {ITEMS} items down", 1.0, lambda client: client.download(items)),
        ]
        figures: list[Figure] = []
        for name, goal, task in tasks:
            ours, theirs = (
                statistics.median(_seconds(task, client) for _ in range(rounds))
                for client, rounds in zip(clients, (ROUNDS, PEER_ROUNDS), strict=True)
            )
            figures.append(Figure(name, ours, "s", goal, at_most=True, peer="pymavlink", peer_value=theirs))
        for client in clients:
            client.close()
    return figures


def _seconds(task: Callable[[Any], object], client: "BySocket | ByPymavlink") -> float:
    begin = time.perf_counter()
    task(client)
    return time.perf_counter() - begin


def mission() -> list[Item]:
    """Take-off, a long way back and forth, landing: fields of MISSION_ITEM_INT."""
    frame = common.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT
    item = {"frame": frame, "autocontinue": 1, "param4": float("nan"), "x": HOME[0], "y": HOME[1], "z": 40.0}
    way = [{"x": HOME[0] + 30_000 + i % 50 * 600, "y": HOME[1] + i % 2 * 9000} for i in range(ITEMS - 2)]
    return [
        {**item, "command": common.MAV_CMD_NAV_VTOL_TAKEOFF},
        *({**item, **place, "command": common.MAV_CMD_NAV_WAYPOINT} for place in way),
        {**item, "command": common.MAV_CMD_NAV_VTOL_LAND, "z": 0.0},
    ]


def check_same(places: list[tuple[int, int]], items: list[Item]) -> None:
    """Raises RuntimeError unless the mission that has come is the one that went."""
    if places != [(item["x"], item["y"]) for item in items]:
        raise RuntimeError("the mission that came back is another one")


def check_accepted(result: int) -> None:
    """Raises RuntimeError unless the vehicle has taken the mission."""
    if result != common.MAV_MISSION_ACCEPTED:
        raise RuntimeError(f"mission refused: {result}")


class BySocket:
    """With a plain socket."""

    def __init__(self, port: int, *, system: int = 255) -> None:
        """Greet the vehicle, as the system of this id."""
        self._station = Station(port, system=system)
        self.socket = self._station.socket

    def list_parameters(self) -> int:
        """Fetch all; returns how many they are."""
        station = self._station
        have: dict[int, int] = {}
        station.watch("PARAM_VALUE", lambda message: have.update({message.param_index: message.param_count}))
        station.send("PARAM_REQUEST_LIST")
        station.until(lambda: have and have.keys() >= set(range(max(have.values()))))
        return max(have.values())

    def upload(self, items: list[Item]) -> None:
        """Send a mission."""
        station = self._station
        results: list[int] = []
        station.watch("MISSION_REQUEST_INT", lambda m: station.send("MISSION_ITEM_INT", seq=m.seq, **items[m.seq]))
        station.watch("MISSION_ACK", lambda message: results.append(message.type))
        station.send("MISSION_COUNT", count=len(items))
        station.until(lambda: results, PATIENCE)
        check_accepted(results[0])

    def download(self, items: list[Item]) -> None:
        """Fetch the mission, which must be this one."""
        station = self._station
        places: list[tuple[int, int]] = []

        def take(message: Any) -> None:
            places.append((message.x, message.y))
            if len(places) < len(items):
                station.send("MISSION_REQUEST_INT", seq=len(places))

        station.watch("MISSION_COUNT", lambda _: station.send("MISSION_REQUEST_INT", seq=0))
        station.watch("MISSION_ITEM_INT", take)
        station.send("MISSION_REQUEST_LIST")
        station.until(lambda: len(places) == len(items), PATIENCE)
        station.send("MISSION_ACK", type=common.MAV_MISSION_ACCEPTED)
        check_same(places, items)

    def command(self, command: int) -> int:
        """Send a command; returns its result."""
        results: list[int] = []
        self._station.watch("COMMAND_ACK", lambda message: results.append(message.result))
        self._station.send("COMMAND_LONG", command=command)
        self._station.until(lambda: results)
        return results[0]

    def close(self) -> None:
        """Be gone."""
        self._station.socket.close()


class ByPymavlink:
    """With pymavlink."""

    def __init__(self, port: int) -> None:
        """Greet the vehicle, and hear it."""
        self._link: Any = mavutil.mavlink_connection(f"udpout:127.0.0.1:{port}", source_system=254, dialect="common")
        self._link.mav.heartbeat_send(common.MAV_TYPE_GCS, common.MAV_AUTOPILOT_INVALID, 0, 0, 0)
        self._link.wait_heartbeat(timeout=PATIENCE)

    def list_parameters(self) -> int:
        """Fetch all; returns how many they are."""
        self._link.mav.param_request_list_send(1, 1)
        have: set[int] = set()
        while True:
            message = self._next("PARAM_VALUE")
            have.add(message.param_index)
            if have >= set(range(message.param_count)):
                return message.param_count

    def upload(self, items: list[Item]) -> None:
        """Send a mission."""
        loader: Any = mavwp.MAVWPLoader(1, 1)
        encode = self._link.mav.mission_item_int_encode
        for item in items:
            params = (item.get(f"param{number}", 0.0) for number in range(1, 5))
            place = int(item["x"]), int(item["y"]), item["z"]
            loader.add(encode(1, 1, 0, int(item["frame"]), int(item["command"]), 0, 1, *params, *place))
        self._link.mav.mission_count_send(1, 1, loader.count())
        while (message := self._next([*REQUESTS, "MISSION_ACK"])).get_type() != "MISSION_ACK":
            self._link.mav.send(loader.wp(message.seq))
        check_accepted(message.type)

    def download(self, items: list[Item]) -> None:
        """Fetch the mission, which must be this one."""
        loader: Any = mavwp.MAVWPLoader(1, 1)
        self._link.mav.mission_request_list_send(1, 1)
        count = self._next("MISSION_COUNT").count
        for number in range(count):
            self._link.mav.mission_request_int_send(1, 1, number)
            loader.add(self._next("MISSION_ITEM_INT"))
        self._link.mav.mission_ack_send(1, 1, common.MAV_MISSION_ACCEPTED)
        check_same([(loader.wp(number).x, loader.wp(number).y) for number in range(count)], items)

    def close(self) -> None:
        """Be gone."""
        self._link.close()

    def _next(self, names: str | list[str]) -> Any:
        message = self._link.recv_match(type=names, blocking=True, timeout=PATIENCE)
        if message is None:
            raise TimeoutError(f"no {names} within {PATIENCE} s")
        return message
