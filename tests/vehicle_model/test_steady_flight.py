"""General trim in six degrees of freedom: any direction through the air, climbs, turns, and the margin to stall."""

import math
from typing import Any

import numpy as np
import pytest

from vehicle_model.aircraft import load_aircraft
from vehicle_model.earth import make_environment
from vehicle_model.integrate import advance, observe
from vehicle_model.records import OUTPUTS
from vehicle_model.rotation import body_to_ned, euler_from_quaternion
from vehicle_model.state import POSITION, QUATERNION, RATES, ROTOR_SPEED, STATE_COUNT, VELOCITY
from vehicle_model.steady_flight import SteadyFlight, trim_steady
from vehicle_model.trim import TrimError, still_air, trim_level

G = 9.80665
AIRCRAFT = load_aircraft()
CRAFT = AIRCRAFT.vehicle[0]
WEIGHT = float(CRAFT["mass"]) * G


def rates_of(flight: SteadyFlight, environment: np.ndarray | None = None) -> np.ndarray:
    world = still_air() if environment is None else environment
    outputs, rate = np.zeros(1, OUTPUTS), np.empty(STATE_COUNT)
    observe(flight.state, flight.controls, AIRCRAFT.vehicle, world, outputs, rate)
    return rate


def velocity_ned(flight: SteadyFlight) -> np.ndarray:
    state = flight.state
    return np.array(body_to_ned(*state[QUATERNION : QUATERNION + 4], *state[VELOCITY : VELOCITY + 3]))


CONDITIONS: dict[str, dict[str, Any]] = {
    "hover": {"airspeed": 0.0},
    "forward": {"airspeed": 12.0},
    "cruise": {"airspeed": 30.0},
    "climb": {"airspeed": 25.0, "climb_angle": math.radians(6.0), "pitch": None},
    "descent": {"airspeed": 12.0, "climb_angle": math.radians(-6.0)},
    "vertical climb": {"airspeed": 2.0, "climb_angle": math.radians(90.0)},
    "vertical descent": {"airspeed": 3.0, "climb_angle": math.radians(-90.0)},
    "sideways": {"airspeed": 6.0, "direction": math.radians(90.0)},
    "rearward": {"airspeed": 6.0, "direction": math.radians(180.0)},
    "turn": {"airspeed": 30.0, "turn_rate": math.radians(12.0), "pitch": None},
    "turning climb": {
        "airspeed": 28.0, "turn_rate": math.radians(-8.0), "climb_angle": math.radians(3.0), "pitch": None
    },
    "tilt given": {"airspeed": 12.0, "tilt": math.radians(45.0), "pitch": None},
}  # fmt: skip


@pytest.mark.parametrize("name", CONDITIONS)
def test_it_is_steady_in_all_six_degrees_of_freedom(name: str) -> None:
    flight = trim_steady(AIRCRAFT, **CONDITIONS[name])
    rate = rates_of(flight)
    assert flight.residual < 1e-8
    assert np.abs(rate[VELOCITY : VELOCITY + 3]).max() * float(CRAFT["mass"]) < 1e-7 * WEIGHT
    assert np.abs(CRAFT["inertia"] @ rate[RATES : RATES + 3]).max() < 1e-7 * WEIGHT
    assert np.abs(rate[ROTOR_SPEED : ROTOR_SPEED + 2]).max() < 1e-4
    asked = CONDITIONS[name]
    velocity = velocity_ned(flight)
    assert np.linalg.norm(velocity) == pytest.approx(asked["airspeed"], abs=1e-9)
    assert -velocity[2] == pytest.approx(asked["airspeed"] * math.sin(asked.get("climb_angle", 0.0)), abs=1e-9)
    level = asked["airspeed"] * math.cos(asked.get("climb_angle", 0.0))
    direction = asked.get("direction", 0.0)
    assert velocity[:2] == pytest.approx([level * math.cos(direction), level * math.sin(direction)], abs=1e-9)
    assert tuple(flight.state[ROTOR_SPEED : ROTOR_SPEED + 3]) == flight.rotor_speeds
    roll, pitch, yaw = euler_from_quaternion(*flight.state[QUATERNION : QUATERNION + 4])
    assert (roll, pitch, yaw) == pytest.approx((flight.roll, flight.pitch, 0.0), abs=1e-9)
    if asked.get("pitch", 0.0) is not None:
        assert flight.pitch == pytest.approx(0.0, abs=1e-9)
    if "tilt" in asked:
        assert flight.tilt == pytest.approx(asked["tilt"], abs=1e-9)


@pytest.mark.parametrize("airspeed", [0.0, 5.0, 10.0, 20.0, 30.0])
def test_level_flight_ahead_is_the_papers_trim_but_for_the_tail_rotors_torque(airspeed: float) -> None:
    level, steady = trim_level(AIRCRAFT, airspeed), trim_steady(AIRCRAFT, airspeed)
    assert sum(steady.rotor_speeds[:2]) / 2.0 == pytest.approx(level.rotor_speed, rel=2e-3)
    assert steady.tilt == pytest.approx(level.tilt, abs=math.radians(0.3))
    assert steady.elevator == pytest.approx(level.elevator, abs=math.radians(0.3))
    assert abs(steady.roll) < math.radians(1.0)
    assert abs(steady.aileron) < math.radians(2.0)


