"""Aircraft files: units, errors that name file, line and entry, and values written back in place."""

import math
import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vehicle_model.aircraft import Aircraft, AircraftFileError, load_aircraft, write_values
from vehicle_model.units import UNITS

SHIPPED = load_aircraft().source_file.read_text()
NUMBER = re.compile(r"(\w+)\s*= \{ value = (.+?),\s+unit = \"(.+?)\"")


def _place(table: str, key: str) -> int:
    """Index of the line of `key` in the first table of this header."""
    lines = SHIPPED.split("\n")
    start = lines.index(table)
    return next(i for i in range(start + 1, len(lines)) if re.match(rf"{key}\s*=", lines[i]))


def _error(folder: Path, text: str | bytes) -> str:
    """What loading this text says, after its path."""
    path = folder / "aircraft.toml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(AircraftFileError) as caught:
        load_aircraft(path)
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith(f"{path}:")
    return message.removeprefix(f"{path}:")


def _with_line(index: int, line: str) -> str:
    lines = SHIPPED.split("\n")
    lines[index] = line
    return "\n".join(lines)


def _load(folder: Path, text: str) -> Aircraft:
    path = folder / "aircraft.toml"
    path.write_text(text)
    return load_aircraft(path)


@pytest.mark.parametrize(
    ("table", "entry", "expected"),
    [
        ("[wing]", "chord = { value = 12, unit = 'kg' }", "expected a length in m between 0.02 and 3, got 12 kg"),
        ("[wing]", "chord = { value = 12, unit = 'm' }", "expected a length in m between 0.02 and 3, got 12 m"),
        ("[wing]", "chord = { value = 2, unit = 'cubit' }", "expected a length in m between 0.02 and 3, got 2 cubit"),
        ("[wing]", "chord = { value = '0.2', unit = 'm' }", 'expected a length in m between 0.02 and 3, got "0.2" m'),
        ("[wing]", "chord = { value = true, unit = 'm' }", "expected a length in m between 0.02 and 3, got true m"),
        ("[wing]", "chord = { value = inf, unit = 'm' }", "expected a length in m between 0.02 and 3, got inf m"),
        ("[wing]", "chord = { value = 5, unit = 'mm' }", "expected a length in m between 0.02 and 3, got 5 mm"),
        ("[wing]", "chord = 0.26",
         'expected { value = .., unit = ".." } with a length in m between 0.02 and 3, got 0.26'),
        ("[wing]", "chord = { value = 0.2 }", "unit is missing; expected a length in m between 0.02 and 3"),
        ("[wing]", "chord = { unit = 'm' }", "value is missing; expected a length in m between 0.02 and 3"),
        ("[wing]", "chord = { value = 0.2, unit = 1 }", 'expected a unit such as "m", got 1'),
        ("[wing]", "slipstream = 'thick'", 'expected "vector" or "paper", got "thick"'),
        ("[wing]", "pivot = { value = [0, 0], unit = 'm' }",
         "expected [x, y, z], each a length in m between -10 and 10, got [0, 0] m"),
        ("[wing]", "pivot = { value = 1.0, unit = 'm' }",
         "expected [x, y, z], each a length in m between -10 and 10, got 1 m"),
        ("[rotors.wing]", "blades = { value = 2.5, unit = '1' }", "expected a whole number between 1 and 8, got 2.5"),
        ("[rotors.tail.motor]", "reversible = 1", "expected true or false, got 1"),
    ],
)  # fmt: skip
def test_a_wrong_entry_is_named_with_its_line(tmp_path: Path, table: str, entry: str, expected: str) -> None:
    key = entry.split(" ", 1)[0]
    index = _place(table, key)
    assert _error(tmp_path, _with_line(index, entry)) == f"{index + 1}: {table.strip('[]')}.{key}: {expected}"


def test_every_number_of_the_file_is_checked_for_being_a_number_its_range_and_its_unit(tmp_path: Path) -> None:
    checked = 0
    for index, line in enumerate(SHIPPED.split("\n")):
        entry = NUMBER.match(line)
        if entry is None:
            continue
        checked += 1
        key, value, unit = entry.groups()
        for scalar in ("nan", "1e12", "-1e12"):
            bad = f"[{scalar}, {scalar}, {scalar}]" if value.startswith("[") else scalar
            found = _error(tmp_path, _with_line(index, line.replace(value, bad, 1)))
            assert re.match(rf"{index + 1}: [\w.]+\.{key}: expected .* between .*, got ", found), found
        other = "V" if unit != "V" else "kg"
        found = _error(tmp_path, _with_line(index, line.replace(f'unit = "{unit}"', f'unit = "{other}"')))
        assert re.match(rf"{index + 1}: [\w.]+\.{key}: expected .*, got .* {other}$", found), found
    assert checked > 120


