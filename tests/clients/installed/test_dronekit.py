"""DroneKit, which knows ArduPilot only: connect, guided flight, and missions of items in floats."""

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.clients.vehicle import FlownVehicle

pytestmark = pytest.mark.installed_clients

SCRIPT = """
import sys, time
import dronekit
from pymavlink import mavutil

vehicle = dronekit.connect(sys.argv[1], wait_ready=True, timeout=60)
end = time.monotonic() + 120.0

def until(condition):
    while not condition():
        assert time.monotonic() < end, "the condition never came true"
        time.sleep(0.05)

until(lambda: vehicle.is_armable)
vehicle.mode = dronekit.VehicleMode("GUIDED")
until(lambda: vehicle.mode.name == "GUIDED")
vehicle.armed = True
until(lambda: vehicle.armed)
vehicle.simple_takeoff(20.0)
until(lambda: vehicle.location.global_relative_frame.alt > 19.0)
goal = dronekit.LocationGlobalRelative(47.3981, 8.5456, 25.0)
vehicle.simple_goto(goal)
until(lambda: abs(vehicle.location.global_relative_frame.lat - goal.lat) < 2e-5)
commands = vehicle.commands
commands.download()  # brings home, without which its first item would be taken for it
commands.wait_ready()
commands.clear()
for lat in (47.400, 47.402, 47.404):
    commands.add(dronekit.Command(0, 0, 0, mavutil.mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT,
                                  mavutil.mavlink.MAV_CMD_NAV_WAYPOINT, 0, 0, 0, 0, 0, 0, lat, 8.5456, 60.0))
commands.upload()
commands.download()
commands.wait_ready()
print("items", [round(command.x, 4) for command in commands])
vehicle.parameters["RTL_RETURN_ALT"] = 33
until(lambda: vehicle.parameters["RTL_RETURN_ALT"] == 33)
vehicle.mode = dronekit.VehicleMode("RTL")
until(lambda: not vehicle.armed)
print("landed")
vehicle.close()
"""


def test_a_guided_flight(program: Callable[[str, str], Path], tmp_path: Path) -> None:
    script = tmp_path / "fly.py"
    script.write_text(SCRIPT)
    with FlownVehicle("--identity", "ardupilot", streams="normal", speed=4) as vehicle:
        python = program("dronekit", "python")
        done = subprocess.run(
            [str(python), str(script), vehicle.pymavlink], capture_output=True, text=True, check=False, timeout=200
        )
        said = done.stdout + done.stderr + vehicle.sitl.log
    assert done.returncode == 0, said
    assert "items [47.4, 47.402, 47.404]" in done.stdout, said
    assert done.stdout.rstrip().endswith("landed"), said
