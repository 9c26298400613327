"""Files of parameters: those of the programs that people use are read, and ours are read by them."""

import random
import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.mavparm import MAVParmDict

from sitl.flight.parameter_file import (
    ParameterFileError,
    as_params,
    as_parm,
    entries,
    parse_parameters,
    read_parameters,
)  # fmt: skip
from sitl.flight.parameter_table import DEFINITIONS
from sitl.flight.parameters import Parameters

# As QGroundControl 4 saves them, numbers in full precision.
QGROUNDCONTROL = """\
# Onboard parameters for Vehicle 1
#
# Stack: PX4 Pro
# Vehicle: VTOL
# Version: 1.15.4
# Git Revision: 99c40407ff000000
#
# Vehicle-Id Component-Id Name Value Type
1\t1\tBAT_CRIT_THR\t0.119999997317790985\t9
1\t1\tCOM_RCL_EXCEPT\t4\t6
1\t1\tMPC_LAND_SPEED\t0.550000011920928955\t9
1\t154\tMNT_MODE_IN\t-1\t6
"""
# As MAVProxy's `param save` writes them, PX4's hash among them, with a comment and a comma as people add them.
MAVPROXY = """\
BAT_CRIT_THR     0.120000
COM_RCL_EXCEPT   0x4   # Offboard
MPC_LAND_SPEED,0.55

# MPC_XY_CRUISE 3
_HASH_CHECK      1830924544
"""
BOTH = {"BAT_CRIT_THR": 0.12, "COM_RCL_EXCEPT": 4, "MPC_LAND_SPEED": 0.55}
SETTINGS = [definition for definition in DEFINITIONS if not definition.read_only]


def some_values() -> st.SearchStrategy[dict[str, float]]:
    """Values that some parameters can have."""

    def of(index: int) -> st.SearchStrategy[float]:
        definition = SETTINGS[index]
        if definition.values is not None:
            return st.sampled_from(sorted(definition.values))
        if definition.kind == "int":
            return st.integers(int(definition.minimum), int(definition.maximum))
        return st.floats(definition.minimum, definition.maximum)

    names = {definition.name: of(index) for index, definition in enumerate(SETTINGS)}
    return st.fixed_dictionaries({}, optional=names)


@pytest.mark.parametrize("text", [QGROUNDCONTROL, MAVPROXY, QGROUNDCONTROL.replace("\n", "\r\n"), "\ufeff" + MAVPROXY])
def test_what_ground_stations_save_is_read_to_the_number_that_was_meant(tmp_path: Path, text: str) -> None:
    file = tmp_path / "saved.params"
    file.write_bytes(text.encode())
    values = read_parameters(file)
    assert values == BOTH
    assert isinstance(values["COM_RCL_EXCEPT"], int)
    assert parse_parameters(files=[file]) == values


@given(some_values())
def test_both_formats_give_back_every_value_exactly(values: dict[str, float]) -> None:
    kept = {name: Parameters(values)[name] for name in values}
    for text in (as_params(kept, 1), as_parm(kept)):
        assert {name: value for _, name, value in entries(text.encode(), "ours")} == kept


def test_pymavlink_reads_ours_and_we_read_what_it_saves(tmp_path: Path) -> None:
    chosen = random.Random(1)
    values: Mapping[str, float] = {
        definition.name: Parameters({definition.name: chosen.uniform(definition.minimum, definition.maximum)})[
            definition.name
        ]
        for definition in SETTINGS
        if definition.kind == "float"
    } | {"WV_EN": 1, "CBRK_FLIGHTTERM": 121212}
    ours, theirs = tmp_path / "ours.parm", tmp_path / "theirs.parm"
    ours.write_text(as_parm(values))
    known = MAVParmDict()
    assert known.load(str(ours))
    assert dict(known) == values
    known.save(str(theirs))
    assert read_parameters(theirs) == pytest.approx(values, abs=1e-6)  # it writes six decimals


def test_the_lines_for_qgroundcontrol_have_five_fields_between_tabs_and_its_types() -> None:
    rows = [line.split("\t") for line in as_params(BOTH, 7).splitlines() if not line.startswith("#")]
    assert rows == [
        ["7", "1", "BAT_CRIT_THR", "0.12", "9"],
        ["7", "1", "COM_RCL_EXCEPT", "4", "6"],
        ["7", "1", "MPC_LAND_SPEED", "0.55", "9"],
    ]


