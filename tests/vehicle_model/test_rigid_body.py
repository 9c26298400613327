"""Rigid-body motion against the paper's eq. (1), closed forms and what must be conserved."""

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vehicle_model.earth import GM, J2, geodetic, local_axes, make_environment, ned_from_geodetic
from vehicle_model.records import VEHICLE
from vehicle_model.rigid_body import gravity_ned, rates_relative_to_earth, rigid_body_derivative
from vehicle_model.rotation import body_to_ned, quaternion_conjugate, quaternion_from_euler, quaternion_multiply
from vehicle_model.state import POSITION, QUATERNION, RATES, VELOCITY, blank_state

R = slice(POSITION, POSITION + 3)
V = slice(VELOCITY, VELOCITY + 3)
Q = slice(QUATERNION, QUATERNION + 4)
W = slice(RATES, RATES + 3)

INERTIA = np.array([[1.1, 0.05, -0.2], [0.05, 0.9, 0.08], [-0.2, 0.08, 1.8]])  # principal axes askew
LATITUDE, LONGITUDE = 0.7, -0.4
Earth = Literal["flat", "round", "wgs84"]


def sea_level(earth: Earth) -> np.ndarray:
    return make_environment(earth, latitude=LATITUDE, longitude=LONGITUDE, height_ellipsoid=0.0)


def body(mass: float = 12.0, inertia: np.ndarray = INERTIA) -> np.ndarray:
    vehicle = np.zeros(1, VEHICLE)
    vehicle["mass"] = mass
    vehicle["inertia"] = inertia
    vehicle["inertia_inverse"] = np.linalg.inv(inertia)
    return vehicle


def tumbling() -> np.ndarray:
    state = blank_state()
    state[V] = 12.0, -3.0, 4.0
    state[Q] = quaternion_from_euler(0.4, -0.3, 2.0)
    state[W] = 1.5, -2.0, 0.7
    return state


def rate_of(state: np.ndarray, vehicle: np.ndarray, env: np.ndarray, loads: Sequence[float] = (0.0,) * 6) -> np.ndarray:
    rate = np.zeros(len(state))
    fx, fy, fz, mx, my, mz = loads
    rigid_body_derivative(state, fx, fy, fz, mx, my, mz, vehicle[0], env[0], rate)
    return rate


def to_ned(state: np.ndarray, vector: np.ndarray) -> np.ndarray:
    q0, q1, q2, q3 = state[Q]
    x, y, z = vector
    return np.array(body_to_ned(q0, q1, q2, q3, x, y, z))


def fly(state: np.ndarray, vehicle: np.ndarray, env: np.ndarray, dt: float, steps: int) -> np.ndarray:
    """The textbook Runge-Kutta 4, without forces but gravity."""
    for _ in range(steps):
        k1 = rate_of(state, vehicle, env)
        k2 = rate_of(state + 0.5 * dt * k1, vehicle, env)
        k3 = rate_of(state + 0.5 * dt * k2, vehicle, env)
        k4 = rate_of(state + dt * k3, vehicle, env)
        state = state + dt / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return state


number = st.floats(-50.0, 50.0)
small = st.floats(-3.0, 3.0)


@given(st.tuples(*[number] * 3), st.tuples(*[small] * 3), st.tuples(*[number] * 6), st.tuples(*[small] * 3))
def test_on_a_flat_earth_it_is_the_papers_equation_1(
    velocity: tuple[float, ...], rates: tuple[float, ...], loads: tuple[float, ...], attitude: tuple[float, ...]
) -> None:
    mass, ixx, iyy, izz, g = 12.0, 1.0, 0.9, 1.8, 9.80665
    env = sea_level("flat")
    state = blank_state()
    state[V], state[W], state[Q] = velocity, rates, quaternion_from_euler(*attitude)
    (u, v, w), (p, q, r), (phi, theta, _) = velocity, rates, attitude
    x, y, z, mx, my, mz = loads
    # Weight in body axes as any text gives it, the rest term by term from the paper.
    x += -mass * g * math.sin(theta)
    y += mass * g * math.cos(theta) * math.sin(phi)
    z += mass * g * math.cos(theta) * math.cos(phi)
    rate = rate_of(state, body(mass, np.diag([ixx, iyy, izz])), env, loads)
    expected_v = v * r - w * q + x / mass, w * p - u * r + y / mass, u * q - v * p + z / mass
    np.testing.assert_allclose(rate[V], expected_v, atol=1e-11)
    expected_w = (
        (iyy - izz) * q * r / ixx + mx / ixx,
        (izz - ixx) * p * r / iyy + my / iyy,
        (ixx - iyy) * p * q / izz + mz / izz,
    )
    np.testing.assert_allclose(rate[W], expected_w, atol=1e-11)


