"""Recordings of all traffic are read by pymavlink's own tools, and hold every message once."""

from pathlib import Path

import pytest
from pymavlink import mavutil

from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.tape import Tape, TapeError
from tests.sitl.mavlink.in_memory import Desk


def test_what_was_said_on_both_sides_is_on_the_tape_once_and_without_gaps(tmp_path: Path) -> None:
    path = tmp_path / "flight.tlog"
    desk = Desk(tape=Tape(path))
    other = desk.join(250, 190)
    desk.advance(2.0)
    assert desk.command(mav.MAV_CMD_RUN_PREARM_CHECKS).result == 0
    other.send("PING", target_system=0, target_component=0, seq=7)
    attitudes = len(desk.of("ATTITUDE"))
    desk.close()
    log = mavutil.mavlogfile(str(path))
    kinds: dict[str, int] = {}
    while (message := log.recv_msg()) is not None:
        kinds[message.get_type()] = kinds.get(message.get_type(), 0) + 1
    log.close()
    # Newer messages than pymavlink's own are known to our dialect alone; each frame follows its time.
    data, sequences, place = path.read_bytes(), list[int](), 0
    while place < len(data):
        frame = place + 8
        place = frame + 12 + data[frame + 1]
        if data[frame + 5] == 1:
            sequences.append(data[frame + 4])
    assert kinds["ATTITUDE"] == attitudes
    assert (kinds["COMMAND_LONG"], kinds["COMMAND_ACK"]) == (1, 1)
    assert kinds["PING"] >= 2
    assert sequences == [number % 256 for number in range(len(sequences))]


def test_keys_are_not_on_the_tape(tmp_path: Path) -> None:
    path = tmp_path / "flight.tlog"
    desk = Desk(tape=Tape(path))
    key = bytes(range(100, 132))
    desk.send("SETUP_SIGNING", secret_key=list(key))
    desk.close()
    assert key not in path.read_bytes()


def test_a_place_that_cannot_be_written_is_one_clear_line(tmp_path: Path) -> None:
    with pytest.raises(TapeError, match="expected a file to write to, got Is a directory"):
        Tape(tmp_path)
