"""What happens to a vehicle from outside: wind, motors and servos that fail, links that fall silent."""

from collections.abc import Sequence

from sitl.airframe import Airframe
from sitl.flight.flight import Flight
from sitl.scenario.link_ages import LINKS, LinkAges
from vehicle_model.state import SERVO_NAMES

__all__ = ["ROTORS", "Fate"]

ROTORS = ("left", "right", "tail")


class Fate:
    """The part of a Simulation that blows of fate are dealt to."""

    airframe: Airframe
    _flight: Flight | None
    _links: LinkAges

    @property
    def time(self) -> float:
        """Simulated seconds since the start."""
        return self.airframe.time

    def set_wind(self, steady_ned: Sequence[float]) -> None:
        """Let this be the steady wind from now on (NED, blowing to) [m/s]; roughness and gusts stay."""
        self.airframe.set_wind(steady_ned)

    def fail_motor(self, name: str, loss: float) -> None:
        """Let a rotor (left, right, tail) lose this share of its thrust, 0..1. Raises ValueError for another."""
        self.airframe.lose_thrust(ROTORS.index(_known("motor", ROTORS, name)), loss)

    def fail_servo(self, name: str, angle: float | None = None) -> None:
        """Let a servo (tilt, aileron_left, aileron_right, elevator) stick where it is, or run to an angle [rad] first.

        Raises ValueError for another name, or an angle it cannot have.
        """
        self.airframe.stick_servo(SERVO_NAMES.index(_known("servo", SERVO_NAMES, name)), angle)

    def repair_motor(self, name: str) -> None:
        """Let a rotor have all of its thrust again. Raises ValueError for another name."""
        self.fail_motor(name, 0.0)
        self._count_on_actuators()

    def repair_servo(self, name: str) -> None:
        """Let a stuck servo move again. Raises ValueError for another name."""
        self.airframe.repair_servo(SERVO_NAMES.index(_known("servo", SERVO_NAMES, name)))
        self._count_on_actuators()

    def repair(self) -> None:
        """End all faults; the flight takes its actuators for repaired."""
        self.airframe.repair()
        self._count_on_actuators()

    def _count_on_actuators(self) -> None:
        if self._flight is not None:
            self._flight.actuators.reset()

    def hear_ground_station(self) -> None:
        """A heartbeat has come from a ground station."""
        self._links.station_received = self.time

    def set_link(self, name: str, up: bool) -> None:
        """Let the ground_station or manual_control be heard all the time from now on, or be silent."""
        self._links.switch(_known("link", LINKS, name), up, self.time)

    def cut_link(self, name: str, silent: bool) -> None:
        """Let the ground_station or manual_control be silent whatever it sends, or be heard again as it speaks."""
        if silent:
            self.set_link(name, up=False)
        else:
            self._links.release(_known("link", LINKS, name))


def _known(what: str, names: tuple[str, ...], name: str) -> str:
    if name not in names:
        msg = f"{what}: expected one of {', '.join(names)}, got {name!r}"
        raise ValueError(msg)
    return name
