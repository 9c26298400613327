"""MAVSDK-Python as it was before version 4, which talks to a server of its own."""

import contextlib
import os
import signal
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from sitl.testing.ports import reserve_port
from tests.clients.vehicle import FlownVehicle

pytestmark = pytest.mark.installed_clients

PLAN = Path(__file__).parents[3] / "docs" / "examples" / "survey_3km.plan"
SCRIPT = """
import asyncio, sys
from mavsdk_grpc import System
from mavsdk_grpc.failure import FailureType, FailureUnit
from mavsdk_grpc.geofence import FenceType, GeofenceData, Point, Polygon
from mavsdk_grpc.mission import MissionItem, MissionPlan
from mavsdk_grpc.offboard import PositionNedYaw

async def first(stream, condition):
    async for value in stream:
        if condition(value):
            return value

def item(lat, lon, alt):
    nan = float("nan")
    return MissionItem(lat, lon, alt, 20.0, True, nan, nan, MissionItem.CameraAction.NONE, nan, nan, nan, nan, nan,
                       MissionItem.VehicleAction.NONE)

async def fly():
    vehicle = System(port=int(sys.argv[2]))
    await vehicle.connect(system_address=sys.argv[1])
    await first(vehicle.telemetry.health(), lambda h: h.is_armable and h.is_home_position_ok)
    await vehicle.param.set_param_float("RTL_RETURN_ALT", 45.0)
    print("parameter", await vehicle.param.get_param_float("RTL_RETURN_ALT"))
    plan = await vehicle.mission_raw.import_qgroundcontrol_mission(sys.argv[3])
    await vehicle.mission_raw.upload_mission(plan.mission_items)
    print("plan", len(await vehicle.mission_raw.download_mission()) == len(plan.mission_items))
    corners = [Point(47.38, 8.53), Point(47.38, 8.58), Point(47.42, 8.58), Point(47.42, 8.53)]
    await vehicle.geofence.upload_geofence(GeofenceData([Polygon(corners, FenceType.INCLUSION)], []))
    print("files", await vehicle.ftp.list_directory("/"))
    await vehicle.param.set_param_int("SYS_FAILURE_EN", 1)
    await vehicle.failure.inject(FailureUnit.SYSTEM_MOTOR, FailureType.OK, 1)
    await vehicle.action.set_takeoff_altitude(20.0)
    await vehicle.action.arm()
    await vehicle.action.takeoff()
    await first(vehicle.telemetry.position(), lambda p: p.relative_altitude_m > 19.0)
    await vehicle.offboard.set_position_ned(PositionNedYaw(5.0, 0.0, -22.0, 0.0))
    await vehicle.offboard.start()
    await first(vehicle.telemetry.position_velocity_ned(), lambda p: p.position.north_m > 4.5)
    await vehicle.offboard.stop()
    print("offboard")
    await vehicle.action.transition_to_fixedwing()
    await first(vehicle.telemetry.flight_mode(), lambda m: str(m) == "HOLD")
    print("cruise")
    await vehicle.mission.upload_mission(MissionPlan([item(47.402, 8.5456, 60.0), item(47.404, 8.55, 60.0)]))
    plan = await vehicle.mission.download_mission()
    print("items", len(plan.mission_items))
    await vehicle.mission.start_mission()
    await first(vehicle.mission.mission_progress(), lambda p: p.current == p.total and p.total > 0)
    await vehicle.action.return_to_launch()
    await first(vehicle.telemetry.armed(), lambda armed: not armed)
    print("logs", len(await vehicle.log_files.get_entries()))
    print("landed")

asyncio.run(fly())
"""


def test_a_sortie_with_a_mission(program: Callable[[str, str], Path], tmp_path: Path) -> None:
    script = tmp_path / "fly.py"
    script.write_text(SCRIPT)
    server, guard = reserve_port()
    guard.close()
    with FlownVehicle(speed=8) as vehicle:
        python = program("grpc", "python")
        process = subprocess.Popen(
            [str(python), str(script), vehicle.mavsdk, str(server), str(PLAN)],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,  # so that its server goes with it
        )
        try:
            said, _ = process.communicate(timeout=200)
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
    assert process.returncode == 0, said + vehicle.sitl.log
    for expected in ("parameter 45.0", "plan True", "offboard", "cruise", "items 2", "logs 1"):
        assert expected in said, said
    assert "landed" in said
