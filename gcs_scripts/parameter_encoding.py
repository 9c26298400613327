"""How parameters of any type travel in the one float of PARAM_VALUE and PARAM_SET.

PX4 sends the bits of an integer (bytewise), ArduPilot the nearest float (C cast). Source: MAVLink guide,
services/parameter, "Parameter Encoding". An integer's bits may be a signalling NaN, which a float does not survive, so
bits are read from the payload and written to it.
"""

import math
import struct
from dataclasses import dataclass
from typing import Any

from pymavlink.dialects.v20 import all as mav

__all__ = ["Parameter", "as_type", "decoded", "is_bytewise", "is_integer", "set_message"]

FORMATS = {
    mav.MAV_PARAM_TYPE_UINT8: "<B", mav.MAV_PARAM_TYPE_INT8: "<b",
    mav.MAV_PARAM_TYPE_UINT16: "<H", mav.MAV_PARAM_TYPE_INT16: "<h",
    mav.MAV_PARAM_TYPE_UINT32: "<I", mav.MAV_PARAM_TYPE_INT32: "<i",
}  # fmt: skip


@dataclass(frozen=True)
class Parameter:
    """One parameter: name, value (int or float by type), MAV_PARAM_TYPE and place in the vehicle's list."""

    name: str
    value: float
    type: int
    index: int = -1


def is_bytewise(heartbeat: Any, capabilities: int | None = None) -> bool:
    """Whether integers travel as their bits, by whose HEARTBEAT it is.

    Of an autopilot that is neither PX4 nor ArduPilot the capabilities of its AUTOPILOT_VERSION tell; without them, yes.
    """
    if heartbeat.autopilot == mav.MAV_AUTOPILOT_PX4:
        return True
    if heartbeat.autopilot == mav.MAV_AUTOPILOT_ARDUPILOTMEGA:
        return False
    return capabilities is None or not capabilities & mav.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST


def is_integer(kind: int) -> bool:
    """Whether a MAV_PARAM_TYPE is an integer type."""
    return kind in FORMATS


def decoded(message: Any, *, bytewise: bool) -> Parameter:
    """The parameter that a PARAM_VALUE tells."""
    kind = message.param_type
    if kind not in FORMATS:
        value = message.param_value
    elif bytewise:
        (value,) = struct.unpack_from(FORMATS[kind], message.get_msgbuf(), _header_length(message))
    else:
        value = round(message.param_value) if math.isfinite(message.param_value) else 0
    return Parameter(message.param_id, value, kind, message.param_index)


def _header_length(message: Any) -> int:
    """Bytes before the payload; pymavlink's get_payload takes every message for MAVLink 1."""
    return 6 if message.get_msgbuf()[0] == mav.PROTOCOL_MARKER_V1 else 10


def as_type(value: float, kind: int) -> float:
    """A number as a parameter of a type holds it. Raises ValueError with what was expected."""
    if kind not in FORMATS:
        try:
            return struct.unpack("<f", struct.pack("<f", value))[0]
        except OverflowError:
            raise ValueError(f"expected a number that a float holds, got {value:g}") from None
    if not math.isfinite(value) or value != round(value):
        raise ValueError(f"expected an integer, got {value:g}")
    try:
        struct.pack(FORMATS[kind], round(value))
    except struct.error:
        name = mav.enums["MAV_PARAM_TYPE"][kind].name.removeprefix("MAV_PARAM_TYPE_")
        raise ValueError(f"expected an integer of type {name}, got {value:g}") from None
    return round(value)


class _BytewiseSet(mav.MAVLink_param_set_message):
    """PARAM_SET whose value is given as the 32 bits that travel."""

    unpacker = struct.Struct("<IBB16sB")


def set_message(system: int, component: int, parameter: Parameter, *, bytewise: bool) -> Any:
    """PARAM_SET for a parameter; its value must fit its type (`as_type`)."""
    name, kind = parameter.name.encode("ascii"), parameter.type
    if kind in FORMATS and bytewise:
        (bits,) = struct.unpack("<I", struct.pack(FORMATS[kind], int(parameter.value)).ljust(4, b"\0"))
        return _BytewiseSet(system, component, name, bits, kind)
    return mav.MAVLink_param_set_message(system, component, name, float(parameter.value), kind)
