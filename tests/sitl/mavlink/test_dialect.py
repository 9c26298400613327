"""The generated dialect agrees with everybody else's."""

import sys
from pathlib import Path

import pytest

from sitl.mavlink.dialect import tiltwing as ours

# CRC_EXTRA of the MAVLink project's own common.xml, as its generated C headers print it.
UPSTREAM = {300: 217, 397: 182, 410: 160, 411: 106, 412: 33, 413: 77, 435: 134, 436: 193, 437: 30, 111: 34}


@pytest.mark.parametrize(("message_id", "crc_extra"), UPSTREAM.items())
def test_added_messages_have_the_crc_of_the_mavlink_project(message_id: int, crc_extra: int) -> None:
    assert ours.mavlink_map[message_id].crc_extra == crc_extra


def test_tilt_wing_has_its_upstream_value_and_name() -> None:
    assert ours.MAV_TYPE_VTOL_TILTWING == 24
    assert ours.enums["MAV_TYPE"][24].name == "MAV_TYPE_VTOL_TILTWING"


def test_shipped_messages_are_unchanged_but_for_extensions() -> None:
    from pymavlink.dialects.v20 import common

    for message_id, shipped in common.mavlink_map.items():
        message = ours.mavlink_map[message_id]
        assert message.crc_extra == shipped.crc_extra, shipped.msgname
        assert message.native_format.startswith(shipped.native_format), shipped.msgname


def test_timesync_can_be_addressed() -> None:
    assert ours.MAVLink_timesync_message.fieldnames == ["tc1", "ts1", "target_system", "target_component"]


def test_the_module_is_what_the_definitions_generate(tmp_path: Path) -> None:
    from sitl.mavlink.dialect.generate import DIALECT, generate

    made = generate(tmp_path / "tiltwing.py")
    assert made.read_text(encoding="utf-8") == DIALECT.with_suffix(".py").read_text(encoding="utf-8")


def test_a_patch_that_does_not_fit_the_shipped_definitions_is_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from sitl.mavlink.dialect import generate

    monkeypatch.setattr(generate, "PATCHES", (("minimal.xml", "MAV_TYPE_NOT_THERE", "X"),))
    with pytest.raises(RuntimeError, match=r"minimal\.xml: expected 'MAV_TYPE_NOT_THERE' once, found it 0 times"):
        generate.generate(tmp_path / "x.py")
    assert "x" not in sys.modules
