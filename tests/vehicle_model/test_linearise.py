"""Linear models against closed forms and another differencing; modes against what their formulas say and Table 1."""

import math

import numpy as np
import pytest
from scipy.linalg import block_diag, expm

from vehicle_model.aircraft import load_aircraft
from vehicle_model.elevator_step import stepped_controls
from vehicle_model.integrate import observe, time_history
from vehicle_model.linearise import HOLDS, Hold, LinearModel, Mode, linearise, modes
from vehicle_model.records import OUTPUTS
from vehicle_model.rotation import euler_from_quaternion, quaternion_from_euler
from vehicle_model.state import ELEVATOR, QUATERNION, RATES, ROTOR_SPEED, STATE_COUNT, VELOCITY
from vehicle_model.trim import still_air, trim_level

G = 9.80665
AIRCRAFT = load_aircraft()
CRUISE = trim_level(AIRCRAFT, 30.0)
MODELS = {hold: linearise(AIRCRAFT, CRUISE, hold) for hold in HOLDS}
THROTTLE = MODELS["throttle"]
STATES = ("u", "v", "w", "p", "q", "r", "phi", "theta", "rotor_left", "rotor_right", "rotor_tail")


def element(model: LinearModel, row: str, column: str) -> float:
    return float(model.a[model.state_names.index(row), model.state_names.index(column)])


def derivative_of(x: np.ndarray) -> np.ndarray:
    """Rates of the eleven states with the throttles held, from the equations of motion."""
    state = CRUISE.state.copy()
    state[VELOCITY : VELOCITY + 3], state[RATES : RATES + 3] = x[0:3], x[3:6]
    state[QUATERNION : QUATERNION + 4] = quaternion_from_euler(x[6], x[7], 0.0)
    state[ROTOR_SPEED : ROTOR_SPEED + 3] = x[8:11]
    outputs, rate = np.zeros(1, OUTPUTS), np.empty(STATE_COUNT)
    observe(state, CRUISE.controls, AIRCRAFT.vehicle, still_air(), outputs, rate)
    _, q, r = x[3:6]
    phi, theta = x[6:8]
    euler = (x[3] + (q * math.sin(phi) + r * math.cos(phi)) * math.tan(theta), q * math.cos(phi) - r * math.sin(phi))
    return np.concatenate(
        [rate[VELOCITY : VELOCITY + 3], rate[RATES : RATES + 3], euler, rate[ROTOR_SPEED : ROTOR_SPEED + 3]]
    )


@pytest.mark.parametrize("hold", HOLDS)
def test_gravity_and_kinematics_have_their_closed_forms(hold: Hold) -> None:
    model = MODELS[hold]
    assert element(model, "u", "theta") == pytest.approx(-G, rel=1e-6)
    assert element(model, "w", "theta") == pytest.approx(0.0, abs=1e-6)  # -g sin theta
    assert element(model, "v", "phi") == pytest.approx(G, rel=1e-6)
    assert element(model, "theta", "q") == pytest.approx(1.0, rel=1e-9)
    assert element(model, "phi", "p") == pytest.approx(1.0, rel=1e-9)
    assert element(model, "phi", "r") == pytest.approx(0.0, abs=1e-9)  # tan theta
    for name in ("u", "v", "w", "phi", "theta"):
        assert element(model, "theta", name) == pytest.approx(0.0, abs=1e-9)
        assert element(model, "q", "theta") == pytest.approx(0.0, abs=1e-4)


def test_turning_axes_appear_with_the_trims_velocity() -> None:
    # W' = U Q + ..., V' = -U R + ...: what is left is small beside the 30 m/s.
    assert element(THROTTLE, "w", "q") == pytest.approx(30.0, rel=0.1)
    assert element(THROTTLE, "v", "r") == pytest.approx(-30.0, rel=0.1)


def test_agrees_with_fourth_order_differences_at_other_step_sizes() -> None:
    assert THROTTLE.state_names == STATES
    centre = np.concatenate([[30.0, 0.0, 0.0], np.zeros(5), CRUISE.state[ROTOR_SPEED : ROTOR_SPEED + 3]])
    scale = np.array([1.0, 1.0, 1.0, 0.1, 0.1, 0.1, 0.1, 0.1, 10.0, 10.0, 10.0])
    for size in (1e-3, 4e-3):
        columns = []
        for j in range(11):
            h = np.zeros(11)
            h[j] = size * scale[j]
            near = derivative_of(centre + h) - derivative_of(centre - h)
            far = derivative_of(centre + 2.0 * h) - derivative_of(centre - 2.0 * h)
            columns.append((8.0 * near - far) / (12.0 * h[j]))
        other = np.column_stack(columns)
        difference = (other - THROTTLE.a) * scale / scale[:, None]
        assert np.abs(difference).max() < 1e-4 * np.abs(THROTTLE.a * scale / scale[:, None]).max()


