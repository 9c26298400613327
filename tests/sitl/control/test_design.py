"""The design: gains that follow from the aircraft, a braking plan that its map bears, a cache that is safe."""

import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sitl.control import design as design_module
from sitl.control import tuning
from sitl.control.design import Design, design_for, design_with
from sitl.control.design_names import BRAKE, COLUMNS, LOWEST_FORCE
from sitl.control.lookup import map_lookup
from sitl.control.shape import PLANNED_BRAKING, STALL_TOLERANCE, Shape
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
    assert [path.name for path in tmp_path.iterdir()] == [file.name]  # nothing half-written is left


def test_another_aircraft_gets_another_map_and_gains_of_its_own_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Making them takes up to a minute: the paper's map, and gains by another shape, stand in for them."""
    original, made = design(), []

    def make(whose: Aircraft, table: np.ndarray, axes: np.ndarray, _: object) -> Design:
        made.append(whose)
        return replace(design_with(whose, table, axes, Shape(rate=0.3)), missed=("roll at 20 m/s: 5.0 dB",))

    monkeypatch.setattr(design_module, "CACHE_FOLDER", tmp_path / "maps")
    monkeypatch.setattr(design_module, "LAWS_FOLDER", tmp_path / "laws")
    monkeypatch.setattr(design_module, "force_map", lambda *_: original.table)
    monkeypatch.setattr(tuning, "tuned", make)
    for folder in ("maps", "laws"):
        (tmp_path / folder).mkdir()
    for share in (1.0, 1.02):
        heavier = aircraft().with_values({"mass_properties.mass": share * aircraft().mass_properties.mass})
        first, again = design_for(heavier), design_for(heavier)
        assert again.shape == first.shape == Shape(rate=0.3)
        assert again.missed == first.missed == ("roll at 20 m/s: 5.0 dB",)
        for name in ("gains", "schedule"):
            assert getattr(again, name).tobytes() == getattr(first, name).tobytes()
        # a record that is laid out alike but is not marked as aligned is another type to compiled code
        assert again.gains.dtype.isalignedstruct
        assert again.gains.dtype == first.gains.dtype
    assert len(made) == 2
    for folder in ("maps", "laws"):
        assert len(list((tmp_path / folder).iterdir())) == 2


def test_folders_that_cannot_be_written_cost_only_the_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    original = design()
    monkeypatch.setattr(design_module, "CACHE_FOLDER", tmp_path / "missing")
    monkeypatch.setattr(design_module, "LAWS_FOLDER", None)
    monkeypatch.setattr(design_module, "force_map", lambda *_: original.table)
    monkeypatch.setattr(tuning, "tuned", lambda *_: original)
    assert design_for(aircraft()).table.tobytes() == original.table.tobytes()
    assert not (tmp_path / "missing").exists()


def test_a_design_that_is_kept_needs_no_solver() -> None:
    design()
    code = (
        "import sys\nfrom sitl.control.design import design_for\nfrom vehicle_model.aircraft import load_aircraft\n"
        "design_for(load_aircraft())\nprint('scipy.optimize' in sys.modules, 'sitl.control.corridor' in sys.modules)"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60).stdout
    assert out.split() == ["False", "False"]


def test_a_design_says_what_was_changed_and_what_is_missed() -> None:
    assert design().summary == "The default shape is kept. All loops have 6 dB and 45 deg."
    changed = replace(design(), shape=Shape(rate=0.3), missed=("roll at 20 m/s: 5.0 dB",))
    assert "rate 0.3 (was 0.42)" in changed.summary
    assert "out of reach in 1 loops: roll at 20 m/s: 5.0 dB" in changed.summary


def test_one_command_designs_and_says_what_it_found() -> None:
    design()
    command = [sys.executable, "-m", "sitl.control", "design"]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout == f"hong2013.toml: {design().summary}\n"
    command += ["--aircraft", "none.toml"]
    missing = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    assert missing.returncode == 1
    assert missing.stderr.startswith("error: ")
    assert missing.stderr.count("\n") == 1
