"""What a ground station makes of messages about parameters."""

import struct
from typing import Any

from sitl.flight.parameter_table import DEFINITIONS
from sitl.mavlink.dialect import tiltwing as mav

__all__ = ["LIST_TIME", "NAMES", "bits", "taken", "texts", "value_of", "values"]

NAMES = [definition.name for definition in DEFINITIONS]
LIST_TIME = 0.5  # within which all parameters are there [s], wall time


def bits(whole: int) -> float:
    """A whole number by its bits."""
    return struct.unpack("<f", struct.pack("<i", whole))[0]


def value_of(message: Any) -> float:
    """The value in a PARAM_VALUE of a vehicle that sends whole numbers by their bits."""
    packed = struct.pack("<f", message.param_value)
    is_whole = message.param_type == mav.MAV_PARAM_TYPE_INT32
    return struct.unpack("<i", packed)[0] if is_whole else message.param_value


def values(station: Any) -> list[Any]:
    """What has come of parameters, without the hash."""
    return [message for message in station.of("PARAM_VALUE") if message.param_id != "_HASH_CHECK"]


def texts(station: Any) -> str:
    return "".join(message.text for message in station.of("STATUSTEXT"))


def taken(station: Any) -> list[Any]:
    """All that has come but heartbeats; it is forgotten then."""
    received, station.received = station.received, []
    return [message for message in received if message.get_type() != "HEARTBEAT"]
