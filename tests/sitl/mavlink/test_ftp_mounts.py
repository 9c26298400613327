"""Virtual files over FTP: what ArduPilot's and PX4's tools look for."""

import struct
from collections.abc import Iterator
from pathlib import Path

import pytest
from pymavlink import mavftp

from sitl.mavlink.identity import IDENTITIES
from sitl.mavlink.mission_conversion import FENCE, MISSION, RALLY
from sitl.mavlink.packed_files import packed_plan, unpacked_plan
from tests.sitl.mavlink.ftp_client import FtpClient, errors, opcodes, pymavlink_client
from tests.sitl.mavlink.in_memory import Desk

HERE = (473977420, 85455940)
WAYPOINT = {"frame": 6, "command": 16, "autocontinue": 1, "x": HERE[0], "y": HERE[1], "z": 30.0}


@pytest.fixture
def client(desk: Desk) -> FtpClient:
    return FtpClient(desk)


@pytest.fixture
def ardupilot() -> Iterator[Desk]:
    made = Desk(identity=IDENTITIES["ardupilot"])
    yield made
    made.close()


def test_pymavlink_gets_parameters_and_defaults(
    ardupilot: Desk, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    flight = ardupilot.simulation.flight
    flight.parameters.set("RTL_RETURN_ALT", 55.0)
    client = pymavlink_client(ardupilot, monkeypatch)
    assert client.cmd_getparams([str(tmp_path / "values"), str(tmp_path / "defaults")]).error_code == 0
    assert client.process_ftp_reply("GetParams", timeout=60).error_code == 0
    values = dict(line.split(",") for line in (tmp_path / "values").read_text().split())
    defaults = dict(line.split(",") for line in (tmp_path / "defaults").read_text().split())
    assert set(values) == set(defaults) == set(flight.parameters.names())
    assert (values["RTL_RETURN_ALT"], defaults["RTL_RETURN_ALT"]) == ("55", "40")


def test_an_open_list_of_parameters_stays_as_it_was(ardupilot: Desk) -> None:
    client = FtpClient(ardupilot)
    session = client.done(opcodes.OPEN, b"@PARAM/param.pck").session
    ardupilot.simulation.flight.parameters.set("RTL_RETURN_ALT", 55.0)
    parts = client.request(opcodes.BURST, session=session, size=239)
    data = mavftp.MAVFTP.ftp_param_decode(b"".join(part.data for part in parts))
    assert data is not None
    assert {name: value for name, value, _ in data.params}[b"RTL_RETURN_ALT"] == 40.0


def test_uploaded_parameters_are_set_all_or_none(ardupilot: Desk) -> None:
    client, parameters = FtpClient(ardupilot), ardupilot.simulation.flight.parameters

    def upload(values: dict[bytes, float]) -> int:
        packed = b"".join(bytes((4, len(name) - 1 << 4)) + name + struct.pack("<f", values[name]) for name in values)
        session = client.done(opcodes.CREATE, b"@PARAM/param.pck").session
        data = struct.pack("<HHH", 0x671B, len(values), 6 + len(packed)) + packed
        client.done(opcodes.WRITE, data, session=session)
        return client.ask(opcodes.TERMINATE, session=session).error

    assert upload({b"RTL_RETURN_ALT": 55.0, b"RTL_TYPE": 2.0}) == errors.NONE
    assert (parameters["RTL_RETURN_ALT"], parameters["RTL_TYPE"]) == (55.0, 2)
    assert upload({b"RTL_RETURN_ALT": 50.0, b"RTL_TYPE": 77.0}) == errors.FAIL
    assert (parameters["RTL_RETURN_ALT"], parameters["RTL_TYPE"]) == (55.0, 2)
    assert "RTL_TYPE: expected 0" in "".join(message.text for message in ardupilot.of("STATUSTEXT"))


def test_px4s_clients_are_not_led_to_take_its_parameters_for_ardupilots(client: FtpClient) -> None:
    assert client.ask(opcodes.OPEN, b"@PARAM/param.pck").error == errors.NOT_FOUND


@pytest.mark.parametrize("kind", [MISSION, FENCE, RALLY])
def test_a_plan_goes_up_and_down(desk: Desk, client: FtpClient, kind: int) -> None:
    items = {
        MISSION: [{**WAYPOINT, "command": 22}, WAYPOINT, {**WAYPOINT, "x": HERE[0] + 1000}],
        FENCE: [{**WAYPOINT, "frame": 0, "command": 5003, "param1": 500.0, "z": 0.0}],
        RALLY: [{**WAYPOINT, "frame": 3, "command": 5100}],
    }[kind]
    path = f"@MISSION/{('mission', 'fence', 'rally')[kind]}.dat".encode()
    client.put(path, packed_plan(kind, [{**item, "seq": n, "mission_type": kind} for n, item in enumerate(items)]))
    plan = unpacked_plan(client.get(path))
    assert plan.kind == kind
    for number, (got, sent) in enumerate(zip(plan.items, items, strict=True)):
        assert (got.seq, got.mission_type) == (number, kind)
        for name, value in sent.items():
            assert getattr(got, name) == value
    desk.send("MISSION_REQUEST_LIST", mission_type=kind)
    assert desk.of("MISSION_COUNT")[-1].count == len(items)


def test_a_plan_of_ardupilot_begins_with_home_and_jumps_by_its_numbers(ardupilot: Desk) -> None:
    client = FtpClient(ardupilot)
    jump = {"command": 177, "frame": 2, "param1": 2.0, "param2": 1.0, "autocontinue": 1}
    items = [WAYPOINT, {**WAYPOINT, "command": 22}, WAYPOINT, {**WAYPOINT, "x": HERE[0] + 3000}, jump]
    client.put(b"@MISSION/mission.dat", packed_plan(MISSION, [{**item, "seq": n} for n, item in enumerate(items)]))
    flown = ardupilot.simulation.flight.mission.items
    assert [item.command for item in flown] == [22, 16, 16, 177]
    assert flown[3].param1 == 1.0
    plan = unpacked_plan(client.get(b"@MISSION/mission.dat"))
    assert [item.command for item in plan.items] == [16, 22, 16, 16, 177]
    assert plan.items[4].param1 == 2.0
    home = ardupilot.simulation.flight.home.geodetic
    assert (plan.items[0].x, plan.items[0].y) == (round(home[0] * 1e7), round(home[1] * 1e7))


def test_part_of_a_plan_takes_the_place_of_those_items_only(desk: Desk, client: FtpClient) -> None:
    items = [{**WAYPOINT, "command": 22}, *({**WAYPOINT, "x": HERE[0] + 1000 * n} for n in range(4))]
    client.put(b"@MISSION/mission.dat", packed_plan(MISSION, items))
    part = packed_plan(MISSION, [{**WAYPOINT, "z": 44.0}])
    client.put(b"@MISSION/mission.dat", struct.pack("<HHHHH", 0x763D, MISSION, 1, 2, 1) + part[10:])
    assert [item.z for item in desk.simulation.flight.mission.items] == [30.0, 30.0, 44.0, 30.0, 30.0]


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (packed_plan(FENCE, []), "type 0, got 1"),
        (packed_plan(MISSION, [{**WAYPOINT, "command": 9}]), "item 0"),
        (packed_plan(MISSION, [WAYPOINT])[:-3], "expected 1 items"),
        (packed_plan(MISSION, [WAYPOINT] * 5001), "at most 5000 items"),
    ],
)
def test_a_plan_that_will_not_do_is_refused_with_the_reason_and_the_old_one_stays(
    desk: Desk, client: FtpClient, data: bytes, reason: str
) -> None:
    client.put(b"@MISSION/mission.dat", packed_plan(MISSION, [{**WAYPOINT, "command": 22}, WAYPOINT]))
    session = client.done(opcodes.CREATE, b"@MISSION/mission.dat").session
    for offset in range(0, len(data), 239):
        client.done(opcodes.WRITE, data[offset : offset + 239], session=session, offset=offset)
    assert client.ask(opcodes.TERMINATE, session=session).error == errors.FAIL
    assert reason in "".join(message.text for message in desk.of("STATUSTEXT"))
    assert len(desk.simulation.flight.mission.items) == 2


