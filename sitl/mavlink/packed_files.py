"""Parameters and plans packed into files, as ArduPilot's FTP serves them: @PARAM/param.pck and @MISSION/*.dat.

Layout of param.pck: https://github.com/ArduPilot/ardupilot/blob/master/libraries/AP_Filesystem/README.md. A header of
three uint16_t (0x671B, or 0x671C with defaults; parameters in the file; parameters there are, or in an upload the
length of the file), and for each parameter its type in four bits and four of flags (1: the default follows the value),
how many characters its name has in common with the one before and how many more less one, four bits each, these
characters, and the value. MAVProxy and pymavlink read it.

Layout of the plans: a header of five uint16_t (0x763D, MAV_MISSION_TYPE, options, number of the first item, count),
then each item as the whole payload of a MISSION_ITEM_INT. MAVProxy reads and writes it.
"""

import errno
import struct
from collections.abc import Mapping, Sequence
from typing import Any, Final, NamedTuple
from urllib.parse import parse_qsl

from sitl.flight.parameters import Parameters
from sitl.mavlink.codec import codec

__all__ = ["PackedPlan", "packed_parameters", "packed_plan", "unpacked_parameters", "unpacked_plan"]

PARAMETERS_MAGIC: Final = 0x671B
DEFAULTS_MAGIC: Final = 0x671C
PARAMETERS_HEADER: Final = struct.Struct("<HHH")
MOST_COMMON: Final = 15  # characters, of names that have 16 at most
LONGEST_NAME: Final = 16
HAS_DEFAULT: Final = 1
VALUES: Final = {1: struct.Struct("<b"), 2: struct.Struct("<h"), 3: struct.Struct("<i"), 4: struct.Struct("<f")}
TYPES: Final = {"int": 3, "float": 4}

PLAN_MAGIC: Final = 0x763D
PLAN_HEADER: Final = struct.Struct("<HHHHH")
KEEP_OTHERS: Final = 1  # option of an upload: items that it does not bring stay


def packed_parameters(parameters: Parameters, query: str = "") -> bytes:
    """The parameters in the order of their names.

    `query` is made of `withdefaults=1` and of `start=` and `count=` of a part of the list, with "&" between them.
    Raises OSError (EINVAL) for another one.
    """
    names = parameters.names()
    asked = _asked(query)
    first = asked.get("start", 0)
    if first >= len(names):
        raise OSError(errno.EINVAL, f"start: expected one below {len(names)}, got {first}")
    chosen = names[first:][: asked.get("count", 0) or None]
    with_defaults = asked.get("withdefaults", 0) == 1
    magic = DEFAULTS_MAGIC if with_defaults else PARAMETERS_MAGIC
    packed = [PARAMETERS_HEADER.pack(magic, len(chosen), len(names))]
    before = ""
    for name in chosen:
        definition = parameters.definition(name)
        kind = TYPES[definition.kind]
        value = VALUES[kind].pack(parameters[name])
        default = VALUES[kind].pack(int(definition.default) if definition.kind == "int" else definition.default)
        flags = HAS_DEFAULT if with_defaults and default != value else 0
        common = _common(before, name)
        packed.append(bytes((kind | flags << 4, common | len(name) - common - 1 << 4)))
        packed += [name[common:].encode(), value, default if flags else b""]
        before = name
    return b"".join(packed)


def unpacked_parameters(data: bytes) -> dict[str, float]:
    """Values by name in an upload. Raises ValueError for one that is not whole."""
    if len(data) < PARAMETERS_HEADER.size:
        msg = f"parameters: expected a file of at least {PARAMETERS_HEADER.size} bytes, got {len(data)}"
        raise ValueError(msg)
    magic, count, length = PARAMETERS_HEADER.unpack_from(data)
    if magic != PARAMETERS_MAGIC or length != len(data) & 0xFFFF:
        msg = f"parameters: expected 0x{PARAMETERS_MAGIC:04x} and {len(data)} bytes, got 0x{magic:04x} and {length}"
        raise ValueError(msg)
    values: dict[str, float] = {}
    place, before = PARAMETERS_HEADER.size, b""
    for number in range(count):
        try:
            kind, lengths = data[place], data[place + 1]
            common, more = lengths & 0xF, (lengths >> 4) + 1
            name = before[:common] + data[place + 2 : place + 2 + more]
            (value,) = VALUES[kind].unpack_from(data, place + 2 + more)
        except (IndexError, KeyError, struct.error):
            msg = f"parameters: expected {count} of them, number {number + 1} is damaged"
            raise ValueError(msg) from None
        values[name[:LONGEST_NAME].decode("ascii", errors="replace")] = value
        place += 2 + more + VALUES[kind].size
        before = name
    return values


class PackedPlan(NamedTuple):
    """A plan in a file: its MAV_MISSION_TYPE, and its items as the fields of MISSION_ITEM_INT.

    `start` is the number of the first item; `is_part`: items of the vehicle that it does not bring stay.
    """

    kind: int
    items: Sequence[Any]
    start: int = 0
    is_part: bool = False


def packed_plan(kind: int, items: Sequence[Mapping[str, Any]]) -> bytes:
    """A plan of this MAV_MISSION_TYPE from the fields of its items, as they are in MISSION_ITEM_INT."""
    packer = codec("MISSION_ITEM_INT")
    header = PLAN_HEADER.pack(PLAN_MAGIC, kind, 0, 0, len(items))
    return header + b"".join(packer.payload_of(**fields).ljust(packer.size, b"\0") for fields in items)


def unpacked_plan(data: bytes) -> PackedPlan:
    """The plan in an upload. Raises ValueError for one that is not whole."""
    packer = codec("MISSION_ITEM_INT")
    if len(data) < PLAN_HEADER.size:
        msg = f"plan: expected a file of at least {PLAN_HEADER.size} bytes, got {len(data)}"
        raise ValueError(msg)
    magic, kind, options, start, count = PLAN_HEADER.unpack_from(data)
    if magic != PLAN_MAGIC or options & ~KEEP_OTHERS or (start and not options):
        msg = f"plan: expected 0x{PLAN_MAGIC:04x}, got 0x{magic:04x} with options {options}, start {start}"
        raise ValueError(msg)
    if len(data) != PLAN_HEADER.size + count * packer.size:
        whole, rest = divmod(len(data) - PLAN_HEADER.size, packer.size)
        msg = f"plan: expected {count} items, got {whole} and {rest} bytes"
        raise ValueError(msg)
    pieces = [data[place : place + packer.size] for place in range(PLAN_HEADER.size, len(data), packer.size)]
    for number, piece in enumerate(pieces):
        if not any(piece):
            msg = f"plan: item {number} has never come"
            raise ValueError(msg)
    return PackedPlan(kind, [packer.read(piece) for piece in pieces], start, is_part=bool(options))


def _asked(query: str) -> dict[str, int]:
    asked: dict[str, int] = {}
    for name, text in parse_qsl(query, keep_blank_values=True):
        if name not in {"start", "count", "withdefaults"} or not (text.isascii() and text.isdigit() and len(text) < 6):
            raise OSError(errno.EINVAL, f"{name}: expected start, count or withdefaults and a number, got {text!r}")
        asked[name] = int(text)
    return asked


def _common(before: str, name: str) -> int:
    """How many characters two names begin with in common, of which one at least is left to the second."""
    most = min(len(before), len(name) - 1, MOST_COMMON)
    return next((place for place in range(most) if before[place] != name[place]), most)
