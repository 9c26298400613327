"""The drawn aircraft is the flown one, and its meshes are sound."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from sitl.viewer.geometry import airframe, quaternion_xyzw
from sitl.viewer.mesh import Mesh, airfoil, ellipse, loft, tube
from vehicle_model.aircraft import Aircraft
from vehicle_model.state import AILERON_LEFT, AILERON_RIGHT, ELEVATOR


def volume(mesh: Mesh) -> float:
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", np.cross(a, b), c)) / 6.0


def test_loft_of_equal_circles_has_the_volume_of_a_prism_and_outward_normals() -> None:
    mesh = tube(np.array([1.0, 2.0, 3.0]), np.array([1.0, 4.0, 3.0]), 0.5, (1, 2, 3))
    polygon = 10 * 0.5 * 0.5**2 * math.sin(2.0 * math.pi / 10)  # a ten-sided one in the circle
    assert volume(mesh) == pytest.approx(2.0 * polygon, rel=1e-12)
    outwards = mesh.vertices - np.array([1.0, 3.0, 3.0])
    assert np.all(np.einsum("ij,ij->i", outwards, mesh.normals) > 0.0)
    assert np.linalg.norm(mesh.normals, axis=1) == pytest.approx(np.ones(len(mesh.vertices)))


@given(st.booleans())
def test_loft_does_not_depend_on_the_sense_of_its_rings(reverse: bool) -> None:
    ring = np.concatenate([ellipse(16), np.zeros((16, 1))], -1)
    rings = np.stack([ring, 0.5 * ring + [0.0, 0.0, 1.0]])
    assert volume(loft(rings[:, ::-1] if reverse else rings, (0, 0, 0))) > 0.0


def test_airfoil_has_its_thickness_and_runs_from_leading_to_trailing_edge() -> None:
    outline = airfoil(0.0, 1.0, thickness=0.12, points=200)
    assert outline[:, 0].max() == pytest.approx(0.25)  # leading edge a quarter chord ahead of the quarter point
    assert outline[:, 0].min() == pytest.approx(-0.75)
    assert np.ptp(outline[:, 1]) == pytest.approx(0.12, rel=1e-3)


@given(arrays(float, 4, elements=st.floats(-1.0, 1.0)).filter(lambda q: np.linalg.norm(q) > 0.1))
def test_quaternion_of_a_rotation_matrix_turns_vectors_as_the_matrix_does(q: np.ndarray) -> None:
    x, y, z, w = q / np.linalg.norm(q)
    matrix = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    found = quaternion_xyzw(matrix)
    assert abs(found @ np.array([x, y, z, w])) == pytest.approx(1.0, abs=1e-12)


def test_wing_spans_and_sits_where_the_aircraft_file_says(aircraft: Aircraft) -> None:
    frame = airframe(aircraft)
    y = frame.wing.vertices[:, 1]
    assert y.max() == pytest.approx(0.5 * aircraft.wing.span, rel=0.01)
    assert y.min() == pytest.approx(-0.5 * aircraft.wing.span, rel=0.01)
    assert frame.pivot == pytest.approx(aircraft.vehicle[0]["pivot"])


def test_fuselage_has_its_length_from_the_nose_back(aircraft: Aircraft) -> None:
    x = airframe(aircraft).body.vertices[:, 0] + aircraft.mass_properties.centre_of_mass[0]
    assert x.max() == pytest.approx(aircraft.fuselage.nose[0], abs=1e-6)
    assert x.min() <= aircraft.fuselage.nose[0] - aircraft.fuselage.length + 1e-6


def test_left_and_right_mirror_each_other(aircraft: Aircraft) -> None:
    wing = airframe(aircraft).wing.vertices
    mirrored = wing * [1.0, -1.0, 1.0]
    distance = np.linalg.norm(wing[:, None] - mirrored[None], axis=2).min(axis=1)
    assert distance.max() < 1e-9


def test_positive_flap_angle_moves_the_trailing_edge_down(aircraft: Aircraft) -> None:
    flaps = {flap.state: flap for flap in airframe(aircraft).flaps}
    assert set(flaps) == {AILERON_LEFT, AILERON_RIGHT, ELEVATOR}
    angle = 0.3
    turn = np.array([[math.cos(angle), 0, math.sin(angle)], [0, 1, 0], [-math.sin(angle), 0, math.cos(angle)]])
    for flap in flaps.values():
        trailing = flap.mesh.vertices[np.argmin(flap.mesh.vertices[:, 0])]
        before, after = flap.axes @ trailing, flap.axes @ (turn @ trailing)
        assert after[2] > before[2] + 0.2 * abs(trailing[0])


def test_flap_continues_the_section_in_front_of_it(aircraft: Aircraft) -> None:
    surfaces = aircraft.vehicle[0]["surfaces"]
    names = {name.replace(" ", "_"): k for k, name in enumerate(aircraft.surface_names)}
    for flap in airframe(aircraft).flaps:
        surface = surfaces[names[flap.path.removeprefix("wing/").removesuffix("_flap")]]
        points = flap.mesh.vertices @ flap.axes.T + flap.origin - surface["position"]
        along = points @ surface["chord_axis"]
        assert along.min() == pytest.approx(-0.75 * surface["chord"], rel=1e-6)  # its trailing edge is the surface's


def test_propeller_blades_reach_the_radius_and_turn_leading_edge_first(aircraft: Aircraft) -> None:
    frame = airframe(aircraft)
    rotors = aircraft.vehicle[0]["rotors"]
    assert len(frame.propellers) == 3
    for propeller, rotor in zip(frame.propellers, rotors, strict=True):
        reach = np.linalg.norm(propeller.blades.vertices[:, :2], axis=1).max()
        assert reach == pytest.approx(rotor["radius"], rel=0.01)
        assert propeller.axes[:, 2] == pytest.approx(rotor["axis"])
        assert np.linalg.det(propeller.axes) == pytest.approx(1.0)
        assert propeller.spin == rotor["spin"]
        # Pitched like a screw: at +x, going the way it spins, the blade rises towards the thrust.
        blade = propeller.blades.vertices
        outer = blade[(blade[:, 0] > 0.6 * rotor["radius"]) & (abs(blade[:, 1]) < 0.3 * rotor["radius"])]
        slope = np.polyfit(outer[:, 1] * propeller.spin, outer[:, 2], 1)[0]
        assert slope > 0.1
