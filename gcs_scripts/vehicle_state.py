"""What a vehicle's latest messages say of it, as texts by name: for a dashboard, and for scripts to read.

Units are in the names. What has not been told is left out; what has not been told for a while is not known any more.
"""

import math
from collections.abc import Callable, Iterator
from typing import Any

from pymavlink.dialects.v20 import all as mav

from gcs_scripts.autopilot import Modes
from gcs_scripts.connection import Vehicle, enum_name
from gcs_scripts.tilt_status import LAGS, STOPPED

__all__ = ["VehicleState", "distance"]

TYPES = {22: "VTOL_FIXEDROTOR", 23: "VTOL_TAILSITTER", 24: "VTOL_TILTWING"}  # reserved in pymavlink's dialects
EARTH_RADIUS = 6371008.8  # mean [m]
OLD = 10.0  # [s] after which what was told is not shown any more
KEPT_FOREVER = ("HOME_POSITION", "AUTOPILOT_VERSION")
UNKNOWN_CENTIDEGREES, UNKNOWN_VOLTAGE = 65535, 65535


class VehicleState:
    """The latest messages of one vehicle's autopilot; `add` is meant for every message of its system."""

    def __init__(self, vehicle: Vehicle, modes: Modes) -> None:
        self._vehicle, self._modes = vehicle, modes
        self._latest: dict[str, tuple[float, Any]] = {}

    def add(self, message: Any, now: float) -> None:
        """Take in a message that came at `now` [s, monotonic]."""
        if (message.get_srcSystem(), message.get_srcComponent()) != (self._vehicle.system, self._vehicle.component):
            return
        kind = message.get_type()
        if kind == "NAMED_VALUE_FLOAT":
            kind = f"{kind} {message.name}"
        elif kind == "AVAILABLE_MODES":
            self._modes.add(message)
        self._latest[kind] = (now, message)

    def get(self, kind: str) -> Any | None:
        """The latest message of a kind, None if there is none; a NAMED_VALUE_FLOAT's kind ends with its name."""
        entry = self._latest.get(kind)
        return None if entry is None else entry[1]

    def sections(self, now: float) -> dict[str, dict[str, str]]:
        """What is known at `now` [s, monotonic]: by section, the texts by name."""
        latest = {k: m for k, (at, m) in self._latest.items() if now - at < OLD or k in KEPT_FOREVER}
        parts: dict[str, Callable[[dict[str, Any]], Iterator[tuple[str, str]]]] = {
            "vehicle": self._identity,
            "attitude": _attitude,
            "flight": _flight,
            "position": _position,
            "battery": _battery,
            "mission": _mission,
        }
        return {name: dict(part(latest)) for name, part in parts.items()}

    def _identity(self, latest: dict[str, Any]) -> Iterator[tuple[str, str]]:
        heartbeat = self._vehicle.heartbeat
        yield "system", f"{self._vehicle.system}"
        yield "autopilot", enum_name("MAV_AUTOPILOT", heartbeat.autopilot)
        yield "type", TYPES.get(heartbeat.type) or enum_name("MAV_TYPE", heartbeat.type)
        yield "mode", self._modes.name(heartbeat)
        yield "armed", "yes" if self._vehicle.armed else "no"
        if (extended := latest.get("EXTENDED_SYS_STATE")) is not None:
            yield "vtol_state", enum_name("MAV_VTOL_STATE", extended.vtol_state)
            yield "landed_state", enum_name("MAV_LANDED_STATE", extended.landed_state)
        status = latest.get("SYS_STATUS")
        ready = mav.MAV_SYS_STATUS_PREARM_CHECK
        if status is not None and status.onboard_control_sensors_present & ready:
            yield "ready_to_arm", "yes" if status.onboard_control_sensors_health & ready else "no"


