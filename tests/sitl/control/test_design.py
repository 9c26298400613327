"""The design: gains that follow from the aircraft, a braking plan that its map bears, a cache that is safe."""

import math
from pathlib import Path

import numpy as np
import pytest

from sitl.control import design as design_module
from sitl.control.design import PLANNED_BRAKING, STALL_TOLERANCE, design_for
from sitl.control.design_names import BRAKE, COLUMNS, LOWEST_FORCE
from sitl.control.lookup import map_lookup
from tests.sitl.control.flown import aircraft, design
from vehicle_model.aircraft import Aircraft
from vehicle_model.force_map import COLUMNS as MAP_COLUMNS
from vehicle_model.force_map import STALL_MARGIN
from vehicle_model.motor import throttle_for
from vehicle_model.rotor import rotor_loads


def airflow() -> np.ndarray:
    first, step, count = design().axes[0]
    return first + step * np.arange(count)


def test_the_same_aircraft_gets_the_same_bits_again() -> None:
    again = design_for(aircraft())
    for name in ("gains", "table", "axes", "schedule", "vehicle"):
        assert getattr(again, name).tobytes() == getattr(design(), name).tobytes(), name


def test_every_gain_is_set_and_finite() -> None:
    for name in design().gains.dtype.names or ():
        assert math.isfinite(design().gains[0][name]), name
        assert design().gains[0][name] > 0.0, name
    assert np.isfinite(design().schedule).all()
    assert (np.delete(design().schedule, LOWEST_FORCE, axis=1) > 0.0).all()
    assert design().schedule.shape == (len(airflow()), len(COLUMNS))


def test_top_speed_is_that_of_full_throttle_at_rest() -> None:
    """Where the motor's throttle for the propeller's own torque is 1."""
    gains, craft = design().gains[0], aircraft().vehicle[0]
    thrust, torque, _ = rotor_loads(craft["rotors"][0], float(gains["top_speed"]), 0.0, 0.0, 1.225)
    assert throttle_for(craft["rotors"][0], float(gains["top_speed"]), torque) == pytest.approx(1.0, abs=1e-4)
    assert 2.0 * thrust > 1.3 * 9.81 * craft["mass"]  # and it hovers with some to spare
    assert gains["torque_factor"] == pytest.approx(torque / float(gains["top_speed"]) ** 2)


def test_loops_are_slower_the_further_out_they_are() -> None:
    gains, schedule = design().gains[0], {name: design().schedule[:, k] for k, name in enumerate(COLUMNS)}
    actuator = 1.0 / gains["rotor_lag"]
    assert (schedule["roll_rate_gain"] < 0.5 * actuator).all()
    assert (schedule["roll_gain"] < 0.5 * schedule["roll_rate_gain"]).all()
    assert (schedule["lateral_gain"] < 0.5 * schedule["roll_gain"]).all()
    hover = np.abs(airflow()) < 8.0
    assert (gains["position"] < 0.5 * schedule["lateral_gain"][hover]).all()
    assert (gains["altitude"] < schedule["vertical_gain"]).all()


def test_guidance_plans_to_brake_with_less_than_the_map_has() -> None:
    brake, lowest = design().schedule[:, BRAKE], design().schedule[:, LOWEST_FORCE]
    assert (lowest <= 0.0).all()
    assert (brake >= PLANNED_BRAKING[0]).all()
    assert (brake <= PLANNED_BRAKING[1]).all()
    forward = airflow() >= 0.0
    assert (brake[forward] < -lowest[forward]).all()


def test_at_the_lowest_force_the_wing_is_not_stalled_nor_the_motors_off() -> None:
    """At the nodes over the airflow, in level flight of the weight that the design assumes."""
    node = np.empty(len(MAP_COLUMNS))
    for u, lowest in zip(airflow(), design().schedule[:, LOWEST_FORCE], strict=True):
        if u < 0.0:
            continue
        map_lookup(design().table, design().axes, float(u), 0.0, float(lowest), -10.0, node)
        found = dict(zip(MAP_COLUMNS, node, strict=True))
        assert found["stall_margin"] > STALL_MARGIN - STALL_TOLERANCE - math.radians(0.05), u
        assert found["force_down"] == pytest.approx(-10.0, abs=0.35), u
        assert found["shaft_torque"] > 0.0, u  # the motors still drive


def test_a_map_is_made_once_and_again_only_if_what_was_kept_is_not_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Making one takes seconds: the one there is stands in for it."""
    made: list[Aircraft] = []

    def make(whose: Aircraft, axes: np.ndarray) -> np.ndarray:
        np.testing.assert_array_equal(axes, original.axes)
        made.append(whose)
        return original.table.copy()

    original = design()
    monkeypatch.setattr(design_module, "CACHE_FOLDER", tmp_path)
    monkeypatch.setattr(design_module, "force_map", make)
    assert design_for(aircraft()).table.tobytes() == original.table.tobytes()
    assert design_for(aircraft()).table.tobytes() == original.table.tobytes()
    assert len(made) == 1
    (file,) = tmp_path.iterdir()
    for content in (file.read_bytes()[:100], b"", b"not an array"):
        file.write_bytes(content)
        assert design_for(aircraft()).table.tobytes() == original.table.tobytes()
    assert len(made) == 4
    np.save(file, original.table[..., :5])  # of other columns
    design_for(aircraft())
    assert len(made) == 5
    assert [path.name for path in tmp_path.iterdir()] == [file.name]  # nothing half-written is left


def test_another_aircraft_gets_another_map(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    original = design()
    monkeypatch.setattr(design_module, "CACHE_FOLDER", tmp_path)
    monkeypatch.setattr(design_module, "force_map", lambda *_: original.table)
    for mass in (aircraft().mass_properties.mass, 1.02 * aircraft().mass_properties.mass):
        design_for(aircraft().with_values({"mass_properties.mass": mass}))
    assert len(list(tmp_path.iterdir())) == 2


def test_a_folder_that_cannot_be_written_costs_only_the_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    original = design()
    monkeypatch.setattr(design_module, "CACHE_FOLDER", tmp_path / "missing")
    monkeypatch.setattr(design_module, "force_map", lambda *_: original.table)
    assert design_for(aircraft()).table.tobytes() == original.table.tobytes()
    assert not (tmp_path / "missing").exists()
