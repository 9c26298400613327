"""Estimates from outside are judged, and needed by nobody."""

import math

import pytest

from sitl.mavlink.dialect import tiltwing as mav
from tests.sitl.mavlink.in_memory import Desk

POSITION, WIND = mav.MAV_CMD_EXTERNAL_POSITION_ESTIMATE, mav.MAV_CMD_EXTERNAL_WIND_ESTIMATE
NAN = math.nan


def test_sound_ones_are_accepted_and_change_nothing(desk: Desk) -> None:
    before = desk.simulation.state.tobytes()
    desk.send("COMMAND_INT", command=POSITION, frame=0, param1=1.0, param3=5.0, x=473977420, y=85455940, z=NAN)
    assert desk.of("COMMAND_ACK")[-1].result == mav.MAV_RESULT_ACCEPTED
    assert desk.command(WIND, 5.0, NAN, 270.0, NAN).result == mav.MAV_RESULT_ACCEPTED
    assert desk.simulation.state.tobytes() == before


@pytest.mark.parametrize(
    ("command", "params"),
    [
        (POSITION, (0.0, 0.0, NAN, NAN, NAN, 8.5)),
        (POSITION, (0.0, 0.0, NAN, NAN, 91.0, 8.5)),
        (POSITION, (0.0, 0.0, -1.0, NAN, 47.0, 8.5)),
        (WIND, (-1.0, NAN, 10.0, NAN)),
        (WIND, (5.0, NAN, 361.0, NAN)),
        (WIND, (NAN, NAN, NAN, NAN)),
        (WIND, (5.0, -2.0, 10.0, NAN)),
    ],
)
def test_nonsense_is_denied_with_a_reason(desk: Desk, command: int, params: tuple[float, ...]) -> None:
    assert desk.command(command, *params).result == mav.MAV_RESULT_DENIED
    assert "expected" in desk.texts[-1]
