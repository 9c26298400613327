"""Whether the vehicle stands on the ground, and what follows: landed state, contact, automatic disarm.

No switch feels the ground. That it carries the vehicle follows from what the control laws ask and what happens: they
ask it to sink with less thrust than hover takes, yet it does not sink. Thrust is then taken away, and a vehicle that
keeps still without it has landed. So has one that keeps still in a way in which nothing flies: a crashed one.
"""

import math
from enum import IntEnum

from sitl.control.records import Level
from sitl.flight.debounce import Debounce
from sitl.flight.demand import Demand
from sitl.flight.parameters import Parameters
from sitl.flight.view import View

__all__ = ["AutoDisarm", "LandedDetector", "LandedState"]

SINKING = 0.12  # less than this is not sinking [m/s]
SINK_ASKED = 0.15  # a demand for more than this is one to sink [m/s]
DEPTH_ASKED = 0.5  # as is one for a height so far below [m]: farther than gusts carry a vehicle that holds its height
ASKED_TIME = 0.6  # after which a vehicle in the air would have begun to sink [s]
CONTACT_TIME = 0.3  # [s]
CONTACT_THRUST = 0.97  # of that in hover: more than this would fly
FELL_ON = 0.25  # sinking faster than this, contact was a mistake: a gust, or an edge [m/s]

HOVER_SLOWNESS = 2.0  # time constant with which hover thrust is learnt [s]
HOVER_TRACKING = 0.2  # while the vertical speed is so near to that asked for [m/s]

LOW_THRUST = 0.3  # of that in hover: with less no flight is still
POWERLESS_TIME = 0.2  # in which a vehicle in the air would begin to fall [s]
STILL_TIME = 0.5  # [s]
STILL_CLIMB = 0.1  # [m/s]
STILL_SPEED = 0.3  # far above the creep of a vehicle that the wind pushes over the ground [m/s]
STILL_RATE = 0.2  # [rad/s]
CRASHED_TIME = 3.0  # of stillness in which nothing carries, after which a vehicle is down however it lies [s]
LYING = 0.5  # cosine of the lean of a vehicle that lies, and share of its thrust that may point up
SINK_DENIED = 0.25  # sink rate that is at least asked for when nothing but the ground can keep the vehicle up [m/s]

HOVER_SPEED = 1.5  # over the ground, faster is no landing [m/s]
ROLLING_SPEED = 12.0  # unless the vehicle is known to land: with its wing stuck it touches down in forward flight [m/s]
AIRSPEED_MARGIN = 0.9  # of FW_AIRSPD_MIN: wing-borne flight begins here

LEFT_CLIMB = 0.15  # [m/s]
LEFT_HEIGHT = 0.15  # above where it stood [m]
LEFT_TIME = 0.1  # [s]


class LandedState(IntEnum):
    """Where the vehicle is between standing and flying; numbers as MAVLink's MAV_LANDED_STATE."""

    ON_GROUND = 1
    IN_AIR = 2
    TAKEOFF = 3
    LANDING = 4


