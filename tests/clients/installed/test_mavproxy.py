"""MAVProxy, told what to do through its standard input, with the vehicle as PX4 and as ArduPilot."""

import os
import re
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.clients.vehicle import FlownVehicle, until

pytestmark = pytest.mark.installed_clients

ANSWER = 60.0  # [s], wall time
WAYPOINTS = """QGC WPL 110
0\t1\t0\t16\t0\t0\t0\t0\t47.397742\t8.545594\t488\t1
1\t0\t3\t84\t0\t0\t0\t0\t47.3985\t8.5456\t30\t1
2\t0\t3\t16\t0\t0\t0\t0\t47.4020\t8.5456\t60\t1
3\t0\t3\t85\t0\t0\t0\t0\t47.397742\t8.545594\t0\t1
"""
FENCE = """QGC WPL 110
0\t0\t3\t5001\t4\t0\t0\t0\t47.38\t8.53\t0\t1
1\t0\t3\t5001\t4\t0\t0\t0\t47.38\t8.56\t0\t1
2\t0\t3\t5001\t4\t0\t0\t0\t47.42\t8.56\t0\t1
3\t0\t3\t5001\t4\t0\t0\t0\t47.42\t8.53\t0\t1
"""
RALLY = """QGC WPL 110
0\t0\t3\t5100\t0\t0\t0\t0\t47.397742\t8.545594\t30\t1
"""


class MavProxy:
    """One MAVProxy; `said` is what it has printed."""

    def __init__(self, python: Path, port: int, folder: Path) -> None:
        self.said = ""
        program = python.with_name("mavproxy.py")
        self._process = subprocess.Popen(
            [
                str(python), str(program), f"--master=udpin:127.0.0.1:{port}", f"--state-basedir={folder}",
                "--aircraft=vtol", "--nowait",
            ],
            cwd=folder,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            env={**os.environ, "PYTHONUNBUFFERED": "1", "HOME": str(folder)},
        )  # fmt: skip
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        assert self._process.stdout is not None
        while piece := self._process.stdout.readline():
            self.said += piece

    def tell(self, line: str, expected: str, timeout: float = ANSWER) -> str:
        """Type a line and wait until what it prints from then on matches; returns that."""
        begun = len(self.said)
        assert self._process.stdin is not None
        self._process.stdin.write(line + "\n")
        self._process.stdin.flush()
        return self.expect(expected, begun, timeout)

    def expect(self, expected: str, begun: int = 0, timeout: float = ANSWER) -> str:
        """Wait until what it has printed from a place on matches."""
        end = time.monotonic() + timeout
        while not re.search(expected, self.said[begun:]):
            assert self._process.poll() is None, self.said
            assert time.monotonic() < end, f"no {expected!r} in:\n{self.said[begun:] or self.said}"
            time.sleep(0.05)
        return self.said[begun:]

    def close(self) -> None:
        self._process.kill()
        self._process.communicate()


@pytest.fixture(params=["px4", "ardupilot"])
def flown(
    request: pytest.FixtureRequest, program: Callable[[str, str], Path], tmp_path: Path
) -> Iterator[tuple[FlownVehicle, MavProxy, str]]:
    identity = str(request.param)
    with FlownVehicle("--identity", identity, streams="normal", speed=4) as vehicle:
        vehicle.seen("HEARTBEAT")  # from now on nothing is missed
        proxy = MavProxy(program("mavproxy", "python"), vehicle.port, tmp_path)
        try:
            proxy.expect(r"[Rr]eceived \d+ parameters|Parameter.*MAV")
            yield vehicle, proxy, identity
        finally:
            proxy.close()


def test_a_session_of_a_ground_station(flown: tuple[FlownVehicle, MavProxy, str], tmp_path: Path) -> None:
    vehicle, proxy, identity = flown
    (tmp_path / "mission.txt").write_text(WAYPOINTS)
    (tmp_path / "fence.txt").write_text(FENCE)
    (tmp_path / "rally.txt").write_text(RALLY)
    (tmp_path / "note.txt").write_text("hello\n")

    proxy.tell("param show MIS_TAKEOFF_ALT", r"MIS_TAKEOFF_ALT\s+15")
    proxy.tell("param set MIS_TAKEOFF_ALT 12", r"")
    vehicle.seen("PARAM_VALUE", lambda message: (message.param_id, message.param_value) == ("MIS_TAKEOFF_ALT", 12.0))
    proxy.tell("param fetch MIS_TAKEOFF_ALT", r"MIS_TAKEOFF_ALT\s*=?\s*12")
    proxy.tell("param set NAV_RCL_ACT 3", r"")  # a whole number
    proxy.tell("param fetch NAV_RCL_ACT", r"NAV_RCL_ACT\s*=?\s*3")
    proxy.tell(
        "wp load mission.txt", r"Loaded 4 waypoints|Sent waypoint|Flight plan received|Got MISSION_ACK.*ACCEPTED"
    )
    proxy.tell("wp list", r"Requesting \d+ waypoints[\s\S]*Saved \d+ waypoints|Saved \d+")
    proxy.tell("fence load fence.txt", r"Loaded|Sent|fence")
    proxy.tell("fence list", r"Saved|Requesting|polygon")
    proxy.tell("rally load rally.txt", r"Got MISSION_ACK: TYPE_RALLY: ACCEPTED")
    proxy.tell("rally list", r"Saved 1 rally items")
    proxy.tell("ftp put note.txt note.txt", r"")
    proxy.tell("ftp list /", r"note\.txt")
    if identity == "ardupilot":  # by its own numbering; of PX4's modes it only knows the number
        proxy.tell("mode GUIDED", r"GUIDED|Mode")
    else:
        proxy.tell("long DO_SET_MODE 1 4 3", r"")
    proxy.tell("arm throttle", r"ARMED|Armed|armed")
    vehicle.seen("HEARTBEAT", lambda message: bool(message.base_mode & 128) and message.get_srcComponent() == 1)
    proxy.tell("long NAV_TAKEOFF 0 0 0 0 0 0 0", r"")
    vehicle.seen("GLOBAL_POSITION_INT", lambda message: message.relative_alt > 9000)
    if identity == "ardupilot":
        proxy.tell("mode QLAND", r"")
    else:
        proxy.tell("long DO_SET_MODE 1 4 6", r"")
    vehicle.seen("HEARTBEAT", lambda message: not message.base_mode & 128 and message.get_srcComponent() == 1)
    proxy.tell("log list", r"Log \d+")
    proxy.tell("log download 1" if identity == "ardupilot" else "log download 0", r"Finished downloading|downloading")
    proxy.tell("signing setup correct-horse", r"")
    until(lambda: "signing on" in vehicle.sitl.log)
    proxy.tell("param fetch RTL_RETURN_ALT", r"RTL_RETURN_ALT\s*=?\s*40")
