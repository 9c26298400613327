"""Altitude and Position: sticks ask for motion, and what they leave centred is held.

Hovering, the throttle stick climbs and the others move the vehicle along its heading: through the air in Altitude,
over the ground in Position. Wing-borne, the
throttle stick sets the airspeed, the roll stick banks and the pitch stick climbs and sinks.
"""

import math

from sitl.flight.behaviour import Behaviour
from sitl.flight.demand import Demand
from sitl.flight.landed import LandedState
from sitl.flight.manoeuvres import Hold, Place, landing_rate
from sitl.flight.manual_input import Sticks, past_dead_zone
from sitl.flight.parameters import Parameters
from sitl.flight.places import Home
from sitl.flight.regime import wing_borne
from sitl.flight.view import View
from vehicle_model.earth import STANDARD_GRAVITY

__all__ = ["Altitude", "Position"]

LEVEL = math.radians(5.0)  # bank below which a turn has ended and a course can be held
COURSE_LENGTH = 20_000.0  # of the leg that stands for a course [m]
LEVEL_OFF = 0.7  # time in which a climb is taken to end once the stick is centred [s]


class Altitude(Behaviour):
    """Height is held, or changed by a stick; with centred sticks the vehicle comes to rest in the air, and drifts.

    Hovering, a stick asks for the acceleration of a lean, up to MPC_MAN_TILT_MAX, less one against the airspeed and in
    proportion to it, so that a full stick ends at an airspeed of MPC_XY_VEL_MAX. That takes the place of the vehicle's
    own drag, which the control laws cancel.
    """

    def __init__(self, parameters: Parameters, demand: Demand, sticks: Sticks, home: Home) -> None:
        self.down: float | None = None  # height held [m], None while a stick changes it
        self.heading: float | None = None
        self._parameters = parameters
        self._demand = demand
        self._sticks = sticks
        self._home = home

    def start(self, view: View, cruise: bool) -> None:
        """Begin in a regime, holding the present height and heading."""
        self.cruise = cruise
        self.down = view.down
        self.heading = view.yaw

    def fly(self, view: View, cruise: bool) -> None:
        """Go on in another regime."""
        self.start(view, cruise)

    def lifts(self, view: View) -> bool:  # noqa: ARG002
        """Whether the throttle stick asks a standing vehicle to climb."""
        return self._sticks.now.up > 0.0

    def update(self, view: View, landed_state: LandedState) -> bool:  # noqa: ARG002
        """Ask for what the sticks say."""
        parameters, sticks = self._parameters, self._sticks.now
        if self.cruise:
            self._on_the_wing(view)
            up = -past_dead_zone(sticks.forward)
            self._vertical(view, up, parameters["FW_T_CLMB_MAX"], parameters["FW_T_SINK_MAX"])
            return False
        self._in_hover(view)
        # Near the ground, as far as home's height tells of it, the stick cannot ask for a hard landing.
        sink = landing_rate(parameters, self._home.down - view.down, parameters["MPC_Z_VEL_MAX_DN"])
        self._vertical(view, sticks.up, parameters["MPC_Z_VEL_MAX_UP"], sink)
        self._turn(view)
        return False

    def _in_hover(self, view: View) -> None:
        parameters, sticks = self._parameters, self._sticks.now
        if wing_borne(view, parameters):
            self.heading = view.yaw  # the nose stays in the airflow until the rotors carry
        forward, right = past_dead_zone(sticks.forward), past_dead_zone(sticks.right)
        fullest = max(math.hypot(forward, right), 1.0)
        largest = STANDARD_GRAVITY * math.tan(math.radians(parameters["MPC_MAN_TILT_MAX"]))
        fastest = parameters["MPC_XY_VEL_MAX"]
        sine, cosine = math.sin(view.yaw), math.cos(view.yaw)
        north, east = view.vn - view.wind_north, view.ve - view.wind_east
        self._demand.acceleration(
            largest * (forward / fullest - (north * cosine + east * sine) / fastest),
            largest * (right / fullest - (east * cosine - north * sine) / fastest),
        )

    def _on_the_wing(self, view: View) -> None:  # noqa: ARG002
        bank = past_dead_zone(self._sticks.now.right) * math.radians(self._parameters["FW_R_LIM"])
        self._demand.bank(bank, speed=self._airspeed())

    def _airspeed(self) -> float:
        """The throttle stick as an airspeed [m/s]: FW_AIRSPD_TRIM at its centre, _MIN and _MAX at its ends."""
        up, parameters = self._sticks.now.up, self._parameters
        trim = parameters["FW_AIRSPD_TRIM"]
        return trim + up * (parameters["FW_AIRSPD_MAX"] - trim if up > 0.0 else trim - parameters["FW_AIRSPD_MIN"])

    def _vertical(self, view: View, up: float, climb: float, sink: float) -> None:
        if up != 0.0:
            self.down = None
            self._demand.climb(-up * (climb if up > 0.0 else sink))
            return
        if self.down is None:
            self.down = view.down + view.vd * LEVEL_OFF
        self._demand.altitude(self.down)

    @property
    def _weathervanes(self) -> bool:
        """Whether the nose turns into the wind while no stick turns it: only where a place is held."""
        return False

    def _turn(self, view: View) -> None:
        turn = past_dead_zone(self._sticks.now.turn)
        if turn != 0.0:
            self.heading = None
            self._demand.yaw_rate(turn * math.radians(self._parameters["MPC_MAN_Y_MAX"]))
            return
        if self._weathervanes:
            self.heading = None
            self._demand.weathervane()
            return
        if self.heading is None:
            self.heading = view.yaw + view.r * LEVEL_OFF
        self._demand.heading(self.heading)


