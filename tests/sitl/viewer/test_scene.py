"""What a recording holds is what was flown."""

import math

import numpy as np
import pytest

from sitl.snapshot import Snapshot
from sitl.viewer.geometry import airframe
from sitl.viewer.scene import METRES_PER_SPEED, SHOWN_ROTATION
from vehicle_model.aircraft import Aircraft
from vehicle_model.state import AILERON_LEFT, ELEVATOR, ROTOR_SPEED

Recorded = dict[str, dict[str, np.ndarray]]

SINGLE = 2e-7  # relative: the scene is stored in single precision, curves in double


def test_every_snapshot_is_there_once_on_both_timelines(recorded: Recorded, flight: list[Snapshot]) -> None:
    aircraft = recorded["/world/aircraft"]
    assert aircraft["sim_time"] == pytest.approx([s.time for s in flight], abs=1e-9)
    assert np.all(np.diff(aircraft["wall_time"]) >= 0.0)
    assert aircraft["wall_time"][0] > 1.6e9


def test_position_and_attitude_are_those_flown(recorded: Recorded, flight: list[Snapshot]) -> None:
    aircraft = recorded["/world/aircraft"]
    translation = aircraft["Transform3D:translation"].reshape(-1, 3)
    assert translation == pytest.approx(np.array([s.position_ned for s in flight]), rel=SINGLE)
    xyzw = aircraft["Transform3D:quaternion"].reshape(-1, 4)
    assert xyzw[:, [3, 0, 1, 2]] == pytest.approx(np.array([s.quaternion for s in flight]), abs=SINGLE)


def test_wing_turns_nose_up_by_the_tilt_angle(recorded: Recorded, flight: list[Snapshot]) -> None:
    x, y, z, w = recorded["/world/aircraft/wing"]["Transform3D:quaternion"].reshape(-1, 4).T
    assert np.all(x == 0.0)
    assert np.all(z == 0.0)
    assert 2.0 * np.arctan2(y, w) == pytest.approx([s.tilt for s in flight], abs=1e-6)


def test_flaps_turn_by_their_servos_angles(recorded: Recorded, flight: list[Snapshot]) -> None:
    for path, state in (("wing/left_wetted_flap", AILERON_LEFT), ("horizontal_tail_flap", ELEVATOR)):
        _, y, _, w = recorded[f"/world/aircraft/{path}/surface"]["Transform3D:quaternion"].reshape(-1, 4).T
        assert 2.0 * np.arctan2(y, w) == pytest.approx([s.state[state] for s in flight], abs=1e-6)


def test_propellers_turn_at_the_shown_fraction_of_their_speed(
    recorded: Recorded, flight: list[Snapshot], aircraft: Aircraft
) -> None:
    for index, propeller in enumerate(airframe(aircraft).propellers):
        path = f"/world/aircraft/{propeller.path}/blades"
        _, _, z, w = recorded[path]["Transform3D:quaternion"].reshape(-1, 4).T
        turned = np.unwrap(2.0 * np.arctan2(z, w))
        speeds = np.array([s.state[ROTOR_SPEED + index] for s in flight[1:]])
        expected = np.sum(speeds) * 0.02 * propeller.spin * SHOWN_ROTATION
        assert turned[-1] - turned[0] == pytest.approx(expected, rel=1e-5, abs=1e-5)


def test_force_arrows_are_the_parts_forces_at_the_documented_scale(
    recorded: Recorded, flight: list[Snapshot], aircraft: Aircraft
) -> None:
    frame = airframe(aircraft)
    outputs = np.array([s.outputs for s in flight])
    surfaces = len(frame.tilting)
    thrust, air = recorded["/world/aircraft/forces/thrust"], recorded["/world/aircraft/forces/air"]
    scale = frame.newtons_per_metre
    assert thrust["Arrows3D:vectors"] * scale == pytest.approx(outputs["rotor_force_body"], rel=SINGLE, abs=1e-6)
    assert thrust["Arrows3D:origins"] == pytest.approx(outputs["rotor_point_body"], rel=SINGLE, abs=1e-7)
    vectors = air["Arrows3D:vectors"] * scale
    assert vectors[:, :surfaces] == pytest.approx(outputs["surface_force_body"][:, :surfaces], rel=SINGLE, abs=1e-5)
    assert vectors[:, surfaces] == pytest.approx(outputs["fuselage_force_body"], rel=SINGLE, abs=1e-6)
    # The arrows add up to all that acts but gravity, so no part is missing from the picture.
    total = (thrust["Arrows3D:vectors"].sum(axis=1) + air["Arrows3D:vectors"].sum(axis=1)) * scale
    assert total == pytest.approx(outputs["force_body"], abs=1e-3)
    assert f"1 m of arrow = {scale:g} N" in recorded["/key"]["TextDocument:text"].item()


def test_arrow_of_a_stalled_surface_changes_colour(
    recorded: Recorded, flight: list[Snapshot], aircraft: Aircraft
) -> None:
    surfaces = len(airframe(aircraft).tilting)
    margins = np.array([s.outputs["stall_margin"][:surfaces] for s in flight])
    colors = recorded["/world/aircraft/forces/air"]["Arrows3D:colors"][:, :surfaces]
    stalled = margins < 0.0
    assert stalled.any(), "this flight is meant to show stalled strips"
    assert not stalled.all()
    assert len(set(colors[stalled])) == len(set(colors[~stalled])) == 1
    assert colors[stalled][0] != colors[~stalled][0]


