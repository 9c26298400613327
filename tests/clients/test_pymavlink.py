"""pymavlink's helpers, as scripts use them: mavutil, mavwp, mavparm, mavftp; the vehicle as PX4 and as ArduPilot."""

from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from pymavlink import mavftp, mavparm, mavwp
from pymavlink.dialects.v20 import ardupilotmega as mav

from tests.clients.pymavlink_station import PymavlinkStation
from tests.clients.vehicle import HOME, FlownVehicle, place

IDENTITIES = ("px4", "ardupilot")
MODES = {"px4": ("RTL", "LAND", "LOITER"), "ardupilot": ("RTL", "QLAND", "LOITER")}


@pytest.fixture(scope="module", params=IDENTITIES)
def vehicle(request: pytest.FixtureRequest) -> Iterator[FlownVehicle]:
    with FlownVehicle(identity=request.param, speed=16, streams="normal") as started:
        yield started


@pytest.fixture(scope="module")
def connected_station(vehicle: FlownVehicle) -> Iterator[PymavlinkStation]:
    made = PymavlinkStation(vehicle)
    yield made
    made.close()


@pytest.fixture
def station(connected_station: PymavlinkStation) -> PymavlinkStation:
    """Connected to a vehicle on the ground."""
    connected_station.begin()
    return connected_station


@pytest.fixture
def identity(vehicle: FlownVehicle) -> str:
    assert vehicle.sitl.options.identity is not None
    return vehicle.sitl.options.identity


def test_mavutil_arms_takes_off_and_asks_for_modes_by_their_names(station: PymavlinkStation, identity: str) -> None:
    station.take_off(15.0)
    for mode in MODES[identity]:
        station.link.set_mode(mode)
        station.wait_for_mode(mode)
    here = station.link.location()
    assert (here.lat, here.lng) == pytest.approx(HOME[:2], abs=1e-5)
    station.link.set_mode("RTL")
    station.wait_disarmed()


def test_mavutil_asks_for_the_older_streams(station: PymavlinkStation) -> None:
    station.link.mav.request_data_stream_send(1, 1, mav.MAV_DATA_STREAM_EXTRA1, 5, 1)
    times = [station.get("ATTITUDE").time_boot_ms for _ in range(6)][2:]
    assert [after - before for before, after in pairwise(times)] == [200, 200, 200]


def test_mavutil_sees_the_vehicle_begin_anew_after_a_reboot(station: PymavlinkStation) -> None:
    before = station.get("ATTITUDE", lambda m: m.time_boot_ms > 500).time_boot_ms
    station.link.reboot_autopilot()
    station.get("ATTITUDE", lambda m: m.time_boot_ms < before)


def uploaded(station: PymavlinkStation, loader: Any, *, as_int: bool) -> int:
    """Give the vehicle what a loader of mavwp has; the type of the MISSION_ACK that ends it."""
    kind = loader.mav_mission_type()
    station.link.mav.mission_count_send(1, 1, loader.count(), kind)
    while True:
        request = station.get(["MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_ACK"])
        if request.get_type() == "MISSION_ACK":
            return request.type
        if (request.get_type() == "MISSION_REQUEST_INT") == as_int:
            station.link.mav.send(loader.wp(request.seq))


def downloaded(station: PymavlinkStation, kind: int, *, as_int: bool) -> list[Any]:
    """The plan of a kind, in items of a kind."""
    send = station.link.mav
    send.mission_request_list_send(1, 1, kind)
    items: list[Any] = []
    for seq in range(station.get("MISSION_COUNT").count):
        ask, name = (
            (send.mission_request_int_send, "MISSION_ITEM_INT")
            if as_int
            else (send.mission_request_send, "MISSION_ITEM")
        )
        ask(1, 1, seq, kind)
        items.append(station.get(name, lambda item, seq=seq: item.seq == seq))
    send.mission_ack_send(1, 1, mav.MAV_MISSION_ACCEPTED, kind)
    return items


