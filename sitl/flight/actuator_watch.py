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


class ActuatorWatch:
    """Watches rotor speeds against their commands, and what the control laws say of the tilt servo.

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
        self.reset()

    def reset(self) -> None:
        """Take all actuators for repaired.

        The control laws believe in a repaired tilt servo only once it has moved: until then their judgement is old.
        """
        self.faults: tuple[str, ...] = ()
        self.tilt_stuck = False
        self._judgement_is_old = True
        self._timers = [Debounce() for _ in MOTORS]
        self._failed = [False for _ in MOTORS]

    def update(self, view: View, level: int) -> tuple[str, ...]:
        """Judge the present moment under the setpoint's `Level`; returns `faults`."""
        if level != Level.DIRECT:  # which commands throttles, not speeds
            self._judge_motors(view)
        if view.tilt_fault < 1.0:
            self._judgement_is_old = False
        elif not (self.tilt_stuck or self._judgement_is_old):
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
