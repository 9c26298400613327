"""Arming: each reason to refuse, told in a pilot's words, and none where there is none."""

import dataclasses
import math
from typing import Any

import pytest

from sitl.flight.arming import ArmingChecks
from sitl.flight.landed import LandedState
from sitl.flight.mode import Mode
from sitl.flight.parameters import Parameters
from sitl.flight.view import View

UPRIGHT = math.radians(90.0)
STANDING = View(tilt=UPRIGHT, tilt_command=UPRIGHT, battery_voltage=48.0, battery_remaining=1.0)
EMPTY_VOLTAGE = 39.6


def problems(
    mode: Mode = Mode.HOLD,
    landed: LandedState = LandedState.ON_GROUND,
    seen: dict[str, Any] | None = None,
    parameters: dict[str, float] | None = None,
    **known: Any,
) -> list[str]:
    view = dataclasses.replace(STANDING, **seen or {})
    return ArmingChecks(Parameters(parameters), EMPTY_VOLTAGE).problems(view, landed, mode, **known)


def test_a_vehicle_in_good_order_may_be_armed() -> None:
    assert problems() == []


@pytest.mark.parametrize(
    ("seen", "reason"),
    [
        ({"roll": math.radians(-20.0)}, "not level: roll -20 deg, at most 15 deg"),
        ({"pitch": math.radians(16.0)}, "not level: pitch 16 deg, at most 15 deg"),
        ({"q": math.radians(30.0)}, "turning at 30 deg/s, at most 10 deg/s"),
        ({"vn": 0.6, "ve": -0.8}, "moving at 1.0 m/s, at most 0.5 m/s"),
        ({"battery_remaining": 0.15}, "battery at 15 %, at least 20 %"),
        ({"battery_remaining": 0.19996}, "battery at 19.9 %, at least 20 %"),
        ({"battery_voltage": 30.0}, "battery at 30.0 V, empty at 39.6 V"),
        ({"tilt": math.radians(45.0)}, "wing at 45 deg though told to be at 90 deg: tilt servo moving or stuck"),
        ({"north": math.nan}, "position and attitude are not known"),
    ],
)
def test_what_is_wrong_with_the_vehicle_is_told(seen: dict[str, Any], reason: str) -> None:
    assert problems(seen=seen) == [reason]


@pytest.mark.parametrize(
    ("known", "reason"),
    [
        ({"inside_fence": False}, "outside the geofence"),
        ({"faults": ("left motor failed",)}, "left motor failed: not repaired"),
        ({"mode": Mode.MISSION}, "no mission"),
        ({"mode": Mode.MISSION, "mission_feasible": False}, "the mission cannot be flown"),
        ({"mode": Mode.RETURN}, "Return does not begin a flight"),
        ({"mode": Mode.LAND}, "Land does not begin a flight"),
        ({"mode": Mode.TERMINATION}, "Termination does not begin a flight"),
        ({"mode": Mode.POSITION}, "Position needs manual control"),
        ({"mode": Mode.STABILIZED, "throttle": 0.2}, "throttle stick is not at its lowest"),
        ({"mode": Mode.ALTITUDE, "throttle": 0.8}, "throttle stick asks to climb"),
        ({"landed": LandedState.IN_AIR}, "not on the ground"),
    ],
)
def test_what_speaks_against_the_flight_is_told(known: dict[str, Any], reason: str) -> None:
    assert problems(**known) == [reason]


@pytest.mark.parametrize(
    "known",
    [
        {"mode": Mode.MISSION, "mission_feasible": True},
        {"mode": Mode.MANUAL, "throttle": 0.0},
        {"mode": Mode.POSITION, "throttle": 0.5},
        {"mode": Mode.TAKEOFF},
        {"mode": Mode.OFFBOARD},
    ],
)
def test_modes_that_begin_a_flight_may_be_armed_in(known: dict[str, Any]) -> None:
    assert problems(**known) == []


def test_all_reasons_are_told_at_once() -> None:
    assert len(problems(seen={"roll": 1.0, "battery_remaining": 0.0}, inside_fence=False)) == 3


def test_parameters_that_contradict_each_other_are_told() -> None:
    assert problems(parameters={"FW_AIRSPD_MIN": 22.0}) == [
        "parameters: expected FW_AIRSPD_MIN <= FW_AIRSPD_TRIM <= FW_AIRSPD_MAX, got 22, 20, 30"
    ]
    assert problems(parameters={"BAT_CRIT_THR": 0.3}) == [
        "parameters: expected BAT_EMERGEN_THR <= BAT_CRIT_THR <= BAT_LOW_THR, got 0.07, 0.3, 0.2"
    ]


def test_limits_are_those_of_the_parameters() -> None:
    lenient = {"TW_ARM_LEVEL": 30.0, "COM_ARM_BAT_MIN": 0.1}
    seen = {"roll": math.radians(-20.0), "battery_remaining": 0.15}
    assert problems(seen=seen, parameters=lenient) == []
