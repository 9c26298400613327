"""What the control laws are asked and what they make of it, read as plain numbers for the messages that tell it."""

from sitl.airframe import Airframe
from sitl.control.records import Horizontal, Level, Vertical, Yaw
from sitl.simulation import Simulation

__all__ = ["Guidance"]

ATTITUDE, VELOCITY = int(Level.ATTITUDE), int(Level.VELOCITY)
PLACES = frozenset(int(kind) for kind in (Horizontal.POINT, Horizontal.LEG, Horizontal.CIRCLE))
LEG, CIRCLE, ACCELERATION = int(Horizontal.LEG), int(Horizontal.CIRCLE), int(Horizontal.ACCELERATION)
HOLDS_ALTITUDE, TURNS_AT_RATE = int(Vertical.ALTITUDE), int(Yaw.RATE)

Vector = list[float]


class Guidance:
    """The SETPOINT and the STATUS of a vehicle's laws; see `sitl.control.records`. Call `look` before reading.

    NED from the local frame's origin [m, m/s], angles in radians.

    Attributes:
        holds_attitude: roll, pitch and yaw are controlled, and `attitude` is what they are to be.
        holds_velocity: so are velocity and height, and `velocity` is what they are to be.
    """

    def __init__(self, simulation: Simulation) -> None:
        """Of this vehicle, whatever airframe and flight a restart gives it."""
        self._simulation = simulation
        self._bind(simulation.airframe)

    def look(self) -> None:
        """See the present moment."""
        airframe = self._simulation.airframe
        if airframe is not self._airframe:
            self._bind(airframe)
        level = 0 if airframe.controls_from_outside else self._level.item()
        self.holds_attitude = level >= ATTITUDE
        self.holds_velocity = level >= VELOCITY

    def _bind(self, airframe: Airframe) -> None:
        self._airframe = airframe
        self.holds_attitude = self.holds_velocity = False
        # Each field as an array of its own: read by name from the record each would cost several times as much.
        asked, said = airframe.setpoint, airframe.status
        self._level, self._horizontal, self._vertical = asked["level"], asked["horizontal"], asked["vertical"]
        self._yaw_kind, self._cruise, self._radius = asked["yaw"], asked["cruise"], asked["radius"]
        self._position, self._start = asked["position_ned"][0], asked["start_ned"][0]
        self._acceleration, self._speed, self._yaw_rate = asked["acceleration"][0], asked["speed"], asked["yaw_rate"]
        self._velocity, self._attitude = said["velocity_reference_ned"][0], said["attitude_reference"][0]
        self._thrust = said["thrust"]

    @property
    def has_place(self) -> bool:
        """Guidance leads to a point, along a leg or around a circle, not just on."""
        return self.holds_velocity and self._horizontal.item() in PLACES

    @property
    def is_leg(self) -> bool:
        """It leads from `start` to `place`."""
        return self.holds_velocity and self._horizontal.item() == LEG

    @property
    def is_circle(self) -> bool:
        """It leads around `place`, at `radius`."""
        return self.holds_velocity and self._horizontal.item() == CIRCLE

    @property
    def holds_altitude(self) -> bool:
        """The height of `place` is to be kept or reached."""
        return self.holds_velocity and self._vertical.item() == HOLDS_ALTITUDE

    @property
    def place(self) -> Vector:
        """Point, end of the leg or centre of the circle."""
        return self._position.tolist()

    @property
    def start(self) -> Vector:
        """Where the leg began."""
        return self._start.tolist()

    @property
    def radius(self) -> float:
        """Of the circle, clockwise if positive."""
        return self._radius.item()

    @property
    def velocity(self) -> Vector:
        """Over the ground, that the laws fly at this moment on their way to what guidance asks for."""
        return self._velocity.tolist()

    @property
    def attitude(self) -> Vector:
        """Roll, pitch, yaw that the laws fly at this moment."""
        return self._attitude.tolist()

    @property
    def thrust(self) -> float:
        """Collective force of the wing's rotors, 0..1 of what they give at most."""
        return self._thrust.item() if self.holds_attitude else 0.0

    @property
    def acceleration(self) -> Vector | None:
        """Forward and right of the heading [m/s^2], None unless it is what guidance is about."""
        asked = self.holds_velocity and self._horizontal.item() == ACCELERATION
        return self._acceleration.tolist() if asked else None

    @property
    def yaw_rate(self) -> float | None:
        """Of the nose in hover [rad/s], None unless it is what was asked for."""
        asked = self.holds_attitude and (not self.holds_velocity or self._yaw_kind.item() == TURNS_AT_RATE)
        return self._yaw_rate.item() if asked else None

    @property
    def cruise(self) -> bool:
        """Wing-borne flight is asked for."""
        return self.holds_velocity and self._cruise.item() == 1

    @property
    def speed(self) -> float:
        """True airspeed wing-borne, largest ground speed in hover."""
        return self._speed.item()
