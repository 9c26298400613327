"""How a parameter's value travels in the float of PARAM_VALUE and PARAM_SET: by its bits, or as the nearest float.

https://mavlink.io/en/services/parameter.html#parameter-encoding. A vehicle speaks one of the two and says which in its
capabilities. Ours are of two types: INT32 and REAL32.
"""

import struct
import zlib
from collections.abc import Iterable
from typing import Final

from sitl.flight.parameter_table import Definition
from sitl.mavlink.codec import codec
from sitl.mavlink.dialect import tiltwing as mav

__all__ = ["HASH_NAME", "WrongTypeError", "decoded", "encoded", "hash_of", "hash_payload", "type_of"]

HASH_NAME: Final = "_HASH_CHECK"
NO_INDEX: Final = 0xFFFF  # of a PARAM_VALUE that is not in the list

_TYPES = {"int": mav.MAV_PARAM_TYPE_INT32, "float": mav.MAV_PARAM_TYPE_REAL32}
_INTEGER, _SINGLE = struct.Struct("<i"), struct.Struct("<f")


class WrongTypeError(ValueError):
    """A value of a type that will not do; `code` says why, as MAV_PARAM_ERROR."""

    def __init__(self, text: str, code: int) -> None:
        super().__init__(text)
        self.code = code


def type_of(definition: Definition) -> int:
    """MAV_PARAM_TYPE of a parameter."""
    return _TYPES[definition.kind]


def encoded(definition: Definition, value: float, *, bytewise: bool) -> float:
    """What stands in `param_value` for a value of a parameter, by its bits or as the nearest float."""
    if bytewise and definition.kind == "int":
        return _SINGLE.unpack(_INTEGER.pack(int(value)))[0]
    return float(value)


def decoded(definition: Definition, field: float, kind: int, *, bytewise: bool) -> float:
    """The value that `param_value` (`field`) of type `kind` (MAV_PARAM_TYPE) holds for a parameter.

    Raises WrongTypeError where values travel by their bits and the type is not the parameter's. Where they travel as
    floats the type changes nothing and is not looked at, as with ArduPilot.

    A few bit patterns, of whole numbers beyond +-4194304 that are signalling NaNs as floats, cannot pass a Python float
    unchanged. No range of ours reaches there, so what becomes of them is refused all the same.
    """
    if not bytewise:
        return field
    expected = type_of(definition)
    if kind != expected:
        names = mav.enums["MAV_PARAM_TYPE"]
        unsupported = kind not in _TYPES.values()
        got = names[kind].name.removeprefix("MAV_PARAM_TYPE_") if kind in names else "unknown"
        wanted = names[expected].name.removeprefix("MAV_PARAM_TYPE_")
        raise WrongTypeError(
            f"{definition.name}: expected type {wanted} ({expected}), got {got} ({kind})",
            mav.MAV_PARAM_ERROR_TYPE_UNSUPPORTED if unsupported else mav.MAV_PARAM_ERROR_TYPE_MISMATCH,
        )
    return _INTEGER.unpack(_SINGLE.pack(field))[0] if definition.kind == "int" else field


def hash_of(values: Iterable[tuple[Definition, float]]) -> int:
    """PX4's hash of parameters in the order of their names, by which QGroundControl knows what it has read before.

    CRC32 over each name and the four bytes of its value, with an initial value of zero and nothing inverted: as
    `param_hash_check` in PX4's src/lib/parameters/parameters.cpp and QGroundControl's `_tryCacheHashLoad` agree on it.
    """
    data = b"".join(
        definition.name.encode() + (_INTEGER.pack(int(value)) if definition.kind == "int" else _SINGLE.pack(value))
        for definition, value in values
    )
    return zlib.crc32(data, 0xFFFFFFFF) ^ 0xFFFFFFFF


def hash_payload(value: int, count: int) -> bytes:
    """Payload of the PARAM_VALUE that carries the hash of `count` parameters, as PX4 sends it before its list."""
    payload = codec("PARAM_VALUE").payload((HASH_NAME.encode(), 0.0, mav.MAV_PARAM_TYPE_UINT32, count, NO_INDEX))
    # Its bits go past any float, which might not keep them. The widest field of a message is the first on the wire.
    return value.to_bytes(4, "little") + payload[4:]
