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
    are those of `limits`).
    """

    def __init__(self) -> None:
        self.record = record = np.zeros(1, SETPOINT)
        # Each field as an array of its own: a number in one is read and written in a tenth of the time that it takes
        # by its name in the record.
        self._level, self._cruise = record["level"], record["cruise"]
        self._horizontal, self._vertical, self._yaw = record["horizontal"], record["vertical"], record["yaw"]
        self._position, self._start = record["position_ned"][0], record["start_ned"][0]
        self._velocity, self._acceleration = record["velocity_ned"][0], record["acceleration"][0]
        self._speed, self._radius, self._bank = record["speed"], record["radius"], record["bank"]
        self._heading, self._yaw_rate = record["heading"], record["yaw_rate"]
        self._direct, self._roll, self._pitch = record["direct"][0], record["roll"], record["pitch"]
        self._thrust, self._tilt = record["thrust"], record["tilt"]
        self._climb_rate, self._sink_rate = record["climb_rate"], record["sink_rate"]
        self._max_bank, self._thrust_limit = record["max_bank"], record["thrust_limit"]
        self.limits(climb_rate=3.0, sink_rate=2.0, max_bank=math.radians(35.0))
        self.off()

    def limits(self, *, climb_rate: float, sink_rate: float, max_bank: float) -> None:
        """Limits of every task from now on [m/s, m/s, rad]."""
        self._climb_rate[0], self._sink_rate[0], self._max_bank[0] = climb_rate, sink_rate, max_bank

    def off(self) -> None:
        """Motors off: disarmed."""
        self._ask_level(Level.OFF)

    def idle(self) -> None:
        """Motors at idle: armed on the ground."""
        self._ask_level(Level.IDLE)

    def direct(self, controls: Sequence[float]) -> None:
        """Controls (7,) as in `vehicle_model.state`, straight to the actuators."""
        self._ask_level(Level.DIRECT)
        self._direct[:] = controls

    def attitude(self, roll: float, pitch: float, yaw_rate: float, thrust: float, tilt: float = math.nan) -> None:
        """Attitude, collective thrust (0..1) and tilt (nan: chosen by the laws)."""
        self._ask_level(Level.ATTITUDE)
        self._roll[0], self._pitch[0], self._yaw_rate[0] = roll, pitch, yaw_rate
        self._thrust[0], self._tilt[0] = thrust, tilt

    def point(self, position: Vector, *, speed: float, cruise: bool = False, thrust_limit: float = 1.0) -> None:
        """Fly to a point and stop there; with `cruise` wing-borne at an airspeed until it is time to slow down."""
        self._ask_velocity(Horizontal.POINT, Vertical.ALTITUDE, cruise, speed)
        self._position[:] = position
        self._thrust_limit[0] = thrust_limit

    def leg(self, start: Vector, end: Vector, *, speed: float, cruise: bool) -> None:
        """Along a straight line, passing its end without slowing down; altitude is that of the end."""
        self._ask_velocity(Horizontal.LEG, Vertical.ALTITUDE, cruise, speed)
        self._start[:] = start
        self._position[:] = end

    def circle(self, centre: Vector, radius: float, *, speed: float, cruise: bool) -> None:
        """Around a centre, clockwise seen from above if the radius is positive."""
        self._ask_velocity(Horizontal.CIRCLE, Vertical.ALTITUDE, cruise, speed)
        self._position[:] = centre
        self._radius[0] = radius

    def velocity(self, velocity_ned: Vector, *, cruise: bool = False) -> None:
        """Velocity over the ground, climb or sink rate included."""
        self._ask_velocity(Horizontal.VELOCITY, Vertical.RATE, cruise, math.hypot(velocity_ned[0], velocity_ned[1]))
        self._velocity[:] = velocity_ned

    def acceleration(self, forward: float, right: float) -> None:
        """Acceleration along and right of the heading [m/s^2], drifting with the wind when zero."""
        self._ask_velocity(Horizontal.ACCELERATION, Vertical.ALTITUDE, False, 0.0)
        self._acceleration[:] = forward, right

    def bank(self, bank: float, *, speed: float) -> None:
        """Wing-borne at an airspeed with a bank angle."""
        self._ask_velocity(Horizontal.BANK, Vertical.ALTITUDE, True, speed)
        self._bank[0] = bank

    # Modifiers of the task just given.

    def altitude(self, down: float) -> None:
        """Hold this height, instead of the task's own."""
        self._vertical[0] = Vertical.ALTITUDE
        self._position[2] = down

    def climb(self, down_rate: float) -> None:
        """Climb (negative) or sink at this rate [m/s], instead of holding a height."""
        self._vertical[0] = Vertical.RATE
        self._velocity[2] = down_rate

    def heading(self, heading: float) -> None:
        """Keep the nose at this heading while hovering."""
        self._yaw[0], self._heading[0] = Yaw.HEADING, heading

    def yaw_rate(self, rate: float) -> None:
        """Turn the nose at this rate while hovering."""
        self._yaw[0], self._yaw_rate[0] = Yaw.RATE, rate

    def weathervane(self) -> None:
        """Turn the nose into the wind while hovering."""
        self._yaw[0] = Yaw.WEATHERVANE

    def limit_thrust(self, share: float) -> None:
        """Use no more than this share 0..1 of the largest collective thrust, to settle on the gear."""
        self._thrust_limit[0] = share

    # What is asked for, to those who watch whether it happens.

    @property
    def level(self) -> int:
        """The `Level` asked for, as a plain number."""
        return self._level.item()

    @property
    def down_rate(self) -> float | None:
        """Climb (negative) or sink rate asked for [m/s]; None while it is a height."""
        return self._velocity.item(2) if self._vertical.item() == Vertical.RATE else None

    @property
    def down(self) -> float:
        """Height asked for [m], while it is one."""
        return self._position.item(2)

    @property
    def sink_rate(self) -> float:
        """Largest sink rate of any task [m/s]."""
        return self._sink_rate.item()

    @property
    def thrust(self) -> float:
        """Collective thrust 0..1 asked for with an attitude."""
        return self._thrust.item()

    @property
    def throttle(self) -> float:
        """The larger throttle of the wing's rotors in `direct` controls."""
        return max(self._direct.item(0), self._direct.item(1))

    def _ask_velocity(self, horizontal: Horizontal, vertical: Vertical, cruise: bool, speed: float) -> None:
        self._level[0], self._horizontal[0], self._vertical[0] = Level.VELOCITY, horizontal, vertical
        self._yaw[0], self._cruise[0], self._speed[0], self._thrust_limit[0] = Yaw.COURSE, cruise, speed, 1.0

    def _ask_level(self, level: Level) -> None:
        self._level[0] = level
        self._thrust_limit[0] = 1.0
