"""A point that does what the Demand asks, without aerodynamics: to test sequences, not flying."""

import math
from collections.abc import Callable

import numpy as np

from sitl.control.records import Horizontal, Level, Vertical, Yaw
from sitl.flight.landed import LandedState
from sitl.flight.view import View

__all__ = ["STEP", "Follower"]

STEP = 0.02  # [s]
AGILITY = {True: 6.0, False: 3.0}  # acceleration on the wing and in hover [m/s^2]
TURN_RATE = 1.0  # of the nose [rad/s]


class Follower:
    """Moves a View as one SETPOINT record asks, over flat ground at down = 0."""

    def __init__(self, setpoint: np.void, wind: tuple[float, float] = (0.0, 0.0)) -> None:
        self.setpoint = setpoint
        self.view = View(tilt=math.pi / 2, wind_north=wind[0], wind_east=wind[1])
        self.landed = LandedState.ON_GROUND

    def put(self, north: float, east: float, down: float, *, speed: float = 0.0, course: float = 0.0) -> None:
        """Into the air: hovering, or on the wing if fast."""
        view = self.view
        view.north, view.east, view.down = north, east, down
        view.vn, view.ve, view.yaw = speed * math.cos(course), speed * math.sin(course), course
        view.tilt = 0.1 if speed > 12.0 else math.pi / 2
        view.airspeed = math.hypot(view.vn - view.wind_north, view.ve - view.wind_east)
        self.landed = LandedState.IN_AIR

    def fly(self, update: Callable[[View], None], until: Callable[[], bool], timeout: float = 600.0) -> None:
        """Alternate updates of the flight and motion; fails if `until` does not come true in time [s]."""
        end = self.view.time + timeout
        while not until():
            assert self.view.time < end, f"not within {timeout} s, at {self.view}"
            update(self.view)
            self.move()

    def move(self) -> None:
        """One step."""
        view, asked = self.view, self.setpoint
        view.time += STEP
        if asked["level"] != Level.VELOCITY:
            view.vn = view.ve = view.vd = 0.0
            return
        cruise = bool(asked["cruise"])
        vn, ve = self._velocity()
        change = math.hypot(vn - view.vn, ve - view.ve)
        share = min(1.0, AGILITY[cruise] * STEP / max(change, 1e-9))
        view.vn += share * (vn - view.vn)
        view.ve += share * (ve - view.ve)
        if asked["vertical"] == Vertical.RATE:
            view.vd = float(asked["velocity_ned"][2])
        else:
            rate = float(asked["position_ned"][2]) - view.down
            view.vd = min(max(rate, -float(asked["climb_rate"])), float(asked["sink_rate"]))
        view.north, view.east = view.north + view.vn * STEP, view.east + view.ve * STEP
        view.down = min(view.down + view.vd * STEP, 0.0)
        self.landed = LandedState.ON_GROUND if view.down > -0.01 and view.vd >= 0.0 else LandedState.IN_AIR
        view.airspeed = math.hypot(view.vn - view.wind_north, view.ve - view.wind_east)
        view.tilt = 0.1 if view.airspeed > 12.0 else math.pi / 2
        if view.airspeed > 12.0:
            view.yaw = math.atan2(view.ve, view.vn)
        elif asked["yaw"] == Yaw.HEADING:
            turn = math.remainder(float(asked["heading"]) - view.yaw, 2.0 * math.pi)
            view.yaw += math.copysign(min(TURN_RATE * STEP, abs(turn)), turn)

    def _velocity(self) -> tuple[float, float]:
        """Velocity over the ground that guidance wants."""
        view, asked = self.view, self.setpoint
        north, east = float(asked["position_ned"][0]) - view.north, float(asked["position_ned"][1]) - view.east
        distance = math.hypot(north, east)
        if asked["horizontal"] == Horizontal.VELOCITY:
            return float(asked["velocity_ned"][0]), float(asked["velocity_ned"][1])
        if asked["horizontal"] == Horizontal.POINT:
            speed = min(float(asked["speed"]), math.sqrt(distance), distance / 0.5)
            return self._along(math.atan2(east, north), speed, wing_borne=False)
        if asked["horizontal"] == Horizontal.LEG:
            start = asked["start_ned"]
            course = math.atan2(asked["position_ned"][1] - start[1], asked["position_ned"][0] - start[0])
            off = (view.east - start[1]) * math.cos(course) - (view.north - start[0]) * math.sin(course)
            return self._along(course - math.atan(off / 30.0), float(asked["speed"]), wing_borne=bool(asked["cruise"]))
        assert asked["horizontal"] == Horizontal.CIRCLE
        radius = float(asked["radius"])
        outside = math.atan2(distance - abs(radius), 0.5 * abs(radius))
        course = math.atan2(east, north) - math.copysign(0.5 * math.pi - outside, radius)
        return self._along(course, float(asked["speed"]), wing_borne=bool(asked["cruise"]))

    def _along(self, course: float, speed: float, *, wing_borne: bool) -> tuple[float, float]:
        """Velocity on a course: `speed` is that over the ground, or through the air if `wing_borne`."""
        view = self.view
        if wing_borne:
            with_it = view.wind_north * math.cos(course) + view.wind_east * math.sin(course)
            across = view.wind_east * math.cos(course) - view.wind_north * math.sin(course)
            speed = with_it + math.sqrt(max(speed * speed - across * across, 1.0))
        return speed * math.cos(course), speed * math.sin(course)
