"""MAVSDK's Ftp, LogFiles and LogStreaming plugins: files both ways, flight logs as files and as a stream."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mavsdk.plugins.ftp import Ftp, FtpError
from mavsdk.plugins.log_files import LogFiles
from mavsdk.plugins.log_streaming import LogStreaming
from pyulog import ULog

from tests.clients.mavsdk_station import MavsdkStation, finished
from tests.clients.vehicle import until

CONTENT = bytes(range(256)) * 400


@pytest.fixture
def ftp(station: MavsdkStation) -> Any:
    return station.plugin(Ftp)


def names(listing: Any) -> set[str]:
    return {entry.name for entry in listing.entries}


@pytest.mark.parametrize("burst", [False, True])
def test_a_file_goes_up_is_renamed_comes_down_and_is_removed(ftp: Any, tmp_path: Path, burst: bool) -> None:
    here, there = tmp_path / "up.bin", tmp_path / "down"
    here.write_bytes(CONTENT)
    there.mkdir()
    ftp.create_directory("/trip")
    up = finished(ftp.upload_async, str(here), "/trip")
    assert up[-1][0] == "SUCCESS"
    assert max(data.bytes_transferred for _, data in up) == len(CONTENT)
    assert names(ftp.list_directory("/trip")) == {"up.bin"}
    assert ftp.are_files_identical(str(here), "/trip/up.bin")
    ftp.rename("/trip/up.bin", "/trip/renamed.bin")
    assert finished(ftp.download_async, "/trip/renamed.bin", str(there), burst)[-1][0] == "SUCCESS"
    assert (there / "renamed.bin").read_bytes() == CONTENT
    ftp.remove_file("/trip/renamed.bin")
    ftp.remove_directory("/trip")
    assert "trip" not in names(ftp.list_directory("/"))


def test_what_cannot_be_done_with_files_is_refused_for_what_is_wrong(ftp: Any, tmp_path: Path) -> None:
    with pytest.raises(FtpError, match="FILE_DOES_NOT_EXIST"):
        ftp.remove_file("/nothing.bin")
    with pytest.raises(FtpError, match="FILE_DOES_NOT_EXIST"):
        ftp.list_directory("/nowhere")
    with pytest.raises(FtpError, match="FILE_PROTECTED"):
        ftp.list_directory("../..")
    ftp.create_directory("/twice")
    with pytest.raises(FtpError, match="FILE_EXISTS"):
        ftp.create_directory("/twice")
    ftp.remove_directory("/twice")
    assert finished(ftp.download_async, "/nothing.bin", str(tmp_path), True)[-1][0] == "FILE_DOES_NOT_EXIST"


def test_a_flight_leaves_a_log_that_is_listed_downloaded_both_ways_and_erased(
    station: MavsdkStation, ftp: Any, tmp_path: Path
) -> None:
    station.take_off(12.0)
    station.action.land()
    until(lambda: not station.telemetry.armed())
    logs = station.plugin(LogFiles)
    (entry,) = logs.get_entries()
    target = tmp_path / "flight.ulg"
    reports = finished(logs.download_log_file_async, entry, str(target))
    assert reports[-1][0] == "SUCCESS"
    assert target.stat().st_size == entry.size_bytes
    flown = ULog(str(target)).get_dataset("vehicle_local_position").data
    assert -float(np.min(flown["z"])) == pytest.approx(12.0, abs=0.7)

    (same,) = names(ftp.list_directory("/fs/microsd/log"))
    assert finished(ftp.download_async, f"/fs/microsd/log/{same}", str(tmp_path), True)[-1][0] == "SUCCESS"
    # It may have grown meanwhile.
    assert (tmp_path / same).read_bytes()[: entry.size_bytes] == target.read_bytes()

    logs.erase_all_log_files()
    with pytest.raises(Exception, match="NO_LOGFILES"):
        logs.get_entries()


def test_a_log_is_streamed_while_it_is_written(station: MavsdkStation) -> None:
    streaming = station.plugin(LogStreaming)
    pieces: list[Any] = []
    heard = streaming.subscribe_log_streaming_raw(lambda piece, _: pieces.append(piece))
    streaming.start_log_streaming()
    until(lambda: len(pieces) > 20)
    streaming.stop_log_streaming()
    streaming.unsubscribe_log_streaming_raw(heard)