class Position(Altitude):
    """As Altitude, but sticks move the vehicle over the ground, and a place or a course is held without them.

    Hovering with centred sticks it brakes and holds the point it comes to; wing-borne it holds its track.
    """

    def __init__(self, parameters: Parameters, demand: Demand, sticks: Sticks, home: Home) -> None:
        super().__init__(parameters, demand, sticks, home)
        self._hold = Hold(parameters, demand)
        self._holding = False
        self._course: tuple[Place, Place] | None = None

    def start(self, view: View, cruise: bool) -> None:
        """Begin in a regime, holding the present height, heading and course."""
        super().start(view, cruise)
        self._holding = False
        self._course = None

    @property
    def _weathervanes(self) -> bool:
        return self._holding and self._hold.settled and self._parameters["WV_EN"] == 1

    def _in_hover(self, view: View) -> None:
        sticks = self._sticks.now
        forward, right = past_dead_zone(sticks.forward), past_dead_zone(sticks.right)
        if forward == 0.0 and right == 0.0:
            if not self._holding:
                self._hold.start(view, cruise=False)
                self._holding = True
            self._hold.update(view)
            return
        self._holding = False
        largest = self._parameters["MPC_XY_VEL_MAX"] / max(math.hypot(forward, right), 1.0)
        sine, cosine = math.sin(view.yaw), math.cos(view.yaw)
        north, east = forward * cosine - right * sine, forward * sine + right * cosine
        self._demand.velocity((north * largest, east * largest, 0.0))

    def _on_the_wing(self, view: View) -> None:
        if past_dead_zone(self._sticks.now.right) != 0.0:
            self._course = None
        elif self._course is None and abs(view.roll) < LEVEL and math.hypot(view.vn, view.ve) > 1.0:
            far = COURSE_LENGTH / math.hypot(view.vn, view.ve)
            here = (view.north, view.east)
            self._course = here, (view.north + view.vn * far, view.east + view.ve * far)
        if self._course is None:
            super()._on_the_wing(view)
            return
        start, end = self._course
        self._demand.leg((*start, view.down), (*end, view.down), speed=self._airspeed(), cruise=True)