def test_every_entry_is_needed_and_its_table_is_named_where_it_is_missing(tmp_path: Path) -> None:
    lines = SHIPPED.split("\n")
    header, checked = 0, 0
    for index, line in enumerate(lines):
        if line.startswith("["):
            header = index + 1
        key = re.match(r"(\w+)\s*=", line)
        if key and key[1] != "source":
            checked += 1
            found = _error(tmp_path, "\n".join(lines[:index] + lines[index + 1 :]))
            assert re.match(rf"{header or 1}: (?:[\w.]+\.)?{key[1]}: missing; expected ", found), found
    assert checked > 140


def test_a_misspelt_key_is_met_with_the_nearest_one(tmp_path: Path) -> None:
    index = _place("[wing]", "chord")
    found = _error(tmp_path, _with_line(index, SHIPPED.split("\n")[index].replace("chord", "chrod")))
    assert found == f'{index + 1}: wing.chrod: no such key; did you mean "chord"?'
    found = _error(tmp_path, _with_line(index, "chord = { value = 0.26, units = 'm' }"))
    assert found == f'{index + 1}: wing.chord.units: no such key; did you mean "unit"?'


def test_a_number_without_any_source_is_refused(tmp_path: Path) -> None:
    bare = re.sub(r'(?m)^source\s*=.*$|, source = "[^"]*"', "", SHIPPED)
    found = _error(tmp_path, bare)
    assert re.match(r"\d+: mass_properties\.mass: source is missing; give one here or in its table", found)
    assert ": expected a text that says" in _error(tmp_path, SHIPPED.replace("source = ", 'source = "" # ', 1))


@pytest.mark.parametrize(
    ("table", "entry", "attributes", "si"),
    [
        ("[wing]", "chord = { value = 260, unit = 'mm' }", "wing.chord", 0.26),
        ("[wing]", "chord = { value = 10, unit = 'in' }", "wing.chord", 0.254),
        ("[wing]", "incidence = { value = 3, unit = 'deg' }", "wing.incidence", math.pi / 60),
        ("[wing]", "incidence = { value = 0.05, unit = 'rad' }", "wing.incidence", 0.05),
        ("[wing]", "lift_slope = { value = 0.1, unit = '1/deg' }", "wing.lift_slope", 5.729577951308232),
        ("[wing]", "zero_lift_drag = { value = 2, unit = '%' }", "wing.zero_lift_drag", 0.02),
        ("[mass_properties]", "mass = { value = 11500, unit = 'g' }", "mass_properties.mass", 11.5),
        ("[rotors.wing]", "inertia = { value = 13000, unit = 'g cm^2' }", "rotors.wing.inertia", 1.3e-3),
        ("[rotors.wing.motor]", "velocity_constant = { value = 300, unit = 'rpm/V' }",
         "rotors.wing.motor.velocity_constant", 10 * math.pi),
        ("[rotors.wing.motor]", "resistance = { value = 31, unit = 'mohm' }", "rotors.wing.motor.resistance", 0.031),
        ("[rotors.wing.motor]", "max_power = { value = 3.1, unit = 'kW' }", "rotors.wing.motor.max_power", 3100.0),
        ("[tail.horizontal]", "area = { value = 11, unit = 'dm^2' }", "tail.horizontal.area", 0.11),
        ("[tail.horizontal]", "area = { value = 1100, unit = 'cm^2' }", "tail.horizontal.area", 0.11),
        ("[servos.tilt]", "rate_limit = { value = 10, unit = 'rpm' }", "servos.tilt.rate_limit", math.pi / 3),
        ("[servos.tilt]", "time_constant = { value = 80, unit = 'ms' }", "servos.tilt.time_constant", 0.08),
        # (60 rpm)^2 = (2 pi rad/s)^2, per 90 deg = pi/2
        ("[elevator]", "tail_gain = { value = 40, unit = 'rpm^2/deg', source = 'x' }", "elevator.tail_gain",
         40 * (4 * math.pi**2 / 3600) / (math.pi / 180)),
    ],
)  # fmt: skip
def test_units_of_the_right_dimension_become_si(
    tmp_path: Path, table: str, entry: str, attributes: str, si: float
) -> None:
    value: Any = _load(tmp_path, _with_line(_place(table, entry.split(" ", 1)[0]), entry))
    for name in attributes.split("."):
        value = getattr(value, name)
    assert value == pytest.approx(si, rel=1e-14)


