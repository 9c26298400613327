"""Log transfer: LOG_* of https://mavlink.io/en/messages/common.html, and what the clients that use them expect."""

import io
import random
from collections.abc import Iterator

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pyulog import ULog

from sitl.flight_log.folder import MOST_LOGS, LogFolder
from sitl.mavlink.codec import codec
from sitl.mavlink.identity import ARDUPILOT, PX4, Identity
from sitl.mavlink.log import FASTEST, PATIENCE, data_payload
from sitl.simulation import Simulation
from tests.sitl.mavlink.in_memory import Desk, MemoryLink, Station
from tests.sitl.mavlink.log_station import (
    PIECE,
    all_gaps_at_once,
    entries,
    keep,
    pieces,
    put_together,
    window_by_window,
)

ALL = 0xFFFFFFFF
SIZES = (0, 1, 89, 90, 91, 180, 10_000, 10_080)


def noise(size: int, seed: int = 0) -> bytes:
    """Content of a log, zeros and all."""
    return random.Random(seed).randbytes(size // 2).ljust(size, b"\0")


def texts(station: Desk | Station) -> str:
    return "".join(("" if message.chunk_seq else "\n") + message.text for message in station.of("STATUSTEXT"))


def whole(messages: dict[int, bytes]) -> bytes:
    """All of a log, from the beginning without a gap."""
    content = b"".join(messages[offset] for offset in sorted(messages))
    assert sorted(messages) == list(range(0, len(content) + 1, PIECE))[: len(messages)]
    return content


def test_without_logs_there_is_one_entry_that_says_so(desk: Desk) -> None:
    (entry,) = entries(desk)
    assert (entry.id, entry.num_logs, entry.last_log_num, entry.time_utc, entry.size) == (0, 0, 0, 0, 0)


@pytest.mark.parametrize(("identity", "first"), [(PX4, 0), (ARDUPILOT, 1)])
def test_logs_are_counted_by_age_from_where_ground_stations_expect_it(identity: Identity, first: int) -> None:
    desk = Desk(identity=identity)
    keep(desk, b"1", b"22", b"333")
    listed = entries(desk)
    assert [entry.id for entry in listed] == [first, first + 1, first + 2]
    assert [entry.size for entry in listed] == [1, 2, 3]
    assert {(entry.num_logs, entry.last_log_num) for entry in listed} == {(3, first + 2)}
    assert [entry.time_utc for entry in listed] == [1_700_000_000, 1_700_000_001, 1_700_000_002]
    (data,) = pieces(desk, desk, first + 1, 0, ALL)
    assert bytes(data.data[: data.count]) == b"22"
    desk.close()


@pytest.mark.parametrize(
    ("start", "end", "ids"),
    [(1, 1, [1]), (1, 2, [1, 2]), (3, 0xFFFF, [3]), (9, 0xFFFF, [3]), (2, 0, [2]), (0xFFFF, 0xFFFF, [3])],
)
def test_part_of_the_list_can_be_asked_for(desk: Desk, start: int, end: int, ids: list[int]) -> None:
    keep(desk, *[b"x"] * 4)
    assert [entry.id for entry in entries(desk, start, end)] == ids


def test_a_hundred_logs_are_listed_at_once(desk: Desk) -> None:
    keep(desk, *[b"x"] * MOST_LOGS)
    assert [entry.id for entry in entries(desk)] == list(range(MOST_LOGS))


@pytest.mark.parametrize("size", SIZES)
def test_a_log_comes_in_full_pieces_and_ends_with_one_that_is_not(desk: Desk, size: int) -> None:
    keep(desk, noise(size))
    sent = pieces(desk, desk, 0, 0, ALL)
    assert [message.ofs for message in sent] == list(range(0, size + 1, PIECE))
    assert [message.count for message in sent] == [PIECE] * (size // PIECE) + [size % PIECE]
    assert whole(put_together(sent)) == noise(size)
    assert all(message.id == 0 for message in sent)


@pytest.mark.parametrize(("ofs", "count"), [(0, 90), (90, 180), (7, 100), (9_990, 10), (0, 10_000), (450, 1)])
def test_a_part_that_is_there_is_sent_exactly(desk: Desk, ofs: int, count: int) -> None:
    keep(desk, noise(10_000))
    sent = pieces(desk, desk, 0, ofs, count)
    assert [message.ofs for message in sent] == list(range(ofs, ofs + count, PIECE))
    content = b"".join(bytes(message.data[: message.count]) for message in sent)
    assert content == noise(10_000)[ofs : ofs + count]


@pytest.mark.parametrize(("ofs", "count"), [(10_000, 90), (10_001, 1), (ALL, ALL), (ALL, 0), (50, 0), (0, 0)])
def test_where_there_is_nothing_an_empty_piece_says_so(desk: Desk, ofs: int, count: int) -> None:
    keep(desk, noise(10_000))
    (sent,) = pieces(desk, desk, 0, ofs, count)
    assert (sent.ofs, sent.count) == (ofs, 0)


@pytest.mark.parametrize("log", [1, 2, 0xFFFF])
def test_a_log_there_is_not_is_empty_and_a_text_says_what_there_is(desk: Desk, log: int) -> None:
    keep(desk, b"x")
    (sent,) = pieces(desk, desk, log, 0, ALL)
    assert (sent.id, sent.ofs, sent.count) == (log, 0, 0)
    assert f"Log {log}: expected one of 1, from 0" in texts(desk)


def test_a_log_that_has_gone_since_is_empty_and_a_text_says_so(desk: Desk) -> None:
    keep(desk, b"x")
    entries(desk)
    LogFolder(desk.face.state.logs).erase()
    (sent,) = pieces(desk, desk, 0, 0, ALL)
    assert sent.count == 0
    assert "Log 0: No such file or directory" in texts(desk)


def test_the_end_of_a_request_is_heeded(desk: Desk) -> None:
    keep(desk, noise(1_000_000))
    desk.send("LOG_REQUEST_DATA", id=0, ofs=0, count=ALL)
    desk.wait(0.01)
    desk.send("LOG_REQUEST_END")
    count = len(desk.of("LOG_DATA"))
    assert 0 < count < 1_000_000 // PIECE
    desk.wait(0.1)
    assert len(desk.of("LOG_DATA")) == count


@pytest.mark.parametrize(("log", "ofs", "count"), [(0, 9_000, 90), (1, 90, 90), (0, 0, 900_000)])
def test_another_request_takes_the_place_of_the_one_before(desk: Desk, log: int, ofs: int, count: int) -> None:
    keep(desk, noise(1_000_000), noise(1_000_000, 1))
    desk.send("LOG_REQUEST_DATA", id=0, ofs=90_000, count=ALL)
    desk.wait(0.001)
    sent = pieces(desk, desk, log, ofs, count, 1.0)
    assert [message.ofs for message in sent] == list(range(ofs, ofs + count, PIECE))
    assert {message.id for message in sent} == {log}


def test_gaps_asked_for_in_one_go_are_all_filled(desk: Desk) -> None:
    keep(desk, noise(100_000))
    gaps = [90, 1800, 99_900, 45_000]
    for gap in gaps[:-1]:
        desk.send("LOG_REQUEST_DATA", id=0, ofs=gap, count=90)
    pieces(desk, desk, 0, gaps[-1], 9_000)
    assert {message.ofs for message in desk.of("LOG_DATA")} == {*gaps, *range(45_000, 54_000, 90)}


def test_two_stations_download_at_the_same_time_different_logs_and_the_same(desk: Desk) -> None:
    keep(desk, noise(200_000), noise(200_000, 1))
    other = desk.join(254)
    for first, second in ((0, 1), (1, 1)):
        before = len(desk.of("LOG_DATA")), len(other.of("LOG_DATA"))
        desk.send("LOG_REQUEST_DATA", id=first, ofs=0, count=ALL)
        other.send("LOG_REQUEST_DATA", id=second, ofs=0, count=ALL)
        desk.wait(0.5)
        assert whole(put_together(desk.of("LOG_DATA")[before[0] :])) == noise(200_000, first)
        assert whole(put_together(other.of("LOG_DATA")[before[1] :])) == noise(200_000, second)


def test_stations_with_the_same_ids_on_two_links_do_not_disturb_each_other() -> None:
    desk = Desk(links=[MemoryLink("a"), MemoryLink("b")])
    keep(desk, noise(200_000))
    twin = desk.join(link=1)
    for station in (desk, twin):
        station.send("LOG_REQUEST_DATA", id=0, ofs=0, count=ALL)
    desk.wait(0.5)
    for station in (desk, twin):
        assert whole(put_together(station.of("LOG_DATA"))) == noise(200_000)
    desk.close()


def test_a_socket_that_is_full_for_a_while_misses_nothing(desk: Desk) -> None:
    keep(desk, noise(200_000))
    desk.station.full = True
    desk.send("LOG_REQUEST_LIST", start=0, end=0xFFFF)
    desk.send("LOG_REQUEST_DATA", id=0, ofs=0, count=ALL)
    for _ in range(10):
        desk.station.full = not desk.station.full
        desk.wait(0.01)
    desk.station.full = False
    desk.wait(1.0)
    assert [entry.size for entry in desk.of("LOG_ENTRY")] == [200_000]
    sent = desk.of("LOG_DATA")
    assert [message.ofs for message in sent] == list(range(0, 200_001, PIECE))
    assert whole(put_together(sent)) == noise(200_000)


def test_a_station_whose_socket_takes_nothing_is_given_up(desk: Desk) -> None:
    keep(desk, noise(200_000))
    desk.send("LOG_REQUEST_DATA", id=0, ofs=0, count=ALL)
    desk.station.full = True
    desk.wait(PATIENCE + 1.0)
    desk.station.full = False
    count = len(desk.of("LOG_DATA"))
    desk.wait(1.0)
    assert len(desk.of("LOG_DATA")) == count


def test_data_flow_at_least_at_3_megabytes_per_second_and_no_faster_than_they_should(desk: Desk) -> None:
    size = 3_000_000
    keep(desk, noise(size))
    desk.send("LOG_REQUEST_DATA", id=0, ofs=0, count=ALL)
    begin = desk.wall
    while len(desk.of("LOG_DATA")) <= size // PIECE:
        desk.wait(0.01)
        assert desk.wall < begin + 1.0
    assert 3e6 <= size / (desk.wall - begin) <= 1.05 * FASTEST


@pytest.mark.parametrize(("lost", "slower"), [(9_000, False), (270_000, True)])
def test_who_comes_back_for_much_is_sent_less_at_a_time(desk: Desk, lost: int, slower: bool) -> None:
    keep(desk, noise(3_000_000))

    def speed() -> float:
        before = len(desk.of("LOG_DATA"))
        desk.send("LOG_REQUEST_DATA", id=0, ofs=0, count=ALL)
        desk.wait(0.1)
        return (len(desk.of("LOG_DATA")) - before) * PIECE / 0.1

    first = speed()
    desk.wait(0.5)
    pieces(desk, desk, 0, 90, lost, 0.2)
    assert (speed() < 0.7 * first) is slower


@pytest.mark.parametrize("seed", range(4))
def test_whole_logs_come_over_a_link_that_loses_and_doubles_a_third(desk: Desk, seed: int) -> None:
    content = noise(50_000, seed)
    keep(desk, content)
    desk.station.random = random.Random(seed)
    desk.station.loss, desk.station.duplicates = 0.3, 0.2
    if seed % 2:
        assert all_gaps_at_once(desk, desk.station, 0) == content
    else:
        assert window_by_window(desk, desk.station, 0, len(content)) == content


def test_erasing_is_refused_while_armed_with_a_reason(desk: Desk) -> None:
    keep(desk, b"x")
    desk.simulation.flight.arm()
    desk.advance(0.2)
    desk.send("LOG_ERASE")
    assert "Logs are not erased while armed" in texts(desk)
    assert entries(desk)[0].size == 1


def test_erasing_leaves_no_log_and_ends_transfers(desk: Desk) -> None:
    keep(desk, noise(1_000_000), b"x")
    other = desk.join(254)
    other.send("LOG_REQUEST_DATA", id=0, ofs=0, count=ALL)
    desk.send("LOG_ERASE")
    assert "Logs erased" in texts(desk)
    count = len(other.of("LOG_DATA"))
    desk.wait(0.1)
    assert len(other.of("LOG_DATA")) == count
    assert [entry.num_logs for entry in entries(desk)] == [0]
    assert list(desk.face.state.logs.iterdir()) == []


def test_ids_stay_when_there_is_another_log_and_each_stations_mean_what_it_was_listed(desk: Desk) -> None:
    keep(desk, b"old", b"newer")
    other = desk.join(254)
    assert [(entry.id, entry.size) for entry in entries(other)] == [(0, 3), (1, 5)]
    keep(desk, b"newest")
    assert [(entry.id, entry.size) for entry in entries(desk)] == [(0, 3), (1, 5), (2, 6)]
    LogFolder(desk.face.state.logs).logs()[0].path.unlink()  # the oldest has gone, to make room
    assert [(entry.id, entry.size) for entry in entries(desk)] == [(0, 5), (1, 6)]
    (sent,) = pieces(desk, other, 1, 0, ALL)
    assert bytes(sent.data[: sent.count]) == b"newer"
    (sent,) = pieces(desk, desk, 1, 0, ALL)
    assert bytes(sent.data[: sent.count]) == b"newest"


def test_the_log_of_the_flight_under_way_is_listed_and_can_be_read() -> None:
    desk = Desk(Simulation(start="trim:20"))
    desk.advance(5.0)
    entries(desk)  # has what there is brought to the disk
    desk.advance(0.2)
    entry = entries(desk)[0]
    assert entry.num_logs == 1
    content = window_by_window(desk, desk.station, entry.id, entry.size)
    log = ULog(io.BytesIO(content))
    assert not log.file_corruption
    assert 4_500_000 <= log.last_timestamp <= 5_200_000
    desk.advance(5.0)
    desk.close()


@given(offset=st.integers(0, ALL), data=st.binary(max_size=PIECE), log=st.integers(0, 0xFFFF))
def test_pieces_are_packed_as_the_codec_would(offset: int, data: bytes, log: int) -> None:
    values = (log, offset, len(data), *data.ljust(PIECE, b"\0"))
    assert data_payload(log, offset, data) == codec("LOG_DATA").payload(values)


@pytest.fixture(scope="module")
def stocked() -> Iterator[Desk]:
    """A vehicle with three logs, flying."""
    desk = Desk(Simulation(start="trim:20"))
    keep(desk, *(noise(size, size) for size in (10_000, 0, 9_000)))
    yield desk
    desk.close()


number = st.one_of(st.integers(0, 12_000), st.integers(0, ALL), st.sampled_from([0, 1, ALL - 1, ALL, 1 << 31]))


@settings(max_examples=300, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.lists(
        st.one_of(
            st.tuples(st.just("LOG_REQUEST_DATA"), st.integers(0, 5) | st.integers(0, 0xFFFF), number, number),
            st.tuples(st.just("LOG_REQUEST_LIST"), st.integers(0, 0xFFFF), st.integers(0, 0xFFFF)),
            st.tuples(st.just("LOG_REQUEST_END")),
        ),
        min_size=1,
        max_size=6,
    ),
    st.integers(240, 250),
)
def test_any_request_is_answered_with_what_is_in_the_log_or_nothing(
    stocked: Desk, requests: list[tuple[str, int, int, int]], system: int
) -> None:
    contents = [noise(size, size) for size in (10_000, 0, 9_000)]
    station = stocked.join(system)
    for name, *values in requests:
        fields = ("start", "end") if name == "LOG_REQUEST_LIST" else ("id", "ofs", "count")
        station.send(name, **dict(zip(fields, values, strict=False)))
    stocked.wait(0.02)
    for message in station.of("LOG_DATA"):
        expected = contents[message.id] if message.id < 3 else b""
        if message.id != 3:  # that is the log of the present flight
            assert bytes(message.data[: message.count]) == expected[message.ofs : message.ofs + message.count]
    if requests[-1][0] == "LOG_REQUEST_DATA":
        assert station.of("LOG_DATA")
    assert stocked.face.internal_errors == 0
