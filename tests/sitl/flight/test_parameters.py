"""Parameters: what may be set, what is told about what may not, and that each of them is there for a reason."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

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
        assert definition.values is None or definition.default in definition.values
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


def test_listeners_hear_of_changes_only_and_find_all_new_values() -> None:
    parameters = Parameters()
    heard: list[tuple[str, float, float]] = []
    parameters.on_change.append(lambda name: heard.append((name, parameters["NAV_ACC_RAD"], parameters["WV_EN"])))
    parameters.set("NAV_ACC_RAD", 10.0)
    assert heard == []
    parameters.load({"NAV_ACC_RAD": 5.0, "WV_EN": 1, "RTL_TYPE": 0})
    assert heard == [("NAV_ACC_RAD", 5.0, 1), ("WV_EN", 5.0, 1)]


def test_every_parameter_is_read_somewhere() -> None:
    folder = Path(sitl.__file__).parent
    sources = "".join(path.read_text() for path in folder.rglob("*.py") if path.name != "parameter_table.py")
    unused = [name for name in Parameters().names() if f'"{name}"' not in sources]
    assert unused == []
