"""Sticks as pulses of a receiver."""

import pytest

from sitl.flight.manual_input import ManualInput
from tests.sitl.mavlink.telemetry.observed import Observed

UNUSED = 65535


def pulses(m: object) -> list[int]:
    return [getattr(m, f"chan{number}_raw") for number in range(1, 19)]


def test_without_sticks_there_are_no_channels() -> None:
    for observed in (Observed(), Observed(autopilot=False)):
        m = observed.sent("RC_CHANNELS")
        assert (m.chancount, m.rssi) == (0, 255)
        assert pulses(m) == [UNUSED] * 18


@pytest.mark.parametrize(
    ("sticks", "expected"),
    [
        (ManualInput(), [1500, 1500, 1500, 1500]),
        (ManualInput(right=1.0, throttle=0.0), [2000, 1500, 1000, 1500]),
        (ManualInput(forward=1.0, throttle=1.0, turn=-1.0), [1500, 1000, 2000, 1000]),
        (ManualInput(forward=-0.5, turn=0.25, tilt=0.75), [1500, 1750, 1500, 1625, 1750]),
    ],
)
def test_sticks_are_roll_pitch_throttle_yaw_and_the_tilt_lever(sticks: ManualInput, expected: list[int]) -> None:
    observed = Observed()
    observed.flight.manual(sticks)
    observed.fly(0.1)
    m = observed.sent("RC_CHANNELS")
    assert (m.time_boot_ms, m.chancount) == (100, len(expected))
    assert pulses(m) == expected + [UNUSED] * (18 - len(expected))


def test_lost_sticks_leave_no_channels() -> None:
    observed = Observed()
    observed.flight.manual(ManualInput())
    observed.fly(observed.flight.parameters["COM_RC_LOSS_T"] + 0.1)
    assert observed.sent("RC_CHANNELS").chancount == 0
    observed.flight.links.enforced = False  # as fast as possible silence does not count
    assert observed.sent("RC_CHANNELS").chancount == 4