def test_quaternion_does_not_change_length() -> None:
    env = sea_level("wgs84")
    state = tumbling()
    assert abs(np.dot(state[Q], rate_of(state, body(), env)[Q])) < 1e-15


@pytest.mark.parametrize("earth", ["flat", "round", "wgs84"])
def test_without_torque_angular_momentum_in_space_and_rotational_energy_stay(earth: Earth) -> None:
    env = sea_level(earth)
    dt, steps = 0.002, 5000

    def momentum_and_energy(state: np.ndarray, time: float) -> np.ndarray:
        momentum = INERTIA @ state[W]
        ned = to_ned(state, momentum)
        # From the turning NED frame to one that kept still since the start: a turn by Omega t about Omega.
        turn = env["rotation_ned"][0]
        speed = float(np.linalg.norm(turn))
        if speed > 0.0:
            axis, angle = turn / speed, speed * time
            ned = (
                ned * math.cos(angle) + np.cross(axis, ned) * math.sin(angle)
                + axis * np.dot(axis, ned) * (1.0 - math.cos(angle))
            )  # fmt: skip
        return np.append(ned, 0.5 * np.dot(state[W], momentum))

    start = tumbling()
    end = fly(start, body(), env, dt, steps)
    assert not np.allclose(end[W], start[W], atol=0.1)  # it did tumble
    np.testing.assert_allclose(
        momentum_and_energy(end, dt * steps), momentum_and_energy(start, 0.0), rtol=0.0, atol=1e-8
    )


def test_a_tumbling_body_on_a_flat_earth_falls_along_the_parabola() -> None:
    env = sea_level("flat")
    state = tumbling()
    v0 = to_ned(state, state[V])
    end = fly(state, body(), env, 0.005, 1000)
    np.testing.assert_allclose(end[R], v0 * 5.0 + [0.0, 0.0, 0.5 * 9.80665 * 25.0], atol=1e-6)


def test_a_body_dropped_on_the_equator_lands_east_by_the_coriolis_closed_form() -> None:
    env = make_environment("round", latitude=0.0, longitude=1.0, height_ellipsoid=5000.0)
    end = fly(blank_state(), body(), env, 0.05, 600)
    omega, t = 7.292115e-5, 30.0
    g = gravity_ned(0.0, 0.0, 0.0, env[0])[2]
    assert end[1] == pytest.approx(omega * g * t**3 / 3.0, rel=2e-3)  # first order in omega t and in fall over radius
    assert end[0] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(("latitude", "side"), [(0.9, 1.0), (-0.9, -1.0)])
def test_a_throw_bends_right_in_the_north_and_left_in_the_south(latitude: float, side: float) -> None:
    env = make_environment("wgs84", latitude=latitude, longitude=0.0, height_ellipsoid=0.0)
    state = blank_state()
    state[VELOCITY] = 300.0
    end = fly(state, body(), env, 0.01, 100)
    expected = 7.292115e-5 * math.sin(0.9) * 300.0 * side  # Omega sin(latitude) V t^2
    falling = 7.292115e-5 * math.cos(0.9) * 9.8 / 3.0  # eastward, as of any falling body
    assert end[1] == pytest.approx(expected + falling, rel=1e-3)


@pytest.mark.parametrize("rotating", [False, True])
def test_a_circular_orbit_closes_after_keplers_period(rotating: bool) -> None:
    radius = 6371007.1809 + 400e3
    env = make_environment("round", latitude=0.0, longitude=0.0, height_ellipsoid=400e3, rotating=rotating)
    omega = 7.292115e-5 if rotating else 0.0
    period = 2.0 * math.pi * math.sqrt(radius**3 / GM)
    state = blank_state()
    state[VELOCITY + 1] = math.sqrt(GM / radius) - omega * radius  # eastward
    steps = 2000
    end = fly(state, body(), env, period / steps, steps)
    # Back at the same place in space, the Earth has turned east below: seen from it the body lags by Omega T.
    angle = -omega * period
    expected = 0.0, radius * math.sin(angle), radius * (1.0 - math.cos(angle))
    np.testing.assert_allclose(end[R], expected, atol=1.0)  # a metre in 42 000 km


