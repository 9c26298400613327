"""High latency: https://mavlink.io/en/services/high_latency.html and the fields' text in common.xml."""

import math
from typing import Any

import pytest

from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.identity import IDENTITIES
from sitl.simulation import Simulation
from tests.sitl.mavlink.in_memory import Desk, MemoryLink, Station

CONTROL = mav.MAV_CMD_CONTROL_HIGH_LATENCY
REQUEST = mav.MAV_CMD_REQUEST_MESSAGE


def with_satellite(**options: Any) -> tuple[Desk, Station]:
    """A vehicle with an ordinary and a high latency link, and who listens on the latter."""
    desk = Desk(links=[MemoryLink(), MemoryLink("satellite", streams="highlatency")], **options)
    return desk, desk.join(system=254, link=1)


def requested(desk: Desk) -> Any:
    before = len(desk.of("HIGH_LATENCY2"))
    desk.command(REQUEST, mav.MAVLINK_MSG_ID_HIGH_LATENCY2)
    (message,) = desk.of("HIGH_LATENCY2")[before:]
    return message


def test_started_it_is_sent_at_once_and_every_5_s_of_wall_time_until_stopped() -> None:
    desk, satellite = with_satellite()
    assert desk.command(CONTROL, 1).result == mav.MAV_RESULT_ACCEPTED
    assert len(satellite.of("HIGH_LATENCY2")) == 1
    desk.wait(4.9)
    assert len(satellite.of("HIGH_LATENCY2")) == 1
    desk.wait(10.2)
    assert len(satellite.of("HIGH_LATENCY2")) == 4
    assert desk.command(CONTROL, 0).result == mav.MAV_RESULT_ACCEPTED
    desk.wait(11.0)
    assert len(satellite.of("HIGH_LATENCY2")) == 4
    assert desk.of("HIGH_LATENCY2") == []
    desk.close()


def test_started_twice_it_is_not_sent_more_often() -> None:
    desk, satellite = with_satellite()
    desk.command(CONTROL, 1)
    desk.wait(2.0)
    assert desk.command(CONTROL, 1).result == mav.MAV_RESULT_ACCEPTED
    desk.wait(4.0)
    assert len(satellite.of("HIGH_LATENCY2")) == 2
    desk.close()


def test_the_link_carries_nothing_else_but_commands() -> None:
    desk, satellite = with_satellite()
    assert satellite.command(CONTROL, 1).result == mav.MAV_RESULT_ACCEPTED
    desk.simulation.flight.arm(force=True)
    desk.advance(12.0)
    assert {message.get_type() for message in satellite.received} == {"HIGH_LATENCY2", "COMMAND_ACK"}
    assert len(satellite.of("HIGH_LATENCY2")) == 3
    desk.close()


def test_it_goes_on_after_the_vehicle_has_begun_anew() -> None:
    desk, satellite = with_satellite()
    desk.command(CONTROL, 1)
    desk.face.request_restart()
    desk.turn()
    desk.advance(11.0)
    assert [message.timestamp for message in satellite.of("HIGH_LATENCY2")] == pytest.approx([0, 5000, 10000], abs=50)
    desk.close()


def test_without_such_a_link_the_command_fails_with_a_text(desk: Desk) -> None:
    for wanted in (0, 1):
        assert desk.command(CONTROL, wanted).result == mav.MAV_RESULT_FAILED
    assert desk.of("STATUSTEXT")[-1].text == "No link for high latency: needs ,highlatency"


@pytest.mark.parametrize("wanted", [math.nan, 2.0, 0.5, -1.0, math.inf])
def test_any_other_wish_is_denied_with_a_text(wanted: float) -> None:
    desk, satellite = with_satellite()
    assert desk.command(CONTROL, wanted).result == mav.MAV_RESULT_DENIED
    said = "".join(message.text for message in desk.of("STATUSTEXT"))
    assert f"expected 1 to start or 0 to stop, got {wanted:g}" in said
    assert satellite.of("HIGH_LATENCY2") == []
    desk.close()


