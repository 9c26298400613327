"""Log streaming: LOGGING_DATA, LOGGING_DATA_ACKED and LOGGING_ACK of https://mavlink.io/en/messages/common.html.

The receivers are written after that text: one joins what comes in order, the other finds its way after a loss by
first_message_offset.
"""

import io
import math
import random
import struct
from itertools import pairwise
from typing import Any

import pytest
from pyulog import ULog

from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.logging_stream import ACK_TIMEOUT, MOST_STREAMS, MOST_TRIES, NO_START, ROOM
from sitl.simulation import Simulation
from tests.sitl.mavlink.in_memory import Desk, Station

START, STOP = mav.MAV_CMD_LOGGING_START, mav.MAV_CMD_LOGGING_STOP
HEADER = 16  # bytes of a file before its first message


class Receiver:
    """Acknowledges what is to be acknowledged, and keeps every message once, in order of sequence."""

    def __init__(self, desk: Desk, station: Desk | Station) -> None:
        self.desk, self.station = desk, station
        self.seen = 0
        self.kept: dict[int, Any] = {}

    def take(self) -> None:
        """Look at what has come."""
        received = self.station.received
        while self.seen < len(received):
            message = received[self.seen]
            self.seen += 1
            kind = message.get_type()
            if kind in ("LOGGING_DATA", "LOGGING_DATA_ACKED"):
                self.kept.setdefault(message.sequence, message)
            if kind == "LOGGING_DATA_ACKED":
                self.station.send("LOGGING_ACK", sequence=message.sequence)

    def fly(self, seconds: float) -> None:
        """Let the vehicle fly, taking what comes."""
        for _ in range(round(seconds / 0.02)):
            self.desk.advance(0.02)
            self.take()

    def wait(self, seconds: float) -> None:
        """Let only wall time pass, taking what comes."""
        for _ in range(round(seconds / 0.01)):
            self.desk.wait(0.01)
            self.take()

    @property
    def in_order(self) -> list[Any]:
        return [self.kept[sequence] for sequence in sorted(self.kept)]

    def joined(self) -> bytes:
        """Everything, if nothing is missing."""
        assert sorted(self.kept) == list(range(len(self.kept)))
        return b"".join(bytes(message.data[: message.length]) for message in self.in_order)

    def mended(self) -> bytes:
        """Whole messages of the log around what is missing."""
        first = self.in_order[0]
        log, rest, expected = bytes(first.data[:HEADER]), b"", 1
        data, start = bytes(first.data[HEADER : first.length]), 0
        for message in [None, *self.in_order[1:]]:
            if message is not None:
                data, start = bytes(message.data[: message.length]), message.first_message_offset
                if message.sequence != expected:
                    rest = b""
                    if start == NO_START:
                        expected = message.sequence + 1
                        continue
                    data = data[start:]
                elif start != NO_START and start > 0:
                    assert (len(rest) + start) in whole_sizes(rest + data[:start])
                expected = message.sequence + 1
            rest += data
            size = max(whole_sizes(rest))
            log, rest = log + rest[:size], rest[size:]
        return log


def whole_sizes(data: bytes) -> list[int]:
    """After how many bytes messages of the log end in `data`, which begins with one."""
    sizes = [0]
    while len(data) - sizes[-1] >= 3:
        end = sizes[-1] + 3 + struct.unpack_from("<H", data, sizes[-1])[0]
        if end > len(data):
            break
        sizes.append(end)
    return sizes


def ulog(data: bytes) -> ULog:
    log = ULog(io.BytesIO(data))
    assert not log.file_corruption
    return log


def started(desk: Desk, station: Desk | Station) -> Receiver:
    receiver = Receiver(desk, station)
    assert station.command(START, 0).result == mav.MAV_RESULT_ACCEPTED
    return receiver


def texts(station: Desk | Station) -> str:
    return "".join(("" if message.chunk_seq else "\n") + message.text for message in station.of("STATUSTEXT"))


def test_the_stream_is_a_log_that_can_be_read_armed_or_not(desk: Desk) -> None:
    receiver = started(desk, desk)
    receiver.fly(3.0)
    desk.simulation.flight.arm()
    receiver.fly(2.0)
    log = ulog(receiver.joined())
    times = log.get_dataset("vehicle_attitude").data["timestamp"]
    assert len(set((times[1:] - times[:-1]).tolist())) == 1  # no row is missing
    assert times[-1] >= 4_900_000
    assert [state for _, state in log.get_dataset("vehicle_status").list_value_changes("arming_state")] == [1, 2]
    assert "Armed" in [text.message for text in log.logged_messages]
    assert set(log.initial_parameters) == set(desk.simulation.flight.parameters.names())


