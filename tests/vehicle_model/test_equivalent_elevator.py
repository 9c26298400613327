"""The equivalent elevator: what the tail rotor is asked to do with one pitch command."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vehicle_model.aircraft import load_aircraft
from vehicle_model.equivalent_elevator import tail_speed
from vehicle_model.rotor import rotor_loads

CRAFT = load_aircraft().vehicle[0]
command = st.floats(-0.4, 0.4)


@given(command, st.floats(0.0, math.pi))
def test_square_of_the_speed_is_proportional_to_the_command_and_to_sin_squared_of_the_tilt(
    command: float, tilt: float
) -> None:
    speed = tail_speed(CRAFT, command, tilt)
    assert speed * abs(speed) == pytest.approx(CRAFT["tail_gain"] * math.sin(tilt) ** 2 * command, rel=1e-9, abs=1e-9)


@given(command)
def test_in_hover_the_tail_thrust_is_linear_in_the_command_and_up_for_nose_down(command: float) -> None:
    def thrust(command: float) -> float:
        return rotor_loads(CRAFT["rotors"][2], tail_speed(CRAFT, command, 0.5 * math.pi), 0.0, 0.0, 1.225)[0]

    assert thrust(command) == pytest.approx(thrust(0.4) / 0.4 * command, rel=1e-6, abs=1e-9)
    assert thrust(0.4) > 0.0


def test_in_cruise_the_tail_rotor_rests() -> None:
    assert tail_speed(CRAFT, 0.3, 0.0) == 0.0
    assert tail_speed(CRAFT, 0.0, 1.0) == 0.0
