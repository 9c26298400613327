"""Attitude and rate: what the body should turn at, and the moment that makes it."""

import math

from vehicle_model.compiled import compiled
from vehicle_model.rotation import (
    Vector,
    cross,
    quaternion_conjugate,
    quaternion_from_euler,
    quaternion_multiply,
)

__all__ = ["moment_demand", "rate_demand"]


@compiled
def rate_demand(estimate, roll: float, pitch: float, turn_rate: float, roll_gain: float, pitch_gain: float,
                max_roll_rate: float) -> Vector:  # fmt: skip
    """Body rates [rad/s] towards a roll and pitch [rad] while the heading turns at `turn_rate` [rad/s].

    The attitude error is the quaternion from the present attitude to the one wanted at the same heading.
    """
    wanted = quaternion_from_euler(roll, pitch, estimate.euler[2])
    q = estimate.quaternion
    e0, e1, e2, _ = quaternion_multiply(*quaternion_conjugate(q[0], q[1], q[2], q[3]), *wanted)
    sign = 2.0 if e0 >= 0.0 else -2.0
    phi, theta = estimate.euler[0], estimate.euler[1]
    p = roll_gain * sign * e1
    return (
        min(max(p, -max_roll_rate), max_roll_rate) - turn_rate * math.sin(theta),
        pitch_gain * sign * e2 + turn_rate * math.cos(theta) * math.sin(phi),
        turn_rate * math.cos(theta) * math.cos(phi),
    )


@compiled
def moment_demand(craft, rates, acceleration: Vector) -> Vector:
    """Moment [N m] for an angular acceleration [rad/s^2] of the rigid body: J w' + w x J w."""
    inertia = craft.inertia
    p, q, r = rates[0], rates[1], rates[2]
    ap, aq, ar = acceleration
    momentum = (
        inertia[0, 0] * p + inertia[0, 1] * q + inertia[0, 2] * r,
        inertia[1, 0] * p + inertia[1, 1] * q + inertia[1, 2] * r,
        inertia[2, 0] * p + inertia[2, 1] * q + inertia[2, 2] * r,
    )
    gx, gy, gz = cross((p, q, r), momentum)
    return (
        inertia[0, 0] * ap + inertia[0, 1] * aq + inertia[0, 2] * ar + gx,
        inertia[1, 0] * ap + inertia[1, 1] * aq + inertia[1, 2] * ar + gy,
        inertia[2, 0] * ap + inertia[2, 1] * aq + inertia[2, 2] * ar + gz,
    )