def test_the_documented_units_are_all_those_of_the_dimensions_in_the_file() -> None:
    dimensions = {UNITS[entry[3]].dimension for entry in map(NUMBER.match, SHIPPED.split("\n")) if entry}
    page = (Path(__file__).parents[2] / "docs" / "aircraft-file.md").read_text()
    table = page.partition("| dimension | units |")[2].partition("\n\n")[0]
    assert set(re.findall(r"`([^`]+)`", table)) == {
        name for name, unit in UNITS.items() if unit.dimension in dimensions
    }


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("position  = { value = [0.45, 0.22, 0.28], unit", "position  = { value = [0.45, 0.22, -0.28], unit",
         "contacts.0.position: expected z below the centre of mass, above 0 m, got -0.28 m"),
        ("position       = { value = [-0.95, 0.0, -0.2], unit", "position       = { value = [0.95, 0.0, -0.2], unit",
         "tail.vertical.position: expected x behind the centre of mass, below 0 m, got 0.95 m"),
        ("stall_angle    = { value = 24.0, ", "stall_angle    = { value = 5.0, ",
         "tail.vertical.stall_width: expected less than stall_angle, 5 deg, got 6 deg"),
        ('control     = "elevator"', 'control     = "tilt"',
         'servo_outputs.6: expected each to differ, got "tilt" twice'),
        ('name    = "outboard"', 'name    = "wetted"', 'wing.strips.2: expected each to differ, got "wetted" twice'),
        ("channel     = { value = 7,", "channel     = { value = 1,",
         'servo_outputs.6: expected each to differ, got "1" twice'),
        ("width   = { value = 0.14,", "width   = { value = 0.18,",
         "wing.strips.1.y: expected 0.24 m or more to its inner edge, where the strip before ends, got 0.22 m"),
        ("span                  = { value = 2.0,", "span                  = { value = 2.4,",
         "wing.span: expected 2 m, where the outermost strips end, got 2.4 m"),
        ("cells               = { value = 12,", "cells               = { value = 10,",
         "battery.voltage: expected 34 to 42 V for 10 lithium-polymer cells, got 44.4 V"),
    ],
)  # fmt: skip
def test_entries_that_contradict_each_other_are_named(tmp_path: Path, old: str, new: str, expected: str) -> None:
    assert SHIPPED.count(old) == 1
    text = SHIPPED.replace(old, new)
    line, _, message = _error(tmp_path, text).partition(": ")
    assert message == expected
    named = ("[[", "y ", "span ", "position ", "stall_width ", "voltage ")
    assert text.split("\n")[int(line) - 1].strip().startswith(named)


def test_a_body_with_impossible_moments_of_inertia_is_refused(tmp_path: Path) -> None:
    mass = load_aircraft().mass_properties
    index = _place("[mass_properties]", "izz")
    found = _error(tmp_path, _with_line(index, "izz = { value = 30.0, unit = 'kg m^2' }"))
    limit = f"{mass.ixx + mass.iyy:.6g} kg m^2"
    expected = f"expected at most the sum of the other two moments, {limit}, got 30 kg m^2"
    assert found == f"{index + 1}: mass_properties.izz: {expected}"


def test_an_output_is_needed_for_every_control(tmp_path: Path) -> None:
    text = SHIPPED[: SHIPPED.rindex("[[servo_outputs]]")]
    assert _error(tmp_path, text).endswith("servo_outputs: expected an output for every control, missing elevator")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (SHIPPED + "\n[wing\n", rf"{SHIPPED.count(chr(10)) + 2}: not valid TOML: "),
        (SHIPPED + "\n[wing]\n", r"\d+: not valid TOML: "),
        (SHIPPED + "\na = 'x", r"\d+: not valid TOML: "),
        (b"name = 'x'\n\xff", "2: expected UTF-8 text, got byte 0xff"),
        ("", "1: name: missing; expected a text"),
    ],
)
def test_what_is_not_toml_is_reported_with_its_line(tmp_path: Path, text: str | bytes, expected: str) -> None:
    assert re.match(expected, _error(tmp_path, text))


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(AircraftFileError, match=r"nowhere\.toml: cannot be read: No such file or directory$"):
        load_aircraft(tmp_path / "nowhere.toml")
    with pytest.raises(AircraftFileError, match=r"cannot be read: Is a directory$"):
        load_aircraft(tmp_path)


@given(
    start=st.integers(0, len(SHIPPED)),
    removed=st.integers(0, 40),
    inserted=st.text("abc019.\"=[]{}#'\n\\ ,-", max_size=6),
)
def test_damaged_files_load_or_fail_with_one_line(
    tmp_path_factory: pytest.TempPathFactory, start: int, removed: int, inserted: str
) -> None:
    path = tmp_path_factory.getbasetemp() / "damaged.toml"
    path.write_text(SHIPPED[:start] + inserted + SHIPPED[start + removed :])
    message = ""
    try:
        load_aircraft(path)
    except AircraftFileError as error:
        message = str(error)
    assert message == "" or re.fullmatch(rf"{re.escape(str(path))}:\d+: [^\n]+", message)


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    path = tmp_path / "copy.toml"
    path.write_bytes(SHIPPED.encode())
    return path


