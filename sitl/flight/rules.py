"""What speaks against a command: the rules of mode changes, transitions, places and speeds."""

import math

from sitl.flight.events import Events
from sitl.flight.feasibility import LARGEST_RADIUS
from sitl.flight.mode import Mode
from sitl.flight.refused import Refused

__all__ = ["LOWEST", "Rules"]

TRANSITION_HEIGHT = 10.0  # above home, least for a transition to cruise [m]
LOWEST = 2.0  # height above home, least to be sent to [m]
NO_MISSION = "no mission: upload one first"
CIRCLE_POINTS = 24  # of an orbit that are compared with the fence


class Rules(Events):
    """A flight that can tell whether a command may be carried out. Each check raises Refused with the reason."""

    @property
    def _has_pilot(self) -> bool:
        """Sticks have been heard of, and are not lost."""
        age = self.links.manual_control
        lost = self.links.enforced and age is not None and age > self.parameters["COM_RC_LOSS_T"]
        return math.isfinite(self.sticks.received) and not lost

    @property
    def _has_setpoints(self) -> bool:
        links = self.links
        fresh = not links.enforced or (
            links.offboard is not None and links.offboard <= self.parameters["COM_OF_LOSS_T"]
        )
        return self._offboard.setpoint is not None and fresh

    def _check_mode(self, mode: Mode) -> None:
        self._check_not_terminated()
        if mode == Mode.RETURN:
            self._check_flying("return")
        if mode == Mode.MISSION and not self.mission.items:
            raise Refused(NO_MISSION)
        if mode == Mode.OFFBOARD and not self._has_setpoints:
            msg = "no offboard setpoints: send them first"
            raise Refused(msg, temporary=True)
        if mode in (Mode.MANUAL, Mode.STABILIZED) and not self._has_pilot:
            msg = f"{mode.title} needs manual control"
            raise Refused(msg, temporary=True)

    def _check_item(self, item: int) -> None:
        if not self.mission.items:
            raise Refused(NO_MISSION)
        if not 0 <= item < len(self.mission.items):
            msg = f"mission item: expected one of {len(self.mission.items)}, counted from 0, got {item}"
            raise Refused(msg)

    def _check_not_terminated(self) -> None:
        if self.mode == Mode.TERMINATION:
            msg = "flight terminated: only disarming ends it"
            raise Refused(msg, temporary=True)

    def _check_flying(self, what: str) -> None:
        self._check_not_terminated()
        if not self.flying:
            msg = f"cannot {what}: on the ground"
            raise Refused(msg, temporary=True)

    def _check_transition(self, cruise: bool) -> None:
        if self.actuators.tilt_stuck:
            msg = "no transition: tilt servo failed"
            raise Refused(msg, temporary=True)
        if cruise and not self.regime.wing_borne and self.height < TRANSITION_HEIGHT:
            msg = f"no transition to cruise: {self.height:.0f} m above home, at least {TRANSITION_HEIGHT:g} m"
            raise Refused(msg, temporary=True)
        wind = math.hypot(self.view.wind_north, self.view.wind_east)
        name = "FW_AIRSPD_TRIM" if cruise else "FW_AIRSPD_MIN"
        if wind > self.parameters[name]:
            msg = f"no transition: wind {wind:.0f} m/s, at most {name} = {self.parameters[name]:g} m/s"
            raise Refused(msg, temporary=True)

    def _check_numbers(self, **numbers: float | None) -> None:
        for name, value in numbers.items():
            if value is not None and not math.isfinite(value):
                msg = f"{name}: expected a finite number, got {value:g}"
                raise Refused(msg)

    def _check_radius(self, radius: float) -> None:
        if not 0.0 < abs(radius) <= LARGEST_RADIUS:
            msg = f"radius: expected one other than 0, up to {LARGEST_RADIUS:g} m, got {radius:g} m"
            raise Refused(msg)

    def _check_inside(self, north: float, east: float, down: float | None = None) -> None:
        if not (math.isfinite(north) and math.isfinite(east)):
            msg = f"place: expected finite north and east [m], got {north:g}, {east:g}"
            raise Refused(msg)
        reason = self.fence.breach_at(north, east)
        if reason is not None:
            msg = f"place is outside the geofence: {reason}"
            raise Refused(msg)
        if down is not None:
            self._check_height(down)

    def _check_circle(self, centre: tuple[float, float], radius: float, down: float) -> None:
        """The circle itself must keep inside; its centre may be something to stay out of."""
        for i in range(CIRCLE_POINTS):
            angle = 2.0 * math.pi * i / CIRCLE_POINTS
            self._check_inside(centre[0] + radius * math.cos(angle), centre[1] + radius * math.sin(angle))
        self._check_height(down)

    def _check_height(self, down: float) -> None:
        height = self.home.down - down
        if not (math.isfinite(height) and height >= LOWEST):
            msg = f"altitude: expected at least {LOWEST:g} m above home, got {height:g} m"
            raise Refused(msg)
        self._check_ceiling(down)

    def _check_ceiling(self, down: float) -> None:
        reason = self.fence.breach_above(down)
        if reason is not None:
            msg = f"altitude is outside the geofence: {reason}"
            raise Refused(msg)

    def _check_speed(self, airspeed: float | None, ground_speed: float | None) -> None:
        lowest, highest = self.parameters["FW_AIRSPD_MIN"], self.parameters["FW_AIRSPD_MAX"]
        if airspeed is not None and not lowest <= airspeed <= highest:
            msg = f"airspeed: expected {lowest:g} to {highest:g} m/s, got {airspeed:g}"
            raise Refused(msg)
        highest = self.parameters["MPC_XY_VEL_MAX"]
        if ground_speed is not None and not 0.0 < ground_speed <= highest:
            msg = f"ground speed: expected up to {highest:g} m/s, got {ground_speed:g}"
            raise Refused(msg)
