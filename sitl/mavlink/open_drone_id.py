"""Open Drone ID: what remote identification transmitters and observers are told of this vehicle and its operator.

https://mavlink.io/en/services/opendroneid.html. The vehicle knows its own id and where it is; operator, purpose of the
flight and area come from a ground station and are passed on as they came. Until one has told where the operator is, it
is where the flight begins: home.
"""

import hashlib
import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from sitl.flight.failsafe import Action
from sitl.flight.mode import Mode
from sitl.flight.refused import Refused
from sitl.hil.air_data import pressure_altitude
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.service import Builder, Exchange, Handler, Sender, Service
from sitl.mavlink.telemetry.context import Context
from sitl.snapshot import Snapshot

__all__ = ["OpenDroneIdService"]

TO_EVERYBODY = (0, 0)  # target system and component
OF_US = (0,) * 20  # id_or_mac, which names other aircraft
HEAD = 3  # fields before those that say something: targets and id_or_mac
ID_SIZE = 20  # of uas_id [bytes]
MAKER = "TWNG"  # a manufacturer's code as ANSI/CTA-2063-A has them, nobody's; then the length of what follows
SERIAL_DIGITS = 12

UNKNOWN_ALTITUDE = -1000.0  # [m]
UNKNOWN_DIRECTION = 36100  # [cdeg]
FASTEST = 25425  # horizontal speed that can be told [cm/s]
FASTEST_VERTICAL = 6200  # [cm/s]
LEAST_COURSE_SPEED = 0.1  # over ground [m/s]; below it there is no direction to speak of
HOUR = 3600.0  # [s]
UNIX_2019 = 1546300800  # [s]
DEGREES_E7 = math.degrees(1.0) * 1e7
MOST_LATITUDE, MOST_LONGITUDE = 900_000_000, 1_800_000_000  # [degE7]

TRANSMITTERS = frozenset({mav.MAV_COMP_ID_ODID_TXRX_1, mav.MAV_COMP_ID_ODID_TXRX_2, mav.MAV_COMP_ID_ODID_TXRX_3})


class _System(NamedTuple):
    """What OPEN_DRONE_ID_SYSTEM says, in its own order and units; by default nothing is known."""

    operator_location_type: int = mav.MAV_ODID_OPERATOR_LOCATION_TYPE_TAKEOFF
    classification_type: int = mav.MAV_ODID_CLASSIFICATION_TYPE_UNDECLARED
    operator_latitude: int = 0
    operator_longitude: int = 0
    area_count: int = 1
    area_radius: int = 0
    area_ceiling: float = UNKNOWN_ALTITUDE
    area_floor: float = UNKNOWN_ALTITUDE
    category_eu: int = mav.MAV_ODID_CATEGORY_EU_UNDECLARED
    class_eu: int = mav.MAV_ODID_CLASS_EU_UNDECLARED
    operator_altitude_geo: float = UNKNOWN_ALTITUDE
    timestamp: int = 0


