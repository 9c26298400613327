"""Logs reach the disk whole and in order; what goes wrong there stays there."""

import threading
import time
from pathlib import Path

from sitl.flight_log.writer import ROOM, LogWriter


def nothing() -> None:
    """No preparation."""


def poll_failure(writer: LogWriter) -> str:
    end = time.monotonic() + 10.0
    while writer.failure is None:
        assert time.monotonic() < end, "it never failed"
    return writer.failure


def test_files_are_written_one_after_the_other(tmp_path: Path) -> None:
    writer = LogWriter()
    for name in ("a", "b"):
        writer.begin(tmp_path / name, nothing)
        for i in range(100):
            assert writer.write(b"%s%d " % (name.encode(), i))
        writer.end()
    writer.close()
    for name in ("a", "b"):
        assert (tmp_path / name).read_text() == "".join(f"{name}{i} " for i in range(100))
    assert writer.failure is None


def test_a_writer_goes_on_after_it_was_closed(tmp_path: Path) -> None:
    writer = LogWriter()
    for name in ("a", "b"):
        writer.begin(tmp_path / name, nothing)
        writer.write(b"x")
        writer.close()
    assert (tmp_path / "b").read_bytes() == b"x"


def test_preparation_comes_first(tmp_path: Path) -> None:
    writer = LogWriter()
    writer.begin(tmp_path / "new" / "a", (tmp_path / "new").mkdir)
    writer.write(b"x")
    writer.close()
    assert (tmp_path / "new" / "a").read_bytes() == b"x"


def test_a_file_that_is_there_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"old")
    writer = LogWriter()
    writer.begin(tmp_path / "a", nothing)
    writer.write(b"new")
    assert poll_failure(writer) == "File exists"
    writer.close()
    assert (tmp_path / "a").read_bytes() == b"old"


def test_a_failure_is_told_and_what_follows_thrown_away(tmp_path: Path) -> None:
    writer = LogWriter()
    writer.begin(tmp_path / "missing" / "a", nothing)
    assert poll_failure(writer) == "No such file or directory"
    end = time.monotonic() + 10.0
    for _ in range(3):
        while not writer.write(bytes(ROOM)):  # fills the room, for a moment
            assert time.monotonic() < end, "the room was never free again"
    writer.end()
    writer.close()


def test_a_disk_that_stands_still_is_given_so_much_and_no_more(tmp_path: Path) -> None:
    writer, disk = LogWriter(), threading.Event()

    def wait() -> None:
        assert disk.wait(10.0)

    writer.begin(tmp_path / "a", wait)
    piece, taken = bytes(ROOM // 4), 0
    while writer.write(piece):
        taken += 1
    assert taken == 4
    disk.set()
    writer.close()
    assert (tmp_path / "a").stat().st_size == ROOM


def test_closing_what_never_began_is_harmless() -> None:
    LogWriter().close()
