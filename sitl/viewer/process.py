"""The viewer process: frames from the flight on stdin, columns to Rerun.

Started by `sitl.viewer.handle`, ends when the flight closes the pipe. Rerun may block here for as long as it likes.
"""

import os
import queue
import signal
import socket
import subprocess
import sys
import threading
import time
from typing import Any, BinaryIO

# Before Rerun is imported: no usage reports from here nor from a viewer window started here. Rerun has a switch in a
# file of the user's home, which is not ours to write, and this variable.
os.environ["CI"] = "1"
os.environ.setdefault("RUST_LOG", "error")

import numpy as np
import rerun as rr

from sitl.viewer.frames import ROW, SNAPSHOT, TEXT, read_frame, unpack_setup, unpack_text
from sitl.viewer.layout import blueprint
from sitl.viewer.scene import Scene
from sitl.viewer.web import rerun_binary, serve_web_viewer

BLOCK_SECONDS = {"save": 1.0}  # of wall time: how long snapshots are gathered before they go out together
LIVE_BLOCK_SECONDS = 0.4
BLOCK_ROWS = 50
FRAMES_AHEAD = 200  # between the pipe and Rerun; more wait in the pipe and with the flight
FLUSH_DEADLINE = 15.0  # s; the flight, which has less patience, ends us sooner; without it Rerun would wait for ever
DISCONNECT_DEADLINE = 5.0  # s
WINDOW_DEADLINE = 15.0  # s for a viewer window to open
SERVER_MEMORY = "512MB"  # the web viewer's history; the oldest goes first


def main() -> None:
    """Run until the flight closes the pipe."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    first = read_frame(sys.stdin.buffer)
    if first is None:
        return
    setup = unpack_setup(first[1])
    try:
        recording = _open(setup)
    except (OSError, RuntimeError) as error:
        print(f"viewer {setup['kind']}: {error}", file=sys.stderr)
        os._exit(1)
    frames: queue.Queue[tuple[int, bytes] | None] = queue.Queue(FRAMES_AHEAD)
    threading.Thread(target=_read, args=(sys.stdin.buffer, frames), name="reader", daemon=True).start()
    scene = Scene(recording, setup["airframe"])
    scene.begin()
    _show(scene, frames, BLOCK_SECONDS.get(setup["kind"], LIVE_BLOCK_SECONDS))
    recording.flush(timeout_sec=FLUSH_DEADLINE)
    # Writes a file's index and closes a connection in order: cut off at the process's end, the peer may throw away what
    # it has not read. With a frozen peer it hangs, so it gets a thread to hang in.
    last = threading.Thread(target=recording.disconnect, daemon=True)
    last.start()
    last.join(DISCONNECT_DEADLINE)
    # Rerun's own clean-up waits for peers that are gone.
    os._exit(0)


def _read(stream: BinaryIO, frames: "queue.Queue[tuple[int, bytes] | None]") -> None:
    """Move frames from the pipe to the queue; when both the flight and Rerun are gone, end the process."""
    flight = os.getppid()
    while True:
        frame = read_frame(stream)
        while True:
            try:
                frames.put(frame, timeout=1.0)
                break
            except queue.Full:
                if os.getppid() != flight:
                    os._exit(1)
        if frame is None:
            return


def _show(scene: Scene, frames: "queue.Queue[tuple[int, bytes] | None]", block_seconds: float) -> None:
    """Gather snapshots into blocks and hand them on, until the end of the stream."""
    rows: list[bytes] = []
    due = 0.0
    ended = False
    while not ended:
        try:
            frame = frames.get(timeout=max(0.0, due - time.monotonic()) if rows else None)
        except queue.Empty:
            frame = (SNAPSHOT, b"")
        if frame is None:
            ended = True
        elif frame[0] == TEXT:
            scene.text(*unpack_text(frame[1]))
        elif frame[1]:
            if not rows:
                due = time.monotonic() + block_seconds
            rows.append(frame[1])
        if rows and (ended or len(rows) >= BLOCK_ROWS or time.monotonic() >= due):
            scene.send(np.frombuffer(b"".join(rows), ROW))
            rows.clear()


def _open(setup: dict[str, Any]) -> rr.RecordingStream:
    """Recording that goes where the user asked, with its layout."""
    recording = rr.RecordingStream("tiltwing-sitl")
    layout = blueprint(setup["airframe"].size, show_map=setup["map"])
    kind = setup["kind"]
    if kind == "save":
        recording.save(setup["file"], default_blueprint=layout)
    elif kind == "connect":
        recording.connect_grpc(setup["url"], default_blueprint=layout)
    elif kind == "spawn":
        _open_window(setup["grpc_port"])
        recording.connect_grpc(f"rerun+http://127.0.0.1:{setup['grpc_port']}/proxy", default_blueprint=layout)
    else:
        serve_web_viewer(setup["web_port"], setup["grpc_port"], show_map=setup["map"])
        sink = rr.GrpcServerSink("127.0.0.1", setup["grpc_port"], server_memory_limit=SERVER_MEMORY)
        recording.set_sinks(sink, default_blueprint=layout)
    recording.send_recording_name(setup["name"])
    return recording


def _open_window(port: int) -> None:
    """Start Rerun's window, unless one already listens; it stays open after the flight."""
    if _answers(port):
        return
    command = [rerun_binary(), "--port", str(port), "--bind", "127.0.0.1", "--expect-data-soon"]
    window = subprocess.Popen(
        command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, start_new_session=True,
        env={**os.environ, "RERUN_APP_ONLY": "true"},
    )  # fmt: skip
    end = time.monotonic() + WINDOW_DEADLINE
    while not _answers(port):
        if window.poll() is not None or time.monotonic() > end:
            msg = "Rerun's window did not open (no display?); use web instead"
            raise OSError(msg)
        time.sleep(0.05)


def _answers(port: int) -> bool:
    with socket.socket() as probe:
        probe.settimeout(1.0)
        return probe.connect_ex(("127.0.0.1", port)) == 0


if __name__ == "__main__":
    main()
