"""Events reach every ground station, once each, and say what its metadata lets it read."""

import math
from collections.abc import Callable
from typing import Any

import pytest

from sitl.flight.mission_items import Command, MissionItem
from sitl.flight.mode import Mode
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.event_definitions import event_metadata
from sitl.mavlink.events import KEPT, EventsService
from sitl.mavlink.identity import IDENTITIES, PX4
from tests.sitl.mavlink.event_reader import EventReader, ReadEvent
from tests.sitl.mavlink.in_memory import Desk, Station

RESET = mav.MAV_EVENT_CURRENT_SEQUENCE_FLAGS_RESET


@pytest.fixture
def reader() -> EventReader:
    import json

    return EventReader(json.dumps(event_metadata(1, PX4)).encode())


@pytest.fixture
def told(desk: Desk, reader: EventReader) -> Callable[[], list[ReadEvent]]:
    """Events for people that have come since it was asked last."""
    seen = 0

    def new() -> list[ReadEvent]:
        nonlocal seen
        events = [reader.read(message) for message in desk.of("EVENT")]
        fresh, seen = events[seen:], len(events)
        return [event for event in fresh if event.group == "default"]

    return new


def names(events: list[ReadEvent]) -> list[str]:
    return [event.name for event in events]


def texts(events: list[ReadEvent]) -> list[str]:
    return [event.text for event in events]


def service(desk: Desk) -> EventsService:
    return next(one for one in desk.face.services if isinstance(one, EventsService))


def request(station: Station, first: int, last: int) -> tuple[list[Any], list[Any]]:
    station.received.clear()
    station.send("REQUEST_EVENT", first_sequence=first, last_sequence=last)
    return station.of("EVENT"), station.of("RESPONSE_EVENT_ERROR")


# -- what happens ------------------------------------------------------------------------------------------------------


def test_a_flight_is_told_from_arming_to_landing(desk: Desk, told: Callable[[], list[ReadEvent]]) -> None:
    flight = desk.simulation.flight
    desk.advance(1.0)
    told()
    flight.takeoff(10.0)
    flight.arm()
    desk.until(lambda: flight.mode == Mode.HOLD)
    flight.land()
    desk.until(lambda: not flight.armed)
    desk.advance(0.1)
    assert texts(told()) == [
        "Armed", "Flight mode: Takeoff", "Take-off detected", "Flight mode: Hold", "Flight mode: Land",
        "Landing detected", "Disarmed: landed", "Flight mode: Hold",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("act", "text"),
    [
        (lambda flight: flight.disarm(), "Disarmed: by command"),
        (lambda _: None, "Disarmed: not taken off"),
    ],
)
def test_disarming_tells_why(
    desk: Desk, told: Callable[[], list[ReadEvent]], act: Callable[[Any], object], text: str
) -> None:
    flight = desk.simulation.flight
    flight.arm()
    desk.advance(0.5)
    act(flight)
    desk.until(lambda: not flight.armed)
    desk.advance(0.1)
    assert text in texts(told())


def test_disarming_in_flight_and_termination_are_told(desk: Desk, told: Callable[[], list[ReadEvent]]) -> None:
    flight = desk.simulation.flight
    flight.takeoff(10.0)
    flight.arm()
    desk.until(lambda: flight.height > 5.0)
    flight.terminate()
    desk.advance(0.1)
    flight.disarm(force=True)
    desk.advance(0.1)
    events = texts(told())
    assert "Flight terminated" in events
    assert "Disarmed: by force" in events