def test_velocity_and_wind_arrows_follow_the_aircraft(recorded: Recorded, flight: list[Snapshot]) -> None:
    velocity, wind = recorded["/world/velocity"], recorded["/world/wind"]
    here = np.array([s.position_ned for s in flight])
    expected = np.array([s.velocity_ned for s in flight])
    assert velocity["Arrows3D:vectors"][:, 0] / METRES_PER_SPEED == pytest.approx(expected, rel=SINGLE, abs=1e-6)
    assert velocity["Arrows3D:origins"][:, 0] == pytest.approx(here, rel=SINGLE)
    blowing = wind["Arrows3D:vectors"][:, 0] / METRES_PER_SPEED
    assert blowing == pytest.approx(np.array([s.wind_ned for s in flight]), rel=SINGLE)


def test_trail_passes_every_position_and_plumb_line_ends_on_the_ground(
    recorded: Recorded, flight: list[Snapshot]
) -> None:
    here = np.array([s.position_ned for s in flight], np.float32)
    trail = recorded["/world/trail"]["LineStrips3D:strips"].reshape(-1, 3)
    assert set(map(tuple, here)) <= set(map(tuple, trail))
    foot = recorded["/world/plumb"]["LineStrips3D:strips"].reshape(-1, 2, 3)[:, 1]
    assert foot[:, :2] == pytest.approx(here[:, :2])
    assert foot[:, 2] == pytest.approx(np.zeros(len(here)), abs=1e-4)  # home lies on the ground


def test_map_shows_the_track_in_degrees(recorded: Recorded, flight: list[Snapshot]) -> None:
    track = recorded["/map/track"]
    by_time = {round(s.time, 6): s for s in flight}
    for time, (latitude, longitude) in zip(track["sim_time"], track["GeoPoints:positions"].reshape(-1, 2), strict=True):
        snapshot = by_time[round(float(time), 6)]
        assert math.radians(latitude) == pytest.approx(snapshot.latitude, rel=1e-12)
        assert math.radians(longitude) == pytest.approx(snapshot.longitude, rel=1e-12)
    gaps = np.diff(track["sim_time"])
    assert gaps.min() > 0.199  # five a second at most, and no gap beyond one snapshot more
    assert gaps.max() < 0.221


def test_curves_hold_the_snapshots_values_in_the_units_of_their_titles(
    recorded: Recorded, flight: list[Snapshot]
) -> None:
    def curves(path: str) -> np.ndarray:
        return recorded[f"/plots/{path}"]["Scalars:scalars"]

    degrees = 180.0 / math.pi
    state = np.array([s.state for s in flight])
    outputs = np.array([s.outputs for s in flight])
    velocity = np.array([s.velocity_ned for s in flight])
    attitude = np.array([(s.roll, s.pitch, s.yaw) for s in flight])
    assert curves("attitude") == pytest.approx(attitude * degrees, rel=1e-12)
    assert curves("rates") == pytest.approx(np.array([s.rates for s in flight]) * degrees, rel=1e-12)
    assert curves("speed")[:, 0] == pytest.approx([s.airspeed for s in flight], rel=1e-12)
    assert curves("speed")[:, 1] ** 2 == pytest.approx(velocity[:, 0] ** 2 + velocity[:, 1] ** 2, rel=1e-12)
    assert curves("speed")[:, 2] == pytest.approx(-velocity[:, 2], rel=1e-12)
    assert curves("height")[:, 0] == pytest.approx(outputs["height_above_ground"], rel=1e-12)
    assert curves("tilt")[:, 0] == pytest.approx(np.array([s.tilt for s in flight]) * degrees, rel=1e-12)
    assert curves("tilt")[:, 1] == pytest.approx(np.array([s.controls[3] for s in flight]) * degrees, rel=1e-12)
    assert curves("rotor_speed") == pytest.approx(state[:, 13:16] * 60.0 / (2.0 * math.pi), rel=1e-12)
    assert curves("servos") == pytest.approx(state[:, 17:20] * degrees, rel=1e-12)
    assert curves("thrust") == pytest.approx(outputs["thrust"], rel=1e-12)
    assert curves("power")[:, 3] == pytest.approx(outputs["shaft_power"].sum(axis=1), rel=1e-12)


def test_angle_of_attack_and_stall_margin_curves_follow_the_air(
    recorded: Recorded, flight: list[Snapshot], aircraft: Aircraft
) -> None:
    curves = recorded["/plots/incidence"]["Scalars:scalars"]
    air = np.array([s.outputs["velocity_air_body"] for s in flight])
    alpha, beta = np.radians(curves[:, 0]), np.radians(curves[:, 1])
    speed = np.linalg.norm(air, axis=1)
    direction = np.column_stack([np.cos(alpha) * np.cos(beta), np.sin(beta), np.sin(alpha) * np.cos(beta)])
    assert direction * speed[:, None] == pytest.approx(air, rel=1e-9, abs=1e-9)
    wing = [k for k, name in enumerate(aircraft.surface_names) if name.startswith(("left", "right"))]
    least = np.array([s.outputs["stall_margin"][wing].min() for s in flight])
    assert np.radians(curves[:, 2]) == pytest.approx(least, rel=1e-12)


def test_message_is_logged_under_the_time_of_its_snapshot(recorded: Recorded, flight: list[Snapshot]) -> None:
    messages = recorded["/messages"]
    assert messages["TextLog:text"].ravel().tolist() == ["fifty"]
    assert messages["TextLog:level"].ravel().tolist() == ["WARN"]
    assert messages["sim_time"] == pytest.approx([flight[50].time])
