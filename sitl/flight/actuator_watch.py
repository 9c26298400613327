"""Notices motors and tilt servos that do not do what they are told.

Seen is only what the vehicle itself reports: a rotor that turns too slowly, a wing that does not follow. A propeller
that has lost part of its thrust turns as fast as before and goes unnoticed here; the control laws make up for it.
"""

import math

import numpy as np

from sitl.control.records import Level
from sitl.flight.debounce import Debounce
from sitl.flight.view import View

__all__ = ["ActuatorWatch"]

MOTORS = ("left motor", "right motor", "tail motor")
# A rotor is too slow by more than a sagging battery or a hard demand explains: share of what it is told, and of its
# speed without load.
SHORTFALL_TOLD = 0.3
SHORTFALL_FULL = 0.05
MOTOR_TIME = 0.5  # [s]
TILT_ERROR = math.radians(5.0)
TILT_TIME = 1.0  # [s]
LONGEST_STEP = 0.2  # between updates: after more the servo's motion cannot be followed [s]


class ActuatorWatch:
    """Watches rotor speeds and wing tilt against their commands.

    A fault stays until `reset`, for a motor that is told to stand still cannot show that it is well again.

    Attributes:
        faults: what has failed, as a pilot reads it, in the order of its failing.
        tilt_stuck: the tilt servo is one of them.
    """

    def __init__(self, vehicle: np.ndarray) -> None:
        """`vehicle` is the VEHICLE record of the aircraft in good order."""
        craft = vehicle[0]
        rotors = craft["rotors"][: len(MOTORS)]
        self._full_speeds = [float(rotor["battery_voltage"] / rotor["torque_constant"]) for rotor in rotors]
        servo = craft["servos"][0]
        self._tilt_range = (float(servo["minimum"]), float(servo["maximum"]))
        self._tilt_rate = float(servo["rate_limit"])
        self._tilt_lag = float(servo["time_constant"])
        self._timers = [Debounce() for _ in MOTORS]
        self._tilt_timer = Debounce()
        self.reset()

    def reset(self) -> None:
        """Take all actuators for repaired."""
        self.faults: tuple[str, ...] = ()
        self.tilt_stuck = False
        self._failed = [False for _ in MOTORS]
        self._expected_tilt = self._time = math.nan

    def update(self, view: View, level: int) -> tuple[str, ...]:
        """Judge the present moment under the setpoint's `Level`; returns `faults`."""
        if level != Level.DIRECT:  # which commands throttles, not speeds
            self._judge_motors(view)
        astray = abs(view.tilt - self._follow_tilt(view)) > TILT_ERROR
        if self._tilt_timer.held(astray, view.time) >= TILT_TIME and not self.tilt_stuck:
            self.tilt_stuck = True
            self.faults += (f"tilt servo stuck at {math.degrees(view.tilt):.0f} deg",)
        return self.faults

    def _judge_motors(self, view: View) -> None:
        speeds, commands = view.rotor_speeds, view.rotor_speed_commands
        for i, timer in enumerate(self._timers):
            command = commands[i]
            speed = speeds[i] if command >= 0.0 else -speeds[i]
            told = abs(command)
            slow = told - speed > SHORTFALL_TOLD * told + SHORTFALL_FULL * self._full_speeds[i]
            if timer.held(slow and told > 0.0, view.time) >= MOTOR_TIME and not self._failed[i]:
                self._failed[i] = True
                self.faults += (f"{MOTORS[i]} failed",)

    def _follow_tilt(self, view: View) -> float:
        """Where a sound servo would have turned the wing by now: a lag with a limited rate, as `motor.servo_rate`."""
        step = view.time - self._time
        self._time = view.time
        if not 0.0 <= step <= LONGEST_STEP:
            self._expected_tilt = view.tilt
            return view.tilt
        lowest, highest = self._tilt_range
        error = min(max(view.tilt_command, lowest), highest) - self._expected_tilt
        most = self._tilt_rate * step
        self._expected_tilt += min(max(error * min(step / self._tilt_lag, 1.0), -most), most)
        return self._expected_tilt
