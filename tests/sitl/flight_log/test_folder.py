"""The folder of logs: whose files it lists and deletes, how it names new ones, and when the oldest go."""

import os
from pathlib import Path

import pytest

from sitl.flight_log.folder import MOST_BYTES, MOST_LOGS, LogFolder

NOON = 1_772_798_553  # 2026-03-06 12:02:33 UTC
FOREIGN = (
    "notes.txt",
    "log_1.ulg",
    "log_x_2026-03-06-12-02-33.ulg",
    "log_1_2026-13-06-12-02-33.ulg",
    "log_2_now.ulg.part",
)


def log_of(folder: Path, number: int, size: int = 10) -> Path:
    """A log of this size, holes and all, a minute after the one before it."""
    path = folder / f"log_{number}_2026-03-06-{number // 60 % 24:02d}-{number % 60:02d}-00.ulg"
    path.touch()
    os.truncate(path, size)
    return path


def test_a_log_is_named_by_number_and_utc(tmp_path: Path) -> None:
    assert LogFolder(tmp_path).next_path(NOON + 0.9).name == "log_1_2026-03-06-12-02-33.ulg"


def test_names_tell_what_is_listed(tmp_path: Path) -> None:
    folder = LogFolder(tmp_path)
    path = folder.next_path(NOON)
    path.write_bytes(b"12345")
    (log,) = folder.logs()
    assert log == (path, 1, NOON, 5)


def test_logs_are_listed_by_number(tmp_path: Path) -> None:
    for number in (10, 2, 1):
        log_of(tmp_path, number)
    assert [log.number for log in LogFolder(tmp_path).logs()] == [1, 2, 10]


def test_no_two_logs_have_the_same_number_or_second_on_the_disk_or_not(tmp_path: Path) -> None:
    folder = LogFolder(tmp_path)
    folder.next_path(NOON).touch()
    again = LogFolder(tmp_path)
    names = [again.next_path(NOON).name for _ in range(3)]
    assert names == [f"log_{2 + i}_2026-03-06-12-02-{34 + i}.ulg" for i in range(3)]


@pytest.mark.parametrize("utc", [-1e9, 0.0, 1e12, 1e300])
def test_any_time_makes_a_name_that_is_understood(tmp_path: Path, utc: float) -> None:
    folder = LogFolder(tmp_path)
    folder.next_path(utc).touch()
    folder.next_path(utc).touch()
    assert len({log.utc for log in folder.logs()}) == 2


def test_what_is_not_ours_is_never_listed_nor_deleted(tmp_path: Path) -> None:
    for name in FOREIGN:
        (tmp_path / name).touch()
    (tmp_path / "log_3_2026-03-06-12-02-33.ulg").mkdir()
    (tmp_path / "log_4_2026-03-06-12-02-33.ulg").symlink_to(tmp_path / "notes.txt")
    before = set(tmp_path.iterdir())
    folder = LogFolder(tmp_path)
    assert folder.logs() == []
    folder.erase()
    folder.make_room(MOST_BYTES)
    assert set(tmp_path.iterdir()) == before


def test_room_is_made_for_one_more_log_by_the_oldest(tmp_path: Path) -> None:
    paths = [log_of(tmp_path, number) for number in range(1, MOST_LOGS + 3)]
    LogFolder(tmp_path).make_room(0)
    assert sorted(tmp_path.iterdir()) == sorted(paths[3:])
    assert len(paths[3:]) == MOST_LOGS - 1


def test_room_is_made_for_so_many_bytes(tmp_path: Path) -> None:
    size = 60_000_000
    paths = [log_of(tmp_path, number, size) for number in range(1, 11)]
    LogFolder(tmp_path).make_room(size)
    left = sorted(tmp_path.iterdir())
    assert left == sorted(paths[3:])
    assert (len(left) + 1) * size <= MOST_BYTES


def test_the_folder_is_made_when_it_is_needed(tmp_path: Path) -> None:
    folder = LogFolder(tmp_path / "a" / "b")
    assert folder.logs() == []
    folder.erase()
    folder.make_room(0)
    assert (tmp_path / "a" / "b").is_dir()


def test_erasing_takes_all_logs(tmp_path: Path) -> None:
    for number in range(1, 5):
        log_of(tmp_path, number)
    LogFolder(tmp_path).erase()
    assert list(tmp_path.iterdir()) == []
