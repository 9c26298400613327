"""What one control step does at each level, and that nothing in it switches: commands move smoothly through it all."""

import math

import numpy as np
import pytest

from sitl.airframe import Airframe
from sitl.control.design_names import COLUMNS as GAIN_COLUMNS
from sitl.flight.demand import Demand
from sitl.start import standing
from tests.sitl.control.flown import RATE, Flown, aircraft, design
from vehicle_model.atmosphere import air_density
from vehicle_model.earth import make_environment
from vehicle_model.force_map import COLUMNS

HEIGHT = 100.0
HERE = (0.0, 0.0, -HEIGHT)


def on_ground() -> tuple[Airframe, Demand]:
    environment = make_environment("flat", latitude=0.8, longitude=0.1, height_ellipsoid=488.0)
    start = standing(aircraft(), environment, 0.5)
    airframe, demand = Airframe(aircraft(), environment, start.state, start.controls, design=design()), Demand()
    airframe.setpoint = demand.record
    return airframe, demand


def commands(flown: Flown, seconds: float) -> np.ndarray:
    """Controls (n, 7) of every tick."""
    rows = np.empty((round(seconds * RATE), 7))
    for row in rows:
        flown.airframe.advance()
        row[:] = flown.airframe.controls
    return rows


def test_off_the_motors_stand_still_and_the_wing_is_up() -> None:
    airframe, _ = on_ground()
    airframe.advance(2 * RATE)
    np.testing.assert_array_equal(airframe.controls[:3], 0.0)
    np.testing.assert_allclose(airframe.controls[3:], (math.radians(90.0), 0.0, 0.0, 0.0))
    np.testing.assert_allclose(airframe.state[13:16], 0.0, atol=1e-6)


def test_idling_the_rotors_turn_slowly_and_the_vehicle_stays_where_it_stands() -> None:
    airframe, demand = on_ground()
    before = airframe.state
    demand.idle()
    airframe.advance(3 * RATE)
    idle = design().gains[0]["idle_speed"]
    np.testing.assert_allclose(airframe.state[13:15], idle, rtol=0.1)
    assert abs(airframe.state[15]) < 1.0
    np.testing.assert_allclose(airframe.state[:3], before[:3], atol=0.02)
    # A motor that gives its power turns faster in thinner air, P ~ rho w^3: the share is of what it gives there.
    top = design().gains[0]["top_speed"] * (1.225 / air_density(488.0)) ** (1.0 / 3.0)
    assert airframe.status[0]["thrust"] == pytest.approx((idle / top) ** 2, rel=1e-3)


def test_direct_controls_go_to_the_actuators_as_they_are() -> None:
    flown = Flown(height=HEIGHT)
    controls = (0.3, 0.4, -0.2, 1.2, 0.1, -0.05, 0.02)
    flown.demand.direct(controls)
    flown.airframe.advance(2)
    np.testing.assert_array_equal(flown.airframe.controls, controls)


@pytest.mark.parametrize(("roll", "pitch"), [(15.0, 0.0), (-20.0, 5.0), (0.0, -8.0)])
def test_attitude_asked_for_in_hover_is_taken_up(roll: float, pitch: float) -> None:
    flown = Flown(height=HEIGHT)
    flown.demand.point(HERE, speed=5.0)
    flown.fly(1.0)
    thrust = float(flown.airframe.status[0]["thrust"])
    flown.demand.attitude(math.radians(roll), math.radians(pitch), 0.0, thrust)
    flown.fly(1.5)
    np.testing.assert_allclose(np.degrees(flown.now["euler"][:2]), (roll, pitch), atol=2.0)


def test_a_yaw_rate_asked_for_in_attitude_flight_is_turned_at() -> None:
    flown = Flown(height=HEIGHT)
    flown.demand.attitude(0.0, 0.0, 0.3, 0.6)
    flown.fly(3.0)
    assert flown.now["rates"][2] == pytest.approx(0.3, abs=0.03)


@pytest.mark.parametrize("tilt", [80.0, 60.0])
def test_a_tilt_asked_for_in_attitude_flight_is_driven_to(tilt: float) -> None:
    flown = Flown(height=HEIGHT)
    flown.demand.attitude(0.0, 0.0, 0.0, 0.6, math.radians(tilt))
    flown.fly(1.0)
    assert math.degrees(flown.now["tilt"]) == pytest.approx(tilt, abs=1.0)


def test_more_thrust_asked_for_turns_the_rotors_faster() -> None:
    speeds: list[float] = []
    for thrust in (0.4, 0.6, 0.8):
        flown = Flown(height=HEIGHT)
        flown.demand.attitude(0.0, 0.0, 0.0, thrust)
        flown.fly(1.0)
        assert flown.airframe.status[0]["thrust"] == pytest.approx(thrust, abs=0.02)
        speeds.append(float(flown.now["rotor_speed"][:2].mean()))
    # Thrust of a rotor at rest goes with the square of its speed.
    np.testing.assert_allclose(np.square(speeds) / (0.4, 0.6, 0.8) / (speeds[0] ** 2 / 0.4), 1.0, atol=0.1)


