"""A recording of a flight that is over holds every moment of it, in simulated time, with what the pilot was told."""

import subprocess
import time
import urllib.request
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

import pytest
from rerun.chunk import RrdReader

from sitl import Simulation
from sitl.recording import Tape, save_recording, serve_recording
from sitl.viewer.web import rerun_binary


@pytest.fixture(scope="module")
def tape() -> Tape:
    """Three seconds of flight, and one message."""
    simulation = Simulation(start="trim:20")
    tape = Tape(simulation.aircraft, "short")
    for _ in range(120):
        tape.snapshots.append(simulation.snapshot())
        simulation.advance(0.025)
    tape.messages.append((1.5, 4, "half way"))
    return tape


def test_every_snapshot_is_in_the_file(tape: Tape, tmp_path: Path) -> None:
    file = save_recording(tape, tmp_path / "flight.rrd", show_map=False)
    times: list[float] = []
    texts: list[str] = []
    for chunk in RrdReader(file).stream():
        batch = chunk.to_record_batch()
        if chunk.entity_path == "/world/aircraft":
            times += (batch.column("sim_time").cast("int64").to_numpy() * 1e-9).tolist()
        if chunk.entity_path == "/messages":
            texts += [text for row in batch.column("TextLog:text").to_pylist() for text in row]
    assert sorted(times) == pytest.approx([snapshot.time for snapshot in tape.snapshots])
    assert texts == ["half way"]


def test_a_served_recording_reaches_who_opens_the_page(tape: Tape, tmp_path: Path) -> None:
    received = tmp_path / "received.rrd"
    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    with serve_recording(tape, show_map=False) as address:
        with opener.open(address, timeout=20.0) as answer:
            assert b"<html" in answer.read().lower()
        data = parse_qs(urlsplit(address).query)["url"][0]
        client = subprocess.Popen([rerun_binary(), data, "--save", str(received)])
        try:
            end = time.monotonic() + 30.0
            while not (received.is_file() and received.stat().st_size > 200_000):
                assert time.monotonic() < end, "no data within 30 s"
                time.sleep(0.05)
        finally:
            client.kill()
            client.wait()
