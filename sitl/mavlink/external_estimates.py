"""Estimates from outside: a position, and the wind, for a vehicle that has lost its own.

EXTERNAL_POSITION_ESTIMATE and EXTERNAL_WIND_ESTIMATE of MAV_CMD are for dead reckoning. What this vehicle believes of
itself is the truth, so it never comes to that: a sound estimate is accepted, and changes nothing.
"""

from collections.abc import Mapping

from sitl.flight.refused import Refused
from sitl.mavlink.command import Command, CommandHandler
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.service import Service

__all__ = ["ExternalEstimates"]


class ExternalEstimates(Service):
    """Both commands."""

    def commands(self) -> Mapping[int, CommandHandler]:
        """See Service."""
        return {
            mav.MAV_CMD_EXTERNAL_POSITION_ESTIMATE: self._position,
            mav.MAV_CMD_EXTERNAL_WIND_ESTIMATE: self._wind,
        }

    def _position(self, command: Command) -> None:
        latitude, longitude = command.params[4:6]
        if not (abs(latitude) <= 90.0 and abs(longitude) <= 180.0):
            msg = f"position estimate: expected latitude and longitude [deg], got {latitude:g}, {longitude:g}"
            raise Refused(msg)
        _check_accuracies(command.params[2])

    def _wind(self, command: Command) -> None:
        speed, speed_accuracy, direction, direction_accuracy = command.params[:4]
        if not (0.0 <= speed < 200.0 and 0.0 <= direction <= 360.0):
            msg = f"wind estimate: expected a speed [m/s] and a direction of 0 to 360 deg, got {speed:g}, {direction:g}"
            raise Refused(msg)
        _check_accuracies(speed_accuracy, direction_accuracy)


def _check_accuracies(*accuracies: float) -> None:
    """A standard deviation is positive, or not a number where it is not known. Raises Refused."""
    for accuracy in accuracies:
        if accuracy < 0.0:
            msg = f"estimate: expected an accuracy of 0 or more, or none, got {accuracy:g}"
            raise Refused(msg)
