"""Each service over links that lose, double, reorder and delay: what is asked for comes whole or fails as it should."""

import hashlib
import math
import random
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.event_definitions import EVENTS
from sitl.mavlink.signing import Signing
from tests.sitl.mavlink.ftp_client import errors, opcodes, pymavlink_client
from tests.sitl.mavlink.in_memory import Desk
from tests.sitl.mavlink.log_station import all_gaps_at_once, keep, window_by_window
from tests.sitl.mavlink.lossy_link import BAD_LINKS, PATIENCE, PatientFtp, PatientStation
from tests.sitl.mavlink.parameter_station import NAMES, bits, value_of, values
from tests.sitl.mavlink.plan_station import (
    FENCE,
    MISSION,
    RALLY,
    Transfer,
    fence,
    fetched,
    mission,
    rally,
    same_items,
    sent,
)

REAL32, INT32 = mav.MAV_PARAM_TYPE_REAL32, mav.MAV_PARAM_TYPE_INT32
ACCEPTED, DENIED, UNSUPPORTED = mav.MAV_RESULT_ACCEPTED, mav.MAV_RESULT_DENIED, mav.MAV_RESULT_UNSUPPORTED
UNDER_WAY = 2.0  # longest that a copy of a command, or of its acknowledgement, may still be: neither says of what [s]
OLD = {MISSION: mission(1), FENCE: fence(3), RALLY: rally(1)}
NEW = {MISSION: mission(10), FENCE: fence(11), RALLY: rally(12)}

Visit = Callable[[int], PatientStation]

pytestmark = pytest.mark.parametrize("how", BAD_LINKS)


@pytest.fixture
def visit(how: str, desk: Desk) -> Iterator[Visit]:
    """A station behind such a link, one for each seed; nothing that it does may make a service fail."""
    yield lambda seed: PatientStation(desk, how, seed)
    assert desk.face.internal_errors == 0


# -- commands ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(3))
def test_commands_are_acknowledged_as_they_were_carried_out(desk: Desk, visit: Visit, seed: int) -> None:
    patient = visit(seed)
    flight = desk.simulation.flight
    assert patient.command(31999) == UNSUPPORTED
    assert patient.command(mav.MAV_CMD_DO_SET_MODE, 1, 99) == DENIED
    assert patient.command(mav.MAV_CMD_NAV_TAKEOFF, math.nan, 0, 0, math.nan, math.nan, math.nan) is not None
    assert patient.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1) == ACCEPTED
    assert flight.armed
    desk.wait(UNDER_WAY)
    assert patient.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 0) == ACCEPTED
    assert not flight.armed
    assert patient.command(mav.MAV_CMD_DO_SET_HOME, 0, 0, 0, 0, 91.0, 8.0, 400.0) == DENIED


@pytest.mark.parametrize("seed", range(3))
def test_a_command_that_takes_time_is_waited_for_to_its_end(desk: Desk, visit: Visit, seed: int) -> None:
    patient = visit(seed)
    assert patient.command(mav.MAV_CMD_PREFLIGHT_CALIBRATION, 1, 0, 0, 0, 0, 0, 0) == ACCEPTED
    desk.wait(3.0)
    again = desk.command(mav.MAV_CMD_PREFLIGHT_CALIBRATION, 1, 0, 0, 0, 0, 0, 0)
    assert again.result == ACCEPTED  # not rejected: nothing is under way any more


@pytest.mark.parametrize("seed", range(3))
def test_a_restart_is_carried_out_once_however_often_it_is_asked_for(desk: Desk, visit: Visit, seed: int) -> None:
    patient = visit(seed)
    started = EVENTS["vehicle_started"].id(1)
    before = sum(event.id == started for event in desk.of("EVENT"))
    assert patient.command(mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1) == ACCEPTED
    desk.wait(3.0)
    assert sum(event.id == started for event in desk.of("EVENT")) == before + 1


