"""Places on the map that others count from: HOME_POSITION and GPS_GLOBAL_ORIGIN, and how to put them elsewhere.

https://mavlink.io/en/messages/common.html#HOME_POSITION and #GPS_GLOBAL_ORIGIN. Both are told everybody when they
change; a wish to move the origin is answered with the origin in force, whether it has moved or not.
"""

import math
from collections.abc import Mapping
from typing import Any

from sitl.flight.places import LocalFrame
from sitl.flight.refused import Refused
from sitl.mavlink.command import Command, CommandHandler
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.service import Exchange, Handler, Sender, Service
from sitl.mavlink.telemetry.context import Context, boot_us
from sitl.snapshot import Snapshot

__all__ = ["HomePositionService", "gps_global_origin", "home_position"]

NO_APPROACH = (math.nan, math.nan, math.nan)
ABOVE_SEA = (None, mav.MAV_FRAME_GLOBAL, mav.MAV_FRAME_GLOBAL_INT)  # frames of DO_SET_GLOBAL_ORIGIN; None: COMMAND_LONG


def home_position(snapshot: Snapshot, context: Context) -> tuple[Any, ...]:
    """HOME_POSITION: degE7, mm above mean sea level, local NED [m]; level ground and the heading of the start.

    With the autopilot off home is where the flight's frame begins.
    """
    flight = context.flight
    start = context.simulation.scenario.home
    latitude, longitude, altitude = start.latitude, start.longitude, start.altitude
    north = east = down = 0.0
    if flight is not None:
        home = flight.home
        north, east, down = home.north, home.east, home.down
        if north or east or down:
            latitude, longitude, altitude = home.geodetic
    half = 0.5 * math.radians(start.heading)
    return (
        round(latitude * 1e7),
        round(longitude * 1e7),
        round(altitude * 1e3),
        *context.origin.seen(north, east, down),
        *(math.cos(half), 0.0, 0.0, math.sin(half)),
        *NO_APPROACH,
        boot_us(snapshot),
    )


def gps_global_origin(snapshot: Snapshot, context: Context) -> tuple[Any, ...]:
    """GPS_GLOBAL_ORIGIN: where the local frame begins [degE7, mm above mean sea level]."""
    return (*context.origin.geodetic, boot_us(snapshot))


class HomePositionService(Service):
    """Tells of changes; SET_HOME_POSITION, SET_GPS_GLOBAL_ORIGIN and DO_SET_GLOBAL_ORIGIN.

    DO_SET_HOME is a command of the flight. The origin may be moved while nothing flies by local coordinates: disarmed.
    """

    def __init__(self, exchange: Exchange, context: Context) -> None:
        """Serve through `exchange`; the origin is that of `context`."""
        super().__init__(exchange)
        self._context = context
        self._told: tuple[object, ...] | None = None

    def messages(self) -> Mapping[str, Handler]:
        """See Service."""
        return {
            "SET_HOME_POSITION": self._on_set_home_position,
            "SET_GPS_GLOBAL_ORIGIN": self._on_set_gps_global_origin,
        }

    def commands(self) -> Mapping[int, CommandHandler]:
        """See Service."""
        return {mav.MAV_CMD_DO_SET_GLOBAL_ORIGIN: self._do_set_global_origin}

    def update(self, snapshot: Snapshot) -> None:  # noqa: ARG002  (home is the flight's)
        """See Service: home that has moved is told everybody at once."""
        flight = self._context.flight
        origin = self._context.origin
        home = None if flight is None else (flight.home.north, flight.home.east, flight.home.down)
        # It has also moved in local coordinates when their origin has.
        now = (home, origin.geodetic)
        if self._told is not None and now != self._told:
            self._tell(mav.MAVLINK_MSG_ID_HOME_POSITION)
        self._told = now

    def _on_set_home_position(self, message: Any, sender: Sender) -> None:
        """SET_HOME_POSITION: latitude, longitude [degE7] and altitude above mean sea level [mm]."""
        try:
            flight = self.exchange.simulation.flight
            flight.set_home(message.latitude * 1e-7, message.longitude * 1e-7, message.altitude * 1e-3)
        except Refused as refused:
            self.exchange.tell(sender, mav.MAV_SEVERITY_WARNING, refused.reason)

    def _on_set_gps_global_origin(self, message: Any, sender: Sender) -> None:
        try:
            self._put_origin(message.latitude, message.longitude, message.altitude)
        except Refused as refused:
            self.exchange.tell(sender, mav.MAV_SEVERITY_WARNING, refused.reason)
        self._tell_origin()

    def _do_set_global_origin(self, command: Command) -> int:
        place = command.params[4:7]
        result = mav.MAV_RESULT_ACCEPTED
        try:
            if command.frame not in ABOVE_SEA:
                result = mav.MAV_RESULT_COMMAND_UNSUPPORTED_MAV_FRAME
            elif all(map(math.isfinite, place)):
                latitude, longitude, altitude = place
                self._put_origin(round(latitude * 1e7), round(longitude * 1e7), round(altitude * 1e3))
            else:
                msg = f"origin: expected latitude, longitude [deg] and altitude [m], got {place}"
                raise Refused(msg)
        finally:
            self._tell_origin()
        return result

    def _put_origin(self, latitude: int, longitude: int, altitude: int) -> None:
        """Move the origin [degE7, mm]. Raises Refused."""
        simulation = self.exchange.simulation
        flies = simulation.flight.armed if simulation.autopilot else not simulation.snapshot().on_ground
        if flies:
            msg = "origin: stays where it is in flight"
            raise Refused(msg, temporary=True)
        try:
            self._context.origin.put(latitude, longitude, altitude, LocalFrame(simulation.airframe.environment))
        except ValueError as error:
            raise Refused(str(error)) from None

    def _tell_origin(self) -> None:
        self._tell(mav.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN)

    def _tell(self, message_id: int) -> None:
        message = self.exchange.telemetry(message_id)
        if message is not None:
            packer, payload = message
            self.exchange.broadcast(packer.name, **packer.read(payload)._asdict())
