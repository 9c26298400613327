"""MAVLink 2 frames packed by precompiled structs, byte for byte as pymavlink packs them but several times faster.

Everything is derived from the message classes of the dialect. Values go in and come out in the order in which the
message definition lists its fields, arrays flattened: the order on the wire is this file's business alone.
"""

import math
import struct
from collections import namedtuple
from functools import cache
from operator import itemgetter
from typing import Any, NamedTuple

from fastcrc.crc16 import mcrf4xx

from sitl.mavlink.dialect import tiltwing

__all__ = ["MAGIC_V1", "MAGIC_V2", "MAX_FRAME", "MessageCodec", "codec", "codec_by_id"]

MAGIC_V1 = 0xFE
MAGIC_V2 = 0xFD
MAX_FRAME = 280  # header 10, payload 255, checksum 2, signature 13

NOWHERE = 1 << 16  # beyond the end of every payload

_HEADER = struct.Struct("<BBBBBBHB")  # of version 2, without the magic byte
_MAGIC = bytes((MAGIC_V2,))

_INTEGER_RANGE = {
    kind: (-(1 << bits - 1), (1 << bits - 1) - 1) if kind.islower() else (0, (1 << bits) - 1)
    for bits, kinds in ((8, "bB"), (16, "hH"), (32, "iI"), (64, "qQ"))
    for kind in kinds
}
_LARGEST_FLOAT = struct.unpack("<f", b"\xff\xff\x7f\x7f")[0]


class MessageCodec:
    """Packs and unpacks one kind of message.

    Attributes:
        id: message id.
        name: message name.
        size: length of the whole payload, extension fields included, before trailing zeros are cut.
        field_names: names of the fields in the order of the definition.
        has_target: whether it names the system that it is meant for.
    """

    def __init__(self, message: type[Any]) -> None:
        """Derive everything from a message class that mavgen made."""
        self.id: int = message.id
        self.name: str = message.msgname
        self.field_names: tuple[str, ...] = tuple(message.fieldnames)
        self._struct: struct.Struct = message.unpacker
        self.size: int = self._struct.size
        self._extra = bytes((message.crc_extra,))
        wire = _Flattened(message)
        self._to_wire = _reordering(wire.order_to_wire)
        self._from_wire = _reordering(wire.order_from_wire)
        self._kinds = wire.kinds
        self._fields = wire.fields
        self._is_plain = not any(field.is_text or field.is_array for field in wire.fields)
        self._record: Any = namedtuple(message.msgname, self.field_names)  # pyright: ignore[reportUntypedNamedTuple]
        offsets: dict[str, int] = dict(wire.offsets)
        self.has_target = bool({"target_system", "target"} & offsets.keys())
        self._target_places = (
            offsets.get("target_system", offsets.get("target", NOWHERE)),
            offsets.get("target_component", NOWHERE),
        )

    def payload(self, values: tuple[Any, ...]) -> bytes:
        """Payload of these field values (definition order, arrays flattened), trailing zeros cut as MAVLink 2 asks.

        A number outside the range of its field is sent as the end of that range, a float that is not a number as
        zero where the field is an integer.
        """
        wire = self._to_wire(values)
        try:
            packed = self._struct.pack(*wire)
        except (struct.error, OverflowError, ValueError):
            packed = self._struct.pack(*map(_in_range, self._kinds, wire))
        return packed.rstrip(b"\0") or b"\0"

    def payload_of(self, **fields: Any) -> bytes:
        """Payload of fields given by name: arrays as sequences, texts as str or bytes; what is left out is zero.

        Arrays and texts that are too long are cut. Raises KeyError for a name that no field has.
        """
        values: list[Any] = []
        for field in self._fields:
            given = fields.pop(field.name, None)
            if field.is_text:
                values.append(given.encode("utf-8", errors="replace") if isinstance(given, str) else given or b"")
            elif field.is_array:
                values += [*(given or ()), *[0] * field.length][: field.length]
            else:
                values.append(0 if given is None else given)
        if fields:
            msg = f"{self.name} has no field {', '.join(fields)}"
            raise KeyError(msg)
        return self.payload(tuple(values))

    def read(self, payload: bytes) -> Any:
        """A payload as a named tuple of the message's fields: arrays are tuples, texts bytes up to the first zero."""
        values = self.unpack(payload)
        if self._is_plain:
            return self._record._make(values)
        read: list[Any] = []
        for field in self._fields:
            first = field.first
            if field.is_text:
                read.append(values[first].partition(b"\0")[0])
            else:
                read.append(values[first : first + field.length] if field.is_array else values[first])
        return self._record._make(read)

    def targets(self, payload: bytes) -> tuple[int, int]:
        """System and component that a payload as received is meant for, 0 for everybody."""
        system, component = self._target_places
        return (
            payload[system] if system < len(payload) else 0,
            payload[component] if component < len(payload) else 0,
        )

    def frame(self, payload: bytes, sequence: int, system: int, component: int, *, signed: bool = False) -> bytes:
        """Whole MAVLink 2 frame around a payload; `signed` announces that a signature will follow it."""
        body = (
            _HEADER.pack(len(payload), signed, 0, sequence, system, component, self.id & 0xFFFF, self.id >> 16)
            + payload
        )
        return _MAGIC + body + mcrf4xx(body + self._extra).to_bytes(2, "little")

    def unpack(self, payload: bytes) -> tuple[Any, ...]:
        """Field values (definition order, arrays flattened) of a payload as received: cut, or longer than we know."""
        return self._from_wire(self._struct.unpack(payload[: self.size].ljust(self.size, b"\0")))


