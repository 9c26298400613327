"""Sends a list of mission items to a vehicle: mission, geofence or rally points.

The vehicle asks for the items one by one and asks again for what got lost; we repeat what starts and what ends it.
Source: MAVLink guide, services/mission, "Upload a Mission to the Vehicle".
"""

import time
from collections.abc import Callable, Sequence
from typing import Any

from pymavlink.dialects.v20 import all as mav

from gcs_scripts.connection import RETRY, Vehicle, enum_name

__all__ = ["upload"]

RESTART = 2.0  # [s] of silence after which the vehicle has given up: its own five retries take 1.25 s
BEGINS_AGAIN = (mav.MAV_MISSION_OPERATION_CANCELLED, mav.MAV_MISSION_INVALID_SEQUENCE)
ANSWERS = ("MISSION_REQUEST_INT", "MISSION_REQUEST", "MISSION_ACK")


def upload(
    vehicle: Vehicle,
    items: Sequence[dict[str, Any]],
    mission_type: int,
    name: str,
    progress: Callable[[int], None] = lambda _: None,
) -> None:
    """Replace the vehicle's list of a mission type by these items (fields of MISSION_ITEM_INT, numbered from 0).

    An empty list clears it. `name` is what errors call the list; `progress` is told how many items have been asked for.
    Raises RefusedError with the MAV_MISSION_RESULT, UnansweredError when nothing new is asked for within the vehicle's
    timeout, LinkLostError.
    """
    begin = time.monotonic()
    failure = f"system {vehicle.system} does not take {name}: no request for an item and no MISSION_ACK"
    asked = best = -1  # highest item asked for since the last beginning, and ever
    ends_again = False
    heard = advanced = begin
    _send_count(vehicle, len(items), mission_type)
    while True:
        message = vehicle.receive(ANSWERS, RETRY)
        now = time.monotonic()
        if message is None or not _is_ours(message, vehicle, mission_type):
            if now - advanced > vehicle.timeout:
                raise vehicle.unanswered(failure, vehicle.timeout)
            if asked < 0 or now - heard > RESTART:
                asked = -1
                _send_count(vehicle, len(items), mission_type)
            elif asked == len(items) - 1 and message is None:
                ends_again = True
                _send_item(vehicle, items[asked])  # its acknowledgement may have got lost
            continue
        heard = now
        if message.get_type() == "MISSION_ACK":
            if message.type == mav.MAV_MISSION_ACCEPTED:
                if asked == len(items) - 1:
                    return
                continue  # a late one, of what was sent before
            if message.type in BEGINS_AGAIN or (ends_again and message.type == mav.MAV_MISSION_ERROR):
                asked, ends_again = -1, False
                continue
            raise vehicle.refusal(
                name, enum_name("MAV_MISSION_RESULT", message.type).removeprefix("MAV_MISSION_"), begin
            )
        if message.seq < len(items):
            asked = max(asked, message.seq)
            if asked > best:
                best, advanced = asked, now
                progress(best + 1)
            _send_item(vehicle, items[message.seq])


def _is_ours(message: Any, vehicle: Vehicle, mission_type: int) -> bool:
    return message.target_system in (0, vehicle.own[0]) and message.mission_type == mission_type


def _send_count(vehicle: Vehicle, count: int, mission_type: int) -> None:
    vehicle.send.mission_count_send(vehicle.system, vehicle.component, count, mission_type)


def _send_item(vehicle: Vehicle, item: dict[str, Any]) -> None:
    vehicle.send.mission_item_int_send(vehicle.system, vehicle.component, **item)
