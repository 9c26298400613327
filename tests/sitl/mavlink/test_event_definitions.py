"""The metadata of events: what libevents' schema and rules ask for, and no enumeration forgotten.

https://github.com/mavlink/libevents: validation/schema.json and scripts/validate.py.
"""

import re
import struct

import pytest

from sitl.flight.failsafe import Action, Cause
from sitl.flight.mode import Mode
from sitl.flight.regime import Regime
from sitl.mavlink.event_definitions import EVENTS, Component, Event, event_metadata, log_levels
from sitl.mavlink.identity import IDENTITIES, PX4

SIZES = {"uint8_t": 1, "int8_t": 1, "uint16_t": 2, "int16_t": 2, "uint32_t": 4, "int32_t": 4, "float": 4}
LARGEST = 25  # bytes of arguments that libevents allows
CONTENT = event_metadata(1, PX4)["components"]["1"]
ENUMS = CONTENT["enums"]
ALL = [
    (group, int(number), event)
    for group, events in CONTENT["event_groups"].items()
    for number, event in events["events"].items()
]


@pytest.mark.parametrize(("text", "value"), [("a", 0xE40C292C), ("foobar", 0xBF9CF968)])
def test_the_number_of_an_event_is_the_published_hash_of_its_name_below_the_component(text: str, value: int) -> None:
    assert Event(text, text).id(1) == 1 << 24 | value & 0xFFFFFF
    assert Event(text, text).id(7) >> 24 == 7


def test_all_events_are_described_once(  # two names with one hash would hide one of them
) -> None:
    assert sorted(event["name"] for _, _, event in ALL) == sorted(EVENTS)
    assert len({number for _, number, _ in ALL}) == len(EVENTS)


@pytest.mark.parametrize("name", sorted(EVENTS))
def test_an_event_keeps_to_the_schema(name: str) -> None:
    ((group, number, event),) = ((g, n, e) for g, n, e in ALL if e["name"] == name)
    assert 0 <= number <= 0xFFFFFF
    assert re.fullmatch(r"[a-zA-Z][a-zA-Z0-9_]*", name)
    assert re.fullmatch(r"[^\n]{1,120}", event["message"])
    assert set(event) <= {"name", "message", "description", "type", "arguments"}
    arguments = event.get("arguments", [])
    kinds = [ENUMS[a["type"]]["type"] if a["type"] in ENUMS else a["type"] for a in arguments]
    assert sum(SIZES[kind] for kind in kinds) <= LARGEST
    assert len({argument["name"] for argument in arguments}) == len(arguments)
    for used in re.findall(r"(?<!\\)\{(\d+)", event["message"]):
        assert 1 <= int(used) <= len(arguments)
    if group in {"arming_check", "health"}:
        if event.get("type") == "summary":
            assert [argument["name"] for argument in arguments] == {
                "arming_check": ["chunk_idx", "error", "warning", "can_arm", "can_run"],
                "health": ["chunk_idx", "is_present", "error", "warning"],
            }[group]
        else:
            assert arguments[0]["type"] in ENUMS
            assert arguments[1] == {"name": "health_component_index", "type": "uint8_t"}
    else:
        assert group == "default"
        assert event.get("type", "append_health_and_arming_messages") == "append_health_and_arming_messages"
        if "type" in event:
            assert kinds[0] == "uint32_t"


def test_enumerations_keep_to_the_schema_and_fit_their_types() -> None:
    for name, enum in ENUMS.items():
        assert re.fullmatch(r"[a-zA-Z][a-zA-Z0-9_]*_t", name)
        for number, entry in enum["entries"].items():
            assert int(number) < 1 << 8 * SIZES[enum["type"]]
            assert re.fullmatch(r"[a-z][a-z0-9_]*", entry["name"])
            assert re.fullmatch(r"[^\n]+", entry["description"])
            if enum.get("is_bitfield"):
                assert int(number).bit_count() == 1


@pytest.mark.parametrize(
    ("name", "members"),
    [
        ("mode_t", Mode),
        ("regime_t", Regime),
        ("failsafe_cause_t", Cause),
        ("failsafe_end_t", Cause),
        ("failsafe_action_t", Action),
    ],
)
def test_no_number_of_the_flight_is_without_a_text(name: str, members: type[Mode]) -> None:
    assert set(ENUMS[name]["entries"]) == {str(int(member)) for member in members}


def test_the_first_part_of_the_vehicle_is_none_as_libevents_asks() -> None:
    assert ENUMS["health_component_t"]["entries"]["1"]["name"] == "none"
    assert Component.NONE == 0


def test_arguments_follow_one_another_without_gaps() -> None:
    event = EVENTS["mission_item_reached"]
    assert event.packed(1, 0x0203) == b"\x01\x00\x03\x02"
    assert EVENTS["home_set"].packed(-1, 2, 3.0) == struct.pack("<iif", -1, 2, 3.0)


def test_both_log_levels_are_in_one_number() -> None:
    assert log_levels(8) == 0x88


def test_the_file_is_of_the_version_that_there_is() -> None:
    for identity in IDENTITIES.values():
        metadata = event_metadata(1, identity)
        assert metadata["version"] == 2
        assert metadata["components"]["1"]["supported_protocols"] == ["health_and_arming_check"]
