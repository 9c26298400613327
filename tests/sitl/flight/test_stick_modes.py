"""Altitude and Position: what sticks ask for, and what is held when they are centred."""

import math

import pytest

from sitl.control.records import Horizontal, Level, Vertical, Yaw
from sitl.flight.manual_input import ManualInput
from sitl.flight.mode import Mode
from sitl.flight.regime import Regime
from sitl.simulation import Simulation

CENTRED = ManualInput()


def test_position_moves_along_the_heading_and_brakes_to_a_point(vehicle):
    vehicle.begin(height=30.0, heading=math.radians(90.0))
    vehicle.flight.set_mode(Mode.POSITION)
    vehicle.flight.manual(ManualInput(forward=1.0))
    vehicle.run(6.0)
    assert vehicle.view.ve == pytest.approx(8.0, abs=0.01)  # MPC_XY_VEL_MAX to the east
    vehicle.flight.manual(CENTRED)
    vehicle.run(8.0)
    assert vehicle.record["horizontal"] == Horizontal.POINT
    east = vehicle.view.east
    vehicle.run(5.0)
    assert vehicle.view.east == pytest.approx(east, abs=0.1)
    assert vehicle.view.down == pytest.approx(-30.0, abs=0.05)


def test_diagonal_stick_is_no_faster(vehicle):
    vehicle.begin(height=30.0)
    vehicle.flight.set_mode(Mode.POSITION)
    vehicle.flight.manual(ManualInput(forward=1.0, right=-1.0))
    vehicle.run(8.0)
    assert math.hypot(vehicle.view.vn, vehicle.view.ve) == pytest.approx(8.0, abs=0.01)
    assert vehicle.view.ve < -5.0


def test_throttle_stick_climbs_and_its_centre_holds_the_height(vehicle):
    vehicle.begin(height=30.0)
    vehicle.flight.set_mode(Mode.POSITION)
    vehicle.flight.manual(ManualInput(throttle=1.0))
    vehicle.run(5.0)
    assert vehicle.view.vd == pytest.approx(-3.0, abs=0.01)
    vehicle.flight.manual(CENTRED)
    vehicle.run(3.0)
    down = vehicle.view.down
    vehicle.run(3.0)
    assert vehicle.view.down == pytest.approx(down, abs=0.05)
    assert vehicle.record["vertical"] == Vertical.ALTITUDE


def test_yaw_stick_turns_and_its_centre_holds_the_heading(vehicle):
    vehicle.begin(height=30.0)
    vehicle.flight.set_mode(Mode.POSITION)
    vehicle.flight.manual(ManualInput(turn=1.0))
    vehicle.run(1.0)
    assert vehicle.view.yaw == pytest.approx(math.radians(45.0), abs=0.02)
    vehicle.flight.manual(CENTRED)
    vehicle.run(1.0)
    assert vehicle.view.yaw == pytest.approx(math.radians(45.0), abs=0.02)


def test_stick_cannot_ask_for_a_hard_landing(vehicle):
    vehicle.begin(height=20.0)
    vehicle.flight.set_mode(Mode.POSITION)
    vehicle.flight.manual(ManualInput(throttle=0.0))
    vehicle.run(2.0)
    assert vehicle.view.vd == pytest.approx(2.0, abs=0.1)
    vehicle.run_until(lambda: vehicle.view.down > -1.0)
    assert vehicle.view.vd < 0.6
    vehicle.run_until(lambda: vehicle.flight.on_ground)
    vehicle.run(0.1)
    assert vehicle.record["level"] == Level.IDLE


def test_throttle_stick_up_takes_off_from_the_ground_in_position(vehicle):
    vehicle.flight.manual(CENTRED)
    vehicle.flight.set_mode(Mode.POSITION)
    vehicle.flight.arm()
    vehicle.run(1.0)
    assert vehicle.record["level"] == Level.IDLE
    vehicle.flight.manual(ManualInput(throttle=0.8))
    vehicle.run(5.0)
    assert vehicle.flight.flying
    assert vehicle.view.down < -3.0


def test_position_in_cruise_banks_and_then_holds_its_track(vehicle):
    vehicle.begin(height=60.0, airspeed=20.0)
    vehicle.flight.set_mode(Mode.POSITION)
    vehicle.flight.manual(ManualInput(right=1.0))
    vehicle.run(3.0)
    assert vehicle.record["horizontal"] == Horizontal.BANK
    assert vehicle.record["bank"] == pytest.approx(math.radians(35.0))
    vehicle.flight.manual(CENTRED)
    vehicle.run(0.1)
    assert vehicle.record["horizontal"] == Horizontal.LEG
    course = math.atan2(vehicle.view.ve, vehicle.view.vn)
    start, end = vehicle.record["start_ned"], vehicle.record["position_ned"]
    assert math.atan2(end[1] - start[1], end[0] - start[0]) == pytest.approx(course, abs=0.02)
    leg = [*start[:2], *end[:2]]
    vehicle.run(5.0)
    assert [*start[:2], *end[:2]] == leg


def test_throttle_stick_is_an_airspeed_in_cruise(vehicle):
    vehicle.begin(height=60.0, airspeed=20.0)
    vehicle.flight.set_mode(Mode.POSITION)
    for throttle, airspeed in ((0.0, 15.0), (0.5, 20.0), (1.0, 30.0)):
        vehicle.flight.manual(ManualInput(throttle=throttle))
        vehicle.run(0.1)
        assert vehicle.record["speed"] == pytest.approx(airspeed)
        assert vehicle.record["cruise"] == 1


