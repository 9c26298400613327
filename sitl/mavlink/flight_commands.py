"""Commands to the flight controller: arm, take off, land, go, orbit, transition, speeds, heights, home, mission.

Each command of MAV_CMD (https://mavlink.io/en/messages/common.html#mav_commands) becomes one call to
`sitl.flight.flight.Flight`, which refuses with a reason what cannot be done.
"""

import math
from collections.abc import Callable, Mapping
from functools import partial

from sitl.flight.flight import Flight
from sitl.flight.manoeuvres import Place, YawBehaviour
from sitl.flight.mode import Mode
from sitl.flight.refused import Refused
from sitl.mavlink.command import Command, CommandHandler, whole_number
from sitl.mavlink.command_place import FrameError, MapPlace, altitude_above_sea, place_in
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.service import Exchange, Service
from sitl.mavlink.standard_modes import StandardModesService
from sitl.mavlink.telemetry.context import Context

__all__ = ["FlightCommands"]

FORCE = 21196.0  # the number that overrides the check of disarming
CHANGE_MODE = 1  # bit of DO_REPOSITION: also out of a mode that flies elsewhere
NO_CHANGE, AS_USUAL = -1.0, -2.0  # speeds that mean something else
AIRSPEED, GROUND_SPEED = 0, 1  # SPEED_TYPE
UNCHANGED = 5  # ORBIT_YAW_BEHAVIOUR
COUNTER_CLOCKWISE = 1.0  # fourth parameter of DO_REPOSITION, wing-borne
# What does not need the vehicle's own controller to fly.
AT_ANY_TIME = frozenset({mav.MAV_CMD_DO_SET_HOME, mav.MAV_CMD_DO_FENCE_ENABLE})