@given(chord=st.floats(0.02, 3), incidence=st.floats(-0.26, 0.26), x=st.floats(-10, 10), gain=st.floats(1, 1e9))
def test_written_values_come_back_to_seven_digits(
    tmp_path_factory: pytest.TempPathFactory, chord: float, incidence: float, x: float, gain: float
) -> None:
    path = tmp_path_factory.getbasetemp() / "written.toml"
    path.write_text(SHIPPED)
    values = {"wing.chord": chord, "wing.incidence": incidence, "wing.pivot.x": x, "elevator.tail_gain": gain}
    write_values(path, values, "test")
    read, wanted = load_aircraft(path), load_aircraft().with_values(values)
    assert read.wing.chord == pytest.approx(chord, rel=5e-7)
    assert read.wing.incidence == pytest.approx(incidence, rel=5e-7, abs=1e-300)
    assert read.wing.pivot == pytest.approx(wanted.wing.pivot, rel=5e-7)
    assert read.elevator.tail_gain == pytest.approx(gain, rel=5e-7)


def test_writing_changes_the_named_numbers_and_their_source_and_nothing_else(copy: Path) -> None:
    values = {
        "wing.incidence": math.radians(2.5),
        "rotors.wing.hub.x": 0.17,
        "wing.strips.wetted.width": 0.4002,
        "wing.slipstream": "paper",
        "rotors.wing.spin": "left-handed",
        "rotors.wing.blades": 3,
    }
    write_values(copy, values, 'measured "by hand"')
    old, new = SHIPPED.split("\n"), copy.read_text().split("\n")
    changed = {index: line for index, line in enumerate(new) if line != old[index]}
    assert len(old) == len(new)
    assert sorted(changed) == sorted(
        [_place("[wing]", "incidence"), _place("[rotors.wing]", "hub"), _place("[wing]", "slipstream"),
         _place("[rotors.wing]", "spin"), _place("[rotors.wing]", "blades"),
         next(i for i, line in enumerate(old) if line.startswith("width") and 'name    = "wetted"' in old[i - 2])]
    )  # fmt: skip
    document = tomllib.loads(copy.read_text())
    hub, was = document["rotors"]["wing"]["hub"], tomllib.loads(SHIPPED)["rotors"]["wing"]["hub"]
    assert document["wing"]["incidence"] == {"value": 2.5, "unit": "deg", "source": 'measured "by hand"'}
    assert hub == {"value": [0.17, *was["value"][1:]], "unit": "m", "source": 'measured "by hand"'}
    hub_line, spin_line = (new[_place("[rotors.wing]", key)] for key in ("hub", "spin"))
    assert hub_line.endswith("# of the right rotor, in wing axes from the pivot")
    assert spin_line.startswith('spin         = "left-handed"')
    assert spin_line.endswith("# of the right rotor: blades go up inboard")
    assert hub_line.index("unit") == old[_place("[rotors.wing]", "hub")].index("unit")  # columns stay
    assert load_aircraft(copy).wing.slipstream == "paper"
    assert load_aircraft(copy).rotors.wing.blades == 3


def test_writing_keeps_the_line_ends_of_the_file(copy: Path) -> None:
    copy.write_bytes(SHIPPED.replace("\n", "\r\n").encode())
    write_values(copy, {"wing.chord": 0.3}, "test")
    assert load_aircraft(copy).wing.chord == 0.3
    assert copy.read_bytes().count(b"\r\n") == copy.read_bytes().count(b"\n") == SHIPPED.count("\n")


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"wing.chord": 0.25, "wing.taper": 7.0}, r"wing\.taper: expected a plain number between 0\.2 and 1, got 7"),
        ({"wing.chord": 0.25, "wing.span": 7.0}, r":\d+: wing\.span: expected 2 m, where"),
        ({"wing.chord": 0.25, "wing.sweep": 0.1}, r"wing\.sweep: no such value"),
    ],
)
def test_what_would_spoil_the_file_is_not_written(copy: Path, values: dict[str, Any], message: str) -> None:
    with pytest.raises(AircraftFileError, match=message):
        write_values(copy, values, "test")
    assert copy.read_text() == SHIPPED


def test_a_value_spread_over_lines_is_read_but_not_written(copy: Path) -> None:
    index = _place("[wing]", "pivot")
    copy.write_text(_with_line(index, "pivot = { unit = 'm', value = [\n  0.0,\n  0.0, # up\n  -0.07] }"))
    assert load_aircraft(copy).wing.pivot == (0.0, 0.0, -0.07)
    with pytest.raises(AircraftFileError, match=rf":{index + 1}: wing\.pivot: expected .* on one line"):
        write_values(copy, {"wing.pivot.x": 0.1}, "test")
    write_values(copy, {"wing.chord": 0.3}, "test")
    assert load_aircraft(copy).wing.chord == 0.3
