"""Failsafes: each cause, the actions set for it, delay and return of links, who wins, and the pilot's last word."""

import math
from typing import Any

import pytest

from sitl.flight.failsafe import NOTHING, Action, Cause, Failsafes, Links, Reaction
from sitl.flight.mode import Mode
from sitl.flight.parameters import Parameters
from sitl.flight.view import View

PERIOD = 0.1
SILENT = 1000.0  # [s]


class Vehicle:
    """In flight, doing what the failsafes say as the flight does."""

    def __init__(self, mode: Mode = Mode.MISSION, **parameters: float) -> None:
        self.messages: list[tuple[int, str]] = []
        self.failsafes = Failsafes(
            Parameters(parameters), lambda severity, text: self.messages.append((severity, text))
        )
        self.view = View()
        self.links = Links(ground_station=0.0)
        self.mode = mode
        self.armed = True
        self.on_ground = False
        self.breach: str | None = None
        self.faults: tuple[str, ...] = ()
        self.reactions: list[tuple[float, Reaction]] = []

    def fly(self, seconds: float = PERIOD) -> list[Action]:
        """Actions raised meanwhile."""
        raised: list[Action] = []
        for _ in range(round(seconds / PERIOD)):
            self.view.time += PERIOD
            reaction = self.failsafes.update(
                self.view, self.links, mode=self.mode, armed=self.armed, on_ground=self.on_ground,
                breach=self.breach, faults=self.faults,
            )  # fmt: skip
            if reaction is NOTHING:
                continue
            self.reactions.append((self.view.time, reaction))
            raised.append(reaction.action)
            self.mode = self.mode if reaction.mode is None else reaction.mode
            self.armed = self.armed and reaction.action != Action.DISARM
        return raised

    @property
    def texts(self) -> list[str]:
        return [text for _, text in self.messages]


def test_nothing_wrong_nothing_done() -> None:
    vehicle = Vehicle()
    assert vehicle.fly(10.0) == []
    assert vehicle.messages == []
    assert vehicle.failsafes.causes == ()


def test_ends_never_heard_of_cannot_be_lost() -> None:
    vehicle = Vehicle(NAV_DLL_ACT=2)
    vehicle.links = Links()
    assert vehicle.fly(10.0) == []


@pytest.mark.parametrize(
    ("choice", "action", "mode"),
    [
        (1, Action.HOLD, Mode.HOLD),
        (2, Action.RETURN, Mode.RETURN),
        (3, Action.LAND, Mode.LAND),
        (5, Action.TERMINATE, Mode.TERMINATION),
        (6, Action.DISARM, Mode.MISSION),
    ],
)
def test_loss_of_the_ground_station_does_what_is_set(choice: int, action: Action, mode: Mode) -> None:
    vehicle = Vehicle(NAV_DLL_ACT=choice, COM_FAIL_ACT_T=0.0)
    vehicle.links.ground_station = 9.9
    assert vehicle.fly() == []
    vehicle.links.ground_station = 10.1
    assert vehicle.fly(3.0) == [action]
    assert vehicle.mode == mode
    assert vehicle.armed == (action != Action.DISARM)


def test_loss_of_the_ground_station_is_told_even_where_it_does_nothing() -> None:
    vehicle = Vehicle(NAV_DLL_ACT=0)
    vehicle.links.ground_station = SILENT
    assert vehicle.fly(20.0) == []
    vehicle.links.ground_station = 0.0
    vehicle.fly()
    assert vehicle.messages == [(4, "Ground station lost"), (6, "Ground station is back")]


@pytest.mark.parametrize(("choice", "action"), [(1, Action.HOLD), (2, Action.RETURN), (3, Action.LAND)])
def test_loss_of_manual_control_does_what_is_set(choice: int, action: Action) -> None:
    vehicle = Vehicle(Mode.POSITION, NAV_RCL_ACT=choice, COM_FAIL_ACT_T=0.0)
    vehicle.links.manual_control = 0.4
    assert vehicle.fly() == []
    vehicle.links.manual_control = 0.6
    assert vehicle.fly(3.0) == [action]


@pytest.mark.parametrize(
    ("mode", "excepted", "acts"),
    [
        (Mode.MISSION, 0, True),
        (Mode.MISSION, 1, False),
        (Mode.HOLD, 1, True),
        (Mode.HOLD, 2, False),
        (Mode.ORBIT, 2, False),
        (Mode.POSITION, 7, True),
    ],
)
def test_modes_may_be_excepted_from_needing_manual_control(mode: Mode, excepted: int, acts: bool) -> None:
    vehicle = Vehicle(mode, COM_RCL_EXCEPT=excepted, COM_FAIL_ACT_T=0.0)
    vehicle.links.manual_control = SILENT
    assert vehicle.fly(2.0) == ([Action.RETURN] if acts else [])