# -- parameters --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(2))
def test_a_list_of_parameters_is_complete_once_what_is_missing_was_asked_for(
    desk: Desk, visit: Visit, seed: int
) -> None:
    patient = visit(seed)
    station = patient.station
    patient.ask(lambda _: station.send("PARAM_REQUEST_LIST"), "PARAM_VALUE", tries=PATIENCE)
    have: dict[int, Any] = {}
    for _ in range(PATIENCE):
        desk.wait(1.5)
        have |= {message.param_index: message for message in values(station)}
        missing = [index for index in range(len(NAMES)) if index not in have]
        if not missing:
            break
        for index in missing:
            station.send("PARAM_REQUEST_READ", param_index=index)
    parameters = desk.simulation.flight.parameters
    assert [have[index].param_id for index in range(len(NAMES))] == NAMES
    assert {have[i].param_id: value_of(have[i]) for i in have} == pytest.approx({n: parameters[n] for n in NAMES})


@pytest.mark.parametrize("seed", range(3))
def test_a_parameter_is_set_or_refused_and_its_station_knows_which(desk: Desk, visit: Visit, seed: int) -> None:
    patient = visit(seed)
    parameters = desk.simulation.flight.parameters

    def setting(name: str, value: float, answer: str, kind: int = REAL32) -> Any:
        return patient.ask(
            lambda _: patient.station.send("PARAM_SET", param_id=name, param_value=value, param_type=kind),
            answer,
            fits=lambda message: message.param_id == name and (answer == "PARAM_ERROR" or message.param_value == value),
            tries=PATIENCE,
        )

    assert setting("MPC_XY_CRUISE", 4.5, "PARAM_VALUE") is not None
    assert setting("RTL_RETURN_ALT", 60.0, "PARAM_VALUE") is not None
    assert setting("WV_EN", bits(1), "PARAM_VALUE", INT32) is not None
    assert (parameters["MPC_XY_CRUISE"], parameters["RTL_RETURN_ALT"], parameters["WV_EN"]) == (4.5, 60.0, 1)
    assert setting("MPC_XY_CRUISE", math.nan, "PARAM_ERROR").error == mav.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE
    assert setting("NOT_THERE", 1.0, "PARAM_ERROR").error == mav.MAV_PARAM_ERROR_DOES_NOT_EXIST
    assert parameters["MPC_XY_CRUISE"] == 4.5


# -- plans -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", [MISSION, FENCE, RALLY])
def test_a_plan_goes_up_and_down_whole_or_not_at_all(desk: Desk, visit: Visit, how: str, kind: int) -> None:
    completed = 0
    for seed in range(3):
        patient = visit(seed)
        sent(desk.station, OLD[kind], kind)
        result = Transfer(patient.station, kind, NEW[kind]).run()
        desk.wait(5.0)  # until the vehicle has given up, too
        held = fetched(desk.station, kind)
        if result == mav.MAV_MISSION_ACCEPTED:
            assert same_items(held, NEW[kind])
        else:
            assert result in (mav.MAV_MISSION_OPERATION_CANCELLED, "timeout")
            assert same_items(held, OLD[kind]) or (result == "timeout" and same_items(held, NEW[kind]))
        download = Transfer(patient.station, kind)
        download.run()
        assert same_items(download.items, held[: len(download.items)])
        assert download.result == "timeout" or len(download.items) == len(held)
        completed += (result == mav.MAV_MISSION_ACCEPTED) + (download.result == mav.MAV_MISSION_ACCEPTED)
    assert completed >= (4 if "loss" in BAD_LINKS[how] else 6)


def test_a_plan_that_is_refused_is_so_with_its_reason_and_leaves_the_old_one(desk: Desk, visit: Visit) -> None:
    sent(desk.station, OLD[MISSION], MISSION)
    bad = [*NEW[MISSION][:5], {**NEW[MISSION][5], "command": 31999}, *NEW[MISSION][6:]]
    for seed in range(3):
        assert Transfer(visit(seed).station, MISSION, bad).run() in (mav.MAV_MISSION_UNSUPPORTED, "timeout")
    desk.wait(5.0)
    assert same_items(fetched(desk.station, MISSION), OLD[MISSION])


