"""How much control is left: rotor speeds where motor and propeller agree, moments by hand, the aircraft's targets."""

import math

import numpy as np
import pytest

from vehicle_model.aircraft import load_aircraft
from vehicle_model.authority import hover_margins, margins, speed_at, thrust_to_weight
from vehicle_model.integrate import observe
from vehicle_model.motor import motor_current, motor_torque
from vehicle_model.records import OUTPUTS
from vehicle_model.rotor import rotor_loads
from vehicle_model.state import AILERON_LEFT, AILERON_RIGHT, STATE_COUNT
from vehicle_model.steady_flight import trim_steady
from vehicle_model.trim import TrimError, still_air

AIRCRAFT = load_aircraft()
CRAFT = AIRCRAFT.vehicle[0]
HOVER = trim_steady(AIRCRAFT, 0.0)


@pytest.mark.parametrize(("index", "throttle"), [(0, 0.2), (1, 1.0), (2, 0.5), (2, -1.0)])
@pytest.mark.parametrize(("axial", "edgewise"), [(0.0, 0.0), (-6.0, 4.0)])
def test_at_its_steady_speed_a_motor_gives_what_the_propeller_takes(
    index: int, throttle: float, axial: float, edgewise: float
) -> None:
    speed = speed_at(AIRCRAFT, index, throttle, axial, edgewise)
    rotor = CRAFT["rotors"][index]
    _, resisting, _ = rotor_loads(rotor, speed, axial, edgewise, 1.225)
    driving = motor_torque(rotor, motor_current(rotor, throttle, speed), speed)
    assert math.copysign(1.0, speed) == math.copysign(1.0, throttle)
    assert driving == pytest.approx(resisting, rel=1e-6, abs=1e-9)


def test_without_throttle_a_rotor_stands_still_and_more_throttle_is_faster() -> None:
    assert speed_at(AIRCRAFT, 0, 0.0) == 0.0
    speeds = [speed_at(AIRCRAFT, 0, throttle) for throttle in (0.1, 0.3, 0.6, 1.0)]
    assert speeds == sorted(speeds)


def test_thrust_to_weight_is_the_static_thrust_at_the_speed_of_full_throttle() -> None:
    rotor = CRAFT["rotors"][0]
    thrust, _, _ = rotor_loads(rotor, speed_at(AIRCRAFT, 0, 1.0), 0.0, 0.0, 1.225)
    assert thrust_to_weight(AIRCRAFT) == pytest.approx(2.0 * thrust / (float(CRAFT["mass"]) * 9.80665), rel=1e-5)


def test_the_aircraft_lifts_at_least_one_and_a_half_times_its_weight() -> None:
    assert thrust_to_weight(AIRCRAFT) >= 1.5


def test_in_still_air_roll_and_yaw_are_in_the_middle_of_their_authority() -> None:
    found = margins(AIRCRAFT, HOVER)
    assert found.roll == pytest.approx(1.0, abs=0.02)
    assert found.yaw == pytest.approx(1.0, abs=0.05)
    assert 0.0 < found.pitch <= 1.0
    assert (found.moments[:, 0] < 0.0).all()
    assert (found.moments[:, 1] > 0.0).all()


def test_roll_moment_is_the_thrust_that_can_be_moved_times_its_arm() -> None:
    found = margins(AIRCRAFT, HOVER)
    trimmed = HOVER.outputs["thrust"][:2]
    top = rotor_loads(CRAFT["rotors"][0], speed_at(AIRCRAFT, 0, 1.0), 0.0, 0.0, 1.225)[0]
    moved = min(top - float(trimmed.max()), float(trimmed.min()))
    arm = float(CRAFT["rotors"][1]["position"][1])
    # In hover the wing's lift in the slipstream, which points backwards, hardly rolls.
    assert found.moments[0, 1] == pytest.approx(2.0 * moved * arm * math.sin(HOVER.tilt), rel=0.1)


def test_yaw_moment_is_that_of_the_ailerons_at_their_stops() -> None:
    outputs, rate = np.zeros(1, OUTPUTS), np.empty(STATE_COUNT)
    ends = []
    for left, right in ((1, 0), (0, 1)):
        state = HOVER.state.copy()
        state[AILERON_LEFT] = CRAFT["servos"]["minimum" if left else "maximum"][1]
        state[AILERON_RIGHT] = CRAFT["servos"]["minimum" if right else "maximum"][2]
        observe(state, HOVER.controls, AIRCRAFT.vehicle, still_air(), outputs, rate)
        ends.append(float(outputs["moment_body"][0, 2]))
    assert margins(AIRCRAFT, HOVER).moments[2] == pytest.approx(sorted(ends), rel=1e-6, abs=1e-6)


def test_a_weaker_motor_leaves_less_roll() -> None:
    weak = AIRCRAFT.with_values({"rotors.wing.motor.max_power": 0.55 * AIRCRAFT.rotors.wing.motor.max_power})
    less = margins(weak, trim_steady(weak, 0.0)).moments[0, 1]
    assert less < margins(AIRCRAFT, HOVER).moments[0, 1]


def test_hovering_in_8_m_s_of_wind_from_anywhere_leaves_30_percent_about_every_axis() -> None:
    rows = hover_margins(AIRCRAFT, 8.0, 12)
    assert len(rows) == 12
    for bearing, flight, found in rows:
        assert float(flight.outputs["airspeed"]) == pytest.approx(8.0)
        ahead, right, _ = flight.outputs["velocity_air_body"]
        assert math.remainder(math.atan2(right, ahead) - bearing, 2.0 * math.pi) == pytest.approx(0.0, abs=0.1)
        assert min(found.roll, found.pitch, found.yaw) >= 0.3, f"wind from {math.degrees(bearing):.0f} deg"


def test_margins_do_not_favour_a_side() -> None:
    rows = {round(math.degrees(bearing)): found for bearing, _, found in hover_margins(AIRCRAFT, 8.0, 8)}
    for right, left in ((45, 315), (90, 270), (135, 225)):
        assert rows[right].roll == pytest.approx(rows[left].roll, abs=0.03)
        assert rows[right].pitch == pytest.approx(rows[left].pitch, abs=0.03)
        assert rows[right].yaw == pytest.approx(rows[left].yaw, abs=0.05)


def test_a_wind_too_strong_to_hover_in_is_said() -> None:
    with pytest.raises(TrimError, match="no steady flight at 90 m/s"):
        hover_margins(AIRCRAFT, 90.0, 4)
