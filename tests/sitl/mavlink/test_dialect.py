"""The generated dialect agrees with everybody else's."""

import sys
from pathlib import Path
from types import ModuleType

import pytest
from pymavlink.dialects.v20 import ardupilotmega, common, development

from sitl.mavlink.dialect import generate
from sitl.mavlink.dialect import tiltwing as ours

# CRC_EXTRA and payload length of the messages that the wheel has not, in the MAVLink project's own common.xml.
UPSTREAM = {
    8: (117, 36),
    80: (14, 4),
    290: (251, 46),
    291: (10, 57),
    300: (217, 22),
    372: (26, 140),
    380: (232, 20),
    395: (0, 212),
    396: (50, 160),
    397: (182, 108),
    410: (160, 53),
    411: (106, 3),
    412: (33, 6),
    413: (77, 7),
}
# Payload lengths, extensions included, of shipped messages that common.xml has lengthened since.
LENGTHENED = {42: 18, 44: 9, 47: 8, 82: 51, 111: 18, 126: 81, 299: 98}


@pytest.mark.parametrize(("message_id", "expected"), UPSTREAM.items())
def test_added_messages_have_the_crc_and_length_of_the_mavlink_project(
    message_id: int, expected: tuple[int, int]
) -> None:
    message = ours.mavlink_map[message_id]
    assert (message.crc_extra, message.unpacker.size) == expected


def test_every_message_is_shipped_borrowed_known_upstream_or_the_one_of_our_own() -> None:
    shipped = {**common.mavlink_map, **ardupilotmega.mavlink_map, **development.mavlink_map}
    assert {ours.mavlink_map[i].msgname for i in ours.mavlink_map.keys() - shipped.keys() - UPSTREAM.keys()} == {
        "TILT_STATUS"
    }


@pytest.mark.parametrize("shipped", [common, ardupilotmega, development], ids=lambda module: module.DIALECT)
def test_shipped_messages_are_unchanged_but_for_extensions(shipped: ModuleType) -> None:
    compared = 0
    for message_id in shipped.mavlink_map.keys() & ours.mavlink_map:
        theirs, message = shipped.mavlink_map[message_id], ours.mavlink_map[message_id]
        assert message.msgname == theirs.msgname
        assert message.crc_extra == theirs.crc_extra, theirs.msgname
        assert message.native_format.startswith(theirs.native_format), theirs.msgname
        assert message.fieldnames[: len(theirs.fieldnames)] == theirs.fieldnames, theirs.msgname
        grown = message.unpacker.size != theirs.unpacker.size
        assert grown == (message_id in LENGTHENED), theirs.msgname
        compared += 1
    assert compared > 200


@pytest.mark.parametrize(("message_id", "size"), LENGTHENED.items())
def test_lengthened_messages_have_the_length_of_the_mavlink_project(message_id: int, size: int) -> None:
    assert ours.mavlink_map[message_id].unpacker.size == size


def test_every_shipped_common_message_is_there() -> None:
    assert common.mavlink_map.keys() <= ours.mavlink_map.keys()


def test_what_is_borrowed_is_there() -> None:
    for names in generate.BORROWED.values():
        for name in names:
            assert hasattr(ours, f"MAVLINK_MSG_ID_{name}") or name in ours.enums, name
    for names in generate.BORROWED_COMMANDS.values():
        for name in names:
            assert ours.enums["MAV_CMD"][getattr(ours, name)].name == name


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("MAV_TYPE_VTOL_TILTWING", 24),
        ("MAV_RESULT_CANCELLED", 6),
        ("MAV_RESULT_COMMAND_UNSUPPORTED_MAV_FRAME", 9),
        ("MAV_PARAM_ERROR_TYPE_MISMATCH", 7),
        ("MAV_CMD_DO_SET_STANDARD_MODE", 262),
        ("MAV_CMD_ACTUATOR_TEST", 310),
        ("MAV_CMD_CONFIGURE_ACTUATOR", 311),
        ("MAV_CMD_INJECT_FAILURE", 420),
        ("MAV_CMD_DO_SET_GLOBAL_ORIGIN", 611),
        ("MAV_CMD_CONTROL_HIGH_LATENCY", 2600),
        ("MAV_CMD_DO_SEND_BANNER", 42428),
        ("MAV_CMD_EXTERNAL_POSITION_ESTIMATE", 43003),
        ("MAV_CMD_EXTERNAL_WIND_ESTIMATE", 43004),
        ("MAV_STANDARD_MODE_TAKEOFF", 8),
        ("MISSION_STATE_COMPLETE", 5),
        ("MAV_FTP_OPCODE_LISTDIRECTORYWITHTIME", 16),
        ("MAV_MODE_PROPERTY_AUTO_MODE", 4),
    ],
)
def test_values_have_their_upstream_numbers(name: str, value: int) -> None:
    assert getattr(ours, name) == value
    assert any(value in entries and entries[value].name == name for entries in ours.enums.values())


def test_the_module_is_what_the_definitions_generate(tmp_path: Path) -> None:
    made = generate.generate(tmp_path / "tiltwing.py")
    assert made.read_text(encoding="utf-8") == generate.DIALECT.with_suffix(".py").read_text(encoding="utf-8")


def test_a_change_that_does_not_fit_the_shipped_definitions_is_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(generate, "RENAMED", {"MAV_TYPE_NOT_THERE": "X"})
    with pytest.raises(RuntimeError, match=r"minimal\.xml.*: expected 'MAV_TYPE_NOT_THERE' once, found it 0 times"):
        generate.generate(tmp_path / "x.py")
    assert "x" not in sys.modules


def test_an_extension_that_the_wheel_has_by_now_is_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(generate, "EXTENSIONS", {"MISSION_CURRENT": ("uint16_t total",)})
    with pytest.raises(RuntimeError, match="MISSION_CURRENT: expected no field total, it has one now"):
        generate.generate(tmp_path / "x.py")
