"""A program as people write them with DroneKit: guided flight to a place, then a mission. Prints what it has seen.

Run by the Python that DroneKit is installed for, with the connection string as argument.
"""
# pyright: reportMissingImports=false

import json
import sys
import time
from collections.abc import Callable
from typing import Any

from dronekit import Command, LocationGlobalRelative, VehicleMode, connect
from pymavlink import mavutil

DEADLINE = 60.0  # [s]
mav: Any = mavutil.mavlink


def wait(condition: Callable[[], Any]) -> None:
    """Until it holds."""
    end = time.monotonic() + DEADLINE
    while not condition():
        if time.monotonic() > end:
            sys.exit(f"the condition of line {condition.__code__.co_firstlineno} never came true")
        time.sleep(0.02)


def main() -> None:
    """Fly, and print."""
    vehicle: Any = connect(sys.argv[1], wait_ready=True, heartbeat_timeout=30)
    seen: dict[str, Any] = {"parameters": len(vehicle.parameters), "cruise": vehicle.parameters["MPC_XY_CRUISE"]}
    wait(lambda: vehicle.is_armable)
    vehicle.mode = VehicleMode("GUIDED")
    wait(lambda: vehicle.mode.name == "GUIDED")
    vehicle.armed = True
    wait(lambda: vehicle.armed)
    vehicle.simple_takeoff(15)
    wait(lambda: vehicle.location.global_relative_frame.alt > 14.5)
    seen["mode after take-off"] = vehicle.mode.name

    here = vehicle.location.global_relative_frame
    goal = LocationGlobalRelative(here.lat + 2e-4, here.lon, 20.0)
    vehicle.simple_goto(goal)
    wait(lambda: abs(vehicle.location.global_relative_frame.lat - goal.lat) < 1e-5)
    wait(lambda: vehicle.location.global_relative_frame.alt > 19.0)
    seen["arrived"] = [vehicle.location.global_relative_frame.lat, vehicle.location.global_relative_frame.alt]

    vehicle.parameters["RTL_RETURN_ALT"] = 35.0
    vehicle.parameters.set("NAV_RCL_ACT", 3)
    wait(lambda: vehicle.parameters["RTL_RETURN_ALT"] == 35.0)
    seen["set"] = [vehicle.parameters["RTL_RETURN_ALT"], vehicle.parameters["NAV_RCL_ACT"]]

    commands = vehicle.commands
    commands.download()
    commands.wait_ready()
    commands.clear()  # but home, the first one
    for north in (1, 2, 3):
        place = (goal.lat + north * 1e-4, goal.lon, 20 + north)
        frame, waypoint = mav.MAV_FRAME_GLOBAL_RELATIVE_ALT, mav.MAV_CMD_NAV_WAYPOINT
        commands.add(Command(0, 0, 0, frame, waypoint, 0, 0, 0, 0, 0, 0, *place))
    commands.upload()
    commands.download()
    commands.wait_ready()
    seen["mission"] = [[item.x, item.y, item.z] for item in commands]
    vehicle.mode = VehicleMode("AUTO")
    wait(lambda: commands.next >= 2)
    vehicle.mode = VehicleMode("RTL")
    wait(lambda: not vehicle.armed)
    seen["landed"] = vehicle.location.global_relative_frame.alt
    vehicle.close()
    print(json.dumps(seen))


if __name__ == "__main__":
    main()
