"""Plan files: what QGroundControl writes is read, what cannot be is refused with its place."""

import json
import math
from pathlib import Path
from typing import Any

import pytest

from sitl.flight.feasibility import check
from sitl.flight.geofence import Fence, FenceCircle, FencePolygon
from sitl.flight.mission_items import Command, Frame, MissionItem
from sitl.flight.parameters import Parameters
from sitl.flight.plan_file import PlanError, read_plan
from sitl.flight.rally import RallyPoint
from tests.sitl.flight.sortie import make_places

EXAMPLE = Path(__file__).resolve().parents[3] / "docs" / "examples" / "survey_3km.plan"
HOME = (47.397742, 8.545594, 488.0)


def simple(command: int, params: list[float | None], number: int, frame: int = 3) -> dict[str, Any]:
    return {
        "AMSLAltAboveTerrain": None, "Altitude": params[6], "AltitudeMode": 1, "autoContinue": True,
        "command": command, "doJumpId": number, "frame": frame, "params": params, "type": "SimpleItem",
    }  # fmt: skip


WAYPOINT = simple(16, [0, 0, 0, None, 47.398, 8.546, 30], 1)
LANDING = {
    "altitudesAreRelative": True, "complexItemType": "vtolLandingPattern", "landCoordinate": [47.3977, 8.5456, 0],
    "landingApproachCoordinate": [47.4, 8.54, 40], "loiterClockwise": False, "loiterRadius": 90,
    "stopTakingPhotos": True, "stopVideoPhotos": True, "type": "ComplexItem", "useLoiterToAlt": True, "version": 1,
}  # fmt: skip


def survey(*items: dict[str, Any]) -> dict[str, Any]:
    return {
        "TransectStyleComplexItem": {"CameraCalc": {}, "Items": list(items), "version": 1},
        "angle": 0, "complexItemType": "survey", "polygon": [], "type": "ComplexItem", "version": 5,
    }  # fmt: skip


def plan(*items: dict[str, Any]) -> dict[str, Any]:
    return {
        "fileType": "Plan",
        "geoFence": {"circles": [], "polygons": [], "version": 2},
        "groundStation": "QGroundControl",
        "mission": {
            "cruiseSpeed": 18, "firmwareType": 12, "globalPlanAltitudeMode": 1, "hoverSpeed": 4, "items": list(items),
            "plannedHomePosition": list(HOME), "vehicleType": 20, "version": 2,
        },
        "rallyPoints": {"points": [], "version": 2},
        "version": 1,
    }  # fmt: skip


def write(folder: Path, content: object) -> Path:
    path = folder / "some.plan"
    path.write_text(json.dumps(content))
    return path


def test_items_are_read_with_null_as_unset(tmp_path: Path) -> None:
    read = read_plan(write(tmp_path, plan(WAYPOINT)))
    (item,) = read.items
    assert math.isnan(item.param4)
    assert (item.command, item.frame, item.x, item.y, item.z) == (Command.WAYPOINT, 3, 47.398, 8.546, 30.0)
    assert (read.home, read.cruise_speed, read.hover_speed) == (HOME, 18.0, 4.0)


def test_jumps_are_by_the_missions_own_numbers_also_past_complex_items(tmp_path: Path) -> None:
    items = [
        WAYPOINT,
        survey(simple(16, [0, 0, 0, None, 47.4, 8.546, 30], 2), simple(206, [25, 0, 1, 0, 0, 0, 0], 3, frame=2)),
        simple(16, [0, 0, 0, None, 47.41, 8.546, 30], 4),
        simple(177, [4, 2, 0, 0, 0, 0, 0], 5, frame=2),
    ]
    read = read_plan(write(tmp_path, plan(*items))).items
    assert [item.command for item in read] == [16, 16, 206, 16, 177]
    assert (read[4].param1, read[4].param2) == (3.0, 2.0)


