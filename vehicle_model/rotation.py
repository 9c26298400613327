"""Attitude: unit quaternions, scalar first, that turn body vectors into NED, and Euler angles yaw-pitch-roll (ZYX).

Everything is scalars in, tuples out, so that compiled equations stay free of array allocation.
"""

import math

from vehicle_model.compiled import compiled

__all__ = [
    "body_to_ned", "cross", "euler_from_quaternion", "ned_to_body", "quaternion_conjugate", "quaternion_from_euler",
    "quaternion_multiply", "quaternion_normalise", "quaternion_rate",
]  # fmt: skip

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


@compiled
def cross(a: Vector, b: Vector) -> Vector:
    """Vector product a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@compiled
def body_to_ned(q0: float, q1: float, q2: float, q3: float, x: float, y: float, z: float) -> Vector:
    """Turn a vector from body axes into NED by a unit quaternion: v + 2 q0 (q x v) + 2 q x (q x v)."""
    tx, ty, tz = 2.0 * (q2 * z - q3 * y), 2.0 * (q3 * x - q1 * z), 2.0 * (q1 * y - q2 * x)
    return (
        x + q0 * tx + (q2 * tz - q3 * ty),
        y + q0 * ty + (q3 * tx - q1 * tz),
        z + q0 * tz + (q1 * ty - q2 * tx),
    )


@compiled
def ned_to_body(q0: float, q1: float, q2: float, q3: float, north: float, east: float, down: float) -> Vector:
    """Turn a vector from NED into body axes by a unit quaternion: the inverse of `body_to_ned`."""
    return body_to_ned(q0, -q1, -q2, -q3, north, east, down)


@compiled
def quaternion_multiply(
    a0: float, a1: float, a2: float, a3: float, b0: float, b1: float, b2: float, b3: float
) -> Quaternion:
    """Hamilton product a b: the rotation b followed by the rotation a."""
    return (
        a0 * b0 - a1 * b1 - a2 * b2 - a3 * b3,
        a0 * b1 + a1 * b0 + a2 * b3 - a3 * b2,
        a0 * b2 - a1 * b3 + a2 * b0 + a3 * b1,
        a0 * b3 + a1 * b2 - a2 * b1 + a3 * b0,
    )


@compiled
def quaternion_conjugate(q0: float, q1: float, q2: float, q3: float) -> Quaternion:
    """Inverse of a unit quaternion."""
    return q0, -q1, -q2, -q3


@compiled
def quaternion_normalise(q0: float, q1: float, q2: float, q3: float) -> Quaternion:
    """The same attitude at unit length."""
    scale = 1.0 / math.sqrt(q0 * q0 + q1 * q1 + q2 * q2 + q3 * q3)
    return q0 * scale, q1 * scale, q2 * scale, q3 * scale


@compiled
def quaternion_rate(q0: float, q1: float, q2: float, q3: float, p: float, q: float, r: float) -> Quaternion:
    """Time derivative q (0, p, q, r)/2 for the rate [rad/s], in body axes, of the body against the NED frame."""
    return (
        0.5 * (-q1 * p - q2 * q - q3 * r),
        0.5 * (q0 * p + q2 * r - q3 * q),
        0.5 * (q0 * q + q3 * p - q1 * r),
        0.5 * (q0 * r + q1 * q - q2 * p),
    )


@compiled
def quaternion_from_euler(roll: float, pitch: float, yaw: float) -> Quaternion:
    """Attitude after yaw, then pitch, then roll [rad], each about the axis as turned so far."""
    cr, sr = math.cos(0.5 * roll), math.sin(0.5 * roll)
    cp, sp = math.cos(0.5 * pitch), math.sin(0.5 * pitch)
    cy, sy = math.cos(0.5 * yaw), math.sin(0.5 * yaw)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


@compiled
def euler_from_quaternion(q0: float, q1: float, q2: float, q3: float) -> Vector:
    """Roll -pi..pi, pitch -pi/2..pi/2 and yaw -pi..pi [rad] of a unit quaternion.

    Pointing straight up or down only the sum or difference of roll and yaw is defined; all of it is given to yaw.
    """
    forward_north = q0 * q0 + q1 * q1 - q2 * q2 - q3 * q3
    forward_east = 2.0 * (q1 * q2 + q0 * q3)
    level = math.sqrt(forward_north * forward_north + forward_east * forward_east)
    pitch = math.atan2(2.0 * (q0 * q2 - q1 * q3), level)
    if level < 1e-12:
        return 0.0, pitch, math.atan2(2.0 * q0 * q3, q0 * q0 - q3 * q3)
    roll = math.atan2(2.0 * (q2 * q3 + q0 * q1), q0 * q0 - q1 * q1 - q2 * q2 + q3 * q3)
    return roll, pitch, math.atan2(forward_east, forward_north)
