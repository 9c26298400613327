"""Offboard: setpoints from a computer outside, in the local NED frame, turned into what the control laws are asked."""

import math
from dataclasses import dataclass

from sitl.flight.behaviour import Behaviour
from sitl.flight.demand import Demand
from sitl.flight.landed import LandedState
from sitl.flight.parameters import Parameters
from sitl.flight.view import View

__all__ = ["AttitudeSetpoint", "MotionSetpoint", "Offboard"]

POSITION_GAIN = 0.8  # from a moving setpoint's distance to extra speed [1/s]
LIFT_OFF = 0.3  # height above the vehicle at which a setpoint asks it to leave the ground [m]
HOVER_THRUST = 0.5  # collective from which an attitude setpoint asks it to [share of the largest]


@dataclass(frozen=True, slots=True)
class MotionSetpoint:
    """What to fly: None where nothing is asked for, as the mask of MAVLink's SET_POSITION_TARGET_LOCAL_NED says.

    Horizontally a position, a velocity, both (a moving point) or an acceleration; vertically a position, a velocity or
    both. `position` and `velocity` are (north, east) and `down`, `climb` the vertical ones, positive down [m, m/s].
    Raises ValueError for a set of them that says too little or is not finite.
    """

    position: tuple[float, float] | None = None
    velocity: tuple[float, float] | None = None
    acceleration: tuple[float, float] | None = None  # north, east [m/s^2]
    down: float | None = None
    down_rate: float | None = None
    yaw: float | None = None  # [rad]
    yaw_rate: float | None = None  # [rad/s]

    def __post_init__(self) -> None:
        pairs = (self.position, self.velocity, self.acceleration)
        numbers = [value for pair in pairs if pair is not None for value in pair]
        numbers += [value for value in (self.down, self.down_rate, self.yaw, self.yaw_rate) if value is not None]
        if not all(math.isfinite(value) for value in numbers):
            msg = f"offboard setpoint: expected finite numbers, got {self}"
            raise ValueError(msg)
        if all(pair is None for pair in pairs):
            msg = "offboard setpoint: expected a horizontal position, velocity or acceleration, got none"
            raise ValueError(msg)
        if self.down is None and self.down_rate is None:
            msg = "offboard setpoint: expected a height or a vertical speed, got neither"
            raise ValueError(msg)

    @property
    def is_place(self) -> bool:
        """It asks for a point to be at, and for nothing on the way there."""
        moves = self.velocity is not None or self.acceleration is not None or self.down_rate is not None
        return self.position is not None and self.down is not None and not moves


@dataclass(frozen=True, slots=True)
class AttitudeSetpoint:
    """Attitude [rad], yaw rate [rad/s] and collective thrust (0..1); `tilt` [rad] is left to the laws if nan.

    Raises ValueError for values that are not finite or a thrust out of its range.
    """

    roll: float
    pitch: float
    yaw_rate: float
    thrust: float
    tilt: float = math.nan

    def __post_init__(self) -> None:
        if not all(math.isfinite(value) for value in (self.roll, self.pitch, self.yaw_rate)) or math.isinf(self.tilt):
            msg = f"offboard attitude: expected finite angles and rates, got {self}"
            raise ValueError(msg)
        if not 0.0 <= self.thrust <= 1.0:
            msg = f"offboard attitude thrust: expected 0 to 1, got {self.thrust}"
            raise ValueError(msg)


