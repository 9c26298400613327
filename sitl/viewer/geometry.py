"""The aircraft as meshes, built from the same records that the equations of motion read.

What tilts, turns or deflects is a part of its own; everything else is one mesh per moving frame. Body axes (forward,
right, down) about the centre of mass; parts of the wing in wing axes about the pivot.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sitl.viewer.mesh import Mesh, airfoil, disk, ellipse, join, loft, tube
from vehicle_model.earth import STANDARD_GRAVITY
from vehicle_model.state import TILT

if TYPE_CHECKING:
    from vehicle_model.aircraft import Aircraft

__all__ = ["Airframe", "Flap", "Propeller", "airframe", "quaternion_xyzw"]

HULL = (222, 226, 230)
WING = (120, 144, 168)
FLAP = (84, 104, 128)
DARK = (52, 58, 64)
PORT = (214, 48, 49)  # left wing tip red, right one green, as the navigation lights
STARBOARD = (46, 160, 67)
BLUR = (255, 196, 120, 40)

HINGE = 0.72  # flaps begin at this fraction of the chord


@dataclass(frozen=True, slots=True)
class Flap:
    """A control surface: turns about the y axis of its hinge frame by a servo's angle."""

    path: str
    origin: np.ndarray  # (3,) in body or wing axes [m]
    axes: np.ndarray  # (3, 3): columns chord forward, along the hinge, normal
    state: int  # index of its angle in the state vector
    mesh: Mesh


@dataclass(frozen=True, slots=True)
class Propeller:
    """A rotor: blades that turn about the z axis of the hub frame, and the disk they sweep."""

    path: str
    hub: np.ndarray  # (3,) in body or wing axes [m]
    axes: np.ndarray  # (3, 3): columns, the last one the thrust direction
    spin: float
    blades: Mesh
    swept: Mesh


@dataclass(frozen=True, slots=True)
class Airframe:
    """All the viewer needs to know about an aircraft."""

    name: str
    pivot: np.ndarray  # (3,) wing pivot, body axes [m]
    body: Mesh
    wing: Mesh
    flaps: list[Flap]
    propellers: list[Propeller]
    tilting: np.ndarray  # (surfaces,) bool: strips of the wing, whose stall margin counts
    fuselage_point: np.ndarray  # (3,) where fuselage drag acts, body axes [m]
    contacts: np.ndarray  # (contacts, 3) body axes [m]
    size: float  # the larger of span and length [m]
    newtons_per_metre: float  # scale of force arrows


def airframe(aircraft: "Aircraft") -> Airframe:
    """Meshes and drawing data of an aircraft (`vehicle_model.aircraft`)."""
    vehicle = aircraft.vehicle[0]
    surfaces = vehicle["surfaces"][: vehicle["surface_count"]]
    rotors = vehicle["rotors"][: vehicle["rotor_count"]]
    contacts = vehicle["contacts"]["position"][: vehicle["contact_count"]]
    body: list[Mesh] = [_fuselage(aircraft)]
    wing: list[Mesh] = []
    flaps: list[Flap] = []
    outermost = max((abs(s["position"][1]) for s in surfaces if s["tilts"]), default=0.0)
    for name, surface in zip(aircraft.surface_names, surfaces, strict=True):
        tip = surface["tilts"] and abs(surface["position"][1]) > outermost - 1e-6
        color = (PORT if surface["position"][1] < 0.0 else STARBOARD) if tip else WING
        fixed, flap = _surface(surface, _path(surface, name) + "_flap", color, aircraft.shapes.airfoil_thickness)
        (wing if surface["tilts"] else body).append(fixed)
        if flap is not None:
            flaps.append(flap)
    propellers = [
        _propeller(rotor, _path(rotor, name) + "_rotor")
        for name, rotor in zip(aircraft.rotor_names, rotors, strict=True)
    ]
    wing += [_nacelle(rotor, aircraft) for rotor in rotors if rotor["tilts"]]
    wing.append(_spar(surfaces))
    body += [_pylon(rotor) for rotor in rotors if not rotor["tilts"]]
    body += [_leg(contact, vehicle) for contact in contacts]
    return Airframe(
        name=aircraft.name,
        pivot=np.array(vehicle["pivot"]),
        body=join(body),
        wing=join(wing),
        flaps=flaps,
        propellers=propellers,
        tilting=surfaces["tilts"] == 1,
        fuselage_point=np.array(vehicle["fuselage_position"]),
        contacts=np.array(contacts),
        size=max(aircraft.wing.span, aircraft.fuselage.length),
        newtons_per_metre=_arrow_scale(float(vehicle["mass"]) * STANDARD_GRAVITY, aircraft.wing.span),
    )


