"""What becomes of parameters from one run to the next, and of files that are damaged or cannot be written."""

import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from sitl.flight.parameter_file import read_parameters
from sitl.flight.parameters import Parameters
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.state_folder import StateError, StateFolder
from sitl.simulation import Simulation
from tests.sitl.mavlink.in_memory import Desk

STORAGE = mav.MAV_CMD_PREFLIGHT_STORAGE
FILE = "parameters.params"
Run = Callable[..., Desk]


@pytest.fixture
def run(tmp_path: Path) -> Iterator[Run]:
    """Runs of a vehicle with the same state folder, one after the other."""
    running: list[Desk] = []

    def end() -> None:
        for desk in running:
            desk.close()
            desk.face.state.close()
        running.clear()

    def begin(simulation: Simulation | None = None, **options: Any) -> Desk:
        end()
        running.append(Desk(simulation, state=StateFolder(tmp_path), **options))
        return running[-1]

    yield begin
    end()


def put(desk: Desk, name: str, value: float) -> None:
    """Set a "float" parameter."""
    desk.send("PARAM_SET", param_id=name, param_value=value, param_type=mav.MAV_PARAM_TYPE_REAL32)


def stored(folder: Path) -> dict[str, float]:
    return read_parameters(folder / FILE)


def heard(texts: list[tuple[int, str]]) -> Callable[[int, str], None]:
    return lambda severity, text: texts.append((severity, text))


def test_what_was_set_is_there_in_the_next_run_in_a_file_qgroundcontrol_reads(run: Run, tmp_path: Path) -> None:
    desk = run()
    put(desk, "NAV_ACC_RAD", 0.7)
    desk.simulation.flight.parameters.set("WV_EN", 1)
    parameters = run().simulation.flight.parameters
    assert parameters["NAV_ACC_RAD"] == 0.7
    assert parameters["WV_EN"] == 1
    lines = (tmp_path / FILE).read_text().splitlines()
    assert [line for line in lines if not line.startswith("#")] == ["1\t1\tNAV_ACC_RAD\t0.7\t9", "1\t1\tWV_EN\t1\t6"]


