"""What the vehicle believes, in PX4's and ArduPilot's words, with rotations by scipy."""

import math
from collections.abc import Callable

import pytest
from scipy.spatial.transform import Rotation

from sitl.mavlink.dialect import tiltwing as mav
from sitl.snapshot import Snapshot
from tests.sitl.mavlink.telemetry.observed import Observed

Moment = Callable[..., Snapshot]


@pytest.fixture
def observed() -> Observed:
    return Observed()


def turn(snapshot: Snapshot) -> Rotation:
    """Body to NED."""
    return Rotation.from_quat(snapshot.quaternion, scalar_first=True)


def test_estimator_status_knows_everything(moment: Moment, observed: Observed) -> None:
    m = observed.sent("ESTIMATOR_STATUS", moment())
    doubts = mav.ESTIMATOR_CONST_POS_MODE | mav.ESTIMATOR_GPS_GLITCH | mav.ESTIMATOR_ACCEL_ERROR
    everything = sum(flag for flag in mav.enums["ESTIMATOR_STATUS_FLAGS"] if flag & flag - 1 == 0)
    assert (m.time_usec, m.flags) == (12347500, everything & ~doubts)
    ratios = (m.vel_ratio, m.pos_horiz_ratio, m.pos_vert_ratio, m.mag_ratio, m.hagl_ratio, m.tas_ratio)
    assert ratios == (0.0,) * 6
    assert (m.pos_horiz_accuracy, m.pos_vert_accuracy) == (0.0, 0.0)


def test_ekf_status_report_has_what_armable_asks_for(observed: Observed) -> None:
    m = observed.sent("EKF_STATUS_REPORT")
    # As DroneKit judges it: absolute or predicted horizontal position, and not in constant position mode.
    assert m.flags & mav.EKF_POS_HORIZ_ABS
    assert m.flags & mav.EKF_PRED_POS_HORIZ_ABS
    assert not m.flags & (mav.EKF_CONST_POS_MODE | mav.EKF_UNINITIALIZED | mav.EKF_GPS_GLITCHING)
    variances = (m.velocity_variance, m.pos_horiz_variance, m.pos_vert_variance, m.compass_variance)
    assert (*variances, m.terrain_alt_variance, m.airspeed_variance) == (0.0,) * 6


def test_odometry_has_its_velocity_in_body_axes(moment: Moment, observed: Observed) -> None:
    snapshot = moment()
    m = observed.sent("ODOMETRY", snapshot)
    assert (m.time_usec, m.frame_id, m.child_frame_id) == (12347500, mav.MAV_FRAME_LOCAL_NED, mav.MAV_FRAME_BODY_FRD)
    assert (m.x, m.y, m.z) == (101.5, -203.25, -24.25)
    assert m.q == pytest.approx(snapshot.quaternion)
    assert (m.vx, m.vy, m.vz) == pytest.approx(turn(snapshot).inv().apply(snapshot.velocity_ned))
    assert (m.rollspeed, m.pitchspeed, m.yawspeed) == pytest.approx((0.01, -0.02, 0.03))
    assert (m.pose_covariance, m.velocity_covariance) == ([0.0] * 21, [0.0] * 21)
    assert (m.reset_counter, m.estimator_type, m.quality) == (0, mav.MAV_ESTIMATOR_TYPE_AUTOPILOT, 100)


def test_global_position_with_covariance(moment: Moment, observed: Observed) -> None:
    m = observed.sent("GLOBAL_POSITION_INT_COV", moment())
    assert (m.time_usec, m.estimator_type) == (12347500, mav.MAV_ESTIMATOR_TYPE_AUTOPILOT)
    assert (m.lat, m.lon, m.alt, m.relative_alt) == (473977000, -85456000, 512250, 24250)
    assert (m.vx, m.vy, m.vz) == (15.125, -9.25, -2.5)
    assert m.covariance == [0.0] * 36


def test_ahrs_and_its_second(moment: Moment, observed: Observed) -> None:
    first = observed.sent("AHRS", moment())
    assert (first.omegaIx, first.omegaIy, first.omegaIz, first.error_rp, first.error_yaw) == (0.0,) * 5
    second = observed.sent("AHRS2", moment())
    assert (second.roll, second.pitch, second.yaw) == pytest.approx((0.1, -0.2, -0.75))
    assert (second.altitude, second.lat, second.lng) == (512.25, 473977000, -85456000)


def test_the_simulations_own_state(moment: Moment, observed: Observed) -> None:
    for name in ("SIMSTATE", "SIM_STATE"):
        m = observed.sent(name, moment())
        assert (m.roll, m.pitch, m.yaw) == pytest.approx((0.1, -0.2, -0.75))
        assert (m.xacc, m.yacc, m.zacc) == (0.5, -0.25, -10.5)
        assert (m.xgyro, m.ygyro, m.zgyro) == pytest.approx((0.01, -0.02, 0.03))
    theirs = observed.sent("SIMSTATE", moment())
    assert (theirs.lat, theirs.lng) == (473977000, -85456000)
    common = observed.sent("SIM_STATE", moment())
    assert (common.q1, common.q2, common.q3, common.q4) == pytest.approx(moment().quaternion)
    assert (common.lat, common.lon) == pytest.approx((47.3977, -8.5456))
    assert (common.lat_int, common.lon_int, common.alt) == (473977000, -85456000, 512.25)
    assert (common.vn, common.ve, common.vd) == (15.125, -9.25, -2.5)
    assert (common.std_dev_horz, common.std_dev_vert) == (0.0, 0.0)


def test_autopilot_state_for_gimbal_device(moment: Moment, observed: Observed) -> None:
    snapshot = moment()
    m = observed.sent("AUTOPILOT_STATE_FOR_GIMBAL_DEVICE", snapshot)
    assert (m.target_system, m.target_component, m.time_boot_us) == (0, 0, 12347500)
    assert m.q == pytest.approx(snapshot.quaternion)
    assert (m.vx, m.vy, m.vz) == (15.125, -9.25, -2.5)
    assert m.angular_velocity_z == pytest.approx(turn(snapshot).apply(snapshot.rates)[2])
    assert math.isnan(m.feed_forward_angular_velocity_z)
    assert (m.q_estimated_delay_us, m.v_estimated_delay_us) == (0, 0)
    assert m.estimator_status & mav.ESTIMATOR_ATTITUDE
    assert m.landed_state == mav.MAV_LANDED_STATE_IN_AIR
    still = observed.sent("AUTOPILOT_STATE_FOR_GIMBAL_DEVICE", moment(rates=(0.0, 0.0, 0.0)))
    assert still.angular_velocity_z == pytest.approx(1e-5)  # as the definition has a measured zero
