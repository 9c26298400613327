"""Triangle meshes from cross sections: all that is needed to draw an aircraft."""

import math
from dataclasses import dataclass

import numpy as np

__all__ = ["Mesh", "airfoil", "disk", "ellipse", "join", "loft", "tube"]


@dataclass(frozen=True, slots=True)
class Mesh:
    """Vertices (n, 3) [m], triangles (m, 3) of vertex indices, unit normals (n, 3), RGBA colours (n, 4) of 0..255."""

    vertices: np.ndarray
    triangles: np.ndarray
    normals: np.ndarray
    colors: np.ndarray

    def moved(self, rotation: np.ndarray, translation: np.ndarray) -> "Mesh":
        """Mesh with every vertex v at `rotation` (3, 3) v + `translation` (3,)."""
        return Mesh(self.vertices @ rotation.T + translation, self.triangles, self.normals @ rotation.T, self.colors)


def join(meshes: list[Mesh]) -> Mesh:
    """One mesh of several."""
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes[:-1])])
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.triangles + start for mesh, start in zip(meshes, starts, strict=True)]),
        np.concatenate([mesh.normals for mesh in meshes]),
        np.concatenate([mesh.colors for mesh in meshes]),
    )


def loft(rings: np.ndarray, color: tuple[int, int, int, int] | tuple[int, int, int]) -> Mesh:
    """Skin over closed cross sections, capped at both ends.

    `rings` (sections, points, 3): corresponding points follow each other around each section. Which way around
    does not matter: faces and normals are turned outwards.
    """
    sections, points, _ = rings.shape
    skin = rings.reshape(-1, 3)
    row, column = np.meshgrid(np.arange(sections - 1) * points, np.arange(points), indexing="ij")
    a = row + column
    b = row + (column + 1) % points
    triangles = np.concatenate(
        [np.stack([a, b, a + points], -1).reshape(-1, 3), np.stack([b, b + points, a + points], -1).reshape(-1, 3)]
    )
    # The caps have vertices of their own, so that the edge between skin and cap stays sharp.
    first, last = len(skin), len(skin) + points
    fan = np.stack([np.zeros(points - 2, int), np.arange(2, points), np.arange(1, points - 1)], -1)
    vertices = np.concatenate([skin, rings[0], rings[-1]])
    triangles = np.concatenate([triangles, fan + first, fan[:, ::-1] + last])
    corner = vertices[triangles]
    if np.einsum("ij,ij->", np.cross(corner[:, 0], corner[:, 1]), corner[:, 2]) < 0.0:  # six times the volume
        triangles = triangles[:, ::-1]
    return _shaded(vertices, triangles, color)


def _shaded(vertices: np.ndarray, triangles: np.ndarray, color: tuple[int, ...]) -> Mesh:
    corner = vertices[triangles]
    faces = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])  # twice the area long
    normals = np.zeros_like(vertices)
    for k in range(3):
        np.add.at(normals, triangles[:, k], faces)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    rgba = np.array([*color, 255][:4], np.uint8)
    return Mesh(vertices, triangles, normals, np.tile(rgba, (len(vertices), 1)))


def ellipse(points: int = 20) -> np.ndarray:
    """Unit circle, shape (points, 2)."""
    angle = np.arange(points) * (2.0 * math.pi / points)
    return np.stack([np.cos(angle), np.sin(angle)], -1)


def airfoil(start: float, end: float, thickness: float = 0.12, points: int = 12) -> np.ndarray:
    """Outline of a symmetric NACA four-digit section between two fractions of the chord.

    Shape (2 points, 2): x from the quarter point, forward positive, and thickness coordinate, both in chords.
    The thickness law is that of NACA Report 460, closed at the trailing edge.
    """
    s = start + (end - start) * 0.5 * (1.0 - np.cos(np.linspace(0.0, math.pi, points)))
    half = 5.0 * thickness * (0.2969 * np.sqrt(s) - 0.1260 * s - 0.3516 * s**2 + 0.2843 * s**3 - 0.1036 * s**4)
    half = np.maximum(half, 0.002)
    x = 0.25 - s
    return np.concatenate([np.stack([x, half], -1), np.stack([x, -half], -1)[::-1]])


def tube(start: np.ndarray, end: np.ndarray, radius: float, color: tuple[int, int, int]) -> Mesh:
    """Straight round rod between two points (3,)."""
    along = (end - start) / np.linalg.norm(end - start)
    side = np.cross(along, [1.0, 0.0, 0.0] if abs(along[0]) < 0.9 else [0.0, 1.0, 0.0])
    side /= np.linalg.norm(side)
    other = np.cross(along, side)
    circle = ellipse(10) @ np.stack([side, other]) * radius
    return loft(np.stack([start + circle, end + circle]), color)


def disk(radius: float, color: tuple[int, int, int, int], points: int = 40) -> Mesh:
    """Flat disk in the x-y plane around the origin, seen from both sides."""
    rim = np.concatenate([ellipse(points) * radius, np.zeros((points, 1))], -1)
    vertices = np.concatenate([np.zeros((1, 3)), rim])
    k = np.arange(points)
    triangles = np.stack([np.zeros(points, int), k + 1, (k + 1) % points + 1], -1)
    return _shaded(vertices, triangles, color)
