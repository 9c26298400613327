"""Flight modes on the wire: which there are, which is flown, how to change it; and the heartbeat that tells it.

https://mavlink.io/en/services/standard_modes.html and https://mavlink.io/en/services/heartbeat.html. The heartbeat is
sent once per wall second at any speed of the simulation, also while simulated time stands still, for the one who waits
for it lives in wall time; and at once when the mode changes, or arming.
"""

from collections.abc import Iterable, Mapping
from typing import Any

from sitl.flight.failsafe import Action
from sitl.flight.mode import Mode
from sitl.flight.refused import Refused
from sitl.mavlink.command import Command, CommandHandler, whole_number
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.identity import ModeNumber
from sitl.mavlink.service import Builder, Exchange, Handler, Request, Requestable, Sender, Service
from sitl.mavlink.telemetry.context import Context
from sitl.snapshot import Snapshot

__all__ = ["HEARTBEAT_PERIOD", "StandardModesService"]

HEARTBEAT_PERIOD = 1.0  # [s], wall time
MAVLINK_VERSION = 3  # of the field of this name, as every implementation sends it
WING_BORNE = ("CRUISE", "TO_CRUISE")

_STABILISED = mav.MAV_MODE_FLAG_STABILIZE_ENABLED
_BY_STICKS = mav.MAV_MODE_FLAG_MANUAL_INPUT_ENABLED
_AUTO = mav.MAV_MODE_FLAG_AUTO_ENABLED | mav.MAV_MODE_FLAG_GUIDED_ENABLED
# What each mode is in the terms that all autopilots share; the rest fly by themselves.
FLAGS = {
    Mode.MANUAL: _BY_STICKS,
    Mode.STABILIZED: _BY_STICKS | _STABILISED,
    Mode.ALTITUDE: _BY_STICKS | _STABILISED,
    Mode.POSITION: _BY_STICKS | _STABILISED,
    Mode.ORBIT: _BY_STICKS | _STABILISED,
    Mode.TERMINATION: 0,
}
PX4_AUTO = 4  # main mode; without a sub mode it means the mission