class OpenDroneIdService(Service):
    """Tells BASIC_ID, LOCATION, SYSTEM, SELF_ID and OPERATOR_ID, and takes all but LOCATION from a ground station."""

    def __init__(self, exchange: Exchange) -> None:
        """Begin with a serial number of our own, without operator id and purpose of the flight."""
        super().__init__(exchange)
        serial = _serial_number(exchange.system)
        self._basic_id = (mav.MAV_ODID_ID_TYPE_SERIAL_NUMBER, mav.MAV_ODID_UA_TYPE_HYBRID_LIFT, *serial)
        self._self_id: tuple[int, bytes] | None = None
        self._operator_id: tuple[int, bytes] | None = None
        self._system: _System | None = None  # as a ground station told it

    def messages(self) -> Mapping[str, Handler]:
        """See Service."""
        return {
            "OPEN_DRONE_ID_BASIC_ID": _about_us(self._on_basic_id),
            "OPEN_DRONE_ID_SELF_ID": _about_us(self._on_self_id),
            "OPEN_DRONE_ID_OPERATOR_ID": _about_us(self._on_operator_id),
            "OPEN_DRONE_ID_SYSTEM": _about_us(self._on_system),
            "OPEN_DRONE_ID_SYSTEM_UPDATE": _about_us(self._on_system_update),
        }

    def telemetry(self) -> Mapping[str, Builder]:
        """See Service."""
        return {
            "OPEN_DRONE_ID_BASIC_ID": lambda _snapshot, _context: (*TO_EVERYBODY, *OF_US, *self._basic_id),
            "OPEN_DRONE_ID_LOCATION": self._location,
            "OPEN_DRONE_ID_SYSTEM": self._system_now,
            "OPEN_DRONE_ID_SELF_ID": lambda _snapshot, _context: _if_known(self._self_id),
            "OPEN_DRONE_ID_OPERATOR_ID": lambda _snapshot, _context: _if_known(self._operator_id),
        }

    # -- what a ground station says ------------------------------------------------------------------------------

    def _on_basic_id(self, message: Any) -> None:
        if any(message.uas_id):
            self._basic_id = (message.id_type, message.ua_type, *message.uas_id)

    def _on_self_id(self, message: Any) -> None:
        self._self_id = (message.description_type, message.description) if message.description else None

    def _on_operator_id(self, message: Any) -> None:
        self._operator_id = (message.operator_id_type, message.operator_id) if message.operator_id else None

    def _on_system(self, message: Any) -> None:
        self._system = _on_the_map(_System._make(message[HEAD:]))

    def _on_system_update(self, message: Any) -> None:
        system = self._system or _System(operator_location_type=mav.MAV_ODID_OPERATOR_LOCATION_TYPE_LIVE_GNSS)
        self._system = _on_the_map(
            system._replace(
                operator_latitude=message.operator_latitude,
                operator_longitude=message.operator_longitude,
                operator_altitude_geo=message.operator_altitude_geo,
                timestamp=message.timestamp,
            )
        )

    # -- what is told --------------------------------------------------------------------------------------------

    def _location(self, snapshot: Snapshot, context: Context) -> tuple[Any, ...]:
        """OPEN_DRONE_ID_LOCATION: where it is and where it goes, as well as it can be told, for all of it is known."""
        north, east, down = snapshot.velocity_ned
        speed = math.hypot(north, east)
        course = math.degrees(math.atan2(east, north)) % 360.0
        return (
            *TO_EVERYBODY,
            *OF_US,
            self._status(snapshot),
            round(course * 100.0) % 36000 if speed >= LEAST_COURSE_SPEED else UNKNOWN_DIRECTION,
            min(round(speed * 100.0), FASTEST),
            min(max(round(-down * 100.0), -FASTEST_VERTICAL), FASTEST_VERTICAL),
            round(snapshot.latitude * DEGREES_E7),
            round(snapshot.longitude * DEGREES_E7),
            pressure_altitude(snapshot.pressure),
            snapshot.height_ellipsoid,
            mav.MAV_ODID_HEIGHT_REF_OVER_TAKEOFF,
            self._height(snapshot, context),
            mav.MAV_ODID_HOR_ACC_1_METER,
            mav.MAV_ODID_VER_ACC_1_METER,
            mav.MAV_ODID_VER_ACC_1_METER,
            mav.MAV_ODID_SPEED_ACC_0_3_METERS_PER_SECOND,
            (context.unix_epoch + snapshot.time) % HOUR,
            mav.MAV_ODID_TIME_ACC_0_1_SECOND,
        )

    def _system_now(self, snapshot: Snapshot, context: Context) -> tuple[Any, ...]:
        """OPEN_DRONE_ID_SYSTEM: as a ground station told it, or with the operator at home."""
        system = self._system
        if system is None:
            system = _System(timestamp=int(context.unix_epoch + snapshot.time) - UNIX_2019)
            home = self._home()
            if home is not None:
                latitude, longitude, altitude = home
                system = system._replace(
                    operator_latitude=round(latitude * 1e7),
                    operator_longitude=round(longitude * 1e7),
                    operator_altitude_geo=altitude,
                )
        return (*TO_EVERYBODY, *OF_US, *system)

    def _status(self, snapshot: Snapshot) -> int:
        if snapshot.armed:
            flight = self.exchange.simulation.flight
            if flight.mode == Mode.TERMINATION or flight.failsafes.action > Action.WARN:
                return mav.MAV_ODID_STATUS_EMERGENCY
        on_ground = snapshot.on_ground if snapshot.landed is None else snapshot.landed == "ON_GROUND"
        return mav.MAV_ODID_STATUS_GROUND if on_ground else mav.MAV_ODID_STATUS_AIRBORNE

    def _height(self, snapshot: Snapshot, context: Context) -> float:
        """Above home [m]."""
        home = self._home()
        altitude = context.home_altitude_msl if home is None else home[2]
        return UNKNOWN_ALTITUDE if altitude is None else snapshot.altitude_msl - altitude

    def _home(self) -> tuple[float, float, float] | None:
        """Latitude and longitude [deg] and altitude [m] of home; None without a flight controller to have one."""
        try:
            return self.exchange.simulation.flight.home.geodetic
        except Refused:
            return None


def _about_us(take: Callable[[Any], None]) -> Handler:
    """Take a message unless it tells of another aircraft: one that a transmitter has received, or a vehicle itself."""

    def handler(message: Any, sender: Sender) -> None:
        of_another = (
            sender.component in TRANSMITTERS
            or any(getattr(message, "id_or_mac", OF_US))
            or (sender.component == mav.MAV_COMP_ID_AUTOPILOT1 and message.target_system == 0)
        )
        if not of_another:
            take(message)

    return handler


def _on_the_map(system: _System) -> _System:
    """The same, with an operator at an impossible place at an unknown one."""
    if abs(system.operator_latitude) > MOST_LATITUDE or abs(system.operator_longitude) > MOST_LONGITUDE:
        system = system._replace(operator_latitude=0, operator_longitude=0)
    if not math.isfinite(system.operator_altitude_geo):
        system = system._replace(operator_altitude_geo=UNKNOWN_ALTITUDE)
    return system


def _if_known(fields: tuple[int, bytes] | None) -> tuple[Any, ...] | None:
    # An empty one would wipe out what a transmitter may have heard from the ground station itself.
    return None if fields is None else (*TO_EVERYBODY, *OF_US, *fields)


def _serial_number(system: int) -> bytes:
    """A serial number in the form of ANSI/CTA-2063-A that stays the same for a system id."""
    digits = hashlib.sha256(f"tiltwing-sitl {system}".encode()).hexdigest()[:SERIAL_DIGITS].upper()
    return f"{MAKER}{SERIAL_DIGITS:X}{digits}".encode().ljust(ID_SIZE, b"\0")
