"""The program as people start it: a real process, a real ground station over UDP, and what it says to wrong options."""

import math
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from urllib.error import URLError

import pytest
from pymavlink.dialects.v20 import common as mav

from sitl import Scenario
from sitl.cli import Options, main, parse_options
from tests.sitl.process import DEADLINE, ROOT, Station, vehicle


@pytest.fixture
def station() -> Iterator[Station]:
    ground = Station()
    yield ground
    ground.connection.close()


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_heartbeat_arrives_and_a_signal_ends_it_cleanly(station: Station, number: signal.Signals, code: int) -> None:
    with vehicle(station) as process:
        heartbeat = station.wait_for("HEARTBEAT")
        assert heartbeat.get_srcSystem() == 1
        assert heartbeat.type == 24  # MAV_TYPE_VTOL_TILTWING
        process.send_signal(number)
        out, err = process.communicate(timeout=DEADLINE)
    assert process.returncode == code
    assert err == ""
    assert station.link in out
    assert "on the ground" in out


def test_an_instance_shifts_the_ports_and_the_system_id(station: Station) -> None:
    with vehicle(station, "-i", "3", "--link", f"udpout:127.0.0.1:{station.port - 3}", "--sysid", "7"):
        assert station.wait_for("HEARTBEAT").get_srcSystem() == 10


def test_as_fast_as_possible_it_ends_by_itself_after_the_duration(station: Station) -> None:
    with vehicle(station, "--at", "trim:20", "--speed", "max", "--duration", "60") as process:
        out, err = process.communicate(timeout=DEADLINE)
    assert process.returncode == 0
    assert err == ""
    assert "Flew 60.00 s" in out
    last = 0.0
    while (message := station.connection.recv_match(type="ATTITUDE")) is not None:
        last = message.time_boot_ms / 1e3
    assert 0.0 < last <= 60.0


def test_waiting_for_servos_it_shows_itself_and_holds_time_still_until_the_first_output(station: Station) -> None:
    with vehicle(station, "--at", "trim:20", "--wait-servos"):
        station.wait_for("HEARTBEAT")
        assert station.wait_for("ATTITUDE").time_boot_ms == 0
        station.wait_for("HEARTBEAT")  # a second one: wall time passes
        assert station.connection.recv_match(type="ATTITUDE") is None
        station.send_servos()
        station.wait_for("ATTITUDE", lambda message: message.time_boot_ms > 0)


def test_in_lockstep_each_tick_advances_one_period_and_a_repeated_one_none(station: Station) -> None:
    with vehicle(station, "--at", "trim:20", "--lockstep", "--rate", "250"):
        station.wait_for("HEARTBEAT")
        seen = 0
        for _ in range(200):
            station.send_servos(seen)
            station.send_servos(seen)  # a client that repeats itself
            answer = station.wait_for("HIL_STATE_QUATERNION", lambda message, past=seen: message.time_usec > past)
            assert answer.time_usec == seen + 4000
            seen = answer.time_usec


def test_in_real_time_simulated_time_keeps_up_with_the_wall_clock(station: Station) -> None:
    with vehicle(station, "--at", "trim:20"):
        first = station.wait_for("SYSTEM_TIME")
        begin = time.monotonic()
        later = station.wait_for("SYSTEM_TIME", lambda message: message.time_boot_ms >= first.time_boot_ms + 2000)
        took = time.monotonic() - begin
    # It may not run ahead; how far a busy machine lets it fall behind is not its fault.
    assert took > 0.95 * (later.time_boot_ms - first.time_boot_ms) / 1e3


def test_a_diverging_flight_ends_with_one_line_and_no_garbage(station: Station, tmp_path: Path) -> None:
    file = tmp_path / "start.toml"
    file.write_text("rates_deg_s = [1e6, 1e6, 1e6]\nvelocity_body = [1e6, 0, 0]\n")
    with vehicle(station, "--at", str(file)) as process:
        out, err = process.communicate(timeout=DEADLINE)
    assert process.returncode == 1
    assert err.startswith("tiltwing-sitl: flight diverged after t = ")
    assert err.count("\n") == 1
    assert "Traceback" not in out
    told = station.wait_for("STATUSTEXT")
    assert "diverged" in told.text


def test_a_scenario_is_flown_and_options_go_before_it(station: Station, tmp_path: Path) -> None:
    file = tmp_path / "scenario.toml"
    file.write_text(
        """
        start = "ground"
        home = [10, 20, 30, 0]
        [[commands]]
        at = 30
        do = "transition hover"
        [[commands]]
        when = "hover"
        do = "land"
        """
    )
    with vehicle(station, "--scenario", str(file), "--at", "trim:20", "--speed", "20", "--duration", "100") as process:
        first = station.wait_for("GLOBAL_POSITION_INT")
        station.wait_for("EXTENDED_SYS_STATE", lambda message: message.vtol_state == mav.MAV_VTOL_STATE_FW)
        station.wait_for("EXTENDED_SYS_STATE", lambda message: message.vtol_state == mav.MAV_VTOL_STATE_MC)
        heartbeat = station.wait_for("HEARTBEAT")
        out, err = process.communicate(timeout=DEADLINE)
    assert (first.lat, first.lon) == pytest.approx((10e7, 20e7), abs=2000)
    assert first.relative_alt == pytest.approx(100e3, abs=500)
    assert heartbeat.base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED
    assert heartbeat.custom_mode in (4 << 16 | 3 << 24, 4 << 16 | 6 << 24)  # PX4: Hold, Land
    assert err == ""
    assert "autopilot on" in out
    assert "Transition to hover" in out
    assert "Land" in out.splitlines()[-2]


