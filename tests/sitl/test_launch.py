"""What the options of the MAVLink side bring about, in a real process over real UDP."""

import hashlib
import math
import signal
import subprocess
import time
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from pymavlink import mavutil
from pymavlink.dialects.v20 import common as mav

from sitl.cli import main
from tests.sitl.process import DEADLINE, Station, vehicle


@pytest.fixture
def station() -> Iterator[Station]:
    ground = Station()
    yield ground
    ground.connection.close()


def command(station: Station, number: int, *params: float) -> Any:
    """Send a command until it is acknowledged."""
    padded = [*params, *[math.nan] * (7 - len(params))]
    station.connection.mav.command_long_send(1, 1, number, 0, *padded)
    return station.wait_for(
        "COMMAND_ACK", lambda message: message.command == number and message.result != mav.MAV_RESULT_IN_PROGRESS
    )


def parameter(station: Station, name: str) -> float:
    station.connection.mav.param_request_read_send(1, 1, name.encode(), -1)
    return station.wait_for("PARAM_VALUE", lambda message: message.param_id == name).param_value


def end(process: "subprocess.Popen[str]") -> str:
    """Ask it to end as a person would; returns what it has said."""
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=DEADLINE)
    assert err == ""
    return out


@pytest.mark.parametrize(("identity", "autopilot", "kind"), [("px4", 12, 24), ("ardupilot", 3, 21), ("generic", 0, 24)])
def test_it_looks_like_the_autopilot_it_is_told_to(station: Station, identity: str, autopilot: int, kind: int) -> None:
    with vehicle(station, "--identity", identity):
        heartbeat = station.wait_for("HEARTBEAT")
        assert (heartbeat.autopilot, heartbeat.type) == (autopilot, kind)
        station.connection.mav.command_long_send(1, 1, mav.MAV_CMD_REQUEST_MESSAGE, 0, 148, 0, 0, 0, 0, 0, 0)
        version = station.wait_for("AUTOPILOT_VERSION")
        bytewise = bool(version.capabilities & mav.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE)
        assert bytewise is (identity != "ardupilot")


def test_parameters_come_from_files_and_options_and_outlive_the_process_in_a_state_folder(
    station: Station, tmp_path: Path
) -> None:
    file = tmp_path / "mine.parm"
    file.write_text("RTL_RETURN_ALT 55\nMIS_TAKEOFF_ALT 11\n")
    state = ("--state", str(tmp_path / "state"))
    with vehicle(station, "--params", str(file), "--param", "MIS_TAKEOFF_ALT=22", *state) as process:
        station.wait_for("HEARTBEAT")
        assert parameter(station, "RTL_RETURN_ALT") == 55.0
        assert parameter(station, "MIS_TAKEOFF_ALT") == 22.0
        station.connection.mav.param_set_send(1, 1, b"RTL_DESCEND_ALT", 33.0, mav.MAV_PARAM_TYPE_REAL32)
        station.wait_for("PARAM_VALUE", lambda message: message.param_id == "RTL_DESCEND_ALT")
        end(process)
    with vehicle(station, *state) as process:
        station.wait_for("HEARTBEAT")
        assert parameter(station, "RTL_DESCEND_ALT") == 33.0  # set over the link
        assert parameter(station, "RTL_RETURN_ALT") == 40.0  # was that run's alone
        end(process)


def test_two_processes_do_not_share_a_state_folder(station: Station, tmp_path: Path) -> None:
    with vehicle(station, "--state", str(tmp_path)):
        station.wait_for("HEARTBEAT")
        with vehicle(station, "--link", "udpout:127.0.0.1:9", "--state", str(tmp_path)) as second:
            _, err = second.communicate(timeout=DEADLINE)
        assert second.returncode == 2
        assert str(tmp_path) in err
        assert err.count("\n") == 1


def test_all_traffic_is_recorded(station: Station, tmp_path: Path) -> None:
    path = tmp_path / "all.tlog"
    with vehicle(station, "--tlog", str(path)) as process:
        station.wait_for("HEARTBEAT")
        assert command(station, mav.MAV_CMD_RUN_PREARM_CHECKS).result == 0
        end(process)
    log = mavutil.mavlogfile(str(path))
    kinds = set[str]()
    while (message := log.recv_msg()) is not None:
        kinds.add(message.get_type())
    log.close()
    assert {"HEARTBEAT", "ATTITUDE", "COMMAND_LONG", "COMMAND_ACK"} <= kinds


