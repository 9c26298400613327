"""ULog, the log format of PX4: the bytes of a file's header and of its messages.

https://docs.px4.io/main/en/dev_log/ulog_file_format.html. A file is `file_header`, then definitions (formats,
information, parameters), then subscriptions and data. Each message is complete in itself, so they may be joined,
streamed or cut between two of them. pyulog reads all of it, but writes only what it has read before.
"""

import re
import struct
from collections.abc import Iterable, Sequence

__all__ = [
    "FILE_HEADER_SIZE", "data_header", "default_parameter", "dropout", "field_size", "file_header", "format_definition",
    "information", "logged_string", "message_starts", "parameter", "subscription",
]  # fmt: skip

MAGIC = b"ULog\x01\x12\x35"
VERSION = 1
FILE_HEADER_SIZE = 16  # [bytes]
HAS_DEFAULT_PARAMETERS = 1  # first of the compatible flags
SYSTEM_DEFAULT = 1  # to which group a default value belongs

SIZES = {
    "int8_t": 1, "uint8_t": 1, "int16_t": 2, "uint16_t": 2, "int32_t": 4, "uint32_t": 4, "int64_t": 8, "uint64_t": 8,
    "float": 4, "double": 8, "bool": 1, "char": 1,
}  # fmt: skip

_HEADER = struct.Struct("<HB")  # size of what follows, kind
_DATA_HEADER = struct.Struct("<HBH")  # and of data the number of its subscription
_STRING_HEADER = struct.Struct("<BQ")  # level, time
_LONGEST = 0xFFFF  # message


def _message(kind: str, content: bytes) -> bytes:
    return _HEADER.pack(len(content), ord(kind)) + content


def _text(text: str) -> bytes:
    return text.encode("utf-8", errors="replace")


def _keyed(key: str, value: bytes) -> bytes:
    name = _text(key)
    return bytes((len(name),)) + name + value


def file_header(time_us: int) -> bytes:
    """Begin of a file whose log begins at this time [us]: magic, version, time and the flags."""
    compatible = bytes((HAS_DEFAULT_PARAMETERS,)).ljust(8, b"\0")
    incompatible, appended = bytes(8), bytes(3 * 8)
    return MAGIC + struct.pack("<BQ", VERSION, time_us) + _message("B", compatible + incompatible + appended)


def format_definition(name: str, fields: Iterable[tuple[str, str]]) -> bytes:
    """Definition of a message: its name and, for each field, type and name. A type may be an array, `float[3]`."""
    return _message("F", _text(f"{name}:" + "".join(f"{kind} {field};" for kind, field in fields)))


def field_size(kind: str) -> int:
    """Bytes that a field of this basic type takes, `float[3]` 12; raises ValueError for a type that ULog has not."""
    matched = re.fullmatch(r"(\w+)(?:\[(\d+)\])?", kind)
    if matched is None or matched[1] not in SIZES:
        msg = f"type of a field: expected one of {', '.join(SIZES)} or an array of it, got {kind!r}"
        raise ValueError(msg)
    return SIZES[matched[1]] * int(matched[2] or 1)


def information(key: str, value: str | int) -> bytes:
    """Something to know about the log: a text, or a number of 32 bits."""
    if isinstance(value, int):
        return _message("I", _keyed(f"int32_t {key}", struct.pack("<i", value)))
    content = _text(value)
    return _message("I", _keyed(f"char[{len(content)}] {key}", content))


def parameter(name: str, value: float) -> bytes:
    """Value of a parameter: at the beginning, or later when it has changed; an int stays one."""
    return _message("P", _parameter(name, value))


def default_parameter(name: str, value: float) -> bytes:
    """Default value of a parameter, where another one is in force."""
    return _message("Q", bytes((SYSTEM_DEFAULT,)) + _parameter(name, value))


def _parameter(name: str, value: float) -> bytes:
    if isinstance(value, int):
        return _keyed(f"int32_t {name}", struct.pack("<i", value))
    return _keyed(f"float {name}", struct.pack("<f", value))


def subscription(number: int, name: str) -> bytes:
    """Data with this number are messages of this name from now on; numbers count from 0."""
    return _message("A", struct.pack("<BH", 0, number) + _text(name))


def data_header(number: int, size: int) -> bytes:
    """What goes before `size` bytes of data, fields without gaps in the order of the definition."""
    return _DATA_HEADER.pack(size + 2, ord("D"), number)


def logged_string(level: int, time_us: int, text: str) -> bytes:
    """A text for people at a time [us]; level 0 (emergency) to 7 (debug), numbers of MAV_SEVERITY."""
    content = _STRING_HEADER.pack(ord("0") + level, time_us) + _text(text)
    return _message("L", content[:_LONGEST])


def dropout(milliseconds: int) -> bytes:
    """Mark that so much time [ms] is missing here."""
    return _message("O", struct.pack("<H", min(max(milliseconds, 1), 0xFFFF)))


def message_starts(data: Sequence[int], start: int, end: int) -> int:
    """First place at or after `end` where a message begins, walking from one that begins at `start`."""
    while start < end:
        start += 3 + (data[start] | data[start + 1] << 8)
    return start
