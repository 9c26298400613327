"""Terrain protocol: how high the ground is at a place that somebody asks about.

https://mavlink.io/en/services/terrain.html. The ground is level and known everywhere, so the vehicle asks nobody for it
(no TERRAIN_REQUEST), and TERRAIN_DATA is not for it.
"""

from collections.abc import Mapping
from typing import Any

from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.service import Handler, Sender, Service
from sitl.mavlink.telemetry.ground_distance import GRID_SPACING

__all__ = ["TerrainService"]

LATEST_LATITUDE, LATEST_LONGITUDE = 900_000_000, 1_800_000_000  # [1e-7 deg]


class TerrainService(Service):
    """Answers TERRAIN_CHECK by a TERRAIN_REPORT of that place."""

    def messages(self) -> Mapping[str, Handler]:
        """See Service."""
        return {"TERRAIN_CHECK": self._on_check}

    def _on_check(self, message: Any, sender: Sender) -> None:
        if abs(message.lat) > LATEST_LATITUDE or abs(message.lon) > LATEST_LONGITUDE:
            place = f"{message.lat * 1e-7:g}, {message.lon * 1e-7:g}"
            text = f"Terrain: expected a latitude and longitude [deg], got {place}"
            self.exchange.tell(sender, mav.MAV_SEVERITY_WARNING, text)
            return
        snapshot = self.exchange.simulation.snapshot()
        height = float(snapshot.outputs["height_above_ground"])
        self.exchange.reply(
            sender,
            "TERRAIN_REPORT",
            lat=message.lat,
            lon=message.lon,
            spacing=GRID_SPACING,
            terrain_height=snapshot.altitude_msl - height,
            current_height=height,
        )
