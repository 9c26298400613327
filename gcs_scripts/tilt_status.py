"""TILT_STATUS, the message of the tilt-wing, which pymavlink's dialects do not have: id, fields and checksum as its
dialect defines them (docs/mavlink.md). Importing this module lets pymavlink decode it.
"""

import struct

from pymavlink.dialects.v20 import all as mav

__all__ = ["LAGS", "MESSAGE_ID", "STOPPED", "MAVLink_tilt_status_message"]

MESSAGE_ID = 59900
LAGS, STOPPED = 1, 2  # flags: turns as fast as it can and lags its command; stands at an end of its range

FIELDS = ["time_boot_ms", "tilt", "tilt_command", "tilt_rate_limit", "flags"]
ORDER, ONE_EACH, NO_ARRAYS = [0, 1, 2, 3, 4], [1] * 5, [0] * 5


class MAVLink_tilt_status_message(mav.MAVLink_message):  # noqa: N801 - as pymavlink names its classes
    """Angle of the wing and its command [rad], fastest rate [rad/s], flags."""

    id = MESSAGE_ID
    msgname = name = "TILT_STATUS"
    fieldnames = ordered_fieldnames = FIELDS
    native_format = bytearray(b"<IfffB")
    orders, lengths, array_lengths = ORDER, ONE_EACH, NO_ARRAYS
    crc_extra = 119
    unpacker = struct.Struct("<IfffB")
    instance_field = None
    instance_offset = -1

    def __init__(self, time_boot_ms: int, tilt: float, tilt_command: float, tilt_rate_limit: float, flags: int) -> None:
        super().__init__(MESSAGE_ID, self.msgname)
        self._fieldnames, self._instance_field, self._instance_offset = self.fieldnames, None, -1
        self.time_boot_ms = time_boot_ms
        self.tilt, self.tilt_command, self.tilt_rate_limit = tilt, tilt_command, tilt_rate_limit
        self.flags = flags

    def pack(self, mav: mav.MAVLink, force_mavlink1: bool = False) -> bytes:
        """The bytes of the message."""
        values = (self.time_boot_ms, self.tilt, self.tilt_command, self.tilt_rate_limit, self.flags)
        return self._pack(mav, self.crc_extra, self.unpacker.pack(*values), force_mavlink1=force_mavlink1)


mav.mavlink_map[MESSAGE_ID] = MAVLink_tilt_status_message
