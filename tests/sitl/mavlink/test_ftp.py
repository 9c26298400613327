"""MAVLink FTP as the guide tells it (https://mavlink.io/en/services/ftp.html), and with pymavlink's client."""

import errno
import os
import random
from pathlib import Path

import pytest

from tests.sitl.mavlink.ftp_client import Answer, FtpClient, errors, opcodes, pymavlink_client
from tests.sitl.mavlink.in_memory import Desk, MemoryLink


@pytest.fixture
def client(desk: Desk) -> FtpClient:
    return FtpClient(desk)


@pytest.fixture
def files(desk: Desk) -> Path:
    return desk.face.state.files


def content(size: int) -> bytes:
    return random.Random(size).randbytes(size)


# -- requests and answers ----------------------------------------------------------------------------------------------


def test_nothing_is_acknowledged(client: FtpClient) -> None:
    assert client.done(opcodes.NONE).data == b""


@pytest.mark.parametrize("opcode", [17, 100, 127, 130, 255])
def test_an_unknown_opcode_is_refused_as_such(client: FtpClient, opcode: int) -> None:
    assert client.ask(opcode).error == errors.UNKNOWN


@pytest.mark.parametrize("opcode", [opcodes.ACK, opcodes.NAK])
def test_an_answer_is_never_answered(client: FtpClient, opcode: int) -> None:
    assert client.request(opcode, b"\1") == []


@pytest.mark.parametrize("opcode", [opcodes.LIST, opcodes.READ, opcodes.WRITE, opcodes.BURST])
def test_more_data_than_a_message_holds_is_refused(client: FtpClient, opcode: int) -> None:
    assert client.ask(opcode, size=240).error == errors.DATA_SIZE


def test_the_sequence_number_after_the_largest_is_zero(client: FtpClient) -> None:
    assert client.ask(opcodes.NONE, sequence=65535).sequence == 0


def test_an_answer_goes_to_the_one_who_asked_and_nobody_else(desk: Desk, client: FtpClient) -> None:
    other = desk.join(system=7)
    client.done(opcodes.NONE)
    assert other.of("FILE_TRANSFER_PROTOCOL") == []


# -- files -------------------------------------------------------------------------------------------------------------


def test_what_was_written_is_read_again(client: FtpClient, files: Path) -> None:
    data = content(1000)
    client.put(b"/new.bin", data)
    assert (files / "new.bin").read_bytes() == data
    assert client.get(b"new.bin") == data


def test_opening_tells_the_length_and_reading_beyond_it_is_end_of_file(client: FtpClient, files: Path) -> None:
    (files / "a").write_bytes(b"12345")
    opened = client.done(opcodes.OPEN, b"/a")
    assert opened.data == (5).to_bytes(4, "little")
    short = client.done(opcodes.READ, session=opened.session, offset=3, size=100)
    assert (short.data, short.offset, short.size) == (b"45", 3, 2)
    for offset in (5, 6, 0xFFFFFFFF):
        nak = client.ask(opcodes.READ, session=opened.session, offset=offset, size=100)
        assert (nak.error, nak.size) == (errors.EOF, 1)


def test_creating_a_file_empties_it_and_opening_it_to_write_does_not(client: FtpClient, files: Path) -> None:
    (files / "a").write_bytes(b"12345")
    session = client.done(opcodes.OPEN_TO_WRITE, b"/a").session
    assert client.done(opcodes.WRITE, b"X", session=session, offset=1).data == b""
    client.done(opcodes.TERMINATE, session=session)
    assert (files / "a").read_bytes() == b"1X345"
    assert client.done(opcodes.CREATE, b"/a").data == b""
    assert (files / "a").read_bytes() == b""
    client.done(opcodes.OPEN_TO_WRITE, b"/b")
    assert (files / "b").exists()


def test_files_and_directories_are_removed_renamed_made_and_cut(client: FtpClient, files: Path) -> None:
    client.done(opcodes.MAKE_DIRECTORY, b"/d")
    client.put(b"/d/a", b"12345")
    client.done(opcodes.RENAME, b"/d/a\0/b")
    assert (files / "b").read_bytes() == b"12345"
    client.done(opcodes.TRUNCATE, b"/b", offset=2)
    assert (files / "b").read_bytes() == b"12"
    client.done(opcodes.REMOVE, b"/b")
    client.done(opcodes.REMOVE_DIRECTORY, b"/d")
    assert list(files.iterdir()) == []


def test_paths_may_end_with_a_zero_as_mavsdk_sends_them(client: FtpClient, files: Path) -> None:
    client.done(opcodes.MAKE_DIRECTORY, b"/d\0")
    client.done(opcodes.RENAME, b"/d\0/e\0")
    assert (files / "e").is_dir()