def test_a_level_turn_banks_for_the_centripetal_force() -> None:
    rate = math.radians(12.0)
    right, left = (trim_steady(AIRCRAFT, 30.0, turn_rate=turn, pitch=None) for turn in (rate, -rate))
    # Coordinated: tan(bank) = V rate/g. Here bank follows from zero sideslip, so the fuselage and fin push nothing.
    assert math.tan(right.roll) == pytest.approx(30.0 * rate / G, rel=0.02)
    assert left.roll == pytest.approx(-right.roll, abs=math.radians(0.5))
    assert left.rotor_speeds[0] == pytest.approx(right.rotor_speeds[1], rel=5e-3)


def test_a_turn_comes_round_at_the_rate_asked_for() -> None:
    rate = math.radians(12.0)
    flight = trim_steady(AIRCRAFT, 30.0, turn_rate=rate, pitch=None)
    state = flight.state.copy()
    advance(state, flight.controls, AIRCRAFT.vehicle, still_air(), 0.0025, 2000)
    _, _, yaw = euler_from_quaternion(*state[QUATERNION : QUATERNION + 4])
    assert yaw == pytest.approx(5.0 * rate, abs=1e-3)
    radius = 30.0 / rate
    expected = [radius * math.sin(5.0 * rate), radius * (1.0 - math.cos(5.0 * rate)), 0.0]
    assert state[POSITION : POSITION + 3] == pytest.approx(expected, abs=0.1)


@pytest.mark.parametrize("name", ["cruise", "turn", "sideways", "turning climb"])
def test_wind_carries_the_trim_along_and_changes_nothing_else(name: str) -> None:
    wind = (4.0, -3.0, 1.0)
    windy = make_environment(
        "flat", latitude=0.0, longitude=0.0, height_ellipsoid=0.0, ground_height=-1e6, wind_ned=wind
    )
    still = trim_steady(AIRCRAFT, **CONDITIONS[name])
    carried = trim_steady(AIRCRAFT, **CONDITIONS[name], environment=windy)
    assert carried.rotor_speeds == pytest.approx(still.rotor_speeds, rel=1e-5)
    assert (carried.tilt, carried.elevator, carried.roll) == pytest.approx(
        (still.tilt, still.elevator, still.roll), abs=1e-5
    )
    assert velocity_ned(carried) == pytest.approx(velocity_ned(still) + wind, abs=1e-4)


def test_climb_costs_the_power_of_lifting_the_weight() -> None:
    level = trim_steady(AIRCRAFT, 25.0, pitch=None)
    climb = trim_steady(AIRCRAFT, 25.0, climb_angle=math.radians(5.0), pitch=None)
    more = float(climb.outputs["shaft_power"].sum() - level.outputs["shaft_power"].sum())
    lifting = WEIGHT * 25.0 * math.sin(math.radians(5.0))
    assert lifting < more < 2.0 * lifting  # the propellers' losses come on top


def test_a_partial_power_descent_at_mid_tilt_has_lost_margin_to_stall() -> None:
    # VZ-2: wing stall trouble at mid incidence, worse in a descent with partial power.
    tilt = math.radians(40.0)
    flights = [
        trim_steady(AIRCRAFT, 12.0, climb_angle=math.radians(angle), tilt=tilt, pitch=None) for angle in (0, -4, -8)
    ]
    wing = AIRCRAFT.vehicle[0]["surfaces"]["tilts"][: len(AIRCRAFT.surface_names)] == 1
    margins = np.array([flight.outputs["stall_margin"][: len(wing)][wing] for flight in flights])
    powers = [float(flight.outputs["shaft_power"].sum()) for flight in flights]
    assert powers[0] > powers[1]
    assert (np.diff(margins, axis=0) < -math.radians(1.0)).all()  # of every strip, wetted or not


def test_it_says_what_cannot_be_flown() -> None:
    with pytest.raises(TrimError, match=r"no steady flight at 30 m/s, climb angle 70 deg, .* of the weight unbalanced"):
        trim_steady(AIRCRAFT, 30.0, climb_angle=math.radians(70.0))
    weak = AIRCRAFT.with_values({"rotors.wing.motor.max_power": 0.2 * AIRCRAFT.rotors.wing.motor.max_power})
    with pytest.raises(TrimError, match=r"no steady flight at 0 m/s.*the (left|right) rotor takes .* N m"):
        trim_steady(weak, 0.0)


def test_ahead_of_the_wing_the_tail_meets_no_downwash() -> None:
    assert trim_steady(AIRCRAFT, 8.0, direction=math.pi).outputs["downwash_angle"] == 0.0
    assert trim_steady(AIRCRAFT, 8.0).outputs["downwash_angle"] > 0.05


def test_a_flight_that_is_no_number_is_refused() -> None:
    with pytest.raises(TrimError, match="expected finite"):
        trim_steady(AIRCRAFT, math.nan)