# -- files and logs ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(2))
def test_files_come_and_go_whole_by_reads_bursts_and_writes(desk: Desk, visit: Visit, seed: int) -> None:
    files = desk.face.state.files
    client = PatientFtp(visit(seed))
    content = random.Random(seed).randbytes(30_000)
    (files / "there").write_bytes(content)
    assert client.get_by_bursts(b"/there") == content
    assert client.get(b"/there")[:3000] == content[:3000]
    client.put(b"/here", content[:3000])
    assert (files / "here").read_bytes() == content[:3000]
    assert client.ask(opcodes.CRC, b"/there").opcode == opcodes.ACK
    assert client.ask(opcodes.REMOVE, b"/here").opcode == opcodes.ACK
    assert not (files / "here").exists()
    assert client.ask(opcodes.OPEN, b"/here").error == errors.NOT_FOUND


@pytest.mark.parametrize("seed", range(2))
def test_pymavlinks_ftp_client_gets_whole_files_or_says_that_it_did_not(
    desk: Desk, visit: Visit, seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files = desk.face.state.files
    client = pymavlink_client(desk, monkeypatch, visit(seed).station)
    content = random.Random(seed).randbytes(20_000)
    (files / "there").write_bytes(content)
    (tmp_path / "up").write_bytes(content[:3000])
    client.cmd_get(["/there", str(tmp_path / "down")])
    if client.process_ftp_reply("OpenFileRO", timeout=600).error_code == 0:
        assert (tmp_path / "down").read_bytes() == content
    client.cmd_put([str(tmp_path / "up"), "/up"])
    if client.process_ftp_reply("put", timeout=600).error_code == 0:
        assert (files / "up").read_bytes() == content[:3000]


@pytest.mark.parametrize("download", ["gaps", "windows"])
def test_logs_come_whole(desk: Desk, visit: Visit, download: str) -> None:
    content = random.Random(1).randbytes(40_000)
    keep(desk, content)
    for seed in range(2):
        patient = visit(seed)
        station = patient.station
        request = {"start": 0, "end": 0xFFFF}
        entry = patient.ask(lambda _: station.send("LOG_REQUEST_LIST", **request), "LOG_ENTRY", tries=PATIENCE)  # noqa: B023
        assert entry.size == len(content)
        if download == "gaps":
            assert all_gaps_at_once(desk, station, entry.id) == content
        else:
            assert window_by_window(desk, station, entry.id, len(content)) == content


# -- what is asked and answered ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(3))
def test_clocks_are_compared_with_the_question_that_an_answer_is_for(desk: Desk, visit: Visit, seed: int) -> None:
    patient = visit(seed)
    for _ in range(5):
        answer = patient.ask(
            lambda _: patient.station.send("TIMESYNC", tc1=0, ts1=round(desk.wall * 1e9)), "TIMESYNC", tries=PATIENCE
        )
        assert answer.tc1 == max(desk.face.time_us, 1) * 1000
        assert -1e-6 < desk.wall - answer.ts1 * 1e-9 < PATIENCE * 1.5
        pinged = patient.ask(
            lambda number: patient.station.send(
                "PING", seq=number, time_usec=round(desk.wall * 1e6), target_system=0, target_component=0
            ),
            "PING",
            tries=PATIENCE,
        )
        assert -1e-6 < desk.wall - pinged.time_usec * 1e-6 < PATIENCE * 1.5


@pytest.mark.parametrize("seed", range(3))
def test_messages_come_at_the_interval_asked_for_and_on_request(desk: Desk, visit: Visit, how: str, seed: int) -> None:
    patient = visit(seed)
    station = patient.station
    request, version = mav.MAV_CMD_REQUEST_MESSAGE, mav.MAVLINK_MSG_ID_AUTOPILOT_VERSION
    assert patient.ask(lambda n: station.command(request, version, confirmation=n), "AUTOPILOT_VERSION", tries=PATIENCE)
    assert patient.command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, mav.MAVLINK_MSG_ID_RAW_IMU, 10_000) == ACCEPTED
    interval = patient.ask(
        lambda n: station.command(mav.MAV_CMD_GET_MESSAGE_INTERVAL, mav.MAVLINK_MSG_ID_RAW_IMU, confirmation=n),
        "MESSAGE_INTERVAL",
        tries=PATIENCE,
    )
    assert interval.interval_us == 10_000
    desk.advance(1.0)
    mark = len(station.received)
    desk.advance(4.0)
    heard = len(list(patient.since(mark, "RAW_IMU")))
    link = BAD_LINKS[how]
    # Desk publishes at 50 Hz.
    expected = 4.0 * 50.0 * (1.0 - link.get("loss", 0.0)) * (1.0 + link.get("duplicates", 0.0))
    assert expected * 0.75 < heard < expected * 1.25
    assert patient.command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, mav.MAVLINK_MSG_ID_RAW_IMU, -1) == ACCEPTED


