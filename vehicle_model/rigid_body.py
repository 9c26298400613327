"""Eq. (1) of Hong et al. (2013) for a rigid body anywhere on or above the Earth, attitude as a quaternion.

The paper's equations are those of Nelson on a flat Earth that does not rotate. Here the NED frame is fixed to an
Earth that may turn at a rate Omega, so the velocity U, V, W relative to the Earth also feels Coriolis and centrifugal
acceleration, and attitude follows the rate of the body relative to the Earth; P, Q, R are inertial. With Omega = 0
every added term vanishes and eq. (1) remains, with its missing products of inertia restored.
"""

import numpy as np

from vehicle_model.compiled import compiled
from vehicle_model.earth import FLAT, geodetic, gravitation, local_axes
from vehicle_model.rotation import (
    Quaternion,
    Vector,
    body_to_ned,
    cross,
    ned_to_body,
    quaternion_multiply,
    quaternion_rate,
)
from vehicle_model.state import POSITION, QUATERNION, RATES, VELOCITY

__all__ = ["gravity_ned", "local_motion", "rates_relative_to_earth", "rigid_body_derivative"]


@compiled
def rates_relative_to_earth(state: np.ndarray, environment) -> Vector:
    """Body rates [rad/s] relative to the Earth and the air that turns with it, in body axes: P, Q, R less Omega."""
    p, q, r = state[RATES], state[RATES + 1], state[RATES + 2]
    if environment.earth == FLAT:
        return p, q, r
    turn = environment.rotation_ned
    wx, wy, wz = ned_to_body(
        state[QUATERNION], state[QUATERNION + 1], state[QUATERNION + 2], state[QUATERNION + 3],
        turn[0], turn[1], turn[2],
    )  # fmt: skip
    return p - wx, q - wy, r - wz


@compiled
def gravity_ned(north: float, east: float, down: float, environment) -> Vector:
    """Acceleration [m/s^2] of a body let go at rest at a NED position [m]: gravitation less Omega x (Omega x r)."""
    gn, ge, gd = gravitation(north, east, down, environment)
    if environment.earth == FLAT:
        return gn, ge, gd
    turn = (environment.rotation_ned[0], environment.rotation_ned[1], environment.rotation_ned[2])
    centre = environment.centre_ned
    cx, cy, cz = cross(turn, cross(turn, (north - centre[0], east - centre[1], down - centre[2])))
    return gn - cx, ge - cy, gd - cz


@compiled
def rigid_body_derivative(
    state: np.ndarray,
    fx: float,
    fy: float,
    fz: float,
    l: float,  # noqa: E741  (L, M, N are the moments in every text on flight dynamics)
    m: float,
    n: float,
    vehicle,
    environment,
    rate: np.ndarray,
) -> None:
    """Write the time derivative of position, velocity, quaternion and rates into rate[0:13]; eq. (1).

    `state` and `rate` are laid out as in `vehicle_model.state`. fx, fy, fz [N] and l, m, n [N m] are all forces but
    gravity and all moments about the centre of mass, those of spinning rotors included, in body axes. `vehicle` and
    `environment` are records.

        r'  = C v                                                                C: body to NED
        v'  = F/m + C^T (g - 2 Omega x C v - Omega x (Omega x r)) - (w - C^T Omega) x v
        q'  = q (0, w - C^T Omega) / 2
        w'  = J^-1 (M - w x J w)

    The quaternion's length is left alone: its derivative is normal to it, so only the integrator's own error changes
    the length, and the step divides that out.
    """
    u, v, w = state[VELOCITY], state[VELOCITY + 1], state[VELOCITY + 2]
    q0, q1, q2, q3 = state[QUATERNION], state[QUATERNION + 1], state[QUATERNION + 2], state[QUATERNION + 3]
    p, q, r = state[RATES], state[RATES + 1], state[RATES + 2]
    north, east, down = state[POSITION], state[POSITION + 1], state[POSITION + 2]

    vn, ve, vd = body_to_ned(q0, q1, q2, q3, u, v, w)
    rate[POSITION], rate[POSITION + 1], rate[POSITION + 2] = vn, ve, vd

    gn, ge, gd = gravity_ned(north, east, down, environment)
    if environment.earth != FLAT:
        turn = environment.rotation_ned
        cn, ce, cd = cross((turn[0], turn[1], turn[2]), (vn, ve, vd))
        gn, ge, gd = gn - 2.0 * cn, ge - 2.0 * ce, gd - 2.0 * cd
    gx, gy, gz = ned_to_body(q0, q1, q2, q3, gn, ge, gd)
    pe, qe, re = rates_relative_to_earth(state, environment)
    tx, ty, tz = cross((pe, qe, re), (u, v, w))
    mobility = 1.0 / vehicle.mass
    rate[VELOCITY] = fx * mobility + gx - tx
    rate[VELOCITY + 1] = fy * mobility + gy - ty
    rate[VELOCITY + 2] = fz * mobility + gz - tz

    d0, d1, d2, d3 = quaternion_rate(q0, q1, q2, q3, pe, qe, re)
    rate[QUATERNION], rate[QUATERNION + 1], rate[QUATERNION + 2], rate[QUATERNION + 3] = d0, d1, d2, d3

    sx, sy, sz = cross((p, q, r), _times(vehicle.inertia, p, q, r))
    rate[RATES], rate[RATES + 1], rate[RATES + 2] = _times(vehicle.inertia_inverse, l - sx, m - sy, n - sz)


@compiled
def local_motion(state: np.ndarray, environment) -> tuple[Vector, Vector, Quaternion]:
    """Where the body is and how it moves, as seen from the Earth below it.

    Returns geodetic latitude and longitude [rad] and height above the ellipsoid [m]; velocity [m/s] relative to the
    Earth in the local geodetic NED axes; and the quaternion that turns body vectors into those axes.
    """
    north, east, down = state[POSITION], state[POSITION + 1], state[POSITION + 2]
    q0, q1, q2, q3 = state[QUATERNION], state[QUATERNION + 1], state[QUATERNION + 2], state[QUATERNION + 3]
    l0, l1, l2, l3 = local_axes(north, east, down, environment)
    attitude = quaternion_multiply(l0, l1, l2, l3, q0, q1, q2, q3)
    a0, a1, a2, a3 = attitude
    velocity = body_to_ned(a0, a1, a2, a3, state[VELOCITY], state[VELOCITY + 1], state[VELOCITY + 2])
    return geodetic(north, east, down, environment), velocity, attitude


@compiled
def _times(matrix: np.ndarray, x: float, y: float, z: float) -> Vector:
    """Matrix (3, 3) times a vector."""
    return (
        matrix[0, 0] * x + matrix[0, 1] * y + matrix[0, 2] * z,
        matrix[1, 0] * x + matrix[1, 1] * y + matrix[1, 2] * z,
        matrix[2, 0] * x + matrix[2, 1] * y + matrix[2, 2] * z,
    )
