"""A flight log, read by pyulog, says what the simulation's own history says, and leaves the flight alone."""

import math
import resource
import threading
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from sitl import Simulation
from sitl.flight.refused import Refused
from sitl.flight_log import flight_log
from sitl.flight_log.flight_log import AFTER, BEFORE, MOST_RECENT, FlightLog, rate_for
from sitl.flight_log.folder import LogFolder
from tests.sitl.flight_log.reading import hop, only_log, poll, texts_of, ulog


def test_the_flight_is_the_same_with_and_without_a_log(logged: Callable[..., tuple[Simulation, FlightLog]]) -> None:
    simulation, _ = logged(rate=50)
    alone = Simulation()
    for each in (simulation, alone):
        hop(each)
    assert simulation.tick == alone.tick
    assert (simulation.state == alone.state).all()


def test_each_flight_has_a_log_of_its_own_with_another_number_and_time(
    logged: Callable[..., tuple[Simulation, FlightLog]],
) -> None:
    simulation, log = logged(start="trim:20")
    for _ in range(3):  # all begin at simulated time zero
        simulation.reset("trim:20")
        simulation.advance(1.0)
    log.close()
    logs = log.folder.logs()
    assert [file.number for file in logs] == [1, 2, 3]
    assert len({file.utc for file in logs}) == 3
    for file in logs:
        times = ulog(file.path).get_dataset("vehicle_attitude").data["timestamp"]
        assert (times[0], times[-1]) == (0, 1_000_000)


def test_logs_of_earlier_runs_stay_and_are_counted_on(tmp_path: Path) -> None:
    for _ in range(2):
        simulation = Simulation(start="trim:20")
        log = FlightLog(simulation, tmp_path, unix_epoch=1.8e9)
        simulation.advance(0.5)
        log.close()
    assert [(file.number, file.utc) for file in LogFolder(tmp_path).logs()] == [(1, 1_800_000_000), (2, 1_800_000_001)]


def test_a_log_in_progress_is_a_log_already(logged: Callable[..., tuple[Simulation, FlightLog]]) -> None:
    simulation, log = logged(start="trim:20")
    simulation.advance(3.0)
    log.flush()
    poll(lambda: [ulog(file.path).last_timestamp for file in log.folder.logs()] == [3_000_000])


def test_a_long_flight_goes_on_in_another_file(
    logged: Callable[..., tuple[Simulation, FlightLog]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(flight_log, "MOST_BYTES", 120_000)
    monkeypatch.setattr(flight_log, "PIECE", 8_000)
    simulation, log = logged(rate=50, start="trim:20")
    simulation.advance(10.0)
    log.close()
    logs = log.folder.logs()
    assert len(logs) > 1
    assert all(file.size <= 120_000 for file in logs)
    times = [ulog(file.path).get_dataset("vehicle_attitude").data["timestamp"] for file in logs]
    assert np.concatenate(times).tolist() == list(range(0, 10_000_001, 20_000))
    assert all(
        ulog(file.path).get_dataset("vehicle_status").data["timestamp"][0] == t[0]
        for file, t in zip(logs, times, strict=True)
    )


def test_an_outside_controllers_flight_is_logged_while_a_motor_turns(
    logged: Callable[..., tuple[Simulation, FlightLog]],
) -> None:
    simulation, log = logged(autopilot=False)
    controls = simulation.controls
    for throttle, seconds in ((0.0, 4.0), (0.1, 3.0), (0.0, 4.0)):
        controls[0] = throttle
        simulation.set_controls(controls)
        simulation.advance(seconds)
    file = only_log(log)
    times = file.get_dataset("actuator_motors").data["timestamp"] * 1e-6
    assert (times[0], times[-1]) == pytest.approx((4.0 - BEFORE, 7.0 + AFTER), abs=0.2)
    assert [state for _, state in file.get_dataset("vehicle_status").list_value_changes("arming_state")] == [1, 2, 1]
    assert file.initial_parameters == {}
    assert (file.get_dataset("battery_status").data["remaining"] == -1.0).all()


def test_who_follows_the_log_gets_all_of_it_in_flight_or_not(
    logged: Callable[..., tuple[Simulation, FlightLog]],
) -> None:
    simulation, log = logged()
    simulation.advance(1.0)
    pieces: list[bytes] = []
    pieces.append(log.follow(pieces.append))
    simulation.advance(1.0)
    log.leave(pieces.append)
    log.leave(pieces.append)
    simulation.advance(1.0)
    file = ulog(b"".join(pieces))
    times = file.get_dataset("vehicle_attitude").data["timestamp"]
    assert (times[0], times[-1], len(times)) == (1_100_000, 2_000_000, 10)
    assert file.get_dataset("vehicle_status").data["timestamp"][0] == 1_100_000
    assert log.folder.logs() == []


def test_a_full_disk_ends_logging_with_one_text_and_the_flight_goes_on(
    logged: Callable[..., tuple[Simulation, FlightLog]],
) -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    simulation, log = logged(rate=50, start="trim:20")
    heard = texts_of(simulation)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, hard))
    try:
        assert simulation.run_until(lambda _: any("Logging" in text for text in heard), 600.0)
        simulation.advance(20.0)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    log.close()
    assert heard == ["Logging ended: File too large"]
    assert simulation.flight.armed
    (file,) = log.folder.logs()
    assert len(ulog(file.path).get_dataset("vehicle_attitude").data["timestamp"]) > 50  # up to there


