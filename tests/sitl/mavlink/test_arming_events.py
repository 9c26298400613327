"""Every reason not to arm that the flight can give is an event of its own with the same numbers in it."""

import json
import math
import re
from collections.abc import Callable
from typing import Any

import pytest

from sitl.flight.flight import Flight
from sitl.flight.geofence import FenceCircle
from sitl.flight.landed import LandedState
from sitl.flight.manual_input import ManualInput
from sitl.flight.mission_items import Command, MissionItem
from sitl.flight.mode import Mode
from sitl.mavlink.arming_events import Judge
from sitl.mavlink.event_definitions import Component, event_metadata
from sitl.mavlink.identity import PX4
from tests.sitl.mavlink.event_reader import EventReader, ReadEvent
from tests.sitl.mavlink.in_memory import Desk

READER = EventReader(json.dumps(event_metadata(1, PX4)).encode())


class _Message:
    """What EventReader looks at in an EVENT."""

    def __init__(self, event: Any, values: tuple[float, ...]) -> None:
        self.id = event.id(1)
        self.arguments = event.packed(*values).ljust(40, b"\0")


def read(flight: Flight) -> list[ReadEvent]:
    return [READER.read(_Message(event, values)) for event, values in Judge().report(flight).events]


def numbers(text: str) -> list[float]:
    return [float(number) for number in re.findall(r"-?\d+(?:\.\d+)?", text)]


def seen(**values: float) -> Callable[[Flight], None]:
    def see(flight: Flight) -> None:
        for name, value in values.items():
            setattr(flight.view, name, value)

    return see


def let(**values: Any) -> Callable[[Flight], None]:
    def change(flight: Flight) -> None:
        for name, value in values.items():
            setattr(flight, name, value)

    return change


def with_faults(*faults: str) -> Callable[[Flight], None]:
    def fail(flight: Flight) -> None:
        flight.actuators.faults = faults

    return fail


def with_parameters(**values: float) -> Callable[[Flight], None]:
    return lambda flight: flight.parameters.load(values)


def with_mission_outside_the_fence(flight: Flight) -> None:
    latitude, longitude, _ = flight.home.geodetic
    flight.load_mission(
        [
            MissionItem(Command.TAKEOFF, x=latitude, y=longitude, z=10.0),
            MissionItem(Command.WAYPOINT, x=latitude + 0.01, y=longitude, z=10.0),
        ]
    )
    flight.fence.load((), (FenceCircle(latitude, longitude, 100.0, True),))


def with_throttle(mode: Mode, throttle: float) -> Callable[[Flight], None]:
    def hold(flight: Flight) -> None:
        flight.links.enforced = False
        flight.manual(ManualInput(throttle=throttle))
        flight.mode = mode

    return hold


@pytest.mark.parametrize(
    ("change", "name"),
    [
        (seen(north=math.nan), "check_unknown"),
        (let(landed=LandedState.IN_AIR), "check_on_ground"),
        (seen(roll=-0.5), "check_roll"),
        (seen(pitch=0.4), "check_pitch"),
        (seen(r=0.6), "check_turning"),
        (seen(vn=0.9), "check_moving"),
        (let(breach="outside"), "check_fence"),
        (with_faults("left motor failed"), "check_left_motor"),
        (with_faults("right motor failed"), "check_right_motor"),
        (with_faults("tail motor failed"), "check_tail_motor"),
        (with_faults("tilt servo stuck at 83 deg"), "check_tilt_servo"),
        (seen(tilt=0.5), "check_wing"),
        (seen(battery_remaining=0.1234), "check_battery_charge"),
        (seen(battery_voltage=20.0), "check_battery_voltage"),
        (with_parameters(FW_AIRSPD_MIN=22.0), "check_order_fw_airspd_min"),
        (with_parameters(BAT_CRIT_THR=0.3), "check_order_bat_emergen_thr"),
        (with_parameters(MPC_XY_CRUISE=9.0), "check_order_mpc_xy_cruise"),
        (let(mode=Mode.LAND), "check_mode"),
        (let(mode=Mode.MISSION), "check_no_mission"),
        (with_mission_outside_the_fence, "check_mission"),
        (let(mode=Mode.POSITION), "check_manual"),
        (with_throttle(Mode.STABILIZED, 0.5), "check_throttle_low"),
        (with_throttle(Mode.POSITION, 1.0), "check_throttle_climb"),
    ],
)
def test_each_reason_is_an_event_with_its_numbers(desk: Desk, change: Callable[[Flight], None], name: str) -> None:
    flight = desk.simulation.flight
    change(flight)
    mode = Mode.MISSION if name == "check_mission" else flight.mode
    (reason,) = flight.check_arming(mode)
    events = {event.name: event for event in read(flight)}
    assert "check_other" not in events
    event = events[name]
    if event.values[2:]:
        assert list(event.values[2:]) == pytest.approx(numbers(reason))
        assert numbers(event.text) == pytest.approx(numbers(reason), abs=0.051)
    assert event.values[0] >> mode & 1


