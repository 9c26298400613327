"""A vehicle for flights without the laws: a point mass that does at once, within limits, what the demand says."""

import math

import pytest

from sitl.control.records import Horizontal, Level, Vertical, Yaw
from sitl.flight.flight import Flight
from sitl.flight.view import View
from vehicle_model.aircraft import load_aircraft
from vehicle_model.earth import make_environment

STEP = 0.02  # [s]
ACCELERATION = 2.0  # of the mass [m/s^2]
STANDING = -0.27  # down of the centre of mass of a vehicle on the ground [m]
HOVER_THRUST = 0.5
TILT_RATE = math.radians(60.0)
TILT_LAG = 0.1  # [s]
CRUISE_TILT = math.radians(5.0)


class PointMass:
    """Follows the SETPOINT of a flight, in calm air, and calls its update at 50 Hz."""

    def __init__(self, **parameters):
        environment = make_environment(
            "flat", latitude=math.radians(47.397742), longitude=math.radians(8.545594), height_ellipsoid=488.0
        )
        self.flight = Flight(load_aircraft(), environment, parameters)
        self.record = self.flight.demand.record[0]
        self.view = View(down=STANDING, tilt=math.pi / 2, tilt_command=math.pi / 2, battery_voltage=48.0)
        self.ground = STANDING
        self.ticks = 0
        self.flight.begin(self.view, airborne=False)
        self.flight.update(self.view)

    def begin(self, *, height, airspeed=0.0, heading=0.0):
        """Be in the air, armed, at a height [m], wing-borne if there is an airspeed [m/s]."""
        view = self.view
        view.down, view.yaw, view.airspeed = -height, heading, airspeed
        view.vn, view.ve = airspeed * math.cos(heading), airspeed * math.sin(heading)
        view.tilt = CRUISE_TILT if airspeed else math.pi / 2
        self.flight.begin(view, airborne=True, cruise=airspeed > 0.0)
        return self

    def run(self, seconds):
        """Let time pass [s]."""
        for _ in range(round(seconds / STEP)):
            self.step()

    def run_until(self, condition, timeout=120.0):
        """Let time pass until it is so; fails after `timeout` [s]."""
        for _ in range(round(timeout / STEP)):
            if condition():
                return
            self.step()
        pytest.fail(f"not within {timeout} s; mode {self.flight.mode.name}, {self.view}")

    def step(self):
        """20 ms of motion, then the flight's update."""
        view, level = self.view, self.record["level"]
        self.ticks += 1
        view.time = self.ticks * STEP
        if level == Level.VELOCITY:
            self._horizontal()
            self._vertical()
            self._nose()
        elif view.down < self.ground:
            view.vd += 9.8 * STEP * (1.0 - min(view.thrust / HOVER_THRUST, 1.0))
        if level in (Level.OFF, Level.IDLE):
            view.thrust = 0.0
            view.vd = 0.0 if view.down >= self.ground else view.vd
        elif level == Level.ATTITUDE:
            view.thrust = float(self.record["thrust"])
        view.north += view.vn * STEP
        view.east += view.ve * STEP
        view.down += view.vd * STEP
        if view.down >= self.ground:
            view.down, view.vd, view.vn, view.ve = self.ground, min(view.vd, 0.0), 0.0, 0.0
        view.airspeed = math.hypot(view.vn, view.ve)
        carried = min(view.airspeed / 15.0, 1.0)
        goal = math.pi / 2 + (CRUISE_TILT - math.pi / 2) * carried
        view.tilt_command = goal
        rate = (goal - view.tilt) / TILT_LAG
        view.tilt += min(max(rate, -TILT_RATE), TILT_RATE) * STEP
        self.flight.update(view)

    def _horizontal(self):
        view, record, kind = self.view, self.record, self.record["horizontal"]
        cruise, speed = bool(record["cruise"]), float(record["speed"])
        if kind == Horizontal.VELOCITY:
            vn, ve = map(float, record["velocity_ned"][:2])
        elif kind == Horizontal.POINT:
            north, east = float(record["position_ned"][0]) - view.north, float(record["position_ned"][1]) - view.east
            far = math.hypot(north, east)
            wanted = min(speed, 0.5 * far, math.sqrt(ACCELERATION * far))
            vn, ve = (north / far * wanted, east / far * wanted) if far > 1e-6 else (0.0, 0.0)
        elif kind == Horizontal.CIRCLE:
            north, east = view.north - float(record["position_ned"][0]), view.east - float(record["position_ned"][1])
            radius, far = float(record["radius"]), math.hypot(north, east) or 1e-6
            inward = min(max((far - abs(radius)) / 20.0, -1.0), 1.0)
            along = math.copysign(math.sqrt(1.0 - inward * inward), radius)
            vn = speed * (-east * along - north * inward) / far
            ve = speed * (north * along - east * inward) / far
        elif kind == Horizontal.LEG:
            start, end = record["start_ned"], record["position_ned"]
            course = math.atan2(float(end[1] - start[1]), float(end[0] - start[0]))
            vn, ve = speed * math.cos(course), speed * math.sin(course)
        elif kind == Horizontal.BANK:
            course = math.atan2(view.ve, view.vn) + 9.8 * math.tan(record["bank"]) / max(speed, 1.0) * STEP
            view.roll = float(record["bank"])
            vn, ve = speed * math.cos(course), speed * math.sin(course)
            view.vn, view.ve = vn, ve
        else:
            forward, right = map(float, record["acceleration"])
            sine, cosine = math.sin(view.yaw), math.cos(view.yaw)
            vn = view.vn + (forward * cosine - right * sine) * STEP
            ve = view.ve + (forward * sine + right * cosine) * STEP
        if kind != Horizontal.BANK:
            view.roll = 0.0
        change = math.hypot(vn - view.vn, ve - view.ve)
        most = (10.0 if cruise and kind == Horizontal.CIRCLE else ACCELERATION) * STEP
        share = min(most / change, 1.0) if change > 0.0 else 0.0
        view.vn += share * (vn - view.vn)
        view.ve += share * (ve - view.ve)

    def _vertical(self):
        view, record = self.view, self.record
        if record["vertical"] == Vertical.RATE:
            wanted = float(record["velocity_ned"][2])
        else:
            wanted = 1.0 * (float(record["position_ned"][2]) - view.down)
            wanted = min(max(wanted, -float(record["climb_rate"])), float(record["sink_rate"]))
        view.vd += min(max(wanted - view.vd, -ACCELERATION * STEP), ACCELERATION * STEP)
        limit = float(record["thrust_limit"])
        sits = view.down >= self.ground and wanted > 0.0
        view.thrust = min(0.8 * HOVER_THRUST if sits else HOVER_THRUST, limit)

    def _nose(self):
        view, record = self.view, self.record
        if view.airspeed > 8.0 or (record["yaw"] == Yaw.COURSE and view.airspeed > 0.5):
            view.yaw = math.atan2(view.ve, view.vn)
        elif record["yaw"] == Yaw.HEADING:
            turn = math.remainder(float(record["heading"]) - view.yaw, 2.0 * math.pi)
            view.yaw += min(max(turn, -STEP), STEP)
        elif record["yaw"] == Yaw.RATE:
            view.yaw += float(record["yaw_rate"]) * STEP


@pytest.fixture
def vehicle():
    """A vehicle standing at home, disarmed."""
    return PointMass()


@pytest.fixture
def make_vehicle():
    """The same with parameters of choice, `make_vehicle(NAME=value)`."""
    return PointMass
