"""Reads EVENT messages by nothing but the metadata that a ground station downloads."""

import json
import re
import struct
from typing import Any, NamedTuple

__all__ = ["EventReader", "ReadEvent"]

FORMATS = {
    "uint8_t": "B", "int8_t": "b", "uint16_t": "H", "int16_t": "h", "uint32_t": "I", "int32_t": "i", "float": "f",
}  # fmt: skip


class ReadEvent(NamedTuple):
    """One event: its names, the text with the arguments in it, and the arguments."""

    group: str
    name: str
    text: str
    values: tuple[Any, ...]


class EventReader:
    """Knows what is in an events.json."""

    def __init__(self, metadata: bytes) -> None:
        ((component, content),) = json.loads(metadata)["components"].items()
        self.enums: dict[str, Any] = content["enums"]
        self.events: dict[int, tuple[str, Any]] = {
            int(component) << 24 | int(number): (group, event)
            for group, events in content["event_groups"].items()
            for number, event in events["events"].items()
        }

    def read(self, message: Any) -> ReadEvent:
        """An EVENT; every value of an enumeration must be one of its entries, and no byte be left over."""
        group, event = self.events[message.id]
        arguments = event.get("arguments", [])
        kinds = [self.enums.get(argument["type"], {"type": argument["type"]}) for argument in arguments]
        form = struct.Struct("<" + "".join(FORMATS[kind["type"]] for kind in kinds))
        raw = bytes(message.arguments)
        values = form.unpack_from(raw)
        assert not any(raw[form.size :])
        texts = [self._text(kind, value) for kind, value in zip(kinds, values, strict=True)]

        def put(match: re.Match[str]) -> str:
            number, digits = int(match[1]) - 1, match[2]
            return texts[number] if digits is None else f"{values[number]:.{digits}f}"

        text = re.sub(r"\{(\d+)(?::\.(\d+))?[a-z/^2_]*\}", put, event["message"])
        return ReadEvent(group, event["name"], re.sub(r"</?param>", "", text).replace("\\<", "<"), values)

    @staticmethod
    def _text(kind: Any, value: float) -> str:
        entries = kind.get("entries")
        if entries is None:
            return f"{value:g}"
        if not kind.get("is_bitfield"):
            return entries[str(value)]["description"]
        bits = [1 << bit for bit in range(32) if int(value) >> bit & 1]
        return kind["separator"].join(entries[str(bit)]["description"] for bit in bits)
