"""Whom the vehicle looks like to ground stations: PX4, ArduPilot, or nobody in particular.

One table each; the flight knows none of them. Mode numbers: PX4's custom modes
(https://docs.px4.io/main/en/concept/flight_modes.html, main mode << 16 | sub mode << 24), ArduPlane's with its Q modes
(https://ardupilot.org/plane/docs/parameters.html, FLTMODE1), and for nobody in particular our own, counted from 1.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

from sitl.flight.mode import Mode
from sitl.mavlink.dialect import tiltwing as mav

__all__ = ["IDENTITIES", "Identity", "ModeNumber"]

ADVANCED = mav.MAV_MODE_PROPERTY_ADVANCED
NOT_SELECTABLE = mav.MAV_MODE_PROPERTY_NOT_USER_SELECTABLE
AUTO = mav.MAV_MODE_PROPERTY_AUTO_MODE


@dataclass(frozen=True, slots=True)
class ModeNumber:
    """One mode as a ground station knows it.

    Asking for it leads to the first of `modes`; once asked for, it also stands for the others. `wing_borne` limits it
    to one regime when it is told and nobody has asked for it: True cruise, False hover, None either.
    """

    number: int
    name: str
    modes: tuple[Mode, ...]
    standard: int = mav.MAV_STANDARD_MODE_NON_STANDARD
    properties: int = 0
    wing_borne: bool | None = None


@dataclass(frozen=True)
class Identity:
    """What differs between autopilots on the wire.

    Attributes:
        modes: the table; the first entry is told while no autopilot flies.
        packs_mode: DO_SET_MODE brings main and sub mode, not the number.
        bytewise_parameters: integer parameters travel as their bits; else as the nearest float.
        mission_has_home: item 0 of a mission is home.
        takeoff_above_home: a take-off command without a frame names a height above home, not above sea level.
        mission_always_continues: an item's autocontinue has no meaning, and clients leave it at zero.
        guided: number of the mode in which setpoints are flown as they come, None if a mode has to be entered first.
        force_arm: the number that overrides the checks of arming.
        calibrates_by_hand: the pilot says when the vehicle lies as its calibration wants it to.
        active_means_flying: the heartbeat says "active" in flight only; else as soon as the motors may turn.
        streams: by the name of a link's stream set, the name of the rates that it means.
    """

    name: str
    autopilot: int
    vehicle_type: int
    modes: tuple[ModeNumber, ...]
    packs_mode: bool = False
    bytewise_parameters: bool = False
    mission_has_home: bool = False
    takeoff_above_home: bool = False
    mission_always_continues: bool = False
    guided: int | None = None
    force_arm: float = 21196.0
    calibrates_by_hand: bool = False
    active_means_flying: bool = False
    streams: Mapping[str, str] = field(default_factory=dict[str, str])

    def entry(self, number: int) -> ModeNumber | None:
        """The mode of this number."""
        return next((entry for entry in self.modes if entry.number == number), None)

    def told(self, mode: Mode | None, *, wing_borne: bool, asked: int | None) -> ModeNumber:
        """How a flight mode is told, given the number that was asked for last."""
        if mode is None:
            return self.modes[0]
        if asked is not None:
            entry = self.entry(asked)
            if entry is not None and mode in entry.modes:
                return entry
        return next(entry for entry in self.modes if entry.modes[0] == mode and entry.wing_borne in (None, wing_borne))


def _px4(main: int, sub: int, name: str, mode: Mode, standard: int = 0, properties: int = 0) -> ModeNumber:
    return ModeNumber(main << 16 | sub << 24, name, (mode,), standard, properties)


PX4 = Identity(
    name="px4",
    autopilot=mav.MAV_AUTOPILOT_PX4,
    vehicle_type=mav.MAV_TYPE_VTOL_TILTWING,
    modes=(
        _px4(1, 0, "Manual", Mode.MANUAL, properties=ADVANCED),
        _px4(7, 0, "Stabilized", Mode.STABILIZED, properties=ADVANCED),
        _px4(2, 0, "Altitude", Mode.ALTITUDE, mav.MAV_STANDARD_MODE_ALTITUDE_HOLD),
        _px4(3, 0, "Position", Mode.POSITION),
        _px4(4, 3, "Hold", Mode.HOLD, properties=AUTO),
        _px4(4, 4, "Mission", Mode.MISSION, mav.MAV_STANDARD_MODE_MISSION, AUTO),
        _px4(4, 5, "Return", Mode.RETURN, mav.MAV_STANDARD_MODE_SAFE_RECOVERY, AUTO),
        _px4(4, 6, "Land", Mode.LAND, mav.MAV_STANDARD_MODE_LAND, AUTO),
        _px4(4, 2, "Takeoff", Mode.TAKEOFF, mav.MAV_STANDARD_MODE_TAKEOFF, AUTO),
        _px4(3, 1, "Orbit", Mode.ORBIT, mav.MAV_STANDARD_MODE_ORBIT, AUTO),
        _px4(6, 0, "Offboard", Mode.OFFBOARD, properties=ADVANCED | AUTO),
        _px4(10, 0, "Termination", Mode.TERMINATION, properties=ADVANCED | NOT_SELECTABLE),
    ),
    packs_mode=True,
    bytewise_parameters=True,
)

ARDUPILOT = Identity(
    name="ardupilot",
    autopilot=mav.MAV_AUTOPILOT_ARDUPILOTMEGA,
    # Type 24 has no modes in ArduPilot's ground stations.
    vehicle_type=mav.MAV_TYPE_VTOL_TILTROTOR,
    modes=(
        ModeNumber(0, "MANUAL", (Mode.MANUAL,), properties=ADVANCED),
        ModeNumber(17, "QSTABILIZE", (Mode.STABILIZED,), wing_borne=False),
        ModeNumber(2, "STABILIZE", (Mode.STABILIZED,), wing_borne=True),
        ModeNumber(18, "QHOVER", (Mode.ALTITUDE,), wing_borne=False),
        ModeNumber(6, "FLY BY WIRE B", (Mode.ALTITUDE,), wing_borne=True),
        ModeNumber(19, "QLOITER", (Mode.POSITION,), wing_borne=False),
        ModeNumber(7, "CRUISE", (Mode.POSITION,), wing_borne=True),
        ModeNumber(12, "LOITER", (Mode.HOLD,), properties=AUTO),
        ModeNumber(10, "AUTO", (Mode.MISSION,), mav.MAV_STANDARD_MODE_MISSION, AUTO),
        ModeNumber(11, "RTL", (Mode.RETURN,), mav.MAV_STANDARD_MODE_SAFE_RECOVERY, AUTO),
        ModeNumber(21, "QRTL", (Mode.RETURN,), properties=AUTO),
        ModeNumber(20, "QLAND", (Mode.LAND,), mav.MAV_STANDARD_MODE_LAND, AUTO),
        ModeNumber(13, "TAKEOFF", (Mode.TAKEOFF,), mav.MAV_STANDARD_MODE_TAKEOFF, AUTO),
        ModeNumber(1, "CIRCLE", (Mode.ORBIT,), mav.MAV_STANDARD_MODE_ORBIT, AUTO),
        # Guided is where its clients take off, go to places and send setpoints without asking for another mode.
        ModeNumber(15, "GUIDED", (Mode.HOLD, Mode.TAKEOFF, Mode.OFFBOARD), properties=AUTO),
        ModeNumber(15, "GUIDED", (Mode.OFFBOARD,), properties=AUTO),
        ModeNumber(16, "INITIALISING", (Mode.TERMINATION,), properties=NOT_SELECTABLE),
    ),
    mission_has_home=True,
    takeoff_above_home=True,
    mission_always_continues=True,
    guided=15,
    force_arm=2989.0,
    calibrates_by_hand=True,
    active_means_flying=True,
    streams={"normal": "ardupilot", "onboard": "ardupilot"},
)

GENERIC = Identity(
    name="generic",
    autopilot=mav.MAV_AUTOPILOT_GENERIC,
    vehicle_type=mav.MAV_TYPE_VTOL_TILTWING,
    modes=tuple(
        ModeNumber(entry.modes[0] + 1, entry.name, entry.modes, entry.standard, entry.properties) for entry in PX4.modes
    ),
    bytewise_parameters=True,  # as ground stations have it for all but ArduPilot
)

IDENTITIES: Mapping[str, Identity] = {identity.name: identity for identity in (PX4, ARDUPILOT, GENERIC)}
