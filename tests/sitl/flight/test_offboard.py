"""Offboard: which setpoints there are, and that they are flown."""

import math

import pytest

from sitl.control.records import Horizontal, Level
from sitl.flight.mode import Mode
from sitl.flight.offboard import AttitudeSetpoint, MotionSetpoint
from sitl.flight.refused import Refused


def begin(vehicle, setpoint, **start):
    vehicle.begin(height=30.0, **start)
    vehicle.flight.links.offboard = 0.0
    vehicle.flight.offboard(setpoint)
    vehicle.flight.set_mode(Mode.OFFBOARD)
    return vehicle


def test_offboard_needs_a_fresh_stream(vehicle):
    vehicle.begin(height=30.0)
    vehicle.flight.offboard(MotionSetpoint(position=(0.0, 0.0), down=-30.0))
    vehicle.flight.links.offboard = 3.0
    with pytest.raises(Refused, match="no offboard setpoints"):
        vehicle.flight.set_mode(Mode.OFFBOARD)
    vehicle.flight.links.enforced = False
    vehicle.flight.set_mode(Mode.OFFBOARD)


def test_position_and_yaw_are_reached(vehicle):
    begin(vehicle, MotionSetpoint(position=(20.0, -10.0), down=-35.0, yaw=1.0))
    vehicle.run(30.0)
    view = vehicle.view
    assert (view.north, view.east, view.down, view.yaw) == pytest.approx((20.0, -10.0, -35.0, 1.0), abs=0.1)


def test_velocity_and_height_are_held_together(vehicle):
    begin(vehicle, MotionSetpoint(velocity=(3.0, 0.0), down=-33.0, yaw_rate=0.2))
    vehicle.run(10.0)
    assert vehicle.view.vn == pytest.approx(3.0, abs=0.01)
    assert vehicle.view.down == pytest.approx(-33.0, abs=0.05)
    assert vehicle.record["yaw_rate"] == 0.2


def test_velocity_is_limited_to_what_hover_allows(vehicle):
    begin(vehicle, MotionSetpoint(velocity=(30.0, 40.0), down_rate=-9.0))
    vehicle.run(0.1)
    assert tuple(vehicle.record["velocity_ned"]) == pytest.approx((4.8, 6.4, -3.0))


def test_moving_point_is_followed(vehicle):
    begin(vehicle, MotionSetpoint(position=(0.0, 0.0), velocity=(4.0, 0.0), down=-30.0))
    for _ in range(500):
        north = 4.0 * (vehicle.view.time + 0.02)
        vehicle.flight.offboard(MotionSetpoint(position=(north, 0.0), velocity=(4.0, 0.0), down=-30.0))
        vehicle.step()
    assert vehicle.view.north == pytest.approx(4.0 * vehicle.view.time, abs=0.3)


def test_acceleration_is_turned_into_the_heading(vehicle):
    begin(vehicle, MotionSetpoint(acceleration=(1.0, 0.0), down=-30.0, yaw=math.pi / 2), heading=math.pi / 2)
    vehicle.step()
    assert tuple(vehicle.record["acceleration"]) == pytest.approx((0.0, -1.0), abs=1e-9)


def test_attitude_goes_straight_through(vehicle):
    begin(vehicle, AttitudeSetpoint(0.1, -0.2, 0.3, 0.55))
    vehicle.run(0.1)
    assert vehicle.record["level"] == Level.ATTITUDE
    assert [vehicle.record[name] for name in ("roll", "pitch", "yaw_rate", "thrust")] == [0.1, -0.2, 0.3, 0.55]
    assert math.isnan(vehicle.record["tilt"])


def test_on_the_wing_a_position_is_circled(vehicle):
    begin(vehicle, MotionSetpoint(position=(300.0, 0.0), down=-30.0), airspeed=20.0)
    vehicle.run(60.0)
    assert vehicle.record["horizontal"] == Horizontal.CIRCLE
    assert math.hypot(vehicle.view.north - 300.0, vehicle.view.east) == pytest.approx(80.0, abs=9.0)


def test_standing_vehicle_takes_off_for_a_setpoint_above_it_only(vehicle):
    vehicle.flight.links.offboard = 0.0
    vehicle.flight.offboard(MotionSetpoint(position=(0.0, 0.0), down=0.0))
    vehicle.flight.set_mode(Mode.OFFBOARD)
    vehicle.flight.arm()
    vehicle.run(1.0)
    assert vehicle.record["level"] == Level.IDLE
    vehicle.flight.offboard(MotionSetpoint(position=(0.0, 0.0), down=-10.0))
    vehicle.run(10.0)
    assert vehicle.view.down == pytest.approx(-10.0, abs=0.3)


def test_lost_stream_holds(make_vehicle):
    vehicle = begin(make_vehicle(COM_OBL_RC_ACT=5), MotionSetpoint(velocity=(5.0, 0.0), down=-30.0))
    vehicle.run(2.0)
    vehicle.flight.links.offboard = 1.5
    vehicle.run(0.3)
    assert vehicle.flight.mode == Mode.HOLD


@pytest.mark.parametrize(
    ("setpoint", "message"),
    [
        ({"down": -10.0}, "expected a horizontal position, velocity or acceleration"),
        ({"position": (0.0, 0.0)}, "expected a height or a vertical speed"),
        ({"position": (math.nan, 0.0), "down": -5.0}, "expected finite numbers"),
    ],
)
def test_setpoints_that_say_too_little_are_errors(setpoint, message):
    with pytest.raises(ValueError, match=message):
        MotionSetpoint(**setpoint)


def test_thrust_out_of_range_is_an_error():
    with pytest.raises(ValueError, match=r"offboard attitude thrust: expected 0 to 1, got 1.2"):
        AttitudeSetpoint(0.0, 0.0, 0.0, 1.2)
