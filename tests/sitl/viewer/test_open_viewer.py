"""What `--rerun` accepts, and what it says to the rest; the web viewer that it serves."""

import os
import socket
import subprocess
import sys
import urllib.request
from collections.abc import Callable
from pathlib import Path
from urllib.error import URLError
from urllib.parse import parse_qs, urlsplit

import numpy as np
import pytest

from sitl.snapshot import Snapshot
from sitl.viewer import ViewerOptionError, open_viewer
from sitl.viewer.web import rerun_binary, unused_port
from vehicle_model.aircraft import Aircraft

Read = Callable[[Path], dict[str, dict[str, np.ndarray]]]
Wait = Callable[[Callable[[], bool], str], None]


@pytest.mark.parametrize(
    ("option", "complaint"),
    [
        ("browser", "expected web, spawn, connect:URL, save:FILE.rrd or off"),
        ("", "expected web, spawn, connect:URL, save:FILE.rrd or off"),
        ("web:8080", "expected web, spawn, connect:URL, save:FILE.rrd or off"),
        ("connect:127.0.0.1:9876", "expected connect:rerun+http://HOST:PORT/proxy"),
        ("connect:rerun+http://127.0.0.1:port/proxy", "expected connect:rerun+http://HOST:PORT/proxy"),
        ("connect:", "expected connect:rerun+http://HOST:PORT/proxy"),
        ("save:flight.mp4", "ends in .rrd"),
        ("save:", "ends in .rrd"),
        ("save:/no/such/folder/flight.rrd", "expected the folder /no/such/folder to exist"),
    ],
)
def test_bad_option_says_what_was_expected(aircraft: Aircraft, option: str, complaint: str) -> None:
    with pytest.raises(ViewerOptionError) as caught:
        open_viewer(option, aircraft)
    assert complaint in str(caught.value)
    assert option in str(caught.value)
    assert "\n" not in str(caught.value)


def test_folder_in_place_of_a_file_is_refused(aircraft: Aircraft, tmp_path: Path) -> None:
    folder = tmp_path / "folder.rrd"
    folder.mkdir()
    with pytest.raises(ViewerOptionError, match="expected a file that can be written"):
        open_viewer(f"save:{folder}", aircraft)


def test_web_viewer_is_served_on_loopback_and_may_only_talk_to_the_flight(
    aircraft: Aircraft, flight: list[Snapshot], wait_until: Wait
) -> None:
    with open_viewer("web", aircraft, map=False) as viewer:
        address = urlsplit(viewer.address)
        data = urlsplit(parse_qs(address.query)["url"][0])
        assert address.hostname == data.hostname == "127.0.0.1"
        assert address.port is not None
        assert data.port is not None
        page = f"http://127.0.0.1:{address.port}"
        opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))

        def answers() -> bool:
            viewer.offer(flight[0])
            try:
                opener.open(page, timeout=5.0).close()
            except (URLError, ConnectionError):
                return False
            return True

        wait_until(lambda: answers() or viewer.lost, "the web viewer is served")
        assert not viewer.lost
        for path in ("/", "/re_viewer.js", "/re_viewer_bg.wasm"):
            with opener.open(page + path, timeout=20.0) as answer:
                policy = answer.headers["Content-Security-Policy"]
                assert int(answer.headers["Content-Length"]) == len(answer.read()) > 1000
            assert policy.startswith("default-src 'self' ")
            assert {urlsplit(source).hostname for source in policy.split() if "//" in source} == {
                "127.0.0.1",
                "localhost",
            }
        wait_until(lambda: _connects("127.0.0.1", data.port), "the data are served")
        if (other := _other_address()) is not None:
            assert not _connects(other, address.port)
            assert not _connects(other, data.port)


def _connects(host: str, port: int | None) -> bool:
    with socket.socket() as probe:
        probe.settimeout(1.0)
        return probe.connect_ex((host, port or 0)) == 0


def _serves(port: int) -> bool:
    """Whether a server at this port answers in HTTP/2, as gRPC does; a port can accept before its server is there."""
    preface, settings = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", b"\0\0\0\4\0\0\0\0\0"
    try:
        with socket.create_connection(("127.0.0.1", port), timeout=1.0) as probe:
            probe.sendall(preface + settings)
            return len(probe.recv(9)) > 0
    except OSError:
        return False


def _other_address() -> str | None:
    """An address of this machine that is not loopback, if it has one."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))  # a documentation address: nothing is sent
        except OSError:
            return None
        return str(probe.getsockname()[0])


@pytest.mark.filterwarnings("ignore:RRD file has no footer")  # it is read while being written
def test_connect_delivers_the_flight_to_a_running_rerun(
    aircraft: Aircraft, flight: list[Snapshot], wait_until: Wait, read_recording: Read, tmp_path: Path
) -> None:
    file, port = tmp_path / "received.rrd", unused_port()
    command = [rerun_binary(), "--save", str(file), "--port", str(port), "--bind", "127.0.0.1"]
    rerun = subprocess.Popen(command, stderr=subprocess.DEVNULL, env={**os.environ, "CI": "1"})
    try:
        wait_until(lambda: _serves(port), "Rerun serves")
        viewer = open_viewer(f"connect:rerun+http://127.0.0.1:{port}/proxy", aircraft, map=False)
        for snapshot in flight:
            viewer.offer(snapshot)
        viewer.close(deadline=20.0)
        assert viewer.dropped == 0

        def received() -> bool:
            # Read while Rerun may still write: an incomplete block at the end is for the next look.
            rows = read_recording(file).get("/world/aircraft", {}).get("sim_time", []) if file.exists() else []
            return len(rows) == len(flight)

        wait_until(received, "all snapshots are in Rerun's file")
    finally:
        rerun.terminate()
        rerun.wait()


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere there is always a display to open a window on")
def test_spawn_without_a_display_says_so_and_the_flight_goes_on(
    aircraft: Aircraft,
    flight: list[Snapshot],
    wait_until: Wait,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr("sitl.viewer.GRPC_PORT", unused_port())  # a window already open would be used
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"):
        monkeypatch.delenv(name, raising=False)
    with open_viewer("spawn", aircraft) as viewer:

        def noticed() -> bool:
            viewer.offer(flight[0])
            return viewer.lost

        wait_until(noticed, "the missing window is noticed")
    assert "Rerun's window did not open (no display?); use web instead" in capfd.readouterr().err