def test_what_cannot_be_done_is_refused_with_the_reason(client: FtpClient, files: Path) -> None:
    (files / "file").write_bytes(b"12345")
    (files / "full").mkdir()
    (files / "full" / "x").touch()

    def refused(opcode: int, data: bytes, **options: int) -> tuple[int, ...]:
        answer = client.ask(opcode, data, **options)
        assert answer.opcode == opcodes.NAK
        return tuple(answer.data)

    for opcode in (opcodes.OPEN, opcodes.REMOVE, opcodes.REMOVE_DIRECTORY, opcodes.TRUNCATE, opcodes.CRC, opcodes.LIST):
        assert refused(opcode, b"/missing") == (errors.NOT_FOUND,)
    assert refused(opcodes.CREATE, b"/missing/a") == (errors.NOT_FOUND,)
    assert refused(opcodes.RENAME, b"/missing\0/a") == (errors.NOT_FOUND,)
    assert refused(opcodes.RENAME, b"/file\0/full") == (errors.EXISTS,)
    assert refused(opcodes.RENAME, b"/file") == (errors.DATA_SIZE,)
    assert refused(opcodes.MAKE_DIRECTORY, b"/full") == (errors.EXISTS,)
    assert refused(opcodes.REMOVE_DIRECTORY, b"/full") == (errors.FAIL_ERRNO, errno.ENOTEMPTY)
    assert refused(opcodes.REMOVE_DIRECTORY, b"/file") == (errors.FAIL_ERRNO, errno.ENOTDIR)
    assert refused(opcodes.LIST, b"/file") == (errors.FAIL_ERRNO, errno.ENOTDIR)
    for opcode in (opcodes.OPEN, opcodes.CREATE, opcodes.REMOVE, opcodes.TRUNCATE, opcodes.CRC):
        assert refused(opcode, b"/full") == (errors.FAIL_ERRNO, errno.EISDIR)
    assert refused(opcodes.TRUNCATE, b"/file", offset=6) == (errors.FAIL_ERRNO, errno.EINVAL)
    reading = client.done(opcodes.OPEN, b"/file").session
    assert refused(opcodes.WRITE, b"x", session=reading) == (errors.FAIL_ERRNO, errno.EBADF)
    writing = client.done(opcodes.OPEN_TO_WRITE, b"/file").session
    assert refused(opcodes.READ, b"", session=writing, size=5) == (errors.FAIL_ERRNO, errno.EBADF)


