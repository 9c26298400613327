"""The command line: JSON whose keys carry units, ranges, other aircraft, one line for what is wrong."""

import json
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vehicle_model.__main__ import main
from vehicle_model.aircraft import load_aircraft
from vehicle_model.linearise import HOLDS, linearise
from vehicle_model.linearise import modes as natural_modes
from vehicle_model.trim import trim_level, trim_sweep

SHIPPED = Path(str(load_aircraft().source_file))
TRIM_KEYS = {"airspeed_m_s", "rpm", "tilt_deg", "elevator_deg", "tail_rpm", "residual"}
MODE_KEYS = {"name", "real", "imag", "omega_rad_s", "damping"}


class Run:
    """One run of the command line in this process: exit status and what it printed."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *arguments: str) -> None:
        monkeypatch.setattr(sys, "argv", ["vehicle_model", *arguments])
        capsys.readouterr()
        with pytest.raises(SystemExit) as ended:
            main()
        code, (self.out, self.err) = ended.value.code, capsys.readouterr()
        if isinstance(code, str):  # sys.exit prints a text and ends with status 1
            self.err, code = self.err + code, 1
        self.status = code or 0


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Any:
    return lambda *arguments: Run(monkeypatch, capsys, *arguments)


def test_trim_prints_json_with_units_in_its_keys(run: Any) -> None:
    done = run("trim", "--airspeed", "0:30:10", "--json")
    rows = json.loads(done.out)
    assert (done.status, done.err) == (0, "")
    assert [row["airspeed_m_s"] for row in rows] == [0.0, 10.0, 20.0, 30.0]
    for row, trim in zip(rows, trim_sweep(load_aircraft(), (0.0, 10.0, 20.0, 30.0)), strict=True):
        assert set(row) >= TRIM_KEYS
        assert row["rpm"] == pytest.approx(trim.rotor_speed * 60.0 / (2.0 * math.pi))
        assert row["tilt_deg"] == pytest.approx(math.degrees(trim.tilt))
        assert row["elevator_deg"] == pytest.approx(math.degrees(trim.elevator))
        assert row["tail_rpm"] == pytest.approx(trim.tail_rpm)
        assert row["residual"] < 1e-9


def test_trim_without_a_range_is_0_to_30_and_without_json_a_table(run: Any) -> None:
    lines = run("trim").out.splitlines()
    assert lines[0].split()[:3] == ["airspeed_m_s", "rpm", "tilt_deg"]
    assert [float(line.split()[0]) for line in lines[1:]] == list(range(31))
    assert len({len(line) for line in lines}) == 1


@pytest.mark.parametrize(
    ("text", "expected"),
    [("20", [20.0]), ("5,25,5", [5.0, 25.0, 5.0]), ("28:30", [28.0, 29.0, 30.0]), ("30:29:-0.5", [30.0, 29.5, 29.0])],
)
def test_airspeeds_are_a_number_a_list_or_a_range_with_its_ends(run: Any, text: str, expected: list[float]) -> None:
    rows = json.loads(run("trim", "--airspeed", text, "--json").out)
    assert [row["airspeed_m_s"] for row in rows] == pytest.approx(expected)


@pytest.mark.parametrize(
    "text", ["", "fast", "1:2:0", "3:1", "0:1:2:3", "nan", "inf", "0:inf:1", "0:nan", "0:1e9:1e-9", "1,,2"]
)
def test_an_airspeed_that_is_none_is_one_line_that_says_what_was_expected(run: Any, text: str) -> None:
    done = run("trim", "--airspeed", text)
    assert (done.status, done.out) == (2, "")
    assert done.err.count("\n") <= 1
    assert "--airspeed" in done.err
    assert f"got {text!r}" in done.err


def test_modes_prints_the_calibrated_hold_and_the_others_beside_it(run: Any) -> None:
    found = json.loads(run("modes", "--airspeed", "30", "--json").out)
    assert found["airspeed_m_s"] == 30.0
    assert set(found["trim"]) >= TRIM_KEYS
    assert {found["hold"], *found["other_holds"]} == set(HOLDS)
    point = trim_level(load_aircraft(), 30.0)
    expected = natural_modes(linearise(load_aircraft(), point, found["hold"]))
    assert [(row["name"], row["real"], row["imag"]) for row in found["modes"]] == [
        (mode.name, mode.real, mode.imag) for mode in expected
    ]
    for row in found["modes"]:
        assert set(row) >= MODE_KEYS
        assert row["omega_rad_s"] == pytest.approx(math.hypot(row["real"], row["imag"]))
        assert row["damping"] == pytest.approx(-row["real"] / row["omega_rad_s"])


@pytest.mark.parametrize("hold", HOLDS)
def test_modes_takes_what_is_held(run: Any, hold: str) -> None:
    found = json.loads(run("modes", "--hold", hold, "--json").out)
    assert found["hold"] == hold
    assert hold not in found["other_holds"]
    names = {row["name"] for row in found["modes"]}
    assert {"short_period", "phugoid"} <= names
    assert ("rotor" in names) == (hold == "throttle")
    table = run("modes", "--hold", hold).out
    assert f"{hold} held (chosen)" in table
    assert table.index(f"{hold} held (chosen)") == table.index("held") - len(hold) - 1


def test_step_prints_the_flight_and_the_servo_outputs_that_make_it(run: Any) -> None:
    flown = json.loads(run("step", "--airspeed", "30", "--elevator", "1", "--duration", "3", "--json").out)
    assert flown["airspeed_m_s"] == 30.0
    assert flown["elevator_step_deg"] == 1.0
    time, q, theta = (np.array(flown[key]) for key in ("time_s", "q_deg_s", "theta_deg"))
    assert len(time) == len(q) == len(theta) == len(flown["u_m_s"]) == len(flown["w_m_s"])
    assert time[-1] == pytest.approx(3.0)
    assert np.diff(time) == pytest.approx(1.0 / flown["rate_hz"])
    assert np.abs(q[time < flown["step_time_s"]]).max() < 1e-6
    assert np.gradient(theta, time) == pytest.approx(q, abs=0.05)  # level wings: theta' = q
    before, after = flown["servo_outputs_before"], flown["servo_outputs_after"]
    assert len(before) == len(after)
    assert before != after


def test_step_without_json_is_a_table_of_about_fifty_lines(run: Any) -> None:
    lines = run("step", "--duration", "5").out.splitlines()
    assert lines[0].split()[0] == "time_s"
    assert 45 <= len(lines) <= 55


def test_another_aircraft_file_is_another_aircraft(run: Any, tmp_path: Path) -> None:
    heavier = tmp_path / "heavier.toml"
    lines = SHIPPED.read_text().splitlines(keepends=True)
    changed = [
        line.replace(line.split("value = ")[1].split(",")[0], "13.5") if line.startswith("mass ") else line
        for line in lines
    ]
    heavier.write_text("".join(changed))
    assert sum(a != b for a, b in zip(lines, changed, strict=True)) == 1
    usual = json.loads(run("trim", "--airspeed", "0", "--json").out)[0]["rpm"]
    found = json.loads(run("trim", "--airspeed", "0", "--json", "--aircraft", str(heavier)).out)[0]["rpm"]
    # Static thrust goes with the square of the speed.
    assert found / usual == pytest.approx(math.sqrt(13.5 / load_aircraft().mass_properties.mass), rel=1e-3)


def test_a_wing_all_in_the_slipstream_has_no_unwetted_margin(run: Any, tmp_path: Path) -> None:
    shipped = (Path(__file__).parents[2] / "vehicle_model" / "hong2013.toml").read_text()
    file = tmp_path / "wet.toml"
    file.write_text(shipped.replace("wetted  = false", "wetted  = true"))
    done = run("trim", "--airspeed", "20", "--aircraft", str(file), "--json")
    assert (done.status, done.err) == (0, "")
    assert json.loads(done.out)[0]["stall_margin_unwetted_deg"] is None


def test_a_wrong_aircraft_file_is_one_line_that_names_file_and_line(run: Any, tmp_path: Path) -> None:
    wrong = tmp_path / "wrong.toml"
    wrong.write_text(SHIPPED.read_text().replace('unit = "kg"', 'unit = "furlong"', 1))
    for arguments in (("trim",), ("modes",), ("step",)):
        done = run(*arguments, "--aircraft", str(wrong))
        assert done.status == 1
        assert done.err.count("\n") <= 1
        assert str(wrong) in done.err
        assert "furlong" in done.err
    missing = run("trim", "--aircraft", str(tmp_path / "none.toml"))
    assert missing.status == 1
    assert missing.err.startswith("error: ")
    assert "none.toml" in missing.err


@pytest.mark.parametrize(
    ("arguments", "names"),
    [
        (("trim", "--airspeed", "150"), "no level trim at 150 m/s"),
        (("modes", "--airspeed", "150"), "no level trim at 150 m/s"),
        (("step", "--airspeed", "150"), "no level trim at 150 m/s"),
    ],
)
def test_a_speed_without_trim_is_one_line_and_status_1(run: Any, arguments: tuple[str, ...], names: str) -> None:
    done = run(*arguments)
    assert (done.status, done.out) == (1, "")
    assert done.err.startswith("error: ")
    assert names in done.err
    assert "\n" not in done.err.rstrip("\n")


@pytest.mark.parametrize(
    ("arguments", "names"),
    [
        (("fly",), "fly"),
        ((), "command"),
        (("trim", "--speed", "3"), "--speed"),
        (("modes", "--hold", "altitude"), "--hold"),
        (("modes", "--airspeed", "nan"), "--airspeed"),
        (("step", "--elevator", "inf"), "--elevator"),
        (("step", "--rate", "0"), "--rate"),
        (("step", "--duration", "-1"), "--duration"),
        (("step", "--at", "soon"), "--at"),
    ],
)
def test_a_wrong_command_line_is_one_line_and_status_2(run: Any, arguments: tuple[str, ...], names: str) -> None:
    done = run(*arguments)
    assert (done.status, done.out) == (2, "")
    assert names in done.err
    assert done.err.count("\n") == 1


def test_bench_prints_microseconds(run: Any) -> None:
    found = json.loads(run("bench", "--json").out)
    assert set(found) == {"rk4_step_from_python_us", "rk4_step_in_loop_us"}
    assert all(0.1 < value < 10_000.0 for value in found.values())


def test_a_check_case_that_fails_is_the_exit_status(run: Any, tmp_path: Path) -> None:
    case = next(iter(sorted((Path(__file__).parent / "check_cases").glob("*.toml"))))
    assert run("case", str(case)).status == 0
    missing = run("case", str(tmp_path / "none.toml"))
    assert missing.status == 1
    assert "none.toml" in missing.err


def test_it_runs_as_a_module() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "vehicle_model", "trim", "--airspeed", "30", "--json"],
        capture_output=True, text=True, check=True, timeout=120,
    )  # fmt: skip
    (row,) = json.loads(done.stdout)
    assert row["airspeed_m_s"] == 30.0
    assert done.stderr == ""
    wrong = subprocess.run(
        [sys.executable, "-m", "vehicle_model", "trim", "--airspeed", "150"],
        capture_output=True, text=True, check=False, timeout=120,
    )  # fmt: skip
    assert wrong.returncode == 1
    assert wrong.stderr.startswith("error: no level trim at 150 m/s")
    assert wrong.stderr.count("\n") == 1
