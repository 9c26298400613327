"""File transfer over time: sessions of several clients, bursts, and requests that come twice or late."""

import random
from pathlib import Path

import pytest

from sitl.mavlink.ftp_sessions import SESSIONS_EACH
from tests.sitl.mavlink.ftp_client import Answer, FtpClient, errors, opcodes
from tests.sitl.mavlink.in_memory import Desk


@pytest.fixture
def client(desk: Desk) -> FtpClient:
    return FtpClient(desk)


@pytest.fixture
def files(desk: Desk) -> Path:
    return desk.face.state.files


def content(size: int) -> bytes:
    return random.Random(size).randbytes(size)


# -- sessions ----------------------------------------------------------------------------------------------------------


def test_several_files_are_open_at_once(client: FtpClient, files: Path) -> None:
    for name in "abc":
        (files / name).write_bytes(name.encode())
    sessions = [client.done(opcodes.OPEN, name.encode()).session for name in "abc"]
    assert len(set(sessions)) == 3
    for name, session in zip("abc", sessions, strict=True):
        assert client.done(opcodes.READ, session=session, size=10).data == name.encode()


def test_a_session_gets_the_number_that_its_client_names(client: FtpClient, files: Path) -> None:
    (files / "a").touch()
    for number in (200, 3, 255):
        assert client.done(opcodes.OPEN, b"/a", session=number).session == number


def test_more_sessions_than_there_are_are_refused_until_one_ends(client: FtpClient, files: Path) -> None:
    (files / "a").touch()
    last = [client.done(opcodes.OPEN, b"/a") for _ in range(SESSIONS_EACH)][-1]
    assert client.ask(opcodes.OPEN, b"/a").error == errors.NO_SESSIONS
    client.done(opcodes.TERMINATE, session=last.session)
    client.done(opcodes.OPEN, b"/a")


def test_a_session_long_silent_makes_room(desk: Desk, client: FtpClient, files: Path) -> None:
    (files / "a").touch()
    for number in range(SESSIONS_EACH):
        client.done(opcodes.OPEN, b"/a", session=number)
    desk.wait(31.0)
    client.ask(opcodes.READ, session=0, size=1)
    assert client.done(opcodes.OPEN, b"/a", session=100).session == 100
    assert client.ask(opcodes.READ, session=0, size=1).error == errors.EOF  # not this one, which was used
    assert client.ask(opcodes.READ, session=1, size=1).error == errors.SESSION


def test_clients_do_not_see_each_others_sessions(desk: Desk, client: FtpClient, files: Path) -> None:
    (files / "a").write_bytes(b"1")
    other = FtpClient(desk, desk.join(system=255, component=191))
    session = client.done(opcodes.OPEN, b"/a").session
    assert other.ask(opcodes.READ, session=session, size=1).error == errors.SESSION
    other.done(opcodes.RESET)
    assert client.done(opcodes.READ, session=session, size=1).data == b"1"


def test_what_is_not_open_cannot_be_read_written_or_ended(client: FtpClient, files: Path) -> None:
    (files / "a").touch()
    for opcode in (opcodes.READ, opcodes.WRITE, opcodes.BURST, opcodes.TERMINATE):
        assert client.ask(opcode, session=9).error == errors.SESSION
    session = client.done(opcodes.OPEN, b"/a").session
    client.done(opcodes.TERMINATE, session=session)
    assert client.ask(opcodes.READ, session=session, size=1).error == errors.SESSION
    assert client.ask(opcodes.TERMINATE, session=session).error == errors.SESSION


def test_reset_ends_all_sessions_of_a_client(client: FtpClient, files: Path) -> None:
    (files / "a").touch()
    for _ in range(3):
        client.done(opcodes.OPEN, b"/a")
    client.done(opcodes.RESET)
    for number in range(3):
        assert client.ask(opcodes.READ, session=number, size=1).error == errors.SESSION


# -- bursts ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("size", [0, 1, 238, 239, 240, 239 * 246, 239 * 246 + 1, 200_000])
def test_bursts_bring_a_file_of_any_length(client: FtpClient, files: Path, size: int) -> None:
    (files / "a").write_bytes(content(size))
    assert client.get_by_bursts(b"/a") == content(size)


@pytest.mark.parametrize("each", [1, 80, 110, 239])
def test_a_burst_is_cut_into_parts_of_the_size_asked_for(client: FtpClient, files: Path, each: int) -> None:
    (files / "a").write_bytes(content(3000))
    session = client.done(opcodes.OPEN, b"/a").session
    parts = client.request(opcodes.BURST, session=session, size=each)
    assert {part.size for part in parts[:-1]} <= {each}
    assert client.get_by_bursts(b"/a", each) == content(3000)


def test_a_burst_of_no_size_comes_in_the_largest_parts(client: FtpClient, files: Path) -> None:
    (files / "a").write_bytes(content(500))
    session = client.done(opcodes.OPEN, b"/a").session
    parts = client.request(opcodes.BURST, session=session, size=0)
    assert [part.size for part in parts] == [239, 239, 22]


def test_data_that_ends_with_zeros_comes_whole(client: FtpClient, files: Path) -> None:
    (files / "a").write_bytes(bytes(1000))
    assert client.get(b"/a") == client.get_by_bursts(b"/a") == bytes(1000)