def test_arming_by_force_and_denied_arming_are_told_with_the_reasons(
    desk: Desk, reader: EventReader, told: Callable[[], list[ReadEvent]]
) -> None:
    desk.simulation.fail_servo("tilt")
    flight = desk.simulation.flight
    flight.actuators.faults = ("left motor failed", "tilt servo stuck at 83 deg")
    desk.advance(0.1)
    assert [event.text for event in told() if event.name == "actuator_failed"] == [
        "Left motor failed",
        "Tilt servo failed",
    ]
    desk.received.clear()
    assert desk.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1).result == mav.MAV_RESULT_TEMPORARILY_REJECTED
    desk.advance(0.1)
    events = [reader.read(message) for message in desk.of("EVENT")]
    assert names(events)[0] == "arming_check_summary"
    assert {"Left motor failed", "Tilt servo stuck at 83 deg"} <= set(texts(events))
    assert names(events)[-2:] == ["health_summary", "arming_denied"]
    (number,) = events[-1].values
    assert number == 4 << 16 | 3 << 24  # Hold, as PX4 numbers it
    desk.received.clear()
    flight.arm(force=True)
    desk.advance(0.1)
    assert "armed_by_force" in [reader.read(message).name for message in desk.of("EVENT")]


def test_failsafes_are_told_when_they_begin_act_and_end(desk: Desk, told: Callable[[], list[ReadEvent]]) -> None:
    flight = desk.simulation.flight
    flight.parameters.load({"NAV_DLL_ACT": 2, "COM_DL_LOSS_T": 1.0, "COM_FAIL_ACT_T": 0.5})
    flight.takeoff(10.0)
    flight.arm()
    desk.until(lambda: flight.mode == Mode.HOLD)
    told()
    desk.simulation.set_link("ground_station", up=True)
    desk.advance(1.0)
    desk.simulation.set_link("ground_station", up=False)
    desk.advance(3.0)
    desk.simulation.set_link("ground_station", up=True)
    desk.advance(1.0)
    events = [event for event in told() if event.name.startswith("failsafe")]
    assert texts(events) == [
        "Ground station lost", "Failsafe: Hold (Ground station lost)", "Failsafe: Return (Ground station lost)",
        "Ground station is back",
    ]  # fmt: skip


@pytest.mark.parametrize(("identity", "first"), [("px4", 0), ("ardupilot", 1)])
def test_a_mission_is_told_item_by_item_with_the_stations_numbers(
    identity: str, first: int, reader: EventReader
) -> None:
    desk = Desk(identity=IDENTITIES[identity])
    flight = desk.simulation.flight
    latitude, longitude, _ = flight.home.geodetic
    flight.load_mission([
        MissionItem(Command.TAKEOFF, x=latitude, y=longitude, z=10.0),
        MissionItem(Command.WAYPOINT, x=latitude + 1e-4, y=longitude, z=10.0, autocontinue=False),
        MissionItem(Command.WAYPOINT, x=latitude + 2e-4, y=longitude, z=10.0),
    ])  # fmt: skip
    flight.start_mission()
    flight.arm()
    desk.until(lambda: flight.mission.paused)
    desk.advance(0.1)
    flight.resume()
    desk.until(lambda: flight.mission.finished)
    desk.advance(0.1)
    events = [reader.read(message) for message in desk.of("EVENT")]
    told = [event for event in events if event.name.startswith("mission")]
    assert texts(told) == [
        f"Mission item {first} reached", f"Mission item {first + 1} reached",
        f"Mission paused after item {first + 1}", f"Mission item {first + 2} reached", "Mission finished",
    ]  # fmt: skip
    assert {event.values[1] for event in told if event.name == "mission_item_reached"} == {3 + first}
    desk.close()


def test_a_transition_home_and_an_outside_controller_are_told(desk: Desk, told: Callable[[], list[ReadEvent]]) -> None:
    desk.simulation.restart(start="trim:25")
    desk.face.restarted()
    flight = desk.simulation.flight
    desk.advance(0.1)
    flight.transition(False)
    desk.advance(0.2)
    flight.set_home(47.0, 8.0, 500.0)
    desk.advance(0.1)
    desk.simulation.set_controls(desk.simulation.controls)
    desk.advance(0.1)
    desk.simulation.take_over()
    desk.advance(0.1)
    events = told()
    expected = ["Transition to hover", "Home set", "Servos taken by an outside controller", "The autopilot flies on"]
    assert [text for text in texts(events) if text in expected] == expected
    (home,) = (event for event in events if event.name == "home_set")
    assert home.values[0] == pytest.approx(47.0 * 1e7, abs=2)
    assert home.values[1] == pytest.approx(8.0 * 1e7, abs=2)
    assert home.values[2] == pytest.approx(500.0)


