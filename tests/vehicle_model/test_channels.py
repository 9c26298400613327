"""Output channels: pulses and normalised values against the controls they stand for."""

import math
import re
from pathlib import Path

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vehicle_model.aircraft import load_aircraft
from vehicle_model.channels import Channel
from vehicle_model.state import CONTROL_NAMES

CHANNELS = {channel.control: channel for channel in load_aircraft().channels}


def test_every_control_has_one_channel_and_knows_its_place_in_the_control_vector() -> None:
    assert set(CHANNELS) == set(CONTROL_NAMES)
    assert [channel.number for channel in load_aircraft().channels] == sorted({c.number for c in CHANNELS.values()})
    for channel in CHANNELS.values():
        assert CONTROL_NAMES[channel.index] == channel.control
        assert channel.is_motor == (channel.index < 3)


@pytest.mark.parametrize(
    ("control", "normalised", "value"),
    [
        ("throttle_left", 0.0, 0.0), ("throttle_left", 0.25, 0.25), ("throttle_left", 1.0, 1.0),
        ("throttle_left", -1.0, 0.0), ("throttle_tail", -1.0, -1.0), ("throttle_tail", 0.5, 0.5),
        ("throttle_tail", 7.0, 1.0),
    ],
)  # fmt: skip
def test_a_normalised_motor_output_is_its_throttle(control: str, normalised: float, value: float) -> None:
    assert CHANNELS[control].from_normalised(normalised) == pytest.approx(value)


@pytest.mark.parametrize("control", ["tilt", "aileron_left", "aileron_right", "elevator"])
def test_a_normalised_servo_output_is_linear_between_the_limits_of_its_servo(control: str) -> None:
    channel = CHANNELS[control]
    servo = getattr(load_aircraft().servos, control.split("_", maxsplit=1)[0])
    assert channel.from_normalised(-1.0) == pytest.approx(servo.minimum)
    assert channel.from_normalised(0.0) == pytest.approx((servo.minimum + servo.maximum) / 2)
    assert channel.from_normalised(0.5) == pytest.approx(servo.minimum + 0.75 * (servo.maximum - servo.minimum))
    assert channel.from_normalised(1.0) == pytest.approx(servo.maximum)


def test_pulses_are_linear_on_either_side_of_a_trim_that_is_off_centre() -> None:
    channel = Channel(
        number=1, control="elevator", index=6, is_motor=False, minimum=-0.4, maximum=0.4, normalised_minimum=-1.0,
        pwm_minimum=1000.0, pwm_trim=1600.0, pwm_maximum=2000.0,
    )  # fmt: skip
    pulses = {900.0: -0.4, 1000.0: -0.4, 1300.0: -0.2, 1600.0: 0.0, 1700.0: 0.1, 2000.0: 0.4, 2200.0: 0.4}
    for pulse, angle in pulses.items():
        assert channel.from_pwm(pulse) == pytest.approx(angle, abs=1e-15)
    assert [channel.to_pwm(angle) for angle in (-9.0, -0.2, 0.0, 0.1, 9.0)] == [1000, 1300, 1600, 1700, 2000]


def test_a_motor_with_one_direction_stands_still_at_and_below_its_trim() -> None:
    channel = CHANNELS["throttle_left"]
    assert channel.from_pwm(channel.pwm_trim) == 0.0
    assert channel.from_pwm(channel.pwm_trim - 100.0) == 0.0
    assert channel.from_pwm((channel.pwm_trim + channel.pwm_maximum) / 2) == pytest.approx(0.5)


@given(share=st.floats(0, 1), control=st.sampled_from(CONTROL_NAMES))
def test_what_goes_out_as_a_pulse_or_normalised_comes_back(share: float, control: str) -> None:
    channel = CHANNELS[control]
    full = channel.maximum - channel.minimum
    value = channel.minimum + share * full
    assert channel.from_normalised(channel.to_normalised(value)) == pytest.approx(value, abs=1e-12)
    assert channel.from_pwm(channel.to_pwm(value)) == pytest.approx(value, abs=0.51 * full / 1000)


def test_the_outputs_for_some_controls_give_these_controls_back_and_leave_unused_numbers_at_zero() -> None:
    aircraft = load_aircraft()
    controls = [
        channel.minimum + (0.3 + 0.07 * channel.index) * (channel.maximum - channel.minimum)
        for channel in sorted(aircraft.channels, key=lambda channel: channel.index)
    ]
    outputs = aircraft.normalised_outputs(controls)
    for channel in aircraft.channels:
        assert channel.from_normalised(outputs[channel.number - 1]) == pytest.approx(controls[channel.index], abs=1e-15)

    moved = msgspec.structs.replace(aircraft.servo_outputs[-1], channel=12)
    renumbered = msgspec.structs.replace(aircraft, servo_outputs=(*aircraft.servo_outputs[:-1], moved))
    away = aircraft.servo_outputs[-1].channel - 1
    expected = outputs + [0.0] * (12 - len(outputs))
    expected[away], expected[11] = 0.0, outputs[away]
    assert renumbered.normalised_outputs(controls) == expected


def test_the_documented_channel_map_is_that_of_the_shipped_aircraft() -> None:
    page = (Path(__file__).parents[2] / "docs" / "aircraft-file.md").read_text()
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")] for line in page.split("\n") if re.match(r"\| \d", line)
    ]
    assert len(rows) == len(CHANNELS)
    for number, control, normalised, means, pulse in rows:
        channel = CHANNELS[control.strip("`")]
        assert int(number) == channel.number
        assert [float(end) for end in normalised.split(" .. ")] == [channel.normalised_minimum, 1.0]
        pulses = [float(width) for width in pulse.split(" .. ")]
        assert [pulses[0], pulses[-1]] == pytest.approx([channel.pwm_minimum, channel.pwm_maximum])
        assert channel.pwm_trim == pytest.approx(pulses[0] if channel.normalised_minimum == 0.0 else pulses[1])
        if not channel.is_motor:
            ends = [math.radians(float(end)) for end in means.removesuffix(" deg").split(" .. ")]
            assert ends == pytest.approx([channel.minimum, channel.maximum])


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_values_that_are_not_finite_are_refused(bad: float) -> None:
    channel = CHANNELS["tilt"]
    for convert in (channel.from_normalised, channel.to_normalised, channel.from_pwm, channel.to_pwm):
        with pytest.raises(ValueError, match=f"tilt: expected a finite value, got {bad}"):
            convert(bad)
