"""Moments are made as asked while nothing saturates; then yaw yields first, and no limit is ever passed."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from sitl.control.allocation import LEAST_MOMENT, ROLL_WEIGHT, apart, pitch_share
from tests.sitl.control.flown import aircraft, design
from vehicle_model.force_map import COLUMNS

SLOWEST, FASTEST, AILERON = 80.0, 500.0, math.radians(25.0)
NAMES = ("roll_per_rotor", "yaw_per_rotor", "roll_per_aileron", "yaw_per_aileron")

moment = st.floats(-20.0, 20.0)
speed = st.floats(0.0, 600.0)
airspeed = st.sampled_from([0.0, 4.0, 8.0, 12.0, 16.0, 20.0, 24.0, 28.0])
CRUISE = 28.0  # [m/s]


def level_nodes() -> list[dict[str, float]]:
    """The map's nodes of level flight in a calm, unaccelerated, for forward airspeeds from 0 on."""
    table, axes = design().table, design().axes
    zero = [round(-first / step) for first, step, _ in axes[:3]]
    weight = round((-10.0 - axes[3, 0]) / axes[3, 1])
    rows = table[zero[0] :, zero[1], zero[2], weight]
    return [dict(zip(COLUMNS, row.tolist(), strict=True)) for row in rows]


def level_node(airspeed: float) -> dict[str, float]:
    """The one of them that is nearest to an airspeed [m/s]."""
    return level_nodes()[round(airspeed / design().axes[0, 1])]


def effectiveness(airspeed: float) -> np.ndarray:
    """Roll and yaw (rows) by rotors and ailerons apart (columns), of the real aircraft near an airspeed [m/s]."""
    node = level_node(airspeed)
    return np.array([[node[f"{axis}_per_{pair}"] for pair in ("rotor", "aileron")] for axis in ("roll", "yaw")])


def allotted(roll: float, yaw: float, matrix: np.ndarray, collective: float) -> tuple[float, float, float]:
    return apart(
        roll, yaw, float(matrix[0, 0]), float(matrix[1, 0]), float(matrix[0, 1]), float(matrix[1, 1]), collective,
        SLOWEST, FASTEST, AILERON,
    )  # fmt: skip


@given(moment, moment, speed, airspeed)
def test_unsaturated_the_actuators_make_the_moments_asked_for(
    roll: float, yaw: float, collective: float, airspeed: float
) -> None:
    matrix = effectiveness(airspeed)
    rotor, aileron = np.linalg.solve(matrix, [roll, yaw])
    room = min(FASTEST - collective, collective - SLOWEST)
    # Each demand by itself has to fit as well: yaw is counted on top of roll.
    assume(abs(rotor) < 0.999 * room)
    assume(abs(aileron) < 0.999 * AILERON)
    by_roll = np.linalg.solve(matrix, [roll, 0.0])
    assume(abs(by_roll[0]) < room)
    assume(abs(by_roll[1]) < AILERON)
    found = allotted(roll, yaw, matrix, collective)
    # But for the little that their use counts.
    np.testing.assert_allclose(matrix @ found[:2], [roll, yaw], rtol=0.02, atol=0.02)
    assert found[2] == pytest.approx(collective, abs=0.05 * abs(by_roll[0]) + 1e-6)


@given(st.floats(-200.0, 200.0), st.floats(-200.0, 200.0), speed, airspeed)
def test_limits_are_kept_whatever_is_asked(roll: float, yaw: float, collective: float, airspeed: float) -> None:
    rotor, aileron, common = allotted(roll, yaw, effectiveness(airspeed), collective)
    assert abs(aileron) <= AILERON * (1.0 + 1e-12)
    assert common + abs(rotor) <= FASTEST * (1.0 + 1e-12)
    assert common - abs(rotor) >= SLOWEST * (1.0 - 1e-12)


