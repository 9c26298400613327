"""Calibration as ArduPilot's ground stations do it: the compass by turning about, the accelerometer on six sides.

Simulated, as all calibration here. The vehicle asks for each side of the accelerometer's by a COMMAND_LONG of its own
and a text, and waits until the pilot says that it lies so: by the same command, or by a COMMAND_ACK, as older stations
do. The compass tells MAG_CAL_PROGRESS and then MAG_CAL_REPORT until that is accepted.
"""

from collections.abc import Mapping
from typing import Any

from sitl.flight.refused import Refused
from sitl.mavlink.command import Command, CommandHandler, whole_number
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.service import Exchange, Handler, Sender, Service
from sitl.mavlink.timers import Timer

__all__ = ["ArduPilotCalibration"]

COMPASSES = 0b1  # one, the first
PERIOD = 0.2  # of its progress and report [s], wall time
STEP = 5  # of progress each time [%]
COMPLETE = 100
SECTIONS = 80  # of the sphere of directions that its progress marks as seen
REPORTS = 50  # unless accepted or cancelled sooner
REMINDER = 1.0  # of the side asked for [s], wall time
PATIENCE = 300  # reminders

SIDES = {
    mav.ACCELCAL_VEHICLE_POS_LEVEL: "level",
    mav.ACCELCAL_VEHICLE_POS_LEFT: "on its LEFT side",
    mav.ACCELCAL_VEHICLE_POS_RIGHT: "on its RIGHT side",
    mav.ACCELCAL_VEHICLE_POS_NOSEDOWN: "nose DOWN",
    mav.ACCELCAL_VEHICLE_POS_NOSEUP: "nose UP",
    mav.ACCELCAL_VEHICLE_POS_BACK: "on its BACK",
}


class ArduPilotCalibration(Service):
    """DO_START_, DO_ACCEPT_ and DO_CANCEL_MAG_CAL, ACCELCAL_VEHICLE_POS; begun by PREFLIGHT_CALIBRATION the latter."""

    def __init__(self, exchange: Exchange) -> None:
        """Serve through `exchange`."""
        super().__init__(exchange)
        self._compass: _Compass | None = None
        self._accelerometer: _Accelerometer | None = None

    def messages(self) -> Mapping[str, Handler]:
        """See Service."""
        return {"COMMAND_ACK": self._on_command_ack}

    def commands(self) -> Mapping[int, CommandHandler]:
        """See Service."""
        return {
            mav.MAV_CMD_DO_START_MAG_CAL: self._start_compass,
            mav.MAV_CMD_DO_ACCEPT_MAG_CAL: self._accept_compass,
            mav.MAV_CMD_DO_CANCEL_MAG_CAL: self._cancel_compass,
            mav.MAV_CMD_ACCELCAL_VEHICLE_POS: self._take_side,
        }

    def restarted(self) -> None:
        """See Service."""
        self.cancel()

    def cancel(self) -> None:
        """End whatever is under way."""
        for under_way in (self._compass, self._accelerometer):
            if under_way is not None:
                under_way.end()
        self._compass = self._accelerometer = None

    def start_accelerometer(self, sender: Sender) -> None:
        """Ask for the first of the six sides."""
        if self._accelerometer is not None:
            self._accelerometer.end()
        self._accelerometer = _Accelerometer(self.exchange, sender)

    def _start_compass(self, command: Command) -> None:
        compasses = whole_number(command.params[0]) or 0  # none named: all of them
        if compasses not in (0, COMPASSES):
            msg = f"compass: expected 0 (all) or {COMPASSES} (the one there is), got {command.params[0]:g}"
            raise Refused(msg)
        simulation = self.exchange.simulation
        if simulation.autopilot and simulation.flight.armed:
            msg = "no calibration: armed"
            raise Refused(msg, temporary=True)
        if self._compass is not None:
            self._compass.end()
        saves = bool(whole_number(command.params[2]))
        self._compass = _Compass(self.exchange, command.sender, saves=saves)

    def _accept_compass(self, command: Command) -> int:  # noqa: ARG002  (there is only one)
        compass = self._compass
        if compass is None or compass.percent < COMPLETE:
            return mav.MAV_RESULT_FAILED
        compass.end()
        return mav.MAV_RESULT_ACCEPTED

    def _cancel_compass(self, command: Command) -> None:  # noqa: ARG002  (there is only one)
        if self._compass is not None:
            self._compass.end()
            self._compass = None

    def _take_side(self, command: Command) -> int:
        accelerometer = self._accelerometer
        if accelerometer is None or not accelerometer.take(whole_number(command.params[0])):
            return mav.MAV_RESULT_FAILED
        return mav.MAV_RESULT_ACCEPTED

    def _on_command_ack(self, _: Any, sender: Sender) -> None:
        """The older way to say that the vehicle lies as it was asked to; who else acknowledges means something else."""
        accelerometer = self._accelerometer
        if accelerometer is not None and (sender.system, sender.component) == accelerometer.pilot:
            accelerometer.take(accelerometer.side)