@pytest.mark.parametrize("arguments", [["--no-map"], []])
def test_without_a_map_the_viewers_page_may_fetch_nothing_from_the_internet(
    station: Station, arguments: list[str]
) -> None:
    with vehicle(station, "--rerun", "web", *arguments) as process:
        assert process.stdout is not None
        said = next(line for line in process.stdout if line.startswith("  watch"))
        page = said.split()[1].partition("?")[0]
        opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
        policy = ""
        end = time.monotonic() + DEADLINE
        while not policy and time.monotonic() < end:  # the viewer follows the flight by a second or two
            with suppress(URLError, ConnectionError), opener.open(page, timeout=5.0) as answer:
                policy = answer.headers["Content-Security-Policy"]
    outside = {source for source in policy.split() if source.startswith("https:")}
    assert outside == (set() if arguments else {"https://*.openstreetmap.org"})


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["--speed", "0"], "'--speed': expected a positive number or max, got '0'"),
        (["--speed", "fast"], "'--speed': expected a positive number or max, got 'fast'"),
        (["--home", "47,8"], "'--home': expected LAT,LON,ALT,HDG in degrees and metres, got '47,8'"),
        (["--home", "91,0,0,0"], "'--home': expected a latitude within +-89.9, got 91"),
        (["--wind", "1"], "'--wind': expected N,E or N,E,D in m/s, got '1'"),
        (["--wind", "nan,0"], "'--wind': expected N,E or N,E,D in m/s, got 'nan,0'"),
        (["--earth", "disk"], "'--earth'"),
        (["--rate", "1"], "'--rate'"),
        (["--rate", "330"], "a multiple of 50 steps per second, got 330"),
        (["--duration", "nan"], "'--duration'"),
        (["--sysid", "250", "-i", "9"], "'--instance': expected a system id up to 255, got 250 + 9"),
        (["--servos", "0"], "'--servos'"),
        (["--no-such-flag"], "No such option: --no-such-flag"),
        (["surprise"], "surprise"),
        (["--link", "serial:/dev/null"], "link 'serial:/dev/null': expected udpout:HOST:PORT"),
        (["--link", "udpout:127.0.0.1:65530", "-i", "9"], "expected a port below 65536 with instance 9, got 65539"),
        (["--lockstep", "--speed", "2"], "'--lockstep': expected no --speed with it"),
        (["--lockstep", "--speed", "max"], "'--lockstep': expected no --speed with it"),
        (["--lockstep", "--wait-servos"], "'--lockstep': expected no --wait-servos with it"),
        (["--autopilot", "maybe"], "'--autopilot'"),
        (["--scenario", "no-such-scenario.toml"], "no-such-scenario.toml: cannot be read as TOML"),
        (["--at", str(ROOT)], "and this is a folder"),
        (["--at", "moon"], "moon: expected ground, trim:AIRSPEED or the path of a start file"),
        (["--aircraft", "no-such-aircraft.toml"], "no-such-aircraft.toml"),
        (["--rerun", "paper"], "viewer 'paper': expected web, spawn"),
    ],
)
def test_a_wrong_option_is_answered_with_one_line_and_exit_code_2(
    arguments: list[str], expected: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == 2
    error = capsys.readouterr().err
    assert error.startswith("tiltwing-sitl: ")
    assert expected in error
    assert error.count("\n") == 1


def test_a_port_already_taken_is_said_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        link = f"udpin:{other.getsockname()[1]}"
        assert main(["--link", link]) == 2
    error = capsys.readouterr().err
    assert link in error
    assert error.count("\n") == 1


def test_options_not_given_are_pxs_home_real_time_and_flat() -> None:
    options = parse_options([])
    assert options is not None
    assert (options.speed, options.rate, options.rerun) == (1.0, 400, "off")
    assert options.duration == math.inf
    assert options.autopilot
    # What is not given is as the scenario has it, which is this without a file.
    assert (options.scenario, options.at, options.home, options.earth, options.wind, options.seed) == (None,) * 6
    assert (Scenario().start, Scenario().earth, Scenario().wind.steady_ned) == ("ground", "flat", (0.0, 0.0, 0.0))
    assert Scenario().home == (47.397742, 8.545594, 488.0, 0.0)


def test_in_lockstep_there_is_no_autopilot() -> None:
    options = parse_options(["--lockstep"])
    assert options is not None
    assert not options.autopilot


def test_help_names_every_option_and_ends_with_success(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--help"]) == 0
    text = capsys.readouterr().out
    for option in Options._fields:
        named = {"links": "link", "system_id": "sysid", "parameters": "param", "parameter_files": "params"}
        flag = named.get(option, option).replace("_", "-")
        assert f"--{flag}" in text


def test_options_are_checked_before_anything_slow_is_imported() -> None:
    code = "import sys, sitl.cli; sitl.cli.main(['--bad']); print(*sys.modules)"
    out = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert not {"numba", "numpy", "pymavlink", "rerun", "scipy", "matplotlib"} & set(out.split())


def test_a_flight_needs_neither_the_solvers_of_scipy_nor_rerun_nor_matplotlib_in_its_process() -> None:
    code = (
        "import sys, sitl.cli\n"
        "sitl.cli.main(['--at', 'trim:20', '--speed', 'max', '--duration', '1', '--link', 'udpout:127.0.0.1:9'])\n"
        "print('modules', *sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, check=True)  # a first start compiles
    out = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    loaded = set(out.split("modules", 1)[1].split())
    # Numba itself loads scipy.linalg, for its BLAS.
    assert not {"rerun", "scipy.optimize", "scipy.integrate", "matplotlib", "rich"} & loaded
