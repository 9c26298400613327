"""`monitor` with a real vehicle: what its snapshot says, and its panels."""

import io
import math
import time
from collections.abc import Callable
from contextlib import AbstractContextManager

import pytest
from rich.console import Console

from gcs_scripts.connection import connect
from gcs_scripts.monitor import Monitor, dashboard, main

Vehicle = Callable[..., AbstractContextManager[str]]
Wire = Callable[[int, float], AbstractContextManager[tuple[int, list[int]]]]
Capture = pytest.CaptureFixture[str]


def lines(text: str) -> dict[str, str]:
    return dict(line.split(": ", 1) for line in text.splitlines())


@pytest.mark.parametrize(
    ("identity", "autopilot", "kind", "mode"),
    [
        ("px4", "PX4", "VTOL_TILTWING", "LOITER"), ("ardupilot", "ARDUPILOTMEGA", "VTOL_TILTROTOR", "LOITER"),
        ("generic", "GENERIC", "VTOL_TILTWING", "Hold"),
    ],
)  # fmt: skip
def test_a_snapshot_of_level_flight_says_what_was_asked_of_the_vehicle(
    vehicle: Vehicle, capsys: Capture, identity: str, autopilot: str, kind: str, mode: str
) -> None:
    with vehicle("--identity", identity, "--at", "trim:20", "--home", "47.397742,8.545594,488,90") as link:
        assert main(["--once", "--connect", link]) == 0, capsys.readouterr().err
    told = lines(capsys.readouterr().out)
    assert (told["system"], told["autopilot"], told["type"], told["mode"]) == ("1", autopilot, kind, mode)
    assert (told["armed"], told["vtol_state"], told["landed_state"]) == ("yes", "FW", "IN_AIR")
    assert float(told["airspeed_m_s"]) == pytest.approx(20.0, abs=1.5)
    assert float(told["altitude_m"]) == pytest.approx(100.0, abs=5.0)
    assert abs(float(told["roll_deg"])) < 40.0
    assert float(told["tilt_deg"]) < 30.0
    assert float(told["battery_percent"]) > 50.0
    assert float(told["battery_V"]) > 30.0
    assert 0.0 <= float(told["home_distance_m"]) < 1000.0
    assert float(told["loss_system_1_percent"]) == 0.0
    assert 0.0 < float(told["latency_ms"]) < 1000.0
    assert float(told["messages_per_s"]) > 10.0


def test_a_wires_losses_are_told_as_they_are(vehicle: Vehicle, lossy_wire: Wire, free_port: Callable[[], int]) -> None:
    port = free_port()
    with (
        lossy_wire(port, 0.2) as (wire, _),
        vehicle(link=f"udpin:127.0.0.1:{port}"),
        connect(f"udpout:127.0.0.1:{wire}", timeout=30.0) as craft,
    ):
        monitor = Monitor(craft)
        monitor.run(6.0)
        told = monitor.sections()["link"]
        monitor.close()
    assert float(told["loss_system_1_percent"]) == pytest.approx(20.0, abs=6.0)
    assert float(told["latency_ms"]) < 1000.0


def test_the_wings_own_message_is_asked_for_and_its_command_shown(vehicle: Vehicle) -> None:
    with vehicle() as link, connect(link) as craft:
        monitor = Monitor(craft)
        end = time.monotonic() + 20.0
        while "tilt_command_deg" not in monitor.sections()["attitude"] and time.monotonic() < end:
            monitor.run(0.25)
        attitude = monitor.sections()["attitude"]
        screen = io.StringIO()
        Console(file=screen, width=120).print(dashboard(monitor))
        monitor.close()
    assert (attitude["tilt_deg"], attitude["tilt_command_deg"]) == ("90.0", "90.0")
    for word in ("mode", "tilt command", "battery", "mission", "latency", "home distance", "m/s", "texts"):
        assert word in screen.getvalue()


def test_an_ended_vehicle_ends_the_monitor_with_the_link_lost(vehicle: Vehicle, capsys: Capture) -> None:
    with vehicle("--duration", "3") as link:
        assert main(["--connect", link, "--timeout", "3"]) == 4
    assert "has fallen silent: no HEARTBEAT for" in capsys.readouterr().err


def test_distances_are_those_of_the_sphere() -> None:
    from gcs_scripts.vehicle_state import EARTH_RADIUS, distance

    quarter = distance(0, 0, 0, 900_000_000)
    assert quarter == pytest.approx(EARTH_RADIUS * math.pi / 2)
    assert distance(473_977_420, 85_455_940, 473_986_420, 85_455_940) == pytest.approx(
        EARTH_RADIUS * math.radians(0.0009)
    )
