"""The battery against the quadratic of its circuit, the energy balance, published cell voltages and whole flights."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vehicle_model.aircraft import load_aircraft
from vehicle_model.aircraft_tables import Battery
from vehicle_model.battery import (
    BUS_LAG,
    EMPTY_VOLTAGE,
    battery_step,
    loaded_voltage,
    make_battery,
    open_circuit_voltage,
)
from vehicle_model.integrate import observe, rk4_step
from vehicle_model.records import OUTPUTS
from vehicle_model.state import STATE_COUNT
from vehicle_model.trim import still_air, trim_level

AIRCRAFT = load_aircraft()
TABLE = AIRCRAFT.battery
DT = 0.0025


def load(watts: float, table: Battery = TABLE) -> np.ndarray:
    """OUTPUTS whose motors take, with the avionics, so many watts."""
    outputs = np.zeros(1, OUTPUTS)
    outputs["electrical_power"][0] = np.array([0.5, 0.4, 0.1]) * (watts - table.avionics_power)
    return outputs


def settle(battery: np.ndarray, watts: float) -> None:
    """Draw until the voltage has settled, with the charge it had."""
    vehicle, outputs, charge = AIRCRAFT.vehicle.copy(), load(watts), battery["charge"][0]
    for _ in range(400):
        battery_step(battery, vehicle, outputs, DT)
        battery["charge"] = charge


# Chen and Rincon-Mora's equation, worked out by hand.
@pytest.mark.parametrize(
    ("state_of_charge", "volts"), [(1.0, 4.1029), (0.5, 3.803363), (0.2, 3.7250 - 1.031 * math.exp(-7.0)), (0.0, 2.654)]
)
def test_a_cell_at_rest_has_the_published_voltage(state_of_charge: float, volts: float) -> None:
    assert open_circuit_voltage(1.0, state_of_charge) == pytest.approx(volts, abs=1e-3)
    assert open_circuit_voltage(12.0, state_of_charge) == pytest.approx(12.0 * volts, abs=12e-3)


def test_voltage_falls_all_the_way_from_full_to_empty() -> None:
    volts = [open_circuit_voltage(12.0, s) for s in np.linspace(0.0, 1.0, 501)]
    assert np.all(np.diff(volts) > 0.0)


@given(st.floats(20.0, 60.0), st.floats(0.001, 0.2), st.floats(-2000.0, 10000.0))
def test_loaded_voltage_satisfies_ohms_law_and_gives_the_power(emf: float, ohms: float, watts: float) -> None:
    volts = loaded_voltage(emf, ohms, watts)
    current = (emf - volts) / ohms
    if watts < emf * emf / (4.0 * ohms):
        assert volts * current == pytest.approx(watts, rel=1e-6, abs=1e-6)
        assert volts >= emf / 2.0
    else:
        assert volts == emf / 2.0


@pytest.mark.parametrize("watts", [-300.0, 15.0, 600.0, 2900.0, 6900.0])
def test_sag_settles_at_the_root_of_the_quadratic(watts: float) -> None:
    battery = make_battery(TABLE, 0.7)
    settle(battery, watts)
    emf, ohms = open_circuit_voltage(12.0, 0.7), TABLE.internal_resistance
    volts, current = float(battery["voltage"][0]), float(battery["current"][0])
    assert volts**2 - emf * volts + ohms * watts == pytest.approx(0.0, abs=1e-6)
    assert volts == pytest.approx(emf - ohms * current, abs=1e-9)
    assert volts * current == pytest.approx(watts, rel=1e-12)


def test_sag_comes_with_its_lag() -> None:
    battery, vehicle = make_battery(TABLE, 1.0), AIRCRAFT.vehicle.copy()
    emf = float(battery["voltage"][0])
    step = BUS_LAG / 2000.0
    for _ in range(2000):
        battery_step(battery, vehicle, load(3000.0), step)
    settled = loaded_voltage(emf, TABLE.internal_resistance, 3000.0)
    assert emf - battery["voltage"][0] == pytest.approx((1.0 - math.exp(-1.0)) * (emf - settled), rel=2e-3)


def test_energy_of_the_cells_is_what_goes_out_and_the_heat() -> None:
    battery, vehicle, outputs = make_battery(TABLE, 0.9), AIRCRAFT.vehicle.copy(), load(2900.0)
    settle(battery, 2900.0)
    from_cells = heat = 0.0
    for _ in range(4000):
        charge = float(battery["charge"][0])
        emf = open_circuit_voltage(12.0, charge / TABLE.capacity)
        battery_step(battery, vehicle, outputs, DT)
        from_cells += emf * (charge - float(battery["charge"][0]))
        heat += TABLE.internal_resistance * float(battery["current"][0]) ** 2 * DT
    # The voltage comes BUS_LAG behind that of the emptying cells, which is 5e-6 of it.
    assert from_cells == pytest.approx(2900.0 * 4000 * DT + heat, rel=1e-5)


def test_at_constant_current_it_lasts_for_capacity_over_current() -> None:
    battery, vehicle, outputs = make_battery(TABLE), AIRCRAFT.vehicle.copy(), load(0.0)
    time = 0.0
    while battery["charge"][0] > 0.0:
        # The power at which the current is 32 A: 2 C, so 30 min.
        emf = open_circuit_voltage(12.0, float(battery["charge"][0]) / TABLE.capacity)
        watts = 32.0 * (emf - 32.0 * TABLE.internal_resistance)
        outputs["electrical_power"][0, 0] = watts - TABLE.avionics_power
        outputs["electrical_power"][0, 1:] = 0.0
        battery_step(battery, vehicle, outputs, 0.05)
        time += 0.05
    assert time == pytest.approx(TABLE.capacity / 32.0, rel=1e-3)
    assert TABLE.capacity == pytest.approx(16.0 * 3600.0)


def test_motors_get_the_voltage_and_nothing_else_of_the_vehicle_changes() -> None:
    battery, vehicle = make_battery(TABLE), AIRCRAFT.vehicle.copy()
    battery_step(battery, vehicle, load(2900.0), DT)
    np.testing.assert_array_equal(vehicle["rotors"]["battery_voltage"][0], battery["voltage"][0])
    vehicle["rotors"]["battery_voltage"] = TABLE.voltage
    assert vehicle.tobytes() == AIRCRAFT.vehicle.tobytes()


def test_the_aircraft_itself_keeps_the_nominal_voltage_of_the_file() -> None:
    np.testing.assert_array_equal(AIRCRAFT.vehicle["rotors"]["battery_voltage"][0], 44.4)


def test_an_empty_battery_drives_nothing() -> None:
    battery, vehicle = make_battery(TABLE, 0.0), AIRCRAFT.vehicle.copy()
    assert battery["voltage"][0] == EMPTY_VOLTAGE
    battery_step(battery, vehicle, load(2900.0), DT)
    assert (battery["current"][0], battery["charge"][0], battery["voltage"][0]) == (0.0, 0.0, EMPTY_VOLTAGE)
    trim = trim_level(AIRCRAFT, 0.0)
    state = trim.state.copy()
    for _ in range(800):
        rk4_step(state, trim.controls, vehicle, still_air(), DT)
    assert np.all(np.isfinite(state))
    assert state[13] < 0.5 * trim.state[13]


def test_braking_charges_but_never_beyond_full() -> None:
    half, full, vehicle = make_battery(TABLE, 0.5), make_battery(TABLE), AIRCRAFT.vehicle.copy()
    before = float(half["charge"][0])
    for battery in (half, full):
        battery_step(battery, vehicle, load(-500.0), 1.0)
    assert half["charge"][0] > before
    assert half["current"][0] < 0.0
    assert full["charge"][0] == TABLE.capacity


@pytest.mark.parametrize("state_of_charge", [1.0, 0.1])
def test_full_throttle_brings_no_oscillation_of_the_voltage(state_of_charge: float) -> None:
    """Motors at the limit of their voltage and the sag close a loop once a step, the worst of it at low charge."""
    world, rate, outputs = still_air(), np.empty(STATE_COUNT), np.zeros(1, OUTPUTS)
    aircraft = AIRCRAFT.with_values({"rotors.wing.motor.throttle": "voltage"})
    battery, vehicle = make_battery(TABLE, state_of_charge), aircraft.vehicle.copy()
    trim = trim_level(aircraft, 0.0)
    state, controls = trim.state.copy(), trim.controls.copy()
    controls[:3] = 1.0
    volts: list[float] = []
    for _ in range(400):
        observe(state, controls, vehicle, world, outputs, rate)
        battery_step(battery, vehicle, outputs, DT)
        volts.append(float(battery["voltage"][0]))
        state[13:16] += DT * rate[13:16]
    # It turns as the rotors spin up and the limits of current come off, but never from one step to the next: without
    # the lag it swings by volts at every step.
    change = np.diff(volts)
    turns = np.flatnonzero(change[1:] * change[:-1] < 0.0)
    assert np.all(np.diff(turns) > 10)
    assert volts[-1] < open_circuit_voltage(12.0, state_of_charge) - 2.0


def test_hover_lasts_twelve_minutes_or_more_and_cruise_much_longer() -> None:
    def minutes(airspeed: float) -> float:
        trim = trim_level(AIRCRAFT, airspeed)
        outputs = np.zeros(1, OUTPUTS)
        outputs[0] = trim.outputs
        battery, vehicle, steps = make_battery(TABLE), AIRCRAFT.vehicle.copy(), 0
        while battery["charge"][0] > 0.0:
            battery_step(battery, vehicle, outputs, 0.1)
            steps += 1
        return steps * 0.1 / 60.0

    assert 12.0 < minutes(0.0) < 18.0
    assert 50.0 < minutes(20.0) < 100.0


def test_the_same_draw_gives_the_same_bits() -> None:
    def flown() -> bytes:
        battery, vehicle = make_battery(TABLE), AIRCRAFT.vehicle.copy()
        for step in range(500):
            battery_step(battery, vehicle, load(1500.0 + 1400.0 * math.sin(0.1 * step)), DT)
        return battery.tobytes() + vehicle.tobytes()

    assert flown() == flown()


@pytest.mark.parametrize("state_of_charge", [-0.1, 1.1, math.nan])
def test_an_impossible_charge_is_refused(state_of_charge: float) -> None:
    with pytest.raises(ValueError, match="state_of_charge: expected 0 to 1, got"):
        make_battery(TABLE, state_of_charge)
