"""Pitching moment by part: the parts are the whole, and single ones agree with a lever arm worked out by hand."""

import numpy as np
import pytest

from vehicle_model.aircraft import Aircraft, load_aircraft
from vehicle_model.integrate import observe
from vehicle_model.paper.loads_by_part import (
    PARTS,
    fixed_control_moments,
    moments_by_part,
    neutral_elevator_moments,
)
from vehicle_model.records import OUTPUTS
from vehicle_model.state import ELEVATOR, ROTOR_SPEED, STATE_COUNT, VELOCITY
from vehicle_model.trim import Trim, still_air, trim_sweep


@pytest.fixture(scope="module")
def aircraft() -> Aircraft:
    return load_aircraft()


@pytest.fixture(scope="module")
def trims(aircraft: Aircraft) -> list[Trim]:
    return trim_sweep(aircraft, (0.0, 12.0, 30.0))


def test_the_parts_add_up_to_the_moment_of_the_equations_of_motion(aircraft: Aircraft, trims: list[Trim]) -> None:
    outputs, rate = np.zeros(1, OUTPUTS), np.empty(STATE_COUNT)
    for trim in trims:
        state = trim.state.copy()
        state[VELOCITY] += 2.0
        state[VELOCITY + 2] += 1.5
        state[ELEVATOR] += 0.05
        observe(state, trim.controls, aircraft.vehicle, still_air(), outputs, rate)
        parts = moments_by_part(aircraft, outputs[0])
        assert abs(outputs[0]["moment_body"][1]) > 0.1
        assert parts.sum() == pytest.approx(outputs[0]["moment_body"][1], rel=1e-9, abs=1e-9)


def test_the_tail_propeller_acts_with_its_lever_arm(aircraft: Aircraft, trims: list[Trim]) -> None:
    hover = trims[0]
    arm = aircraft.rotors.tail.hub[0] - aircraft.mass_properties.centre_of_mass[0]
    thrust = float(hover.outputs["thrust"][2])
    assert moments_by_part(aircraft, hover.outputs)[PARTS.index("tail propeller")] == pytest.approx(thrust * arm)


def test_fixed_controls_start_from_the_balance_of_hover(aircraft: Aircraft, trims: list[Trim]) -> None:
    moments = fixed_control_moments(aircraft, trims[0], (0.0, 5.0))
    assert moments.total[0] == pytest.approx(0.0, abs=1e-9)
    assert moments.parts.shape == (len(PARTS), 2)


def test_without_elevator_in_hover_the_sum_is_what_the_tail_propeller_balanced(
    aircraft: Aircraft, trims: list[Trim]
) -> None:
    hover = trims[0]
    assert hover.state[ROTOR_SPEED + 2] != 0.0
    tail = moments_by_part(aircraft, hover.outputs)[PARTS.index("tail propeller")]
    assert neutral_elevator_moments(aircraft, [hover]).total[0] == pytest.approx(-tail)


def test_strips_in_and_outside_the_slipstream_are_the_whole_wing(aircraft: Aircraft) -> None:
    wetted, unwetted = aircraft.wing_strips
    names = aircraft.surface_names
    named = {strip.name: strip.wetted for strip in aircraft.wing.strips}
    assert all(named[names[i].split(" ", 1)[1]] for i in wetted)
    assert not any(named[names[i].split(" ", 1)[1]] for i in unwetted)
    assert len(wetted) + len(unwetted) == 2 * len(named)
