"""No command takes a number that is none: each refuses it, names it, and the flight goes on as before."""

import math
from collections.abc import Callable

import pytest

from sitl.flight.flight import Flight
from sitl.flight.manual_input import ManualInput
from sitl.flight.mode import Mode
from sitl.flight.offboard import AttitudeSetpoint, MotionSetpoint
from sitl.flight.refused import Refused

COMMANDS: list[tuple[str, Callable[[Flight, float], object]]] = [
    ("take-off height", lambda flight, value: flight.takeoff(value)),
    ("place", lambda flight, value: flight.land((value, 0.0))),
    ("place", lambda flight, value: flight.land((0.0, value))),
    ("north", lambda flight, value: flight.go_to(value, 0.0, -30.0)),
    ("east", lambda flight, value: flight.go_to(0.0, value, -30.0)),
    ("down", lambda flight, value: flight.go_to(0.0, 0.0, value)),
    ("speed", lambda flight, value: flight.go_to(0.0, 0.0, -30.0, speed=value)),
    ("radius", lambda flight, value: flight.go_to(0.0, 0.0, -30.0, radius=value)),
    ("heading", lambda flight, value: flight.go_to(0.0, 0.0, -30.0, heading=value)),
    ("place", lambda flight, value: flight.reposition(value, 8.5456)),
    ("place", lambda flight, value: flight.reposition(47.3977, value)),
    ("speed", lambda flight, value: flight.reposition(speed=value)),
    ("radius", lambda flight, value: flight.reposition(radius=value)),
    ("heading", lambda flight, value: flight.reposition(heading=value)),
    ("place", lambda flight, value: flight.orbit((value, 0.0), 100.0)),
    ("place", lambda flight, value: flight.orbit((0.0, value), 100.0)),
    ("radius", lambda flight, value: flight.orbit(radius=value)),
    ("speed", lambda flight, value: flight.orbit(radius=100.0, speed=value)),
    ("down", lambda flight, value: flight.orbit(radius=100.0, down=value)),
    ("airspeed", lambda flight, value: flight.change_speed(airspeed=value)),
    ("ground speed", lambda flight, value: flight.change_speed(ground_speed=value)),
    ("altitude", lambda flight, value: flight.change_altitude(value)),
    ("home", lambda flight, value: flight.set_home(value, 8.5456, 488.0)),
    ("home", lambda flight, value: flight.set_home(47.3977, value, 488.0)),
    ("home", lambda flight, value: flight.set_home(47.3977, 8.5456, value)),
    ("manual input forward", lambda flight, value: flight.manual(ManualInput(forward=value))),
    ("manual input right", lambda flight, value: flight.manual(ManualInput(right=value))),
    ("manual input throttle", lambda flight, value: flight.manual(ManualInput(throttle=value))),
    ("manual input turn", lambda flight, value: flight.manual(ManualInput(turn=value))),
    ("manual input tilt", lambda flight, value: flight.manual(ManualInput(tilt=value))),
    ("finite", lambda flight, value: flight.offboard(MotionSetpoint(position=(value, 0.0), down=-30.0))),
    ("finite", lambda flight, value: flight.offboard(MotionSetpoint(velocity=(0.0, value), down=-30.0))),
    ("finite", lambda flight, value: flight.offboard(MotionSetpoint(acceleration=(value, 0.0), down=-30.0))),
    ("finite", lambda flight, value: flight.offboard(MotionSetpoint(velocity=(0.0, 0.0), down=value))),
    ("finite", lambda flight, value: flight.offboard(MotionSetpoint(velocity=(0.0, 0.0), down_rate=value))),
    ("finite", lambda flight, value: flight.offboard(MotionSetpoint(velocity=(0.0, 0.0), down=-30.0, yaw=value))),
    ("finite", lambda flight, value: flight.offboard(MotionSetpoint(velocity=(0.0, 0.0), down=-30.0, yaw_rate=value))),
    ("finite", lambda flight, value: flight.offboard(AttitudeSetpoint(value, 0.0, 0.0, 0.5))),
    ("finite", lambda flight, value: flight.offboard(AttitudeSetpoint(0.0, value, 0.0, 0.5))),
    ("finite", lambda flight, value: flight.offboard(AttitudeSetpoint(0.0, 0.0, value, 0.5))),
    ("thrust", lambda flight, value: flight.offboard(AttitudeSetpoint(0.0, 0.0, 0.0, value))),
]


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize(("name", "command"), COMMANDS)
@pytest.mark.parametrize("airspeed", [0.0, 20.0])
def test_number_that_is_not_finite_is_refused_by_its_name(vehicle, name, command, value, airspeed):
    vehicle.begin(height=60.0, airspeed=airspeed)
    vehicle.flight.hold()
    vehicle.run(1.0)
    asked, home = vehicle.record.copy(), (vehicle.flight.home.north, vehicle.flight.home.down)
    with pytest.raises((Refused, ValueError), match=rf"{name}.*(expected|got)"):
        command(vehicle.flight, value)
    vehicle.flight.update(vehicle.view)
    assert vehicle.flight.mode == Mode.HOLD
    assert vehicle.record == asked
    assert (vehicle.flight.home.north, vehicle.flight.home.down) == home


@pytest.mark.parametrize("value", [math.inf, -math.inf])
def test_infinite_altitude_to_go_to_is_refused(vehicle, value):
    vehicle.begin(height=60.0)
    with pytest.raises(Refused, match=r"altitude: expected a finite number, got -?inf"):
        vehicle.flight.reposition(altitude_msl=value)


def test_place_on_the_map_that_is_left_open_is_the_present_one(vehicle):
    vehicle.begin(height=60.0)
    vehicle.view.north = 100.0
    vehicle.flight.reposition(math.nan, math.nan, 488.0 + 40.0)
    vehicle.run(0.1)
    assert tuple(vehicle.record["position_ned"]) == pytest.approx((100.0, 0.0, -40.0), abs=0.1)


@pytest.mark.parametrize("radius", [0.0, 20_000.0])
def test_radius_that_makes_no_circle_here_is_refused(vehicle, radius):
    vehicle.begin(height=60.0, airspeed=20.0)
    for command in (
        lambda: vehicle.flight.orbit(radius=radius),
        lambda: vehicle.flight.go_to(0, 0, -60, radius=radius),
    ):
        with pytest.raises(Refused, match="radius: expected one other than 0, up to 10000 m"):
            command()