def quaternion_xyzw(axes: np.ndarray) -> np.ndarray:
    """Unit quaternion (x, y, z, w) of a rotation matrix (3, 3), any angle (Shepperd's choice of the largest term)."""
    m = axes
    squares = np.array(
        [1.0 + m[0, 0] - m[1, 1] - m[2, 2], 1.0 - m[0, 0] + m[1, 1] - m[2, 2],
         1.0 - m[0, 0] - m[1, 1] + m[2, 2], 1.0 + m[0, 0] + m[1, 1] + m[2, 2]]
    )  # fmt: skip
    k = int(np.argmax(squares))
    products = np.array(
        [
            [squares[0], m[0, 1] + m[1, 0], m[0, 2] + m[2, 0], m[2, 1] - m[1, 2]],
            [m[0, 1] + m[1, 0], squares[1], m[1, 2] + m[2, 1], m[0, 2] - m[2, 0]],
            [m[0, 2] + m[2, 0], m[1, 2] + m[2, 1], squares[2], m[1, 0] - m[0, 1]],
            [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], squares[3]],
        ]
    )
    return products[k] / (2.0 * math.sqrt(squares[k]))


def _arrow_scale(weight: float, span: float) -> float:
    """Newtons per metre of arrow, a round number: the weight would be about 1.2 spans long."""
    wanted = weight / (1.2 * max(span, 0.1))
    decade = 10.0 ** math.floor(math.log10(wanted))
    return decade * min((1.0, 2.0, 5.0, 10.0), key=lambda step: abs(math.log(wanted / (decade * step))))


def _surface(surface: np.void, path: str, color: tuple[int, int, int], thickness: float) -> tuple[Mesh, Flap | None]:
    """Fixed part of a lifting surface in its mounting axes, and its flap if a servo moves one."""
    normal = np.array(surface["normal"])
    chord_axis = np.array(surface["chord_axis"])
    axes = np.stack([chord_axis, np.cross(normal, chord_axis), normal], -1)
    chord, span = float(surface["chord"]), float(surface["area"] / surface["chord"])
    position = np.array(surface["position"])
    moves = surface["servo"] >= 0
    fixed = _extruded(airfoil(0.0, HINGE if moves else 1.0, thickness), chord, span, color).moved(axes, position)
    if not moves:
        return fixed, None
    hinge = np.array([(0.25 - HINGE) * chord, 0.0, 0.0])
    mesh = _extruded(airfoil(HINGE, 1.0, thickness), chord, 0.97 * span, FLAP).moved(np.eye(3), -hinge)
    return fixed, Flap(path, position + axes @ hinge, axes, TILT + int(surface["servo"]), mesh)


def _path(part: np.void, name: str) -> str:
    """Entity path of a part below the aircraft's."""
    return ("wing/" if part["tilts"] else "") + name.replace(" ", "_")


def _extruded(outline: np.ndarray, chord: float, span: float, color: tuple[int, int, int]) -> Mesh:
    ring = np.stack([outline[:, 0] * chord, np.zeros(len(outline)), outline[:, 1] * chord], -1)
    return loft(np.stack([ring + [0.0, -0.5 * span, 0.0], ring + [0.0, 0.5 * span, 0.0]]), color)


def _axes_along(direction: np.ndarray) -> np.ndarray:
    """Right-handed axes (3, 3) whose last column is `direction`."""
    z = direction / np.linalg.norm(direction)
    x = np.cross([0.0, 1.0, 0.0], z)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], -1)


