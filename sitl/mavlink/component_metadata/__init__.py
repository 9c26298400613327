"""Component metadata protocol: files that describe parameters, events and actuators, and where they are found.

https://mavlink.io/en/services/component_metadata.html. COMPONENT_METADATA names the general file, which names the
others; all are downloaded by FTP. COMPONENT_INFORMATION is the older message that says the same. The files follow the
schemas in https://github.com/mavlink/mavlink/tree/master/component_metadata, that of the events is in
https://github.com/mavlink/libevents.
"""

import json
import lzma
from collections.abc import Mapping
from functools import cached_property
from typing import Any, Final

from sitl.mavlink.component_metadata.actuators import actuator_metadata
from sitl.mavlink.component_metadata.parameters import parameter_metadata
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.event_definitions import event_metadata
from sitl.mavlink.ftp_files import Mount
from sitl.mavlink.ftp_messages import crc32
from sitl.mavlink.mavlink_version import autopilot_version
from sitl.mavlink.service import Exchange, Requestable, Service

__all__ = ["ComponentMetadataService"]

FOLDER: Final = "/etc/extras"  # as with PX4
GENERAL: Final = f"{FOLDER}/component_general.json"
FILES: Final = {
    mav.COMP_METADATA_TYPE_PARAMETER: f"{FOLDER}/parameters.json",
    mav.COMP_METADATA_TYPE_EVENTS: f"{FOLDER}/events.json",
    mav.COMP_METADATA_TYPE_ACTUATORS: f"{FOLDER}/actuators.json",
}
COMPRESSED: Final = ".xz"
GENERAL_VERSION: Final = 1  # of the schema
VENDOR: Final = "tiltwing-sitl"


class ComponentMetadataService(Service):
    """Answers requests for the place of the metadata; the files are made when they are first asked for."""

    def __init__(self, exchange: Exchange) -> None:
        """Describe the vehicle of `exchange`."""
        super().__init__(exchange)
        self._files: dict[str, bytes] = {}

    def requestable(self) -> Mapping[str, Requestable]:
        """See Service."""
        return {
            "COMPONENT_METADATA": lambda _: [{"uri": _uri(GENERAL), "file_crc": self._crc, **self._now}],
            "COMPONENT_INFORMATION": lambda _: [
                {"general_metadata_uri": _uri(GENERAL), "general_metadata_file_crc": self._crc, **self._now}
            ],
            "COMPONENT_INFORMATION_BASIC": lambda _: [self._basic()],
        }

    @property
    def mounts(self) -> dict[str, Mount]:
        """The files by path, for FTP: each as it is and compressed."""

        def mount(path: str) -> Mount:
            return lambda _: self.file(path)

        return {path + end: mount(path + end) for path in (GENERAL, *FILES.values()) for end in ("", COMPRESSED)}

    def file(self, path: str) -> bytes:
        """One of the files; raises KeyError for another path."""
        made = self._files.get(path)
        if made is None:
            if path.endswith(COMPRESSED):
                # The small decoder that ground stations use knows this check and no stronger one.
                made = lzma.compress(self.file(path.removesuffix(COMPRESSED)), check=lzma.CHECK_CRC32)
            else:
                made = json.dumps(self._contents[path](), separators=(",", ":")).encode()
            self._files[path] = made
        return made

    @cached_property
    def _contents(self) -> dict[str, Any]:
        exchange = self.exchange
        return {
            GENERAL: self._general,
            FILES[mav.COMP_METADATA_TYPE_PARAMETER]: parameter_metadata,
            FILES[mav.COMP_METADATA_TYPE_EVENTS]: lambda: event_metadata(exchange.component, exchange.identity),
            FILES[mav.COMP_METADATA_TYPE_ACTUATORS]: lambda: actuator_metadata(exchange.simulation.aircraft),
        }

    def _general(self) -> dict[str, Any]:
        return {
            "version": GENERAL_VERSION,
            "vendorName": VENDOR,
            "modelName": self.exchange.simulation.aircraft.name,
            "firmwareVersion": self._version,
            "metadataTypes": [
                {"type": kind, "uri": _uri(path), "fileCrc": crc32(self.file(path + COMPRESSED))}
                for kind, path in FILES.items()
            ],
        }

    @property
    def _about(self) -> dict[str, Any]:
        return autopilot_version(self.exchange.system, self.exchange.identity)

    @property
    def _version(self) -> str:
        """Our version as major.minor.patch."""
        major, minor, patch, _ = self._about["flight_sw_version"].to_bytes(4, "big")
        return f"{major}.{minor}.{patch}"

    @property
    def _crc(self) -> int:
        return crc32(self.file(GENERAL + COMPRESSED))

    @property
    def _now(self) -> dict[str, int]:
        return {"time_boot_ms": self.exchange.time_us // 1000 & 0xFFFFFFFF}

    def _basic(self) -> dict[str, Any]:
        """COMPONENT_INFORMATION_BASIC; when it was made is not known."""
        about = self._about
        return {
            **self._now,
            "capabilities": about["capabilities"],
            "vendor_name": VENDOR,
            "model_name": self.exchange.simulation.aircraft.name,
            "software_version": self._version,
            "serial_number": f"{about['uid']:016x}",
        }


def _uri(path: str) -> str:
    return f"mftp://{path}{COMPRESSED}"