def test_longitudinal_and_lateral_motion_are_apart_and_keep_the_eigenvalues() -> None:
    full = np.linalg.eigvals(THROTTLE.a)
    part = THROTTLE.longitudinal()
    assert part.state_names == ("u", "w", "q", "theta", "rotor_wing", "rotor_tail")
    for value in np.linalg.eigvals(part.a):
        # The tail propeller's torque, alone on its side, couples the two a little.
        assert np.abs(full - value).min() < 1e-2 * (1.0 + abs(value))


def test_rpm_held_is_throttle_held_with_rotors_that_cannot_change() -> None:
    rigid = [THROTTLE.state_names.index(name) for name in MODELS["rpm"].state_names]
    difference = np.abs(THROTTLE.a[np.ix_(rigid, rigid)] - MODELS["rpm"].a)
    # The motors' reaction follows their torque, which with the speed held is the propeller's.
    lateral = [MODELS["rpm"].state_names.index(name) for name in ("p", "r")]
    difference[lateral] = 0.0
    assert difference.max() < 1e-4


def test_held_power_and_thrust_are_held() -> None:
    outputs, rate = np.zeros(1, OUTPUTS), np.empty(STATE_COUNT)
    change = 0.5  # [m/s]
    # X_u with thrust held is that of drag alone: from X_u at held RPM take away the thrust's own fall.
    state = CRUISE.state.copy()
    slopes = []
    for sign in (1.0, -1.0):
        state[VELOCITY] = 30.0 + sign * change
        observe(state, CRUISE.controls, AIRCRAFT.vehicle, still_air(), outputs, rate)
        slopes.append(float(outputs["rotor_force_body"][0, :2, 0].sum()))
    thrust_slope = (slopes[0] - slopes[1]) / (2.0 * change) / float(AIRCRAFT.vehicle["mass"][0])
    assert thrust_slope < 0.0
    x_u = {hold: element(MODELS[hold], "u", "u") for hold in ("rpm", "power", "thrust")}
    # The slipstream's drag changes with the rotor speed too, so this is an estimate.
    assert x_u["thrust"] - x_u["rpm"] == pytest.approx(-thrust_slope, rel=0.3)
    assert x_u["rpm"] < x_u["power"] < x_u["thrust"] < 0.0


def test_linear_response_is_the_small_response_of_the_nonlinear_model() -> None:
    step = math.radians(0.02)
    state = CRUISE.state.copy()
    state[ELEVATOR] += step  # already there: the linear model leaves out the servo
    flown = np.empty((4000, STATE_COUNT))
    schedule = np.tile(stepped_controls(AIRCRAFT, CRUISE, step), (4000, 1))
    time_history(state, schedule, AIRCRAFT.vehicle, still_air(), 1.0 / 400.0, 1, flown)
    theta = np.array([euler_from_quaternion(*row[QUATERNION : QUATERNION + 4])[1] for row in flown])
    model = THROTTLE.longitudinal()
    n = len(model.state_names)
    block = np.zeros((n + 1, n + 1))
    block[:n, :n], block[:n, n] = model.a, model.b * step
    turn, x = expm(block / 400.0), np.append(np.zeros(n), 1.0)
    linear = np.empty((4000, n + 1))
    for row in linear:
        row[:] = x
        x = turn @ x
    responses = {"u": flown[:, VELOCITY] - 30.0, "w": flown[:, VELOCITY + 2], "q": flown[:, RATES + 1], "theta": theta}
    for name, response in responses.items():
        ours = linear[:, model.state_names.index(name)]
        assert np.abs(response - ours).max() < 0.01 * np.abs(ours).max(), name


def test_elevator_moves_the_surface_and_in_hover_the_tail_rotor() -> None:
    assert THROTTLE.b[STATES.index("q")] < -1.0
    hover = linearise(AIRCRAFT, trim_level(AIRCRAFT, 0.0), "throttle")
    assert hover.b[STATES.index("q")] == pytest.approx(0.0, abs=1e-6)  # no air over the surface
    assert hover.b[STATES.index("rotor_tail")] > 100.0  # but a motor that runs up
    held = linearise(AIRCRAFT, trim_level(AIRCRAFT, 0.0), "rpm")
    assert held.b[held.state_names.index("q")] < -1.0


# Modes.

TABLE_1 = {"short_period": complex(-2.6766, 10.7711), "phugoid": complex(-0.0626, 0.4481)}
POLYNOMIAL = [1.0, 5.4784, 124.0557, 16.5181, 25.2166]  # of the paper's A, from Table 1