class Offboard(Behaviour):
    """Flies the latest setpoint.

    Wing-borne, a position is circled at NAV_LOITER_RAD, for a wing cannot stop there; accelerations are for hover.
    """

    def __init__(self, parameters: Parameters, demand: Demand) -> None:
        self.setpoint: MotionSetpoint | AttitudeSetpoint | None = None
        self.received = -math.inf  # time of the latest setpoint [s]
        self.airspeed = parameters["FW_AIRSPD_TRIM"]
        self.ground_speed = parameters["MPC_XY_VEL_MAX"]
        self._parameters = parameters
        self._demand = demand

    def start(self, view: View, cruise: bool) -> None:  # noqa: ARG002
        """Begin in a regime, at the usual speeds."""
        self.cruise = cruise
        self.airspeed = self._parameters["FW_AIRSPD_TRIM"]
        self.ground_speed = self._parameters["MPC_XY_VEL_MAX"]

    def give(self, setpoint: MotionSetpoint | AttitudeSetpoint, time: float) -> None:
        """Take a setpoint that has come at this time [s]."""
        self.setpoint = setpoint
        self.received = time

    def lifts(self, view: View) -> bool:
        """Whether the setpoint asks a standing vehicle to leave the ground."""
        setpoint = self.setpoint
        if isinstance(setpoint, AttitudeSetpoint):
            return setpoint.thrust >= HOVER_THRUST
        if setpoint is None:
            return False
        if setpoint.down is not None:
            return setpoint.down < view.down - LIFT_OFF
        return setpoint.down_rate is not None and setpoint.down_rate < -0.1

    def fly(self, view: View, cruise: bool) -> None:  # noqa: ARG002
        """Fly the setpoints wing-borne or hovering from now on."""
        self.cruise = cruise

    def change_speed(self, *, airspeed: float | None = None, ground_speed: float | None = None) -> None:
        """Circle setpoints, or approach them in hover, at another speed [m/s]."""
        if airspeed is not None:
            self.airspeed = airspeed
        if ground_speed is not None:
            self.ground_speed = ground_speed

    def update(self, view: View, landed_state: LandedState) -> bool:  # noqa: ARG002
        """Ask for what the setpoint says."""
        setpoint = self.setpoint
        if isinstance(setpoint, AttitudeSetpoint):
            self._demand.attitude(setpoint.roll, setpoint.pitch, setpoint.yaw_rate, setpoint.thrust, setpoint.tilt)
        elif setpoint is not None:
            self._horizontal(setpoint, view)
            self._vertical(setpoint, view)
            if setpoint.yaw is not None:
                self._demand.heading(setpoint.yaw)
            elif setpoint.yaw_rate is not None:
                self._demand.yaw_rate(setpoint.yaw_rate)
        return False

    def _horizontal(self, setpoint: MotionSetpoint, view: View) -> None:
        position, velocity = setpoint.position, setpoint.velocity
        if velocity is not None:
            vn, ve = velocity
            if position is not None:
                vn += POSITION_GAIN * (position[0] - view.north)
                ve += POSITION_GAIN * (position[1] - view.east)
            largest = self._parameters["FW_AIRSPD_MAX" if self.cruise else "MPC_XY_VEL_MAX"]
            shorter = largest / max(math.hypot(vn, ve), largest)
            self._demand.velocity((vn * shorter, ve * shorter, 0.0), cruise=self.cruise)
        elif position is not None:
            down = view.down if setpoint.down is None else setpoint.down
            if self.cruise:
                radius = self._parameters["NAV_LOITER_RAD"]
                self._demand.circle((*position, down), radius, speed=self.airspeed, cruise=True)
            else:
                self._demand.point((*position, down), speed=self.ground_speed)
        elif setpoint.acceleration is not None:
            north, east = setpoint.acceleration
            sine, cosine = math.sin(view.yaw), math.cos(view.yaw)
            self._demand.acceleration(north * cosine + east * sine, east * cosine - north * sine)

    def _vertical(self, setpoint: MotionSetpoint, view: View) -> None:
        down, rate = setpoint.down, setpoint.down_rate
        if rate is None:
            assert down is not None  # a setpoint has one of them
            self._demand.altitude(down)
            return
        if down is not None:
            rate += POSITION_GAIN * (down - view.down)
        up = self._parameters["FW_T_CLMB_MAX" if self.cruise else "MPC_Z_VEL_MAX_UP"]
        sink = self._parameters["FW_T_SINK_MAX" if self.cruise else "MPC_Z_VEL_MAX_DN"]
        self._demand.climb(min(max(rate, -up), sink))