def test_all_before_the_data_is_acknowledged_and_nothing_after_it(desk: Desk) -> None:
    receiver = started(desk, desk)
    receiver.fly(2.0)
    acked, plain = desk.of("LOGGING_DATA_ACKED"), desk.of("LOGGING_DATA")
    assert [message.sequence for message in acked] == list(range(len(acked)))
    assert plain[0].sequence == len(acked)
    definitions = b"".join(bytes(message.data[: message.length]) for message in acked)
    kinds = [definitions[HEADER + end + 2 : HEADER + end + 3] for end in whole_sizes(definitions[HEADER:])]
    assert set(kinds[:-1]) == {b"B", b"F", b"I", b"P", b"A"}
    assert plain[0].data[2] == ord("D")


def test_every_message_says_where_the_first_message_of_the_log_begins(desk: Desk) -> None:
    receiver = started(desk, desk)
    receiver.fly(1.0)
    data = receiver.joined()
    starts = {0, *(HEADER + size for size in whole_sizes(data[HEADER:]))} - {HEADER}
    position = 0
    for message in receiver.in_order:
        within = [start - position for start in starts if position <= start < position + message.length]
        assert message.first_message_offset == min(within, default=NO_START)
        position += message.length
    offsets = {message.first_message_offset for message in receiver.in_order}
    assert NO_START in offsets
    assert len(offsets) > 10


def test_messages_name_their_receiver(desk: Desk) -> None:
    receiver = started(desk, desk.join(77, 88))
    receiver.fly(1.0)
    assert {(message.target_system, message.target_component) for message in receiver.in_order} == {(77, 88)}
    assert desk.of("LOGGING_DATA") == []


def test_what_is_not_acknowledged_is_sent_again_and_nothing_else_meanwhile(desk: Desk) -> None:
    assert desk.command(START, 0).result == mav.MAV_RESULT_ACCEPTED
    desk.wait(0.45)
    sent = desk.of("LOGGING_DATA_ACKED")
    assert {message.sequence for message in sent} == {0}
    assert len(sent) == pytest.approx(0.45 / ACK_TIMEOUT, abs=3)
    desk.send("LOGGING_ACK", sequence=5)  # of what was never sent
    assert {message.sequence for message in desk.of("LOGGING_DATA_ACKED")} == {0}
    desk.send("LOGGING_ACK", sequence=0)
    assert desk.of("LOGGING_DATA_ACKED")[-1].sequence == 1
    desk.send("LOGGING_ACK", sequence=0)  # once more: too late to mean anything
    desk.wait(0.2)
    assert desk.of("LOGGING_DATA_ACKED")[-1].sequence == 1
    assert desk.of("LOGGING_DATA") == []


def test_a_stream_that_is_never_acknowledged_ends_with_a_text(desk: Desk) -> None:
    desk.command(START, 0)
    desk.wait(2.0 * MOST_TRIES * ACK_TIMEOUT)
    assert len(desk.of("LOGGING_DATA_ACKED")) == MOST_TRIES
    assert f"Log stream ended: {MOST_TRIES} times no LOGGING_ACK 0" in texts(desk)


@pytest.mark.parametrize("seed", range(3))
def test_over_a_bad_link_definitions_come_whole_and_the_rest_can_be_mended(desk: Desk, seed: int) -> None:
    desk.station.random = random.Random(seed)
    desk.station.loss, desk.station.duplicates = 0.3, 0.2
    receiver = Receiver(desk, desk)
    while not (desk.of("COMMAND_ACK") or receiver.kept):
        desk.command(START, 0)
    receiver.fly(12.0)
    log = ulog(receiver.mended())
    assert set(log.initial_parameters) == set(desk.simulation.flight.parameters.names())
    rows = len(log.get_dataset("vehicle_attitude").data["timestamp"])
    assert 50 < rows < 12 * 50