class _Compass:
    """The compass being turned about.

    Attributes:
        percent: so much is done.
    """

    def __init__(self, exchange: Exchange, sender: Sender, *, saves: bool) -> None:
        self.percent = 0
        self._exchange = exchange
        self._sender = sender
        self._saves = saves
        self._reports = 0
        self._timer: Timer = exchange.after(0.0, self._go_on)

    def end(self) -> None:
        """Tell no more."""
        self._timer.cancel()

    def _go_on(self) -> None:
        if self.percent < COMPLETE:
            self.percent += STEP
            seen = (1 << SECTIONS * self.percent // COMPLETE) - 1
            self._exchange.reply(
                self._sender,
                "MAG_CAL_PROGRESS",
                cal_mask=COMPASSES,
                cal_status=mav.MAG_CAL_RUNNING_STEP_ONE if self.percent < 50 else mav.MAG_CAL_RUNNING_STEP_TWO,
                attempt=1,
                completion_pct=self.percent,
                completion_mask=seen.to_bytes(SECTIONS // 8, "little"),
            )
        else:
            self._reports += 1
            self._exchange.reply(
                self._sender,
                "MAG_CAL_REPORT",
                cal_mask=COMPASSES,
                cal_status=mav.MAG_CAL_SUCCESS,
                autosaved=self._saves,
                diag_x=1.0,
                diag_y=1.0,
                diag_z=1.0,
                scale_factor=1.0,
            )
        if self._reports < REPORTS:
            self._timer = self._exchange.after(PERIOD, self._go_on)


class _Accelerometer:
    """The accelerometer being laid on one side after the other.

    Attributes:
        pilot: system and component of whoever does it.
        side: asked for, as ACCELCAL_VEHICLE_POS.
    """

    def __init__(self, exchange: Exchange, sender: Sender) -> None:
        self.pilot = sender.system, sender.component
        self._exchange = exchange
        self._sender = sender
        self._waiting = iter(SIDES)
        self._reminders = 0
        self._timer: Timer | None = None
        self.side = next(self._waiting)
        self._begin_side()

    def take(self, side: int | None) -> bool:
        """The vehicle lies on this side; False if that is not the one asked for."""
        if side != self.side or side not in SIDES:
            return False
        following = next(self._waiting, None)
        if following is None:
            self._finish(mav.ACCELCAL_VEHICLE_POS_SUCCESS, "Calibration successful")
        else:
            self.side = following
            self._begin_side()
        return True

    def end(self) -> None:
        """Ask for nothing more."""
        if self._timer is not None:
            self._timer.cancel()

    def _begin_side(self) -> None:
        text = f"Place vehicle {SIDES[self.side]} and press any key."
        self._exchange.tell(self._sender, mav.MAV_SEVERITY_CRITICAL, text)
        self._reminders = 0
        self._ask()

    def _ask(self) -> None:
        self.end()
        self._say(self.side)
        self._reminders += 1
        if self._reminders > PATIENCE:
            self._finish(mav.ACCELCAL_VEHICLE_POS_FAILED, "Calibration FAILED")
        else:
            self._timer = self._exchange.after(REMINDER, self._ask)

    def _finish(self, result: int, text: str) -> None:
        self.end()
        self.side = result
        self._say(result)
        self._exchange.tell(self._sender, mav.MAV_SEVERITY_CRITICAL, text)

    def _say(self, position: int) -> None:
        self._exchange.reply(
            self._sender, "COMMAND_LONG", command=mav.MAV_CMD_ACCELCAL_VEHICLE_POS, param1=float(position)
        )
