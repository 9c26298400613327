"""MAVSDK's Mission, MissionRaw and Geofence plugins: plans up and down, flown, imported, refused."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from mavsdk.plugins.geofence import Circle, FenceType, Geofence, GeofenceData, GeofenceError, Point, Polygon
from mavsdk.plugins.mission import Mission, MissionError, MissionItem, MissionPlan
from mavsdk.plugins.mission_raw import MissionItem as RawItem
from mavsdk.plugins.mission_raw import MissionRaw, MissionRawError
from mavsdk.plugins.telemetry import FlightMode
from pymavlink.dialects.v20 import common as mav

from tests.clients.mavsdk_station import MavsdkStation, finished
from tests.clients.vehicle import place, until

PLAN = Path(__file__).parents[2] / "docs" / "examples" / "survey_3km.plan"
ACTION = MissionItem.VehicleAction
ITEM_FIELDS = (
    "frame",
    "command",
    "autocontinue",
    "param1",
    "param2",
    "param3",
    "param4",
    "x",
    "y",
    "z",
    "mission_type",
)


@pytest.fixture(scope="module")
def vehicle_options() -> dict[str, Any]:
    return {"speed": 16}


@pytest.fixture
def mission(station: MavsdkStation) -> Iterator[Any]:
    made = station.plugin(Mission)
    yield made
    made.set_return_to_launch_after_mission(False)
    made.clear_mission()


@pytest.fixture
def raw(station: MavsdkStation) -> Iterator[Any]:
    made = station.plugin(MissionRaw)
    yield made
    made.clear_mission()


def waypoint(north: float, east: float, height: float, **options: Any) -> MissionItem:
    return MissionItem(*place(north, east), height, **{"is_fly_through": True, "acceptance_radius_m": 8.0, **options})


def raw_item(
    seq: int, command: int, param1: float = 0.0, *, north: float = 0.0, height: float = 30.0, mission_type: int = 0
) -> RawItem:
    latitude, longitude = place(north, 0.0)
    return RawItem(
        seq=seq,
        frame=mav.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT,
        command=command,
        current=int(seq == 0),
        autocontinue=1,
        param1=param1,
        x=round(latitude * 1e7),
        y=round(longitude * 1e7),
        z=height,
        mission_type=mission_type,
    )


def fields(item: Any, names: tuple[str, ...]) -> list[str]:
    """Values as text, in which what is not given (NaN) equals itself."""
    return [f"{getattr(item, name):.7g}" for name in names]


def flight_plan() -> list[MissionItem]:
    """Up, to cruise, around two corners."""
    return [
        waypoint(0.0, 0.0, 30.0, vehicle_action=ACTION.TAKEOFF),
        waypoint(30.0, 0.0, 30.0, speed_m_s=5.0, vehicle_action=ACTION.TRANSITION_TO_FW),
        waypoint(300.0, 0.0, 50.0, speed_m_s=20.0),
        waypoint(300.0, 300.0, 50.0),
    ]


def test_a_mission_is_flown_with_progress_paused_and_continued_and_ends_at_home(
    station: MavsdkStation, mission: Any
) -> None:
    progress: list[tuple[int, int]] = []
    heard = mission.subscribe_mission_progress(lambda now, _: progress.append((now.current, now.total)))
    mission.set_return_to_launch_after_mission(True)
    mission.upload_mission(MissionPlan(flight_plan()))
    progress.clear()
    assert not mission.is_mission_finished()
    station.action.arm()
    mission.start_mission()
    until(lambda: progress and progress[-1][0] >= 2)
    station.wait_for_mode(FlightMode.MISSION)
    mission.pause_mission()
    station.wait_for_mode(FlightMode.HOLD)
    assert not mission.is_mission_finished()
    mission.start_mission()
    until(mission.is_mission_finished)
    until(lambda: not station.telemetry.armed())
    mission.unsubscribe_mission_progress(heard)
    assert station.at(0.0, 0.0, 0.0)
    assert {total for _, total in progress} == {4}
    assert list(dict.fromkeys(done for done, _ in progress if done)) == [1, 2, 3, 4]
    assert "Mission finished" in station.texts


def test_a_mission_comes_down_as_it_went_up(mission: Any) -> None:
    plan = flight_plan()
    mission.upload_mission(MissionPlan(plan))
    names = ("latitude_deg", "longitude_deg", "relative_altitude_m", "speed_m_s", "vehicle_action", "loiter_time_s")
    assert [fields(item, names) for item in mission.download_mission().mission_items] == [
        fields(item, names) for item in plan
    ]


def test_another_item_is_made_current(mission: Any) -> None:
    mission.upload_mission(MissionPlan(flight_plan()))
    mission.set_current_mission_item(2)
    until(lambda: mission.mission_progress().current == 2)
    with pytest.raises(MissionError, match="INVALID_ARGUMENT"):
        mission.set_current_mission_item(9)


def test_a_long_mission_tells_progress_both_ways_and_an_upload_is_cancelled(mission: Any) -> None:
    long = [waypoint(20.0 + 5.0 * number, 0.0, 30.0) for number in range(200)]
    up = finished(mission.upload_mission_with_progress_async, MissionPlan(long))
    shares = [data.progress for result, data in up if result == "NEXT"]
    assert up[-1][0] == "SUCCESS"
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    down = finished(mission.download_mission_with_progress_async)
    assert down[-1][0] == "SUCCESS"
    (plan,) = (data.mission_plan for _, data in down if data.has_mission)
    assert len(plan.mission_items) == 200

    def upload(report: Any) -> None:
        mission.upload_mission_with_progress_async(MissionPlan(long[:100]), report)
        mission.cancel_mission_upload()

    assert "TRANSFER_CANCELLED" in [result for result, _ in finished(upload)]
    assert len(mission.download_mission().mission_items) == 200


def test_a_plan_of_qgroundcontrol_is_imported_uploaded_and_comes_down_again(station: MavsdkStation, raw: Any) -> None:
    changes: list[bool] = []
    heard = raw.subscribe_mission_changed(lambda changed, _: changes.append(changed))
    plan = raw.import_qgroundcontrol_mission(str(PLAN))
    assert (len(plan.mission_items), len(plan.geofence_items)) == (7, 1)
    raw.upload_mission(plan.mission_items)
    raw.upload_geofence(plan.geofence_items)
    until(lambda: changes)
    raw.unsubscribe_mission_changed(heard)
    for sent, got in ((plan.mission_items, raw.download_mission()), (plan.geofence_items, raw.download_geofence())):
        assert [fields(item, ITEM_FIELDS) for item in got] == [fields(item, ITEM_FIELDS) for item in sent]
    station.plugin(Geofence).clear_geofence()


def test_an_imported_plan_is_flown(station: MavsdkStation, raw: Any) -> None:
    reached: list[int] = []
    heard = raw.subscribe_mission_progress(lambda now, _: reached.append(now.current))
    raw.upload_mission(raw.import_qgroundcontrol_mission(str(PLAN)).mission_items)
    station.action.arm()
    raw.start_mission()
    until(lambda: 2 in reached)
    raw.pause_mission()
    station.wait_for_mode(FlightMode.HOLD)
    raw.unsubscribe_mission_progress(heard)
    assert station.height > 40.0
    raw.set_current_mission_item(6)  # lands
    raw.start_mission()
    until(lambda: raw.mission_progress().current >= 6)


def test_rally_points_go_up_and_come_down(raw: Any) -> None:
    # All at home, so that returns of other tests end there; MAVSDK has no way to clear them.
    points = [
        raw_item(number, mav.MAV_CMD_NAV_RALLY_POINT, height=20.0 + number, mission_type=mav.MAV_MISSION_TYPE_RALLY)
        for number in range(3)
    ]
    raw.upload_rally_points(points)
    assert [fields(item, ITEM_FIELDS) for item in raw.download_rallypoints()] == [
        fields(item, ITEM_FIELDS) for item in points
    ]


def test_a_geofence_of_areas_and_circles_comes_down_as_it_went_up_and_is_cleared(station: MavsdkStation) -> None:
    fence = station.plugin(Geofence)
    corners = [Point(*place(n, e)) for n, e in ((-900.0, -900.0), (900.0, -900.0), (900.0, 900.0), (-900.0, 900.0))]
    sent = GeofenceData(
        [Polygon(corners, FenceType.INCLUSION)], [Circle(Point(*place(200.0, 200.0)), 50.0, FenceType.EXCLUSION)]
    )
    fence.upload_geofence(sent)
    got = fence.download_geofence()
    assert [shape.fence_type for shape in (*got.polygons, *got.circles)] == [FenceType.INCLUSION, FenceType.EXCLUSION]
    assert got.circles[0].radius == 50.0
    for here, there in zip(got.polygons[0].points, corners, strict=True):
        assert (here.latitude_deg, here.longitude_deg) == pytest.approx(
            (there.latitude_deg, there.longitude_deg), abs=1e-7
        )
    fence.clear_geofence()
    empty = fence.download_geofence()
    assert (empty.polygons, empty.circles) == ([], [])


def test_a_geofence_holds(station: MavsdkStation) -> None:
    fence = station.plugin(Geofence)
    fence.upload_geofence(GeofenceData([], [Circle(Point(*place(0.0, 0.0)), 60.0, FenceType.INCLUSION)]))
    station.begin()
    station.take_off(20.0)
    with pytest.raises(Exception, match="COMMAND_DENIED"):
        station.action.goto_location(*place(100.0, 0.0), 520.0, 0.0)
    until(lambda: any("fence" in text for text in station.texts))
    fence.clear_geofence()


def test_missions_that_cannot_be_are_refused_for_what_is_wrong_and_the_old_one_stays(
    station: MavsdkStation, raw: Any
) -> None:
    good = [raw_item(0, mav.MAV_CMD_NAV_TAKEOFF), raw_item(1, mav.MAV_CMD_NAV_WAYPOINT, north=50.0)]
    raw.upload_mission(good)
    for item, result, reason in (
        (raw_item(0, mav.MAV_CMD_NAV_WAYPOINT, -5.0), "INVALID_ARGUMENT", "hold time"),
        (raw_item(0, 4242), "UNSUPPORTED", "command 4242"),
    ):
        with pytest.raises(MissionRawError, match=result):
            raw.upload_mission([item])
        until(lambda reason=reason: any(reason in text for text in station.texts))
    assert len(raw.download_mission()) == 2
    raw.clear_mission()
    with pytest.raises(MissionRawError, match="DENIED"):
        raw.start_mission()


def test_a_fence_that_mavsdk_itself_finds_wrong_never_leaves_it(station: MavsdkStation) -> None:
    with pytest.raises(GeofenceError, match="INVALID_ARGUMENT"):
        station.plugin(Geofence).upload_geofence(
            GeofenceData([], [Circle(Point(*place(0.0, 0.0)), 0.0, FenceType.EXCLUSION)])
        )