def test_a_healthy_vehicle_may_be_armed_to_begin_a_flight_by_itself(desk: Desk) -> None:
    summary, *_, health = read(desk.simulation.flight)
    _, error, warning, can_arm, can_run = summary.values
    assert (error, warning) == (0, 0)
    assert [mode for mode in Mode if can_arm >> mode & 1] == [Mode.HOLD, Mode.TAKEOFF, Mode.OFFBOARD]
    assert not can_run >> Mode.LAND & 1
    assert health.values[1] >> Component.GPS & 1
    assert health.values[2:] == (0, 0)


def test_what_is_wrong_with_the_vehicle_keeps_every_mode_from_arming_and_names_the_part(desk: Desk) -> None:
    flight = desk.simulation.flight
    with_faults("left motor failed")(flight)
    summary, *checks, health = read(flight)
    assert summary.values[1] == health.values[2] == 1 << Component.MOTORS_ESCS
    assert summary.values[3] == 0
    (check,) = (check for check in checks if check.name == "check_left_motor")
    assert check.values[0] == sum(1 << mode for mode in Mode)
    assert check.values[1] == Component.MOTORS_ESCS


def test_in_flight_how_it_would_stand_does_not_matter(desk: Desk) -> None:
    flight = desk.simulation.flight
    flight.takeoff(10.0)
    flight.arm()
    desk.until(lambda: flight.height > 5.0)
    names = [event.name for event in read(flight)]
    assert not {"check_on_ground", "check_moving", "check_mode"} & set(names)
    assert read(flight)[0].values[4] >> Mode.LAND & 1


def test_a_report_is_another_only_if_what_it_says_is(desk: Desk) -> None:
    flight = desk.simulation.flight
    judge = Judge()
    flight.view.roll = 0.5
    before = judge.report(flight).key
    flight.view.roll = 0.6
    assert judge.report(flight).key == before
    flight.view.roll = 0.0
    assert judge.report(flight).key != before


def test_a_mission_is_judged_again_once_it_or_the_fence_is_another(desk: Desk) -> None:
    flight = desk.simulation.flight
    judge = Judge()

    def can_arm() -> bool:
        return bool(int(judge.report(flight).events[0][1][3]) >> Mode.MISSION & 1)

    assert not can_arm()
    latitude, longitude, _ = flight.home.geodetic
    flight.load_mission([MissionItem(Command.TAKEOFF, x=latitude, y=longitude, z=10.0)])
    assert can_arm()
    flight.fence.load((), (FenceCircle(latitude + 0.01, longitude, 100.0, True),))
    assert not can_arm()
    flight.fence.load((), ())
    assert can_arm()


def test_a_reason_nobody_knew_of_is_still_told(desk: Desk) -> None:
    flight = desk.simulation.flight
    with_faults("paint scratched")(flight)
    assert "check_other" in [event.name for event in read(flight)]
