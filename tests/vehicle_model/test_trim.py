"""Level trim: equations (17)-(20) at every speed of the paper, its curves, and a clear word where there is none."""

import math
from typing import Literal

import numpy as np
import pytest

from vehicle_model.aircraft import load_aircraft
from vehicle_model.earth import make_environment
from vehicle_model.integrate import observe
from vehicle_model.records import OUTPUTS
from vehicle_model.state import ELEVATOR, QUATERNION, RATES, ROTOR_SPEED, STATE_COUNT, TILT, VELOCITY
from vehicle_model.trim import Trim, TrimError, no_load_speed, still_air, trim_each, trim_level, trim_sweep

AIRCRAFT = load_aircraft()
CRAFT = AIRCRAFT.vehicle[0]
WEIGHT = float(CRAFT["mass"]) * 9.80665
SWEEP = trim_sweep(AIRCRAFT, range(31))
RPM = np.array([trim.rpm for trim in SWEEP])
TILT_DEG = np.degrees([trim.tilt for trim in SWEEP])
ELEVATOR_DEG = np.degrees([trim.elevator for trim in SWEEP])


def unbalanced(trim: Trim) -> tuple[np.ndarray, np.ndarray]:
    """Force [N] and moment [N m] that a trim leaves, gravity included, and the rates of its rotors."""
    outputs, rate = np.zeros(1, OUTPUTS), np.empty(STATE_COUNT)
    observe(trim.state, trim.controls, AIRCRAFT.vehicle, still_air(), outputs, rate)
    force = outputs["force_body"][0] + [0.0, 0.0, WEIGHT]  # the fuselage is level
    return np.concatenate([force, outputs["moment_body"][0]]), rate


def test_every_speed_from_0_to_30_trims_to_a_billionth_of_the_weight() -> None:
    for airspeed, trim in enumerate(SWEEP):
        left, _ = unbalanced(trim)
        assert trim.residual < 1e-9
        assert np.abs(left[[0, 2, 4]]).max() < 1e-9 * WEIGHT
        assert trim.airspeed == airspeed


def test_a_trim_is_level_unaccelerated_flight_with_rotors_and_servos_at_rest() -> None:
    for trim in SWEEP:
        _, rate = unbalanced(trim)
        assert trim.state[VELOCITY : VELOCITY + 3] == pytest.approx([trim.airspeed, 0.0, 0.0])
        assert trim.state[QUATERNION : QUATERNION + 4] == pytest.approx([1.0, 0.0, 0.0, 0.0])
        assert not trim.state[RATES : RATES + 3].any()
        assert np.abs(rate[ROTOR_SPEED : ROTOR_SPEED + 3]).max() < 1e-6
        assert not rate[TILT:].any()
        assert (trim.state[TILT], trim.state[ELEVATOR]) == (trim.tilt, trim.elevator)


def test_a_trim_keeps_to_the_limits_of_servos_and_motors() -> None:
    for trim in SWEEP:
        for servo, angle in ((0, trim.tilt), (3, trim.elevator)):
            assert CRAFT["servos"][servo]["minimum"] <= angle <= CRAFT["servos"][servo]["maximum"]
        assert (np.abs(trim.controls[:3]) <= 1.0).all()
        assert (trim.outputs["current"] <= CRAFT["rotors"]["max_current"]).all()


# Fig. 10 of the paper.


def test_rotor_speed_falls_from_6000_rpm_in_hover_to_between_4000_and_5000_at_30_m_s() -> None:
    assert RPM[0] == pytest.approx(6000.0, rel=0.02)
    assert 4000.0 <= RPM[30] <= 5000.0
    assert RPM.min() > 2000.0  # the axis of the figure
    assert RPM.max() < 7000.0


def test_tilt_falls_monotonically_from_hover_to_cruise() -> None:
    assert 78.0 <= TILT_DEG[0] <= 90.0
    assert TILT_DEG[30] < 15.0
    assert (np.diff(TILT_DEG) < 0.0).all()


def test_elevator_stays_within_10_deg() -> None:
    assert np.abs(ELEVATOR_DEG).max() <= 10.0


def test_trim_curves_do_not_jump() -> None:
    # A change of slope within 1 m/s that stays below a few percent of the curve's whole range.
    assert np.abs(np.diff(RPM, 2)).max() < 250.0
    assert np.abs(np.diff(TILT_DEG, 2)).max() < 3.0
    assert np.abs(np.diff(ELEVATOR_DEG, 2)).max() < 2.0


def test_hover_tilt_follows_from_thrust_and_the_lift_in_the_slipstream() -> None:
    # With the fuselage level the thrust's forward part holds the wing's backward lift: T cos xi = L sin xi + D cos xi.
    trim = SWEEP[0]
    forward = float(trim.outputs["rotor_force_body"][:2, 0].sum())
    backward = float(trim.outputs["surface_force_body"][:, 0].sum())
    assert forward > 0.0
    assert forward == pytest.approx(-backward, rel=1e-9)


def test_motor_power_is_the_shaft_power_of_the_rotors() -> None:
    for trim in SWEEP[::10]:
        speeds = trim.state[ROTOR_SPEED : ROTOR_SPEED + 3]
        assert trim.power == pytest.approx(float(trim.outputs["motor_torque"] @ speeds), rel=1e-6)
        assert trim.tail_rpm == pytest.approx(float(speeds[2]) * 60.0 / (2.0 * math.pi))
        assert trim.rpm == pytest.approx(float(speeds[0]) * 60.0 / (2.0 * math.pi))