def test_with_a_key_only_signed_commands_are_obeyed(station: Station, tmp_path: Path) -> None:
    key = tmp_path / "key"
    key.write_text("correct horse battery staple\n")
    with vehicle(station, "--signing-key", str(key)) as process:
        station.wait_for("HEARTBEAT")
        connection = station.connection
        connection.mav.command_long_send(1, 1, mav.MAV_CMD_COMPONENT_ARM_DISARM, 0, 1, 0, 0, 0, 0, 0, 0)
        connection.setup_signing(
            hashlib.sha256(b"correct horse battery staple").digest(), allow_unsigned_callback=lambda *_: False
        )
        assert command(station, mav.MAV_CMD_RUN_PREARM_CHECKS).result == 0
        assert not station.wait_for("HEARTBEAT").base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED
        end(process)


def test_it_begins_anew_when_told_to_and_ends_when_told_to(station: Station) -> None:
    with vehicle(station, "--speed", "5") as process:
        station.wait_for("ATTITUDE", lambda message: message.time_boot_ms > 3000)
        assert command(station, mav.MAV_CMD_USER_2, 2, 20.0, 90.0).result == 0
        station.wait_for("ATTITUDE", lambda message: message.time_boot_ms < 1000)
        hud = station.wait_for("VFR_HUD")
        assert hud.airspeed == pytest.approx(20.0, abs=2.0)
        assert command(station, mav.MAV_CMD_USER_2, 1).result == 0
        station.wait_for("EXTENDED_SYS_STATE", lambda message: message.landed_state == mav.MAV_LANDED_STATE_ON_GROUND)
        assert command(station, mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 2).result == 0
        out, err = process.communicate(timeout=DEADLINE)
    assert (process.returncode, err) == (0, "")
    assert "Restarted: level flight at 20 m/s" in out


def test_a_viewer_gets_heartbeat_and_true_state_at_50_hz(station: Station) -> None:
    with vehicle(station, "--link", f"{station.link},viewer", "--at", "trim:20"):
        times = [station.wait_for("HIL_STATE_QUATERNION").time_usec for _ in range(20)]
        station.wait_for("HEARTBEAT")
        assert {late - early for early, late in pairwise(times)} == {20_000}
        assert station.connection.recv_match(type="ATTITUDE") is None


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["--param", "MIS_TAKEOFF_ALT"], "parameter 'MIS_TAKEOFF_ALT': expected NAME=VALUE"),
        (["--param", "MIS_TAKEOFF_ALTT=3"], "expected MIS_TAKEOFF_ALT"),
        (["--param", "MIS_TAKEOFF_ALT=3000"], "MIS_TAKEOFF_ALT: expected 1 to 120 m, got 3000"),
        (["--params", "no-such-file"], "no-such-file"),
        (["--signing-key", "no-such-file"], "no-such-file"),
        (["--tlog", "/"], "recording /: expected a file to write to"),
        (["--state", "/dev/null"], "state folder /dev/null"),
        (["--identity", "dji"], "'--identity'"),
        (["--link", "udpin:14550,onboard,normal"], "got 'onboard,normal'"),
    ],
)
def test_what_cannot_be_is_said_in_one_line(
    arguments: list[str], expected: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == 2
    error = capsys.readouterr().err
    assert expected in error
    assert error.count("\n") == 1


def test_a_station_that_speaks_once_a_second_is_not_lost_however_fast_the_vehicle_flies(station: Station) -> None:
    with vehicle(station, "--speed", "30", "--param", "NAV_DLL_ACT=2", "--at", "trim:20"):
        station.wait_for("HEARTBEAT")
        said: list[str] = []
        for _ in range(3):  # COM_DL_LOSS_T is 10 s, of which 30 pass between two of these
            station.connection.mav.heartbeat_send(mav.MAV_TYPE_GCS, mav.MAV_AUTOPILOT_INVALID, 0, 0, 0)
            heard = time.monotonic()
            while time.monotonic() - heard < 1.0:
                message = station.connection.recv_match(type=["STATUSTEXT"], blocking=True, timeout=0.1)
                said += [] if message is None else [message.text]
        assert said == []
