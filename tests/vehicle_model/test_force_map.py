"""The force map against the model it inverts: forces, trims, what each actuator does, and that it is one branch."""

import functools
import math

import numpy as np
import pytest

from sitl.control.design import design_for
from sitl.control.lookup import map_lookup
from vehicle_model.aircraft import Aircraft, load_aircraft
from vehicle_model.authority import speed_at
from vehicle_model.earth import STANDARD_GRAVITY
from vehicle_model.force_map import (
    COLUMNS,
    FLAP_SHARE,
    SEA_LEVEL_DENSITY,
    STALL_MARGIN,
    force_grid,
    force_map,
    point_loads,
    stall_speed,
)
from vehicle_model.loads import describe_parts, vehicle_loads
from vehicle_model.records import OUTPUTS
from vehicle_model.state import AILERON_LEFT, ELEVATOR, QUATERNION, RATES, ROTOR_SPEED, STATE_COUNT, TILT, VELOCITY
from vehicle_model.trim import balance_motors, still_air, trim_level

AXES = force_grid(load_aircraft())
REACHED = 0.05  # [m/s^2]


@functools.cache
def aircraft() -> Aircraft:
    return load_aircraft()


@functools.cache
def table() -> np.ndarray:
    """The whole map, as the design keeps it on disk."""
    design = design_for(aircraft())
    np.testing.assert_array_equal(design.axes, AXES)
    return design.table


def column(name: str) -> np.ndarray:
    return table()[..., COLUMNS.index(name)]


def wanted(axis: int) -> np.ndarray:
    """What the nodes ask for along an axis of the grid, to be broadcast over the table."""
    values = AXES[axis, 0] + AXES[axis, 1] * np.arange(int(AXES[axis, 2]))
    return values.reshape([-1 if k == axis else 1 for k in range(4)])


def reached() -> np.ndarray:
    forward = np.abs(column("force_forward") - wanted(2)) < REACHED
    return forward & (np.abs(column("force_down") - wanted(3)) < REACHED)


def level(name: str) -> np.ndarray:
    """A column along the airspeed, in a calm, unaccelerated, carrying a little more than the weight."""
    zero = [round(-AXES[k, 0] / AXES[k, 1]) for k in (1, 2)]
    return column(name)[:, zero[0], zero[1], round((-10.0 - AXES[3, 0]) / AXES[3, 1])]


def level_airspeeds() -> np.ndarray:
    return wanted(0).ravel()


def node_at(airspeed: float) -> int:
    """Index along the airspeed of the node nearest to one [m/s]."""
    return int(np.abs(level_airspeeds() - airspeed).argmin())


