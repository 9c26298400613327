"""Parameters: what may be set, what is told about what may not, and that each of them is there for a reason."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import sitl
from sitl.flight.parameters import Parameters


def test_begins_with_the_defaults() -> None:
    parameters = Parameters()
    assert parameters["COM_DISARM_LAND"] == 1.5
    assert parameters["FW_AIRSPD_MIN"] == 15.0
    assert parameters["FW_AIRSPD_TRIM"] == 20.0
    assert parameters["FW_AIRSPD_MAX"] == 30.0


def test_kinds_are_kept_by_defaults_and_by_setting() -> None:
    parameters = Parameters({"NAV_RCL_ACT": 3.0, "NAV_ACC_RAD": 7})
    assert isinstance(parameters["NAV_RCL_ACT"], int)
    assert isinstance(parameters["NAV_ACC_RAD"], float)
    for definition in parameters.definitions:
        assert isinstance(parameters[definition.name], int if definition.kind == "int" else float)


def test_every_definition_is_complete_and_its_default_in_range() -> None:
    definitions = Parameters.definitions
    for definition in definitions:
        assert re.fullmatch(r"[A-Z][A-Z0-9_]{1,15}", definition.name), "MAVLink has room for 16 characters"
        assert definition.minimum <= definition.default <= definition.maximum
        assert definition.description
        assert definition.group
        assert definition.values is None or definition.default in definition.values
        assert definition.bits is None or definition.maximum == sum(1 << bit for bit in definition.bits)
        Parameters().set(definition.name, definition.default)
    names = [definition.name for definition in definitions]
    assert names == sorted(set(names))
    assert tuple(names) == Parameters().names()


def test_the_touch_down_is_slower_than_asked_for_whatever_is_set() -> None:
    landing = Parameters().definition("MPC_LAND_SPEED")
    assert landing.default == 0.4
    assert landing.maximum < 0.6


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("NAV_ACC_RAD", 500.0, "NAV_ACC_RAD: expected 0.5 to 200 m, got 500.0"),
        ("NAV_ACC_RAD", math.nan, "NAV_ACC_RAD: expected 0.5 to 200 m, got nan"),
        ("NAV_ACC_RAD", -math.inf, "NAV_ACC_RAD: expected 0.5 to 200 m, got -inf"),
        ("BAT_LOW_THR", 1.5, "BAT_LOW_THR: expected 0 to 0.9, got 1.5"),
        ("WV_EN", 2, "WV_EN: expected 0 (Keep heading), 1 (Turn into the wind), got 2"),
        ("COM_RCL_EXCEPT", 2.5, "COM_RCL_EXCEPT: expected a whole number 0 to 7, got 2.5"),
        ("SYS_AUTOSTART", 4001, "SYS_AUTOSTART: expected 22000, which cannot be set, got 4001"),
        ("SENS_DPRES_OFF", 0.0, "SENS_DPRES_OFF: expected 0.001 Pa, which cannot be set, got 0.0"),
        ("NAV_ACC_RDA", 10.0, "NAV_ACC_RDA: unknown parameter, expected NAV_ACC_RAD"),
        ("QQQQ", 1.0, "QQQQ: unknown parameter, expected one of the listed names"),
    ],
)  # fmt: skip
def test_what_may_not_be_set_is_told_with_name_range_and_value(name: str, value: float, message: str) -> None:
    parameters = Parameters()
    with pytest.raises(ValueError, match=re.escape(message)) as refusal:
        parameters.set(name, value)
    assert str(refusal.value).startswith(message)
    assert all(parameters[n] == Parameters()[n] for n in parameters.names())


def test_text_from_a_file_is_refused_as_any_other_value() -> None:
    with pytest.raises(ValueError, match=r"NAV_ACC_RAD: expected 0\.5 to 200 m, got '10'"):
        Parameters().load({"NAV_ACC_RAD": "10"})  # pyright: ignore[reportArgumentType]


def test_loads_all_or_nothing() -> None:
    parameters = Parameters()
    with pytest.raises(ValueError, match="NAV_LOITER_RAD"):
        parameters.load({"NAV_ACC_RAD": 5.0, "NAV_LOITER_RAD": -1.0})
    assert parameters["NAV_ACC_RAD"] == 10.0
    parameters.load({"NAV_ACC_RAD": 5.0, "NAV_LOITER_RAD": 100.0})
    assert parameters["NAV_ACC_RAD"] == 5.0
    assert parameters["NAV_LOITER_RAD"] == 100.0


def test_limits_survive_single_precision() -> None:
    parameters = Parameters()
    for definition in parameters.definitions:
        for limit in (definition.minimum, definition.maximum):
            parameters.set(definition.name, float(np.float32(limit)))
            assert definition.minimum <= parameters[definition.name] <= definition.maximum


def test_a_fact_may_be_set_to_what_it_is_as_a_whole_file_does() -> None:
    parameters = Parameters()
    facts = [definition for definition in parameters.definitions if definition.read_only]
    assert facts
    parameters.load({definition.name: float(np.float32(definition.default)) for definition in facts})
    assert all(parameters[definition.name] == definition.default for definition in facts)


@given(st.floats(width=32, min_value=0.5, max_value=200.0))
def test_a_value_of_single_precision_becomes_the_decimal_number_it_stands_for(value: float) -> None:
    parameters = Parameters({"NAV_ACC_RAD": value})
    assert repr(parameters["NAV_ACC_RAD"]) == repr(float(str(np.float32(value))))
    assert np.float32(parameters["NAV_ACC_RAD"]) == np.float32(value)


@given(st.floats(min_value=0.5, max_value=200.0))
def test_a_value_of_double_precision_stays_as_it_is(value: float) -> None:
    if float(np.float32(value)) != value:
        assert Parameters({"NAV_ACC_RAD": value})["NAV_ACC_RAD"] == value


def test_listeners_hear_of_changes_only_and_find_all_new_values() -> None:
    parameters = Parameters()
    heard: list[tuple[str, float, float]] = []
    parameters.on_change.append(lambda name: heard.append((name, parameters["NAV_ACC_RAD"], parameters["WV_EN"])))
    parameters.set("NAV_ACC_RAD", 10.0)
    assert heard == []
    parameters.load({"NAV_ACC_RAD": 5.0, "WV_EN": 1, "RTL_TYPE": 0})
    assert heard == [("NAV_ACC_RAD", 5.0, 1), ("WV_EN", 5.0, 1)]


def test_every_parameter_that_can_be_set_is_read_somewhere() -> None:
    folder = Path(sitl.__file__).parent
    sources = "".join(path.read_text() for path in folder.rglob("*.py") if path.name != "parameter_table.py")
    settings = [definition.name for definition in Parameters.definitions if not definition.read_only]
    unused = [name for name in settings if f'"{name}"' not in sources]
    assert unused == []
