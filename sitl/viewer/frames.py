"""The bytes between the flight and the viewer process: one frame per snapshot or message, over a pipe.

A frame is its kind, its length and its payload. A snapshot's payload is one row of ROW, so the viewer process
joins any number of them into one numpy array by looking at the bytes, without parsing.
"""

import pickle
import struct
import time
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from vehicle_model.records import OUTPUTS
from vehicle_model.state import CONTROL_COUNT, STATE_COUNT

if TYPE_CHECKING:
    from sitl.snapshot import Snapshot

__all__ = [
    "ROW", "SETUP", "SNAPSHOT", "TEXT", "pack_setup", "pack_snapshot", "pack_text", "read_frame", "unpack_setup",
    "unpack_text",
]  # fmt: skip

SETUP, SNAPSHOT, TEXT = 0, 1, 2

_HEADER = struct.Struct("=BI")
_SCALARS = struct.Struct("=32d")
_TEXT_HEAD = struct.Struct("=ddB")

# The scalars come first and in the order `pack_snapshot` writes them. Units and frames are those of Snapshot.
ROW = np.dtype(
    [
        ("wall_time", np.float64),  # seconds since 1970, when the snapshot was offered
        ("time", np.float64),
        ("latitude", np.float64),
        ("longitude", np.float64),
        ("height_ellipsoid", np.float64),
        ("altitude_msl", np.float64),
        ("position_ned", np.float64, (3,)),
        ("velocity_ned", np.float64, (3,)),
        ("quaternion", np.float64, (4,)),
        ("roll", np.float64),
        ("pitch", np.float64),
        ("yaw", np.float64),
        ("rates", np.float64, (3,)),
        ("specific_force", np.float64, (3,)),
        ("airspeed", np.float64),
        ("density", np.float64),
        ("wind_ned", np.float64, (3,)),
        ("tilt", np.float64),
        ("on_ground", np.float64),
        ("state", np.float64, (STATE_COUNT,)),
        ("controls", np.float64, (CONTROL_COUNT,)),
        ("outputs", OUTPUTS),
    ]
)


def pack_snapshot(snapshot: "Snapshot") -> bytes:
    """Frame of one snapshot, stamped with the wall time of this call."""
    s = snapshot
    scalars = _SCALARS.pack(
        time.time(), s.time, s.latitude, s.longitude, s.height_ellipsoid, s.altitude_msl,
        *s.position_ned, *s.velocity_ned, *s.quaternion, s.roll, s.pitch, s.yaw, *s.rates, *s.specific_force,
        s.airspeed, s.density, *s.wind_ned, s.tilt, s.on_ground,
    )  # fmt: skip
    header = _HEADER.pack(SNAPSHOT, ROW.itemsize)
    return b"".join((header, scalars, s.state.tobytes(), s.controls.tobytes(), s.outputs.tobytes()))


def pack_text(sim_time: float, severity: int, text: str) -> bytes:
    """Frame of one message: simulated time [s], MAV_SEVERITY (0 emergency .. 7 debug), text."""
    payload = _TEXT_HEAD.pack(time.time(), sim_time, severity) + text.encode()
    return _HEADER.pack(TEXT, len(payload)) + payload


def unpack_text(payload: bytes) -> tuple[float, float, int, str]:
    """Wall time, simulated time [s], severity and text of a message's payload."""
    return *_TEXT_HEAD.unpack_from(payload), payload[_TEXT_HEAD.size :].decode()


def pack_setup(setup: dict[str, Any]) -> bytes:
    """Frame that opens the stream: what to draw and where to send it.

    Pickled, because the pipe is private to a parent and the child it started itself.
    """
    payload = pickle.dumps(setup, protocol=pickle.HIGHEST_PROTOCOL)
    return _HEADER.pack(SETUP, len(payload)) + payload


def unpack_setup(payload: bytes) -> dict[str, Any]:
    """Inverse of `pack_setup`, for the payload without its header."""
    return pickle.loads(payload)  # noqa: S301 (from our own parent, over a private pipe)


def read_frame(stream: BinaryIO) -> tuple[int, bytes] | None:
    """Next frame of a blocking stream as (kind, payload), or None when the other end has closed."""
    header = stream.read(_HEADER.size)
    if len(header) < _HEADER.size:
        return None
    kind, length = _HEADER.unpack(header)
    payload = stream.read(length)
    return (kind, payload) if len(payload) == length else None