def test_a_socket_that_takes_no_more_is_tried_again_and_nothing_is_lost(
    desk: Desk, client: FtpClient, files: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (files / "a").write_bytes(content(50_000))
    session = client.done(opcodes.OPEN, b"/a").session
    taken = 0
    take = client.station.take

    def narrow(data: bytes) -> bool:
        nonlocal taken
        taken += 1
        return taken % 7 != 0 and take(data)

    monkeypatch.setattr(client.station, "take", narrow)
    parts = client.request(opcodes.BURST, session=session, size=239)
    while not parts or not parts[-1].complete:
        desk.wait(0.01)
        parts += client.answers()
    assert b"".join(part.data for part in parts) == content(50_000)
    assert [part.sequence for part in parts] == list(range(client.sequence, client.sequence + len(parts)))


def test_a_burst_that_nobody_takes_is_given_up(desk: Desk, client: FtpClient, files: Path) -> None:
    (files / "a").write_bytes(content(1000))
    session = client.done(opcodes.OPEN, b"/a").session
    client.station.full = True
    assert client.request(opcodes.BURST, session=session, size=239) == []
    desk.wait(3.0)
    client.station.full = False
    desk.wait(1.0)
    assert client.answers() == []


def test_all_bursts_together_keep_to_their_rate(desk: Desk, files: Path) -> None:
    (files / "a").write_bytes(content(1 << 20))
    clients = [FtpClient(desk, desk.join(system=10 + number)) for number in range(4)]
    sessions = [client.done(opcodes.OPEN, b"/a").session for client in clients]
    wanted = [0] * len(clients)
    begin = desk.wall
    parts: list[list[Answer]] = [[] for _ in clients]
    for number, client in enumerate(clients):
        parts[number] = client.request(opcodes.BURST, session=sessions[number], size=239)
    while desk.wall - begin < 0.05:
        for number, client in enumerate(clients):
            wanted[number] += sum(part.size for part in parts[number])
            if parts[number] and parts[number][-1].complete:
                offset = wanted[number]
                parts[number] = client.request(opcodes.BURST, session=sessions[number], offset=offset, size=239)
            else:
                parts[number] = client.answers()
        desk.wait(0.001)
    assert 0.6 * 32e6 * 0.05 < sum(wanted) < 32e6 * 0.05 + 2 * (1 << 16)
    assert min(wanted) > 0.5 * max(wanted)


# -- retransmissions ---------------------------------------------------------------------------------------------------


def test_a_request_come_twice_is_answered_twice_and_carried_out_once(client: FtpClient, files: Path) -> None:
    (files / "a").touch()
    (files / "d").mkdir()
    for opcode, data in (
        (opcodes.OPEN, b"/a"),
        (opcodes.TERMINATE, b""),
        (opcodes.RENAME, b"/a\0/b"),
        (opcodes.REMOVE, b"/b"),
        (opcodes.REMOVE_DIRECTORY, b"/d"),
        (opcodes.MAKE_DIRECTORY, b"/e"),
        (opcodes.CREATE, b"/c"),
    ):
        first = client.done(opcode, data)
        assert client.ask(opcode, data, sequence=client.sequence - 1) == first
    assert len([one for one in client.desk.face.services if type(one).__name__ == "FtpService"]) == 1


def test_what_came_late_does_not_harm_what_was_done_since(client: FtpClient, files: Path) -> None:
    """A network that doubles and delays datagrams brings old requests among new ones."""
    client.done(opcodes.CREATE, b"/a")
    client.done(opcodes.WRITE, b"12345", offset=0)
    client.done(opcodes.CREATE, b"/a", sequence=0)
    assert (files / "a").read_bytes() == b"12345"
    client.done(opcodes.TERMINATE)  # sequence 2
    client.done(opcodes.OPEN, b"/a")
    client.done(opcodes.TERMINATE, sequence=2)
    assert client.done(opcodes.READ, size=10).data == b"12345"


def test_a_reset_overtaken_by_an_opening_ends_nothing(client: FtpClient, files: Path) -> None:
    (files / "a").write_bytes(b"1")
    client.done(opcodes.RESET)
    session = client.done(opcodes.OPEN, b"/a").session
    client.done(opcodes.RESET, sequence=0)
    assert client.done(opcodes.READ, session=session, size=1).data == b"1"


def test_an_opening_repeated_under_a_new_number_is_the_same_opening(desk: Desk, client: FtpClient, files: Path) -> None:
    """MAVSDK repeats that way when it has not heard the answer, and uses session 0 whatever it is given."""
    (files / "a").write_bytes(b"1")
    for _ in range(10):
        assert client.done(opcodes.OPEN, b"/a\0").session == 0
        desk.wait(0.5)
    for _ in range(3):
        client.done(opcodes.TERMINATE)
        desk.wait(0.5)


def test_an_upload_whose_opening_is_overtaken_by_its_repetition_stays_whole(client: FtpClient, files: Path) -> None:
    delayed = client.sequence
    client.sequence += 1
    client.done(opcodes.CREATE, b"/a\0")
    client.done(opcodes.WRITE, b"12345")
    client.done(opcodes.CREATE, b"/a\0", sequence=delayed)
    assert (files / "a").read_bytes() == b"12345"


def test_a_client_with_one_number_for_everything_gets_the_file_it_asks_for(
    desk: Desk, client: FtpClient, files: Path
) -> None:
    """A transfer of MAVSDK that has run into its timeout is never ended; the next one opens session 0 again."""
    (files / "a").write_bytes(b"old")
    (files / "b").write_bytes(b"new")
    client.done(opcodes.OPEN, b"/a\0")
    desk.wait(5.0)
    client.done(opcodes.OPEN, b"/b\0")
    assert client.done(opcodes.READ, session=0, size=10).data == b"new"


def test_a_client_that_counts_anew_after_a_reset_is_not_taken_for_the_old_one(client: FtpClient, files: Path) -> None:
    for number in range(3):
        client.sequence = 0
        client.done(opcodes.RESET)
        client.put(b"/a", f"{number}".encode())
        assert (files / "a").read_bytes() == f"{number}".encode()
        client.done(opcodes.REMOVE, b"/a")
