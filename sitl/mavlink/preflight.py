"""Commands on the ground: pre-arm checks, calibration, reboot and shutdown, and a start anywhere.

Calibration is simulated, for ideal sensors need none: it takes its time and says what ground stations of PX4 parse
(docs.px4.io, "Calibration"; the texts are a protocol of their own). USER_2 is ours: docs/mavlink.md describes it.
"""

import math
from collections.abc import Callable, Mapping
from typing import Final, NamedTuple

from sitl.flight.refused import Refused
from sitl.mavlink.ardupilot_calibration import ArduPilotCalibration
from sitl.mavlink.command import Command, CommandHandler, Running, whole_number
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.service import Exchange, Service
from sitl.mavlink.timers import Timer

__all__ = ["RESTART", "PreflightService"]

RESTART: Final = mav.MAV_CMD_USER_2
AS_STARTED, ON_GROUND, TRIMMED = range(3)  # its first parameter
REBOOT, SHUTDOWN = 1, 2
FORCE = 20190226.0  # the number that overrides the check of a reboot
STAGES = 10  # of a calibration
STAGE = 0.2  # time that each takes [s], wall time
TEXTS_VERSION = 2
SIX_SIDES = 1.0  # fifth parameter of PREFLIGHT_CALIBRATION: the accelerometer, in full
SIDES = ("back", "front", "left", "right", "up", "down")


class _Calibration(NamedTuple):
    """One that is under way, and how to tell whoever has begun it."""

    next_stage: Timer
    say: Callable[[str], None]