def test_pitch_stick_climbs_in_cruise(vehicle):
    vehicle.begin(height=60.0, airspeed=20.0)
    vehicle.flight.set_mode(Mode.ALTITUDE)
    vehicle.flight.manual(ManualInput(forward=-1.0))
    vehicle.run(4.0)
    assert vehicle.view.vd == pytest.approx(-3.0, abs=0.01)  # FW_T_CLMB_MAX


def test_altitude_in_hover_accelerates_along_the_heading(vehicle):
    vehicle.begin(height=30.0, heading=1.0)
    vehicle.flight.set_mode(Mode.ALTITUDE)
    vehicle.flight.manual(ManualInput(forward=1.0, right=-1.0))
    vehicle.flight.update(vehicle.view)
    largest = 9.80665 * math.tan(math.radians(20.0)) / math.sqrt(2.0)
    assert vehicle.record["horizontal"] == Horizontal.ACCELERATION
    assert tuple(vehicle.record["acceleration"]) == pytest.approx((largest, -largest))
    assert vehicle.record["position_ned"][2] == pytest.approx(-30.0)


def test_altitude_in_hover_brakes_against_the_air(vehicle):
    vehicle.begin(height=30.0, heading=math.radians(90.0))
    vehicle.flight.set_mode(Mode.ALTITUDE)
    vehicle.flight.manual(CENTRED)
    vehicle.view.ve, vehicle.view.wind_east, vehicle.view.wind_north = 5.0, 1.0, 2.0
    vehicle.flight.update(vehicle.view)
    per_speed = 9.80665 * math.tan(math.radians(20.0)) / 8.0  # MPC_XY_VEL_MAX
    assert tuple(vehicle.record["acceleration"]) == pytest.approx((-4.0 * per_speed, -2.0 * per_speed))


@pytest.mark.parametrize("stick", [ManualInput(forward=1.0), ManualInput(right=-1.0), ManualInput(forward=-1.0)])
def test_full_stick_in_altitude_ends_near_its_airspeed_and_its_centre_at_rest_in_the_air(stick):
    simulation = Simulation(wind=(-4.0, 3.0, 0.0))
    simulation.advance(0.1)
    simulation.flight.takeoff(30.0)
    simulation.flight.arm()
    assert simulation.run_until(lambda s: s.flight.mode == Mode.HOLD and s.flight.flying, 60.0)
    simulation.set_link("manual_control", True)
    simulation.flight.manual(stick)
    simulation.flight.set_mode(Mode.ALTITUDE)

    def through_air():
        view = simulation.flight.view
        return math.hypot(view.vn - view.wind_north, view.ve - view.wind_east)

    simulation.advance(15.0)
    for _ in range(10):
        simulation.advance(1.0)
        assert 6.0 < through_air() < 9.0
    simulation.flight.manual(CENTRED)
    simulation.advance(10.0)
    assert through_air() < 0.8
    assert simulation.flight.regime == Regime.HOVER
    assert simulation.flight.view.down == pytest.approx(-30.3, abs=1.0)


def test_nose_turns_into_the_wind_where_position_holds_a_point(make_vehicle):
    vehicle = make_vehicle(WV_EN=1).begin(height=30.0)
    vehicle.flight.set_mode(Mode.POSITION)
    vehicle.flight.manual(CENTRED)
    vehicle.run(1.0)
    assert vehicle.record["yaw"] == Yaw.WEATHERVANE
    vehicle.flight.manual(ManualInput(turn=1.0))
    vehicle.run(1.0)
    assert vehicle.record["yaw"] == Yaw.RATE
    vehicle.flight.manual(ManualInput(forward=1.0))
    vehicle.run(1.0)
    assert vehicle.record["yaw"] == Yaw.HEADING
    vehicle.flight.manual(CENTRED)
    vehicle.run(10.0)
    assert vehicle.record["yaw"] == Yaw.WEATHERVANE


def test_transition_changes_what_the_sticks_mean(vehicle):
    vehicle.begin(height=60.0)
    vehicle.flight.set_mode(Mode.POSITION)
    vehicle.flight.transition(cruise=True)
    vehicle.run(12.0)
    assert vehicle.record["cruise"] == 1
    assert vehicle.view.airspeed == pytest.approx(20.0, abs=0.5)
    vehicle.flight.transition(cruise=False)
    vehicle.run(20.0)
    assert vehicle.record["horizontal"] == Horizontal.POINT
    assert vehicle.flight.mode == Mode.POSITION


def test_altitude_slows_down_from_the_wing_to_rest_in_the_air_and_drifts_with_it(vehicle):
    vehicle.begin(height=60.0, airspeed=20.0, heading=1.0)
    vehicle.view.wind_east = 3.0
    vehicle.flight.manual(CENTRED)
    vehicle.flight.set_mode(Mode.ALTITUDE)
    vehicle.flight.transition(cruise=False)
    vehicle.run(20.0)
    assert vehicle.flight.mode == Mode.ALTITUDE
    assert (vehicle.view.vn, vehicle.view.ve) == pytest.approx((0.0, 3.0), abs=0.05)
    assert vehicle.view.down == pytest.approx(-60.0, abs=0.05)
    vehicle.flight.manual(ManualInput(throttle=1.0))
    vehicle.run(3.0)
    assert vehicle.view.vd == pytest.approx(-3.0, abs=0.01)
    vehicle.flight.manual(ManualInput(forward=1.0))
    vehicle.run(0.1)
    assert vehicle.record["horizontal"] == Horizontal.ACCELERATION
    assert vehicle.record["acceleration"][0] > 3.0
