"""Who we are and what we speak: AUTOPILOT_VERSION and PROTOCOL_VERSION, and the same in words.

https://mavlink.io/en/guide/mavlink_version.html. All are sent on request only.
"""

import hashlib
import platform
import re
from collections.abc import Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from sitl.mavlink.command import Command, CommandHandler
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.identity import Identity
from sitl.mavlink.service import Handler, Requestable, Sender, Service

__all__ = ["MavlinkVersionService", "autopilot_version", "protocol_version"]

CAPABILITIES = (
    mav.MAV_PROTOCOL_CAPABILITY_MAVLINK2
    | mav.MAV_PROTOCOL_CAPABILITY_COMMAND_INT
    | mav.MAV_PROTOCOL_CAPABILITY_MISSION_INT
    | mav.MAV_PROTOCOL_CAPABILITY_MISSION_FLOAT
    | mav.MAV_PROTOCOL_CAPABILITY_MISSION_FENCE
    | mav.MAV_PROTOCOL_CAPABILITY_MISSION_RALLY
    | mav.MAV_PROTOCOL_CAPABILITY_PARAM_FLOAT
    | mav.MAV_PROTOCOL_CAPABILITY_FTP
    | mav.MAV_PROTOCOL_CAPABILITY_SET_ATTITUDE_TARGET
    | mav.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED
    | mav.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_GLOBAL_INT
    | mav.MAV_PROTOCOL_CAPABILITY_FLIGHT_TERMINATION
)
MAVLINK_2 = 200
MAVLINK_1 = 100  # is understood, not spoken


def autopilot_version(system: int, identity: Identity) -> dict[str, object]:
    """Fields of AUTOPILOT_VERSION for a system id: our own versions, whatever autopilot we look like.

    flight: our version and the hash of the model's sources; middleware: Python; os: the kernel. The unique id stays the
    same for a system id.
    """
    unique = hashlib.sha256(f"tiltwing-sitl {system}".encode()).digest()
    if identity.bytewise_parameters:
        encoding = mav.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE
    else:
        encoding = mav.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST
    return {
        "capabilities": CAPABILITIES | encoding,
        "flight_sw_version": _packed(_own_version()),
        "middleware_sw_version": _packed(platform.python_version()),
        "os_sw_version": _packed(platform.release()),
        "board_version": 0,
        "flight_custom_version": tuple(_model_hash()),
        "middleware_custom_version": (0,) * 8,
        "os_custom_version": (0,) * 8,
        "vendor_id": 0,
        "product_id": 0,
        "uid": int.from_bytes(unique[:8], "little"),
        "uid2": tuple(unique[:18]),
    }


def protocol_version() -> dict[str, object]:
    """Fields of PROTOCOL_VERSION; the hashes are not known and zero."""
    return {
        "version": MAVLINK_2,
        "min_version": MAVLINK_1,
        "max_version": MAVLINK_2,
        "spec_version_hash": (0,) * 8,
        "library_version_hash": (0,) * 8,
    }


class MavlinkVersionService(Service):
    """Both messages, on request, also by ArduPilot's older AUTOPILOT_VERSION_REQUEST; DO_SEND_BANNER."""

    def messages(self) -> Mapping[str, Handler]:
        """See Service."""
        return {"AUTOPILOT_VERSION_REQUEST": self._on_version_request}

    def commands(self) -> Mapping[int, CommandHandler]:
        """See Service."""
        return {mav.MAV_CMD_DO_SEND_BANNER: self._send_banner}

    def requestable(self) -> Mapping[str, Requestable]:
        """See Service."""
        exchange = self.exchange
        return {
            "AUTOPILOT_VERSION": lambda _: [autopilot_version(exchange.system, exchange.identity)],
            "PROTOCOL_VERSION": lambda _: [protocol_version()],
        }

    def _on_version_request(self, _: Any, sender: Sender) -> None:
        fields = autopilot_version(self.exchange.system, self.exchange.identity)
        self.exchange.reply(sender, "AUTOPILOT_VERSION", **fields)

    def _send_banner(self, command: Command) -> None:
        """Say in words who we are."""
        lines = (
            f"tiltwing-sitl V{_own_version()} ({_model_hash().hex()[:8]})",
            f"Frame: {self.exchange.simulation.aircraft.name}",
        )
        for line in lines:
            self.exchange.tell(command.sender, mav.MAV_SEVERITY_INFO, line)


def _own_version() -> str:
    try:
        return version("tiltwing-sitl")
    except PackageNotFoundError:  # run from sources that were never installed
        return "0.0.0"


def _packed(text: str) -> int:
    """A dotted version as MAVLink packs it: one byte each for major, minor, patch, and 0 for a development version."""
    numbers = [min(int(number), 255) for number in re.findall(r"\d+", text)[:3]]
    major, minor, patch = (*numbers, 0, 0, 0)[:3]
    return major << 24 | minor << 16 | patch << 8


@cache
def _model_hash() -> bytes:
    """First 8 bytes of a hash over the sources of the flight model."""
    import vehicle_model

    digest = hashlib.sha256()
    for source in sorted(Path(vehicle_model.__file__).parent.glob("*.py")):
        digest.update(source.read_bytes())
    return digest.digest()[:8]
