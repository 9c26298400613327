"""Servo outputs of an outside controller: who may give them, what they mean for the aircraft, when they are a tick.

The messages (SERVO_OUTPUT_RAW, HIL_ACTUATOR_CONTROLS, HIL_CONTROLS) carry no target. So the first sender claims the
servos and keeps them until it releases them or falls silent and another one speaks; everybody else is counted and
ignored. A simulated vehicle streams SERVO_OUTPUT_RAW as telemetry, which is no claim; it is known by telling its true
state, as no controller does. Values that are no use never reach the model: not finite, the channel keeps its last;
out of range, limited.
"""

import math
from collections import deque
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from vehicle_model.aircraft import Channel
from vehicle_model.state import blank_controls

__all__ = ["ServoInput", "Source"]

SEVERITY_WARNING = 4  # of MAV_SEVERITY
SEVERITY_INFO = 6
ARMED = 128  # MAV_MODE_FLAG_SAFETY_ARMED
CUSTOM_MODE = 1  # MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
MAIN_PORT = 0
PULSE_UNUSED = (0, 0xFFFF)  # [us]
PULSE_RANGE = (500, 2500)  # what a servo could possibly be sent [us]
MAX_WAITING_TICKS = 64


class Source(NamedTuple):
    """Who sends servo outputs."""

    system: int
    component: int
    link: str