class _Field(NamedTuple):
    """One field: where its value, or the first of its values, stands in the flattened definition."""

    name: str
    first: int
    length: int
    is_text: bool  # a character array is one bytes object,
    is_array: bool  # any other array so many numbers


class _Flattened:
    """How the fields of a message, arrays flattened, lie in the definition and on the wire."""

    def __init__(self, message: type[Any]) -> None:
        kinds_on_wire = iter(_kinds(message.native_format.decode()))
        elements: dict[str, list[str]] = {}
        arrays: set[str] = set()
        self.offsets: list[tuple[str, int]] = []  # of each field in the payload [bytes]
        offset = 0
        for name, length in zip(message.ordered_fieldnames, message.array_lengths, strict=True):
            kind = next(kinds_on_wire)
            is_array = length > 0 and not kind.endswith("s")
            elements[name] = [kind] * length if is_array else [kind]
            if is_array:
                arrays.add(name)
            self.offsets.append((name, offset))
            offset += struct.calcsize(f"<{kind}") * max(length, 1)
        wire = [(name, i) for name in message.ordered_fieldnames for i in range(len(elements[name]))]
        defined = [(name, i) for name in message.fieldnames for i in range(len(elements[name]))]
        place_defined = {element: place for place, element in enumerate(defined)}
        place_on_wire = {element: place for place, element in enumerate(wire)}
        self.order_to_wire = [place_defined[element] for element in wire]
        self.order_from_wire = [place_on_wire[element] for element in defined]
        self.kinds = [elements[name][i] for name, i in wire]
        self.fields = [
            _Field(name, place_defined[name, 0], len(elements[name]), elements[name][0].endswith("s"), name in arrays)
            for name in message.fieldnames
        ]


def _kinds(native_format: str) -> list[str]:
    """Format letters of the fields, one each; an array of characters is `c` to mavgen and `s` to struct."""
    return ["s" if kind == "c" else kind for kind in native_format[1:]]


def _reordering(order: list[int]) -> Any:
    if order == list(range(len(order))):
        return tuple
    return itemgetter(*order)


def _in_range(kind: str, value: Any) -> Any:
    if kind == "s":
        return value
    if kind in "fd":
        value = float(value)
        return value if kind == "d" or not math.isfinite(value) else min(max(value, -_LARGEST_FLOAT), _LARGEST_FLOAT)
    lowest, highest = _INTEGER_RANGE[kind]
    if value != value:  # noqa: PLR0124  (the one value that differs from itself: not a number)
        return 0
    return lowest if value <= lowest else highest if value >= highest else int(value)


@cache
def codec(name: str) -> MessageCodec:
    """Codec of a message of the dialect by its name; raises KeyError for an unknown one."""
    return codec_by_id(_ids()[name])


@cache
def codec_by_id(message_id: int) -> MessageCodec:
    """Codec of a message of the dialect by its id; raises KeyError for an unknown one."""
    return MessageCodec(tiltwing.mavlink_map[message_id])


@cache
def _ids() -> dict[str, int]:
    return {message.msgname: message_id for message_id, message in tiltwing.mavlink_map.items()}