class FlightCommands(Service):
    """Everything a pilot can command."""

    def __init__(self, exchange: Exchange, context: Context, modes: StandardModesService) -> None:
        """Serve through `exchange`; `context` knows the local origin, `modes` which mode was asked for."""
        super().__init__(exchange)
        self._origin = context.origin
        self._modes = modes

    def commands(self) -> Mapping[int, CommandHandler]:
        """See Service."""
        table: dict[int, Callable[[Flight, Command], None]] = {
            mav.MAV_CMD_COMPONENT_ARM_DISARM: self._arm_disarm,
            mav.MAV_CMD_NAV_TAKEOFF: self._takeoff,
            mav.MAV_CMD_NAV_VTOL_TAKEOFF: self._takeoff,
            mav.MAV_CMD_NAV_LAND: self._land,
            mav.MAV_CMD_NAV_VTOL_LAND: self._land,
            mav.MAV_CMD_NAV_RETURN_TO_LAUNCH: _return,
            mav.MAV_CMD_NAV_LOITER_UNLIM: self._loiter,
            mav.MAV_CMD_DO_VTOL_TRANSITION: _transition,
            mav.MAV_CMD_DO_REPOSITION: self._reposition,
            mav.MAV_CMD_DO_ORBIT: self._orbit,
            mav.MAV_CMD_DO_CHANGE_SPEED: _change_speed,
            mav.MAV_CMD_GUIDED_CHANGE_SPEED: _change_speed,
            mav.MAV_CMD_DO_CHANGE_ALTITUDE: _change_altitude,
            mav.MAV_CMD_GUIDED_CHANGE_ALTITUDE: _change_guided_altitude,
            mav.MAV_CMD_DO_SET_HOME: self._set_home,
            mav.MAV_CMD_DO_FLIGHTTERMINATION: _terminate,
            mav.MAV_CMD_DO_FENCE_ENABLE: _enable_fence,
            mav.MAV_CMD_MISSION_START: self._start_mission,
            mav.MAV_CMD_DO_PAUSE_CONTINUE: _pause_continue,
            mav.MAV_CMD_DO_LAND_START: lambda flight, _: flight.land_as_planned(),
            mav.MAV_CMD_OVERRIDE_GOTO: _override_goto,
        }
        return {command: partial(self._carry_out, action) for command, action in table.items()}

    def _carry_out(self, action: Callable[[Flight, Command], None], command: Command) -> int:
        simulation = self.exchange.simulation
        if simulation.is_flown_from_outside and command.id not in AT_ANY_TIME:
            msg = "not now: an outside controller has the servos"
            raise Refused(msg, temporary=True)
        try:
            action(simulation.flight, command)
        except FrameError as error:
            self.exchange.tell(command.sender, mav.MAV_SEVERITY_WARNING, str(error))
            return mav.MAV_RESULT_COMMAND_UNSUPPORTED_MAV_FRAME
        return mav.MAV_RESULT_ACCEPTED

    def _takeoff(self, flight: Flight, command: Command) -> None:
        """Altitudes count from home with ArduPilot's clients, and where the frame says so; else from sea level."""
        altitude = command.params[6]
        if math.isnan(altitude) or (altitude == 0.0 and command.frame is None):
            flight.takeoff()
            return
        if command.frame is None and self.exchange.identity.takeoff_above_home:
            goal = flight.home.altitude + altitude
        else:
            goal = self._place(command, flight).altitude
        flight.takeoff(goal - (flight.places.altitude - flight.view.down))

    def _start_mission(self, flight: Flight, command: Command) -> None:
        """As ground stations use it: it arms, too."""
        first = whole_number(command.params[0]) or 0
        if self.exchange.identity.mission_has_home:
            first = max(first - 1, 0)
        if flight.mission.items and not flight.armed:
            problems = flight.check_arming(Mode.MISSION)
            if problems:  # then the mode stays as it is, too
                msg = f"not armed: {'; '.join(problems)}"
                raise Refused(msg, temporary=True)
        flight.start_mission(first)
        flight.arm()

    def _place(self, command: Command, flight: Flight) -> MapPlace:
        return place_in(command, flight, self._origin)

    def _place_or_here(self, command: Command, flight: Flight) -> Place | None:
        """North and east [m] of the place named; None if none is."""
        where = self._place(command, flight)
        if where.is_here:
            return None
        _check_on_map(where)
        north, east, _ = flight.places.to_ned(where.latitude, where.longitude, flight.places.altitude)
        return north, east

    def _arm_disarm(self, flight: Flight, command: Command) -> None:
        number = command.params[1]
        if _switch(command.params[0], "arm"):
            flight.arm(force=number == self.exchange.identity.force_arm)
        else:
            flight.disarm(force=number == FORCE)

    def _land(self, flight: Flight, command: Command) -> None:
        flight.land(self._place_or_here(command, flight))

    def _loiter(self, flight: Flight, command: Command) -> None:
        """Where it is, or at the place named."""
        where = self._place(command, flight)
        radius = _given(command.params[2]) or None
        if where.is_here and radius is None:
            flight.hold()
        else:
            flight.reposition(*where, radius=radius)
        self._modes.asked = None

    def _reposition(self, flight: Flight, command: Command) -> None:
        """Wing-borne, and always with ArduPilot's clients, the fourth parameter says which way to circle."""
        speed, flags, radius, heading = command.params[:4]
        changes_mode = bool((whole_number(flags) or 0) & CHANGE_MODE)
        if not changes_mode and flight.mode != Mode.HOLD and not self._modes.is_guided(flight.mode):
            msg = f"reposition: in {flight.mode.title} only with the flag to change the mode (param2 = {CHANGE_MODE})"
            raise Refused(msg, temporary=True)
        guided = self.exchange.identity.guided
        around = _given(radius) or None
        if (flight.regime.wing_borne or guided is not None) and heading == COUNTER_CLOCKWISE:
            around = -abs(around or flight.parameters["NAV_LOITER_RAD"])
        flight.reposition(
            *self._place(command, flight),
            speed=_given(speed) if speed > 0.0 else None,
            radius=around,
            heading=None if guided is not None else _given(heading),
        )
        if guided is not None and changes_mode:
            self._modes.asked = guided

    def _orbit(self, flight: Flight, command: Command) -> None:
        radius, speed, yaw = command.params[:3]
        number = UNCHANGED if math.isnan(yaw) else whole_number(yaw)
        try:
            behaviour = YawBehaviour.CENTRE if number == UNCHANGED else YawBehaviour(-1 if number is None else number)
        except ValueError:
            known = ", ".join(str(int(one)) for one in YawBehaviour)
            msg = f"orbit: expected a yaw behaviour of {known} or {UNCHANGED}, got {yaw:g}"
            raise Refused(msg) from None
        altitude = self._place(command, flight).altitude
        flight.orbit(
            self._place_or_here(command, flight),
            _given(radius),
            _given(speed),
            down=None if math.isnan(altitude) else flight.places.altitude - altitude,
            yaw=behaviour,
        )

    def _set_home(self, flight: Flight, command: Command) -> None:
        here = command.params[0]
        if not math.isnan(here) and _switch(here, "home here"):
            flight.set_home()
            return
        where = self._place(command, flight)
        if where.is_here:
            msg = "home: expected latitude and longitude [deg], got none"
            raise Refused(msg)
        flight.set_home(where.latitude, where.longitude, where.altitude)


