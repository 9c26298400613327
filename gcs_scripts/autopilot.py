"""What differs between autopilots on the wire: names and numbers of flight modes, and how to ask for the mission.

PX4's and ArduPilot's modes are pymavlink's tables; of any other autopilot those that it tells by AVAILABLE_MODES.
Sources: MAVLink guide, services/standard_modes; PX4 guide, flight_modes (custom mode: main << 16 | sub << 24).
"""

from typing import Any

from pymavlink import mavutil
from pymavlink.dialects.v20 import all as mav

from gcs_scripts.connection import Vehicle, enum_name

__all__ = ["Modes", "arms_in_guided", "is_ardupilot", "is_px4", "set_ardupilot_mode", "set_mission_mode"]

PX4_MISSION = mavutil.PX4_CUSTOM_MAIN_MODE_AUTO << 16 | mavutil.PX4_CUSTOM_SUB_MODE_AUTO_MISSION << 24
PX4_OTHERS = {(3, 1): "ORBIT", (4, 1): "READY", (4, 9): "PRECLAND", (10, 0): "TERMINATION"}  # what pymavlink lacks
MODES_GAP = 0.2  # [s] after which no more AVAILABLE_MODES are on their way
COPTERS = (
    mav.MAV_TYPE_QUADROTOR, mav.MAV_TYPE_COAXIAL, mav.MAV_TYPE_HELICOPTER, mav.MAV_TYPE_HEXAROTOR,
    mav.MAV_TYPE_OCTOROTOR, mav.MAV_TYPE_TRICOPTER, mav.MAV_TYPE_DODECAROTOR, mav.MAV_TYPE_DECAROTOR,
)  # fmt: skip


def is_ardupilot(heartbeat: Any) -> bool:
    """Whether a HEARTBEAT is ArduPilot's."""
    return heartbeat.autopilot == mav.MAV_AUTOPILOT_ARDUPILOTMEGA


def is_px4(heartbeat: Any) -> bool:
    """Whether a HEARTBEAT is PX4's."""
    return heartbeat.autopilot == mav.MAV_AUTOPILOT_PX4


def arms_in_guided(heartbeat: Any) -> bool:
    """Whether the vehicle cannot be armed in its mission mode: ArduPilot's copters wait for MISSION_START in it."""
    return is_ardupilot(heartbeat) and heartbeat.type in COPTERS


class Modes:
    """The flight modes of one vehicle."""

    def __init__(self) -> None:
        self._by_index: dict[int, Any] = {}  # AVAILABLE_MODES
        self._by_number: dict[int, Any] = {}  # the same by custom mode; several may have one number

    def add(self, message: Any) -> None:
        """Take in an AVAILABLE_MODES."""
        self._by_index[message.mode_index] = message
        self._by_number.setdefault(message.custom_mode, message)

    def name(self, heartbeat: Any) -> str:
        """Name of the mode that a HEARTBEAT tells."""
        number = heartbeat.custom_mode
        if is_px4(heartbeat):
            name = mavutil.interpret_px4_mode(heartbeat.base_mode, number)
            main, sub = number >> 16 & 0xFF, number >> 24
            return PX4_OTHERS.get((main, sub), f"mode {main}:{sub}" if name == "UNKNOWN" else name)
        if is_ardupilot(heartbeat):
            return ardupilot_modes(heartbeat).get(number, f"mode {number}")
        told = self._by_number.get(number)
        if told is None:
            return f"mode {number}"
        return told.mode_name or enum_name("MAV_STANDARD_MODE", told.standard_mode)

    def is_mission(self, heartbeat: Any) -> bool:
        """Whether the mode that a HEARTBEAT tells is the one that flies missions."""
        if is_px4(heartbeat):
            return heartbeat.custom_mode == PX4_MISSION
        if is_ardupilot(heartbeat):
            return ardupilot_modes(heartbeat).get(heartbeat.custom_mode) == "AUTO"
        told = self._by_number.get(heartbeat.custom_mode)
        return told is not None and told.standard_mode == mav.MAV_STANDARD_MODE_MISSION

    def learn(self, vehicle: Vehicle) -> None:
        """Ask a vehicle whose modes no table has for them. Raises UnansweredError if it does not tell."""
        if is_px4(vehicle.heartbeat) or is_ardupilot(vehicle.heartbeat):
            return
        total, wanted = 1, 0  # index 0 stands for all of them
        while len(self._by_index) < total:
            message = vehicle.ask(
                lambda index=float(wanted): vehicle.request("AVAILABLE_MODES", parameter=index),
                "AVAILABLE_MODES",
                lambda _: True,
                f"system {vehicle.system} does not tell its modes: no AVAILABLE_MODES",
            )
            while message is not None:
                self.add(message)
                total = message.number_modes
                message = vehicle.receive("AVAILABLE_MODES", MODES_GAP)
            wanted = next((i for i in range(1, total + 1) if i not in self._by_index), 0)


def ardupilot_modes(heartbeat: Any) -> dict[int, str]:
    """Names by number. A VTOL type that pymavlink does not know flies as a plane."""
    return mavutil.mode_mapping_bynumber(heartbeat.type) or mavutil.mode_mapping_apm


def ardupilot_mode_number(heartbeat: Any, name: str) -> int:
    """Number of a mode that every ArduPilot vehicle has."""
    return next(number for number, known in ardupilot_modes(heartbeat).items() if known == name)


def set_mission_mode(vehicle: Vehicle, modes: Modes) -> None:
    """Ask for the mode that flies missions and wait until HEARTBEAT tells it. Errors as of `Vehicle.command`."""
    heartbeat = vehicle.heartbeat
    if is_px4(heartbeat):
        flags = mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | mavutil.auto_mode_flags
        main, sub = mavutil.PX4_CUSTOM_MAIN_MODE_AUTO, mavutil.PX4_CUSTOM_SUB_MODE_AUTO_MISSION
        vehicle.command(mav.MAV_CMD_DO_SET_MODE, flags, main, sub, name="the mode MISSION")
    elif is_ardupilot(heartbeat):
        set_ardupilot_mode(vehicle, "AUTO")
    else:
        standard = mav.MAV_STANDARD_MODE_MISSION
        vehicle.command(mav.MAV_CMD_DO_SET_STANDARD_MODE, standard, name="the standard mode MISSION")
    vehicle.wait_for_heartbeat(modes.is_mission, "the mission's mode was accepted but is not told")


def set_ardupilot_mode(vehicle: Vehicle, name: str) -> None:
    """Ask for one of ArduPilot's modes. Errors as of `Vehicle.command`."""
    number = ardupilot_mode_number(vehicle.heartbeat, name)
    vehicle.command(mav.MAV_CMD_DO_SET_MODE, mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED, number, name=f"the mode {name}")