def test_nothing_is_told_while_nothing_happens(desk: Desk) -> None:
    desk.advance(2.0)
    desk.received.clear()
    desk.advance(10.0)
    assert desk.of("EVENT") == []


# -- health ------------------------------------------------------------------------------------------------------------


def test_checks_are_reported_on_request_between_their_two_summaries(desk: Desk, reader: EventReader) -> None:
    desk.advance(1.0)
    desk.received.clear()
    assert desk.command(mav.MAV_CMD_RUN_PREARM_CHECKS).result == mav.MAV_RESULT_ACCEPTED
    events = [reader.read(message) for message in desk.of("EVENT")]
    assert (events[0].name, events[-1].name) == ("arming_check_summary", "health_summary")
    assert {event.group for event in events[1:-1]} <= {"arming_check", "health"}
    _, error, warning, can_arm, can_run = events[0].values
    assert (error, warning) == (0, 0)
    assert can_arm >> Mode.HOLD & can_run >> Mode.HOLD & 1
    assert not can_arm >> Mode.MISSION & 1
    levels = [message.log_levels for message in desk.of("EVENT")]
    assert levels[0] == levels[-1] == 0x88


def test_a_report_comes_by_itself_when_health_has_changed(desk: Desk, reader: EventReader) -> None:
    desk.advance(2.0)
    desk.received.clear()
    desk.simulation.flight.actuators.faults = ("tail motor failed",)
    desk.advance(1.1)
    assert "Tail motor failed" in [reader.read(message).text for message in desk.of("EVENT")]


def test_every_mode_of_every_identity_belongs_to_a_group_of_checks() -> None:
    for identity in IDENTITIES.values():
        groups = event_metadata(1, identity)["components"]["1"]["navigation_mode_groups"]["groups"]
        numbers = [number for group in groups.values() for number in group]
        assert sorted(numbers) == sorted({entry.number for entry in identity.modes})
        for mode, group in groups.items():
            for number in group:
                entry = identity.entry(number)
                assert entry is not None
                assert entry.modes[0] == int(mode)


# -- the protocol ------------------------------------------------------------------------------------------------------


def test_numbers_rise_by_one_and_times_are_the_vehicles(desk: Desk) -> None:
    flight = desk.simulation.flight
    desk.advance(1.0)
    flight.takeoff(5.0)
    flight.arm()
    desk.until(lambda: flight.mode == Mode.HOLD)
    events = desk.of("EVENT")
    sequences = [event.sequence for event in events]
    assert sequences == list(range(sequences[0], sequences[0] + len(events)))
    assert all(event.event_time_boot_ms <= desk.simulation.time * 1e3 for event in events)
    assert {(event.destination_system, event.destination_component) for event in events} == {(0, 0)}


def test_the_latest_number_is_told_now_and_then_and_on_request(desk: Desk) -> None:
    desk.advance(10.0)
    assert 2 <= len(desk.of("CURRENT_EVENT_SEQUENCE")) <= 4
    latest = desk.of("EVENT")[-1].sequence
    assert desk.of("CURRENT_EVENT_SEQUENCE")[-1].sequence == latest
    ack = desk.command(mav.MAV_CMD_REQUEST_MESSAGE, mav.MAVLINK_MSG_ID_CURRENT_EVENT_SEQUENCE)
    assert ack.result == mav.MAV_RESULT_ACCEPTED
    assert desk.of("CURRENT_EVENT_SEQUENCE")[-1].sequence == latest


