"""What QGroundControl's plans become on the wire."""

import json
import math
from pathlib import Path
from typing import Any

import pytest
from pymavlink import mavwp
from pymavlink.dialects.v20 import all as mav

from gcs_scripts.errors import GroundError
from gcs_scripts.plan_file import Item, Plan, read_plan, wire_items

ROOT = Path(__file__).parents[2]
HOME = (47.397742, 8.545594, 488.0)


def simple(command: int, *params: float | None, jump_id: int = 0, frame: int = 3) -> dict[str, Any]:
    filled = [*params, *[0] * (7 - len(params))]
    entry = {"type": "SimpleItem", "command": command, "frame": frame, "params": filled, "autoContinue": True}
    return entry | ({"doJumpId": jump_id} if jump_id else {})


def read(tmp_path: Path, *items: dict[str, Any], **parts: Any) -> Plan:
    file = tmp_path / "some.plan"
    mission = {"version": 2, "plannedHomePosition": HOME, "items": items}
    file.write_text(json.dumps({"fileType": "Plan", "version": 1, "mission": mission, **parts}))
    return read_plan(file)


def test_the_example_is_seven_items_a_circle_and_a_landing_at_its_end() -> None:
    plan = read_plan(ROOT / "docs" / "examples" / "survey_3km.plan")
    assert [item.command for item in plan.mission] == [84, 16, 16, 16, 16, 18, 85]
    assert plan.landing == 6
    assert [(item.command, item.params[0]) for item in plan.fence] == [(mav.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION, 1600)]
    assert plan.rally == ()


def test_items_of_complex_items_come_in_their_place_and_jumps_go_to_indices(tmp_path: Path) -> None:
    survey = {
        "type": "ComplexItem", "complexItemType": "survey", "version": 5,
        "TransectStyleComplexItem": {"Items": [simple(16, jump_id=2), simple(206, jump_id=3), simple(16, jump_id=4)]},
    }  # fmt: skip
    plan = read(tmp_path, simple(22, jump_id=1), survey, simple(177, 4, 2, jump_id=5), simple(20, jump_id=6))
    assert [item.command for item in plan.mission] == [22, 16, 206, 16, 177, 20]
    assert plan.mission[4].params[:2] == (3.0, 2)
    assert plan.landing == 5


def test_a_vtol_landing_pattern_becomes_what_qgroundcontrol_sends(tmp_path: Path) -> None:
    # Commands, frames and parameters as in QGroundControl's LandingComplexItem::appendMissionItems.
    pattern = {
        "type": "ComplexItem", "complexItemType": "vtolLandingPattern", "altitudesAreRelative": True,
        "landCoordinate": [47.1, 8.1, 0], "landingApproachCoordinate": [47.2, 8.2, 40],
        "loiterRadius": 75, "loiterClockwise": False, "useLoiterToAlt": True, "stopTakingPhotos": True,
    }  # fmt: skip
    items = read(tmp_path, pattern).mission
    assert [(item.command, item.frame) for item in items] == [(189, 2), (206, 2), (2001, 2), (31, 3), (85, 3)]
    assert items[3].params == (1.0, -75.0, 0.0, 1.0, 47.2, 8.2, 40.0)
    assert items[4].params[4:] == (47.1, 8.1, 0.0)
    assert math.isnan(items[4].params[3])
    runway = read(tmp_path, pattern | {"complexItemType": "fwLandingPattern", "useLoiterToAlt": False}).mission
    assert [item.command for item in runway[-2:]] == [16, 21]


def test_fence_and_rally_carry_their_counts_radii_and_heights(tmp_path: Path) -> None:
    corners = [[47.0, 8.0], [47.1, 8.0], [47.0, 8.1]]
    fence = {
        "polygons": [{"polygon": corners, "inclusion": True}, {"polygon": corners[::-1], "inclusion": False}],
        "circles": [{"circle": {"center": [47.05, 8.05], "radius": 30.5}, "inclusion": False}],
        "breachReturn": [47.01, 8.01, 25],
    }
    plan = read(tmp_path, simple(16), geoFence=fence, rallyPoints={"points": [[47.02, 8.02, 30]]})
    assert [item.command for item in plan.fence] == [5001] * 3 + [5002] * 3 + [5004, 5000]
    assert {item.params[0] for item in plan.fence[:6]} == {3}  # MAV_CMD 5001: parameter 1 is the polygon's vertex count
    assert plan.fence[6].params[0] == 30.5
    assert plan.rally == (Item(5100, 3, (0, 0, 0, 0, 47.02, 8.02, 30)),)


