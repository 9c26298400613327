"""The flight must not notice what becomes of its viewer."""

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from sitl.snapshot import Snapshot
from sitl.viewer import open_viewer
from sitl.viewer.frames import ROW, pack_snapshot
from sitl.viewer.handle import QUEUE_LENGTH, Viewer
from vehicle_model.aircraft import Aircraft

Freeze = Callable[[Path], Viewer]
Read = Callable[[Path], dict[str, dict[str, np.ndarray]]]
Wait = Callable[[Callable[[], bool], str], None]

needs_stop = pytest.mark.skipif(not hasattr(signal, "SIGSTOP"), reason="the system cannot freeze a process")


@needs_stop
def test_frozen_viewer_neither_delays_offers_nor_the_exit(
    frozen_viewer: Freeze, flight: list[Snapshot], tmp_path: Path
) -> None:
    viewer = frozen_viewer(tmp_path / "frozen.rrd")
    process = viewer.process
    assert process is not None
    calls = []
    while viewer.dropped < QUEUE_LENGTH:
        begin = time.perf_counter()
        viewer.offer(flight[0])
        calls.append(time.perf_counter() - begin)
    calls.sort()
    # A busy machine may take the processor away from the test itself now and then; a call that waits for the viewer
    # would wait every time.
    assert calls[int(0.99 * len(calls))] < 1e-3
    begin = time.monotonic()
    viewer.close(deadline=0.5)
    assert time.monotonic() - begin < 1.5
    assert process.poll() is not None


@needs_stop
def test_viewer_that_wakes_up_gets_the_newest_and_each_drop_is_counted(
    frozen_viewer: Freeze, read_recording: Read, flight: list[Snapshot], tmp_path: Path
) -> None:
    file = tmp_path / "woken.rrd"
    viewer = frozen_viewer(file)
    assert viewer.process is not None
    offered = 0
    while viewer.dropped < 10:
        viewer.offer(flight[0])
        offered += 1
    viewer.offer(flight[-1])
    viewer.text(6, "the last word")
    os.kill(viewer.process.pid, signal.SIGCONT)
    viewer.close(deadline=30.0)
    recording = read_recording(file)
    times = recording["/world/aircraft"]["sim_time"]
    assert times[-1] == pytest.approx(flight[-1].time)
    assert recording["/messages"]["TextLog:text"].ravel().tolist() == ["the last word"]
    assert len(times) + 1 + viewer.dropped == offered + 2


def test_dead_viewer_is_noticed_and_what_it_misses_is_counted(
    aircraft: Aircraft, flight: list[Snapshot], tmp_path: Path
) -> None:
    viewer = open_viewer(f"save:{tmp_path / 'dead.rrd'}", aircraft)
    assert viewer.process is not None
    viewer.process.kill()
    viewer.process.wait()
    for snapshot in flight[:20]:
        viewer.offer(snapshot)
    viewer.text(6, "unheard")
    assert viewer.lost
    assert viewer.dropped >= 21
    viewer.close()


def test_close_without_a_listener_keeps_its_deadline(aircraft: Aircraft, flight: list[Snapshot]) -> None:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    viewer = open_viewer(f"connect:rerun+http://127.0.0.1:{port}/proxy", aircraft)
    for snapshot in flight:
        viewer.offer(snapshot)
    begin = time.monotonic()
    viewer.close(deadline=1.0)
    assert time.monotonic() - begin < 2.0


def test_viewer_process_ends_by_itself_when_the_flight_is_killed(wait_until: Wait, tmp_path: Path) -> None:
    file = tmp_path / "orphan.rrd"
    flight = (
        "import sys, time\n"
        "from sitl.viewer import open_viewer\n"
        "from vehicle_model.aircraft import load_aircraft\n"
        f"viewer = open_viewer({f'save:{file}'!r}, load_aircraft())\n"
        "print(viewer.process.pid, flush=True)\n"
        "time.sleep(60)\n"
    )
    root = Path(__file__).parents[3]
    process = subprocess.Popen([sys.executable, "-c", flight], stdout=subprocess.PIPE, text=True, cwd=root)
    assert process.stdout is not None
    pid = int(process.stdout.readline())
    wait_until(lambda: file.stat().st_size > 0, "the viewer process starts to write")
    process.kill()
    process.wait()
    process.stdout.close()
    wait_until(lambda: not _runs(pid), "the viewer process ends")


def _runs(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    stat = Path(f"/proc/{pid}/stat")
    try:
        return not stat.exists() or stat.read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


def test_viewer_that_is_off_takes_everything_and_starts_nothing(aircraft: Aircraft, flight: list[Snapshot]) -> None:
    with open_viewer("off", aircraft) as viewer:
        viewer.offer(flight[0])
        viewer.text(0, "nobody listens")
        assert viewer.process is None
        assert viewer.address == ""
        assert viewer.dropped == 0


def test_closing_twice_is_harmless(aircraft: Aircraft, tmp_path: Path) -> None:
    viewer = open_viewer(f"save:{tmp_path / 'twice.rrd'}", aircraft)
    viewer.close(deadline=10.0)
    viewer.close()


def test_snapshot_frame_is_one_row(flight: list[Snapshot]) -> None:
    snapshot = flight[-1]
    payload = pack_snapshot(snapshot)[-ROW.itemsize :]
    row = np.frombuffer(payload, ROW)[0]
    for name in ROW.names or ():
        if name != "wall_time":
            assert np.array_equal(row[name], getattr(snapshot, name)), name
