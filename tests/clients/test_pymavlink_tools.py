"""pymavlink's log tools on the .tlog that the vehicle writes: each finds in it what has been flown."""

import re
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import pytest
from pymavlink import mavutil
from pymavlink.dialects.v20 import all as mav

from tests.clients.pymavlink_station import PymavlinkStation
from tests.clients.vehicle import HOME, FlownVehicle, place


@pytest.fixture(scope="module")
def tlog(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of a mission that was sent, flown and brought back home, and of all parameters."""
    path = tmp_path_factory.mktemp("tools") / "flight.tlog"
    with FlownVehicle(f"--tlog={path}", speed=16, streams="normal") as vehicle:
        station = PymavlinkStation(vehicle)
        station.link.param_fetch_all()
        latitude, longitude = (round(value * 1e7) for value in place(20.0, 0.0))
        station.link.mav.mission_count_send(1, 1, 1, 0)
        station.get(["MISSION_REQUEST_INT", "MISSION_REQUEST"])
        frame, waypoint = mav.MAV_FRAME_GLOBAL_RELATIVE_ALT, mav.MAV_CMD_NAV_WAYPOINT
        station.link.mav.mission_item_int_send(1, 1, 0, frame, waypoint, 1, 1, 0, 0, 0, 0, latitude, longitude, 15.0)
        station.get("MISSION_ACK", lambda ack: ack.type == mav.MAV_MISSION_ACCEPTED)
        station.take_off(15.0)
        station.link.set_mode("RTL")
        station.wait_for_mode("RTL")
        station.wait_disarmed()
        station.close()
    return path


def tool(name: str, *arguments: str) -> str:
    """What one of pymavlink's tools prints."""
    done = subprocess.run(
        [sys.executable, "-m", f"pymavlink.tools.{name}", *arguments],
        env={"MAVLINK20": "1", "MAVLINK_DIALECT": "all"},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_every_message_of_it_is_read_and_none_is_bad_or_lost(tlog: Path) -> None:
    log = mavutil.mavlink_connection(str(tlog), dialect="all")
    kinds: set[str] = set()
    ours: list[int] = []  # sequence numbers
    while (message := log.recv_match()) is not None:
        kinds.add(message.get_type())
        _, _, _, _, sequence, system = bytes(message.get_msgbuf()[:6])
        if system == 1:
            ours.append(sequence)
    log.close()
    assert "BAD_DATA" not in kinds
    assert {(after - before) % 256 for before, after in pairwise(ours)} == {1}
    # What was heard is in it, too.
    assert {"HEARTBEAT", "ATTITUDE", "COMMAND_LONG", "COMMAND_ACK", "MISSION_COUNT", "PARAM_REQUEST_LIST"} <= kinds


def test_mavlogdump_prints_messages_of_a_kind_in_order(tlog: Path) -> None:
    printed = tool("mavlogdump", "--types", "GLOBAL_POSITION_INT", str(tlog))
    times = [int(found) for found in re.findall(r"time_boot_ms : (\d+)", printed)]
    assert len(times) > 50
    assert times == sorted(times)
    heights = [int(found) for found in re.findall(r"relative_alt : (-?\d+)", printed)]
    assert max(heights) > 14500


def test_mavlogdump_writes_json(tlog: Path) -> None:
    printed = tool("mavlogdump", "--format", "json", "--types", "STATUSTEXT", str(tlog))
    assert '"text": "Armed' in printed


def test_mavflightmodes_lists_the_modes_that_were_flown(tlog: Path) -> None:
    printed = tool("mavflightmodes", str(tlog))
    assert re.search(r"LOITER.*TAKEOFF.*RTL", printed, re.DOTALL)


def test_mavparms_extracts_the_parameters(tlog: Path) -> None:
    values = dict(line.split()[:2] for line in tool("mavparms", str(tlog)).splitlines() if len(line.split()) == 2)
    assert float(values["MPC_XY_CRUISE"]) == 5.0


def test_mavmission_extracts_the_mission(tlog: Path, tmp_path: Path) -> None:
    tool("mavmission", "--output", str(tmp_path / "mission.txt"), str(tlog))
    (line,) = (tmp_path / "mission.txt").read_text().splitlines()[1:]
    assert float(line.split("\t")[8]) == pytest.approx(place(20.0, 0.0)[0], abs=1e-6)


def test_mavtogpx_draws_the_track(tlog: Path) -> None:
    tool("mavtogpx", str(tlog))
    track = (tlog.parent / f"{tlog.name}.gpx").read_text()
    points = re.findall(r'<trkpt lat="([\d.]+)" lon="([\d.]+)">', track)
    assert len(points) > 10
    assert (float(points[0][0]), float(points[0][1])) == pytest.approx(HOME[:2], abs=1e-6)