# The search.


def same(a: Trim, b: Trim) -> bool:
    mine, theirs = (np.array([t.rotor_speed / 600.0, t.tilt, t.elevator]) for t in (a, b))
    return float(np.abs(mine - theirs).max()) < 1e-8


def test_the_order_of_a_sweep_changes_nothing_but_its_order() -> None:
    speeds = [12.0, 30.0, 3.0, 12.0]
    found = trim_sweep(AIRCRAFT, speeds)
    assert [trim.airspeed for trim in found] == speeds
    upwards = trim_sweep(AIRCRAFT, [3.0, 12.0, 30.0])
    assert found[2].state.tobytes() == upwards[0].state.tobytes()
    assert found[0].state.tobytes() == found[3].state.tobytes() == upwards[1].state.tobytes()


def test_continuation_in_either_direction_and_no_continuation_find_the_same_trims() -> None:
    near = None
    for airspeed, swept in enumerate(SWEEP):  # slow to fast; the sweep goes from fast to slow
        near = trim_level(AIRCRAFT, float(airspeed), near=near)
        assert same(near, swept), f"{airspeed} m/s, from slow to fast"
        assert same(trim_level(AIRCRAFT, float(airspeed)), swept), f"{airspeed} m/s, alone"


def test_thin_air_takes_more_rotor_speed() -> None:
    high = make_environment("flat", latitude=0.0, longitude=0.0, height_ellipsoid=3000.0, ground_height=0.0)
    # Static thrust goes with density and the square of the speed; the slipstream's lift with it.
    expected = SWEEP[0].rpm * math.sqrt(1.225 / 0.90925)
    assert trim_level(AIRCRAFT, 0.0, high).rpm == pytest.approx(expected, rel=1e-3)


def test_it_says_clearly_that_motors_cannot_hold_a_trim() -> None:
    heavy = AIRCRAFT.with_values({"mass_properties.mass": 3.0 * AIRCRAFT.mass_properties.mass})
    with pytest.raises(TrimError, match=r"no level trim at 0 m/s: .*(rotor takes .* N m|of the weight unbalanced)"):
        trim_level(heavy, 0.0)
    weak = AIRCRAFT.with_values({"rotors.wing.motor.max_power": 0.2 * AIRCRAFT.rotors.wing.motor.max_power})
    with pytest.raises(TrimError, match=r"no level trim at 0 m/s: at \d+ rpm the (left|right) rotor takes"):
        trim_level(weak, 0.0)


def test_it_says_clearly_that_nothing_balances() -> None:
    with pytest.raises(TrimError, match=r"no level trim at 150 m/s: "):
        trim_level(AIRCRAFT, 150.0)
    with pytest.raises(TrimError, match=r"no level trim at 200 m/s: "):
        trim_sweep(AIRCRAFT, [20.0, 200.0])
    for bad in (math.nan, math.inf):
        with pytest.raises(TrimError, match="expected a finite airspeed"):
            trim_level(AIRCRAFT, bad)


def test_wind_is_refused_for_level_trim_is_through_the_air() -> None:
    windy = make_environment("flat", latitude=0.0, longitude=0.0, height_ellipsoid=0.0, wind_ned=(-8.0, 0.0, 0.0))
    with pytest.raises(ValueError, match="expected still air"):
        trim_level(AIRCRAFT, 20.0, windy)


def test_a_sweep_says_where_there_is_no_trim_and_keeps_the_others() -> None:
    found = trim_each(AIRCRAFT, [10.0, 200.0, 30.0])
    assert [isinstance(each, Trim) for each in found] == [True, False, True]
    assert "200 m/s" in str(found[1])
    with pytest.raises(TrimError, match="200 m/s"):
        trim_sweep(AIRCRAFT, [10.0, 200.0])


@pytest.mark.parametrize("earth", ["round", "wgs84"])
def test_the_whole_aircraft_trims_on_a_curved_earth_too(earth: Literal["round", "wgs84"]) -> None:
    world = make_environment(earth, latitude=0.8, longitude=0.1, height_ellipsoid=0.0, ground_height=-1e6)
    curved, flat = trim_level(AIRCRAFT, 30.0, world), trim_level(AIRCRAFT, 30.0)
    assert curved.residual < 1e-9
    # On the sphere the plumb line leans 0.1 deg from the normal, which thrust feels as a slope.
    assert curved.rpm == pytest.approx(flat.rpm, rel=5e-3)
    assert curved.tilt == pytest.approx(flat.tilt, rel=2e-2)


def test_searches_are_scaled_by_the_motors_own_no_load_speed() -> None:
    constant = AIRCRAFT.rotors.wing.motor.velocity_constant
    fast = AIRCRAFT.with_values({"rotors.wing.motor.velocity_constant": 2.0 * constant})
    assert no_load_speed(fast.vehicle) == pytest.approx(2.0 * no_load_speed(AIRCRAFT.vehicle))
    assert trim_level(fast, 25.0).rpm == pytest.approx(trim_level(AIRCRAFT, 25.0).rpm, rel=1e-9)
