"""Forces and moments of the whole vehicle: the paper's eqs (9)-(16) term by term, symmetry, and textbook mechanics."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vehicle_model.aircraft import load_aircraft
from vehicle_model.earth import make_environment
from vehicle_model.integrate import observe
from vehicle_model.loads import downwash_angle
from vehicle_model.records import OUTPUTS
from vehicle_model.rotation import quaternion_from_euler
from vehicle_model.state import (
    AILERON_LEFT,
    AILERON_RIGHT,
    ELEVATOR,
    QUATERNION,
    RATES,
    ROTOR_SPEED,
    STATE_COUNT,
    TILT,
    VELOCITY,
    blank_controls,
    blank_state,
)

AIRCRAFT = load_aircraft()
WORLD = make_environment("flat", latitude=0.0, longitude=0.0, height_ellipsoid=0.0, ground_height=-1e6)
DENSITY = 1.225
# The paper's wing: CL alpha 0.1/deg, incidence to the propeller axis 2 deg, so CL_wet = 0.2 (eq. 9).
PAPER = AIRCRAFT.with_values(
    {"wing.slipstream": "paper", "wing.lift_slope": 0.1 * 180.0 / math.pi, "wing.incidence": math.radians(2.0)}
)
WETTED = [i for i in range(len(PAPER.surface_names)) if int(PAPER.vehicle[0]["surfaces"][i]["rotor"]) >= 0]


def observed(
    state: np.ndarray, controls: np.ndarray | None = None, vehicle: np.ndarray | None = None,
    environment: np.ndarray = WORLD,
) -> tuple[np.void, np.ndarray]:  # fmt: skip
    """OUTPUTS record and state derivative; the motors are off and the servos rest unless `controls` say otherwise."""
    outputs, rate = np.zeros(1, OUTPUTS), np.empty(STATE_COUNT)
    if controls is None:
        controls = blank_controls()
        controls[3:] = state[TILT : TILT + 4]
    observe(state, controls, AIRCRAFT.vehicle if vehicle is None else vehicle, environment, outputs, rate)
    return outputs[0], rate


def flying(
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0), tilt: float = 0.0, rotor_speed: float = 0.0,
    rates: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> np.ndarray:  # fmt: skip
    state = blank_state()
    state[VELOCITY : VELOCITY + 3] = velocity
    state[RATES : RATES + 3] = rates
    state[ROTOR_SPEED] = state[ROTOR_SPEED + 1] = rotor_speed
    state[TILT] = tilt
    return state


def only(surfaces: list[int], *, aircraft: np.ndarray = AIRCRAFT.vehicle, rotors: int = 3) -> np.ndarray:
    """The vehicle with just these surfaces and as many rotors, no fuselage."""
    vehicle = aircraft.copy()
    kept = vehicle["surfaces"][0][surfaces].copy()
    vehicle["surfaces"][0, : len(surfaces)] = kept
    vehicle["surface_count"], vehicle["rotor_count"], vehicle["fuselage_drag_area"] = len(surfaces), rotors, 0.0
    return vehicle


# Slipstream to the letter of the paper.


@pytest.mark.parametrize("tilt", [0.0, 30.0, 60.0, 90.0])
@pytest.mark.parametrize("airspeed", [0.0, 8.0, 20.0])
def test_paper_slipstream_gives_equations_9_to_15_term_by_term(tilt: float, airspeed: float) -> None:
    xi = math.radians(tilt)
    state = flying((airspeed, 0.0, 0.0), xi, 600.0)
    state[ROTOR_SPEED + 1] = 560.0  # sides differ, so that roll and yaw are told apart
    state[ROTOR_SPEED + 2] = 300.0
    out, _ = observed(state, vehicle=only(WETTED, aircraft=PAPER.vehicle))
    area = float(PAPER.vehicle[0]["surfaces"][WETTED[0]]["area"])
    zero_lift = float(PAPER.vehicle[0]["surfaces"][WETTED[0]]["zero_lift_drag"])
    force, moment = np.zeros(3), np.zeros(3)
    for i, surface in enumerate(WETTED):
        rotor = int(PAPER.vehicle[0]["surfaces"][surface]["rotor"])
        pressure = 0.5 * DENSITY * float(out["induced_velocity"][rotor]) ** 2  # (11)
        lift, drag = 0.2 * pressure * area, zero_lift * pressure * area  # (9), (10)
        fx = -lift * math.sin(xi) - drag * math.cos(xi)  # (13)
        fz = -lift * math.cos(xi) + drag * math.sin(xi)
        # CL alpha 0.1/deg is a slope in alpha; the model's section is linear in its sine: 2e-4 at 2 deg.
        assert out["surface_force_body"][i] == pytest.approx([fx, 0.0, fz], rel=1e-3, abs=1e-4 * lift)
        x, y, z = out["surface_point_body"][i]
        lx, ly, lz = x, abs(y), -z  # the paper's arms: ahead of and above the centre of mass
        moment[1] += lift * lx * math.cos(xi) - drag * lx * math.sin(xi)  # (14)
        moment[1] += lift * lz * math.sin(xi) + drag * lz * math.cos(xi)
        side = 1.0 if rotor == 1 else -1.0
        moment[2] += side * (lift * ly * math.sin(xi) + drag * ly * math.cos(xi))  # (15)
        moment[0] += side * (-lift * ly * math.cos(xi) + drag * ly * math.sin(xi))  # from (13); missing in the paper
        force += (fx, 0.0, fz)
    left, right, tail = out["thrust"]
    force += ((left + right) * math.cos(xi), 0.0, -(left + right) * math.sin(xi) - tail)  # (13)
    for rotor, thrust in ((0, left), (1, right)):
        x, y, z = out["rotor_point_body"][rotor]
        moment[1] += thrust * x * math.sin(xi) - thrust * -z * math.cos(xi)  # (14)
        moment[2] += -thrust * y * math.cos(xi)  # (15): (T_L - T_R) ly
        moment[0] += -thrust * y * math.sin(xi)
    moment[1] -= tail * -float(out["rotor_point_body"][2][0])  # (14): lx_T behind the centre of mass
    # What the paper leaves out: the propellers' torque.
    spins = AIRCRAFT.vehicle[0]["rotors"]["spin"]
    axes = [(math.cos(xi), 0.0, -math.sin(xi))] * 2 + [(0.0, 0.0, -1.0)]
    for spin, axis, torque in zip(spins, axes, out["motor_torque"], strict=True):
        moment -= spin * torque * np.array(axis)
    assert out["force_body"] == pytest.approx(force, rel=1e-3, abs=0.02)
    assert out["moment_body"] == pytest.approx(moment, rel=1e-3, abs=0.01)


def test_paper_slipstream_makes_0_05_of_the_thrust_per_wetted_area_in_disk_areas_in_hover() -> None:
    out, _ = observed(flying(tilt=0.5 * math.pi, rotor_speed=628.0), vehicle=only(WETTED, aircraft=PAPER.vehicle))
    side = [i for i in WETTED if int(PAPER.vehicle[0]["surfaces"][i]["rotor"]) == 0]
    wetted_area = PAPER.vehicle[0]["surfaces"]["area"][side].sum()
    disk = math.pi * float(PAPER.vehicle[0]["rotors"][0]["radius"]) ** 2
    lift = -out["surface_force_body"][: len(side), 0].sum()  # at 90 deg lift points backwards: -L sin xi
    assert lift / out["thrust"][0] == pytest.approx(0.05 * wetted_area / disk, rel=2e-3)


def test_paper_slipstream_does_not_feel_tilt_or_airspeed_beyond_the_induced_velocity() -> None:
    coefficients = set()
    for tilt, airspeed in ((0.0, 0.0), (0.0, 15.0), (0.7, 15.0), (1.5, 3.0)):
        vehicle = only(WETTED, aircraft=PAPER.vehicle)
        out, _ = observed(flying((airspeed, 0.0, 0.0), tilt, 600.0, rates=(0.1, 0.2, 0.3)), vehicle=vehicle)
        size = float(np.linalg.norm(out["surface_force_body"][0]))
        coefficients.add(round(size / float(out["induced_velocity"][0]) ** 2, 9))
    assert len(coefficients) == 1


def test_wing_feels_the_vector_sum_of_free_stream_and_wake() -> None:
    state = flying((12.0, 0.0, 1.0), math.radians(40.0), 600.0)
    out, _ = observed(state)
    for i in WETTED:
        surface = AIRCRAFT.vehicle[0]["surfaces"][i]
        v_i = float(out["induced_velocity"][int(surface["rotor"])])
        wake = float(surface["wake_factor"]) * v_i
        axis = np.array([math.cos(state[TILT]), 0.0, -math.sin(state[TILT])])
        wing = np.array([12.0, 0.0, 1.0]) + wake * axis
        up = np.array([math.sin(state[TILT]), 0.0, math.cos(state[TILT])])  # the wing's z axis in body axes
        incidence = AIRCRAFT.wing.incidence
        expected = math.atan2(wing @ up, wing @ axis) + incidence
        assert out["surface_angle_of_attack"][i] == pytest.approx(expected, abs=1e-9)
        assert out["stall_margin"][i] == pytest.approx(float(surface["max_lift_angle"]) - abs(expected), abs=1e-9)


# Symmetry and mechanics.

small = st.floats(-0.5, 0.5)


@given(
    st.tuples(st.floats(-10.0, 30.0), st.floats(-8.0, 8.0), st.floats(-8.0, 8.0)), st.tuples(small, small, small),
    st.floats(0.0, 1.7), st.tuples(st.floats(0.0, 800.0), st.floats(0.0, 800.0)), st.tuples(small, small, small),
    st.tuples(small, small),
)  # fmt: skip
def test_the_mirrored_state_has_the_mirrored_derivative(
    velocity: tuple[float, float, float], rates: tuple[float, float, float], tilt: float,
    rotors: tuple[float, float], servos: tuple[float, float, float], attitude: tuple[float, float],
) -> None:  # fmt: skip
    roll, pitch = attitude
    state = flying(velocity, tilt, 0.0, rates)
    state[ROTOR_SPEED : ROTOR_SPEED + 2] = rotors  # the tail rotor, which turns one way only, stands still
    state[AILERON_LEFT], state[AILERON_RIGHT], state[ELEVATOR] = servos
    state[QUATERNION : QUATERNION + 4] = quaternion_from_euler(roll, pitch, 0.0)
    controls = blank_controls()
    controls[0], controls[1] = 0.3, 0.2
    mirrored = state.copy()
    mirrored[[VELOCITY + 1, RATES, RATES + 2]] *= -1.0
    mirrored[ROTOR_SPEED : ROTOR_SPEED + 2] = rotors[::-1]
    mirrored[[AILERON_LEFT, AILERON_RIGHT]] = servos[1], servos[0]
    mirrored[QUATERNION : QUATERNION + 4] = quaternion_from_euler(-roll, pitch, 0.0)
    vehicle = AIRCRAFT.vehicle.copy()
    vehicle["inertia"][0, 0, 1] = vehicle["inertia"][0, 1, 0] = 0.0
    vehicle["rotor_count"] = 2
    out, rate = observed(state, controls, vehicle)
    other, mirrored_rate = observed(mirrored, controls[[1, 0, 2, 3, 5, 4, 6]], vehicle)
    sign = np.array([1.0, -1.0, 1.0])
    scale = float(np.abs(out["force_body"]).max() + np.abs(out["moment_body"]).max()) + 1.0
    assert other["force_body"] == pytest.approx(sign * out["force_body"], abs=1e-9 * scale)
    assert other["moment_body"] == pytest.approx(-sign * out["moment_body"], abs=1e-9 * scale)
    assert mirrored_rate[ROTOR_SPEED : ROTOR_SPEED + 2] == pytest.approx(
        rate[[ROTOR_SPEED + 1, ROTOR_SPEED]], rel=1e-9, abs=1e-6
    )


@given(st.tuples(small, small, small), st.floats(0.0, 1.6))
def test_a_spinning_rotor_resists_turning_with_omega_cross_h(rates: tuple[float, float, float], tilt: float) -> None:
    state = flying((5.0, 0.0, 0.0), tilt, 0.0, rates)
    state[ROTOR_SPEED], state[ROTOR_SPEED + 2] = 600.0, -900.0
    light, heavy = AIRCRAFT.vehicle.copy(), AIRCRAFT.vehicle.copy()
    heavy["rotors"]["inertia"] += 1e-3
    change = observed(state, vehicle=heavy)[0]["moment_body"] - observed(state, vehicle=light)[0]["moment_body"]
    spins = AIRCRAFT.vehicle[0]["rotors"]["spin"]
    h = spins[0] * 1e-3 * 600.0 * np.array([math.cos(tilt), 0.0, -math.sin(tilt)])
    h += spins[2] * 1e-3 * -900.0 * np.array([0.0, 0.0, -1.0])
    assert change == pytest.approx(-np.cross(rates, h), abs=1e-9)


@pytest.mark.parametrize("index", [0, 1, 2])
def test_the_airframe_gets_the_motors_torque_reversed(index: int) -> None:
    state = flying(tilt=0.3, rotor_speed=500.0)
    state[ROTOR_SPEED + 2] = 500.0
    controls = blank_controls()
    before = observed(state, controls)[0]
    controls[index] = 0.5
    after = observed(state, controls)[0]
    torque = float(after["motor_torque"][index] - before["motor_torque"][index])
    axis = np.array([0.0, 0.0, -1.0]) if index == 2 else np.array([math.cos(0.3), 0.0, -math.sin(0.3)])
    change = after["moment_body"] - before["moment_body"]
    assert torque > 0.1
    assert change == pytest.approx(-AIRCRAFT.vehicle[0]["rotors"]["spin"][index] * torque * axis, abs=1e-9)


def test_wing_rotors_turn_against_each_other() -> None:
    spins = AIRCRAFT.vehicle[0]["rotors"]["spin"]
    assert spins[0] == -spins[1]
    out, _ = observed(flying(tilt=0.5 * math.pi, rotor_speed=600.0))
    assert abs(out["moment_body"][2]) < 1e-9
    assert abs(out["moment_body"][0]) < 1e-9


@pytest.mark.parametrize(("axis", "name"), [(0, "roll"), (1, "pitch"), (2, "yaw")])
@pytest.mark.parametrize("airspeed", [10.0, 30.0])
def test_turning_is_damped_because_every_part_feels_its_own_speed(axis: int, name: str, airspeed: float) -> None:
    del name
    tilt = math.radians(5.0)
    rates = [0.0, 0.0, 0.0]
    rates[axis] = 0.05
    still, _ = observed(flying((airspeed, 0.0, 0.0), tilt, 480.0))
    turning, _ = observed(flying((airspeed, 0.0, 0.0), tilt, 480.0, (rates[0], rates[1], rates[2])))
    assert turning["moment_body"][axis] < still["moment_body"][axis] - 0.01


def test_roll_damping_is_that_of_strip_theory() -> None:
    # A rigid rolling wing: each strip at y sees p y more across, so L_p = -rho V a sum(S y^2)/2.
    wing = [i for i in range(len(AIRCRAFT.surface_names)) if AIRCRAFT.vehicle[0]["surfaces"][i]["tilts"]]
    vehicle = only(wing, rotors=0)
    vehicle["surfaces"]["rotor"], vehicle["surfaces"]["zero_lift_drag"], vehicle["surfaces"]["induced_drag"] = -1, 0, 0
    surfaces = vehicle[0]["surfaces"][: len(wing)]
    p, airspeed = 1e-4, 25.0
    tilt = -AIRCRAFT.wing.incidence  # chord along the flow
    moment = observed(flying((airspeed, 0.0, 0.0), tilt, rates=(p, 0.0, 0.0)), vehicle=vehicle)[0]["moment_body"]
    expected = (
        -0.5
        * DENSITY
        * airspeed
        * float((surfaces["area"] * surfaces["lift_slope"] * surfaces["position"][:, 1] ** 2).sum())
    )
    assert moment[0] / p == pytest.approx(expected, rel=1e-3)


@given(st.tuples(*[st.floats(-15.0, 15.0)] * 3), st.tuples(small, small, st.floats(-3.0, 3.0)))
def test_moving_with_the_wind_is_standing_in_still_air(
    wind: tuple[float, float, float], attitude: tuple[float, float, float]
) -> None:
    windy = make_environment(
        "flat", latitude=0.0, longitude=0.0, height_ellipsoid=0.0, ground_height=-1e6, wind_ned=wind
    )
    state = flying((18.0, 1.0, 2.0), 0.3, 500.0, (0.1, -0.2, 0.3))
    state[QUATERNION : QUATERNION + 4] = quaternion_from_euler(*attitude)
    carried = state.copy()
    q0, q1, q2, q3 = state[QUATERNION : QUATERNION + 4]
    turn = np.array(
        [
            [1 - 2 * (q2 * q2 + q3 * q3), 2 * (q1 * q2 - q0 * q3), 2 * (q1 * q3 + q0 * q2)],
            [2 * (q1 * q2 + q0 * q3), 1 - 2 * (q1 * q1 + q3 * q3), 2 * (q2 * q3 - q0 * q1)],
            [2 * (q1 * q3 - q0 * q2), 2 * (q2 * q3 + q0 * q1), 1 - 2 * (q1 * q1 + q2 * q2)],
        ]
    )
    carried[VELOCITY : VELOCITY + 3] += turn.T @ wind
    still, moving = observed(state)[0], observed(carried, environment=windy)[0]
    assert moving["airspeed"] == pytest.approx(float(still["airspeed"]))
    assert moving["force_body"] == pytest.approx(still["force_body"], abs=1e-8)
    assert moving["moment_body"] == pytest.approx(still["moment_body"], abs=1e-8)


def test_ailerons_roll_in_cruise_and_yaw_in_hover() -> None:
    # More lift on the left rolls to the right in cruise; in hover lift points backwards (13), so it yaws to the left.
    for tilt, airspeed, axis, sign in ((5.0, 30.0, 0, 1.0), (90.0, 0.0, 2, -1.0)):
        state = flying((airspeed, 0.0, 0.0), math.radians(tilt), 550.0)
        neutral = observed(state)[0]["moment_body"].copy()
        state[AILERON_LEFT], state[AILERON_RIGHT] = 0.1, -0.1  # left trailing edge down
        change = observed(state)[0]["moment_body"] - neutral
        assert sign * change[axis] > 0.1
        assert abs(change[axis]) > 3.0 * abs(change[2 - axis])


def test_elevator_down_and_tail_thrust_up_pitch_the_nose_down() -> None:
    state = flying((30.0, 0.0, 0.0), 0.1, 480.0)
    neutral = observed(state)[0]["moment_body"][1]
    state[ELEVATOR] = 0.05
    assert observed(state)[0]["moment_body"][1] < neutral - 0.1
    hover = flying(tilt=0.5 * math.pi, rotor_speed=600.0)
    neutral = observed(hover)[0]["moment_body"][1]
    hover[ROTOR_SPEED + 2] = 500.0
    assert observed(hover)[0]["moment_body"][1] < neutral - 0.1


# Downwash and drag.


def test_downwash_behind_a_cruising_wing_is_momentum_theorys() -> None:
    # Elliptic loading: far behind, epsilon = 2 CL/(pi A) = L/(rho V^2 pi b^2/4).
    span, airspeed, lift = 2.0, 30.0, 115.0
    expected = lift / (DENSITY * airspeed**2 * math.pi * span**2 / 4.0)
    found = downwash_angle((0.0, 0.0, -lift), (airspeed, 0.0, 0.0), math.pi * span**2 / 4.0, DENSITY)
    assert 0.0 < found <= expected
    assert found == pytest.approx(expected, rel=0.06)  # less what the force itself adds to the mass flow


def test_downwash_velocity_fades_towards_hover_and_has_the_sign_of_the_lift() -> None:
    area = math.pi
    velocities = [
        downwash_angle((0.0, 0.0, -115.0), (speed, 0.0, 0.0), area, DENSITY) * speed for speed in (0.0, 0.01, 0.1, 1.0)
    ]
    assert velocities[0] == 0.0
    assert velocities[1] < 0.011
    assert velocities[2] < 0.11
    assert velocities == sorted(velocities)
    assert downwash_angle((0.0, 0.0, 115.0), (30.0, 0.0, 0.0), area, DENSITY) < 0.0
    assert downwash_angle((-50.0, 0.0, 0.0), (30.0, 0.0, 0.0), area, DENSITY) == 0.0


def test_tail_meets_downwashed_air_in_cruise() -> None:
    state = flying((30.0, 0.0, 0.0), math.radians(6.0), 480.0)
    tail = AIRCRAFT.surface_names.index("horizontal tail")
    out, _ = observed(state)
    incidence = AIRCRAFT.tail.horizontal.incidence
    turned = AIRCRAFT.tail.horizontal.downwash_factor * float(out["downwash_angle"])
    assert turned > 0.0
    assert out["surface_angle_of_attack"][tail] == pytest.approx(incidence - math.atan(turned), abs=1e-9)


def test_fuselage_drag_opposes_the_motion_through_the_air() -> None:
    out, _ = observed(flying((20.0, -4.0, 3.0)))
    u, v, w = 20.0, -4.0, 3.0
    areas = AIRCRAFT.vehicle[0]["fuselage_drag_area"]
    expected = -0.5 * DENSITY * math.sqrt(u * u + v * v + w * w) * areas * np.array([u, v, w])
    assert out["fuselage_force_body"] == pytest.approx(expected, rel=1e-5)


def test_aerodynamic_forces_are_proportional_to_density() -> None:
    state = flying((22.0, 2.0, 3.0), 0.3, 500.0, (0.1, 0.2, 0.3))
    low = observed(state)[0]
    high_world = make_environment("flat", latitude=0.0, longitude=0.0, height_ellipsoid=5000.0, ground_height=-1e6)
    high = observed(state, environment=high_world)[0]
    ratio = float(high["density"] / low["density"])
    assert ratio == pytest.approx(0.73643 / 1.225, rel=1e-4)  # US Standard Atmosphere 1976
    assert high["force_body"] == pytest.approx(ratio * low["force_body"], rel=1e-9, abs=1e-9)


def test_no_part_works_in_air_that_does_not_move_and_rotors_that_do_not_turn() -> None:
    out, _ = observed(flying(tilt=1.0))
    assert not out["force_body"].any()
    assert not out["moment_body"].any()


def test_forces_of_the_parts_add_up_to_the_total() -> None:
    state = flying((15.0, 2.0, 1.0), 0.6, 550.0, (0.2, -0.1, 0.3))
    state[ROTOR_SPEED + 2], state[AILERON_LEFT], state[ELEVATOR] = 250.0, 0.1, -0.05
    out, _ = observed(state)
    count = len(AIRCRAFT.surface_names)
    parts = out["rotor_force_body"].sum(axis=0) + out["surface_force_body"][:count].sum(axis=0)
    assert out["force_body"] == pytest.approx(parts + out["fuselage_force_body"], rel=1e-9)
    pushed = np.cross(out["rotor_point_body"], out["rotor_force_body"]).sum(axis=0)
    pushed += np.cross(out["surface_point_body"][:count], out["surface_force_body"][:count]).sum(axis=0)
    pushed += np.cross(AIRCRAFT.vehicle[0]["fuselage_position"], out["fuselage_force_body"])
    # The rest are the propellers' torque and gyroscopic moments.
    craft, axes = AIRCRAFT.vehicle[0], [(math.cos(0.6), 0.0, -math.sin(0.6))] * 2 + [(0.0, 0.0, -1.0)]
    for i, axis in enumerate(axes):
        spin = craft["rotors"]["spin"][i] * np.array(axis)
        momentum = craft["rotors"]["inertia"][i] * state[ROTOR_SPEED + i] * spin
        pushed += -out["motor_torque"][i] * spin - np.cross(state[RATES : RATES + 3], momentum)
    assert out["moment_body"] == pytest.approx(pushed, rel=1e-9, abs=1e-9)


def test_outputs_that_no_part_fills_stay_zero() -> None:
    out, _ = observed(flying((30.0, 0.0, 0.0), 0.1, 480.0))
    assert not out["surface_force_body"][len(AIRCRAFT.surface_names) :].any()
    assert not out["contact_force_body"].any()


def test_a_large_nose_up_moment_grows_from_hover_into_forward_flight_at_fixed_controls() -> None:
    # NASA TN D-1389: tilt-wings show a large nose-up pitching moment from hover to forward flight.
    hover = math.radians(80.0)
    moments = [observed(flying((speed, 0.0, 0.0), hover, 620.0))[0]["moment_body"][1] for speed in (0.0, 1.0, 2.0, 3.0)]
    assert (np.diff(moments) > 0.0).all()
