"""The wire as an independent decoder reads it: node-mavlink, with definitions of its own."""

import json
import os
import shutil
import socket
import subprocess
import time
from typing import Any

import pytest

from sitl.mavlink.dialect import tiltwing as mav
from tests.clients.installed.conftest import CLIENTS
from tests.clients.vehicle import FlownVehicle

pytestmark = pytest.mark.installed_clients

TRAFFIC = 4.0  # that is captured [s], wall time


def captured() -> bytes:
    """What a vehicle in cruise sends on a link for SDKs, everything that it can be asked for among it."""
    wire = bytearray()
    with FlownVehicle(at="trim:20", speed=4) as vehicle, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ear:
        ear.bind(("127.0.0.1", vehicle.port))
        ear.settimeout(0.2)
        sender = mav.MAVLink(None, srcSystem=255, srcComponent=190)
        asked = iter(sorted(mav.mavlink_map))
        end = time.monotonic() + TRAFFIC
        while time.monotonic() < end:
            data, address = ear.recvfrom(1 << 16)
            wire += data
            if (number := next(asked, None)) is not None:
                request = mav.MAVLink_command_long_message(
                    1, 1, mav.MAV_CMD_REQUEST_MESSAGE, 0, number, 0, 0, 0, 0, 0, 0
                )
                ear.sendto(request.pack(sender), address)
    return bytes(wire)


def decoded(wire: bytes) -> dict[str, Any]:
    """What node-mavlink makes of it."""
    node = shutil.which("node")
    assert node is not None, "node is missing: Node.js runs the decoder"
    script = str(CLIENTS.parents[1] / "tests" / "clients" / "installed" / "decode.js")
    environment = {**os.environ, "NODE_PATH": str(CLIENTS / "node" / "node_modules")}
    done = subprocess.run([node, script], input=wire, capture_output=True, check=False, timeout=100, env=environment)
    assert done.returncode == 0, done.stderr.decode()
    return json.loads(done.stdout)


def test_every_packet_is_valid_by_its_definitions_and_says_what_it_says_to_pymavlink() -> None:
    wire = captured()
    theirs = decoded(wire)
    parser = mav.MAVLink(None)
    messages = parser.parse_buffer(wire) or []
    counts: dict[str, int] = {}
    latest: dict[str, Any] = {}
    for message in messages:
        counts[message.get_type()] = counts.get(message.get_type(), 0) + 1
        latest[message.get_type()] = message
    assert theirs["invalidPackages"] == 0
    # Known to our dialect only: newer than its definitions, or ours alone.
    missing = {name for name in counts if name not in theirs["counts"]}
    assert {mav.mavlink_map[int(number)].msgname for number in theirs["unknown"]} <= missing
    assert len(theirs["counts"]) > 60
    assert theirs["counts"] == {name: count for name, count in counts.items() if name not in missing}
    attitude, place = theirs["last"]["ATTITUDE"], theirs["last"]["GLOBAL_POSITION_INT"]
    assert attitude["pitch"] == pytest.approx(latest["ATTITUDE"].pitch)
    assert attitude["timeBootMs"] == latest["ATTITUDE"].time_boot_ms
    assert (place["lat"], place["lon"]) == (latest["GLOBAL_POSITION_INT"].lat, latest["GLOBAL_POSITION_INT"].lon)
    assert place["relativeAlt"] == latest["GLOBAL_POSITION_INT"].relative_alt