class ServoInput:
    """The servos as an outside controller sees them.

    Attributes:
        controls: latest accepted controls, shape (7,), as in `vehicle_model.state`; in lockstep, those of the tick
            last taken.
        source: who holds the servos, or None.
        time_us: simulated time of the present state [us]; kept by whoever publishes it.
        taken, ignored: messages accepted, and those of others than the holder.
        rejected, limited: values not finite or absurd, and values outside their channel's range.
    """

    def __init__(
        self,
        channels: Sequence[Channel],
        announce: Callable[[int, str], None],
        *,
        system: int | None = None,
        timeout: float = 0.5,
        speed: float = 1.0,
        lockstep: bool = False,
        fallback: str = "last ones held",
    ) -> None:
        """Serve these channels.

        Args:
            channels: the aircraft's channel map.
            announce: told (MAV_SEVERITY, text) what the pilot should know.
            system: accept servo outputs of this system only.
            timeout: silence after which outputs are stale, in seconds of simulated time at the requested speed.
            speed: simulated seconds per wall second asked for; at inf, and in lockstep, outputs never go stale.
            lockstep: HIL_ACTUATOR_CONTROLS are ticks.
            fallback: what becomes of the actuators without fresh outputs, for the pilot.
        """
        self.controls = blank_controls()
        self.source: Source | None = None
        self.time_us = 0
        self.taken = self.ignored = self.rejected = self.limited = 0
        self._announce = announce
        self._fallback = fallback
        self._system = system
        self._timeout = timeout
        self._silence = timeout / speed if math.isfinite(speed) else timeout  # wall time
        self._never_stale = lockstep or not math.isfinite(speed)
        self._lockstep = lockstep
        self._last_heard = -math.inf
        self._is_stale = False
        self._incoming = blank_controls() if lockstep else self.controls
        self._ticks: deque[np.ndarray] = deque()
        self._last_tick_us: int | None = None
        self._repeat = False
        self._vehicles: set[int] = set()  # systems
        self._lockstep_explained = False
        # Place in the message, place in the controls, lowest normalised value, and the line from value to control.
        self._normalised = []
        for channel in channels:
            gain = (channel.maximum - channel.minimum) / (1.0 - channel.normalised_minimum)
            offset = channel.maximum - gain
            self._normalised.append((channel.number - 1, channel.index, channel.normalised_minimum, offset, gain))
        self._motors = [line for line, channel in zip(self._normalised, channels, strict=True) if channel.is_motor]
        self._by_control = {channel.control: line for line, channel in zip(self._normalised, channels, strict=True)}
        self._channels = tuple(channels)

    def servo_output_raw(self, port: int, pulses: Sequence[int], source: Source, wall_time: float) -> None:
        """SERVO_OUTPUT_RAW: pulse widths [us] of up to 16 channels; 0 and 65535 mean none. Port 0 only."""
        if port != MAIN_PORT:
            return
        # Who names a system by hand means it, whatever else that system sends.
        if source.system in self._vehicles and source.system != self._system:
            self.ignored += 1
            return
        if not self._may_drive(source) or not self._accepts(source, wall_time):
            return
        for channel in self._channels:
            pulse = pulses[channel.number - 1]
            if pulse in PULSE_UNUSED:
                continue
            if not PULSE_RANGE[0] <= pulse <= PULSE_RANGE[1]:
                self.rejected += 1
                continue
            if not channel.pwm_minimum <= pulse <= channel.pwm_maximum:
                self.limited += 1
            self._incoming[channel.index] = channel.from_pwm(pulse)

    def hil_actuator_controls(
        self, time_us: int, controls: Sequence[float], mode: int, source: Source, wall_time: float
    ) -> None:
        """HIL_ACTUATOR_CONTROLS: normalised values of 16 channels; in lockstep, a tick or a repeated one.

        In lockstep a holder that was silent for longer than the timeout and comes back with a smaller time has
        started anew: its ticks count from there.

        `mode` as base mode: an autopilot that says it is disarmed (CUSTOM_MODE_ENABLED without SAFETY_ARMED) stops the
        motors and leaves the servos where they are, for the zeros it then sends mean nothing. Any other value is no
        statement about arming.
        """
        was_silent = wall_time - self._last_heard > self._silence
        if not self._accepts(source, wall_time):
            return
        if was_silent and self._last_tick_us is not None and time_us < self._last_tick_us:
            self._last_tick_us = None
        if self._lockstep and not self._is_new_tick(time_us):
            self._repeat = True
            return
        if mode & (ARMED | CUSTOM_MODE) == CUSTOM_MODE:
            for _, index, _, _, _ in self._motors:
                self._incoming[index] = 0.0
        else:
            for line in self._normalised:
                self._take(line, controls[line[0]])
        if self._lockstep:
            if len(self._ticks) < MAX_WAITING_TICKS:
                self._ticks.append(self._incoming.copy())
            else:
                self.ignored += 1

    def hil_controls(
        self, sticks: tuple[float, float, float, float], tilt: float, tail: float, source: Source, wall_time: float
    ) -> None:
        """HIL_CONTROLS: `sticks` are roll, pitch, yaw, -1..1, and throttle, 0..1.

        Positive roll lowers the left aileron, positive pitch raises the elevator, positive yaw gives the left motor
        more than the right; `tilt` (aux1) and `tail` (aux2) are the normalised values of those channels.
        """
        if not self._may_drive(source) or not self._accepts(source, wall_time):
            return
        roll, pitch, yaw, throttle = sticks
        lines = self._by_control
        for name, value in (
            ("throttle_left", throttle + yaw),
            ("throttle_right", throttle - yaw),
            ("throttle_tail", tail),
            ("tilt", tilt),
            ("aileron_left", roll),
            ("aileron_right", -roll),
            ("elevator", -pitch),
        ):
            if name in lines:
                self._take(lines[name], value)

    def simulated_vehicle(self, system: int) -> None:
        """Take note that a system tells its true state: it is a vehicle like ours, and its outputs are its own."""
        self._vehicles.add(system)

    def take_tick(self) -> bool:
        """In lockstep: True once for each tick, whose controls are then in `controls`."""
        if not self._ticks:
            return False
        self.controls[:] = self._ticks.popleft()
        return True

    def take_repeat(self) -> bool:
        """In lockstep: True if the holder must be told the present state once more, without a tick."""
        repeat, self._repeat = self._repeat, False
        return repeat

    def fresh(self, wall_time: float) -> bool:
        """Whether somebody gives servo outputs and did so lately enough."""
        return self.source is not None and (self._never_stale or wall_time - self._last_heard <= self._silence)

    def watch(self, wall_time: float) -> None:
        """Say so once when servo outputs cease; the last ones are held."""
        if self.source is not None and not self._is_stale and not self.fresh(wall_time):
            self._is_stale = True
            self._announce(SEVERITY_WARNING, f"No servo outputs for {self._timeout:g} s: {self._fallback}")

    def release(self, source: Source) -> bool:
        """Give the servos back, at the holder's wish. True if nobody holds them now."""
        if self.source is not None and self.source.system == source.system:
            self._announce(SEVERITY_INFO, f"Servos released by system {source.system}")
            self.source = None
        return self.source is None

    def follow(self, controls: np.ndarray) -> None:
        """While nobody holds the servos: keep to the vehicle's controls (7,), where channels never sent then stay."""
        if self.source is None:
            self._incoming[:] = controls
            self.controls[:] = controls

    def statistics(self) -> dict[str, int]:
        """The counters."""
        return {"taken": self.taken, "ignored": self.ignored, "rejected": self.rejected, "limited": self.limited}

    def _accepts(self, source: Source, wall_time: float) -> bool:
        if source != self.source and not self._claimed_by(source, wall_time):
            self.ignored += 1
            return False
        self.taken += 1
        self._last_heard = wall_time
        if self._is_stale:
            self._is_stale = False
            self._announce(SEVERITY_INFO, "Servo outputs are back")
        return True

    def _claimed_by(self, source: Source, wall_time: float) -> bool:
        if not self._is_wanted(source):
            return False
        if self.source is not None and wall_time - self._last_heard <= self._silence:
            return False
        self.source = source
        self._is_stale = False
        self._ticks.clear()
        self._last_tick_us = None
        # Without the host the text fits one STATUSTEXT, which holds 50 characters.
        kind, *_, port = source.link.partition(",")[0].split(":")
        self._announce(SEVERITY_INFO, f"Servos taken by {source.system}/{source.component} on {kind}:{port}")
        return True

    def _is_wanted(self, source: Source) -> bool:
        return self._system is None or source.system == self._system

    def _may_drive(self, source: Source) -> bool:
        """Whether outputs without a tick are any use; in lockstep they are not, and who sends them is told once."""
        if not self._lockstep:
            return True
        self.ignored += 1
        if self._is_wanted(source) and not self._lockstep_explained:
            self._lockstep_explained = True
            self._announce(SEVERITY_WARNING, "Lockstep needs HIL_ACTUATOR_CONTROLS")
        return False

    def _is_new_tick(self, time_us: int) -> bool:
        """Whether controls with this time advance the vehicle; a time that was answered before never does again."""
        last, self_time = self._last_tick_us, self.time_us
        if time_us == last:
            return False
        if last is None:
            # The first words of a controller that does not know the time yet: it is told, and goes on from there.
            self._last_tick_us = time_us
            return time_us >= self_time
        if time_us > last or time_us == self_time:
            self._last_tick_us = time_us
            return True
        return False

    def _take(self, line: tuple[int, int, float, float, float], value: float) -> None:
        _, index, lowest, offset, gain = line
        if not lowest <= value <= 1.0:
            if not math.isfinite(value):
                self.rejected += 1
                return
            self.limited += 1
            value = min(max(value, lowest), 1.0)
        self._incoming[index] = offset + gain * value
