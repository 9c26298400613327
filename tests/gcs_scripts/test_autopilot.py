"""Names of flight modes, against the autopilots' numbers and this vehicle's own tables."""

from types import SimpleNamespace
from typing import Any

import pytest
from pymavlink.dialects.v20 import all as mav

from gcs_scripts.autopilot import Modes, arms_in_guided
from sitl.mavlink.identity import IDENTITIES

PX4, ARDUPILOT, GENERIC = 12, 3, 0


def beat(autopilot: int, kind: int, custom_mode: int) -> Any:
    return SimpleNamespace(autopilot=autopilot, type=kind, custom_mode=custom_mode, base_mode=1)


@pytest.mark.parametrize(
    ("autopilot", "kind", "number", "name", "flies_mission"),
    [
        (PX4, 24, 4 << 16 | 4 << 24, "MISSION", True), (PX4, 2, 4 << 16 | 3 << 24, "LOITER", False),
        (PX4, 24, 3 << 16 | 1 << 24, "ORBIT", False), (PX4, 24, 10 << 16, "TERMINATION", False),
        (PX4, 24, 9 << 16 | 9 << 24, "mode 9:9", False),
        (ARDUPILOT, 21, 10, "AUTO", True), (ARDUPILOT, 24, 10, "AUTO", True), (ARDUPILOT, 1, 19, "QLOITER", False),
        (ARDUPILOT, 2, 3, "AUTO", True), (ARDUPILOT, 2, 12, "mode 12", False), (ARDUPILOT, 21, 99, "mode 99", False),
        (GENERIC, 24, 5, "mode 5", False),
    ],
)  # fmt: skip
def test_modes_have_their_autopilots_names(
    autopilot: int, kind: int, number: int, name: str, flies_mission: bool
) -> None:
    modes, heartbeat = Modes(), beat(autopilot, kind, number)
    assert (modes.name(heartbeat), modes.is_mission(heartbeat)) == (name, flies_mission)


def test_no_mode_of_this_vehicle_is_without_a_name() -> None:
    for identity in (IDENTITIES["px4"], IDENTITIES["ardupilot"]):
        for entry in identity.modes:
            name = Modes().name(beat(identity.autopilot, identity.vehicle_type, entry.number))
            assert not name.startswith("mode "), (identity.name, entry)


def test_an_unknown_autopilots_modes_are_those_it_tells() -> None:
    modes = Modes()
    modes.add(mav.MAVLink_available_modes_message(2, 1, mav.MAV_STANDARD_MODE_MISSION, 5, 0, b""))
    modes.add(mav.MAVLink_available_modes_message(2, 2, mav.MAV_STANDARD_MODE_NON_STANDARD, 6, 0, b"Dance"))
    assert modes.name(beat(GENERIC, 24, 5)) == "MISSION"
    assert modes.is_mission(beat(GENERIC, 24, 5))
    assert modes.name(beat(GENERIC, 24, 6)) == "Dance"


def test_only_ardupilots_copters_arm_in_another_mode_than_the_missions() -> None:
    assert arms_in_guided(beat(ARDUPILOT, mav.MAV_TYPE_HEXAROTOR, 0))
    assert not arms_in_guided(beat(ARDUPILOT, mav.MAV_TYPE_VTOL_TILTROTOR, 0))
    assert not arms_in_guided(beat(PX4, mav.MAV_TYPE_QUADROTOR, 0))
