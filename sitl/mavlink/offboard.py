"""Offboard control: setpoints of position, velocity, acceleration and attitude from a computer outside.

https://mavlink.io/en/services/offboard_control.html. A setpoint is flown in Offboard, which needs a stream of them
first; with ArduPilot's clients it is flown in Guided as it comes, and a position is gone to though no other setpoint
follows. What a mask leaves out is not asked for; where it leaves nothing the vehicle stays where it is. Angles of
attitude come as a quaternion, rates of the body are flown as the attitude that they lead to.
"""

import math
from collections.abc import Callable, Mapping
from typing import Any

from sitl.flight.flight import Flight
from sitl.flight.mode import Mode
from sitl.flight.offboard import AttitudeSetpoint, MotionSetpoint
from sitl.flight.refused import Refused
from sitl.flight.view import View
from sitl.mavlink.command_place import altitude_above_sea
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.service import Exchange, Handler, Sender, Service
from sitl.mavlink.standard_modes import StandardModesService
from sitl.mavlink.telemetry.context import Context
from vehicle_model.rotation import euler_from_quaternion

__all__ = ["OffboardService"]

Pair = tuple[float, float]

NO_ALTITUDE, NO_DOWN_RATE, NO_LIFT = 0x004, 0x020, 0x100
NO_PLACE, NO_VELOCITY, NO_ACCELERATION = 0x003, 0x018, 0x0C0
AS_FORCE, NO_YAW, NO_YAW_RATE = 0x200, 0x400, 0x800
ALL_ACCELERATION = NO_ACCELERATION | NO_LIFT
NO_BODY_RATES, NO_BODY_YAW_RATE, NO_THRUST, NO_ATTITUDE = 0x03, 0x04, 0x40, 0x80

LOCAL, LOCAL_OFFSET, BODY_NED = mav.MAV_FRAME_LOCAL_NED, mav.MAV_FRAME_LOCAL_OFFSET_NED, mav.MAV_FRAME_BODY_NED
LOCAL_FRD = mav.MAV_FRAME_LOCAL_FRD
BODY = (BODY_NED, mav.MAV_FRAME_BODY_OFFSET_NED, mav.MAV_FRAME_BODY_FRD, LOCAL_FRD)  # turned with the nose

YAW_GAIN = 2.0  # from an error of heading to a yaw rate [1/s]
YAW_RATE = math.radians(45.0)  # at most
LONGEST_STEP = 0.2  # between two setpoints of rates that belong together [s]
STEEPEST = math.radians(60.0)  # attitude that rates may lead to
STAYS = 0.01  # from the vehicle to a position that asks for no other [m]
COMPLAINT_PERIOD = 5.0  # [s], wall time