def test_an_upload_given_up_leaves_the_plan(desk: Desk, client: FtpClient) -> None:
    client.put(b"@MISSION/mission.dat", packed_plan(MISSION, [{**WAYPOINT, "command": 22}, WAYPOINT]))
    session = client.done(opcodes.CREATE, b"@MISSION/mission.dat").session
    whole = packed_plan(MISSION, [WAYPOINT] * 9)
    client.done(opcodes.WRITE, whole[:200], session=session)
    assert client.ask(opcodes.RESET).error == errors.FAIL
    assert len(desk.simulation.flight.mission.items) == 2


def test_logs_are_listed_where_px4_has_them_and_under_their_standard_name(desk: Desk, client: FtpClient) -> None:
    (desk.face.state.logs / "log_1.ulg").write_bytes(b"12345")
    for path in (b"/fs/microsd/log", b"@MAV_LOG"):
        assert client.listed(path) == [b"Flog_1.ulg\t5"]
        assert client.get(path + b"/log_1.ulg") == b"12345"
        assert client.ask(opcodes.REMOVE, path + b"/log_1.ulg").error == errors.PROTECTED


def test_a_look_inside_is_served(desk: Desk, client: FtpClient) -> None:
    assert b"MainThread" in client.get(b"@SYS/threads.txt")
    assert client.get(b"@SYS/uarts.txt").startswith(desk.links[0].spec.text.encode() + b" rx ")


def test_without_an_autopilot_there_are_no_parameters_and_plans() -> None:
    from sitl.simulation import Simulation

    desk = Desk(Simulation(autopilot=False), identity=IDENTITIES["ardupilot"])
    client = FtpClient(desk)
    assert client.ask(opcodes.OPEN, b"@PARAM/param.pck").error == errors.NOT_FOUND
    assert client.ask(opcodes.OPEN, b"@MISSION/mission.dat").error == errors.NOT_FOUND
    assert client.listed(b"@PARAM") == [b"Fparam.pck\t0"]
    desk.close()