@given(moment, st.floats(-200.0, 200.0), st.floats(150.0, 420.0), airspeed)
def test_yaw_is_given_up_before_roll(roll: float, yaw: float, collective: float, airspeed: float) -> None:
    matrix = effectiveness(airspeed)
    by_roll = np.linalg.solve(matrix, [roll, 0.0])
    assume(abs(by_roll[0]) < 0.999 * min(FASTEST - collective, collective - SLOWEST))
    assume(abs(by_roll[1]) < 0.999 * AILERON)
    rotor, aileron, common = allotted(roll, yaw, matrix, collective)
    lost = matrix @ [rotor, aileron] - [roll, yaw]
    assert abs(lost[0]) <= 0.3 * abs(lost[1]) + 0.01 * abs(roll) + 1e-9
    assert common == pytest.approx(collective, abs=0.05 * abs(by_roll[0]) + 1e-6)


@given(moment, st.floats(-200.0, 200.0), st.floats(150.0, 420.0), airspeed)
def test_no_other_use_of_the_actuators_within_their_limits_is_better(
    roll: float, yaw: float, collective: float, airspeed: float
) -> None:
    """Bounded least squares by scipy, an independent solver of the same weighted problem."""
    matrix = effectiveness(airspeed)
    rotor, aileron, common = allotted(roll, yaw, matrix, collective)
    room = min(FASTEST - common, common - SLOWEST)
    weight = math.sqrt(ROLL_WEIGHT)
    use = np.diag([LEAST_MOMENT / (0.5 * (FASTEST - SLOWEST)), LEAST_MOMENT / AILERON])
    weighted, wanted = np.vstack([matrix * [[weight], [1.0]], use]), np.array([weight * roll, yaw, 0.0, 0.0])
    limits = np.array([max(room, 1e-9), AILERON])
    best = lsq_linear(weighted, wanted, bounds=(-limits, limits), tol=1e-14)
    cost = float(np.sum((weighted @ [rotor, aileron] - wanted) ** 2))
    assert cost <= 2.0 * best.cost * (1.0 + 1e-6) + 1e-6


def test_at_full_collective_the_ailerons_still_yaw() -> None:
    """In hover the rotors' small part of a yaw must not take the ailerons' large one with it."""
    matrix = effectiveness(0.0)
    rotor, aileron, _ = allotted(0.0, 0.5, matrix, FASTEST)
    made = matrix @ [rotor, aileron]
    assert made[1] > 0.25
    assert abs(made[0]) < 0.05


@pytest.mark.parametrize("collective", [SLOWEST, FASTEST])
def test_the_collective_moves_to_make_room_for_roll(collective: float) -> None:
    """In hover, where rotors roll, even with the collective at one of its ends."""
    matrix = effectiveness(0.0)
    rotor, aileron, common = allotted(5.0, 0.0, matrix, collective)
    np.testing.assert_allclose(matrix @ [rotor, aileron], [5.0, 0.0], atol=0.02)
    assert abs(common - collective) == pytest.approx(abs(rotor), rel=1e-3)


def test_with_the_ailerons_at_their_limit_the_rotors_roll_on() -> None:
    """Half-way, where both roll: what the ailerons lack of the roll asked for comes from the rotors."""
    matrix = np.array([[0.2, 20.0], [-0.3, 8.0]])
    rotor, aileron, _ = allotted(25.0, 0.0, matrix, 300.0)
    assert aileron == pytest.approx(AILERON)
    assert (matrix @ [rotor, aileron])[0] == pytest.approx(25.0, rel=0.03)


