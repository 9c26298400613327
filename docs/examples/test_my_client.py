"""Tests of a MAVLink client against a flying tilt-wing.

Copy this file, put your own client in the place of `arm`, and run pytest.
"""

from collections.abc import Iterator
from typing import Any

import pytest
from pymavlink import mavutil
from pymavlink.dialects.v20 import common as mav

from sitl.testing import SitlVehicle


class RefusedError(Exception):
    """The vehicle did not do what it was asked."""


def arm(connection: Any, attempts: int = 3) -> None:
    """The client under test: arms a vehicle, asks again if no answer comes, and says why it could not."""
    for confirmation in range(attempts):
        params = (1, 0, 0, 0, 0, 0, 0)
        connection.mav.command_long_send(
            connection.target_system, 1, mav.MAV_CMD_COMPONENT_ARM_DISARM, confirmation, *params
        )
        answer = connection.recv_match(type="COMMAND_ACK", blocking=True, timeout=0.5)
        if answer is not None:
            if answer.result != mav.MAV_RESULT_ACCEPTED:
                raise RefusedError(mav.enums["MAV_RESULT"][answer.result].name)
            return
    raise TimeoutError


@pytest.fixture
def client(tiltwing_sitl: SitlVehicle) -> Iterator[Any]:
    """A connected client; the vehicle behind it is the test's own."""
    connection: Any = mavutil.mavlink_connection(tiltwing_sitl.connection)
    assert connection.wait_heartbeat(timeout=10) is not None
    yield connection
    connection.close()


def test_it_arms_the_vehicle(client: Any, tiltwing_sitl: SitlVehicle) -> None:
    """Whether it did is not asked of the client, but seen by a connection of our own."""
    arm(client)
    observer = tiltwing_sitl.connect()
    while not observer.motors_armed():
        assert observer.recv_match(type="HEARTBEAT", blocking=True, timeout=5) is not None


def test_it_asks_again_when_the_answer_is_lost(client: Any, tiltwing_sitl: SitlVehicle) -> None:
    """The next COMMAND_ACK gets lost on the wire, and nothing else."""
    tiltwing_sitl.wire.drop(messages="COMMAND_ACK", count=1)
    arm(client)
    sent = tiltwing_sitl.wire.messages("COMMAND_LONG")
    assert [command.confirmation for command in sent] == [0, 1]


def test_it_says_why_it_was_refused(client: Any, tiltwing_sitl: SitlVehicle) -> None:
    """The wire answers in the vehicle's place."""
    tiltwing_sitl.wire.deny("COMPONENT_ARM_DISARM", "TEMPORARILY_REJECTED")
    with pytest.raises(RefusedError, match="MAV_RESULT_TEMPORARILY_REJECTED"):
        arm(client)


def test_it_gives_up_when_nothing_is_heard(client: Any, tiltwing_sitl: SitlVehicle) -> None:
    """A link that has gone dead, as behind a hill."""
    tiltwing_sitl.wire.silence("to_client")
    with pytest.raises(TimeoutError):
        arm(client)


@pytest.mark.tiltwing_sitl(at="trim:20", speed=10, seed=1, wind=(5, 0))
def test_it_hears_the_vehicle_through_a_bad_radio(client: Any, tiltwing_sitl: SitlVehicle) -> None:
    """A third of all messages lost, and late by half a second; the vehicle flies already, at ten times real time."""
    tiltwing_sitl.wire.drop(0.3)
    tiltwing_sitl.wire.delay(0.5, jitter=0.1)
    speed = client.recv_match(type="VFR_HUD", blocking=True, timeout=10).airspeed
    assert 15 < speed < 25