def test_stopping_stops_it_and_starting_again_begins_from_the_beginning(desk: Desk) -> None:
    receiver = started(desk, desk)
    receiver.fly(1.0)
    assert desk.command(STOP).result == mav.MAV_RESULT_ACCEPTED
    count = len(desk.of("LOGGING_DATA"))
    receiver.fly(1.0)
    assert len(desk.of("LOGGING_DATA")) == count
    assert desk.command(STOP).result == mav.MAV_RESULT_ACCEPTED  # as it is already
    desk.command(START, 0)
    desk.advance(0.1)
    again = started(desk, desk)  # in the middle of the one just begun
    again.seen = next(i for i, message in enumerate(desk.received) if message is desk.of("COMMAND_ACK")[-1])
    again.fly(2.0)
    assert ulog(again.joined()).start_timestamp == 2_100_000


def test_two_stations_have_streams_of_their_own(desk: Desk) -> None:
    first = started(desk, desk)
    first.fly(1.0)
    second = started(desk, desk.join(254))
    for _ in range(50):
        first.fly(0.02)
        second.take()
    assert ulog(first.joined()).start_timestamp == 0
    assert ulog(second.joined()).start_timestamp == 1_000_000


def test_more_streams_than_are_good_for_the_vehicle_are_refused_for_now(desk: Desk) -> None:
    stations = [desk.join(100 + i) for i in range(MOST_STREAMS + 1)]
    results = [station.command(START, 0).result for station in stations]
    assert results == [mav.MAV_RESULT_ACCEPTED] * MOST_STREAMS + [mav.MAV_RESULT_TEMPORARILY_REJECTED]


@pytest.mark.parametrize("kind", [1.0, -1.0, 0.5, math.inf, -math.inf, 1e30])
def test_another_format_is_denied_with_what_was_expected(desk: Desk, kind: float) -> None:
    assert desk.command(START, kind).result == mav.MAV_RESULT_DENIED
    assert "log format: expected 0 (ULog)" in texts(desk)


def test_no_format_is_the_usual_one(desk: Desk) -> None:
    assert desk.command(START).result == mav.MAV_RESULT_ACCEPTED


def test_what_a_full_socket_leaves_no_room_for_is_dropped_whole_and_marked(desk: Desk) -> None:
    receiver = started(desk, desk)
    receiver.fly(2.0)
    desk.station.full = True
    desk.advance(1.5 * ROOM / (50 * 560))
    desk.station.full = False
    receiver.fly(2.0)
    log = ulog(receiver.joined())
    times = log.get_dataset("vehicle_attitude").data["timestamp"]
    gaps = times[1:] - times[:-1]
    (mark,) = log.dropouts
    assert (gaps > 20_000).sum() == 1
    assert mark.duration * 1e-3 == pytest.approx(gaps.max() * 1e-6, abs=0.1)


def test_a_stream_ends_when_the_vehicle_begins_anew(desk: Desk) -> None:
    receiver = started(desk, desk)
    receiver.fly(1.0)
    desk.face.request_restart()
    desk.turn()
    count = len(desk.of("LOGGING_DATA"))
    receiver.fly(1.0)
    assert len(desk.of("LOGGING_DATA")) == count
    assert "Log stream ended: the vehicle begins anew" in texts(desk)


def test_a_station_that_has_gone_is_streamed_to_no_more(desk: Desk) -> None:
    station = desk.join(254)
    receiver = started(desk, station)
    receiver.fly(1.0)
    del desk.links[0].stations[station.peer]
    desk.advance(1.0)
    assert desk.face.internal_errors == 0


def test_acknowledgements_of_anything_from_anybody_are_harmless() -> None:
    desk = Desk(Simulation(start="trim:20"))
    for system in (255, 254):
        station = desk.join(system)
        for sequence in (0, 1, 77, 0xFFFF):
            station.send("LOGGING_ACK", sequence=sequence)
    assert desk.face.internal_errors == 0
    desk.close()


def test_sequences_go_on_at_zero_after_their_last_number(desk: Desk) -> None:
    receiver = started(desk, desk)
    receiver.wait(4.0)
    assert desk.of("LOGGING_DATA_ACKED")
    sequences: list[int] = []
    for i in range(0x10000 + 300):
        desk.face.log.text(6, f"{i} ".ljust(237, "x"))  # fills one message
        if i % 100 == 0:
            desk.wait(0.04)
            sequences += [message.sequence for message in desk.of("LOGGING_DATA")]
            desk.received.clear()
    assert {(after - before) & 0xFFFF for before, after in pairwise(sequences)} == {1}
    assert 0xFFFF in sequences[:-1]
