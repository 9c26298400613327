"""The paper's experiment end to end: a real vehicle process, servo outputs in and HIL_STATE out over real UDP."""

import contextlib
import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from gcs_scripts.connection import connect
from gcs_scripts.elevator_step import main
from gcs_scripts.errors import GroundError
from gcs_scripts.hil_vehicle import HilVehicle
from vehicle_model.aircraft import write_values

ROOT = Path(__file__).parents[2]
ALTITUDE = 588.0  # [m]: 100 m above the default home, where a trimmed start begins


Vehicle = Callable[..., AbstractContextManager[str]]
Wire = Callable[[int, float], AbstractContextManager[tuple[int, list[int]]]]
Port = Callable[[], int]


@pytest.fixture(scope="session")
def vehicle(vehicle: Vehicle) -> Vehicle:
    """A vehicle trimmed at 30 m/s."""
    return partial(vehicle, "--at", "trim:30")


def write_reference(path: Path, **changes: Any) -> Path:
    """What `python -m vehicle_model step --json` prints, for a vehicle at the default home; options can be added."""
    options = {"altitude": ALTITUDE, **changes}
    arguments = [text for name, value in options.items() for text in (f"--{name}", str(value))]
    done = subprocess.run(
        [sys.executable, "-m", "vehicle_model", "step", "--json", *arguments],
        cwd=ROOT, capture_output=True, text=True, check=True, env={**os.environ, "PYTHONWARNINGS": "error"},
    )  # fmt: skip
    path.write_text(done.stdout)
    return path


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The paper's step: 1 deg at 1 s, 50 s long."""
    return write_reference(tmp_path_factory.mktemp("step") / "step.json")


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three seconds of it."""
    return write_reference(tmp_path_factory.mktemp("short") / "step.json", duration=3)


def test_in_lockstep_the_flight_is_the_models_own_time_history(
    vehicle: Vehicle, reference: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    picture = tmp_path / "step.png"
    with vehicle("--lockstep") as link:
        code = main([str(reference), "--connect", link, "--lockstep", "--timeout", "60", "--plot", str(picture)])
    said = capsys.readouterr()
    assert (code, said.err) == (0, "")
    assert "20001 states over 50.000 s, in lockstep" in said.out
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(("theirs", "ours"), [("udpin", "udpout"), ("tcpin", "tcp"), ("tcpout", "tcpin")])
def test_a_vehicle_on_any_link_and_any_heading_agrees(
    vehicle: Vehicle, free_port: Port, short: Path, capsys: pytest.CaptureFixture[str], theirs: str, ours: str
) -> None:
    place = f"127.0.0.1:{free_port()}"
    with vehicle("--lockstep", "--home", "47.397742,8.545594,488,137", link=f"{theirs}:{place}"):
        code = main([str(short), "--connect", f"{ours}:{place}", "--lockstep", "--timeout", "60"])
    assert code == 0, capsys.readouterr().err


def test_in_lockstep_lost_datagrams_cost_time_and_change_nothing(
    vehicle: Vehicle, lossy_wire: Wire, free_port: Port, short: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    port = free_port()
    with lossy_wire(port, 0.02) as (wire, dropped), vehicle("--lockstep", link=f"udpin:127.0.0.1:{port}"):
        link = f"udpout:127.0.0.1:{wire}"
        assert main([str(short), "--connect", link, "--lockstep", "--timeout", "60"]) == 0, capsys.readouterr().err
    assert dropped[0] > 10
    assert "1201 states over 3.000 s" in capsys.readouterr().out


def test_another_aircraft_is_told_from_the_reference(
    vehicle: Vehicle, short: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    heavier = tmp_path / "heavier.toml"
    shutil.copy(ROOT / "vehicle_model" / "hong2013.toml", heavier)
    write_values(heavier, {"mass_properties.mass": 14.0}, "a heavier one")
    with vehicle("--lockstep", "--aircraft", str(heavier)) as link:
        assert main([str(short), "--connect", link, "--lockstep", "--timeout", "60"]) == 1
    assert "theta differs by" in capsys.readouterr().err


def test_another_step_is_told_from_the_reference(
    vehicle: Vehicle, short: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    content = json.loads(short.read_text())
    after = content["servo_outputs_after"]
    content["servo_outputs_after"] = [value + 0.02 * (index == 6) for index, value in enumerate(after)]
    other = tmp_path / "other.json"
    other.write_text(json.dumps(content))
    with vehicle("--lockstep") as link:
        assert main([str(other), "--connect", link, "--lockstep", "--timeout", "60"]) == 1
    assert "q differs by" in capsys.readouterr().err


def test_while_the_vehicle_keeps_time_the_flight_agrees_to_within_a_period(
    vehicle: Vehicle, short: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with vehicle("--autopilot", "off", "--wait-servos", "--speed", "2") as link:
        code = main([str(short), "--connect", link, "--timeout", "60"])
    said = capsys.readouterr()
    assert (code, said.err) == (0, "")
    assert re.search(
        r"x real time, [\d.]+ states a second, \d+ messages lost; arrival jitter p50 .* step in force", said.out
    )
    table = re.findall(r"^(\w+(?: \w+)?) +([\d.e-]+) \S+ +[\d.]+ s +([\d.e-]+)$", said.out, re.MULTILINE)
    shares = {name: float(largest) / float(limit) for name, largest, limit in table}
    # Aligned no better than to a period of 2.5 ms, theta at its fastest (1.2 deg/s) is off by 0.5 % of its peak and
    # q (some 20 deg/s^2) by 4 %.
    assert shares.keys() == {"theta", "q", "velocity ahead", "velocity across", "velocity down"}
    assert shares.pop("q") < 10.0
    assert max(shares.values()) < 2.0


def test_a_vehicle_that_has_ended_with_its_flight_is_only_waited_for_where_its_answer_matters(vehicle: Vehicle) -> None:
    with contextlib.ExitStack() as ground:
        with vehicle() as link:
            craft = ground.enter_context(connect(link, timeout=60.0, kind=HilVehicle))
            craft.stream("HIL_STATE_QUATERNION", 400.0)
        craft.timeout = 0.2
        craft.stream_by_default("HIL_STATE_QUATERNION")  # the recording is done: nothing after it may cost it
        with pytest.raises(GroundError, match="system 1 does not answer SET_MESSAGE_INTERVAL for SERVO_OUTPUT_RAW"):
            craft.stream("SERVO_OUTPUT_RAW", 400.0)


def test_a_vehicle_at_another_altitude_is_refused_and_says_how_to_mend_it(
    vehicle: Vehicle, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    low = write_reference(tmp_path / "low.json", altitude=0, duration=2)
    with vehicle("--lockstep") as link:
        assert main([str(low), "--connect", link, "--lockstep", "--timeout", "60"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "--altitude 588" in said


def without(key: str) -> Callable[[dict[str, Any]], dict[str, Any]]:
    return lambda content: {name: value for name, value in content.items() if name != key}


@pytest.mark.parametrize(
    ("damage", "complaint"),
    [
        (without("time_s"), "time_s is missing"),
        (without("servo_outputs_after"), "servo_outputs_after is missing"),
        (lambda content: content | {"q_deg_s": content["q_deg_s"][:-1]}, "q_deg_s: expected a list of"),
        (lambda content: content | {"theta_deg": "level"}, "theta_deg: expected finite numbers"),
        (lambda content: content | {"step_time_s": 99.0}, "step_time_s: expected a time between"),
        (lambda content: content | {"servo_outputs_after": content["servo_outputs_before"]}, "expected a step"),
        (lambda _: [1, 2], "expected a JSON object"),
    ],
)
def test_a_damaged_reference_is_one_line_that_names_what(
    short: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    damage: Callable[[dict[str, Any]], Any],
    complaint: str,
) -> None:
    broken = tmp_path / "broken.json"
    broken.write_text(json.dumps(damage(json.loads(short.read_text()))))
    assert main([str(broken)]) == 2
    said = capsys.readouterr().err
    assert complaint in said
    assert said.count("\n") == 1


@pytest.mark.parametrize("link", ["udpin:127.0.0.1", "serial:/dev/null:1", "udpin:127.0.0.1:99999"])
def test_a_wrong_connection_string_is_one_line(short: Path, capsys: pytest.CaptureFixture[str], link: str) -> None:
    assert main([str(short), "--connect", link]) == 2
    assert capsys.readouterr().err.startswith("elevator_step: --connect: expected")


def test_no_vehicle_is_one_line_after_the_timeout(
    free_port: Port, short: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([str(short), "--connect", f"udpin:127.0.0.1:{free_port()}", "--timeout", "0.3"]) == 4
    assert "no vehicle on udpin" in capsys.readouterr().err
