"""What guidance asks for, in flights whose targets are known, and masked where nothing is asked."""

import math
from typing import Any

import pytest
from scipy.spatial.transform import Rotation

from sitl.flight.manual_input import ManualInput
from sitl.flight.mission_items import MissionItem
from sitl.flight.mode import Mode
from sitl.flight.offboard import AttitudeSetpoint, MotionSetpoint
from sitl.mavlink.dialect import tiltwing as mav
from tests.sitl.mavlink.telemetry.observed import Observed

X, Y, Z, VELOCITY, AX, AY, AZ, YAW, YAW_RATE = 1, 2, 4, 8 | 16 | 32, 64, 128, 256, 1024, 2048  # ignored
METRES_PER_DEGREE = 111_200.0  # of latitude, near enough


@pytest.fixture
def hovering() -> Observed:
    """Armed, 20 m above home, holding a point with a heading of north."""
    observed = Observed()
    observed.flight.takeoff(20.0)
    observed.flight.arm()
    while observed.flight.mode != Mode.HOLD:
        observed.fly(0.5)
        assert observed.simulation.time < 60.0
    observed.fly(2.0)
    return observed


@pytest.fixture
def cruising() -> Observed:
    """Wing-borne northward, 100 m above home."""
    return Observed(start="trim:20")


def test_who_stands_disarmed_asks_for_nothing() -> None:
    observed = Observed()
    observed.fly(0.1)
    local, world = observed.sent("POSITION_TARGET_LOCAL_NED"), observed.sent("POSITION_TARGET_GLOBAL_INT")
    assert local.type_mask == world.type_mask == 0x7FFF & ~0x7200  # everything but the bit for forces
    assert (local.coordinate_frame, world.coordinate_frame) == (mav.MAV_FRAME_LOCAL_NED, mav.MAV_FRAME_GLOBAL)
    attitude = observed.sent("ATTITUDE_TARGET")
    assert attitude.type_mask == 1 | 2 | 4 | 64 | 128
    assert (attitude.q, attitude.thrust) == ([1.0, 0.0, 0.0, 0.0], 0.0)
    navigation = observed.sent("NAV_CONTROLLER_OUTPUT")
    assert (navigation.nav_roll, navigation.nav_pitch, navigation.wp_dist, navigation.xtrack_error) == (0, 0, 0, 0)
    assert observed.values("ORBIT_EXECUTION_STATUS") is None


def test_a_point_in_hover(hovering: Observed) -> None:
    hovering.flight.go_to(30.0, -40.0, -25.0, heading=math.radians(-90.0))
    hovering.fly(1.0)
    snapshot = hovering.simulation.snapshot()
    m = hovering.sent("POSITION_TARGET_LOCAL_NED", snapshot)
    assert m.time_boot_ms == round(snapshot.time * 1e3)
    assert m.type_mask == AX | AY | AZ | YAW_RATE
    assert (m.x, m.y, m.z) == (30.0, -40.0, -25.0)
    assert math.degrees(math.atan2(m.vy, m.vx)) == pytest.approx(math.degrees(math.atan2(-40.0, 30.0)), abs=5.0)
    assert 0.0 < math.hypot(m.vx, m.vy) <= hovering.flight.parameters["MPC_XY_CRUISE"]
    assert m.vz < 0.0
    assert (m.afx, m.afy, m.afz, m.yaw_rate) == (0.0, 0.0, 0.0, 0.0)

    world = hovering.sent("POSITION_TARGET_GLOBAL_INT", snapshot)
    assert (world.type_mask, world.vx, world.vy, world.vz, world.yaw) == (m.type_mask, m.vx, m.vy, m.vz, m.yaw)
    assert (world.lat_int * 1e-7 - 47.397742) * METRES_PER_DEGREE == pytest.approx(30.0, rel=1e-2)
    east = (world.lon_int * 1e-7 - 8.545594) * METRES_PER_DEGREE * math.cos(math.radians(47.4))
    assert east == pytest.approx(-40.0, rel=1e-2)
    assert world.alt == pytest.approx(513.0)  # 25 m above 488 m

    navigation = hovering.sent("NAV_CONTROLLER_OUTPUT", snapshot)
    north, east, down = snapshot.position_ned
    assert navigation.wp_dist == round(math.hypot(30.0 - north, -40.0 - east))
    assert navigation.target_bearing == round(math.degrees(math.atan2(-40.0 - east, 30.0 - north)))
    assert navigation.nav_bearing == pytest.approx(math.degrees(math.atan2(m.vy, m.vx)), abs=0.51)
    assert navigation.alt_error == pytest.approx(down + 25.0)
    assert (navigation.aspd_error, navigation.xtrack_error) == (0.0, 0.0)
    assert hovering.values("ORBIT_EXECUTION_STATUS") is None


