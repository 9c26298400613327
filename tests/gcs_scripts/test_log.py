"""`log` with a real vehicle whose logs are known byte by byte, also over a wire that loses datagrams."""

import random
import re
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import pytest

from gcs_scripts.connection import connect
from gcs_scripts.errors import LinkLostError
from gcs_scripts.log import main
from gcs_scripts.log_transfer import PIECE, LogEntry, download, list_logs

Vehicle = Callable[..., AbstractContextManager[str]]
Wire = Callable[[int, float], AbstractContextManager[tuple[int, list[int]]]]
Capture = pytest.CaptureFixture[str]

MAGIC = b"ULog\x01\x12\x35\x01"
SIZES = (100_001, 5 * PIECE, 1_200_000)  # the last takes two windows, the second ends with a full piece


@pytest.fixture
def state(tmp_path: Path) -> Path:
    """A state folder with logs of these sizes and random content."""
    folder = tmp_path / "state"
    (folder / "logs").mkdir(parents=True)
    chance = random.Random(7)
    for number, size in enumerate(SIZES, 1):
        file = folder / "logs" / f"log_{number}_2026-11-22-10-0{number}-00.ulg"
        file.write_bytes(MAGIC + chance.randbytes(size - len(MAGIC)))
    return folder


def contents(state: Path) -> list[bytes]:
    return [file.read_bytes() for file in sorted((state / "logs").glob("*.ulg"))]


@pytest.mark.parametrize("identity", ["px4", "ardupilot"])
def test_all_logs_are_listed_and_downloaded_byte_by_byte(
    vehicle: Vehicle, state: Path, tmp_path: Path, capsys: Capture, identity: str
) -> None:
    out = tmp_path / "out"
    with vehicle("--identity", identity, "--state", str(state)) as link:
        assert main(["list", "--connect", link]) == 0, capsys.readouterr().err
        rows = [line.split() for line in capsys.readouterr().out.splitlines()]
        assert [(day, clock, int(size)) for _, day, clock, size in rows] == [
            ("2026-11-22", f"10:0{number}:00", size) for number, size in enumerate(SIZES, 1)
        ]
        assert main(["download", "--all", "--output", str(out), "--connect", link]) == 0, capsys.readouterr().err
        paths = [Path(line) for line in capsys.readouterr().out.splitlines()]
        assert [path.read_bytes() for path in paths] == contents(state)
        assert {path.suffix for path in paths} == {".ulg"}
        assert main(["download", rows[1][0], "--output", str(out), "--connect", link]) == 0  # it is there already
        assert capsys.readouterr().out.strip() == str(paths[1])


def test_a_log_is_fetched_over_a_wire_that_loses_a_third(
    vehicle: Vehicle, lossy_wire: Wire, free_port: Callable[[], int], state: Path, tmp_path: Path, capsys: Capture
) -> None:
    port, out = free_port(), tmp_path / "out"
    with (
        lossy_wire(port, 0.33) as (wire, dropped),
        vehicle("--state", str(state), link=f"udpin:127.0.0.1:{port}"),
    ):
        link = f"udpout:127.0.0.1:{wire}"
        assert main(["--connect", link, "download", "0", "--output", str(out)]) == 0, capsys.readouterr().err
    assert Path(capsys.readouterr().out.strip()).read_bytes() == contents(state)[0]
    assert dropped[0] > 30
    assert not list(out.glob("*.part"))


def test_a_download_that_was_cut_goes_on_where_it_ended(vehicle: Vehicle, state: Path, tmp_path: Path) -> None:
    out, whole = tmp_path / "out", contents(state)[-1]
    steps: list[int] = []
    with vehicle("--state", str(state)) as link, connect(link) as craft:
        entry = list_logs(craft)[-1]

        def cut(there: int) -> None:
            if there > 500_000:
                raise LinkLostError("cut")

        with pytest.raises(LinkLostError, match="cut"):
            download(craft, entry, out, cut)
        (part,) = out.glob("*.part")
        there = part.stat().st_size
        assert 400_000 < there <= 500_000 + PIECE
        assert part.read_bytes() == whole[:there]
        path = download(craft, entry, out, steps.append)
    assert steps[0] == there
    assert path.read_bytes() == whole


def test_what_is_erased_is_not_listed(vehicle: Vehicle, state: Path, capsys: Capture) -> None:
    with vehicle("--state", str(state)) as link:
        assert main(["erase", "--yes", "--connect", link]) == 0, capsys.readouterr().err
        assert re.match(r"3 logs erased, 0 there now\n", capsys.readouterr().out)
        assert main(["list", "--connect", link]) == 0
        assert capsys.readouterr().out == ""
        assert main(["download", "--last", "--connect", link]) == 2
        assert "no log to download" in capsys.readouterr().err
    assert contents(state) == []


def test_a_log_that_is_not_there_is_refused_with_those_that_are(vehicle: Vehicle, state: Path, capsys: Capture) -> None:
    with vehicle("--state", str(state)) as link:
        assert main(["download", "77", "--connect", link]) == 2
        assert "no log 77; there are 0 to 2" in capsys.readouterr().err
    assert main(["download", "77", "--all"]) == 2
    assert "--all or --last" in capsys.readouterr().err


def test_a_file_is_named_by_what_tells_its_log_from_others() -> None:
    entry: Any = LogEntry(3, 1_795_341_600, 12345)
    assert entry.name == "log_3_2026-11-22T10-00-00Z_12345"
    assert LogEntry(0, 0, 5).date == "unknown"