def test_many_changes_are_one_write_half_a_second_later(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    desk = run()
    writes: list[str] = []
    write = desk.face.state.write
    monkeypatch.setattr(desk.face.state, "write", lambda name, data: (writes.append(name), write(name, data)))
    for value in range(1, 51):
        put(desk, "NAV_ACC_RAD", float(value))
        desk.wait(0.004)
    assert writes == []
    desk.wait(0.5)
    assert writes == [FILE]
    desk.wait(2.0)
    assert writes == [FILE]
    put(desk, "NAV_ACC_RAD", 3.0)
    desk.close()
    assert writes == [FILE, FILE]


def test_command_line_goes_before_scenario_and_this_before_what_is_stored(run: Run, tmp_path: Path) -> None:
    desk = run()
    for name in ("NAV_ACC_RAD", "MPC_XY_CRUISE", "MPC_TKO_SPEED"):
        put(desk, name, 3.0)
    scenario = tmp_path / "scenario.toml"
    scenario.write_text("[parameters]\nNAV_ACC_RAD = 4\nMPC_XY_CRUISE = 4\n")
    desk = run(Simulation(scenario, parameters={"NAV_ACC_RAD": 5.0}))
    parameters = desk.simulation.flight.parameters
    assert (parameters["NAV_ACC_RAD"], parameters["MPC_XY_CRUISE"], parameters["MPC_TKO_SPEED"]) == (5.0, 4.0, 3.0)
    # Neither is stored itself, and a later run without them has what was set.
    put(desk, "RTL_RETURN_ALT", 50.0)
    parameters = run().simulation.flight.parameters
    assert (parameters["NAV_ACC_RAD"], parameters["MPC_XY_CRUISE"], parameters["RTL_RETURN_ALT"]) == (3.0, 3.0, 50.0)


def test_what_was_set_outlives_a_reboot_without_any_folder(desk: Desk) -> None:
    put(desk, "NAV_ACC_RAD", 7.0)
    desk.face.request_restart()
    desk.turn()
    assert desk.simulation.flight.parameters["NAV_ACC_RAD"] == 7.0
    put(desk, "NAV_ACC_RAD", 8.0)
    assert desk.of("PARAM_VALUE")[-1].param_value == 8.0


def test_a_damaged_file_is_set_aside_and_told_in_one_line(run: Run, tmp_path: Path) -> None:
    (tmp_path / FILE).write_bytes(b"1\t1\tNAV_ACC_RAD\t5\t9\n1\t1\tWV_E")
    texts: list[tuple[int, str]] = []
    desk = run(on_text=heard(texts))
    assert texts == [
        (
            mav.MAV_SEVERITY_WARNING,
            (
                f"{FILE}: line 2: expected NAME VALUE, or VEHICLE COMPONENT NAME VALUE TYPE, got '1\\t1\\tWV_E'; "
                f"set aside as {FILE}.bad, nothing in store"
            ),
        )
    ]
    parameters = desk.simulation.flight.parameters
    assert {name: parameters[name] for name in parameters.names()} == {
        name: Parameters()[name] for name in parameters.names()
    }
    assert (tmp_path / f"{FILE}.bad").read_bytes().endswith(b"WV_E")
    put(desk, "NAV_ACC_RAD", 6.0)
    assert run().simulation.flight.parameters["NAV_ACC_RAD"] == 6.0


def test_values_that_are_no_use_any_more_are_left_out_and_the_others_kept(run: Run, tmp_path: Path) -> None:
    (tmp_path / FILE).write_text("OLD_NAME 1\nNAV_ACC_RAD 5\nWV_EN 7\nSYS_AUTOSTART 1\n")
    texts: list[tuple[int, str]] = []
    desk = run(on_text=heard(texts))
    assert [text for _, text in texts] == [
        f"{FILE}: left out OLD_NAME: unknown parameter, expected one of the listed names (and 2 more)"
    ]
    assert desk.simulation.flight.parameters["NAV_ACC_RAD"] == 5.0
    desk.simulation.flight.parameters.set("RTL_TYPE", 2)
    run()
    assert stored(tmp_path) == {"NAV_ACC_RAD": 5.0, "RTL_TYPE": 2}


def test_a_disk_that_is_full_is_told_and_the_vehicle_flies_on_and_stores_later(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    desk = run()

    def full(name: str, _: bytes) -> None:
        raise StateError(f"{name}: No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(desk.face.state, "write", full)
        put(desk, "NAV_ACC_RAD", 5.0)
        desk.wait(1.0)
        assert "".join(m.text for m in desk.of("STATUSTEXT")) == (
            f"Parameters are not stored: {FILE}: No space left on device"
        )
        assert desk.command(STORAGE, 1).result == mav.MAV_RESULT_FAILED
    assert desk.simulation.flight.parameters["NAV_ACC_RAD"] == 5.0
    assert desk.face.internal_errors == 0
    put(desk, "RTL_RETURN_ALT", 50.0)
    desk.wait(1.0)
    assert stored(tmp_path) == {"NAV_ACC_RAD": 5.0, "RTL_RETURN_ALT": 50.0}


# -- MAV_CMD_PREFLIGHT_STORAGE -----------------------------------------------------------------------------------------


def test_write_stores_at_once_all_that_is_not_the_default(run: Run, tmp_path: Path) -> None:
    desk = run(Simulation(parameters={"NAV_ACC_RAD": 5.0}))
    assert not (tmp_path / FILE).exists()
    assert desk.command(STORAGE, 1, -1).result == mav.MAV_RESULT_ACCEPTED
    assert stored(tmp_path) == {"NAV_ACC_RAD": 5.0}
    assert run().simulation.flight.parameters["NAV_ACC_RAD"] == 5.0


def test_read_takes_what_is_in_the_file_and_tells_everybody(run: Run, tmp_path: Path) -> None:
    desk = run()
    (tmp_path / FILE).write_text("NAV_ACC_RAD 5\n")
    assert desk.command(STORAGE, 0).result == mav.MAV_RESULT_ACCEPTED
    assert desk.simulation.flight.parameters["NAV_ACC_RAD"] == 5.0
    assert [(m.param_id, m.param_value) for m in desk.of("PARAM_VALUE")] == [("NAV_ACC_RAD", 5.0)]
    (tmp_path / FILE).write_text("NAV_ACC_RAD\n")
    assert desk.command(STORAGE, 0).result == mav.MAV_RESULT_FAILED
    assert desk.simulation.flight.parameters["NAV_ACC_RAD"] == 5.0


@pytest.mark.parametrize("action", [2, 4])
def test_reset_gives_every_parameter_its_default_for_good(run: Run, tmp_path: Path, action: int) -> None:
    desk = run(Simulation(parameters={"MAV_SYS_ID": 9, "WV_EN": 1}))
    put(desk, "NAV_ACC_RAD", 5.0)
    desk.command(STORAGE, 1)
    desk.station.received.clear()
    assert desk.command(STORAGE, action).result == mav.MAV_RESULT_ACCEPTED
    kept = {"MAV_SYS_ID": 9} if action == 2 else {}  # the vehicle stays the one it is
    parameters = desk.simulation.flight.parameters
    assert {name: parameters[name] for name in parameters.names()} == {
        name: kept.get(name, Parameters()[name]) for name in parameters.names()
    }
    told = {message.param_id for message in desk.of("PARAM_VALUE")}
    assert told == {"NAV_ACC_RAD", "WV_EN"} | ({"MAV_SYS_ID"} - kept.keys())
    desk.wait(1.0)
    assert stored(tmp_path) == kept


@pytest.mark.parametrize("params", [(), (3,), (-1, 0), (math.nan, 1), (math.nan, math.nan, 1), (-1, -1)])
def test_what_asks_for_nothing_that_changes_is_accepted(run: Run, tmp_path: Path, params: tuple[float, ...]) -> None:
    desk = run()
    assert desk.command(STORAGE, *params).result == mav.MAV_RESULT_ACCEPTED
    assert not (tmp_path / FILE).exists()
    assert desk.of("PARAM_VALUE") == []


@pytest.mark.parametrize("params", [(5,), (-2,), (0.5,), (math.inf,), (1, 2), (1, 0.5), (1, -math.inf), (2, 3)])
def test_what_there_is_not_is_denied_with_the_reason_and_nothing_is_done(
    run: Run, tmp_path: Path, params: tuple[float, ...]
) -> None:
    desk = run(Simulation(parameters={"NAV_ACC_RAD": 5.0}))
    assert desk.command(STORAGE, *params).result == mav.MAV_RESULT_DENIED
    assert "".join(m.text for m in desk.of("STATUSTEXT")).startswith("PREFLIGHT_STORAGE param")
    assert desk.simulation.flight.parameters["NAV_ACC_RAD"] == 5.0
    assert not (tmp_path / FILE).exists()


def test_in_flight_parameters_are_only_written(run: Run, tmp_path: Path) -> None:
    desk = run(Simulation(start="trim:20", parameters={"NAV_ACC_RAD": 5.0}))
    for action in (0, 2, 4):
        assert desk.command(STORAGE, action).result == mav.MAV_RESULT_TEMPORARILY_REJECTED
    assert desk.command(STORAGE, 1).result == mav.MAV_RESULT_ACCEPTED
    assert stored(tmp_path) == {"NAV_ACC_RAD": 5.0}
    assert desk.simulation.flight.parameters["NAV_ACC_RAD"] == 5.0