def test_attitude_target_is_the_reference_as_a_quaternion(hovering: Observed) -> None:
    hovering.flight.go_to(30.0, -40.0, -25.0, heading=math.radians(-90.0))
    hovering.fly(10.0)
    snapshot = hovering.simulation.snapshot()
    m = hovering.sent("ATTITUDE_TARGET", snapshot)
    assert m.type_mask == 1 | 2 | 4  # no rates are asked for
    wanted = Rotation.from_quat(m.q, scalar_first=True)
    yaw, pitch, roll = wanted.as_euler("ZYX", degrees=True)
    navigation = hovering.sent("NAV_CONTROLLER_OUTPUT", snapshot)
    assert (roll, pitch) == pytest.approx((navigation.nav_roll, navigation.nav_pitch), abs=1e-3)
    assert yaw == pytest.approx(-90.0, abs=1.0)
    error = wanted.inv() * Rotation.from_quat(snapshot.quaternion, scalar_first=True)
    assert math.degrees(error.magnitude()) < 3.0  # which it flies
    assert 0.3 < m.thrust < 0.9


def test_a_leg_has_its_errors_signed(cruising: Observed) -> None:
    north, east, down = cruising.simulation.snapshot().position_ned
    places = cruising.flight.places
    end = places.to_geodetic(north + 1000.0, east + 1000.0, down - 20.0)
    cruising.flight.load_mission([MissionItem(16, frame=0, x=end[0], y=end[1], z=end[2])])
    cruising.flight.start_mission()
    cruising.fly(2.0)  # northward still for the most part: left of a leg to the north-east
    snapshot = cruising.simulation.snapshot()
    m = cruising.sent("NAV_CONTROLLER_OUTPUT", snapshot)
    now_north, now_east, now_down = snapshot.position_ned
    right = ((now_east - east) - (now_north - north)) / math.sqrt(2.0)
    assert right < -1.0
    assert m.xtrack_error == pytest.approx(right, abs=0.1)
    assert m.alt_error == pytest.approx(now_down - (down - 20.0), abs=0.1)
    assert m.alt_error > 15.0  # it shall climb
    speed = cruising.flight.parameters["FW_AIRSPD_TRIM"]
    assert m.aspd_error == pytest.approx(speed - snapshot.airspeed, abs=0.01)
    assert m.nav_roll > 5.0  # to the right
    target = cruising.sent("POSITION_TARGET_LOCAL_NED", snapshot)
    assert (target.x, target.y, target.z) == pytest.approx((north + 1000.0, east + 1000.0, down - 20.0), abs=0.1)


def test_a_circle_has_its_centre_and_its_radius(cruising: Observed) -> None:
    assert cruising.flight.mode == Mode.HOLD  # which on the wing is a circle
    cruising.flight.orbit((50.0, 60.0), -200.0)
    cruising.fly(0.1)
    snapshot = cruising.simulation.snapshot()
    m = cruising.sent("ORBIT_EXECUTION_STATUS", snapshot)
    assert (m.time_usec, m.radius, m.frame) == (round(snapshot.time * 1e6), -200.0, mav.MAV_FRAME_GLOBAL)
    assert (m.x * 1e-7 - 47.397742) * METRES_PER_DEGREE == pytest.approx(50.0, rel=1e-2)
    assert m.z == pytest.approx(snapshot.altitude_msl, abs=1.0)
    target = cruising.sent("POSITION_TARGET_LOCAL_NED", snapshot)
    assert (target.x, target.y) == (50.0, 60.0)
    north, east, _ = snapshot.position_ned
    inside = math.hypot(50.0 - north, 60.0 - east) - 200.0
    assert cruising.sent("NAV_CONTROLLER_OUTPUT", snapshot).xtrack_error == pytest.approx(inside, abs=1e-3)


def offboard(observed: Observed, setpoint: Any) -> None:
    observed.simulation.stream(setpoint)
    observed.fly(1.0)


