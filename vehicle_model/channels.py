"""The output channels of a flight controller and what each drives: pulse widths, normalised values, controls.

A normalised value is 0..1 for a motor (-1..1 if it can be reversed) and is its throttle; for a servo it is -1..1,
linear from its minimum to its maximum angle. A pulse is linear in the normalised value on either side of its trim,
which is normalised 0: the motor stopped, the servo in the middle of its range.
"""

import math

import msgspec

from vehicle_model.aircraft_tables import AircraftTables, ServoOutput
from vehicle_model.state import CONTROL_NAMES

__all__ = ["Channel", "channels_of"]


class Channel(msgspec.Struct, frozen=True):
    """One channel: `number` counts from 1, `index` is the place of `control` in the control vector."""

    number: int
    control: str  # one of CONTROL_NAMES
    index: int
    is_motor: bool  # the control is a throttle, else an angle [rad]
    minimum: float  # control at the low end of the normalised range
    maximum: float
    normalised_minimum: float  # 0 for a motor with one direction, else -1
    pwm_minimum: float  # [us]
    pwm_trim: float  # [us]
    pwm_maximum: float  # [us]

    def from_normalised(self, value: float) -> float:
        """Control (throttle or angle [rad]) of a normalised value, which is limited to its range.

        Raises ValueError if the value is not finite.
        """
        share = (self._limited(value) - self.normalised_minimum) / (1.0 - self.normalised_minimum)
        return self.minimum + share * (self.maximum - self.minimum)

    def to_normalised(self, control: float) -> float:
        """Normalised value of a control (throttle or angle [rad]), limited to its range."""
        share = (control - self.minimum) / (self.maximum - self.minimum)
        return self._limited(self.normalised_minimum + share * (1.0 - self.normalised_minimum))

    def from_pwm(self, pulse: float) -> float:
        """Control (throttle or angle [rad]) of a pulse width [us], limited to its range."""
        above = pulse >= self.pwm_trim
        full = self.pwm_maximum - self.pwm_trim if above else self.pwm_trim - self.pwm_minimum
        return self.from_normalised((pulse - self.pwm_trim) / full if full else 0.0)

    def to_pwm(self, control: float) -> int:
        """Pulse width in whole microseconds of a control (throttle or angle [rad]), limited to its range."""
        value = self.to_normalised(control)
        full = self.pwm_maximum - self.pwm_trim if value >= 0 else self.pwm_trim - self.pwm_minimum
        return round(self.pwm_trim + value * full)

    def _limited(self, value: float) -> float:
        if not math.isfinite(value):
            raise ValueError(f"{self.control}: expected a finite value, got {value}")
        return min(max(value, self.normalised_minimum), 1.0)


def channels_of(tables: AircraftTables) -> tuple[Channel, ...]:
    """The channels of an aircraft in ascending order of their number."""
    return tuple(sorted((_channel(tables, output) for output in tables.servo_outputs), key=lambda item: item.number))


def _channel(tables: AircraftTables, output: ServoOutput) -> Channel:
    is_motor = output.control.startswith("throttle")
    if is_motor:
        rotor = tables.rotors.tail if output.control == "throttle_tail" else tables.rotors.wing
        minimum = -1.0 if rotor.motor.reversible else 0.0
        maximum, normalised_minimum = 1.0, minimum
    else:
        servo = getattr(tables.servos, output.control.split("_")[0])
        minimum, maximum, normalised_minimum = servo.minimum, servo.maximum, -1.0
    return Channel(
        number=output.channel,
        control=output.control,
        index=CONTROL_NAMES.index(output.control),
        is_motor=is_motor,
        minimum=minimum,
        maximum=maximum,
        normalised_minimum=normalised_minimum,
        pwm_minimum=output.pwm_minimum * 1e6,
        pwm_trim=output.pwm_trim * 1e6,
        pwm_maximum=output.pwm_maximum * 1e6,
    )
