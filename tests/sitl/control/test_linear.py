"""Linear models against the continuous ones of `vehicle_model`, loops against those written out by hand."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from sitl.control.linear import (
    CHART,
    LinearSystem,
    chart_from_state,
    close_loop,
    differentiate,
    linear_plant,
    margins_of,
    state_from_chart,
)
from vehicle_model.aircraft import load_aircraft
from vehicle_model.linearise import linearise
from vehicle_model.rotation import quaternion_from_euler
from vehicle_model.state import QUATERNION, RATES
from vehicle_model.trim import still_air, trim_level

DT = 0.0025
AIRCRAFT = load_aircraft()
KP, KD = 4.0, 3.0


def double_integrator() -> LinearSystem:
    """Position and velocity of a unit mass under a force held for a tick; both are read."""
    a = np.array([[1.0, DT], [0.0, 1.0]])
    b = np.array([[0.5 * DT**2], [DT]])
    return LinearSystem(a, b, np.eye(2), np.zeros((2, 1)), ("force",), ("position", "velocity"))


def proportional_derivative() -> LinearSystem:
    none = np.zeros((0, 0))
    gains = -np.array([[KP, KD]])
    return LinearSystem(none, np.zeros((0, 2)), np.zeros((1, 0)), gains, ("position", "velocity"), ("force",))


def integrating(gain: float) -> LinearSystem:
    """The same with an integral of position in its memory."""
    c, gains = np.array([[-gain]]), -np.array([[KP, KD]])
    b = np.array([[DT, 0.0]])
    return LinearSystem(np.eye(1), b, c, gains, ("position", "velocity"), ("force",))


def transfers(omega: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    z = np.exp(1j * omega * DT)
    return z, 0.5 * DT**2 * (z + 1.0) / (z - 1.0) ** 2, DT / (z - 1.0)


def opened(system, name: str, omega: np.ndarray) -> np.ndarray:
    return (1.0 / system.sensitivity(omega, [name]) - 1.0)[:, 0, 0]


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_loops_are_those_of_the_transfer_functions(delay: int) -> None:
    system = close_loop(double_integrator(), integrating(0.5), DT, delay=delay)
    omega = np.geomspace(0.1, 1000.0, 50)
    z, position, velocity = transfers(omega)
    late = z**-delay
    by_position = (KP + 0.5 * DT / (z - 1.0)) * position * late
    by_velocity = KD * velocity * late
    np.testing.assert_allclose(opened(system, "force", omega), by_position + by_velocity, rtol=1e-9)
    np.testing.assert_allclose(opened(system, "position", omega), by_position / (1.0 + by_velocity), rtol=1e-9)
    np.testing.assert_allclose(opened(system, "velocity", omega), by_velocity / (1.0 + by_position), rtol=1e-9)


def test_opened_together_the_sensitivity_is_that_of_both() -> None:
    system = close_loop(double_integrator(), proportional_derivative(), DT)
    omega = np.array([1.0, 10.0])
    _, position, velocity = transfers(omega)
    found = system.sensitivity(omega, ["position", "velocity"])
    for k in range(2):
        plant = np.array([[position[k]], [velocity[k]]])
        expected = np.linalg.inv(np.eye(2) + plant @ np.array([[KP, KD]]))
        np.testing.assert_allclose(found[k], expected, rtol=1e-9)


def test_margins_are_those_of_the_double_integrator() -> None:
    single, _ = margins_of(close_loop(double_integrator(), proportional_derivative(), DT))
    # continuous: |L| = 1 at w^4 = kp^2 + kd^2 w^2, phase margin atan(kd w/kp), less half a tick of the hold
    crossover = math.sqrt((KD**2 + math.sqrt(KD**4 + 4.0 * KP**2)) / 2.0)
    assert single["force"].crossover == pytest.approx(crossover, rel=1e-3)
    assert single["force"].phase == pytest.approx(math.atan(KD * crossover / KP) - crossover * DT / 2.0, rel=1e-3)
    # at z = -1 position is not felt and velocity as -dt/2: L = -kd dt/2
    assert single["force"].gain_up == pytest.approx(2.0 / (KD * DT), rel=1e-3)


def test_one_tick_of_delay_costs_its_phase_at_every_crossover() -> None:
    now, _ = margins_of(close_loop(double_integrator(), proportional_derivative(), DT))
    late, _ = margins_of(close_loop(double_integrator(), proportional_derivative(), DT, delay=1))
    assert now["force"].phase - late["force"].phase == pytest.approx(now["force"].crossover * DT, rel=1e-3)
    assert now["force"].delay - late["force"].delay == pytest.approx(DT, rel=1e-3)


def test_poles_are_those_of_the_characteristic_polynomial() -> None:
    system = close_loop(double_integrator(), proportional_derivative(), DT)
    a = np.array([[1.0, DT], [0.0, 1.0]]) - np.array([[0.5 * DT**2], [DT]]) @ np.array([[KP, KD]])
    np.testing.assert_allclose(np.sort_complex(system.poles), np.sort_complex(np.linalg.eigvals(a)), rtol=1e-12)
    assert system.growth == pytest.approx(-1.5, rel=0.01)  # s^2 + 3 s + 4


def test_what_no_signal_reaches_or_shows_is_left_out() -> None:
    plant = double_integrator()
    a = np.zeros((4, 4))
    a[:2, :2] = plant.a
    a[2, 2], a[2, 1] = 1.0, DT  # a distance that nobody reads
    a[3, 3], a[1, 3] = 1.02, 1.0  # something growing that nothing moves
    wide = LinearSystem(
        a, np.vstack([plant.b, np.zeros((2, 1))]), np.hstack([plant.c, np.zeros((2, 2))]), plant.d, plant.inputs,
        plant.outputs,
    )  # fmt: skip
    found = close_loop(wide, proportional_derivative(), DT)
    assert len(found.poles) == 2
    assert found.growth < 0.0


def test_a_signal_that_is_not_used_has_no_margins() -> None:
    controller = proportional_derivative()
    gains = np.array([[-KP, -KD, 0.0]])
    plant = double_integrator()
    reads = (*plant.outputs, "spare")
    plant = LinearSystem(plant.a, plant.b, np.vstack([plant.c, [1.0, 0.0]]), np.zeros((3, 1)), plant.inputs, reads)
    controller = LinearSystem(controller.a, np.zeros((0, 3)), controller.c, gains, reads, controller.outputs)
    single, together = margins_of(close_loop(plant, controller, DT), [["force"], ["position", "velocity"]])
    assert set(single) == {"position", "velocity", "force"}
    assert together[0] == pytest.approx(single["force"].disk, rel=1e-3)
    assert together[1] <= min(single["position"].disk, single["velocity"].disk)


def test_controller_of_another_plant_is_refused() -> None:
    with pytest.raises(ValueError, match="expected the controller from"):
        close_loop(linear_hover(), proportional_derivative(), DT)


def test_central_differences_are_exact_for_a_parabola() -> None:
    jacobian, deviation = differentiate(
        lambda x: np.array([x[0] ** 2 + 3.0 * x[1], x[1] * x[0]]), np.array([2.0, 5.0]), np.array([1e-3, 1e-3])
    )
    np.testing.assert_allclose(jacobian, [[4.0, 3.0], [5.0, 2.0]], rtol=1e-9)
    assert (deviation < 1e-3).all()


@pytest.mark.parametrize(
    "function", [lambda x: np.minimum(x, 1e-4), lambda x: np.maximum(x, 0.0), lambda x: np.clip(x, -1e-4, 1e-4)]
)
def test_a_limit_within_the_step_shows(function: Callable[[np.ndarray], np.ndarray]) -> None:
    _, deviation = differentiate(function, np.array([0.0]), np.array([1e-3]))
    assert deviation[0] > 0.5


def linear_hover() -> LinearSystem:
    trim = trim_level(AIRCRAFT, 0.0)
    return linear_plant(AIRCRAFT.vehicle, still_air(), trim.state, trim.controls, DT)


@pytest.mark.parametrize("airspeed", [0.5, 8.0, 16.0, 30.0])
def test_plant_has_the_modes_of_the_continuous_model(airspeed: float) -> None:
    trim = trim_level(AIRCRAFT, airspeed)
    plant = linear_plant(AIRCRAFT.vehicle, still_air(), trim.state, trim.controls, DT)
    found = np.log(np.linalg.eigvals(plant.a)) / DT
    for root in np.linalg.eigvals(linearise(AIRCRAFT, trim).a):
        # the phugoid feels the air's density change with height, which the continuous model leaves out
        assert np.abs(found - root).min() < 2e-3 * abs(root) + 1e-3


def test_servos_lag_as_their_file_says() -> None:
    plant = linear_hover()
    for name, servo in zip(CHART[-4:], AIRCRAFT.vehicle[0]["servos"], strict=True):
        i, j = CHART.index(name), plant.inputs.index(name)
        lag = math.exp(-DT / servo["time_constant"])
        assert plant.a[i, i] == pytest.approx(lag, rel=1e-6)
        assert plant.b[i, j] == pytest.approx(1.0 - lag, rel=1e-5)


def test_airflow_is_read_beside_the_motion_over_the_ground() -> None:
    trim = trim_level(AIRCRAFT, 20.0)
    plant = linear_plant(AIRCRAFT.vehicle, still_air(), trim.state, trim.controls, DT)
    for airflow, motion in (("air_north", "vn"), ("air_east", "ve"), ("air_down", "vd")):
        row = plant.c[plant.outputs.index(airflow)]
        np.testing.assert_array_equal(row, np.eye(len(CHART))[CHART.index(motion)])


def test_coordinates_and_state_are_one_another_s_inverse() -> None:
    state = np.linspace(-1.0, 1.0, 20)
    state[QUATERNION:RATES] = quaternion_from_euler(-0.4, 0.3, 2.0)
    chart = chart_from_state(state)
    np.testing.assert_allclose(chart[6:9], [-0.4, 0.3, 2.0], rtol=1e-12)
    np.testing.assert_allclose(state_from_chart(chart), state, rtol=1e-12, atol=1e-14)