@pytest.mark.parametrize("seed", range(3))
def test_all_modes_are_known_once_those_missing_were_asked_for(visit: Visit, seed: int) -> None:
    patient = visit(seed)
    station, request, modes = patient.station, mav.MAV_CMD_REQUEST_MESSAGE, mav.MAVLINK_MSG_ID_AVAILABLE_MODES
    first = patient.ask(lambda n: station.command(request, modes, 0, confirmation=n), "AVAILABLE_MODES", tries=PATIENCE)
    for index in range(1, first.number_modes + 1):
        mode = patient.ask(
            lambda n: station.command(request, modes, index, confirmation=n),  # noqa: B023  (called at once)
            "AVAILABLE_MODES",
            fits=lambda message: message.mode_index == index,  # noqa: B023
            tries=PATIENCE,
        )
        assert mode.number_modes == first.number_modes


@pytest.mark.parametrize("seed", range(3))
def test_no_event_is_missed_by_who_asks_for_those_not_heard(desk: Desk, visit: Visit, seed: int) -> None:
    patient = visit(seed)
    station = patient.station
    flight = desk.simulation.flight
    flight.arm()
    desk.advance(1.0)
    flight.disarm()
    desk.advance(5.0)
    latest = desk.of("EVENT")[-1].sequence
    first = next(event.sequence for event in desk.of("EVENT") if event.sequence > len(desk.of("EVENT")) - latest)
    for sequence in range(first, latest + 1):
        patient.ask(
            lambda _: station.send("REQUEST_EVENT", first_sequence=sequence, last_sequence=sequence),  # noqa: B023
            "EVENT",
            fits=lambda event: event.sequence == sequence,  # noqa: B023
            tries=PATIENCE,
        )
    heard = {event.sequence: event.id for event in patient.since(0, "EVENT")}
    told = {event.sequence: event.id for event in desk.of("EVENT")}
    assert {sequence: heard[sequence] for sequence in range(first, latest + 1)} == {
        sequence: told[sequence] for sequence in range(first, latest + 1)
    }


# -- signing -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(3))
def test_with_signing_on_all_goes_as_well(how: str, seed: int) -> None:
    """What is overtaken counts as played back, and is asked for again."""
    key = hashlib.sha256(b"a passphrase").digest()
    desk = Desk(signing=Signing(key=key))
    patient = PatientStation(desk, how, seed)
    for station in (desk.station, patient.station):
        signing = station.mav.signing
        signing.secret_key, signing.sign_outgoing = key, True
        signing.timestamp = int((time.time() - 1420070400) * 1e5)
    assert patient.command(31999) == UNSUPPORTED
    assert patient.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1) == ACCEPTED
    desk.wait(UNDER_WAY)
    assert patient.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 0) == ACCEPTED
    sent(desk.station, OLD[MISSION], MISSION)
    result = Transfer(patient.station, MISSION, NEW[MISSION]).run()
    desk.wait(5.0)
    held = fetched(desk.station)
    assert same_items(held, NEW[MISSION] if result == mav.MAV_MISSION_ACCEPTED else OLD[MISSION]) or result == "timeout"
    assert desk.face.internal_errors == 0
    desk.close()
