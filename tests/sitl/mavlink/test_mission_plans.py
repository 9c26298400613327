"""What the vehicle has of each plan: kept as it came, told by its id, stored, and loaded again."""

import json
import math
from pathlib import Path
from typing import Any

import pytest

from sitl.flight.geofence import FenceCircle
from sitl.flight.mission_items import Command, Frame, MissionItem
from sitl.flight.rally import RallyPoint
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.identity import ARDUPILOT
from sitl.mavlink.state_folder import StateFolder
from sitl.simulation import Simulation
from tests.sitl.mavlink.in_memory import Desk
from tests.sitl.mavlink.plan_station import (
    FENCE,
    MISSION,
    RALLY,
    fence,
    fetched,
    item,
    mission,
    rally,
    same_items,
    sent,
)

PLANS = {MISSION: mission(), FENCE: fence(), RALLY: rally()}


def told_id(desk: Desk, kind: int) -> int:
    """The opaque id of a plan, which must be the same wherever it is told."""
    desk.send("MISSION_REQUEST_LIST", mission_type=kind)
    count = desk.of("MISSION_COUNT")[-1]
    desk.command(mav.MAV_CMD_REQUEST_MESSAGE, mav.MAVLINK_MSG_ID_MISSION_CURRENT)
    current = desk.of("MISSION_CURRENT")[-1]
    assert count.opaque_id == (current.mission_id, current.fence_id, current.rally_points_id)[kind]
    return count.opaque_id


@pytest.mark.parametrize("kind", list(PLANS))
def test_ids_are_zero_without_a_plan_change_with_it_and_are_the_same_for_the_same_plan(desk: Desk, kind: int) -> None:
    assert told_id(desk, kind) == 0
    items = PLANS[kind]
    first = sent(desk.station, items, kind).opaque_id
    assert first == told_id(desk, kind) != 0
    assert sent(desk.station, [*items, *items[-1:]] if kind == RALLY else [*items[:-1], {**items[-1], "param2": 1.0}],
                kind).opaque_id not in (0, first)  # fmt: skip
    assert sent(desk.station, items, kind).opaque_id == first


def test_a_plan_from_elsewhere_can_be_fetched(desk: Desk) -> None:
    flight = desk.simulation.flight
    latitude, longitude, _ = flight.home.geodetic
    sent(desk.station, mission())
    old = told_id(desk, MISSION)
    flight.load_mission((
        MissionItem(Command.TAKEOFF, Frame.GLOBAL_RELATIVE_ALT, x=latitude, y=longitude, z=25.0),
        MissionItem(Command.LAND, Frame.GLOBAL_RELATIVE_ALT, x=math.nan, y=math.nan),
    ))  # fmt: skip
    flight.fence.load((), (FenceCircle(latitude, longitude, 400.0, inclusion=True),))
    flight.rally.load((RallyPoint(latitude, longitude, 20.0),))
    assert told_id(desk, MISSION) not in (0, old)
    assert [(one["command"], one["z"]) for one in fetched(desk.station)] == [(22, 25.0), (21, 0.0)]
    assert fetched(desk.station)[1]["x"] == 0x7FFFFFFF
    assert [(one["command"], one["param1"]) for one in fetched(desk.station, FENCE)] == [(5003, 400.0)]
    assert [(one["command"], one["frame"]) for one in fetched(desk.station, RALLY)] == [(5100, 3)]


def test_plans_outlive_a_restart_of_the_vehicle(desk: Desk) -> None:
    for kind, items in PLANS.items():
        sent(desk.station, items, kind)
    ids = [told_id(desk, kind) for kind in PLANS]
    desk.advance(1.0)
    for _ in range(2):
        desk.face.request_restart()
        desk.turn()
        assert desk.simulation.time == 0.0
        desk.publish()
        for kind, items in PLANS.items():
            assert same_items(fetched(desk.station, kind), items)
        assert [told_id(desk, kind) for kind in PLANS] == ids
        assert len(desk.simulation.flight.mission.items) == 5


def test_a_restart_ends_transfers(desk: Desk) -> None:
    desk.send("MISSION_COUNT", count=3)
    desk.face.request_restart()
    desk.turn()
    requests = len(desk.of("MISSION_REQUEST_INT"))
    desk.wait(5.0)
    assert len(desk.of("MISSION_REQUEST_INT")) == requests
    assert not desk.of("MISSION_REQUEST")