def test_in_cruise_its_fields_are_the_vehicles_in_their_own_units() -> None:
    desk = Desk(Simulation(start="trim:20", wind=(3.0, -4.0, 0.0)))
    desk.advance(2.0)
    message, snapshot = requested(desk), desk.simulation.snapshot()
    north, east, _ = snapshot.velocity_ned
    assert message.timestamp == 2000
    assert (message.type, message.autopilot) == (mav.MAV_TYPE_VTOL_TILTWING, mav.MAV_AUTOPILOT_PX4)
    assert message.latitude == pytest.approx(math.degrees(snapshot.latitude) * 1e7, abs=1)
    assert message.altitude == round(snapshot.altitude_msl)
    assert message.heading == round(math.degrees(snapshot.yaw) / 2.0) % 180
    assert message.groundspeed == pytest.approx(5.0 * math.hypot(north, east), abs=1.0)
    assert message.airspeed == pytest.approx(5.0 * 20.0, abs=5.0)
    assert message.windspeed == pytest.approx(25, abs=1)
    assert 2 * message.wind_heading == pytest.approx(math.degrees(math.atan2(-4.0, 3.0)) % 360.0, abs=1.5)
    assert message.temperature_air == pytest.approx(snapshot.temperature - 273.15, abs=0.5)
    assert message.battery == pytest.approx(100, abs=1)
    assert message.custom0 == pytest.approx(math.degrees(snapshot.tilt), abs=0.5)
    assert message.throttle > 0
    assert message.failure_flags == 0
    desk.close()


@pytest.mark.parametrize(("identity", "mode"), [("px4", 0x0304), ("ardupilot", 12), ("generic", 5)])
def test_the_mode_is_the_heartbeats_in_two_bytes(identity: str, mode: int) -> None:
    desk = Desk(identity=IDENTITIES[identity])
    desk.advance(1.1)
    heartbeat = desk.of("HEARTBEAT")[-1].custom_mode
    message = requested(desk)
    assert message.custom_mode == mode == (heartbeat >> 16 if identity == "px4" else heartbeat)
    desk.close()


def test_on_the_way_to_a_place_it_says_how_far_and_where_that_is() -> None:
    desk = Desk(Simulation(start="trim:20"))
    view = desk.simulation.flight.view
    desk.simulation.flight.go_to(view.north + 2000.0, view.east, view.down - 20.0)
    desk.advance(0.1)
    message, snapshot = requested(desk), desk.simulation.snapshot()
    assert message.target_altitude == pytest.approx(snapshot.altitude_msl + 20.0, abs=1.5)
    assert message.target_distance == pytest.approx(200, abs=15)  # decametres
    assert message.airspeed_sp == 5 * 20
    desk.close()


def test_the_climb_rate_is_the_fastest_since_the_last_message() -> None:
    desk = Desk(Simulation(start="trim:20"))
    view = desk.simulation.flight.view
    requested(desk)
    desk.simulation.flight.go_to(view.north + 500.0, view.east, view.down - 10.0)
    fastest = 0.0
    for _ in range(100):
        desk.advance(0.1)
        fastest = max(fastest, abs(desk.simulation.snapshot().velocity_ned[2]))
    assert fastest > 1.0
    assert requested(desk).climb_rate / 10.0 == pytest.approx(fastest, abs=0.1)
    assert requested(desk).climb_rate / 10.0 == pytest.approx(abs(desk.simulation.snapshot().velocity_ned[2]), abs=0.1)
    desk.close()


def test_what_has_failed_shows_in_its_flags() -> None:
    desk = Desk(Simulation(start="trim:20"))
    desk.simulation.fail_servo("tilt")
    desk.simulation.flight.transition(False)
    desk.until(lambda: requested(desk).failure_flags & mav.HL_FAILURE_FLAG_ENGINE)
    desk.close()


def test_it_can_be_streamed_on_an_ordinary_link(desk: Desk) -> None:
    desk.command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, mav.MAVLINK_MSG_ID_HIGH_LATENCY2, 500_000)
    desk.advance(0.1)  # the first one comes at once
    desk.received.clear()
    desk.advance(3.0)
    assert len(desk.of("HIGH_LATENCY2")) == 6
