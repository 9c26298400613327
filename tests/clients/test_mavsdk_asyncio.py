"""MAVSDK's asyncio API: one sortie that uses it as its own examples do, everything awaited."""

import asyncio
from collections.abc import AsyncGenerator, Callable
from contextlib import aclosing
from pathlib import Path
from typing import Any

import pytest
from mavsdk.asyncio import ComponentType, Configuration, Mavsdk
from mavsdk.asyncio.plugins.action import ActionAsync
from mavsdk.asyncio.plugins.ftp import FtpAsync
from mavsdk.asyncio.plugins.geofence import GeofenceAsync
from mavsdk.asyncio.plugins.log_files import LogFilesAsync
from mavsdk.asyncio.plugins.mission import MissionAsync
from mavsdk.asyncio.plugins.mission_raw import MissionRawAsync
from mavsdk.asyncio.plugins.offboard import OffboardAsync
from mavsdk.asyncio.plugins.param import ParamAsync
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
from mavsdk.plugins.action import ActionError
from mavsdk.plugins.geofence import Circle, FenceType, GeofenceData, Point
from mavsdk.plugins.mission import MissionItem, MissionPlan
from mavsdk.plugins.offboard import PositionNedYaw, VelocityNedYaw
from mavsdk.plugins.telemetry import FlightMode, LandedState, VtolState

from tests.clients.vehicle import DEADLINE, FlownVehicle, place

PLAN = Path(__file__).parents[2] / "docs" / "examples" / "survey_3km.plan"


@pytest.fixture(scope="module")
def vehicle_options() -> dict[str, Any]:
    return {"speed": 16}


async def first(stream: AsyncGenerator[Any], condition: Callable[[Any], bool] = lambda _: True) -> Any:
    """The first value of a stream that fulfils a condition."""
    async with asyncio.timeout(DEADLINE), aclosing(stream):
        async for value in stream:
            if condition(value):
                return value
    raise AssertionError


def fly(vehicle: FlownVehicle, sortie: Callable[[Any], Any]) -> None:
    """Run what a program with MAVSDK does, connected to a vehicle on the ground."""

    async def run() -> None:
        configuration = Configuration.create_with_component_type(ComponentType.GROUND_STATION)
        async with Mavsdk(configuration) as mavsdk:
            await mavsdk.add_any_connection(vehicle.mavsdk)
            system = await mavsdk.first_autopilot(DEADLINE)
            assert system is not None
            await first(TelemetryAsync(system).subscribe_health_all_ok(), bool)
            await sortie(system)

    vehicle.reset("ground")
    asyncio.run(run())


def test_a_sortie_with_both_transitions(vehicle: FlownVehicle) -> None:
    async def sortie(system: Any) -> None:
        action, telemetry = ActionAsync(system), TelemetryAsync(system)
        await action.set_takeoff_altitude(20.0)
        await action.arm()
        await action.takeoff()
        await first(telemetry.subscribe_position(), lambda position: position.relative_altitude_m > 19.5)
        await action.transition_to_fixedwing()
        await first(telemetry.subscribe_vtol_state(), lambda state: state == VtolState.FW)
        await action.transition_to_multicopter()
        await first(telemetry.subscribe_vtol_state(), lambda state: state == VtolState.MC)
        with pytest.raises(ActionError, match="COMMAND_DENIED"):
            await action.disarm()
        await action.land()
        await first(telemetry.subscribe_landed_state(), lambda state: state == LandedState.ON_GROUND)
        await first(telemetry.subscribe_armed(), lambda armed: not armed)

    fly(vehicle, sortie)


def test_a_mission_with_progress_to_its_end(vehicle: FlownVehicle) -> None:
    async def sortie(system: Any) -> None:
        mission, telemetry = MissionAsync(system), TelemetryAsync(system)
        items = [
            MissionItem(*place(0.0, 0.0), 15.0, vehicle_action=MissionItem.VehicleAction.TAKEOFF),
            MissionItem(*place(15.0, 0.0), 15.0, speed_m_s=5.0, is_fly_through=True),
        ]
        await mission.set_return_to_launch_after_mission(True)
        await mission.upload_mission(MissionPlan(items))
        assert len((await mission.download_mission()).mission_items) == 2
        await ActionAsync(system).arm()
        await mission.start_mission()
        done = await first(mission.subscribe_mission_progress(), lambda progress: progress.current == progress.total)
        assert done.total == 2
        await first(telemetry.subscribe_armed(), lambda armed: not armed)
        await mission.clear_mission()

    fly(vehicle, sortie)


def test_setpoints_of_a_computer_outside(vehicle: FlownVehicle) -> None:
    async def sortie(system: Any) -> None:
        action, telemetry, offboard = ActionAsync(system), TelemetryAsync(system), OffboardAsync(system)
        await action.set_takeoff_altitude(10.0)
        await action.arm()
        await action.takeoff()
        await first(telemetry.subscribe_position(), lambda position: position.relative_altitude_m > 9.5)
        await offboard.set_position_ned(PositionNedYaw(5.0, 0.0, -12.0, 0.0))
        await offboard.start()
        await first(telemetry.subscribe_position_velocity_ned(), lambda now: now.position.north_m > 4.5)
        await offboard.set_velocity_ned(VelocityNedYaw(0.0, 2.0, 0.0, 0.0))
        await first(telemetry.subscribe_position_velocity_ned(), lambda now: now.velocity.east_m_s > 1.8)
        await offboard.stop()
        await first(telemetry.subscribe_flight_mode(), lambda mode: mode == FlightMode.HOLD)
        await action.land()
        await first(telemetry.subscribe_armed(), lambda armed: not armed)

    fly(vehicle, sortie)


def test_plans_parameters_files_and_logs(vehicle: FlownVehicle, tmp_path: Path) -> None:
    async def sortie(system: Any) -> None:
        parameters, raw = ParamAsync(system), MissionRawAsync(system)
        await parameters.set_param_float("RTL_RETURN_ALT", 55.0)
        assert await parameters.get_param_float("RTL_RETURN_ALT") == 55.0
        everything = await parameters.get_all_params()
        assert "RTL_RETURN_ALT" in {parameter.name for parameter in everything.float_params}

        plan = await raw.import_qgroundcontrol_mission(str(PLAN))
        await raw.upload_mission(plan.mission_items)
        assert len(await raw.download_mission()) == len(plan.mission_items)
        await raw.clear_mission()

        fence = GeofenceAsync(system)
        await fence.upload_geofence(GeofenceData([], [Circle(Point(*place(0.0, 0.0)), 500.0, FenceType.INCLUSION)]))
        assert len((await fence.download_geofence()).circles) == 1
        await fence.clear_geofence()

        ftp = FtpAsync(system)
        assert {"fs", "etc"} <= {entry.name for entry in (await ftp.list_directory("/")).entries}
        (tmp_path / "note.txt").write_text("hello")
        async for _ in ftp.upload(str(tmp_path / "note.txt"), "/"):
            pass
        assert await ftp.are_files_identical(str(tmp_path / "note.txt"), "/note.txt")
        await ftp.remove_file("/note.txt")

        logs = LogFilesAsync(system)
        entries = await logs.get_entries()
        async for _ in logs.download_log_file(entries[-1], str(tmp_path / "log.ulg")):
            pass
        assert (tmp_path / "log.ulg").stat().st_size == entries[-1].size_bytes

    vehicle.reset("trim:20")
    fly(vehicle, sortie)