def test_rotors_and_ailerons_exchange_roll_and_yaw_between_hover_and_cruise() -> None:
    """Issue 3: what differential thrust does in hover the ailerons do in cruise, and the other way round."""
    nodes, hover, cruise = level_nodes(), level_node(0.0), level_node(CRUISE)
    assert abs(hover["roll_per_rotor"]) > 5.0 * abs(hover["yaw_per_rotor"])
    assert abs(hover["yaw_per_aileron"]) > 5.0 * abs(hover["roll_per_aileron"])
    # In cruise rotors apart also change the lift of the wing behind them, so that they roll it a little, too.
    assert abs(cruise["yaw_per_rotor"]) > 1.5 * abs(cruise["roll_per_rotor"])
    assert abs(cruise["roll_per_aileron"]) > 5.0 * abs(cruise["yaw_per_aileron"])
    # On the way what one pair loses of a moment the other gains.
    rotors = [math.atan2(node["yaw_per_rotor"], node["roll_per_rotor"]) for node in nodes]
    ailerons = [math.atan2(node["yaw_per_aileron"], node["roll_per_aileron"]) for node in nodes]
    assert min(np.diff(rotors)) > 0.0
    assert min(np.diff(ailerons)) > 0.0


def test_everywhere_in_level_flight_the_two_pairs_span_roll_and_yaw() -> None:
    """Else the allocation would divide by nothing."""
    for node in level_nodes():
        rolls = math.hypot(node["roll_per_rotor"], node["yaw_per_rotor"])
        ailerons = math.hypot(node["roll_per_aileron"], node["yaw_per_aileron"])
        determinant = (
            node["roll_per_rotor"] * node["yaw_per_aileron"] - node["yaw_per_rotor"] * node["roll_per_aileron"]
        )
        assert abs(determinant) > 0.5 * rolls * ailerons  # more than 30 deg apart


TAIL_ARM, TAIL_LIMIT, ELEVATOR = 1.28, 30.0, math.radians(25.0)


@given(st.floats(-100.0, 100.0), st.floats(-60.0, -0.01), st.floats(1.0, 200.0))
def test_elevator_and_tail_rotor_make_the_pitch_moment_together(
    pitch: float, per_elevator: float, preference: float
) -> None:
    elevator, thrust = pitch_share(pitch, per_elevator, ELEVATOR, TAIL_ARM, TAIL_LIMIT, preference)
    assert abs(elevator) <= ELEVATOR
    assert abs(thrust) <= TAIL_LIMIT
    made = per_elevator * elevator - TAIL_ARM * thrust
    if abs(thrust) < TAIL_LIMIT:
        assert made == pytest.approx(pitch, rel=1e-9, abs=1e-9)
    else:  # all that is left is asked of it
        assert abs(made) < abs(pitch) + 1e-9
        assert made * pitch >= 0.0


@given(st.floats(-5.0, 5.0), st.floats(-60.0, -5.0))
def test_the_pitch_shares_are_the_least_weighted_squares(pitch: float, per_elevator: float) -> None:
    """numpy's minimum-norm solution, with the unknowns scaled by their limits and the tail's cost by its root."""
    preference = 100.0
    elevator, thrust = pitch_share(pitch, per_elevator, ELEVATOR, TAIL_ARM, TAIL_LIMIT, preference)
    scale = np.array([ELEVATOR, TAIL_LIMIT / math.sqrt(preference)])
    shares, *_ = np.linalg.lstsq(np.array([[per_elevator, -TAIL_ARM]]) * scale, [pitch], rcond=None)
    np.testing.assert_allclose([elevator, thrust], shares * scale, rtol=1e-9, atol=1e-9)


def test_without_airflow_the_elevator_does_nothing_and_the_tail_rotor_all() -> None:
    elevator, thrust = pitch_share(3.0, 0.0, ELEVATOR, TAIL_ARM, TAIL_LIMIT, 100.0)
    assert elevator == 0.0
    assert thrust == pytest.approx(-3.0 / TAIL_ARM)


def test_the_tail_rotor_is_behind_the_centre_of_mass() -> None:
    """The arm that the sign of its thrust in `pitch_share` stands for."""
    assert design().gains[0]["tail_arm"] == pytest.approx(-aircraft().vehicle[0]["rotors"]["position"][2, 0])
    assert design().gains[0]["tail_arm"] > 0.0