def test_that_numbers_have_begun_anew_is_told_at_first_only(desk: Desk) -> None:
    def flags() -> int:
        desk.command(mav.MAV_CMD_REQUEST_MESSAGE, mav.MAVLINK_MSG_ID_CURRENT_EVENT_SEQUENCE)
        return desk.of("CURRENT_EVENT_SEQUENCE")[-1].flags

    assert flags() == RESET
    desk.wait(11.0)
    assert flags() == 0


def test_who_has_missed_events_gets_them_again_and_nobody_else_does(desk: Desk) -> None:
    desk.advance(1.0)
    sent = {event.sequence: event for event in desk.of("EVENT")}
    other = desk.join(system=7)
    first, last = min(sent), max(sent)
    events, wrong = request(other, first, last)
    assert wrong == []
    assert [event.to_dict() for event in events] == [sent[number].to_dict() for number in range(first, last + 1)]
    assert len(desk.of("EVENT")) == len(sent)
    events, _ = request(other, last, last)
    assert [event.sequence for event in events] == [last]


def test_an_event_that_is_not_kept_is_answered_with_the_oldest_that_is(desk: Desk) -> None:
    started, _ = request(desk.station, 1, 1)
    assert len(started) == 1
    for _ in range(KEPT + 5):
        service(desk).report()
    latest = desk.of("EVENT")[-1].sequence
    events, wrong = request(desk.station, 1, 3)
    assert events == []
    assert [(error.sequence, error.reason) for error in wrong] == [(number, 0) for number in (1, 2, 3)]
    oldest = wrong[0].sequence_oldest_available
    assert oldest == latest - KEPT + 1
    events, wrong = request(desk.station, oldest, latest)
    assert [event.sequence for event in events] == list(range(oldest, latest + 1))
    assert wrong == []
    events, wrong = request(desk.station, latest + 1, latest + 1)
    assert (events, [error.sequence for error in wrong]) == ([], [latest + 1])


def test_numbers_pass_from_the_largest_to_zero(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sitl.mavlink.events.BEFORE_FIRST", 65533)
    desk = Desk()
    desk.advance(2.0)
    events, wrong = request(desk.station, 65534, 1)
    assert [event.sequence for event in events] == [65534, 65535, 0, 1]
    assert wrong == []
    desk.close()


def test_a_request_for_all_numbers_there_are_gets_what_is_kept_and_few_errors(desk: Desk) -> None:
    events, wrong = request(desk.station, 5, 4)
    assert 0 < len(events) <= KEPT
    assert len(wrong) <= 32


def test_a_vehicle_that_begins_anew_goes_on_counting(desk: Desk, reader: EventReader) -> None:
    desk.advance(1.0)
    latest = desk.of("EVENT")[-1].sequence
    desk.face.request_restart()
    desk.turn()
    desk.advance(0.1)
    events = [event for event in desk.of("EVENT") if event.sequence > latest]
    assert reader.read(events[0]).name == "vehicle_started"
    assert events[0].sequence == latest + 1
    desk.simulation.flight.arm()
    desk.advance(0.1)
    assert reader.read(desk.of("EVENT")[-1]).name in {"armed", "health_summary"}


def test_a_vehicle_without_autopilot_has_no_events_but_its_start() -> None:
    from sitl.simulation import Simulation

    desk = Desk(Simulation(autopilot=False))
    desk.advance(2.0)
    assert desk.of("EVENT") == []
    assert desk.face.internal_errors == 0
    desk.close()


def test_no_numbers_make_it_stumble(desk: Desk) -> None:
    for first in (0, 1, 255, 65535):
        for last in (0, 1, 255, 65535):
            desk.send("REQUEST_EVENT", first_sequence=first, last_sequence=last)
    desk.command(mav.MAV_CMD_RUN_PREARM_CHECKS, math.nan)
    assert desk.face.internal_errors == 0
