"""The bits by which ground stations judge whether the vehicle may fly, each switched by what it stands for."""

from collections.abc import Callable
from typing import Any

import pytest

from sitl.flight.geofence import FenceCircle
from sitl.flight.manual_input import ManualInput
from sitl.flight.mode import Mode
from sitl.mavlink.dialect import tiltwing as mav
from sitl.snapshot import Snapshot
from tests.sitl.mavlink.telemetry.observed import Observed

GPS, STICKS, PREARM = 0x20, 0x10000, 0x10000000  # as MAVSDK reads them
FENCE, BATTERY, PROPULSION = mav.MAV_SYS_STATUS_GEOFENCE, 0x2000000, 0x40000000
MOTOR_OUTPUTS, AHRS = 0x8000, 0x200000
LOOPS = 0x7C00  # rates, attitude, yaw, height, position

Moment = Callable[..., Snapshot]


@pytest.fixture
def observed() -> Observed:
    return Observed()


def bits(m: Any) -> tuple[int, ...]:
    """Present, enabled and healthy."""
    return tuple(getattr(m, f"onboard_control_sensors_{kind}") for kind in ("present", "enabled", "health"))


def test_sys_status(moment: Moment, observed: Observed) -> None:
    context = observed.context
    context.load, context.received, context.malformed = 0.125, 300, 100
    m = observed.sent("SYS_STATUS", moment(battery_voltage=48.5, battery_current=31.25, battery_remaining=0.62))
    for sensors in bits(m):
        assert sensors & 0x3F == 0x3F  # gyro, accelerometer, magnetometer, both pressures, GPS
        assert sensors & AHRS
        assert sensors & MOTOR_OUTPUTS
        assert sensors & BATTERY
        assert sensors & PROPULSION
        assert sensors & mav.MAV_SYS_STATUS_EXTENSION_USED
    assert (m.load, m.voltage_battery, m.current_battery, m.battery_remaining) == (125, 48500, 3125, 62)
    assert (m.drop_rate_comm, m.errors_comm) == (2500, 100)
    assert m.onboard_control_sensors_health_extended == 4 | 8  # third inertial unit, as SCALED_IMU3 has it
    assert observed.sent("SYS_STATUS", moment(battery_remaining=None)).battery_remaining == -1


def test_load_stops_at_a_whole_core(moment: Moment, observed: Observed) -> None:
    observed.context.load = 1.75
    assert observed.sent("SYS_STATUS", moment()).load == 1000


def test_link_errors_stop_at_the_most_their_field_holds(moment: Moment, observed: Observed) -> None:
    observed.context.malformed = 65536 + 7
    assert observed.sent("SYS_STATUS", moment()).errors_comm == 65535


def test_a_vehicle_ready_on_the_ground_is_armable_and_one_that_is_not_says_so(observed: Observed) -> None:
    observed.fly(1.0)
    present, enabled, healthy = bits(observed.sent("SYS_STATUS"))
    assert present & enabled & healthy & PREARM
    observed.flight.set_mode(Mode.ALTITUDE)  # which needs sticks
    observed.fly(1.0)
    present, enabled, healthy = bits(observed.sent("SYS_STATUS"))
    assert present & enabled & PREARM
    assert not healthy & PREARM
    observed.flight.set_mode(Mode.HOLD)
    observed.fly(1.0)
    observed.flight.arm()
    assert bits(observed.sent("SYS_STATUS"))[2] & PREARM


def test_arming_checks_are_not_made_for_every_message(observed: Observed, monkeypatch: pytest.MonkeyPatch) -> None:
    observed.fly(1.0)
    judged: list[float] = []
    check = observed.flight.check_arming
    monkeypatch.setattr(observed.flight, "check_arming", lambda: judged.append(observed.simulation.time) or check())
    for _ in range(50):
        observed.fly(0.02)
        observed.sent("SYS_STATUS")
    assert 1 <= len(judged) <= 3