def test_an_exception_does_not_end_the_loss_that_led_to_the_excepted_mode() -> None:
    vehicle = Vehicle(Mode.POSITION, NAV_RCL_ACT=3, COM_RCL_EXCEPT=7)
    vehicle.links.manual_control = SILENT
    assert vehicle.fly(10.0) == [Action.HOLD, Action.LAND]


@pytest.mark.parametrize(
    ("choice", "with_pilot", "without"),
    [
        (0, Action.POSITION, Action.HOLD),
        (1, Action.ALTITUDE, Action.HOLD),
        (2, Action.STABILIZED, Action.HOLD),
        (3, Action.RETURN, Action.RETURN),
        (4, Action.LAND, Action.LAND),
        (5, Action.HOLD, Action.HOLD),
        (6, Action.TERMINATE, Action.TERMINATE),
    ],
)
def test_loss_of_offboard_control_hands_over_as_set(choice: int, with_pilot: Action, without: Action) -> None:
    for manual, action in ((0.0, with_pilot), (None, without), (SILENT, without)):
        vehicle = Vehicle(Mode.OFFBOARD, COM_OBL_RC_ACT=choice, COM_FAIL_ACT_T=0.0, COM_RCL_EXCEPT=7)
        vehicle.links = Links(manual_control=manual, offboard=0.9)
        assert vehicle.fly() == []
        vehicle.links.offboard = 1.1
        assert vehicle.fly(3.0) == [action]
        assert vehicle.failsafes.action == action


def test_offboard_setpoints_matter_in_offboard_only() -> None:
    vehicle = Vehicle(Mode.MISSION)
    vehicle.links.offboard = SILENT
    assert vehicle.fly(3.0) == []


def test_links_are_not_judged_where_time_runs_as_fast_as_it_can() -> None:
    vehicle = Vehicle(Mode.OFFBOARD, NAV_DLL_ACT=2)
    vehicle.links = Links(ground_station=SILENT, manual_control=SILENT, offboard=SILENT, enforced=False)
    assert vehicle.fly(10.0) == []
    vehicle.links.enforced = True
    assert vehicle.fly() != []


def test_the_pilot_has_time_before_a_lost_link_leads_home() -> None:
    vehicle = Vehicle(NAV_DLL_ACT=2, COM_FAIL_ACT_T=5.0)
    vehicle.links.ground_station = SILENT
    vehicle.fly(8.0)
    (first, hold), (second, leave) = vehicle.reactions
    assert (hold.action, hold.mode) == (Action.HOLD, Mode.HOLD)
    assert (leave.action, leave.mode, leave.cause) == (Action.RETURN, Mode.RETURN, Cause.GROUND_STATION)
    assert second - first == pytest.approx(5.0, abs=1.5 * PERIOD)
    assert vehicle.texts == [
        "Ground station lost",
        "Ground station lost: Hold, Return in 5 s",
        "Ground station lost: Return",
    ]


@pytest.mark.parametrize(("mode", "link"), [(Mode.MISSION, "ground_station"), (Mode.OFFBOARD, "offboard")])
def test_a_link_that_comes_back_in_time_lets_the_flight_go_on(mode: Mode, link: str) -> None:
    vehicle = Vehicle(mode, NAV_DLL_ACT=2, COM_OBL_RC_ACT=4)
    vehicle.links.offboard = 0.0
    setattr(vehicle.links, link, SILENT)
    assert vehicle.fly(2.0) == [Action.HOLD]
    setattr(vehicle.links, link, 0.0)
    assert vehicle.fly(10.0) == [Action.NONE]
    assert vehicle.mode == mode
    assert vehicle.failsafes.causes == ()


def test_a_link_that_comes_back_late_does_not_turn_the_flight_round_again() -> None:
    vehicle = Vehicle(NAV_DLL_ACT=2)
    vehicle.links.ground_station = SILENT
    vehicle.fly(8.0)
    vehicle.links.ground_station = 0.0
    assert vehicle.fly(5.0) == []
    assert vehicle.mode == Mode.RETURN
    vehicle.mode = Mode.MISSION
    vehicle.failsafes.pilot_took_over()
    vehicle.links.ground_station = SILENT
    assert vehicle.fly(8.0) == [Action.HOLD, Action.RETURN], "a new loss is a new case"


