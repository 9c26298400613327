"""What modes and missions ask of the control laws, in one vocabulary: each method writes one setpoint.

Positions are (north, east, down) from home [m], angles in radians, speeds in m/s.
"""

import math
from collections.abc import Sequence

import numpy as np

from sitl.control.records import SETPOINT, Horizontal, Level, Vertical, Yaw

__all__ = ["Demand", "Vector"]

Vector = Sequence[float]


class Demand:
    """Writes the SETPOINT record that the compiled laws read.

    A call describes the whole of a task: what it does not say goes back to rest (the nose follows the airflow, limits
    are those of `limits`). The setpoint's sequence number changes with the kind of task, its points or its regime, not
    when only a speed or an altitude is adjusted.
    """

    def __init__(self) -> None:
        self.record = np.zeros(1, SETPOINT)
        self._task: tuple[object, ...] = ()
        self.limits(climb_rate=3.0, sink_rate=2.0, max_bank=math.radians(35.0))
        self.off()

    def limits(self, *, climb_rate: float, sink_rate: float, max_bank: float) -> None:
        """Limits of every task from now on [m/s, m/s, rad]."""
        record = self.record[0]
        record["climb_rate"], record["sink_rate"], record["max_bank"] = climb_rate, sink_rate, max_bank

    def off(self) -> None:
        """Motors off: disarmed."""
        self._level(Level.OFF)

    def idle(self) -> None:
        """Motors at idle: armed on the ground."""
        self._level(Level.IDLE)

    def direct(self, controls: Sequence[float]) -> None:
        """Controls (7,) as in `vehicle_model.state`, straight to the actuators."""
        self._level(Level.DIRECT)
        self.record[0]["direct"] = controls

    def attitude(self, roll: float, pitch: float, yaw_rate: float, thrust: float, tilt: float = math.nan) -> None:
        """Attitude, collective thrust (0..1) and tilt (nan: chosen by the laws)."""
        self._level(Level.ATTITUDE)
        record = self.record[0]
        record["roll"], record["pitch"], record["yaw_rate"] = roll, pitch, yaw_rate
        record["thrust"], record["tilt"] = thrust, tilt

    def point(self, position: Vector, *, speed: float, cruise: bool = False, thrust_limit: float = 1.0) -> None:
        """Fly to a point and stop there; with `cruise` wing-borne at an airspeed until it is time to slow down."""
        self._velocity(Horizontal.POINT, Vertical.ALTITUDE, cruise, speed, (position[0], position[1]))
        self.record[0]["position_ned"] = position
        self.record[0]["thrust_limit"] = thrust_limit

    def leg(self, start: Vector, end: Vector, *, speed: float, cruise: bool) -> None:
        """Along a straight line, passing its end without slowing down; altitude is that of the end."""
        self._velocity(Horizontal.LEG, Vertical.ALTITUDE, cruise, speed, (start[0], start[1], end[0], end[1]))
        self.record[0]["start_ned"] = start
        self.record[0]["position_ned"] = end

    def circle(self, centre: Vector, radius: float, *, speed: float, cruise: bool) -> None:
        """Around a centre, clockwise seen from above if the radius is positive."""
        self._velocity(Horizontal.CIRCLE, Vertical.ALTITUDE, cruise, speed, (centre[0], centre[1], radius))
        self.record[0]["position_ned"] = centre
        self.record[0]["radius"] = radius

    def velocity(self, velocity_ned: Vector, *, cruise: bool = False) -> None:
        """Velocity over the ground, climb or sink rate included."""
        self._velocity(Horizontal.VELOCITY, Vertical.RATE, cruise, math.hypot(velocity_ned[0], velocity_ned[1]), ())
        self.record[0]["velocity_ned"] = velocity_ned

    def acceleration(self, forward: float, right: float) -> None:
        """Acceleration along and right of the heading [m/s^2], drifting with the wind when zero."""
        self._velocity(Horizontal.ACCELERATION, Vertical.ALTITUDE, False, 0.0, ())
        self.record[0]["acceleration"] = forward, right

    def bank(self, bank: float, *, speed: float) -> None:
        """Wing-borne at an airspeed with a bank angle."""
        self._velocity(Horizontal.BANK, Vertical.ALTITUDE, True, speed, ())
        self.record[0]["bank"] = bank

    # Modifiers of the task just given.

    def altitude(self, down: float) -> None:
        """Hold this height, instead of the task's own."""
        self.record[0]["vertical"] = Vertical.ALTITUDE
        self.record[0]["position_ned"][2] = down

    def climb(self, down_rate: float) -> None:
        """Climb (negative) or sink at this rate [m/s], instead of holding a height."""
        self.record[0]["vertical"] = Vertical.RATE
        self.record[0]["velocity_ned"][2] = down_rate

    def heading(self, heading: float) -> None:
        """Keep the nose at this heading while hovering."""
        self.record[0]["yaw"], self.record[0]["heading"] = Yaw.HEADING, heading

    def yaw_rate(self, rate: float) -> None:
        """Turn the nose at this rate while hovering."""
        self.record[0]["yaw"], self.record[0]["yaw_rate"] = Yaw.RATE, rate

    def weathervane(self) -> None:
        """Turn the nose into the wind while hovering."""
        self.record[0]["yaw"] = Yaw.WEATHERVANE

    def _velocity(
        self, horizontal: Horizontal, vertical: Vertical, cruise: bool, speed: float, where: tuple[float, ...]
    ) -> None:
        record = self.record[0]
        record["level"], record["horizontal"], record["vertical"] = Level.VELOCITY, horizontal, vertical
        record["yaw"], record["cruise"], record["speed"], record["thrust_limit"] = Yaw.COURSE, cruise, speed, 1.0
        self._begin((Level.VELOCITY, horizontal, bool(cruise), *where))

    def _level(self, level: Level) -> None:
        self.record[0]["level"] = level
        self.record[0]["thrust_limit"] = 1.0
        self._begin((level,))

    def _begin(self, task: tuple[object, ...]) -> None:
        if task != self._task:
            self._task = task
            self.record[0]["sequence"] += 1
