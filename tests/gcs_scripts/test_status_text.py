"""STATUSTEXT put together from chunks as the message's definition says."""

from typing import Any

from pymavlink.dialects.v20 import all as mav

from gcs_scripts.status_text import StatusTexts

INFO, WARNING, ERROR = 6, 4, 3


def over_the_wire(severity: int, text: str, identity: int = 0, chunk: int = 0, component: int = 1) -> Any:
    message = mav.MAVLink_statustext_message(severity, text.encode(), identity, chunk)
    return mav.MAVLink(None).decode(bytearray(message.pack(mav.MAVLink(None, 1, component))))


def words(texts: StatusTexts) -> list[str]:
    return [text.text for text in texts.kept]


LONG = "".join(f"{i:03} " for i in range(30))  # 120 characters: two full chunks and a part of one
CHUNKS = [LONG[:50], LONG[50:100], LONG[100:]]


def test_a_long_text_is_one_whatever_order_its_chunks_come_in() -> None:
    for order in ((0, 1, 2), (2, 0, 1), (1, 2, 0)):
        texts = StatusTexts()
        for i in order:
            texts.add(over_the_wire(INFO, CHUNKS[i], identity=9, chunk=i), 0.0)
        assert words(texts) == [LONG]


def test_a_lost_chunk_leaves_a_gap_and_the_next_text_is_its_own() -> None:
    texts = StatusTexts()
    for chunk, text in ((0, CHUNKS[0]), (2, CHUNKS[2])):
        texts.add(over_the_wire(INFO, text, identity=9, chunk=chunk), 1.0)
    texts.add(over_the_wire(INFO, "next", identity=10), 2.0)
    assert words(texts) == [CHUNKS[0] + "..." + CHUNKS[2], "next"]


def test_a_text_of_exactly_full_chunks_is_whole_once_the_next_one_comes() -> None:
    texts = StatusTexts()
    texts.add(over_the_wire(INFO, "x" * 50, identity=3), 0.0)
    texts.add(over_the_wire(INFO, "short"), 0.0)
    assert words(texts) == ["x" * 50, "short"]


def test_only_new_and_grave_texts_tell_the_reason_for_a_refusal_each_once() -> None:
    texts = StatusTexts()
    for severity, text, time in (
        (ERROR, "old", 1.0), (INFO, "fine", 5.0), (WARNING, "no GPS", 5.0), (ERROR, "low", 6.0), (ERROR, "low", 7.0),
    ):  # fmt: skip
        texts.add(over_the_wire(severity, text), time)
    assert texts.warnings_since(5.0) == ["no GPS", "low"]
    assert [text.text for text in texts.since(3)] == ["low", "low"]
