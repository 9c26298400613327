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
from sitl.mavlink.service import Service

__all__ = ["FlightCommands"]

FORCE = 21196.0  # the number that overrides the checks of arming and disarming
CHANGE_MODE = 1  # bit of DO_REPOSITION: also out of a mode that flies elsewhere
NO_CHANGE, AS_USUAL = -1.0, -2.0  # speeds that mean something else
AIRSPEED, GROUND_SPEED = 0, 1  # SPEED_TYPE
UNCHANGED = 5  # ORBIT_YAW_BEHAVIOUR


class FlightCommands(Service):
    """Everything a pilot can command."""

    def commands(self) -> Mapping[int, CommandHandler]:
        """See Service."""
        table: dict[int, Callable[[Flight, Command], None]] = {
            mav.MAV_CMD_COMPONENT_ARM_DISARM: _arm_disarm,
            mav.MAV_CMD_NAV_TAKEOFF: self._takeoff,
            mav.MAV_CMD_NAV_VTOL_TAKEOFF: self._takeoff,
            mav.MAV_CMD_NAV_LAND: _land,
            mav.MAV_CMD_NAV_VTOL_LAND: _land,
            mav.MAV_CMD_NAV_RETURN_TO_LAUNCH: _return,
            mav.MAV_CMD_NAV_LOITER_UNLIM: _loiter,
            mav.MAV_CMD_DO_VTOL_TRANSITION: _transition,
            mav.MAV_CMD_DO_REPOSITION: _reposition,
            mav.MAV_CMD_DO_ORBIT: _orbit,
            mav.MAV_CMD_DO_CHANGE_SPEED: _change_speed,
            mav.MAV_CMD_DO_CHANGE_ALTITUDE: _change_altitude,
            mav.MAV_CMD_DO_SET_HOME: _set_home,
            mav.MAV_CMD_DO_FLIGHTTERMINATION: _terminate,
            mav.MAV_CMD_DO_FENCE_ENABLE: _enable_fence,
            mav.MAV_CMD_MISSION_START: self._start_mission,
            mav.MAV_CMD_DO_PAUSE_CONTINUE: _pause_continue,
            mav.MAV_CMD_DO_LAND_START: lambda flight, _: flight.land_as_planned(),
            mav.MAV_CMD_OVERRIDE_GOTO: _override_goto,
        }
        return {command: partial(self._carry_out, action) for command, action in table.items()}

    def _carry_out(self, action: Callable[[Flight, Command], None], command: Command) -> int:
        try:
            action(self.exchange.simulation.flight, command)
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
            goal = place_in(command, flight).altitude
        flight.takeoff(goal - (flight.places.altitude - flight.view.down))

    def _start_mission(self, flight: Flight, command: Command) -> None:
        """As ground stations use it: it arms, too."""
        first = whole_number(command.params[0]) or 0
        if self.exchange.identity.mission_has_home:
            first = max(first - 1, 0)
        flight.start_mission(first)
        flight.arm()


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


def _arm_disarm(flight: Flight, command: Command) -> None:
    forced = command.params[1] == FORCE
    if _switch(command.params[0], "arm"):
        flight.arm(force=forced)
    else:
        flight.disarm(force=forced)


def _land(flight: Flight, command: Command) -> None:
    flight.land(_place_or_here(flight, command))


def _place_or_here(flight: Flight, command: Command) -> Place | None:
    """North and east [m] of the place named; None if none is."""
    where = place_in(command, flight)
    if where.is_here:
        return None
    _check_on_map(where)
    north, east, _ = flight.places.to_ned(where.latitude, where.longitude, flight.places.altitude)
    return north, east


def _check_on_map(where: MapPlace) -> None:
    if not (abs(where.latitude) <= 90.0 and abs(where.longitude) <= 180.0):
        msg = f"place: expected latitude and longitude [deg], got {where.latitude:g}, {where.longitude:g}"
        raise Refused(msg)


def _return(flight: Flight, command: Command) -> None:
    del command
    flight.return_home()


def _loiter(flight: Flight, command: Command) -> None:
    """Where it is, or at the place named."""
    where = place_in(command, flight)
    radius = _given(command.params[2]) or None
    if where.is_here and radius is None:
        flight.hold()
    else:
        flight.reposition(*where, radius=radius)


def _transition(flight: Flight, command: Command) -> None:
    state = whole_number(command.params[0])
    if state not in (mav.MAV_VTOL_STATE_MC, mav.MAV_VTOL_STATE_FW):
        msg = (
            f"transition: expected {mav.MAV_VTOL_STATE_MC} (hover) or {mav.MAV_VTOL_STATE_FW} (cruise), "
            f"got {command.params[0]:g}"
        )
        raise Refused(msg)
    flight.transition(state == mav.MAV_VTOL_STATE_FW)


def _reposition(flight: Flight, command: Command) -> None:
    speed, flags, radius, heading = command.params[:4]
    if not (whole_number(flags) or 0) & CHANGE_MODE and flight.mode != Mode.HOLD:
        msg = f"reposition: in {flight.mode.title} only with the flag to change the mode (param2 = {CHANGE_MODE})"
        raise Refused(msg, temporary=True)
    where = place_in(command, flight)
    flight.reposition(
        *where,
        speed=_given(speed) if speed > 0.0 else None,
        radius=_given(radius) or None,
        heading=_given(heading),
    )


def _orbit(flight: Flight, command: Command) -> None:
    radius, speed, yaw = command.params[:3]
    number = UNCHANGED if math.isnan(yaw) else whole_number(yaw)
    try:
        behaviour = YawBehaviour.CENTRE if number == UNCHANGED else YawBehaviour(-1 if number is None else number)
    except ValueError:
        known = ", ".join(str(int(one)) for one in YawBehaviour)
        msg = f"orbit: expected a yaw behaviour of {known} or {UNCHANGED}, got {yaw:g}"
        raise Refused(msg) from None
    altitude = place_in(command, flight).altitude
    flight.orbit(
        _place_or_here(flight, command),
        _given(radius),
        _given(speed),
        down=None if math.isnan(altitude) else flight.places.altitude - altitude,
        yaw=behaviour,
    )


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


def _set_home(flight: Flight, command: Command) -> None:
    here = command.params[0]
    if not math.isnan(here) and _switch(here, "home here"):
        flight.set_home()
        return
    where = place_in(command, flight)
    if where.is_here:
        msg = "home: expected latitude and longitude [deg], got none"
        raise Refused(msg)
    flight.set_home(where.latitude, where.longitude, where.altitude)


def _terminate(flight: Flight, command: Command) -> None:
    if _switch(command.params[0], "terminate"):
        flight.terminate()
    elif flight.mode == Mode.TERMINATION:
        msg = "flight terminated: only disarming ends it"
        raise Refused(msg, temporary=True)


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
