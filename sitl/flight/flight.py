"""The flight as whoever commands it sees it: pilot, ground station, script, scenario.

Places are north, east and down from the local frame's origin [m], or latitude, longitude [deg] and altitude above mean
sea level [m]; speeds are m/s, angles radians. Every command that is not carried out raises Refused with the reason.
"""

import math
from collections.abc import Sequence

from sitl.flight.landed import AutoDisarm, LandedState
from sitl.flight.manoeuvres import Place, YawBehaviour
from sitl.flight.manual_input import ManualInput
from sitl.flight.messages import Severity
from sitl.flight.mission_items import MissionItem
from sitl.flight.mode import Mode
from sitl.flight.offboard import AttitudeSetpoint, MotionSetpoint
from sitl.flight.refused import Refused
from sitl.flight.rules import LOWEST, Rules

__all__ = ["Flight"]

HIGHEST = 5000.0  # that a take-off may climb [m]
LONGEST_TEST = 60.0  # of an actuator [s]
HOME_STAYS = 5.0  # distance from home up to which arming does not move it [m]


class Flight(Rules):
    """Commands to a flight; `update(view)` at 50 Hz lets it happen, `demand.record` is what the laws are asked."""

    # Arming.

    def check_arming(self, mode: Mode | None = None) -> list[str]:
        """All that speaks against arming now, in the present mode or another one; none if nothing does."""
        mode = self.mode if mode is None else mode
        is_flown = mode == Mode.MISSION and bool(self.mission.items)  # to judge a long one takes its time
        return self._checks.problems(
            self.view,
            self.landed,
            mode,
            inside_fence=self.breach is None,
            mission_feasible=not self.mission.problems() if is_flown else None,
            faults=self.actuators.faults,
            throttle=self.sticks.now.throttle if self._has_pilot else None,
        )

    def arm(self, *, force: bool = False) -> None:
        """Let the motors turn. Raises Refused with all that speaks against it; `force` overrides that."""
        if self.armed:
            return
        self.arming_problems = self.check_arming()
        if self.arming_problems and not force:
            raise Refused(f"not armed: {'; '.join(self.arming_problems)}", temporary=True)
        self.armed = True
        self.actuator_test.stop()
        self._auto_disarm = AutoDisarm(self.parameters)
        self._move_home_here()
        self._enter(self.mode)
        self.say(Severity.NOTICE, "Armed by force" if self.arming_problems else "Armed")

    def disarm(self, *, force: bool = False) -> None:
        """Stop the motors. Raises Refused in flight, unless by force."""
        if not self.armed:
            return
        if self.flying and not force and self.mode != Mode.TERMINATION:
            msg = "not disarmed: flying"
            raise Refused(msg, temporary=True)
        self._disarm("by force" if self.flying else "by command")

    def terminate(self) -> None:
        """Stop the motors and centre the servos for good: only disarming ends it. Raises Refused if disarmed."""
        if not self.armed:
            msg = "not terminated: disarmed"
            raise Refused(msg, temporary=True)
        self.failsafes.pilot_took_over()
        self._enter(Mode.TERMINATION)
        self.say(Severity.EMERGENCY, "Flight terminated")

    def test_actuator(self, control: int, value: float, seconds: float, delay: float = 0.0) -> None:
        """Move one control (as in `vehicle_model.state`: throttle or angle [rad]) for a while, after a delay [s].

        Raises Refused while armed or in the air, and for what is not a finite number or takes longer than a minute.
        """
        self._check_numbers(value=value, seconds=seconds, delay=delay)
        if self.armed or not self.on_ground:
            msg = "no actuator test: only on the ground and disarmed"
            raise Refused(msg, temporary=True)
        if not (0.0 <= seconds <= LONGEST_TEST and 0.0 <= delay <= LONGEST_TEST):
            msg = f"actuator test: expected 0 to {LONGEST_TEST:g} s, got {seconds:g} s after {delay:g} s"
            raise Refused(msg)
        self.actuator_test.add(control, value, self.view.time + delay, seconds)

    # Modes.

    def set_mode(self, mode: Mode) -> None:
        """Fly in another mode. Raises Refused for one that cannot be flown now."""
        match mode:
            case Mode.TERMINATION:
                self.terminate()
            case Mode.TAKEOFF:
                self.takeoff()
            case Mode.LAND:
                self.land()
            case Mode.ORBIT:
                self.orbit()
            case _:
                self._check_mode(mode)
                waits = mode == Mode.MISSION and self.mission.paused
                if mode != self.mode or mode == Mode.HOLD or waits:
                    self._take(mode)

    def takeoff(self, height: float | None = None) -> None:
        """Climb to a height [m] above where the vehicle stands, by default MIS_TAKEOFF_ALT; once armed, if it is not.

        In flight: Hold, but a take-off under way goes on. Raises Refused for a height that is none, too low or higher
        than the fence allows.
        """
        self._check_not_terminated()
        if height is not None and not (LOWEST <= height <= HIGHEST or (self.flying and math.isfinite(height))):
            msg = f"take-off height: expected {LOWEST:g} to {HIGHEST:g} m, got {height:g}"
            raise Refused(msg)
        if self.flying:
            if self.mode != Mode.TAKEOFF:
                self._take(Mode.HOLD)
            return
        climb = self.parameters["MIS_TAKEOFF_ALT"] if height is None else height
        self._check_ceiling(self.view.down - climb)
        self._takeoff.height = height
        self._take(Mode.TAKEOFF)

    def land(self, place: Place | None = None) -> None:
        """Land at a place (north, east) [m], or where the vehicle comes to a stop; raises Refused on the ground."""
        self._check_flying("land")
        if place is not None:
            self._check_inside(*place)
        if self.mode == Mode.LAND and place == self._land.place:
            return
        self._land.place = place
        self._take(Mode.LAND)

    def return_home(self) -> None:
        """Return to home, a rally point or the mission's landing, as RTL_TYPE says; raises Refused on the ground."""
        self.set_mode(Mode.RETURN)

    def hold(self) -> None:
        """Stay here, hovering or circling by regime."""
        self.set_mode(Mode.HOLD)

    # Regime.

    def transition(self, cruise: bool) -> None:
        """Go on wing-borne, or hovering, in the present mode, as it may already; from a take-off or landing into Hold.

        Raises Refused on the ground, too low, in a wind that does not allow it, or with a tilt that does not move.
        """
        self._check_flying("make a transition")
        self._check_transition(cruise)
        if self.mode not in (Mode.TAKEOFF, Mode.LAND):
            if self._behaviour.cruise == cruise and not self.mode.by_sticks:
                return
            self._behaviour.fly(self.view, cruise)
        elif cruise:
            self._take(Mode.HOLD)
            self._hold.fly(self.view, True)
        self.say(Severity.INFO, f"Transition to {'cruise' if cruise else 'hover'}")

    # Places.

    def go_to(
        self,
        north: float,
        east: float,
        down: float,
        *,
        speed: float | None = None,
        radius: float | None = None,
        heading: float | None = None,
    ) -> None:
        """Fly to a point and hold there: hover with a heading, or circle at a radius, by regime.

        Raises Refused on the ground, for a place outside the fence, too high or too low, an impossible speed or radius,
        or what is not a finite number.
        """
        self._check_flying("go anywhere")
        self._check_numbers(north=north, east=east, down=down, heading=heading)
        self._check_inside(north, east, down)
        if radius is not None:
            self._check_radius(radius)
        if speed is not None:
            self._check_speed(speed if self.regime.wing_borne else None, None if self.regime.wing_borne else speed)
        self._take(Mode.HOLD)
        self._hold.go_to(self.view, (north, east), down, radius, heading)
        if speed is not None:
            self._hold.change_speed(airspeed=speed, ground_speed=speed)

    def reposition(
        self,
        latitude_deg: float = math.nan,
        longitude_deg: float = math.nan,
        altitude_msl: float = math.nan,
        *,
        speed: float | None = None,
        radius: float | None = None,
        heading: float | None = None,
    ) -> None:
        """As `go_to`, to a place on the map.

        As in MAVLink's DO_REPOSITION latitude and longitude that both are not a number (nan), and an altitude that is
        none, are those of the present position. Raises Refused for one without the other, or off the map.
        """
        latitude, longitude, altitude = self.places.to_geodetic(self.view.north, self.view.east, self.view.down)
        if not (math.isnan(latitude_deg) and math.isnan(longitude_deg)):
            if not (abs(latitude_deg) <= 90.0 and abs(longitude_deg) <= 180.0):
                where = f"{latitude_deg:g}, {longitude_deg:g}"
                msg = f"place: expected latitude and longitude [deg] or neither, got {where}"
                raise Refused(msg)
            latitude, longitude = latitude_deg, longitude_deg
        if not math.isnan(altitude_msl):
            self._check_numbers(altitude=altitude_msl)
            altitude = altitude_msl
        place = self.places.to_ned(latitude, longitude, altitude)
        self.go_to(*place, speed=speed, radius=radius, heading=heading)

    def orbit(
        self,
        centre: Place | None = None,
        radius: float | None = None,
        speed: float | None = None,
        *,
        down: float | None = None,
        yaw: YawBehaviour = YawBehaviour.CENTRE,
    ) -> None:
        """Fly around a centre (north, east), by default here, at a radius, clockwise if positive, and a speed.

        Raises Refused on the ground, for an orbit that leaves the fence, or one too tight for its speed and the wind.
        """
        self._check_flying("orbit")
        self._check_numbers(radius=radius, speed=speed, down=down)
        view = self.view
        centre = (view.north, view.east) if centre is None else centre
        radius = self.parameters["NAV_LOITER_RAD"] if radius is None else radius
        down = view.down if down is None else down
        self._check_radius(radius)
        self._check_circle(centre, radius, down)
        cruise = self.regime.wing_borne
        if speed is not None:
            self._check_speed(speed if cruise else None, None if cruise else speed)
        self._orbit.go_round(view, centre, down, radius, speed, yaw, cruise=cruise)
        self._take(Mode.ORBIT)

    def change_speed(self, *, airspeed: float | None = None, ground_speed: float | None = None) -> None:
        """Fly at another airspeed wing-borne, or ground speed in hover, until the mode changes.

        Raises Refused for a speed the vehicle does not fly at, and in modes where sticks or missions set it.
        """
        self._check_speed(airspeed, ground_speed)
        self._behaviour.change_speed(airspeed=airspeed, ground_speed=ground_speed)

    def change_altitude(self, altitude_msl: float) -> None:
        """Hold or orbit at another altitude above mean sea level [m].

        Raises Refused where nothing holds one, or for one that is too low or higher than the fence allows.
        """
        self._check_flying("change altitude")
        down = self.places.altitude - altitude_msl
        self._check_height(down)
        self._behaviour.change_altitude(down)

    def land_as_planned(self) -> None:
        """Fly the mission's landing now (DO_LAND_START). Raises Refused on the ground and without one."""
        self._check_flying("land")
        start = self.mission.land_start_index()
        if start is None:
            msg = "no landing in the mission: DO_LAND_START marks one"
            raise Refused(msg)
        self.start_mission(start)

    def set_home(
        self,
        latitude_deg: float | None = None,
        longitude_deg: float | None = None,
        altitude_msl: float | None = None,
    ) -> None:
        """Home is at this place of the map from now on; below the vehicle without one."""
        if latitude_deg is None or longitude_deg is None or altitude_msl is None:
            self.home.move(self.view.north, self.view.east, self._ground_below)
        elif math.isfinite(altitude_msl) and abs(latitude_deg) <= 90.0 and abs(longitude_deg) <= 180.0:
            self.home.move_to(latitude_deg, longitude_deg, altitude_msl)
        else:
            where = f"{latitude_deg:g}, {longitude_deg:g}, {altitude_msl:g}"
            msg = f"home: expected latitude, longitude [deg] and altitude [m], got {where}"
            raise Refused(msg)
        self.say(Severity.INFO, "Home set")

    # Missions.

    def load_mission(self, items: Sequence[MissionItem]) -> None:
        """Replace the mission. Raises InfeasibleMissionError, which names items and reasons."""
        self.mission.load(items)
        if self.mode != Mode.MISSION or not self.armed:
            self._mission_mode.begin_at(0)
        elif not items:
            self._take(Mode.HOLD)

    def start_mission(self, first: int = 0) -> None:
        """Fly the mission from an item on; once armed, if it is not. Raises Refused if there is no such item."""
        self._check_mode(Mode.MISSION)
        self._check_item(first)
        self._mission_mode.begin_at(first)
        self._take(Mode.MISSION)

    def jump_to(self, item: int) -> None:
        """Go on with this item, at once or when the mission is flown next. Raises Refused if there is none."""
        self._check_item(item)
        self.mission.jump_to(item)
        if self.mode != Mode.MISSION or not self.armed:
            self._mission_mode.begin_at(item)

    def pause(self) -> None:
        """Hold, to go on with the mission later. Raises Refused on the ground."""
        self._check_flying("pause")
        self._take(Mode.HOLD)

    def resume(self) -> None:
        """Go on with the mission where it was left, or stands still of itself. Raises Refused if there is none."""
        self.set_mode(Mode.MISSION)

    # Streams.

    def manual(self, sticks: ManualInput) -> None:
        """The pilot's sticks are here now."""
        self.sticks.now = sticks
        self.sticks.received = self.view.time

    def offboard(self, setpoint: MotionSetpoint | AttitudeSetpoint) -> None:
        """A setpoint from a computer outside; flown in Offboard, and needed before it."""
        self._offboard.give(setpoint, self.view.time)

    # How it is done.

    @property
    def _ground_below(self) -> float:
        """Where the ground is [m, NED down]: under the gear of a vehicle that stands, else as high as home's."""
        return self.view.down + self._standing_height if self.on_ground else self.home.down

    def _take(self, mode: Mode) -> None:
        """Enter a mode at a pilot's word."""
        self.failsafes.pilot_took_over()
        self._enter(mode)

    def _move_home_here(self) -> None:
        """Home is where a flight begins, unless that is where it is anyway."""
        distance = math.hypot(self.home.north - self.view.north, self.home.east - self.view.east)
        if self.landed == LandedState.ON_GROUND and distance > HOME_STAYS:
            self.home.move(self.view.north, self.view.east, self._ground_below)
