"""Failures on command: each does what it says, OK restores, and what is not modelled is not pretended."""

from collections.abc import Iterator

import pytest

from sitl.mavlink.dialect import tiltwing as mav
from sitl.simulation import Simulation
from tests.sitl.mavlink.in_memory import Desk

INJECT = mav.MAV_CMD_INJECT_FAILURE
OK, OFF, STUCK, GARBAGE, SLOW = (
    mav.FAILURE_TYPE_OK, mav.FAILURE_TYPE_OFF, mav.FAILURE_TYPE_STUCK, mav.FAILURE_TYPE_GARBAGE, mav.FAILURE_TYPE_SLOW,
)  # fmt: skip
MOTOR, SERVO = mav.FAILURE_UNIT_SYSTEM_MOTOR, mav.FAILURE_UNIT_SYSTEM_SERVO
ACCEPTED, UNSUPPORTED, DENIED = mav.MAV_RESULT_ACCEPTED, mav.MAV_RESULT_UNSUPPORTED, mav.MAV_RESULT_DENIED


@pytest.fixture
def flying() -> Iterator[Desk]:
    desk = Desk(Simulation(start="trim:20", parameters={"SYS_FAILURE_EN": 1}))
    desk.advance(0.5)
    yield desk
    desk.close()


def thrusts(desk: Desk) -> list[float]:
    return [float(rotor["thrust_factor"]) for rotor in desk.simulation.airframe.vehicle[0]["rotors"][:3]]


def test_failures_need_their_parameter(desk: Desk) -> None:
    assert desk.command(INJECT, MOTOR, OFF, 1).result == DENIED
    assert "SYS_FAILURE_EN" in desk.texts[-1]


def test_motors_stop_weaken_and_are_well_again(flying: Desk) -> None:
    assert flying.command(INJECT, MOTOR, SLOW, 2).result == ACCEPTED
    assert thrusts(flying) == pytest.approx([1.0, 0.8, 1.0])
    assert flying.command(INJECT, MOTOR, OFF, 3).result == ACCEPTED
    assert thrusts(flying) == pytest.approx([1.0, 0.8, 0.0])
    assert flying.command(INJECT, MOTOR, OK, 3).result == ACCEPTED
    assert thrusts(flying) == pytest.approx([1.0, 0.8, 1.0])
    assert flying.command(INJECT, MOTOR, OK, 0).result == ACCEPTED
    assert thrusts(flying) == pytest.approx([1.0, 1.0, 1.0])


def test_a_servo_sticks_and_moves_again(flying: Desk) -> None:
    servos = flying.simulation.airframe.vehicle[0]["servos"]
    healthy = servos.copy()
    assert flying.command(INJECT, SERVO, STUCK, 1).result == ACCEPTED
    before = flying.simulation.snapshot().tilt
    flying.command(mav.MAV_CMD_DO_VTOL_TRANSITION, 3)
    flying.advance(8.0)
    assert flying.simulation.snapshot().tilt == pytest.approx(before, abs=1e-6)
    assert flying.command(INJECT, SERVO, OK, 1).result == ACCEPTED
    assert (servos == healthy).all()


def test_links_fall_silent_and_are_heard_again(flying: Desk) -> None:
    links = flying.simulation.flight.links
    flying.send("HEARTBEAT", type=mav.MAV_TYPE_GCS)
    flying.advance(0.1)
    assert flying.command(INJECT, mav.FAILURE_UNIT_SYSTEM_MAVLINK_SIGNAL, OFF, 0).result == ACCEPTED
    flying.advance(2.0)
    flying.send("HEARTBEAT", type=mav.MAV_TYPE_GCS)
    flying.advance(0.1)
    assert links.ground_station == pytest.approx(2.1, abs=0.1)
    assert flying.command(INJECT, mav.FAILURE_UNIT_SYSTEM_MAVLINK_SIGNAL, OK, 0).result == ACCEPTED
    flying.advance(0.1)
    assert links.ground_station == pytest.approx(0.2, abs=0.1)


@pytest.mark.parametrize(
    ("unit", "kind"),
    [(MOTOR, GARBAGE), (mav.FAILURE_UNIT_SENSOR_GPS, OFF), (mav.FAILURE_UNIT_SENSOR_GYRO, OK), (9999, OFF)],
)
def test_what_is_not_modelled_is_unsupported(flying: Desk, unit: int, kind: int) -> None:
    assert flying.command(INJECT, unit, kind, 0).result == UNSUPPORTED


def test_an_instance_there_is_not_is_denied(flying: Desk) -> None:
    assert flying.command(INJECT, MOTOR, OFF, 4).result == DENIED
    assert "left, right, tail" in flying.texts[-1]