def test_a_velocity_leads_to_no_place_and_a_yaw_rate_is_told(hovering: Observed) -> None:
    offboard(hovering, MotionSetpoint(velocity=(2.0, 1.0), down_rate=-0.5, yaw_rate=0.3))
    m = hovering.sent("POSITION_TARGET_LOCAL_NED")
    assert m.type_mask == X | Y | Z | AX | AY | AZ
    assert (m.x, m.y, m.z) == (0.0, 0.0, 0.0)
    assert (m.vx, m.vy, m.vz) == pytest.approx((2.0, 1.0, -0.5), abs=0.8)
    assert m.yaw_rate == pytest.approx(0.3)
    world = hovering.sent("POSITION_TARGET_GLOBAL_INT")
    assert (world.lat_int, world.lon_int, world.alt) == (0, 0, 0.0)
    attitude = hovering.sent("ATTITUDE_TARGET")
    assert attitude.type_mask == 1 | 2
    assert attitude.body_yaw_rate == pytest.approx(0.3)
    gimbal = hovering.sent("AUTOPILOT_STATE_FOR_GIMBAL_DEVICE")
    assert gimbal.feed_forward_angular_velocity_z == pytest.approx(0.3)


def test_an_acceleration_is_turned_back_into_ned(hovering: Observed) -> None:
    offboard(hovering, MotionSetpoint(acceleration=(0.4, -0.2), down=-20.0, yaw=0.5))
    m = hovering.sent("POSITION_TARGET_LOCAL_NED")
    assert m.type_mask == X | Y | AZ | YAW_RATE
    assert (m.afx, m.afy, m.afz) == pytest.approx((0.4, -0.2, 0.0), abs=0.01)
    assert m.z == -20.0
    assert hovering.sent("POSITION_TARGET_GLOBAL_INT").alt == pytest.approx(508.0)


def test_an_attitude_setpoint_has_no_position(hovering: Observed) -> None:
    offboard(hovering, AttitudeSetpoint(0.05, -0.02, 0.1, 0.55))
    assert hovering.sent("POSITION_TARGET_LOCAL_NED").type_mask & (X | VELOCITY | YAW) == X | VELOCITY | YAW
    m = hovering.sent("ATTITUDE_TARGET")
    assert m.type_mask == 1 | 2
    assert (m.body_yaw_rate, m.thrust) == pytest.approx((0.1, 0.55), abs=0.02)
    navigation = hovering.sent("NAV_CONTROLLER_OUTPUT")
    assert (navigation.nav_roll, navigation.nav_pitch) == pytest.approx(
        (math.degrees(0.05), math.degrees(-0.02)), abs=0.1
    )


def test_an_outside_controllers_targets_are_not_ours(cruising: Observed) -> None:
    cruising.simulation.set_controls(cruising.simulation.controls)
    assert cruising.sent("POSITION_TARGET_LOCAL_NED").type_mask & X
    assert cruising.sent("ATTITUDE_TARGET").type_mask & 128
    assert cruising.values("ORBIT_EXECUTION_STATUS") is None


def test_targets_follow_a_restart(cruising: Observed) -> None:
    assert not cruising.sent("POSITION_TARGET_LOCAL_NED").type_mask & X
    cruising.simulation.restart("ground")
    cruising.context.restarted()
    assert cruising.sent("POSITION_TARGET_LOCAL_NED").type_mask & X


def test_sticks_in_position_mode_are_a_velocity(hovering: Observed) -> None:
    hovering.flight.manual(ManualInput(forward=1.0))
    hovering.flight.set_mode(Mode.POSITION)
    for _ in range(50):
        hovering.flight.manual(ManualInput(forward=1.0))
        hovering.fly(0.02)
    m = hovering.sent("POSITION_TARGET_LOCAL_NED")
    assert m.type_mask & (X | Y | VELOCITY) == X | Y
    assert m.vx > 0.5


def test_places_beyond_the_earth_do_no_harm(hovering: Observed) -> None:
    offboard(hovering, MotionSetpoint(position=(3e38, -3e38), down=-3e38))
    for name in ("POSITION_TARGET_LOCAL_NED", "POSITION_TARGET_GLOBAL_INT", "NAV_CONTROLLER_OUTPUT"):
        hovering.sent(name)
    assert hovering.sent("NAV_CONTROLLER_OUTPUT").wp_dist == 65535