def test_stall_speed_is_where_the_wing_at_its_greatest_lift_carries_the_weight() -> None:
    """Found again by flying the wing, rotors stopped, through all angles: V^2 = W over the lift at 1 m/s."""
    craft, state, controls = aircraft().vehicle[0], np.zeros(STATE_COUNT), np.zeros(7)
    greatest = 0.0
    for tilt in np.radians(np.arange(5.0, 40.0, 0.25)):
        state[TILT] = tilt
        lift = 0.0
        loads = np.zeros(1, OUTPUTS)
        vehicle_loads(state, controls, craft, (1.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0, SEA_LEVEL_DENSITY, loads[0])
        describe_parts(state, craft, loads[0])
        for k in range(int(craft["surface_count"])):
            if craft["surfaces"][k]["tilts"] == 1:
                lift -= float(loads[0]["surface_force_body"][k, 2])
        greatest = max(greatest, lift)
    weight = float(craft["mass"]) * STANDARD_GRAVITY
    assert stall_speed(aircraft()) == pytest.approx(math.sqrt(weight / greatest), rel=0.02)


def test_a_coarser_grid_gives_the_same_solutions_where_nodes_coincide() -> None:
    """They are found from other neighbours, and yet the same."""
    hover, still, none, weight = (round((v - AXES[k, 0]) / AXES[k, 1]) for k, v in enumerate((0.0, 0.0, 0.0, -10.0)))
    step = AXES[0, 1]
    small = force_map(
        aircraft(), np.array([[0.0, 2.0 * step, 5.0], [0.0, 1.0, 1.0], [0.0, 1.5, 2.0], [-10.0, 2.0, 2.0]])
    )
    large = table()[hover : hover + 10 : 2, still : still + 1, none : none + 2, weight : weight + 2]
    np.testing.assert_allclose(small[..., 0], large[..., 0], atol=math.radians(0.3))
    np.testing.assert_allclose(small[..., 1], large[..., 1], rtol=5e-3)


def test_every_node_has_the_force_and_the_stall_margin_that_it_says() -> None:
    """Evaluated again by the model, at nodes all over the table."""
    craft, out = aircraft().vehicle[0], np.zeros(1, OUTPUTS)[0]
    state, controls = np.empty(STATE_COUNT), np.zeros(7)
    tail_arm = -float(craft["rotors"]["position"][2, 0])
    for index in np.random.default_rng(5).integers(0, AXES[:, 2].astype(int), size=(400, 4)):
        node = dict(zip(COLUMNS, table()[tuple(index)], strict=True))
        u, w = (float(AXES[k, 0] + AXES[k, 1] * index[k]) for k in (0, 1))
        x = np.array([node["tilt"], node["rotor_speed"], node["flap"]])
        fx, fz, my, margin = point_loads(craft, u, w, x, state, controls, out)
        assert node["force_forward"] == pytest.approx(fx / craft["mass"], abs=1e-9)
        assert node["force_down"] == pytest.approx((fz - my / tail_arm) / craft["mass"], abs=1e-9)
        assert node["pitch_moment"] == pytest.approx(my, abs=1e-9)
        assert node["stall_margin"] == pytest.approx(margin, abs=1e-9)


@pytest.mark.parametrize("airspeed", [0.0, 2.0, 4.0, 6.0, 20.0, 24.0, 28.0, 30.0])
def test_in_between_the_nodes_it_agrees_with_the_trim_of_level_flight(airspeed: float) -> None:
    """`trim_level` solves the whole aircraft at the weight itself, between the nodes; flaps are at rest in both."""
    trim = trim_level(aircraft(), airspeed)
    node = np.empty(len(COLUMNS))
    map_lookup(table(), AXES, airspeed, 0.0, 0.0, -STANDARD_GRAVITY, node)
    assert node[COLUMNS.index("flap")] == pytest.approx(0.0, abs=1e-3)
    assert node[COLUMNS.index("rotor_speed")] == pytest.approx(trim.rotor_speed, rel=0.011)
    assert math.degrees(node[COLUMNS.index("tilt")]) == pytest.approx(math.degrees(trim.tilt), abs=0.5)


def test_from_hover_to_the_fastest_cruise_level_flight_is_one_branch() -> None:
    ahead = level_airspeeds() >= 0.0
    assert reached()[ahead, 3, 4, 4].all()  # the row that `level` takes
    tilt = np.degrees(level("tilt"))
    assert np.abs(np.diff(tilt)).max() < 15.0
    assert (np.diff(tilt[ahead]) < 0.0).all()  # the wing comes down all the way
    assert tilt[ahead][0] > 80.0
    assert tilt[-1] < 10.0


def test_where_the_force_is_reached_the_wing_stays_below_its_stall() -> None:
    """The margin is kept softly: it may give way a little where force and margin contend."""
    margin = np.degrees(column("stall_margin")[reached()])
    assert margin.min() > 0.0
    assert np.quantile(margin, 0.01) > math.degrees(STALL_MARGIN) - 1.0
    assert np.degrees(level("stall_margin")[level_airspeeds() >= 0.0]).min() > math.degrees(STALL_MARGIN)


def test_servos_and_rotors_are_within_their_limits_everywhere() -> None:
    servos, fastest = aircraft().vehicle[0]["servos"], speed_at(aircraft(), 0, 1.0)
    assert column("tilt").min() >= servos["minimum"][0]
    assert column("tilt").max() <= servos["maximum"][0]
    assert column("flap").min() >= 0.0
    assert column("flap").max() <= FLAP_SHARE * servos["maximum"][1]
    assert column("rotor_speed").min() > 0.0
    assert column("rotor_speed").max() <= 1.05 * fastest
    assert column("rotor_speed")[reached()].max() <= 1.03 * fastest


def test_most_of_what_flight_needs_is_reached() -> None:
    """From hover to cruise with the weight and a tenth of it in acceleration forward and in load."""
    forward = (level_airspeeds() >= 0.0) & (level_airspeeds() <= 26.0)
    accelerating = round((1.5 - AXES[2, 0]) / AXES[2, 1])
    loaded = round((-12.0 - AXES[3, 0]) / AXES[3, 1])
    assert reached()[forward, 3, accelerating, loaded].all()
    # Where it is not, the force cannot be had: in fast cruise nothing brakes with 6 m/s^2.
    assert not reached()[forward, 3, 0, 4][-1]


@pytest.mark.parametrize("airspeed", [0.0, 4.0, 8.0, 16.0, 24.0, 30.0])
def test_what_the_actuators_do_is_what_the_equations_of_motion_give(airspeed: float) -> None:
    """Moments J w' by the derivative of the whole vehicle, motors balanced, each actuator moved a little either way."""
    index = node_at(airspeed)
    node: dict[str, float] = dict(zip(COLUMNS, table()[index, 3, 4, 4].tolist(), strict=True))
    u, inertia = level_airspeeds()[index], aircraft().vehicle[0]["inertia"]

    def moment(place: tuple[int, ...], change: float) -> np.ndarray:
        state, controls = np.zeros(STATE_COUNT), np.zeros(7)
        state[QUATERNION], state[VELOCITY], state[TILT] = 1.0, u, node["tilt"]
        state[ROTOR_SPEED : ROTOR_SPEED + 2] = node["rotor_speed"]
        state[AILERON_LEFT : AILERON_LEFT + 2] = node["flap"]
        for k, sign in zip(place, (1.0, -1.0), strict=False):
            state[k] += sign * change
        controls[3:] = state[TILT : ELEVATOR + 1]
        rate = np.empty(STATE_COUNT)
        balance_motors(state, controls, aircraft().vehicle, still_air(), np.zeros(1, OUTPUTS), rate)
        return inertia @ rate[RATES : RATES + 3]

    def slope(place: tuple[int, ...], step: float) -> np.ndarray:
        return (moment(place, step) - moment(place, -step)) / (2.0 * step)

    rotors = slope((ROTOR_SPEED, ROTOR_SPEED + 1), 1.0)
    ailerons = slope((AILERON_LEFT, AILERON_LEFT + 1), 1e-3)
    elevator = slope((ELEVATOR,), 1e-3)
    expected = [node[f"{axis}_per_{pair}"] for pair in ("rotor", "aileron") for axis in ("roll", "yaw")]
    found = [rotors[0], rotors[2], ailerons[0], ailerons[2]]
    np.testing.assert_allclose(found, expected, rtol=0.02, atol=2e-3)
    assert elevator[1] == pytest.approx(node["pitch_per_elevator"], rel=0.02, abs=1e-3)


def test_a_turn_rolls_the_faster_outer_wing_up_by_the_moment_that_the_equations_of_motion_give() -> None:
    """J w' + w x J w by the derivative of the whole vehicle in a yaw rate, at a node of cruise."""
    index, rate = node_at(20.0), 0.05
    node: dict[str, float] = dict(zip(COLUMNS, table()[index, 3, 4, 4].tolist(), strict=True))
    inertia = aircraft().vehicle[0]["inertia"]
    state, controls, change = np.zeros(STATE_COUNT), np.zeros(7), np.empty(STATE_COUNT)
    state[QUATERNION], state[VELOCITY], state[TILT] = 1.0, level_airspeeds()[index], node["tilt"]
    state[ROTOR_SPEED : ROTOR_SPEED + 2] = node["rotor_speed"]
    state[AILERON_LEFT : AILERON_LEFT + 2] = node["flap"]
    state[RATES + 2] = rate
    controls[3:] = state[TILT : ELEVATOR + 1]
    balance_motors(state, controls, aircraft().vehicle, still_air(), np.zeros(1, OUTPUTS), change)
    turning = np.array([0.0, 0.0, rate])
    moment = inertia @ change[RATES : RATES + 3] + np.cross(turning, inertia @ turning)
    assert node["roll_per_yaw_rate"] == pytest.approx(moment[0] / rate, rel=0.05)
    assert node["roll_per_yaw_rate"] > 0.0


def test_signs_of_what_the_actuators_do() -> None:
    """Left rotor faster lifts the left wing: roll right. Left aileron down too. Elevator down: nose down."""
    ahead = level_airspeeds() >= 0.0
    assert (level("roll_per_rotor")[ahead] > 0.0).all()
    assert (level("roll_per_aileron")[ahead] > 0.0).all()
    assert (level("pitch_per_elevator")[ahead] <= 0.0).all()
    assert (level("pitch_per_elevator")[level_airspeeds() > 5.0] < 0.0).all()
    # In cruise the left rotor's pull yaws right; in hover the left aileron pushes the slipstream forward: yaw left.
    assert level("yaw_per_rotor")[-1] > 0.0
    assert level("yaw_per_aileron")[np.flatnonzero(ahead)[0]] < 0.0