def _propeller(rotor: np.void, path: str) -> Propeller:
    """Blades of the rotor's chord, number and twist, the pitch held below 60 degrees near the hub."""
    radius, blades = float(rotor["radius"]), max(2, round(float(rotor["blades"])))
    stations = np.linspace(0.12, 1.0, 8)
    section = airfoil(0.0, 1.0, thickness=0.10, points=6)
    rings = []
    for station in stations:
        pitch = min(abs(float(rotor["twist"])) * 0.75 / station, math.radians(60.0))
        chord = float(rotor["blade_chord"]) * (0.6 + 0.8 * math.sin(math.pi * min(station, 0.92)))
        # At +x the blade moves towards y spin: its leading edge points there, raised towards the thrust.
        along = np.array([0.0, math.cos(pitch) * rotor["spin"], math.sin(pitch)])
        across = np.array([0.0, -math.sin(pitch) * rotor["spin"], math.cos(pitch)])
        outline = section * chord
        rings.append([station * radius, 0.0, 0.0] + outline[:, :1] * along + outline[:, 1:] * across)
    blade = loft(np.array(rings), DARK)
    turned = []
    for k in range(blades):
        angle = 2.0 * math.pi * k / blades
        c, s = math.cos(angle), math.sin(angle)
        turned.append(blade.moved(np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]), np.zeros(3)))
    circle = ellipse(14)
    spinner = [
        np.concatenate([circle * r * radius, np.full((14, 1), z * radius)], -1)
        for z, r in ((-0.06, 0.13), (0.02, 0.12), (0.10, 0.08), (0.15, 0.01))
    ]
    return Propeller(
        path=path,
        hub=np.array(rotor["position"]),
        axes=_axes_along(np.array(rotor["axis"])),
        spin=float(rotor["spin"]),
        blades=join([*turned, loft(np.array(spinner), HULL)]),
        swept=disk(radius, BLUR),
    )


def _nacelle(rotor: np.void, aircraft: "Aircraft") -> Mesh:
    """Motor housing behind the hub of a rotor on the wing."""
    length, radius = aircraft.shapes.nacelle_length, 0.5 * aircraft.shapes.nacelle_diameter
    circle = ellipse(16)
    rings = [
        np.concatenate([circle * r * radius, np.full((16, 1), -z * length)], -1)
        for z, r in ((0.0, 0.7), (0.15, 1.0), (0.6, 1.0), (0.85, 0.7), (1.0, 0.15))
    ]
    return loft(np.array(rings), HULL).moved(_axes_along(np.array(rotor["axis"])), np.array(rotor["position"]))


def _spar(surfaces: np.ndarray) -> Mesh:
    """The tube about which the wing tilts, through its innermost strips."""
    reach = min(abs(float(s["position"][1])) for s in surfaces if s["tilts"])
    return tube(np.array([0.0, -reach, 0.0]), np.array([0.0, reach, 0.0]), 0.012, DARK)


def _fuselage(aircraft: "Aircraft") -> Mesh:
    """Body of the given length, width and height from the nose back, tapering to the tail."""
    shape = aircraft.fuselage
    nose = np.array(shape.nose) - np.array(aircraft.mass_properties.centre_of_mass)
    circle = ellipse(24)
    # Fraction of the length, of the full section, and rise of the axis as a fraction of the height.
    stations = (
        (0.0, 0.02, 0.0), (0.01, 0.22, 0.0), (0.04, 0.48, 0.0), (0.10, 0.78, 0.0), (0.20, 0.98, 0.0), (0.42, 1.0, 0.0),
        (0.55, 0.80, 0.05), (0.70, 0.45, 0.12), (0.85, 0.30, 0.16), (0.97, 0.22, 0.18), (1.0, 0.05, 0.18),
    )  # fmt: skip
    rings = []
    for along, size, rise in stations:
        y = nose[1] + circle[:, 0] * 0.5 * shape.width * size
        z = nose[2] + circle[:, 1] * 0.5 * shape.height * size - rise * shape.height
        rings.append(np.stack([np.full(24, nose[0] - along * shape.length), y, z], -1))
    return loft(np.array(rings), HULL)


def _pylon(rotor: np.void) -> Mesh:
    hub, axis = np.array(rotor["position"]), np.array(rotor["axis"])
    return tube(hub - axis * 0.35 * rotor["radius"], hub, 0.12 * float(rotor["radius"]), DARK)


def _leg(contact: np.ndarray, vehicle: np.void) -> Mesh:
    """Strut from a ground contact point up to the fuselage axis, leaning inwards."""
    foot = np.array(contact)
    top = np.array([foot[0] * 0.85, foot[1] * 0.35, min(0.0, foot[2])])
    return tube(top, foot, 0.008 + 1e-4 * float(vehicle["mass"]), DARK)