def mission(*, as_int: bool) -> Any:
    """Home, as ArduPilot's missions begin, then up and around."""
    loader = mavwp.MAVWPLoader()
    relative = mav.MAV_FRAME_GLOBAL_RELATIVE_ALT
    for command, north, height in (
        (mav.MAV_CMD_NAV_WAYPOINT, 0.0, 0.0),
        (mav.MAV_CMD_NAV_TAKEOFF, 0.0, 20.0),
        (mav.MAV_CMD_NAV_WAYPOINT, 30.0, 20.0),
        (mav.MAV_CMD_NAV_WAYPOINT, 60.0, 25.0),
    ):
        latitude, longitude = place(north, 0.0)
        frame = relative if loader.count() else mav.MAV_FRAME_GLOBAL
        kind: Any
        x: Any
        y: Any
        if as_int:
            kind, x, y = mav.MAVLink_mission_item_int_message, round(latitude * 1e7), round(longitude * 1e7)
        else:
            kind, x, y = mav.MAVLink_mission_item_message, latitude, longitude
        height_told = height if loader.count() else HOME[2]
        loader.add(kind(1, 1, loader.count(), frame, command, 0, 1, 0, 0, 0, 0, x, y, height_told))
    return loader


@pytest.mark.parametrize("as_int", [True, False])
def test_mavwp_sends_a_mission_and_reads_the_same_back(
    station: PymavlinkStation, identity: str, tmp_path: Path, as_int: bool
) -> None:
    loader = mission(as_int=as_int)
    if identity == "px4":
        loader.remove(loader.wp(0))
    assert uploaded(station, loader, as_int=as_int) == mav.MAV_MISSION_ACCEPTED
    got: Any = mavwp.MAVWPLoader()
    for item in downloaded(station, mav.MAV_MISSION_TYPE_MISSION, as_int=False):
        got.add(item)
    got.save(str(tmp_path / "way.txt"))
    again: Any = mavwp.MAVWPLoader()
    assert again.load(str(tmp_path / "way.txt")) == loader.count()
    for number in range(loader.count()):
        sent, back = loader.wp(number), again.wp(number)
        scale = 1e-7 if as_int else 1.0
        assert (back.command, back.seq) == (sent.command, sent.seq)
        assert (back.x, back.y, back.z) == pytest.approx((sent.x * scale, sent.y * scale, sent.z), abs=1e-5)


def test_mavwp_clears_a_mission(station: PymavlinkStation) -> None:
    station.link.waypoint_clear_all_send()
    assert station.get("MISSION_ACK").type == mav.MAV_MISSION_ACCEPTED
    assert downloaded(station, mav.MAV_MISSION_TYPE_MISSION, as_int=True) == []


@pytest.mark.parametrize("kind", ["fence", "rally"])
def test_mavwp_sends_fence_and_rally_points_and_reads_the_same_back(station: PymavlinkStation, kind: str) -> None:
    loader: Any
    if kind == "fence":
        loader, command, count = (
            mavwp.MissionItemProtocol_Fence(1, 1),
            mav.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION,
            4,
        )
    else:
        loader, command, count = mavwp.MissionItemProtocol_Rally(1, 1), mav.MAV_CMD_NAV_RALLY_POINT, 0
    for number, (north, east) in enumerate(((-300.0, -300.0), (-300.0, 300.0), (300.0, 300.0), (300.0, -300.0))):
        x, y = (round(value * 1e7) for value in place(north, east))
        loader.add(
            mav.MAVLink_mission_item_int_message(
                1, 1, number, mav.MAV_FRAME_GLOBAL_RELATIVE_ALT, command, 0, 1, count, 0, 0, 0, x, y, 30.0,
                loader.mav_mission_type(),
            )
        )  # fmt: skip
    assert uploaded(station, loader, as_int=True) == mav.MAV_MISSION_ACCEPTED
    back = downloaded(station, loader.mav_mission_type(), as_int=True)
    assert [(item.command, item.x, item.y) for item in back] == [
        (item.command, item.x, item.y) for item in map(loader.wp, range(4))
    ]
    station.link.mav.mission_clear_all_send(1, 1, loader.mav_mission_type())
    assert station.get("MISSION_ACK").type == mav.MAV_MISSION_ACCEPTED