def test_places_are_scaled_by_frame_as_the_message_wants_them() -> None:
    items = [
        Item(16, mav.MAV_FRAME_GLOBAL_RELATIVE_ALT, (0, 0, 0, math.nan, 47.3977421, -8.5455941, 30.5)),
        Item(16, mav.MAV_FRAME_LOCAL_NED, (0, 0, 0, 0, 12.34567, -5, -20)),
        Item(178, mav.MAV_FRAME_MISSION, (0, 15, -1, 0, 7, math.nan, 0)),
    ]
    wire = wire_items(items, mav.MAV_MISSION_TYPE_MISSION)
    assert [(w["x"], w["y"], w["z"]) for w in wire] == [
        (473977421, -85455941, 30.5), (123457, -50000, -20), (7, 0, 0),
    ]  # fmt: skip
    assert [w["current"] for w in wire] == [1, 0, 0]
    loader: Any = mavwp.MAVWPLoader(1, 1)  # pymavlink packs them as they are
    for fields in wire:
        loader.add(mav.MAVLink_mission_item_int_message(1, 1, **fields))
    assert [loader.wp(i).seq for i in range(loader.count())] == [0, 1, 2]
    assert loader.wp(1).pack(mav.MAVLink(None))


def test_for_ardupilot_home_is_item_zero_jumps_are_moved_and_only_headings_are_nan() -> None:
    items = [
        Item(84, 3, (0, 0, math.nan, math.nan, 47.0, 8.0, 20)),
        Item(19, 3, (10, math.nan, 0, math.nan, 47.0, 8.0, math.nan)),
        Item(177, 2, (1, 5, 0, 0, 0, 0, 0)),
    ]
    wire = wire_items(items, 0, HOME)
    home = wire[0]
    assert (home["seq"], home["command"], home["frame"], home["x"], home["y"], home["z"]) == (
        0, 16, 0, 473977420, 85455940, 488.0,
    )  # fmt: skip
    assert math.isnan(wire[1]["param4"])
    assert wire[1]["param3"] == wire[2]["param2"] == wire[2]["param4"] == 0.0
    assert math.isnan(wire[2]["z"])  # for ArduPilot to refuse; 0 would be the ground
    assert (wire[3]["seq"], wire[3]["param1"]) == (3, 2)


@pytest.mark.parametrize(
    ("items", "parts", "complaint"),
    [
        ([{"type": "SimpleItem", "frame": 3, "params": [0] * 7}], {}, "mission.items[0]: object missing"),
        ([simple(16) | {"params": [1, 2]}], {}, "mission.items[0]: expected 7 params, got 2"),
        ([simple(16) | {"command": "go"}], {}, "mission.items[0].command: expected `int`, got `str`"),
        (
            [{"type": "ComplexItem", "complexItemType": "StructureScan"}],
            {},
            "mission.items[0]: StructureScan: expected",
        ),
        ([{"type": "ComplexItem", "complexItemType": "vtolLandingPattern"}], {}, "expected landCoordinate"),
        ([simple(177, 9)], {}, "mission item 0: jump: expected an item's doJumpId, got 9"),
        ([], {"fileType": "Params"}, "fileType: expected Plan"),
        ([], {"geoFence": {"circles": [{"inclusion": True}]}}, "geoFence.circles[0]: object missing"),
    ],
)
def test_what_is_wrong_is_named_with_its_place(
    tmp_path: Path, items: list[dict[str, Any]], parts: dict[str, Any], complaint: str
) -> None:
    with pytest.raises(GroundError) as caught:
        read(tmp_path, *items, **parts)
    assert complaint in str(caught.value)
    assert str(caught.value).startswith(str(tmp_path / "some.plan"))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("content", [b"", b"{", b"\xff\xfe", b"[]", b"QGC WPL 110\n"])
def test_what_is_no_plan_is_refused_in_one_line(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "some.plan"
    file.write_bytes(content)
    with pytest.raises(GroundError, match=r"some\.plan: "):
        read_plan(file)


def test_a_file_that_is_not_there_is_refused_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(GroundError, match="cannot be read: No such file"):
        read_plan(tmp_path / "none.plan")
