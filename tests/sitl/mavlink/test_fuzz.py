"""Noise and arbitrary messages do the vehicle no harm, and what commands nothing changes nothing in its flight.

These are samples: `make fuzz` does it at length.
"""

import pytest

from sitl.mavlink.identity import ARDUPILOT, PX4, Identity
from tests.sitl.mavlink.fuzzing import COMMANDING, HARMLESS, any_storm, harmless_storm, served_messages
from tests.sitl.mavlink.in_memory import Desk


def test_of_every_message_that_is_served_it_is_known_whether_it_can_command(desk: Desk) -> None:
    assert served_messages(desk) == COMMANDING | HARMLESS
    assert not COMMANDING & HARMLESS


@pytest.mark.parametrize(("identity", "seed"), [(PX4, 0), (ARDUPILOT, 1)])
def test_a_storm_that_commands_nothing_changes_no_bit_of_a_flight(identity: Identity, seed: int) -> None:
    outcome = harmless_storm(seed, 100_000, 12_000, 3000, identity)
    assert outcome.unchanged
    assert outcome.errors == 0
    assert 12_000 <= outcome.received < 12_100
    assert outcome.malformed > 100


@pytest.mark.parametrize(("identity", "seed"), [(PX4, 0), (ARDUPILOT, 1), (PX4, 2)])
def test_whatever_messages_come_no_service_fails_and_the_vehicle_flies_on(identity: Identity, seed: int) -> None:
    outcome = any_storm(seed, 8000, 1000, identity)
    assert outcome.errors == 0
    assert outcome.received == 8000