def _switch(value: float, meaning: str) -> bool:
    """A parameter that is 0 or 1. Raises Refused."""
    number = whole_number(value)
    if number not in (0, 1):
        msg = f"{meaning}: expected 0 or 1, got {value:g}"
        raise Refused(msg)
    return number == 1


def _given(value: float) -> float | None:
    """A number, None for one that is not given."""
    return None if math.isnan(value) else value


def _check_on_map(where: MapPlace) -> None:
    if not (abs(where.latitude) <= 90.0 and abs(where.longitude) <= 180.0):
        msg = f"place: expected latitude and longitude [deg], got {where.latitude:g}, {where.longitude:g}"
        raise Refused(msg)


def _return(flight: Flight, command: Command) -> None:
    del command
    flight.return_home()


def _transition(flight: Flight, command: Command) -> None:
    state = whole_number(command.params[0])
    if state not in (mav.MAV_VTOL_STATE_MC, mav.MAV_VTOL_STATE_FW):
        msg = (
            f"transition: expected {mav.MAV_VTOL_STATE_MC} (hover) or {mav.MAV_VTOL_STATE_FW} (cruise), "
            f"got {command.params[0]:g}"
        )
        raise Refused(msg)
    flight.transition(state == mav.MAV_VTOL_STATE_FW)


def _change_speed(flight: Flight, command: Command) -> None:
    kind, speed = whole_number(command.params[0]), command.params[1]
    if kind not in (AIRSPEED, GROUND_SPEED):
        msg = f"speed: expected type {AIRSPEED} (air) or {GROUND_SPEED} (ground), got {command.params[0]:g}"
        raise Refused(msg)
    if speed == NO_CHANGE:
        return
    if speed == AS_USUAL:
        speed = flight.parameters["FW_AIRSPD_TRIM" if kind == AIRSPEED else "MPC_XY_CRUISE"]
    if kind == AIRSPEED:
        flight.change_speed(airspeed=speed)
    else:
        flight.change_speed(ground_speed=speed)


def _change_altitude(flight: Flight, command: Command) -> None:
    altitude, frame = command.params[0], whole_number(command.params[1])
    flight.change_altitude(altitude_above_sea(altitude, 0 if frame is None else frame, flight))


def _terminate(flight: Flight, command: Command) -> None:
    if _switch(command.params[0], "terminate"):
        flight.terminate()
    elif flight.mode == Mode.TERMINATION:
        msg = "flight terminated: only disarming ends it"
        raise Refused(msg, temporary=True)


def _change_guided_altitude(flight: Flight, command: Command) -> None:
    """GUIDED_CHANGE_ALTITUDE: above mean sea level, or as the frame says."""
    frame = mav.MAV_FRAME_GLOBAL if command.frame is None else command.frame
    flight.change_altitude(altitude_above_sea(command.params[6], frame, flight))


def _enable_fence(flight: Flight, command: Command) -> None:
    flight.fence.enabled = _switch(command.params[0], "fence")


def _pause_continue(flight: Flight, command: Command) -> None:
    if _switch(command.params[0], "continue"):
        flight.resume()
    else:
        flight.pause()


def _override_goto(flight: Flight, command: Command) -> None:
    """The older command to pause and continue: MAV_GOTO_DO_HOLD is 0, MAV_GOTO_DO_CONTINUE 1."""
    _pause_continue(flight, command)