class OffboardService(Service):
    """SET_POSITION_TARGET_LOCAL_NED, SET_POSITION_TARGET_GLOBAL_INT and SET_ATTITUDE_TARGET."""

    def __init__(self, exchange: Exchange, context: Context, modes: StandardModesService) -> None:
        """Serve through `exchange`; `context` knows the local origin, `modes` which mode was asked for."""
        super().__init__(exchange)
        self._origin = context.origin
        self._modes = modes
        self._next_complaint = -math.inf
        # What rates have led to: roll and pitch [rad], the rate of sinking [m/s], and when [s], simulated.
        self._roll = self._pitch = self._sink = 0.0
        self._integrated_at = -math.inf

    def messages(self) -> Mapping[str, Handler]:
        """See Service."""
        return {
            "SET_POSITION_TARGET_LOCAL_NED": self._on_local,
            "SET_POSITION_TARGET_GLOBAL_INT": self._on_global,
            "SET_ATTITUDE_TARGET": self._on_attitude,
        }

    def _on_local(self, message: Any, sender: Sender) -> None:
        self._try(sender, lambda flight: self._motion(message, flight, self._local_place(message, flight.view)))

    def _on_global(self, message: Any, sender: Sender) -> None:
        self._try(sender, lambda flight: self._motion(message, flight, _global_place(message, flight)))

    def _on_attitude(self, message: Any, sender: Sender) -> None:
        self._try(sender, lambda flight: self._attitude(message, flight.view))

    def _try(self, sender: Sender, make: Callable[[Flight], MotionSetpoint | AttitudeSetpoint]) -> None:
        simulation = self.exchange.simulation
        try:
            flight = simulation.flight
            setpoint = make(flight)
            simulation.offboard(setpoint)
            in_guided = self._modes.is_guided(flight.mode) and flight.mode != Mode.TAKEOFF
            if in_guided and flight.flying and not simulation.is_flown_from_outside:
                self._follow(flight, setpoint)
        except Refused as refused:
            self._complain(sender, refused.reason)
        except ValueError as error:
            self._integrated_at = -math.inf
            self._complain(sender, str(error))

    @staticmethod
    def _follow(flight: Flight, setpoint: MotionSetpoint | AttitudeSetpoint) -> None:
        """As ArduPilot's Guided does: go to a position and stay there, do anything else as long as it is repeated."""
        if isinstance(setpoint, MotionSetpoint) and setpoint.is_place:
            assert setpoint.position is not None  # so it is
            assert setpoint.down is not None
            view = flight.view
            stays = math.dist(setpoint.position, (view.north, view.east)) < STAYS
            if stays and flight.regime.wing_borne and flight.mode == Mode.HOLD:  # the circle remains, at another height
                flight.change_altitude(flight.places.altitude - setpoint.down)
            else:
                flight.go_to(*setpoint.position, setpoint.down, heading=setpoint.yaw)
        elif flight.mode != Mode.OFFBOARD:
            flight.set_mode(Mode.OFFBOARD)

    def _complain(self, sender: Sender, reason: str) -> None:
        """Say what is wrong with a setpoint; the next ones are likely to be wrong in the same way."""
        if self.exchange.wall_time >= self._next_complaint:
            self._next_complaint = self.exchange.wall_time + COMPLAINT_PERIOD
            self.exchange.tell(sender, mav.MAV_SEVERITY_WARNING, reason)

    def _motion(self, message: Any, flight: Flight, place: tuple[Pair, float]) -> MotionSetpoint:
        view, mask = flight.view, message.type_mask
        if mask & AS_FORCE and mask & ALL_ACCELERATION != ALL_ACCELERATION:
            msg = "offboard setpoint: expected accelerations, got forces"
            raise ValueError(msg)
        position = _pair(mask, NO_PLACE, place[0], "x and y")
        velocity = _pair(mask, NO_VELOCITY, _turned(message, view, message.vx, message.vy), "vx and vy")
        acceleration = _pair(mask, NO_ACCELERATION, _turned(message, view, message.afx, message.afy), "afx and afy")
        if position is None and velocity is None and acceleration is None:
            velocity = (0.0, 0.0)
        down = None if mask & NO_ALTITUDE else place[1]
        down_rate = None if mask & NO_DOWN_RATE else message.vz
        if down is None and down_rate is None:
            lift = 0.0 if mask & NO_LIFT else message.afz
            self._sink = self._sink + lift * self._step(view) if self._goes_on(view) else view.vd
            down_rate = self._sink if lift else 0.0
            self._integrated_at = view.time
        along_nose = message.coordinate_frame in BODY and not self._is_local(message.coordinate_frame)
        yaw = None if mask & NO_YAW else message.yaw + (view.yaw if along_nose else 0.0)
        yaw_rate = None if mask & NO_YAW_RATE or yaw is not None else message.yaw_rate
        return MotionSetpoint(position, velocity, acceleration, down, down_rate, yaw, yaw_rate)

    def _is_local(self, frame: int) -> bool:
        """Whether positions and headings in a frame are those of the local NED."""
        return frame == LOCAL or (frame == BODY_NED and self.exchange.identity.guided is None)

    def _local_place(self, message: Any, view: View) -> tuple[Pair, float]:
        """North and east, and down, of the position [m].

        In BODY_NED it counts from the origin, as the frame's definition has it, but with ArduPilot's clients from the
        vehicle, as they mean it.
        """
        frame = message.coordinate_frame
        if self._is_local(frame):
            north, east, down = self._origin.meant(message.x, message.y, message.z)
            return (north, east), down
        if frame != LOCAL_OFFSET and frame not in BODY:
            expected = ", ".join(str(known) for known in (LOCAL, LOCAL_OFFSET, *BODY))
            msg = f"offboard setpoint: expected a frame of {expected}, got {frame}"
            raise ValueError(msg)
        north, east = _turned(message, view, message.x, message.y)
        if frame == LOCAL_FRD:
            north, east, down = self._origin.meant(north, east, message.z)
            return (north, east), down
        return (view.north + north, view.east + east), view.down + message.z

    def _attitude(self, message: Any, view: View) -> AttitudeSetpoint:
        mask = message.type_mask
        thrust = view.thrust if mask & NO_THRUST else min(max(message.thrust, 0.0), 1.0)
        if mask & NO_ATTITUDE:
            if mask & NO_BODY_RATES:
                msg = "offboard attitude: expected an attitude or body rates, got neither"
                raise ValueError(msg)
            if not self._goes_on(view):
                self._roll, self._pitch = view.roll, view.pitch
            step = self._step(view)
            self._roll = _within(self._roll + message.body_roll_rate * step, STEEPEST)
            self._pitch = _within(self._pitch + message.body_pitch_rate * step, STEEPEST)
            self._integrated_at = view.time
            roll, pitch, yaw = self._roll, self._pitch, view.yaw
        else:
            length = math.hypot(*message.q)
            if not 0.5 < length < 2.0:
                msg = f"offboard attitude: expected a unit quaternion, got one of length {length:g}"
                raise ValueError(msg)
            roll, pitch, yaw = euler_from_quaternion(*(value / length for value in message.q))
        if mask & NO_BODY_YAW_RATE:
            yaw_rate = _within(YAW_GAIN * math.remainder(yaw - view.yaw, math.tau), YAW_RATE)
        else:
            yaw_rate = message.body_yaw_rate
        return AttitudeSetpoint(roll, pitch, yaw_rate, thrust)

    def _goes_on(self, view: View) -> bool:
        """Whether the setpoint before is one of the same stream."""
        return 0.0 <= view.time - self._integrated_at <= LONGEST_STEP

    def _step(self, view: View) -> float:
        """Simulated time since the setpoint before [s]."""
        return view.time - self._integrated_at if self._goes_on(view) else 0.0