def run(folder: Path, **face: Any) -> Desk:
    return Desk(state=StateFolder(folder), **face)


def end(desk: Desk) -> None:
    desk.close()
    desk.face.state.close()


def test_plans_are_stored_and_loaded_at_the_next_start(tmp_path: Path) -> None:
    desk = run(tmp_path)
    for kind, items in PLANS.items():
        sent(desk.station, items, kind)
    ids = [told_id(desk, kind) for kind in PLANS]
    end(desk)
    desk = run(tmp_path)
    for kind, items in PLANS.items():
        assert same_items(fetched(desk.station, kind), items)
    assert [told_id(desk, kind) for kind in PLANS] == ids
    desk.send("MISSION_CLEAR_ALL", mission_type=MISSION)
    end(desk)
    desk = run(tmp_path)
    assert [len(fetched(desk.station, kind)) for kind in PLANS] == [0, 5, 2]
    end(desk)


def test_nothing_is_stored_that_was_not_accepted(tmp_path: Path) -> None:
    desk = run(tmp_path)
    sent(desk.station, mission())
    before = (tmp_path / "mission.json").read_bytes()
    assert sent(desk.station, [*mission(), item(31000)]).type == mav.MAV_MISSION_UNSUPPORTED
    desk.send("MISSION_COUNT", count=3)
    assert (tmp_path / "mission.json").read_bytes() == before
    end(desk)


def test_the_file_can_be_read_by_anybody(tmp_path: Path) -> None:
    desk = run(tmp_path)
    sent(desk.station, mission())
    end(desk)
    file = json.loads((tmp_path / "mission.json").read_text())
    assert list(file) == ["mission"]
    assert file["mission"][0] == {
        "command": 84, "frame": 6, "params": [0.0, 0.0, 0.0, None, 47.3977418, 8.5455939, 30.0],
    }  # fmt: skip


@pytest.mark.parametrize(
    "content", [b"", b"\xff", b"[]", b'{"mission": [{"command": -1}]}', b'{"fence": [{"command": 5, "frame": 0}]}']
)
def test_a_damaged_file_is_set_aside_and_said(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "mission.json").write_bytes(content)
    said: list[str] = []
    desk = run(tmp_path, on_text=lambda _, text: said.append(text))
    assert any(text.startswith("mission.json: ") and text.endswith("kept as mission.json.bad") for text in said)
    assert (tmp_path / "mission.json.bad").read_bytes() == content
    assert sent(desk.station, mission()).type == mav.MAV_MISSION_ACCEPTED
    end(desk)


def test_a_stored_mission_that_cannot_be_flown_here_is_said_and_not_loaded(tmp_path: Path) -> None:
    desk = run(tmp_path)
    sent(desk.station, mission())
    end(desk)
    said: list[str] = []
    away = Simulation(home=(10.0, 10.0, 100.0, 0.0))
    desk = Desk(away, state=StateFolder(tmp_path), on_text=lambda _, text: said.append(text))
    assert any(text.startswith("Stored mission not loaded: item 0: first place is ") for text in said)
    assert fetched(desk.station) == []
    end(desk)


def test_what_a_run_was_started_with_goes_before_what_is_stored(tmp_path: Path) -> None:
    desk = run(tmp_path)
    sent(desk.station, mission())
    sent(desk.station, rally(), RALLY)
    end(desk)
    simulation = Simulation()
    simulation.flight.load_mission((MissionItem(Command.RETURN_TO_LAUNCH, Frame.MISSION),))
    desk = Desk(simulation, state=StateFolder(tmp_path))
    assert [one["command"] for one in fetched(desk.station)] == [20]
    assert same_items(fetched(desk.station, RALLY), rally())
    end(desk)


def test_a_mission_stored_with_home_can_be_read_without_and_the_other_way_round(tmp_path: Path) -> None:
    jumping = [item(22), item(16, 50.0), item(177, frame=2, param1=1, param2=1), item(16, 90.0)]
    desk = run(tmp_path)
    sent(desk.station, jumping)
    end(desk)
    desk = run(tmp_path, identity=ARDUPILOT)
    back = fetched(desk.station)
    assert back[3]["param1"] == 2.0
    assert same_items([back[1], back[2], back[4]], [jumping[0], jumping[1], jumping[3]])
    end(desk)