def test_of_a_parameter_named_twice_the_latter_value_counts(tmp_path: Path) -> None:
    file = tmp_path / "twice.parm"
    file.write_text("WV_EN 1\nWV_EN 0\n")
    assert read_parameters(file) == {"WV_EN": 0}


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("WV_EN 1\nWV_EN\n", "line 2: expected NAME VALUE, or VEHICLE COMPONENT NAME VALUE TYPE, got 'WV_EN'"),
        ("WV_EN one\n", "line 1: expected NAME VALUE"),
        ("WV_EN 1_0\n", "line 1: expected NAME VALUE"),
        ("WV_EN 0x" + "F" * 400, "line 1: expected NAME VALUE"),
        ("1 1 WV_EN 1\n", "line 1: expected NAME VALUE"),
        ("1 one WV_EN 1 6\n", "line 1: expected NAME VALUE"),
        ("# fine\n\nWV_EN 3\n", "line 3: WV_EN: expected 0 (Keep heading), 1 (Turn into the wind), got 3.0"),
        ("NAV_ACC_RAD nan\n", "line 1: NAV_ACC_RAD: expected 0.5 to 200 m, got nan"),
        ("NAV_ACC_RADD 1\n", "line 1: NAV_ACC_RADD: unknown parameter, expected NAV_ACC_RAD"),
        ("WV_EN \x00\n", "line 1: expected NAME VALUE"),
    ],
)
def test_what_is_wrong_with_a_file_is_told_with_file_and_line(tmp_path: Path, text: str, problem: str) -> None:
    file = tmp_path / "wrong.params"
    file.write_text(text)
    with pytest.raises(ParameterFileError, match=re.escape(f"{file}: {problem}")) as refusal:
        read_parameters(file)
    assert "\n" not in str(refusal.value)


def test_a_file_that_is_no_text_or_not_there_is_told_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(ParameterFileError, match=r"none\.params: cannot be read: No such file"):
        read_parameters(tmp_path / "none.params")
    (tmp_path / "binary").write_bytes(b"WV_EN 1\n\xff\xfe")
    with pytest.raises(ParameterFileError, match=r"binary: expected text, got invalid start byte at byte 8"):
        read_parameters(tmp_path / "binary")


@given(st.binary(max_size=200))
def test_any_bytes_are_read_or_refused_with_one_error(data: bytes) -> None:
    try:
        found = entries(data, "any")
    except ParameterFileError:
        return
    assert all(len(name) > 0 and isinstance(value, float) for _, name, value in found)


def test_assignments_go_before_files_and_later_ones_before_earlier(tmp_path: Path) -> None:
    first, second = tmp_path / "first.parm", tmp_path / "second.parm"
    first.write_text("WV_EN 1\nNAV_ACC_RAD 5\nRTL_TYPE 2\n")
    second.write_text("NAV_ACC_RAD 6\n")
    values = parse_parameters(["RTL_TYPE=0", "MPC_XY_CRUISE = 4.5", "MPC_XY_CRUISE=3"], [first, second])
    assert values == {"WV_EN": 1, "NAV_ACC_RAD": 6.0, "RTL_TYPE": 0, "MPC_XY_CRUISE": 3.0}
    assert parse_parameters() == {}


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("WV_EN", "parameter 'WV_EN': expected NAME=VALUE with a number"),
        ("WV_EN=on", "parameter 'WV_EN=on': expected NAME=VALUE with a number"),
        ("=1", ": unknown parameter"),
        ("NAV_ACC_RAD=1e9", "NAV_ACC_RAD: expected 0.5 to 200 m, got 1000000000.0"),
        ("NAV_ACC_RAD=-inf", "NAV_ACC_RAD: expected 0.5 to 200 m, got -inf"),
        ("SYS_AUTOSTART=4001", "SYS_AUTOSTART: expected 22000, which cannot be set, got 4001.0"),
    ],
)
def test_a_wrong_assignment_is_told_with_what_was_expected(text: str, problem: str) -> None:
    with pytest.raises(ParameterFileError, match="^" + re.escape(problem)):
        parse_parameters([text])


def test_every_parameter_survives_single_precision_in_a_file() -> None:
    values = {definition.name: Parameters()[definition.name] for definition in DEFINITIONS}
    text = "".join(f"{name} {float(np.float32(value)):.18g}\n" for name, value in values.items())
    parameters = Parameters()
    for _, name, value in entries(text.encode(), "single"):
        parameters.set(name, value)
    assert {name: parameters[name] for name in parameters.names()} == values