def _pair(mask: int, bits: int, pair: Pair, names: str) -> Pair | None:
    """Both or none of two values."""
    if mask & bits == bits:
        return None
    if mask & bits:
        msg = f"offboard setpoint: expected both or none of {names} in the mask, got {mask:#x}"
        raise ValueError(msg)
    return pair


def _turned(message: Any, view: View, forward: float, right: float) -> Pair:
    """A horizontal vector, north and east, of what may be given along the nose."""
    if message.coordinate_frame not in BODY:
        return forward, right
    sine, cosine = math.sin(view.yaw), math.cos(view.yaw)
    return forward * cosine - right * sine, forward * sine + right * cosine


def _global_place(message: Any, flight: Flight) -> tuple[Pair, float]:
    """North and east, and down, of the place on the map [m]."""
    altitude = altitude_above_sea(message.alt, message.coordinate_frame, flight)
    latitude, longitude = message.lat_int * 1e-7, message.lon_int * 1e-7
    if message.type_mask & NO_PLACE == NO_PLACE:
        return (0.0, 0.0), flight.places.altitude - altitude
    if not (abs(latitude) <= 90.0 and abs(longitude) <= 180.0):
        msg = f"offboard setpoint: expected latitude and longitude, got {latitude:g}, {longitude:g}"
        raise ValueError(msg)
    north, east, down = flight.places.to_ned(latitude, longitude, altitude)
    return (north, east), down


def _within(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)