def test_a_thrust_limit_bounds_the_collective_thrust_so_that_the_vehicle_settles() -> None:
    flown = Flown(height=HEIGHT)
    flown.demand.point(HERE, speed=5.0)
    flown.fly(2.0)
    hover = float(flown.airframe.status[0]["thrust"])
    flown.demand.point(HERE, speed=5.0, thrust_limit=0.5 * hover)
    flown.fly(1.0)
    assert float(flown.airframe.status[0]["thrust"]) <= 1.02**2 * 0.5 * hover + 1e-9
    assert flown.now["velocity"][2] > 2.0


@pytest.mark.parametrize("height", [100.0, 3000.0])
def test_hover_and_cruise_are_held_as_well_in_thin_air(height: float) -> None:
    """The map is one of sea level; at another density the same forces come at the same dynamic pressures."""
    for airspeed in (0.0, 22.0):
        flown = Flown(airspeed, height=height)
        if airspeed:
            flown.demand.leg((0.0, 0.0, -height), (9000.0, 0.0, -height), speed=airspeed, cruise=True)
        else:
            flown.demand.point((0.0, 0.0, -height), speed=5.0)
        flown.fly(20.0)
        rows = flown.history()
        assert np.abs(rows["position"][:, 2] + height).max() < 0.5
        np.testing.assert_allclose(rows["airspeed"], airspeed, atol=0.5)
        forces = flown.airframe.status[0]["node"][COLUMNS.index("force_down")]
        assert forces == pytest.approx(-9.81, abs=0.3)


def test_through_both_transitions_no_command_jumps() -> None:
    """No hard switch: once the task is given, nothing moves by more from tick to tick than a smooth law moves it."""
    flown = Flown(height=HEIGHT)
    flown.demand.point(HERE, speed=5.0)
    flown.demand.heading(0.0)
    flown.fly(5.0)
    flown.demand.leg(HERE, (3000.0, 0.0, -HEIGHT), speed=25.0, cruise=True)
    front = commands(flown, 20.0)
    flown.demand.point((float(flown.airframe.state[0]) + 450.0, 0.0, -HEIGHT), speed=25.0, cruise=True)
    back = commands(flown, 50.0)
    assert np.degrees(front[-1, 3]) < 10.0
    assert np.degrees(back[-1, 3]) > 75.0
    # A new task is a step, which acts from its second tick on.
    steps = np.abs(np.concatenate([np.diff(front[2:], axis=0), np.diff(back[2:], axis=0)])).max(axis=0)
    assert np.degrees(steps[3:]).max() < 0.5
    assert steps[:3].max() < 0.02


def test_a_change_of_task_starts_from_the_motion_that_is() -> None:
    """The velocity reference moves on from where it was, by no more than what the aircraft can in a tick."""
    flown = Flown(20.0, height=HEIGHT)
    flown.demand.leg(HERE, (9000.0, 0.0, -HEIGHT), speed=20.0, cruise=True)
    flown.fly(5.0)
    for change in (
        lambda: flown.demand.circle((0.0, 80.0, -HEIGHT), 80.0, speed=25.0, cruise=True),
        lambda: flown.demand.velocity((-5.0, 0.0, 2.0)),
        lambda: flown.demand.point((0.0, 0.0, -HEIGHT - 50.0), speed=5.0),
    ):
        before = flown.airframe.status[0]["velocity_reference_ned"].copy()
        change()
        flown.airframe.advance(2)
        after = flown.airframe.status[0]["velocity_reference_ned"]
        assert np.linalg.norm(after - before) < 10.0 * 2 / RATE  # 1 g, nearly
        flown.fly(2.0)


def test_a_sound_tilt_drive_is_never_suspected_and_a_stuck_one_is_found_within_a_second_and_a_half() -> None:
    flown = Flown(height=HEIGHT)
    flown.demand.leg(HERE, (9000.0, 0.0, -HEIGHT), speed=25.0, cruise=True)
    suspected = 0.0
    while flown.time < 20.0:
        flown.fly(0.1)
        suspected = max(suspected, float(flown.airframe.status[0]["tilt_fault"]))
    assert suspected == 0.0
    flown.airframe.stick_servo(0)
    flown.demand.point((float(flown.now["position"][0]), 0.0, -HEIGHT), speed=25.0, cruise=True)
    status = flown.airframe.status[0]
    flown.until(lambda row: float(status["servo_command"][0] - row["tilt"]) > math.radians(6.0), timeout=30.0)
    flown.fly(1.5)
    assert status["tilt_fault"] == 1.0


def test_the_schedule_reported_is_that_of_the_airflow() -> None:
    flown = Flown(20.0, height=HEIGHT)
    flown.demand.leg(HERE, (9000.0, 0.0, -HEIGHT), speed=20.0, cruise=True)
    flown.fly(2.0)
    status = flown.airframe.status[0]
    axis = design().axes[0, 0] + design().axes[0, 1] * np.arange(len(design().schedule))
    density = flown.airframe.snapshot().density
    equivalent = float(status["airflow_forward"]) * math.sqrt(density / 1.225)
    expected = [np.interp(equivalent, axis, design().schedule[:, k]) for k in range(len(GAIN_COLUMNS))]
    np.testing.assert_allclose(status["schedule"], expected, rtol=2e-3)
