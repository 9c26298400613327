"""What a recording holds: the static scene, and blocks of snapshots as columns.

World axes are NED with home at the origin. Rerun is told once per block and entity (`send_columns`), which costs a
hundredth of logging each snapshot by itself.
"""

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import rerun as rr

from sitl.viewer.geometry import Airframe, quaternion_xyzw
from sitl.viewer.plots import PLOTS
from vehicle_model.state import ROTOR_SPEED

if TYPE_CHECKING:
    from sitl.viewer.mesh import Mesh

__all__ = ["FOLLOWED", "METRES_PER_SPEED", "SHOWN_ROTATION", "Scene"]

METRES_PER_SPEED = 0.1  # length of velocity and wind arrows [m per m/s]
SHOWN_ROTATION = 1.0 / 97.0  # propellers are shown this much slower, else 50 Hz would make them stand or turn back
TELEPORT = 100.0  # m: a longer way between two snapshots is a new start, not flight
MAP_INTERVAL = 0.2  # s between points on the map

AIRCRAFT = "world/aircraft"
FOLLOWED = "world/aircraft/followed"
THRUST = (255, 149, 20)
AIR_LOAD = (82, 148, 226)
STALLED = (230, 60, 60)
CONTACT = (196, 120, 220)
VELOCITY = (76, 200, 120)
WIND = (130, 215, 230)
TRAIL = (240, 200, 90)
PLUMB = (150, 158, 168)
LEVELS = ("CRITICAL", "CRITICAL", "CRITICAL", "ERROR", "WARN", "INFO", "INFO", "DEBUG")  # of MAV_SEVERITY 0..7


def _packed(color: tuple[int, ...]) -> int:
    red, green, blue, alpha = (*color, 255)[:4]
    return red << 24 | green << 16 | blue << 8 | alpha


def _mesh(mesh: "Mesh") -> rr.Mesh3D:
    return rr.Mesh3D(
        vertex_positions=mesh.vertices.astype(np.float32),
        triangle_indices=mesh.triangles.astype(np.uint32),
        vertex_normals=mesh.normals.astype(np.float32),
        vertex_colors=mesh.colors,
        # Transparency counts only here, for the mesh as a whole.
        albedo_factor=(255, 255, 255, int(mesh.colors[0, 3])),
    )


def _placed(origin: np.ndarray, axes: np.ndarray) -> rr.Transform3D:
    return rr.Transform3D(translation=origin, quaternion=rr.Quaternion(xyzw=quaternion_xyzw(axes)))


def _about(axis: int, angles: np.ndarray) -> np.ndarray:
    """Quaternions (n, 4), x y z w, of turns about a coordinate axis."""
    quaternions = np.zeros((len(angles), 4))
    quaternions[:, axis] = np.sin(0.5 * angles)
    quaternions[:, 3] = np.cos(0.5 * angles)
    return quaternions