def test_a_checksum_is_mavlinks_also_of_a_file_too_large_for_one_turn(
    desk: Desk, client: FtpClient, files: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # CRC-32/JAMCRC inverted: the algorithm of the guide bit by bit, from zero and without a last inversion.
    def by_the_guide(data: bytes) -> int:
        crc = 0
        for byte in data:
            crc ^= byte
            for _ in range(8):
                crc = crc >> 1 ^ (0xEDB88320 if crc & 1 else 0)
        return crc

    monkeypatch.setattr("sitl.mavlink.ftp.PIECE", 1000)
    for size in (0, 1, 999, 1000, 1001, 5000):
        (files / "a").write_bytes(content(size))
        answers = client.request(opcodes.CRC, b"/a")
        while not answers:
            desk.wait(0.001)
            answers = client.answers()
        (answer,) = answers
        assert (answer.opcode, answer.sequence) == (opcodes.ACK, client.sequence)
        assert int.from_bytes(answer.data, "little") == by_the_guide(content(size))


# -- directories -------------------------------------------------------------------------------------------------------


def test_a_directory_is_listed_page_by_page_and_ends_with_end_of_file(client: FtpClient, files: Path) -> None:
    folder = files / "d"
    folder.mkdir()
    (folder / "sub").mkdir()
    for number in range(100):
        (folder / f"file{number:03}").write_bytes(b"x" * number)
    expected = [f"Ffile{number:03}\t{number}".encode() for number in range(100)] + [b"Dsub"]
    assert client.listed(b"/d") == expected
    assert client.listed(b"d/") == expected


def test_times_of_change_are_listed_on_request(client: FtpClient, files: Path) -> None:
    (files / "d").mkdir()
    (files / "d" / "a").write_bytes(b"123")
    os.utime(files / "d" / "a", (1.7e9, 1.7e9))
    (files / "d" / "sub").mkdir()
    os.utime(files / "d" / "sub", (1.6e9, 1.6e9))
    assert client.listed(b"/d", opcodes.LIST_WITH_TIME) == [b"Fa\t3\t1700000000", b"Dsub\t0\t1600000000"]


def test_names_that_cannot_be_told_are_entries_to_pass_over(client: FtpClient, files: Path) -> None:
    (files / "d").mkdir()
    (files / "d" / "a\tb").touch()
    (files / "d" / ("n" * 250)).touch()
    (files / "d" / "z").symlink_to("/etc/passwd")
    (files / "d" / "ä").touch()
    assert client.listed(b"/d") == [b"S", b"S", b"S", "Fä\t0".encode()]


def test_the_pages_of_a_listing_are_of_one_moment(client: FtpClient, files: Path) -> None:
    for number in range(40):
        (files / f"file{number:03}").touch()
    first = client.done(opcodes.LIST, b"/")
    seen = first.data.count(b"\0")
    for number in range(5):
        (files / f"file{number:03}").unlink()
    second = client.done(opcodes.LIST, b"/", offset=seen)
    last = first.data.split(b"\0")[-2][1:].split(b"\t")[0]
    assert second.data.split(b"\0")[0][1:].split(b"\t")[0] > last
    assert int(second.data.split(b"\t")[0][-3:]) == int(last[-3:]) + 1


# -- pymavlink's client ------------------------------------------------------------------------------------------------


def test_pymavlinks_client_does_everything(
    desk: Desk, files: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    client = pymavlink_client(desk, monkeypatch)
    (tmp_path / "up").write_bytes(content(10_000))
    assert client.cmd_mkdir(["/d"]).error_code == 0
    client.cmd_put([str(tmp_path / "up"), "/d/file"])
    assert client.process_ftp_reply("put", timeout=60).error_code == 0
    assert (files / "d" / "file").read_bytes() == content(10_000)
    listing = client.cmd_list(["/d"]).directory_listing
    assert [(entry.name, entry.is_dir, entry.size_b) for entry in listing or []] == [("file", False, 10_000)]
    assert client.cmd_rename(["/d/file", "/d/other"]).error_code == 0
    assert client.cmd_crc(["/d/other"]).error_code == 0
    client.cmd_get(["/d/other", str(tmp_path / "down")])
    assert client.process_ftp_reply("OpenFileRO", timeout=60).error_code == 0
    assert (tmp_path / "down").read_bytes() == content(10_000)
    assert client.read("/d/other", 100, 50) == content(10_000)[50:150]
    assert client.cmd_rm(["/d/other"]).error_code == 0
    assert client.cmd_rmdir(["/d"]).error_code == 0
    assert client.cmd_rm(["/d/other"]).error_code == errors.NOT_FOUND


@pytest.mark.parametrize("seed", range(3))
def test_files_come_whole_over_a_link_that_loses_and_doubles(
    desk: Desk, files: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, seed: int
) -> None:
    station = desk.join(system=100 + seed)
    client = pymavlink_client(desk, monkeypatch, station)
    station.loss, station.duplicates = 0.3, 0.1
    (files / "a").write_bytes(content(20_000))
    (tmp_path / "up").write_bytes(content(3000))
    client.cmd_get(["/a", str(tmp_path / "down")])
    assert client.process_ftp_reply("OpenFileRO", timeout=600).error_code == 0
    assert (tmp_path / "down").read_bytes() == content(20_000)
    client.cmd_put([str(tmp_path / "up"), "/up"])
    result = client.process_ftp_reply("put", timeout=600)
    station.loss = station.duplicates = 0.0
    # Whether its request to create the file comes is chance: it does not repeat that one. What it has done is whole.
    if result.error_code == 0:
        assert (files / "up").read_bytes() == content(3000)
    else:
        assert not (files / "up").exists() or len(content(3000)) >= (files / "up").stat().st_size


# -- the rest ----------------------------------------------------------------------------------------------------------


def test_no_numbers_in_any_field_make_it_stumble(desk: Desk) -> None:
    chance = random.Random(1)
    for _ in range(3000):
        payload = bytes((chance.randrange(256), chance.randrange(256), chance.randrange(256), chance.randrange(20)))
        payload += chance.randbytes(chance.randrange(248))
        desk.send("FILE_TRANSFER_PROTOCOL", payload=list(payload))
    assert desk.face.internal_errors == 0


def test_a_vehicle_that_begins_anew_keeps_its_files_and_closes_them(desk: Desk, client: FtpClient, files: Path) -> None:
    (files / "a").write_bytes(b"1")
    session = client.done(opcodes.OPEN, b"/a").session
    desk.face.request_restart()
    desk.turn()
    assert client.ask(opcodes.READ, session=session, size=1).error == errors.SESSION
    assert client.get(b"/a") == b"1"


def test_files_outlive_the_process_in_the_state_folder(tmp_path: Path) -> None:
    from sitl.mavlink.state_folder import StateFolder

    for number in range(2):
        with StateFolder(tmp_path) as state:
            desk = Desk(links=[MemoryLink()], state=state)
            client = FtpClient(desk)
            if number == 0:
                client.put(b"/kept", b"12345")
            else:
                assert client.get(b"/kept") == b"12345"
            desk.close()


def test_an_answer_says_nothing_beyond_its_size(client: FtpClient, files: Path) -> None:
    (files / "a").write_bytes(b"1")
    session = client.done(opcodes.OPEN, b"/a").session
    answer: Answer = client.done(opcodes.READ, session=session, size=239)
    assert answer.size == len(answer.data) == 1
