"""The aircraft: what the VEHICLE record says follows from the file by geometry, and values can be exchanged."""

import math
from collections.abc import Iterator
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vehicle_model.aircraft import Aircraft, load_aircraft
from vehicle_model.aircraft_schema import fields_of
from vehicle_model.records import VEHICLE
from vehicle_model.surface import coefficients

BENT = {"wing.dihedral": 0.07, "wing.incidence": 0.05, "wing.taper": 0.6, "wing.quarter_chord_z": -0.03}


@pytest.fixture(scope="module")
def aircraft() -> Aircraft:
    return load_aircraft()


def _surfaces(aircraft: Aircraft) -> dict[str, Any]:
    return dict(zip(aircraft.surface_names, aircraft.vehicle[0]["surfaces"], strict=False))


def _numbers(table: msgspec.Struct, path: str = "") -> Iterator[tuple[str, Any]]:
    """Dotted path and value of every number and vector of an aircraft."""
    for name in fields_of(type(table)):
        value = getattr(table, name)
        if isinstance(value, msgspec.Struct):
            yield from _numbers(value, f"{path}{name}.")
        elif isinstance(value, tuple) and isinstance(value[0], msgspec.Struct):
            for index, item in enumerate(value):
                yield from _numbers(item, f"{path}{name}.{index}.")
        elif isinstance(value, tuple | int | float) and not isinstance(value, bool):
            yield path + name, value


def test_the_shipped_aircraft_has_all_its_parts_in_one_read_only_record(aircraft: Aircraft) -> None:
    vehicle = aircraft.vehicle
    assert vehicle.dtype == VEHICLE
    assert vehicle.shape == (1,)
    assert (vehicle["rotor_count"], vehicle["surface_count"]) == (3, len(aircraft.surface_names))
    with pytest.raises(ValueError, match="read-only"):
        vehicle["mass"] = 1.0


def test_right_wing_is_the_mirror_image_of_the_left(aircraft: Aircraft) -> None:
    surfaces = _surfaces(aircraft.with_values(BENT))
    mirror = np.array([1.0, -1.0, 1.0])
    for strip in aircraft.wing.strips:
        left, right = surfaces[f"left {strip.name}"], surfaces[f"right {strip.name}"]
        for vector in ("position", "chord_axis", "normal"):
            np.testing.assert_array_equal(left[vector] * mirror, right[vector])
        assert right["position"][1] > 0
        assert (left["rotor"], right["rotor"]) == ((0, 1) if strip.wetted else (-1, -1))
        assert (left["servo"], right["servo"]) == ((1, 2) if strip.aileron else (-1, -1))
        sided = {"position", "chord_axis", "normal", "rotor", "servo"}
        for name in set(left.dtype.names) - sided:
            assert left[name] == right[name], name


def test_wing_rotors_mirror_each_other_and_turn_opposite_ways(aircraft: Aircraft) -> None:
    left, right, tail = aircraft.vehicle[0]["rotors"]
    np.testing.assert_array_equal(left["position"] * [1.0, -1.0, 1.0], right["position"])
    assert left["spin"] == -right["spin"]
    for name in set(left.dtype.names) - {"position", "spin"}:
        np.testing.assert_array_equal(left[name], right[name])
    np.testing.assert_array_equal(tail["axis"], [0.0, 0.0, -1.0])
    assert (left["tilts"], tail["tilts"]) == (1, 0)
    assert (left["min_throttle"], tail["min_throttle"]) == (0.0, -1.0)


def test_strip_axes_are_square_with_the_nose_up_and_the_tips_up(aircraft: Aircraft) -> None:
    bent = aircraft.with_values(BENT)
    surfaces = _surfaces(bent)
    for surface in surfaces.values():
        chord_axis, normal = surface["chord_axis"], surface["normal"]
        if surface["area"] > 0:
            assert np.linalg.norm(chord_axis) == pytest.approx(1.0, abs=1e-15)
            assert np.linalg.norm(normal) == pytest.approx(1.0, abs=1e-15)
            assert chord_axis @ normal == pytest.approx(0.0, abs=1e-15)
    root, tip = surfaces["right inboard"], surfaces["right outboard"]
    along_span = tip["position"] - root["position"]
    assert math.atan2(-along_span[2], along_span[1]) == pytest.approx(0.07)  # z is down: the tip is higher
    assert along_span @ root["normal"] == pytest.approx(0.0, abs=1e-15)
    assert math.asin(root["normal"][0]) == pytest.approx(0.05)  # flow along x meets the lower side
    assert root["chord_axis"][2] < 0


@given(taper=st.floats(0.2, 1.0), chord=st.floats(0.1, 0.5))
def test_strip_areas_add_up_to_the_trapezoids_they_cover(taper: float, chord: float) -> None:
    wing = load_aircraft().with_values({"wing.taper": taper, "wing.chord": chord})
    half, inner = wing.wing.span / 2, min(strip.y - strip.width / 2 for strip in wing.wing.strips)
    root = 2 * chord / (1 + taper)

    def area_to(y: float) -> float:  # integral of root (1 - (1 - taper) y/half)
        return root * (y - (1 - taper) * y * y / (2 * half))

    areas = [surface["area"] for name, surface in _surfaces(wing).items() if name.startswith(("left", "right"))]
    assert sum(areas) == pytest.approx(2 * (area_to(half) - area_to(inner)), rel=1e-9)


