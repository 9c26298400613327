"""Files of parameters, against pymavlink's reader of them and QGroundControl's columns."""

import struct
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink import mavparm

from gcs_scripts.errors import GroundError
from gcs_scripts.parameter_encoding import Parameter
from gcs_scripts.parameter_file import FileValue, compare, is_equal, read_file, text_of, write_file

INT32, REAL32 = 6, 9


def single(value: float) -> float:
    return struct.unpack("<f", struct.pack("<f", value))[0]


PARAMETERS = [
    Parameter("BAT_LOW_THR", single(0.2), REAL32), Parameter("COM_RCL_EXCEPT", -7, INT32),
    Parameter("TINY", single(1e-7), REAL32), Parameter("BIG", 2139095041, INT32),
]  # fmt: skip
VEHICLE: Any = SimpleNamespace(system=3, component=1, heartbeat=SimpleNamespace(type=21, autopilot=12))


@given(st.floats(width=32, allow_nan=False, allow_infinity=False))
def test_a_value_as_text_reads_back_as_the_same_float(value: float) -> None:
    text = text_of(Parameter("X", value, REAL32))
    assert single(float(text)) == value
    assert "e" not in text  # some readers know no exponents


@pytest.mark.parametrize("ending", [".params", ".parm", ".param"])
def test_what_is_saved_reads_back_without_a_difference(tmp_path: Path, ending: str) -> None:
    file = tmp_path / f"all{ending}"
    write_file(file, PARAMETERS, VEHICLE)
    assert compare(read_file(file), {p.name: p for p in PARAMETERS}) == []


def test_mavproxy_reads_what_is_saved_for_it(tmp_path: Path) -> None:
    file = tmp_path / "all.parm"
    write_file(file, PARAMETERS, VEHICLE)
    theirs = mavparm.MAVParmDict()
    assert theirs.load(str(file))
    assert {name: single(value) if name != "BIG" else value for name, value in theirs.items()} == {
        p.name: p.value for p in PARAMETERS
    }


def test_qgroundcontrols_columns_are_ids_name_value_and_type_with_tabs(tmp_path: Path) -> None:
    file = tmp_path / "all.params"
    write_file(file, PARAMETERS, VEHICLE)
    lines = [line for line in file.read_text().splitlines() if not line.startswith("#")]
    assert lines[:2] == ["3\t1\tBAT_LOW_THR\t0.2\t9", "3\t1\tCOM_RCL_EXCEPT\t-7\t6"]


def test_files_as_others_write_them_are_read(tmp_path: Path) -> None:
    file = tmp_path / "theirs.param"
    file.write_text("# Onboard parameters for Vehicle 1\n1\t1\tMPC_XY_CRUISE\t5.000000000000000000\t9\n")
    assert read_file(file) == [FileValue("MPC_XY_CRUISE", 5.0, 0.5e-18)]
    file.write_text("#NOTE: 22 Nov\nARSPD_TYPE,1\nBATT_MONITOR    0x10 # both\n\nACRO_LOCKING 0.000000\n")
    assert [value[:2] for value in read_file(file)] == [("ARSPD_TYPE", 1), ("BATT_MONITOR", 16), ("ACRO_LOCKING", 0)]


def test_only_what_differs_beyond_the_writers_rounding_differs(tmp_path: Path) -> None:
    file = tmp_path / "theirs.parm"
    theirs = mavparm.MAVParmDict()
    theirs.update({p.name: float(p.value) for p in PARAMETERS})
    theirs.save(str(file))  # with six decimals
    given = read_file(file)
    assert all(is_equal(value, next(p for p in PARAMETERS if p.name == value.name)) for value in given)
    assert not is_equal(FileValue("A", 15.0, 0.0), Parameter("A", single(15.3), REAL32))
    changed = {p.name: p for p in PARAMETERS} | {"BAT_LOW_THR": Parameter("BAT_LOW_THR", single(0.21), REAL32)}
    del changed["TINY"]
    changed["MORE"] = Parameter("MORE", 1, INT32)
    changed["SYS_NUM_RESETS"] = Parameter("SYS_NUM_RESETS", 1, INT32)  # a counter: nobody loads it
    assert [d.name for d in compare(given, changed)] == ["BAT_LOW_THR", "MORE", "TINY"]


@pytest.mark.parametrize(
    ("content", "complaint"),
    [("A 1\nB\n", ":2: expected NAME VALUE"), ("A one\n", ":1: A: expected a number"), ("\xff", "cannot be read")],
)
def test_a_line_that_is_none_is_named(tmp_path: Path, content: str, complaint: str) -> None:
    file = tmp_path / "some.parm"
    file.write_text(content, encoding="latin-1")
    with pytest.raises(GroundError, match=complaint):
        read_file(file)


def test_a_file_of_another_ending_is_refused_before_it_is_written(tmp_path: Path) -> None:
    with pytest.raises(GroundError, match=r"one of \.params, \.parm, \.param"):
        write_file(tmp_path / "all.txt", PARAMETERS, VEHICLE)
    assert not (tmp_path / "all.txt").exists()