def _attitude(latest: dict[str, Any]) -> Iterator[tuple[str, str]]:
    if (attitude := latest.get("ATTITUDE")) is not None:
        yield "roll_deg", f"{math.degrees(attitude.roll):.1f}"
        yield "pitch_deg", f"{math.degrees(attitude.pitch):.1f}"
        yield "heading_deg", f"{math.degrees(attitude.yaw) % 360.0:.1f}"
    tilt, named = latest.get("TILT_STATUS"), latest.get("NAMED_VALUE_FLOAT TILT")
    if tilt is not None:
        yield "tilt_deg", f"{math.degrees(tilt.tilt):.1f}"
        yield "tilt_command_deg", f"{math.degrees(tilt.tilt_command):.1f}"
        words = [word for flag, word in ((LAGS, "lags"), (STOPPED, "at end stop")) if tilt.flags & flag]
        yield "tilt_servo", ", ".join(words) or "follows"
    elif named is not None:
        yield "tilt_deg", f"{named.value:.1f}"


def _flight(latest: dict[str, Any]) -> Iterator[tuple[str, str]]:
    position, hud = latest.get("GLOBAL_POSITION_INT"), latest.get("VFR_HUD")
    if position is not None:
        yield "altitude_m", f"{position.relative_alt * 1e-3:.1f}"
        yield "altitude_msl_m", f"{position.alt * 1e-3:.1f}"
    if hud is not None:
        yield "airspeed_m_s", f"{hud.airspeed:.1f}"
        yield "groundspeed_m_s", f"{hud.groundspeed:.1f}"
        yield "climb_m_s", f"{hud.climb:.1f}"
        yield "throttle_percent", f"{hud.throttle}"


def _position(latest: dict[str, Any]) -> Iterator[tuple[str, str]]:
    position, home, gps = latest.get("GLOBAL_POSITION_INT"), latest.get("HOME_POSITION"), latest.get("GPS_RAW_INT")
    if position is not None:
        yield "latitude_deg", f"{position.lat * 1e-7:.7f}"
        yield "longitude_deg", f"{position.lon * 1e-7:.7f}"
        if home is not None:
            yield "home_distance_m", f"{distance(position.lat, position.lon, home.latitude, home.longitude):.0f}"
    if gps is not None:
        yield "gps_fix", enum_name("GPS_FIX_TYPE", gps.fix_type)
        yield "satellites", f"{gps.satellites_visible}" if gps.satellites_visible != 255 else "unknown"


def _battery(latest: dict[str, Any]) -> Iterator[tuple[str, str]]:
    if (status := latest.get("SYS_STATUS")) is not None:
        if status.voltage_battery != UNKNOWN_VOLTAGE:
            yield "battery_V", f"{status.voltage_battery * 1e-3:.2f}"
        if status.current_battery >= 0:
            yield "battery_A", f"{status.current_battery * 1e-2:.1f}"
        if status.battery_remaining >= 0:
            yield "battery_percent", f"{status.battery_remaining}"


def _mission(latest: dict[str, Any]) -> Iterator[tuple[str, str]]:
    if (current := latest.get("MISSION_CURRENT")) is not None:
        yield "mission_item", f"{current.seq}"
        if current.total not in (0, 65535):  # 65535: no mission
            yield "mission_items", f"{current.total}"
        if current.mission_state:
            yield "mission_state", enum_name("MISSION_STATE", current.mission_state)
    if (navigation := latest.get("NAV_CONTROLLER_OUTPUT")) is not None:
        yield "waypoint_distance_m", f"{navigation.wp_dist}"


def distance(latitude: int, longitude: int, other_latitude: int, other_longitude: int) -> float:
    """Great-circle distance [m] of two places in 1e-7 deg (haversine)."""
    a, b = math.radians(latitude * 1e-7), math.radians(other_latitude * 1e-7)
    half = math.radians((other_longitude - longitude) * 1e-7) / 2.0
    chord = math.sin((b - a) / 2.0) ** 2 + math.cos(a) * math.cos(b) * math.sin(half) ** 2
    return 2.0 * EARTH_RADIUS * math.asin(math.sqrt(min(chord, 1.0)))