def test_mavparm_fetches_all_sets_saves_and_loads(station: PymavlinkStation, tmp_path: Path) -> None:
    values = mavparm.MAVParmDict()
    station.link.param_fetch_all()
    count = station.get("PARAM_VALUE").param_count
    for index in range(count):
        station.link.param_fetch_one(index)
        got = station.get("PARAM_VALUE", lambda message, index=index: message.param_index == index)
        values[got.param_id] = got.param_value
    assert values.mavset(station.link, "RTL_RETURN_ALT", 45.0, parm_type=mav.MAV_PARAM_TYPE_REAL32)
    file = tmp_path / "vehicle.parm"
    values.save(str(file))
    assert values.mavset(station.link, "RTL_RETURN_ALT", 50.0, parm_type=mav.MAV_PARAM_TYPE_REAL32)
    assert values["RTL_RETURN_ALT"] == 50.0
    loaded = mavparm.MAVParmDict()
    assert loaded.load(str(file))
    assert loaded["RTL_RETURN_ALT"] == 45.0
    assert len(loaded) == count


@pytest.fixture
def ftp(station: PymavlinkStation) -> Callable[..., Any]:
    """Carries a command line of mavftp out; gives its result."""
    client = mavftp.MAVFTP(station.link, 1, 1)
    client.ftp_settings.idle_detection_time = 0.6  # of silence after which an operation counts as done [s]
    client.ftp_settings.retry_time = client.ftp_settings.read_retry_time = 0.3

    def run(*line: str, wait: bool = True) -> Any:
        result = client.cmd_ftp(list(line))
        if wait and result.error_code == mavftp.FtpError.Success:
            result = client.process_ftp_reply(line[0], timeout=20)
        return result

    run.client = client  # type: ignore[attr-defined]
    return run


def test_mavftp_carries_files_both_ways(ftp: Any, tmp_path: Path) -> None:
    content = bytes(range(256)) * 100
    (tmp_path / "up.bin").write_bytes(content)
    success = mavftp.FtpError.Success
    assert ftp("mkdir", "/trip", wait=False).error_code == success
    assert ftp("put", str(tmp_path / "up.bin"), "/trip/up.bin").error_code == success
    assert ftp("rename", "/trip/up.bin", "/trip/b.bin", wait=False).error_code == success
    listing = ftp("list", "/trip", wait=False)
    assert listing.error_code == success
    assert [(entry.name, entry.size_b) for entry in ftp.client.list_result] == [("b.bin", len(content))]
    assert ftp("get", "/trip/b.bin", str(tmp_path / "down.bin")).error_code == success
    assert (tmp_path / "down.bin").read_bytes() == content
    assert ftp("rm", "/trip/b.bin", wait=False).error_code == success
    assert ftp("rmdir", "/trip", wait=False).error_code == success
    assert ftp("rm", "/trip/b.bin", wait=False).error_code == mavftp.FtpError.FileNotFound


def test_mavftp_fetches_all_parameters_in_one_file_as_from_ardupilot(ftp: Any, identity: str, tmp_path: Path) -> None:
    result = ftp("get", "@PARAM/param.pck", str(tmp_path / "param.pck"))
    if identity == "px4":
        assert result.error_code == mavftp.FtpError.FileNotFound
        return
    assert result.error_code == mavftp.FtpError.Success
    packed = mavftp.MAVFTP.ftp_param_decode((tmp_path / "param.pck").read_bytes())
    assert packed is not None
    values = {name.decode(): value for name, value, _ in packed.params}
    assert values["MPC_XY_CRUISE"] == 5.0
