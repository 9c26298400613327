"""What `--rerun` accepts, and what it says to the rest; the web viewer that it serves."""

import socket
import urllib.request
from collections.abc import Callable
from pathlib import Path
from urllib.error import URLError
from urllib.parse import parse_qs, urlsplit

import pytest

from sitl.snapshot import Snapshot
from sitl.viewer import ViewerOptionError, open_viewer
from vehicle_model.aircraft import Aircraft

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


def _other_address() -> str | None:
    """An address of this machine that is not loopback, if it has one."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))  # a documentation address: nothing is sent
        except OSError:
            return None
        return str(probe.getsockname()[0])
