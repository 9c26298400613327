"""Every field of every streamed message, computed here a second time from its definition's units and frames."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from pymavlink import mavutil

from sitl.flight.landed import LandedState
from sitl.flight.mode import Mode
from sitl.flight.regime import Regime
from sitl.mavlink.codec import codec
from sitl.mavlink.context import Context, context_for
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.face import TELEMETRY
from sitl.snapshot import Snapshot
from vehicle_model.aircraft import Aircraft
from vehicle_model.state import blank_controls

EPOCH = 1_790_000_000.25  # 2026-09-21
Moment = Callable[..., Snapshot]


@pytest.fixture
def context(aircraft: Aircraft) -> Context:
    return context_for(aircraft.vehicle, aircraft.channels, EPOCH)


def sent(name: str, snapshot: Snapshot, context: Context) -> Any:
    """The message as pymavlink decodes it from our frame."""
    context.note(snapshot)
    packer = codec(name)
    frame = packer.frame(packer.payload(TELEMETRY[name](snapshot, context)), 0, 1, 1)
    return mav.MAVLink(None).decode(bytearray(frame))


def test_attitude(moment: Moment, context: Context) -> None:
    m = sent("ATTITUDE", moment(), context)
    assert m.time_boot_ms == 12348  # 12.3475 s
    assert (m.roll, m.pitch, m.yaw) == pytest.approx((0.1, -0.2, -0.75))
    assert (m.rollspeed, m.pitchspeed, m.yawspeed) == pytest.approx((0.01, -0.02, 0.03))


def test_attitude_quaternion(moment: Moment, context: Context) -> None:
    m = sent("ATTITUDE_QUATERNION", moment(), context)
    assert m.time_boot_ms == 12348
    assert (m.q1, m.q2, m.q3, m.q4) == pytest.approx((0.9, 0.1, -0.2, math.sqrt(0.14)))
    assert (m.rollspeed, m.pitchspeed, m.yawspeed) == pytest.approx((0.01, -0.02, 0.03))
    assert m.repr_offset_q == [0.0] * 4


def test_local_position_ned(moment: Moment, context: Context) -> None:
    m = sent("LOCAL_POSITION_NED", moment(), context)
    assert m.time_boot_ms == 12348
    assert (m.x, m.y, m.z, m.vx, m.vy, m.vz) == (101.5, -203.25, -24.25, 15.125, -9.25, -2.5)


def test_global_position_int(moment: Moment, context: Context) -> None:
    m = sent("GLOBAL_POSITION_INT", moment(), context)
    assert (m.time_boot_ms, m.lat, m.lon, m.alt, m.relative_alt) == (12348, 473977000, -85456000, 512250, 24250)
    assert (m.vx, m.vy, m.vz) == (1512, -925, -250)  # cm/s; 1512.5 rounds to even
    assert m.hdg == round((360.0 - math.degrees(0.75)) * 100)


def test_relative_altitude_is_a_difference_of_altitudes_where_the_earth_is_curved(
    moment: Moment, context: Context
) -> None:
    context.note(moment(altitude_msl=488.0, position_ned=(0.0, 0.0, 0.0)))
    # 10 km away at the same altitude the tangent plane has left the ground by d^2/2R = 7.8 m.
    away = moment(altitude_msl=488.0, position_ned=(10000.0, 0.0, 7.84))
    assert sent("GLOBAL_POSITION_INT", away, context).relative_alt == 0
    assert sent("ALTITUDE", away, context).altitude_relative == 0.0
    assert sent("ALTITUDE", away, context).altitude_local == pytest.approx(-7.84)


@pytest.mark.parametrize(
    ("yaw", "cdeg", "deg"), [(0.0, 0, 0), (-1e-6, 0, 0), (math.pi, 18000, 180), (-math.pi / 2, 27000, 270)]
)
def test_headings_run_from_0_to_360_exclusive(
    moment: Moment, context: Context, yaw: float, cdeg: int, deg: int
) -> None:
    assert sent("GLOBAL_POSITION_INT", moment(yaw=yaw), context).hdg == cdeg
    assert sent("VFR_HUD", moment(yaw=yaw), context).heading == deg


def test_vfr_hud(moment: Moment, context: Context) -> None:
    m = sent("VFR_HUD", moment(), context)
    assert m.airspeed == pytest.approx(18.25 * math.sqrt(1.16 / 1.225))  # equivalent airspeed
    assert m.groundspeed == pytest.approx(math.sqrt(15.125**2 + 9.25**2))
    assert (m.heading, m.throttle, m.alt, m.climb) == (317, 55, 512.25, 2.5)


def test_altitude(moment: Moment, context: Context) -> None:
    m = sent("ALTITUDE", moment(), context)
    assert m.time_usec == 12347500
    # Standard atmosphere (1976), table: 950 hPa is at 540.3 m.
    assert m.altitude_monotonic == pytest.approx(540.3, abs=0.2)
    assert (m.altitude_amsl, m.altitude_local, m.altitude_relative) == (512.25, 24.25, 24.25)
    assert (m.altitude_terrain, m.bottom_clearance) == (23.5, 23.5)


def test_servo_output_raw(moment: Moment, context: Context, aircraft: Aircraft) -> None:
    m = sent("SERVO_OUTPUT_RAW", moment(time=5000.0), context)
    assert m.time_usec == 5_000_000_000 % 2**32
    assert m.port == 0
    servos = {row: aircraft.vehicle["servos"][0][row] for row in range(4)}
    elevator, tilt, aileron = servos[3], servos[0], servos[1]

    def pulse(angle: float, servo: np.void) -> int:
        return round(1000.0 + 1000.0 * (angle - servo["minimum"]) / (servo["maximum"] - servo["minimum"]))

    assert [m.servo1_raw, m.servo2_raw, m.servo3_raw] == [1600, 1500, 1375]
    assert m.servo4_raw == pulse(math.radians(40.0), tilt)
    assert [m.servo5_raw, m.servo6_raw] == [pulse(0.10, aileron), pulse(-0.05, aileron)]
    assert m.servo7_raw == pulse(0.02, elevator)
    assert [getattr(m, f"servo{n}_raw") for n in range(8, 17)] == [0] * 9


def test_heartbeat(moment: Moment, context: Context) -> None:
    m = sent("HEARTBEAT", moment(), context)
    assert (m.type, m.autopilot, m.custom_mode >> 16, m.mavlink_version) == (24, 12, 1, 3)
    assert m.base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED
    assert m.base_mode & mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
    assert m.system_status == mav.MAV_STATE_ACTIVE
    parked = sent("HEARTBEAT", moment(controls=blank_controls(), on_ground=True), context)
    assert not parked.base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED
    assert parked.system_status == mav.MAV_STATE_STANDBY


@pytest.mark.parametrize(
    ("mode", "name"),
    [
        (Mode.MANUAL, "MANUAL"),
        (Mode.STABILIZED, "STABILIZED"),
        (Mode.ALTITUDE, "ALTCTL"),
        (Mode.POSITION, "POSCTL"),
        (Mode.HOLD, "LOITER"),
        (Mode.TAKEOFF, "TAKEOFF"),
        (Mode.LAND, "LAND"),
        (Mode.RETURN, "RTL"),
        (Mode.MISSION, "MISSION"),
        (Mode.OFFBOARD, "OFFBOARD"),
    ],
)
@pytest.mark.parametrize("armed", [True, False])
def test_the_autopilots_modes_are_pxs_to_those_who_know_px4(
    moment: Moment, context: Context, mode: Mode, name: str, armed: bool
) -> None:
    m = sent("HEARTBEAT", moment(mode=mode.name, armed=armed), context)
    assert mavutil.interpret_px4_mode(m.base_mode, m.custom_mode) == name
    assert bool(m.base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED) == armed


def test_orbit_and_termination_have_pxs_numbers_too(moment: Moment, context: Context) -> None:
    assert sent("HEARTBEAT", moment(mode="ORBIT", armed=True), context).custom_mode == 3 << 16 | 1 << 24
    ended = sent("HEARTBEAT", moment(mode="TERMINATION", armed=True), context)
    assert (ended.custom_mode, ended.system_status) == (10 << 16, mav.MAV_STATE_FLIGHT_TERMINATION)


@pytest.mark.parametrize("regime", Regime)
@pytest.mark.parametrize("landed", LandedState)
def test_the_autopilots_regime_and_landed_state_go_before_wing_and_gear(
    moment: Moment, context: Context, regime: Regime, landed: LandedState
) -> None:
    snapshot = moment(tilt=0.0, on_ground=True, regime=regime.name, landed=landed.name)
    m = sent("EXTENDED_SYS_STATE", snapshot, context)
    vtol, land = mav.enums["MAV_VTOL_STATE"], mav.enums["MAV_LANDED_STATE"]
    words = {"HOVER": "MC", "CRUISE": "FW", "TO_CRUISE": "TRANSITION_TO_FW", "TO_HOVER": "TRANSITION_TO_MC"}
    assert vtol[m.vtol_state].name == f"MAV_VTOL_STATE_{words[regime.name]}"
    assert land[m.landed_state].name == f"MAV_LANDED_STATE_{landed.name}"


def test_sys_status(moment: Moment, context: Context) -> None:
    context.load, context.received, context.malformed = 0.125, 300, 100
    m = sent("SYS_STATUS", moment(battery_voltage=48.5, battery_current=31.25, battery_remaining=0.62), context)
    for sensors in (
        m.onboard_control_sensors_present,
        m.onboard_control_sensors_enabled,
        m.onboard_control_sensors_health,
    ):
        assert sensors & 0x3F == 0x3F  # gyro, accelerometer, magnetometer, both pressures, GPS
    assert (m.load, m.voltage_battery, m.current_battery, m.battery_remaining) == (125, 48500, 3125, 62)
    assert (m.drop_rate_comm, m.errors_comm) == (2500, 100)
    assert sent("SYS_STATUS", moment(battery_remaining=None), context).battery_remaining == -1


def test_link_errors_stop_at_the_most_their_field_holds(moment: Moment, context: Context) -> None:
    context.malformed = 65536 + 7
    assert sent("SYS_STATUS", moment(), context).errors_comm == 65535


def test_system_time_is_utc_and_time_since_start(moment: Moment, context: Context) -> None:
    m = sent("SYSTEM_TIME", moment(), context)
    assert (m.time_unix_usec, m.time_boot_ms) == (round((EPOCH + 12.3475) * 1e6), 12348)


@pytest.mark.parametrize(
    ("tilt", "command", "state"),
    [
        (90.0, 90.0, mav.MAV_VTOL_STATE_MC),
        (76.0, 0.0, mav.MAV_VTOL_STATE_MC),
        (14.0, 90.0, mav.MAV_VTOL_STATE_FW),
        (50.0, 20.0, mav.MAV_VTOL_STATE_TRANSITION_TO_FW),
        (50.0, 90.0, mav.MAV_VTOL_STATE_TRANSITION_TO_MC),
    ],
)
def test_vtol_state_follows_the_wing(moment: Moment, context: Context, tilt: float, command: float, state: int) -> None:
    controls = blank_controls()
    controls[3] = math.radians(command)
    snapshot = moment(tilt=math.radians(tilt), controls=controls)
    assert sent("EXTENDED_SYS_STATE", snapshot, context).vtol_state == state


def test_a_wing_that_rests_half_way_keeps_the_direction_it_came_from(moment: Moment, context: Context) -> None:
    controls = blank_controls()
    controls[3] = math.radians(50.0)
    context.note(moment(tilt=math.radians(30.0), controls=controls))
    resting = moment(tilt=math.radians(50.0), controls=controls)
    assert sent("EXTENDED_SYS_STATE", resting, context).vtol_state == mav.MAV_VTOL_STATE_TRANSITION_TO_MC


@pytest.mark.parametrize(
    ("on_ground", "state"), [(True, mav.MAV_LANDED_STATE_ON_GROUND), (False, mav.MAV_LANDED_STATE_IN_AIR)]
)
def test_landed_state(moment: Moment, context: Context, on_ground: bool, state: int) -> None:
    assert sent("EXTENDED_SYS_STATE", moment(on_ground=on_ground), context).landed_state == state


def test_tilt_goes_out_in_degrees_for_everybody_and_in_radians_in_our_dialect(moment: Moment, context: Context) -> None:
    named = sent("NAMED_VALUE_FLOAT", moment(), context)
    assert (named.name, named.time_boot_ms) == ("TILT", 12348)
    assert named.value == pytest.approx(42.0)
    ours = sent("TILT_STATUS", moment(), context)
    assert (ours.tilt, ours.tilt_command) == pytest.approx((math.radians(42.0), math.radians(40.0)))
    assert ours.tilt_rate_limit == pytest.approx(context.tilt_rate_limit)
    assert ours.flags == 0


def test_tilt_status_says_what_holds_the_wing_back(moment: Moment, context: Context, aircraft: Aircraft) -> None:
    servo = aircraft.vehicle["servos"][0][0]
    threshold = servo["rate_limit"] * servo["time_constant"]  # lag at which a first-order servo asks for its top rate
    for lag, limited in ((0.9 * threshold, 0), (1.1 * threshold, mav.TILT_STATUS_FLAGS_RATE_LIMITED)):
        controls = blank_controls()
        controls[3] = 0.7
        assert sent("TILT_STATUS", moment(tilt=0.7 - lag, controls=controls), context).flags == limited
    controls = blank_controls()
    controls[3] = servo["maximum"] + 1.0
    at_end = moment(tilt=float(servo["maximum"]), controls=controls)
    assert sent("TILT_STATUS", at_end, context).flags == mav.TILT_STATUS_FLAGS_AT_LIMIT