def test_on_the_rotating_ellipsoid_jacobis_integral_stays() -> None:
    env = sea_level("wgs84")
    centre, turn = env["centre_ned"][0], env["rotation_ned"][0]

    def jacobi(state: np.ndarray) -> float:
        r = state[R] - centre
        distance = float(np.linalg.norm(r))
        z = float(np.dot(turn, r) / np.linalg.norm(turn))
        potential = GM / distance * (1.0 - J2 * (6378137.0 / distance) ** 2 * (1.5 * (z / distance) ** 2 - 0.5))
        centrifugal = 0.5 * float(np.sum(np.cross(turn, r) ** 2))
        return 0.5 * float(np.dot(state[V], state[V])) - potential - centrifugal

    start = tumbling()
    start[V] = 2000.0, 3000.0, -4000.0
    start[W] *= 0.1  # the velocity in body axes turns as fast, and Runge-Kutta's error grows by the fifth power of that
    end = fly(start, body(), env, 0.01, 6000)
    assert np.linalg.norm(end[R]) > 1e5  # high up and far away
    assert abs(end[POSITION + 2] - start[POSITION + 2]) > 5e4
    assert jacobi(end) == pytest.approx(jacobi(start), abs=1e-4)  # of 5e7 m^2/s^2


def test_a_body_at_rest_in_space_turns_against_the_earth() -> None:
    env = sea_level("wgs84")
    state = blank_state()
    state[Q] = quaternion_from_euler(0.3, 0.2, 1.0)
    relative = to_ned(state, np.array(rates_relative_to_earth(state, env[0])))
    expected = -7.292115e-5 * np.array([math.cos(0.7), 0.0, -math.sin(0.7)])
    np.testing.assert_allclose(relative, expected, atol=1e-18)


@given(st.tuples(*[number] * 3), st.tuples(*[small] * 3), st.tuples(*[number] * 6), st.tuples(*[small] * 3))
def test_the_mirror_image_of_a_flight_is_a_flight(
    velocity: tuple[float, ...], rates: tuple[float, ...], loads: tuple[float, ...], attitude: tuple[float, ...]
) -> None:
    symmetric = np.array([[1.1, 0.0, -0.2], [0.0, 0.9, 0.0], [-0.2, 0.0, 1.8]])
    env = sea_level("flat")
    vector, turn = np.array([1.0, -1.0, 1.0]), np.array([-1.0, 1.0, -1.0])
    right, left = blank_state(), blank_state()
    right[V], right[W], right[Q] = velocity, rates, quaternion_from_euler(*attitude)
    left[V], left[W], left[Q] = vector * velocity, turn * rates, quaternion_from_euler(*(turn * attitude))
    right_rate = rate_of(right, body(inertia=symmetric), env, loads)
    left_rate = rate_of(left, body(inertia=symmetric), env, list(loads * np.append(vector, turn)))
    np.testing.assert_allclose(left_rate[R], vector * right_rate[R], atol=1e-11)
    np.testing.assert_allclose(left_rate[V], vector * right_rate[V], atol=1e-11)
    np.testing.assert_allclose(left_rate[W], turn * right_rate[W], atol=1e-11)
    np.testing.assert_allclose(left_rate[Q], np.append(1.0, turn) * right_rate[Q], atol=1e-11)


def test_the_choice_of_origin_does_not_change_the_motion() -> None:
    here = sea_level("wgs84")
    there = make_environment("wgs84", latitude=0.72, longitude=-0.38, height_ellipsoid=2000.0)
    state = tumbling()
    other = state.copy()
    north, east, down = ned_from_geodetic(LATITUDE, LONGITUDE, 0.0, there[0])
    other[R] = north, east, down
    # The same attitude against the local axes, which here are those of the first origin.
    to_there = quaternion_conjugate(*local_axes(north, east, down, there[0]))
    q0, q1, q2, q3 = state[Q]
    other[Q] = quaternion_multiply(*to_there, q0, q1, q2, q3)
    end, other_end = fly(state, body(), here, 0.02, 500), fly(other, body(), there, 0.02, 500)
    place = geodetic(end[0], end[1], end[2], here[0])
    other_place = geodetic(other_end[0], other_end[1], other_end[2], there[0])
    np.testing.assert_allclose(np.subtract(other_place, place) * [6.4e6, 6.4e6, 1.0], 0.0, atol=2e-7)
    np.testing.assert_allclose(other_end[V], end[V], atol=1e-8)
    np.testing.assert_allclose(other_end[W], end[W], atol=1e-12)