def test_vtol_landing_pattern_becomes_what_qgroundcontrol_sends_for_it(tmp_path: Path) -> None:
    read = read_plan(write(tmp_path, plan(WAYPOINT, LANDING))).items
    assert [item.command for item in read[1:]] == [
        Command.DO_LAND_START, Command.DO_SET_CAM_TRIGG_DIST, Command.IMAGE_STOP_CAPTURE, Command.VIDEO_STOP_CAPTURE,
        Command.LOITER_TO_ALT, Command.VTOL_LAND,
    ]  # fmt: skip
    loiter, land = read[-2:]
    assert loiter == MissionItem(31, Frame.GLOBAL_RELATIVE_ALT, 1.0, -90.0, 0.0, 1.0, 47.4, 8.54, 40.0)
    assert (land.x, land.y, land.z) == (47.3977, 8.5456, 0.0)
    straight = read_plan(write(tmp_path, plan(LANDING | {"useLoiterToAlt": False, "stopTakingPhotos": False}))).items
    assert [item.command for item in straight] == [189, 2501, 16, 85]
    assert check(read, make_places(), Parameters()) == []


def test_fence_and_rally_points_are_read(tmp_path: Path) -> None:
    content = plan(WAYPOINT)
    corners = [[47.39, 8.54], [47.40, 8.54], [47.40, 8.55]]
    content["geoFence"]["polygons"] = [{"polygon": corners, "inclusion": True, "version": 1}]
    content["geoFence"]["circles"] = [
        {"circle": {"center": [47.395, 8.545], "radius": 20.5}, "inclusion": False, "version": 1}
    ]
    content["rallyPoints"]["points"] = [[47.396, 8.544, 25]]
    read = read_plan(write(tmp_path, content))
    assert read.polygons == (FencePolygon(((47.39, 8.54), (47.40, 8.54), (47.40, 8.55)), inclusion=True),)
    assert read.circles == (FenceCircle(47.395, 8.545, 20.5, inclusion=False),)
    assert read.rally_points == (RallyPoint(47.396, 8.544, 25.0, above_home=True),)


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (plan(WAYPOINT | {"params": [0, 0, 0]}), "mission.items[0].params: expected `array` of length 7"),
        (plan(WAYPOINT | {"command": "go"}), "mission.items[0].command: expected `int`, got `str`"),
        (plan(WAYPOINT) | {"fileType": "Tram"}, "fileType: expected Plan, got Tram"),
        ({"fileType": "Plan"}, "file: object missing required field `mission`"),
        (
            plan(LANDING | {"complexItemType": "StructureScan"}),
            "mission.items[0]: complex item StructureScan: ",
        ),
        (plan(LANDING | {"landCoordinate": None}), "mission.items[0]: expected landCoordinate and"),
        (
            plan(WAYPOINT, simple(177, [9, 1, 0, 0, 0, 0, 0], 2)),
            "mission item 1: jump: expected the doJumpId",
        ),
    ],
)
def test_what_is_no_plan_is_refused_with_its_place(tmp_path: Path, content: object, reason: str) -> None:
    path = write(tmp_path, content)
    with pytest.raises(PlanError) as refusal:
        read_plan(path)
    assert str(refusal.value).startswith(f"{path}: {reason}")
    assert "\n" not in str(refusal.value)


def test_what_is_no_json_or_no_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "text.plan").write_text("not a plan")
    with pytest.raises(PlanError, match=r"text\.plan: file: expected JSON as QGroundControl saves it"):
        read_plan(tmp_path / "text.plan")
    with pytest.raises(PlanError, match=r"none\.plan: cannot be read: No such file"):
        read_plan(tmp_path / "none.plan")


def test_example_can_be_flown_inside_its_own_fence() -> None:
    read, places, parameters = read_plan(EXAMPLE), make_places(), Parameters()
    fence = Fence(parameters, places)
    fence.load(read.polygons, read.circles)
    assert check(read.items, places, parameters, fence) == []
    assert read.home == HOME
    legs = [places.to_ned(item.x, item.y, 488.0)[:2] for item in read.items[1:5]]
    length = sum(math.dist(a, b) for a, b in zip([(0.0, 0.0), *legs], legs, strict=False))
    assert length == pytest.approx(3210.0, abs=10.0)