def test_control_loops_are_in_use_as_the_mode_closes_them() -> None:
    observed = Observed(start="trim:20")
    assert bits(observed.sent("SYS_STATUS"))[1] & LOOPS == LOOPS
    for mode, loops in ((Mode.MANUAL, 0), (Mode.STABILIZED, 0xC00), (Mode.ALTITUDE, 0x3C00), (Mode.POSITION, 0x7C00)):
        observed.flight.manual(ManualInput())
        observed.fly(0.1)
        observed.flight.set_mode(mode)
        present, enabled, healthy = bits(observed.sent("SYS_STATUS"))
        assert enabled & LOOPS == loops, mode
        assert present & healthy & LOOPS == LOOPS
    grounded = Observed()
    assert not bits(grounded.sent("SYS_STATUS"))[1] & LOOPS


def test_sticks_are_there_once_heard_and_ill_when_lost(observed: Observed) -> None:
    assert not bits(observed.sent("SYS_STATUS"))[0] & STICKS
    observed.flight.manual(ManualInput())
    observed.fly(0.1)
    present, enabled, healthy = bits(observed.sent("SYS_STATUS"))
    assert present & enabled & healthy & STICKS
    observed.fly(observed.flight.parameters["COM_RC_LOSS_T"] + 0.1)
    present, enabled, healthy = bits(observed.sent("SYS_STATUS"))
    assert present & enabled & STICKS
    assert not healthy & STICKS


def test_the_fence_is_there_once_loaded_and_ill_when_left() -> None:
    observed = Observed(start="trim:20")
    present, _, healthy = bits(observed.sent("SYS_STATUS"))
    assert not present & FENCE
    assert healthy & FENCE  # for MAVProxy says "fence breach" without it
    observed.flight.fence.load((), (FenceCircle(47.397742, 8.545594, 2000.0, inclusion=True),))
    observed.fly(0.2)
    present, enabled, healthy = bits(observed.sent("SYS_STATUS"))
    assert present & healthy & FENCE
    assert bool(enabled & FENCE) == (observed.flight.parameters["GF_ACTION"] != 0)
    observed.flight.fence.load((), (FenceCircle(47.397742, 8.545594, 5000.0, inclusion=False),))
    observed.fly(0.2)
    assert not bits(observed.sent("SYS_STATUS"))[2] & FENCE
    observed.flight.parameters.set("GF_ACTION", 0)
    assert not bits(observed.sent("SYS_STATUS"))[1] & FENCE


def test_a_battery_below_the_critical_charge_is_ill(moment: Moment, observed: Observed) -> None:
    critical = observed.flight.parameters["BAT_CRIT_THR"]
    for remaining, well in ((critical + 0.01, True), (critical - 0.01, False), (None, True)):
        assert bool(bits(observed.sent("SYS_STATUS", moment(battery_remaining=remaining)))[2] & BATTERY) == well


def test_a_stuck_wing_and_a_failed_motor_show_where_they_belong(moment: Moment, observed: Observed) -> None:
    observed.flight.actuators.faults = ("tilt servo stuck at 20 deg",)
    healthy = bits(observed.sent("SYS_STATUS", moment()))[2]
    assert not healthy & MOTOR_OUTPUTS
    assert healthy & PROPULSION
    observed.flight.actuators.faults = ("left motor failed",)
    healthy = bits(observed.sent("SYS_STATUS", moment()))[2]
    assert healthy & MOTOR_OUTPUTS
    assert not healthy & PROPULSION


def test_without_an_autopilot_nothing_is_said_of_arming_and_control() -> None:
    for kind in bits(Observed(autopilot=False).sent("SYS_STATUS")):
        assert not kind & (PREARM | LOOPS | STICKS | FENCE)
        assert kind & GPS


def test_an_outside_controller_leaves_arming_and_control_to_itself() -> None:
    observed = Observed(start="trim:20")
    observed.simulation.set_controls(observed.simulation.controls)
    assert not bits(observed.sent("SYS_STATUS"))[0] & (PREARM | LOOPS)
