"""A Rerun recording of a flight that is over: written from this process, so that no moment of it is dropped.

A live flight must not wait for Rerun and goes by `sitl.viewer.handle` instead.
"""

import io
import os
import time
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

# Before Rerun is imported: no usage reports.
os.environ["CI"] = "1"
os.environ.setdefault("RUST_LOG", "error")

import numpy as np
import rerun as rr

from sitl.snapshot import Snapshot
from sitl.viewer.frames import ROW, pack_snapshot, read_frame
from sitl.viewer.geometry import airframe
from sitl.viewer.layout import blueprint
from sitl.viewer.scene import Scene
from sitl.viewer.web import serve_web_viewer, unused_port
from vehicle_model.aircraft import Aircraft

__all__ = ["Tape", "save_recording", "serve_recording"]

BLOCK_ROWS = 50  # snapshots that Rerun is told of together
SERVER_MEMORY = "2GB"  # of the web viewer's history


@dataclass
class Tape:
    """A flight as it was seen: snapshots in the order of flight, and what the pilot was told."""

    aircraft: Aircraft
    name: str
    snapshots: list[Snapshot] = field(default_factory=list[Snapshot])
    messages: list[tuple[float, int, str]] = field(default_factory=list[tuple[float, int, str]])  # time, severity, text


def save_recording(tape: Tape, path: Path, *, show_map: bool) -> Path:
    """Write a recording (.rrd) with its layout; needs at least one snapshot. Raises OSError."""
    recording = rr.RecordingStream("tiltwing-sitl")
    drawn = airframe(tape.aircraft)
    recording.save(path, default_blueprint=blueprint(drawn.size, show_map=show_map))
    _write(tape, Scene(recording, drawn), recording)
    recording.disconnect()
    return path


@contextmanager
def serve_recording(tape: Tape, *, show_map: bool) -> Generator[str]:
    """Serve a recording and a web viewer for it on loopback until the end of the block; gives the page's address.

    Raises OSError when Rerun's server does not come up.
    """
    web_port, data_port = unused_port(), unused_port()
    recording = rr.RecordingStream("tiltwing-sitl")
    drawn = airframe(tape.aircraft)
    serve_web_viewer(web_port, data_port, show_map=show_map)
    sink = rr.GrpcServerSink("127.0.0.1", data_port, server_memory_limit=SERVER_MEMORY)
    recording.set_sinks(sink, default_blueprint=blueprint(drawn.size, show_map=show_map))
    _write(tape, Scene(recording, drawn), recording)
    yield f"http://127.0.0.1:{web_port}/?url=rerun%2Bhttp%3A%2F%2F127.0.0.1%3A{data_port}%2Fproxy"
    recording.disconnect()  # the server lives as long as its recording


def _write(tape: Tape, scene: Scene, recording: rr.RecordingStream) -> None:
    recording.send_recording_name(tape.name)
    scene.begin()
    begun = time.time() - tape.snapshots[0].time
    for rows in _blocks(tape.snapshots):
        rows["wall_time"] = begun + rows["time"]  # as if it had been flown in real time, from now on
        scene.send(rows)
    for sim_time, severity, text in tape.messages:
        scene.text(begun + sim_time, sim_time, severity, text)
    recording.flush()


def _blocks(snapshots: list[Snapshot]) -> Iterator[np.ndarray]:
    """The snapshots as arrays of the viewer's ROW."""
    for first in range(0, len(snapshots), BLOCK_ROWS):
        payloads = []
        for snapshot in snapshots[first : first + BLOCK_ROWS]:
            frame = read_frame(io.BytesIO(pack_snapshot(snapshot)))
            assert frame is not None
            payloads.append(frame[1])
        yield np.frombuffer(bytearray(b"".join(payloads)), ROW)
