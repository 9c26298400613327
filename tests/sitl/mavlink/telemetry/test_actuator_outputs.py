"""Normalised outputs against the aircraft's own map of channels."""

from collections.abc import Callable

import pytest

from sitl.mavlink.dialect import tiltwing as mav
from sitl.snapshot import Snapshot
from tests.sitl.mavlink.telemetry.observed import Observed
from vehicle_model.aircraft import Aircraft

Moment = Callable[..., Snapshot]


@pytest.fixture
def observed() -> Observed:
    return Observed()


def test_actuator_output_status(moment: Moment, observed: Observed, aircraft: Aircraft) -> None:
    m = observed.sent("ACTUATOR_OUTPUT_STATUS", moment())
    assert (m.time_usec, m.active) == (12347500, 0b1111111)
    assert m.actuator[:7] == pytest.approx(aircraft.normalised_outputs(moment().controls))
    assert m.actuator[:3] == pytest.approx([0.60, 0.50, -0.25])  # throttles
    assert m.actuator[7:] == [0.0] * 25


@pytest.mark.parametrize(("armed", "mode"), [(True, 1 | 128), (False, 1), (None, 1)])
def test_hil_actuator_controls(
    moment: Moment, observed: Observed, aircraft: Aircraft, armed: bool | None, mode: int
) -> None:
    m = observed.sent("HIL_ACTUATOR_CONTROLS", moment(armed=armed))
    assert (m.time_usec, m.mode, m.flags) == (12347500, mode, 0)
    assert mav.MAV_MODE_FLAG_SAFETY_ARMED == 128
    assert m.controls[:7] == pytest.approx(aircraft.normalised_outputs(moment().controls))
    assert m.controls[7:] == [0.0] * 9


def test_a_channel_that_only_a_command_moves_is_among_them(moment: Moment, observed: Observed) -> None:
    observed.context.free_pulses[9] = 1750
    m = observed.sent("ACTUATOR_OUTPUT_STATUS", moment())
    assert m.active == 0b101111111
    assert (m.actuator[7], m.actuator[8]) == (0.0, 0.5)