class PreflightService(Service):
    """What is done before a flight."""

    def __init__(
        self, exchange: Exchange, report_health: Callable[[], None], by_hand: ArduPilotCalibration | None = None
    ) -> None:
        """Serve through `exchange`.

        `report_health` tells the result of checks as events. `by_hand` calibrates what the pilot has to lay on all its
        sides, if he is to say himself when it lies so.
        """
        super().__init__(exchange)
        self._report_health = report_health
        self._by_hand = by_hand
        self._calibration: _Calibration | None = None
        self._restarting: Running | None = None

    def commands(self) -> Mapping[int, CommandHandler]:
        """See Service."""
        return {
            mav.MAV_CMD_RUN_PREARM_CHECKS: self._check,
            mav.MAV_CMD_PREFLIGHT_CALIBRATION: self._calibrate,
            mav.MAV_CMD_FIXED_MAG_CAL_YAW: self._calibrate_compass,
            mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN: self._reboot,
            RESTART: self._restart,
        }

    def restarted(self) -> None:
        """See Service."""
        if self._calibration is not None:
            self._calibration.next_stage.cancel()
            self._calibration = None
        if self._restarting is not None:
            self._restarting.finish(mav.MAV_RESULT_ACCEPTED)
            self._restarting = None

    def _check(self, command: Command) -> None:
        """RUN_PREARM_CHECKS: says everything that speaks against arming, or that nothing does."""
        flight = self.exchange.simulation.flight
        self._report_health()
        if flight.armed:
            msg = "no pre-arm checks: armed"
            raise Refused(msg, temporary=True)
        problems = flight.check_arming()
        for problem in problems:
            self.exchange.tell(command.sender, mav.MAV_SEVERITY_WARNING, f"Preflight: {problem}")
        if not problems:
            self.exchange.tell(command.sender, mav.MAV_SEVERITY_INFO, "Preflight: ready to arm")

    # -- calibration ---------------------------------------------------------------------------------------------

    def _calibrate(self, command: Command) -> None:
        """Begin one, or stop it: accepted at once, and told by texts from then on.

        Ground stations stop it by the same command, which they do not send while they wait for the answer to the first.
        """
        sensor = _sensor(command.params)
        if sensor is None:  # all zero means: stop
            self._stop_calibration()
            if self._by_hand is not None:
                self._by_hand.cancel()
            return
        self._check_disarmed("calibration")
        if self._by_hand is not None and command.params[4] == SIX_SIDES:
            self._by_hand.start_accelerometer(command.sender)
            return
        if self._calibration is not None:
            msg = "no calibration: another one is under way"
            raise Refused(msg, temporary=True)
        say = self._say(command)
        say(f"calibration started: {TEXTS_VERSION} {sensor}")
        if sensor in ("accel", "mag"):
            say("pending: " + " ".join(SIDES))
        self._go_on(sensor, 0, say)

    def _go_on(self, sensor: str, stage: int, say: Callable[[str], None]) -> None:
        say(f"progress <{round(100.0 * stage / STAGES)}>")
        if sensor in ("accel", "mag") and 0 < stage <= len(SIDES):
            side = SIDES[stage - 1]
            say(f"{side} orientation detected")
            say(f"{side} side done, rotate to a different side")
        if stage == STAGES:
            self._calibration = None
            say(f"calibration done: {sensor}")
        else:
            timer = self.exchange.after(STAGE, lambda: self._go_on(sensor, stage + 1, say))
            self._calibration = _Calibration(timer, say)

    def _stop_calibration(self) -> None:
        if self._calibration is not None:
            timer, say = self._calibration
            self._calibration = None
            timer.cancel()
            # After the acknowledgement: a text before it makes MAVSDK wait for ever.
            self.exchange.after(0.0, lambda: say("calibration cancelled"))

    def _calibrate_compass(self, command: Command) -> None:
        """FIXED_MAG_CAL_YAW: at once, by a heading [deg]."""
        if not math.isfinite(command.params[0]):
            msg = f"calibration: expected a heading [deg], got {command.params[0]:g}"
            raise Refused(msg)
        self._check_disarmed("calibration")
        self._say(command)("calibration done: mag")

    def _say(self, command: Command) -> Callable[[str], None]:
        return lambda text: self.exchange.tell(command.sender, mav.MAV_SEVERITY_INFO, f"[cal] {text}")

    # -- beginning anew ------------------------------------------------------------------------------------------

    def _reboot(self, command: Command) -> None:
        action = whole_number(command.params[0])
        if action not in (0, REBOOT, SHUTDOWN):
            msg = f"reboot: expected 0, {REBOOT} (reboot) or {SHUTDOWN} (shut down), got {command.params[0]:g}"
            raise Refused(msg)
        if command.params[5] != FORCE:
            self._check_disarmed("reboot")
        if action == REBOOT:
            self.exchange.request_restart()
        elif action == SHUTDOWN:
            self.exchange.request_stop()

    def _restart(self, command: Command) -> Running:
        """USER_2: begin anew as started (0), on the ground (1), or in level flight (2) at an airspeed."""
        kind = whole_number(command.params[0])
        _, airspeed, heading, _, latitude, longitude, altitude = command.params
        if kind not in (AS_STARTED, ON_GROUND, TRIMMED):
            msg = (
                f"restart: expected {AS_STARTED} (as started), {ON_GROUND} (on the ground) or {TRIMMED} (in level "
                f"flight), got {command.params[0]:g}"
            )
            raise Refused(msg)
        if kind == TRIMMED and not (math.isfinite(airspeed) and airspeed >= 0.0):
            msg = f"restart: expected an airspeed [m/s] as second parameter, got {airspeed:g}"
            raise Refused(msg)
        if any(math.isinf(value) for value in (heading, latitude, longitude, altitude)):
            msg = "restart: expected a heading, latitude, longitude [deg] and height [m] or NaN, got an infinite number"
            raise Refused(msg)
        running = self._restarting = Running()

        def refused(reason: str) -> None:
            self.exchange.tell(command.sender, mav.MAV_SEVERITY_WARNING, reason)
            running.finish(mav.MAV_RESULT_FAILED)

        self.exchange.request_restart(
            refused=refused,
            start=(None, "ground", f"trim:{airspeed:g}")[kind],
            heading=heading,
            place=None if math.isnan(latitude) or math.isnan(longitude) else (latitude, longitude),
            height=altitude,
        )
        return running

    def _check_disarmed(self, what: str) -> None:
        simulation = self.exchange.simulation
        if simulation.autopilot and simulation.flight.armed:
            msg = f"no {what}: armed"
            raise Refused(msg, temporary=True)


def _sensor(params: tuple[float, ...]) -> str | None:
    """Which one PREFLIGHT_CALIBRATION means, in the words of the texts; None if none. Raises Refused."""
    wanted = [whole_number(value) or 0 for value in params]
    names: list[Mapping[int, str]] = [
        {1: "gyro", 3: "gyro"}, {1: "mag"}, {1: "baro"}, {1: "rc", 2: "rc"},
        {1: "accel", 2: "level", 4: "accel"}, {1: "airspeed", 2: "airspeed"}, {1: "esc", 3: "temperature"},
    ]  # fmt: skip
    chosen = [(place, value) for place, value in enumerate(wanted) if value]
    if not chosen:
        return None
    place, value = chosen[0]
    if len(chosen) > 1 or value not in names[place]:
        msg = f"calibration: expected one sensor, got {', '.join(f'param{p + 1} = {v}' for p, v in chosen)}"
        raise Refused(msg)
    return names[place][value]
