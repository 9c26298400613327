"""What the vehicle believes of its motion, and how far: estimator status, odometry, secondary and simulated attitude.

The estimate is the truth, so nothing is in doubt: every flag is up, no innovation, no variance. ArduPilot's messages
say the same in their own fields.
"""

import math
from typing import Any

from sitl.hil.magnetic_field import in_body_axes
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.telemetry.context import Context, boot_us
from sitl.mavlink.telemetry.motion import DEGREES_E7, global_position_int
from sitl.mavlink.telemetry.vehicle_status import extended_sys_state
from sitl.snapshot import Snapshot

__all__ = [
    "ahrs",
    "ahrs2",
    "autopilot_state_for_gimbal_device",
    "ekf_status_report",
    "estimator_status",
    "global_position_int_cov",
    "odometry",
    "sim_state",
    "simstate",
]

# The same bits have the same meaning in ESTIMATOR_STATUS_FLAGS and EKF_STATUS_FLAGS.
KNOWN = (
    mav.ESTIMATOR_ATTITUDE
    | mav.ESTIMATOR_VELOCITY_HORIZ
    | mav.ESTIMATOR_VELOCITY_VERT
    | mav.ESTIMATOR_POS_HORIZ_REL
    | mav.ESTIMATOR_POS_HORIZ_ABS
    | mav.ESTIMATOR_POS_VERT_ABS
    | mav.ESTIMATOR_POS_VERT_AGL
    | mav.ESTIMATOR_PRED_POS_HORIZ_REL
    | mav.ESTIMATOR_PRED_POS_HORIZ_ABS
)
COVARIANCE_6 = (0.0,) * 36
UPPER_TRIANGLE_6 = (0.0,) * 21
SURE = 100  # [%]
MEASURED_ZERO = 1e-5  # 0 would mean that nobody knows it


def estimator_status(snapshot: Snapshot, _: Context) -> tuple[Any, ...]:
    """ESTIMATOR_STATUS: all is known; ratios of innovations and accuracies [m] are zero."""
    return (boot_us(snapshot), KNOWN, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def ekf_status_report(_: Snapshot, __: Context) -> tuple[Any, ...]:
    """EKF_STATUS_REPORT: the same."""
    return (KNOWN, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def odometry(snapshot: Snapshot, context: Context) -> tuple[Any, ...]:
    """ODOMETRY: position in local NED [m], attitude, velocity and rates in body axes [m/s, rad/s]."""
    return (
        boot_us(snapshot),
        mav.MAV_FRAME_LOCAL_NED,
        mav.MAV_FRAME_BODY_FRD,
        *context.origin.seen(*snapshot.position_ned),
        *snapshot.quaternion,
        *in_body_axes(snapshot.velocity_ned, snapshot.quaternion),
        *snapshot.rates,
        *UPPER_TRIANGLE_6,
        *UPPER_TRIANGLE_6,
        context.origin.moves & 0xFF,  # resets of the estimate
        mav.MAV_ESTIMATOR_TYPE_AUTOPILOT,
        SURE,
    )


def global_position_int_cov(snapshot: Snapshot, context: Context) -> tuple[Any, ...]:
    """GLOBAL_POSITION_INT_COV: degE7, mm, m/s north, east, down."""
    _, lat, lon, alt, relative, *_ = global_position_int(snapshot, context)
    place = (lat, lon, alt, relative)
    return (boot_us(snapshot), mav.MAV_ESTIMATOR_TYPE_AUTOPILOT, *place, *snapshot.velocity_ned, *COVARIANCE_6)


def ahrs(_: Snapshot, __: Context) -> tuple[Any, ...]:
    """AHRS: no gyro drifts, no error is left."""
    return (0.0,) * 7


def ahrs2(snapshot: Snapshot, _: Context) -> tuple[Any, ...]:
    """AHRS2: roll, pitch, yaw [rad], altitude above mean sea level [m], degE7."""
    return (
        snapshot.roll,
        snapshot.pitch,
        snapshot.yaw,
        snapshot.altitude_msl,
        round(snapshot.latitude * DEGREES_E7),
        round(snapshot.longitude * DEGREES_E7),
    )


def simstate(snapshot: Snapshot, _: Context) -> tuple[Any, ...]:
    """SIMSTATE: roll, pitch, yaw [rad], specific force [m/s^2] and rates [rad/s] in body axes, degE7."""
    return (
        snapshot.roll,
        snapshot.pitch,
        snapshot.yaw,
        *snapshot.specific_force,
        *snapshot.rates,
        round(snapshot.latitude * DEGREES_E7),
        round(snapshot.longitude * DEGREES_E7),
    )


def sim_state(snapshot: Snapshot, _: Context) -> tuple[Any, ...]:
    """SIM_STATE: attitude, specific force and rates in body axes, deg and degE7, m above mean sea level, m/s NED."""
    return (
        *snapshot.quaternion,
        snapshot.roll,
        snapshot.pitch,
        snapshot.yaw,
        *snapshot.specific_force,
        *snapshot.rates,
        math.degrees(snapshot.latitude),
        math.degrees(snapshot.longitude),
        snapshot.altitude_msl,
        *(0.0, 0.0),
        *snapshot.velocity_ned,
        round(snapshot.latitude * DEGREES_E7),
        round(snapshot.longitude * DEGREES_E7),
    )


def autopilot_state_for_gimbal_device(snapshot: Snapshot, context: Context) -> tuple[Any, ...]:
    """AUTOPILOT_STATE_FOR_GIMBAL_DEVICE: attitude, velocity NED [m/s], turn rate about the vertical [rad/s]."""
    _vtol, landed = extended_sys_state(snapshot, context)
    guidance = context.guidance
    guidance.look()
    yaw_rate = guidance.yaw_rate
    w, x, y, z = snapshot.quaternion
    p, q, r = snapshot.rates
    # Last row of the matrix that turns body vectors into NED.
    turning = 2.0 * (x * z - w * y) * p + 2.0 * (y * z + w * x) * q + (1.0 - 2.0 * (x * x + y * y)) * r
    return (
        *(0, 0),
        boot_us(snapshot),
        *snapshot.quaternion,
        0,
        *snapshot.velocity_ned,
        0,
        math.nan if yaw_rate is None else yaw_rate,
        KNOWN,
        landed,
        turning or MEASURED_ZERO,
    )