def test_the_pilot_overrides_what_is_wrong_now_but_not_what_comes() -> None:
    vehicle = Vehicle(NAV_DLL_ACT=2)
    vehicle.links.ground_station = SILENT
    vehicle.fly(1.0)
    vehicle.mode = Mode.POSITION
    vehicle.failsafes.pilot_took_over()
    assert vehicle.fly(20.0) == []
    assert vehicle.failsafes.action == Action.NONE
    assert vehicle.failsafes.causes == (Cause.GROUND_STATION,)
    vehicle.view.battery_remaining = 0.05
    assert vehicle.fly(1.0) == [Action.LAND]


def test_an_empty_battery_acts_level_by_level() -> None:
    vehicle = Vehicle(COM_LOW_BAT_ACT=3, COM_FAIL_ACT_T=2.0)
    for remaining, actions, mode in (
        (0.21, [], Mode.MISSION),
        (0.19, [], Mode.MISSION),
        (0.119, [Action.HOLD, Action.RETURN], Mode.RETURN),
        (0.069, [Action.LAND], Mode.LAND),
        (0.0, [], Mode.LAND),
    ):
        vehicle.view.battery_remaining = remaining
        assert vehicle.fly(10.0) == actions
        assert vehicle.mode == mode
    warnings = [text for severity, text in vehicle.messages if severity == 4]
    assert warnings == ["Battery low", "Battery critical", "Battery nearly empty"]


@pytest.mark.parametrize(("choice", "critical"), [(0, []), (2, [Action.LAND])])
def test_a_critical_battery_does_what_is_set(choice: int, critical: list[Action]) -> None:
    vehicle = Vehicle(COM_LOW_BAT_ACT=choice, COM_FAIL_ACT_T=0.0)
    vehicle.view.battery_remaining = 0.1
    assert vehicle.fly(3.0) == critical
    vehicle.view.battery_remaining = 0.01
    assert vehicle.fly(3.0) == []


def test_a_charge_that_swings_about_a_limit_is_told_once() -> None:
    vehicle = Vehicle()
    for i in range(20):
        vehicle.view.battery_remaining = 0.2 + (0.001 if i % 2 else -0.001)
        vehicle.fly()
    assert vehicle.texts == ["Battery low"]


@pytest.mark.parametrize(
    ("choice", "actions"),
    [
        (0, []),
        (1, []),
        (2, [Action.HOLD]),
        (3, [Action.RETURN]),
        (4, [Action.TERMINATE]),
        (5, [Action.LAND]),
    ],
)
def test_leaving_the_fence_does_at_once_what_is_set(choice: int, actions: list[Action]) -> None:
    vehicle = Vehicle(GF_ACTION=choice)
    vehicle.breach = "outside the fence"
    assert vehicle.fly(10.0) == actions
    assert bool(vehicle.messages) == (choice > 0)


def test_a_fence_left_again_acts_again_while_its_text_changing_does_not() -> None:
    vehicle = Vehicle(GF_ACTION=2)
    for distance in range(10):
        vehicle.breach = f"{distance} m outside the fence"
        vehicle.fly()
    assert [reaction.action for _, reaction in vehicle.reactions] == [Action.HOLD]
    vehicle.breach = None
    vehicle.fly()
    vehicle.mode = Mode.MISSION
    vehicle.failsafes.pilot_took_over()
    vehicle.breach = "1 m outside the fence"
    assert vehicle.fly(2.0) == [Action.HOLD]


@pytest.mark.parametrize(
    ("breaker", "action"), [(121212, Action.LAND), (0, Action.TERMINATE)]
)  # fmt: skip
def test_a_lost_attitude_terminates_only_if_the_circuit_breaker_allows(breaker: int, action: Action) -> None:
    for angle in ("roll", "pitch"):
        vehicle = Vehicle(CBRK_FLIGHTTERM=breaker)
        setattr(vehicle.view, angle, math.radians(-80.0))
        assert vehicle.fly(0.3) == [], "shorter than the trigger time"
        assert vehicle.fly(1.0) == [action]


def test_large_angles_are_left_to_the_pilot_in_manual_and_to_nobody_if_switched_off() -> None:
    manual = Vehicle(Mode.MANUAL)
    off = Vehicle(FD_FAIL_R=0.0)
    for vehicle in (manual, off):
        vehicle.view.roll = math.pi
        assert vehicle.fly(5.0) == []