def test_a_folder_that_cannot_be_had_ends_logging_with_one_text(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    simulation = Simulation(start="trim:20")
    log = FlightLog(simulation, tmp_path / "file" / "logs")
    heard = texts_of(simulation)
    assert simulation.run_until(lambda _: bool(heard), 600.0)
    simulation.reset("trim:20")
    simulation.advance(10.0)
    log.close()
    assert heard == ["Logging ended: Not a directory"]


def test_what_a_slow_disk_has_no_room_for_is_dropped_and_marked(
    logged: Callable[..., tuple[Simulation, FlightLog]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(flight_log, "PIECE", 16_000)
    monkeypatch.setattr("sitl.flight_log.writer.ROOM", 60_000)
    simulation, log = logged(rate=50, start="trim:20")
    disk = threading.Event()
    make_room = log.folder.make_room

    def wait_and_make_room(size: int) -> None:
        disk.wait()
        make_room(size)

    monkeypatch.setattr(log.folder, "make_room", wait_and_make_room)
    simulation.advance(20.0)
    assert log.dropped > 0
    disk.set()
    poll(lambda: log.folder.logs() and log.folder.logs()[0].size > 40_000)
    simulation.advance(4.0)
    file = only_log(log)
    times = file.get_dataset("vehicle_attitude").data["timestamp"]
    gaps = np.diff(times)
    (mark,) = file.dropouts
    assert (gaps > 20_000).sum() == 1
    assert mark.duration * 1e-3 == pytest.approx(gaps.max() * 1e-6, abs=1.0)


def test_erasing_is_refused_while_armed_and_mends_what_had_ended(
    logged: Callable[..., tuple[Simulation, FlightLog]],
) -> None:
    simulation, log = logged(start="trim:20")
    simulation.advance(1.0)
    with pytest.raises(Refused, match="while armed"):
        log.erase()
    simulation.reset("ground")
    simulation.advance(1.0)
    log.erase()
    assert log.folder.logs() == []
    simulation.flight.arm()
    simulation.advance(1.0)
    log.close()
    assert [file.number for file in log.folder.logs()] == [2]


def test_a_closed_log_follows_no_more(logged: Callable[..., tuple[Simulation, FlightLog]]) -> None:
    simulation, log = logged(start="trim:20")
    simulation.advance(1.0)
    log.close()
    simulation.advance(5.0)
    assert only_log(log).last_timestamp == 1_000_000


def test_texts_without_end_before_arming_take_no_memory(logged: Callable[..., tuple[Simulation, FlightLog]]) -> None:
    simulation, log = logged()
    for i in range(10_000):
        log.text(6, f"text {i}")
    simulation.flight.arm()
    simulation.advance(1.0)
    texts = [text.message for text in only_log(log).logged_messages]
    assert len(texts) <= MOST_RECENT + 1
    assert "text 9999" in texts


@pytest.mark.parametrize(("speed", "rate"), [(0.5, 50), (1.0, 50), (100.0, 10), (math.inf, 10)])
def test_rows_are_fewer_at_high_speed(speed: float, rate: int) -> None:
    assert rate_for(speed) == rate


def test_a_rate_that_does_not_divide_the_updates_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="log rate: expected one of 10, 25, 50 Hz, got 30"):
        FlightLog(Simulation(), tmp_path, rate=30)