class StandardModesService(Service):
    """HEARTBEAT, CURRENT_MODE, AVAILABLE_MODES and the commands that change the mode.

    Attributes:
        asked: the mode number that somebody has asked for last, None before.
    """

    def __init__(self, exchange: Exchange) -> None:
        """Serve through `exchange`."""
        super().__init__(exchange)
        self.asked: int | None = None
        self._intended: int | None = None  # number of the mode that the pilot wants, whatever failsafes do
        self._told: ModeNumber | None = None
        self._told_armed: bool | None = None

    def messages(self) -> Mapping[str, Handler]:
        """See Service."""
        return {"SET_MODE": self._on_set_mode, "HEARTBEAT": self._on_heartbeat}

    def commands(self) -> Mapping[int, CommandHandler]:
        """See Service."""
        return {
            mav.MAV_CMD_DO_SET_MODE: self._do_set_mode,
            mav.MAV_CMD_DO_SET_STANDARD_MODE: self._do_set_standard_mode,
        }

    def requestable(self) -> Mapping[str, Requestable]:
        """See Service."""
        return {"AVAILABLE_MODES": self._available_modes, "AVAILABLE_MODES_MONITOR": lambda _: [{"seq": 0}]}

    def telemetry(self) -> Mapping[str, Builder]:
        """See Service."""
        return {"HEARTBEAT": self._heartbeat, "CURRENT_MODE": self._current_mode}

    def is_guided(self, mode: Mode) -> bool:
        """Whether a flight mode is one that ArduPilot's clients see as Guided now."""
        guided = self.exchange.identity.guided
        entry = None if guided is None else self.exchange.identity.entry(guided)
        return entry is not None and self.asked == guided and mode in entry.modes

    def update(self, snapshot: Snapshot) -> None:
        """See Service: a change of mode, or of arming, is told at once."""
        told = self._entry(snapshot)
        if snapshot.mode is None or self.exchange.simulation.flight.failsafes.action <= Action.WARN:
            self._intended = told.number
        if told is not self._told and self._told is not None:
            self.exchange.broadcast("CURRENT_MODE", **self._current_fields(told))
        if (told, snapshot.armed) != (self._told, self._told_armed) and self._told is not None:
            self._tell_heartbeat()
        self._told, self._told_armed = told, snapshot.armed

    def restarted(self) -> None:
        """See Service."""
        self.asked = self._intended = None

    def _entry(self, snapshot: Snapshot) -> ModeNumber:
        mode = None if snapshot.mode is None else Mode[snapshot.mode]
        return self.exchange.identity.told(mode, wing_borne=snapshot.regime in WING_BORNE, asked=self.asked)

    def _tell_heartbeat(self) -> None:
        message = self.exchange.telemetry(mav.MAVLINK_MSG_ID_HEARTBEAT)
        if message is not None:
            packer, payload = message
            self.exchange.broadcast(packer.name, **packer.read(payload)._asdict())

    # -- what is told --------------------------------------------------------------------------------------------

    def _status(self, snapshot: Snapshot, mode: Mode | None, armed: bool) -> int:
        """MAV_STATE."""
        if mode == Mode.TERMINATION:
            return mav.MAV_STATE_FLIGHT_TERMINATION
        if mode is not None and armed and self.exchange.simulation.flight.failsafes.action > Action.WARN:
            return mav.MAV_STATE_CRITICAL
        on_ground = snapshot.on_ground if snapshot.landed is None else snapshot.landed == "ON_GROUND"
        if on_ground and (not armed or self.exchange.identity.active_means_flying):
            return mav.MAV_STATE_STANDBY
        return mav.MAV_STATE_ACTIVE

    def _heartbeat(self, snapshot: Snapshot, _: Context) -> tuple[Any, ...]:
        """HEARTBEAT; while no autopilot flies, armed says that a motor is told to turn."""
        identity = self.exchange.identity
        mode = None if snapshot.mode is None else Mode[snapshot.mode]
        flags = mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
        flags |= FLAGS.get(Mode.MANUAL if mode is None else mode, _STABILISED | _AUTO)
        armed = snapshot.armed
        if armed is None:
            armed = bool(snapshot.controls[0] or snapshot.controls[1] or snapshot.controls[2])
        if armed:
            flags |= mav.MAV_MODE_FLAG_SAFETY_ARMED
        status = self._status(snapshot, mode, armed)
        number = self._entry(snapshot).number
        return (identity.vehicle_type, identity.autopilot, flags, number, status, MAVLINK_VERSION)

    def _current_mode(self, snapshot: Snapshot, _: Context) -> tuple[Any, ...]:
        return tuple(self._current_fields(self._entry(snapshot)).values())

    def _current_fields(self, entry: ModeNumber) -> dict[str, int]:
        intended = entry.number if self._intended is None else self._intended
        return {"standard_mode": entry.standard, "custom_mode": entry.number, "intended_custom_mode": intended}

    def _available_modes(self, request: Request) -> Iterable[Mapping[str, Any]] | None:
        """All modes, or the one of this index, counted from 1."""
        modes = list({entry.number: entry for entry in reversed(self.exchange.identity.modes)}.values())[::-1]
        wanted = whole_number(request.params[0]) or 0
        if not 0 <= wanted <= len(modes):
            return None
        return [
            {
                "number_modes": len(modes),
                "mode_index": index,
                "standard_mode": entry.standard,
                "custom_mode": entry.number,
                "properties": entry.properties,
                "mode_name": "" if entry.standard else entry.name,
            }
            for index, entry in enumerate(modes, start=1)
            if wanted in (0, index)
        ]

    def _on_heartbeat(self, message: Any, _: Sender) -> None:
        """A ground station is there."""
        if message.type == mav.MAV_TYPE_GCS:
            self.exchange.simulation.hear_ground_station()

    # -- what is asked for ---------------------------------------------------------------------------------------

    def _on_set_mode(self, message: Any, sender: Sender) -> None:
        """SET_MODE, the older message; it has no acknowledgement but the one PX4 and ArduPilot send."""
        result = mav.MAV_RESULT_ACCEPTED
        try:
            self._enter(message.custom_mode)
        except Refused as refused:
            self.exchange.tell(sender, mav.MAV_SEVERITY_WARNING, refused.reason)
            result = mav.MAV_RESULT_TEMPORARILY_REJECTED if refused.temporary else mav.MAV_RESULT_DENIED
        self.exchange.reply(sender, "COMMAND_ACK", command=mav.MAV_CMD_DO_SET_MODE, result=result)

    def _do_set_mode(self, command: Command) -> None:
        base, main, sub = (whole_number(param) for param in command.params[:3])
        if base is not None and not base & mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED:
            msg = (
                f"mode: expected a custom mode (base mode with bit {mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED}), got {base}"
            )
            raise Refused(msg)
        if main is None or main < 0:
            msg = f"mode: expected a number, got {command.params[1]:g}"
            raise Refused(msg)
        self._enter(main << 16 | (sub or 0) << 24 if self.exchange.identity.packs_mode else main)

    def _do_set_standard_mode(self, command: Command) -> int:
        standard = whole_number(command.params[0])
        entry = next((entry for entry in self.exchange.identity.modes if standard and entry.standard == standard), None)
        if entry is None:
            return mav.MAV_RESULT_FAILED  # what the definition of the command asks for
        self._enter(entry.number)
        return mav.MAV_RESULT_ACCEPTED

    def _enter(self, number: int) -> None:
        identity = self.exchange.identity
        if identity.packs_mode and number == PX4_AUTO << 16:
            number = next(entry.number for entry in identity.modes if entry.modes[0] == Mode.MISSION)
        entry = identity.entry(number)
        if entry is None:
            given = f"{number >> 16 & 0xFF}/{number >> 24}" if identity.packs_mode else f"{number}"
            msg = f"mode: there is none of number {given}"
            raise Refused(msg)
        simulation = self.exchange.simulation
        flight = simulation.flight
        if simulation.is_flown_from_outside:
            msg = "mode: an outside controller has the servos"
            raise Refused(msg, temporary=True)
        # Who asks for Guided while it is told already must not be stopped on the way.
        if not (flight.mode in entry.modes and self.asked == number):
            flight.set_mode(entry.modes[0])
        self.asked = number
        if entry.wing_borne is not None and flight.flying and entry.wing_borne != flight.regime.wing_borne:
            flight.transition(entry.wing_borne)