class Scene:
    """Writes one vehicle into a Rerun recording: `begin` once, then `send` and `text`."""

    def __init__(self, recording: rr.RecordingStream, airframe: Airframe) -> None:
        self._recording = recording
        self._airframe = airframe
        self._phase = np.zeros(len(airframe.propellers))  # shown propeller angles
        self._last: np.void | None = None  # of the block before
        self._next_map = -math.inf

    def begin(self) -> None:
        """Log all that never changes: meshes, offsets, colours, names, the key to the arrows."""
        frame = self._airframe
        self._static("world", rr.ViewCoordinates.FRD)
        self._static("world/home", rr.Points3D([[0.0, 0.0, 0.0]], radii=0.15, colors=[VELOCITY], labels=["home"]))
        # The camera follows the middle of an entity and takes its distance from that entity's size.
        corners = [[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
        self._static(FOLLOWED, rr.Points3D(np.array(corners) * 0.5 * frame.size, radii=1e-4, colors=[(0, 0, 0, 0)]))
        self._static(f"{AIRCRAFT}/body", _mesh(frame.body))
        self._static(f"{AIRCRAFT}/wing/structure", _mesh(frame.wing))
        for flap in frame.flaps:
            self._static(f"{AIRCRAFT}/{flap.path}", _placed(flap.origin, flap.axes))
            self._static(f"{AIRCRAFT}/{flap.path}/surface", _mesh(flap.mesh))
        for propeller in frame.propellers:
            self._static(f"{AIRCRAFT}/{propeller.path}", _placed(propeller.hub, propeller.axes))
            self._static(f"{AIRCRAFT}/{propeller.path}/disk", _mesh(propeller.swept))
            self._static(f"{AIRCRAFT}/{propeller.path}/blades", _mesh(propeller.blades))
        arrows = rr.Arrows3D.from_fields
        self._static(f"{AIRCRAFT}/forces/thrust", arrows(colors=[_packed(THRUST)], radii=[0.016]))
        self._static(f"{AIRCRAFT}/forces/air", arrows(radii=[0.010]))
        self._static(f"{AIRCRAFT}/forces/ground", arrows(colors=[_packed(CONTACT)], radii=[0.010]))
        self._static("world/velocity", arrows(colors=[_packed(VELOCITY)], radii=[0.014]))
        self._static("world/wind", arrows(colors=[_packed(WIND)], radii=[0.012]))
        self._static("world/trail", rr.LineStrips3D.from_fields(colors=[_packed(TRAIL)], radii=[-1.5]))
        for plot in PLOTS:
            widths = [1.5] * len(plot.names)
            self._static(plot.path, rr.SeriesLines(names=plot.names, colors=[*plot.colors], widths=widths))
        self._static("world/plumb", rr.LineStrips3D.from_fields(colors=[_packed(PLUMB)], radii=[-0.7]))
        self._static("map/track", rr.GeoPoints.from_fields(colors=[_packed(TRAIL)], radii=[-2.0]))
        self._static("key", rr.TextDocument(self._key(), media_type=rr.MediaType.MARKDOWN))

    def _key(self) -> str:
        scale = self._airframe.newtons_per_metre
        return (
            f"**{self._airframe.name}**: 1 m of arrow = {scale:g} N, or {1.0 / METRES_PER_SPEED:g} m/s\n\n"
            "**orange** thrust · **blue** air load, **red** where stalled · **purple** ground\n\n"
            "**green** velocity · **cyan** wind · **yellow** trail of the last minute\n\n"
            f"Wing tips: red left, green right. Propellers are shown turning {1.0 / SHOWN_ROTATION:.0f} times slower."
        )

    def send(self, rows: np.ndarray) -> None:
        """Add a block of snapshots, an array of ROW in the order of flight; needs at least one row."""
        self._motion(rows)
        self._forces(rows)
        self._speeds(rows)
        self._plumb(rows)
        self._trail(rows)
        self._map(rows)
        for plot in PLOTS:
            values = plot.values(rows, self._airframe.tilting)
            columns = rr.Scalars.columns(scalars=values.reshape(-1)).partition(np.full(len(rows), values.shape[1]))
            self._send(plot.path, rows, columns)
        self._last = rows[-1].copy()

    def text(self, wall_time: float, sim_time: float, severity: int, text: str) -> None:
        """Add a message: seconds since 1970, simulated seconds, MAV_SEVERITY 0 to 7."""
        columns = rr.TextLog.columns(text=[text], level=[LEVELS[severity]])
        self._recording.send_columns("messages", _times([sim_time], [wall_time]), columns)

    def _motion(self, rows: np.ndarray) -> None:
        frame = self._airframe
        attitude = rows["quaternion"][:, [1, 2, 3, 0]]
        self._send(AIRCRAFT, rows, rr.Transform3D.columns(translation=rows["position_ned"], quaternion=attitude))
        pivot = np.tile(frame.pivot, (len(rows), 1))
        wing = rr.Transform3D.columns(translation=pivot, quaternion=_about(1, rows["tilt"]))
        self._send(f"{AIRCRAFT}/wing", rows, wing)
        for flap in frame.flaps:
            turn = rr.Transform3D.columns(quaternion=_about(1, rows["state"][:, flap.state]))
            self._send(f"{AIRCRAFT}/{flap.path}/surface", rows, turn)
        before = rows["time"][0] if self._last is None else self._last["time"]
        elapsed = np.diff(rows["time"], prepend=before)
        elapsed[(elapsed < 0.0) | (elapsed > 1.0)] = 0.0
        for index, propeller in enumerate(frame.propellers):
            turned = rows["state"][:, ROTOR_SPEED + index] * elapsed * (propeller.spin * SHOWN_ROTATION)
            angles = self._phase[index] + np.cumsum(turned)
            self._phase[index] = angles[-1] % (2.0 * math.pi)
            turn = rr.Transform3D.columns(quaternion=_about(2, angles))
            self._send(f"{AIRCRAFT}/{propeller.path}/blades", rows, turn)

    def _forces(self, rows: np.ndarray) -> None:
        """Where each part's force acts and how large it is, in body axes."""
        frame, outputs = self._airframe, rows["outputs"]
        scale = 1.0 / frame.newtons_per_metre
        rotors, surfaces, contacts = len(frame.propellers), len(frame.tilting), len(frame.contacts)
        points, forces = outputs["rotor_point_body"][:, :rotors], outputs["rotor_force_body"][:, :rotors]
        self._arrows(f"{AIRCRAFT}/forces/thrust", rows, points, forces * scale)

        fuselage = np.broadcast_to(frame.fuselage_point, (len(rows), 1, 3))
        points = np.concatenate([outputs["surface_point_body"][:, :surfaces], fuselage], axis=1)
        forces = np.concatenate(
            [outputs["surface_force_body"][:, :surfaces], outputs["fuselage_force_body"][:, None]], axis=1
        )
        colors = np.full((len(rows), surfaces + 1), _packed(AIR_LOAD), np.uint32)
        colors[:, :surfaces][outputs["stall_margin"][:, :surfaces] < 0.0] = _packed(STALLED)
        self._arrows(f"{AIRCRAFT}/forces/air", rows, points, forces * scale, colors)

        if contacts:
            points = np.broadcast_to(frame.contacts, (len(rows), contacts, 3))
            forces = outputs["contact_force_body"][:, :contacts]
            self._arrows(f"{AIRCRAFT}/forces/ground", rows, points, forces * scale)

    def _speeds(self, rows: np.ndarray) -> None:
        here = rows["position_ned"][:, None]
        self._arrows("world/velocity", rows, here, rows["velocity_ned"][:, None] * METRES_PER_SPEED)
        wind = rows["wind_ned"][:, None] * METRES_PER_SPEED
        above = here - [0.0, 0.0, 1.0]  # clear of the aircraft, its tip over the centre of mass
        self._arrows("world/wind", rows, above - wind, wind)

    def _plumb(self, rows: np.ndarray) -> None:
        """Line straight down to the ground, which shows the height."""
        lines = np.repeat(rows["position_ned"][:, None], 2, axis=1)
        lines[:, 1, 2] += rows["outputs"]["height_above_ground"]
        self._send("world/plumb", rows, rr.LineStrips3D.columns(strips=lines))

    def _trail(self, rows: np.ndarray) -> None:
        """One piece of line per block, from the end of the last one; the view shows those of the last minute."""
        path = rows["position_ned"]
        if self._last is not None:
            path = np.concatenate([self._last["position_ned"][None], path])
        jumps = np.flatnonzero(np.linalg.norm(np.diff(path, axis=0), axis=1) > TELEPORT)
        path = path[jumps[-1] + 1 :] if len(jumps) else path
        if len(path) > 1:
            columns = rr.LineStrips3D.columns(strips=[path]).partition([1])
            self._send("world/trail", rows[-1:], columns)

    def _map(self, rows: np.ndarray) -> None:
        chosen = []
        for index, time in enumerate(rows["time"]):
            if time >= self._next_map or time < self._next_map - 2.0 * MAP_INTERVAL:
                chosen.append(index)
                self._next_map = time + MAP_INTERVAL
        if chosen:
            some = rows[chosen]
            degrees = np.degrees(np.column_stack([some["latitude"], some["longitude"]]))
            self._send("map/track", some, rr.GeoPoints.columns(positions=degrees))

    def _arrows(
        self, path: str, rows: np.ndarray, origins: np.ndarray, vectors: np.ndarray, colors: np.ndarray | None = None
    ) -> None:
        """Arrows of shape (rows, arrows, 3)."""
        each = np.full(len(rows), vectors.shape[1])
        flat = None if colors is None else colors.reshape(-1)
        columns = rr.Arrows3D.columns(vectors=vectors.reshape(-1, 3), origins=origins.reshape(-1, 3), colors=flat)
        self._send(path, rows, columns.partition(each))

    def _send(self, path: str, rows: np.ndarray, columns: Any) -> None:
        self._recording.send_columns(path, _times(rows["time"], rows["wall_time"]), columns)

    def _static(self, path: str, what: Any) -> None:
        self._recording.log(path, what, static=True)


def _times(sim_time: Any, wall_time: Any) -> list[rr.TimeColumn]:
    return [rr.TimeColumn("sim_time", duration=sim_time), rr.TimeColumn("wall_time", timestamp=wall_time)]