@given(shift=st.tuples(*[st.floats(-0.2, 0.2)] * 3))
def test_moving_the_centre_of_mass_moves_all_that_is_on_the_body_the_other_way(
    shift: tuple[float, float, float],
) -> None:
    before = load_aircraft()
    centre = np.array(before.mass_properties.centre_of_mass) + shift
    one, two = before.vehicle[0], before.with_values({"mass_properties.centre_of_mass": centre}).vehicle[0]
    for name in ("pivot", "fuselage_position"):
        np.testing.assert_allclose(two[name], one[name] - shift, atol=1e-15)
    for group, count in (("rotors", "rotor_count"), ("surfaces", "surface_count"), ("contacts", "contact_count")):
        for old, new in zip(one[group][: one[count]], two[group][: two[count]], strict=True):
            on_wing = group != "contacts" and old["tilts"]
            np.testing.assert_allclose(new["position"], old["position"] - np.multiply(shift, not on_wing), atol=1e-15)
    np.testing.assert_array_equal(one["inertia"], two["inertia"])


def test_inertia_tensor_has_the_product_with_a_minus_sign_and_its_inverse_beside_it(aircraft: Aircraft) -> None:
    vehicle = aircraft.with_values({"mass_properties.ixz": 0.2}).vehicle[0]
    m = aircraft.mass_properties
    np.testing.assert_array_equal(vehicle["inertia"], [[m.ixx, 0, -0.2], [0, m.iyy, 0], [-0.2, 0, m.izz]])
    np.testing.assert_allclose(vehicle["inertia"] @ vehicle["inertia_inverse"], np.eye(3), atol=1e-12)


def test_paper_slipstream_leaves_wetted_strips_the_wake_alone(aircraft: Aircraft) -> None:
    literal = aircraft.with_values({"wing.slipstream": "paper"})
    for strip in aircraft.wing.strips:
        surface = _surfaces(literal)[f"left {strip.name}"]
        factors = [float(surface[name]) for name in ("wake_factor", "freestream_factor", "induced_drag")]
        assert factors == ([1.0, 0.0, 0.0] if strip.wetted else [0.0, 1.0, aircraft.wing.induced_drag])


def test_angle_of_greatest_lift_is_where_the_lift_curve_peaks(aircraft: Aircraft) -> None:
    for name, surface in _surfaces(aircraft).items():
        peak = float(surface["max_lift_angle"])
        lifts = [coefficients(surface, math.sin(a), math.cos(a), 0.0)[0] for a in (peak - 0.01, peak, peak + 0.01)]
        assert lifts[1] == max(lifts) > 0, name


def test_every_number_can_be_replaced_by_its_path_and_leaves_the_original_as_it_was(aircraft: Aircraft) -> None:
    before = msgspec.structs.asdict(aircraft)
    record = aircraft.vehicle.copy()
    paths = dict(_numbers(aircraft))
    assert len(paths) > 100
    for path, value in paths.items():
        same = aircraft.with_values({path: value})
        np.testing.assert_array_equal(same.vehicle, record)
        assert same.source_file == aircraft.source_file
    lighter = aircraft.with_values({"mass_properties.mass": aircraft.mass_properties.mass * 0.9})
    assert lighter.vehicle["mass"][0] == pytest.approx(0.9 * record["mass"][0])
    assert msgspec.structs.asdict(aircraft) == before
    np.testing.assert_array_equal(aircraft.vehicle, record)


def test_named_tables_components_and_numpy_values_can_be_replaced(aircraft: Aircraft) -> None:
    changed = aircraft.with_values(
        {
            "wing.strips.wetted.aileron": False,
            "wing.pivot.z": np.float32(-0.125),
            "contacts.rear.friction": np.float64(0.75),
            "rotors.wing.blades": 3,
        }
    )
    assert changed.wing.pivot == (*aircraft.wing.pivot[:2], -0.125)
    assert _surfaces(changed)["left wetted"]["servo"] == -1
    assert changed.vehicle[0]["rotors"][0]["blades"] == 3
    assert [contact.friction for contact in changed.contacts if contact.name == "rear"] == [0.75]


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        ("wing.chrod", 0.3, r'wing\.chrod: no such value; did you mean "chord"\?'),
        ("wing.strips.wet.y", 0.3, r'wing\.strips\.wet: no such table; did you mean "wetted"\?'),
        ("wing.chord", -0.3, r"wing\.chord: expected a length in m between 0\.02 and 3, got -0\.3 m"),
        ("wing.chord", math.nan, r"wing\.chord: expected a length .*, got nan m"),
        ("wing.chord", "0.3", r'wing\.chord: expected a length .*, got "0\.3"'),
        ("wing.incidence", 0.5, r"wing\.incidence: expected an angle in deg between -15 and 15, got 28\.64789 deg"),
        ("wing.pivot", [0.0, 0.0], r"wing\.pivot: expected \[x, y, z\], each a length .*, got \[0, 0\]"),
        ("wing.pivot.w", 0.0, r"wing\.pivot\.w: no such value"),
        ("wing", 0.0, r"wing: expected the name of a value in this table"),
        ("wing.strips", 0.0, r"wing\.strips: expected the name or index"),
        ("wing.strips.0.wetted", 1, r"wing\.strips\.0\.wetted: expected true or false, got 1"),
        ("wing.slipstream", "none", r'wing\.slipstream: expected "vector" or "paper", got "none"'),
        ("rotors.wing.blades", 2.5, r"rotors\.wing\.blades: expected a whole number between 1 and 8, got 2\.5"),
        ("wing.span", 4.0, r"wing\.span: expected 2 m, where the outermost strips end, got 4 m"),
    ],
)
def test_implausible_replacements_are_refused_by_path(aircraft: Aircraft, path: str, value: Any, message: str) -> None:
    with pytest.raises(ValueError, match=f"^{message}"):
        aircraft.with_values({path: value})