class LandedDetector:
    """Decides at every update of the flight whether the vehicle flies.

    Attributes:
        state: as `update` returned it last.
        contact: the ground carries at least part of the weight: always when landed; before that as soon as the vehicle
            no longer sinks though told to. Time to take the thrust away.
        hover_thrust: share of the largest thrust that hover takes, learnt in hovering flight.
    """

    def __init__(self, parameters: Parameters, hover_thrust: float = 0.6) -> None:
        """`hover_thrust` is a first guess (0..1)."""
        self.hover_thrust = hover_thrust
        self._parameters = parameters
        self._asked = Debounce()
        self._stopped = Debounce()
        self._still = Debounce()
        self._crashed = Debounce()
        self._powerless = Debounce()
        self._rising = Debounce()
        self._slow = False  # slow enough for a landing
        self._time = self._ground_down = math.nan
        self.begin(airborne=False)

    def begin(self, *, airborne: bool) -> None:
        """Start on the ground or in the air."""
        self.state = LandedState.IN_AIR if airborne else LandedState.ON_GROUND
        self._time = self._ground_down = math.nan
        self._forget()
        self.contact = not airborne

    def update(
        self, view: View, demand: Demand, armed: bool, *, taking_off: bool = False, landing: bool = False
    ) -> LandedState:
        """Judge the present moment from what is seen and what is asked for.

        `taking_off` and `landing` tell what a vehicle in the air is about; they change nothing but the state's name.
        """
        level = demand.level
        if self.state is LandedState.ON_GROUND:
            if not self._left(view, armed and level >= Level.DIRECT):
                return self.state
            self.contact = False
        elif self._comes_down(view, demand, level, landing):
            self.begin(airborne=False)
            return self.state
        self.state = LandedState.TAKEOFF if taking_off else LandedState.LANDING if landing else LandedState.IN_AIR
        return self.state

    def _left(self, view: View, powered: bool) -> bool:
        """Whether a vehicle that stood on the ground has left it by its own power."""
        if not powered or math.isnan(self._ground_down):
            self._ground_down = view.down  # it may be carried about, or slide, while it does not fly
            return False
        rises = view.vd < -LEFT_CLIMB or view.down < self._ground_down - LEFT_HEIGHT
        return self._rising.held(rises, view.time) >= LEFT_TIME

    def _comes_down(self, view: View, demand: Demand, level: int, landing: bool) -> bool:
        """Whether a vehicle believed to fly stands on the ground; updates `contact` and the hover thrust."""
        speed = math.hypot(view.vn, view.ve)
        still = (
            abs(view.vd) < STILL_CLIMB
            and speed < STILL_SPEED
            and max(abs(view.p), abs(view.q), abs(view.r)) < STILL_RATE
        )
        if self._crashed.held(still and self._cannot_fly(view, demand, level), view.time) >= CRASHED_TIME:
            return True
        fastest = ROLLING_SPEED if landing else HOVER_SPEED
        # No look at the tilt: hovering against a strong wind the wing lies as flat as in flight.
        if speed > fastest or view.airspeed > AIRSPEED_MARGIN * self._parameters["FW_AIRSPD_MIN"]:
            if self._slow:
                self._forget()
            return False
        self._slow = True
        if level == Level.VELOCITY:
            self._feel(view, demand, hovers=speed < HOVER_SPEED)
        else:
            self.contact = False
        stands = self._still.held(still, view.time) >= STILL_TIME
        powerless = still and self._is_powerless(view, demand, level)
        return self._powerless.held(powerless, view.time) >= POWERLESS_TIME and stands

    def _feel(self, view: View, demand: Demand, hovers: bool) -> None:
        """Update `contact`, and what hover takes."""
        rate = demand.down_rate
        if rate is None:
            # While it slows down, height is traded for speed: not sinking at once means nothing.
            rate = demand.sink_rate if hovers and demand.down - view.down > DEPTH_ASKED else 0.0
        step = view.time - self._time
        self._time = view.time
        if hovers and not self.contact and abs(view.vd - rate) < HOVER_TRACKING and 0.0 < step < HOVER_SLOWNESS:
            self.hover_thrust += (view.thrust - self.hover_thrust) * step / HOVER_SLOWNESS
        asked = rate > SINK_ASKED
        asked_long = self._asked.held(asked, view.time) >= ASKED_TIME
        if self.contact:
            self.contact = asked and view.vd < FELL_ON
        else:
            carried = asked_long and abs(view.vd) < SINKING and view.thrust < CONTACT_THRUST * self.hover_thrust
            self.contact = self._stopped.held(carried, view.time) >= CONTACT_TIME

    def _cannot_fly(self, view: View, demand: Demand, level: int) -> bool:
        """Whether no vehicle in the air is still like this, so that one that keeps still is a wreck on the ground.

        It lies on its back or side and the rotors do not point up; or it is to sink, pulls harder than a hover takes,
        and yet does not: a fallen vehicle that tries to right itself. Settling down is `contact`'s affair.
        """
        roll, pitch, tilt = math.cos(view.roll), math.cos(view.pitch), view.tilt
        upward = math.sin(view.pitch) * math.cos(tilt) + roll * pitch * math.sin(tilt)
        if roll * pitch < LYING and upward < LYING:
            return True
        rate = demand.down_rate if level == Level.VELOCITY else None
        return rate is not None and rate > SINK_DENIED and view.thrust >= CONTACT_THRUST * self.hover_thrust

    def _is_powerless(self, view: View, demand: Demand, level: int) -> bool:
        """Whether there is too little thrust to fly."""
        low = LOW_THRUST * self.hover_thrust
        if level == Level.VELOCITY:
            return self.contact and view.thrust < low
        if level == Level.ATTITUDE:
            return demand.thrust < low
        if level == Level.DIRECT:
            return demand.throttle < low
        return True

    def _forget(self) -> None:
        """Begin all timing anew."""
        self._slow = False
        self.contact = False
        for timer in (self._asked, self._stopped, self._still, self._crashed, self._powerless, self._rising):
            timer.held(False, 0.0)


class AutoDisarm:
    """Disarms a vehicle that has landed, or that was armed and then not flown."""

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters
        self._grounded = Debounce()
        self._flown = False

    def update(self, time: float, armed: bool, landed: LandedState) -> str | None:
        """Why to disarm now (COM_DISARM_LAND, COM_DISARM_PRFLT), or None; `time` is simulated [s]."""
        on_ground = landed == LandedState.ON_GROUND
        self._flown = armed and (self._flown or not on_ground)
        held = self._grounded.held(armed and on_ground, time)
        delay = self._parameters["COM_DISARM_LAND" if self._flown else "COM_DISARM_PRFLT"]
        if held < 0.0 or delay <= 0.0 or held < delay:
            return None
        return "landed" if self._flown else f"no take-off within {delay:g} s of arming"