def pair(value: complex) -> np.ndarray:
    """Real matrix with this eigenvalue and its conjugate."""
    return np.array([[value.real, value.imag], [-value.imag, value.real]])


def synthetic() -> LinearModel:
    """Table 1 in (w, q) and (u, theta); Dutch roll in (v, r), roll in p, spiral in phi; a little of all in each."""
    blocks = [pair(TABLE_1["short_period"]), pair(TABLE_1["phugoid"]), pair(-1.2 + 6.0j), [[-9.0]], [[0.03]]]
    names = ("w", "q", "u", "theta", "v", "r", "p", "phi")
    mix = np.eye(8) + 0.02 * np.random.default_rng(2).standard_normal((8, 8))
    a = mix @ np.asarray(block_diag(*blocks)) @ np.linalg.inv(mix)
    order = [names.index(name) for name in ("u", "v", "w", "p", "q", "r", "phi", "theta")]
    return LinearModel(("u", "v", "w", "p", "q", "r", "phi", "theta"), a[np.ix_(order, order)], np.zeros(8), "rpm", 0.1)


def test_modes_are_named_by_the_states_that_take_part() -> None:
    found = {mode.name: complex(mode.real, mode.imag) for mode in modes(synthetic())}
    assert set(found) == {"short_period", "phugoid", "dutch_roll", "roll", "spiral"}
    expected = {**TABLE_1, "dutch_roll": -1.2 + 6.0j, "roll": -9.0 + 0.0j, "spiral": 0.03 + 0.0j}
    for name, value in expected.items():
        assert found[name] == pytest.approx(value, abs=1e-9)
    sizes = [mode.omega for mode in modes(synthetic())]
    assert sizes == sorted(sizes, reverse=True)


def test_the_four_longitudinal_roots_have_the_papers_characteristic_polynomial() -> None:
    roots = [complex(mode.real, mode.imag) for mode in modes(synthetic()) if mode.name in TABLE_1]
    found = np.poly([*roots, *np.conj(roots)]).real
    assert found == pytest.approx(POLYNOMIAL, rel=1e-4)


def test_frequency_damping_period_and_time_to_half_are_those_derived_from_table_1() -> None:
    short_period, phugoid = (Mode(name, value.real, value.imag) for name, value in TABLE_1.items())
    assert short_period.omega == pytest.approx(11.0987, abs=1e-4)
    assert short_period.damping == pytest.approx(0.24116, abs=1e-5)  # the paper prints 2.41
    assert short_period.period == pytest.approx(0.583, abs=5e-4)
    assert short_period.time_to_half == pytest.approx(0.259, abs=5e-4)
    assert phugoid.omega == pytest.approx(0.45245, abs=1e-5)
    assert phugoid.damping == pytest.approx(0.13836, abs=1e-5)
    assert phugoid.period == pytest.approx(14.02, abs=5e-3)
    assert phugoid.time_to_half == pytest.approx(11.07, abs=5e-3)


def test_a_mode_without_oscillation_has_no_period_and_a_growing_one_a_negative_time_to_half() -> None:
    growing = Mode("spiral", 0.05, 0.0)
    assert growing.period == math.inf
    assert growing.time_to_half == pytest.approx(-math.log(2.0) / 0.05)
    assert growing.damping == -1.0
    neutral = Mode("neutral", 0.0, 0.0)
    assert (neutral.damping, neutral.time_to_half, neutral.omega) == (0.0, math.inf, 0.0)


def test_the_aircraft_in_cruise_has_the_five_classical_modes() -> None:
    for hold in HOLDS:
        names = [mode.name for mode in modes(MODELS[hold])]
        for name in ("short_period", "phugoid", "dutch_roll", "roll", "spiral"):
            assert names.count(name) == 1, (hold, names)
        assert names.count("rotor") == (3 if hold == "throttle" else 0)


@pytest.mark.parametrize("name", ["short_period", "phugoid"])
def test_poles_at_30_m_s_are_the_papers_within_2_percent(name: str) -> None:
    found = next(mode for mode in modes(THROTTLE) if mode.name == name)
    assert found.real == pytest.approx(TABLE_1[name].real, rel=0.02)
    assert found.imag == pytest.approx(TABLE_1[name].imag, rel=0.02)


def test_phugoid_is_near_lanchesters() -> None:
    found = next(mode for mode in modes(THROTTLE) if mode.name == "phugoid")
    assert found.omega == pytest.approx(math.sqrt(2.0) * G / 30.0, rel=0.1)


def test_in_hover_the_classical_names_are_not_given() -> None:
    found = {mode.name for mode in modes(linearise(AIRCRAFT, trim_level(AIRCRAFT, 0.0)))}
    assert found <= {"longitudinal", "lateral", "rotor"}
