"""Sticks from a ground station: where they go, whose they are, and when they are lost."""

import pytest

from sitl.flight.manual_input import ManualInput
from sitl.mavlink.dialect import tiltwing as mav
from sitl.simulation import Simulation
from tests.sitl.mavlink.in_memory import Desk


@pytest.mark.parametrize(
    ("axes", "sticks"),
    [
        ({"x": 1000, "y": -500, "z": 250, "r": 100}, ManualInput(1.0, -0.5, 0.25, 0.1)),
        ({"x": 5000, "y": -5000, "z": 5000, "r": 0}, ManualInput(1.0, -1.0, 1.0, 0.0)),
        ({"x": 0, "y": 0, "z": -500, "r": 0}, ManualInput(0.0, 0.0, 0.0, 0.0)),
        ({"x": 32767, "y": 32767, "z": 32767, "r": 32767}, ManualInput(0.0, 0.0, 0.5, 0.0)),
    ],
)
def test_manual_control_becomes_sticks(desk: Desk, axes: dict[str, int], sticks: ManualInput) -> None:
    desk.send("MANUAL_CONTROL", target=1, **axes)
    assert desk.simulation.flight.sticks.now == sticks


def test_sticks_for_another_vehicle_are_not_ours(desk: Desk) -> None:
    desk.send("MANUAL_CONTROL", target=2, x=1000, z=500)
    assert desk.simulation.flight.sticks.now == ManualInput()


def test_channels_override_each_other_and_are_released(desk: Desk) -> None:
    def override(*pulses: int) -> ManualInput:
        desk.send("RC_CHANNELS_OVERRIDE", **{f"chan{n}_raw": pulse for n, pulse in enumerate(pulses, start=1)})
        return desk.simulation.flight.sticks.now

    def positions(sticks: ManualInput) -> tuple[float, ...]:
        return sticks.forward, sticks.right, sticks.throttle, sticks.turn

    assert positions(override(1750, 1250, 1800, 1400)) == pytest.approx((0.5, 0.5, 0.8, -0.2))
    assert positions(override(65535, 1500, 65535, 0)) == pytest.approx((0.0, 0.5, 0.8, 0.0))
    assert positions(override(5, 3000, 1000, 1500)) == pytest.approx((0.0, 0.5, 0.0, 0.0))  # no pulses a radio sends


def test_released_channels_are_no_sticks(desk: Desk) -> None:
    desk.send("RC_CHANNELS_OVERRIDE", chan1_raw=1600, chan3_raw=1500)
    received = desk.simulation.flight.sticks.received
    desk.advance(1.0)
    desk.send("RC_CHANNELS_OVERRIDE")  # all zero: released
    assert desk.simulation.flight.sticks.received == received


def test_one_pilot_has_the_sticks_until_he_is_silent() -> None:
    desk = Desk(Simulation(start="trim:20"))
    other = desk.join(250, 190)
    desk.send("MANUAL_CONTROL", target=1, y=300, z=500)
    desk.advance(0.1)
    other.send("MANUAL_CONTROL", target=1, y=-300, z=500)
    assert desk.simulation.flight.sticks.now.right == 0.3
    desk.advance(1.0)
    other.send("MANUAL_CONTROL", target=1, y=-300, z=500)
    assert desk.simulation.flight.sticks.now.right == -0.3
    desk.close()


def test_lost_sticks_are_noticed_in_flight() -> None:
    desk = Desk(Simulation(start="trim:20"))
    for _ in range(10):
        desk.send("MANUAL_CONTROL", target=1, z=500)
        desk.advance(0.1)
    assert desk.command(mav.MAV_CMD_DO_SET_MODE, 1, 3, 0).result == mav.MAV_RESULT_ACCEPTED
    desk.advance(1.0)
    assert any("Manual control lost" in message.text for message in desk.of("STATUSTEXT"))
    desk.close()


def test_without_an_autopilot_sticks_are_ignored() -> None:
    desk = Desk(Simulation(autopilot=False))
    desk.send("MANUAL_CONTROL", target=1, z=500)
    desk.send("RC_CHANNELS_OVERRIDE", chan1_raw=1600)
    assert desk.face.internal_errors == 0
    desk.close()


def test_the_sticks_are_lost_by_the_pilots_clock_not_by_that_of_a_faster_vehicle(desk: Desk) -> None:
    desk.simulation.pace = 10.0
    other = desk.join(250, 190)
    desk.send("MANUAL_CONTROL", target=1, x=500, z=500)
    desk.advance(4.0)  # COM_RC_LOSS_T is 0.5 s, and his clock has seen 0.4
    other.send("MANUAL_CONTROL", target=1, x=-500, z=500)
    assert desk.simulation.flight.sticks.now.forward == 0.5
    desk.advance(2.0)
    other.send("MANUAL_CONTROL", target=1, x=-500, z=500)
    assert desk.simulation.flight.sticks.now.forward == -0.5