@pytest.mark.parametrize(
    ("choice", "actions"),
    [(0, []), (1, [Action.HOLD]), (2, [Action.LAND]), (3, [Action.RETURN]), (4, [Action.TERMINATE])],
)
def test_a_failed_actuator_does_at_once_what_is_set(choice: int, actions: list[Action]) -> None:
    vehicle = Vehicle(COM_ACT_FAIL_ACT=choice)
    vehicle.faults = ("left motor failed",)
    assert vehicle.fly(10.0) == actions
    assert vehicle.texts[0] == "Left motor failed"


def test_a_second_failure_is_another_case() -> None:
    vehicle = Vehicle(COM_ACT_FAIL_ACT=2)
    vehicle.faults = ("left motor failed",)
    vehicle.fly(1.0)
    vehicle.failsafes.pilot_took_over()
    vehicle.mode = Mode.POSITION
    assert vehicle.fly(5.0) == []
    vehicle.faults += ("tilt servo stuck at 45 deg",)
    assert vehicle.fly(1.0) == [Action.LAND]
    assert "Tilt servo stuck at 45 deg" in vehicle.texts


def test_the_gravest_of_several_wins_at_once() -> None:
    vehicle = Vehicle(NAV_DLL_ACT=2, GF_ACTION=2)
    vehicle.links.ground_station = SILENT
    vehicle.breach = "outside the fence"
    vehicle.view.battery_remaining = 0.01
    assert vehicle.fly(20.0) == [Action.LAND]
    assert vehicle.failsafes.action == Action.LAND


def test_what_the_vehicle_does_already_is_not_begun_again() -> None:
    for mode in (Mode.RETURN, Mode.LAND):
        vehicle = Vehicle(mode, NAV_DLL_ACT=2)
        vehicle.links.ground_station = SILENT
        vehicle.breach = "outside the fence"
        assert vehicle.fly(20.0) == []
        assert vehicle.mode == mode


def test_on_the_ground_and_disarmed_there_are_warnings_only() -> None:
    for armed, on_ground in ((True, True), (False, False), (False, True)):
        vehicle = Vehicle(NAV_DLL_ACT=2)
        vehicle.armed, vehicle.on_ground = armed, on_ground
        vehicle.links.ground_station = SILENT
        vehicle.view.battery_remaining = 0.01
        vehicle.view.roll = 3.0
        assert vehicle.fly(20.0) == []
        assert "Ground station lost" in vehicle.texts
        assert Cause.ATTITUDE not in vehicle.failsafes.causes


def test_what_was_wrong_on_the_ground_acts_after_take_off() -> None:
    vehicle = Vehicle(Mode.TAKEOFF, NAV_DLL_ACT=2)
    vehicle.on_ground = True
    vehicle.links.ground_station = SILENT
    vehicle.fly(60.0)
    vehicle.on_ground = False
    assert vehicle.fly() == [Action.HOLD], "the pilot's time begins with the flight"
    assert vehicle.fly(4.0) == []
    assert vehicle.fly(2.0) == [Action.RETURN]


def test_a_flight_ended_leaves_no_alarm_of_its_own() -> None:
    vehicle = Vehicle(Mode.OFFBOARD, COM_OBL_RC_ACT=4)
    vehicle.breach = "outside the fence"
    vehicle.links.offboard = SILENT
    vehicle.fly(10.0)
    assert set(vehicle.failsafes.causes) == {Cause.FENCE, Cause.OFFBOARD}
    vehicle.on_ground, vehicle.armed = True, False
    vehicle.fly()
    assert vehicle.failsafes.causes == ()


@pytest.mark.parametrize("count", [60])
def test_steadily_bad_news_is_told_once(count: int) -> None:
    vehicle = Vehicle(NAV_DLL_ACT=1)
    vehicle.links.ground_station = SILENT
    for _ in range(count):
        vehicle.fly(1.0)
    assert len(vehicle.messages) == 2


def test_same_history_same_reactions() -> None:
    def history() -> tuple[list[Any], list[Any]]:
        vehicle = Vehicle(NAV_DLL_ACT=2, GF_ACTION=3)
        for i in range(200):
            vehicle.links.ground_station = SILENT if 20 < i < 60 else 0.0
            vehicle.breach = "out" if 90 < i < 95 else None
            vehicle.view.battery_remaining = 1.0 - i / 200.0
            vehicle.fly()
        return vehicle.reactions, vehicle.messages

    assert history() == history()
