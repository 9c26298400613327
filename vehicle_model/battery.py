"""The battery: a lithium-polymer pack that empties, and whose voltage sags under the load of the motors.

Open-circuit voltage over state of charge: Chen and Rincon-Mora (2006), "Accurate electrical battery model capable of
predicting runtime and I-V performance", IEEE Trans. Energy Conversion 21(2), measured on polymer lithium-ion cells:

    V(s) = 3.685 + 0.2156 s - 0.1178 s^2 + 0.3201 s^3 - 1.031 exp(-35 s)    a cell

One internal resistance stands for all losses. Not modelled: temperature, ageing, the slow part of the sag, the
dependence of capacity on current.

Power that braking motors give back charges the battery: controllers of reversible motors rectify synchronously, and
clipping it would lose energy from the balance. There is little: all that a propeller stores.
"""

import math

import numpy as np

from vehicle_model.aircraft_tables import Battery
from vehicle_model.compiled import compiled
from vehicle_model.records import BATTERY

__all__ = ["BUS_LAG", "EMPTY_VOLTAGE", "battery_step", "loaded_voltage", "make_battery", "open_circuit_voltage"]

# Capacitors of the controllers and double layer of the cells [s]. It also keeps the loop of sag, current and more sag
# calm: the loop is closed once a step, and at full throttle its gain exceeds one.
BUS_LAG = 0.02
EMPTY_VOLTAGE = 0.1  # [V]: no motor turns on it, and nothing has to divide by zero


def make_battery(table: Battery, state_of_charge: float = 1.0) -> np.ndarray:
    """BATTERY array of shape (1,), writable and at rest, of an aircraft's `battery` table, charged to a share 0..1.

    Raises ValueError for a state of charge outside 0 to 1.
    """
    if not 0.0 <= state_of_charge <= 1.0:
        raise ValueError(f"state_of_charge: expected 0 to 1, got {state_of_charge}")
    battery = np.zeros(1, BATTERY)
    battery["cells"] = table.cells
    battery["capacity"] = table.capacity
    battery["internal_resistance"] = table.internal_resistance
    battery["avionics_power"] = table.avionics_power
    battery["charge"] = state_of_charge * table.capacity
    empty = state_of_charge == 0.0
    battery["voltage"] = EMPTY_VOLTAGE if empty else open_circuit_voltage(float(table.cells), state_of_charge)
    return battery


@compiled
def open_circuit_voltage(cells: float, state_of_charge: float) -> float:
    """Voltage [V] of `cells` in series at rest, at a state of charge 0..1; source in the module's head."""
    s = state_of_charge
    return cells * (3.685 + s * (0.2156 + s * (-0.1178 + s * 0.3201)) - 1.031 * math.exp(-35.0 * s))


@compiled
def loaded_voltage(open_circuit: float, resistance: float, power: float) -> float:
    """Steady bus voltage V [V] at which a battery gives `power` [W]: V = E - R I and P = V I, so V^2 - E V + R P = 0.

    Of the two roots the one with less current, which a load can settle at. More than E^2/4R no battery gives: then the
    voltage is that of the most, E/2.
    """
    half = 0.5 * open_circuit
    return half + math.sqrt(max(half * half - resistance * power, 0.0))


@compiled
def battery_step(battery, vehicle, outputs, dt: float) -> None:
    """Draw for `dt` seconds what the motors and the avionics take, and tell the motors the new voltage.

    `battery` is a BATTERY, `outputs` an OUTPUTS array of shape (1,); `vehicle` is a writable copy of a VEHICLE array
    whose rotors get the voltage under load. That follows `loaded_voltage` with the lag BUS_LAG. An empty battery is cut
    off: no current, EMPTY_VOLTAGE.
    """
    pack = battery[0]
    craft = vehicle[0]
    out = outputs[0]
    if pack.charge > 0.0:
        power = pack.avionics_power
        for i in range(craft.rotor_count):
            power += out.electrical_power[i]
        at_rest = open_circuit_voltage(pack.cells, pack.charge / pack.capacity)
        settled = loaded_voltage(at_rest, pack.internal_resistance, power)
        pack.voltage += (settled - pack.voltage) * dt / (BUS_LAG + dt)
        pack.current = power / pack.voltage
        pack.charge = min(max(pack.charge - pack.current * dt, 0.0), pack.capacity)
    else:
        pack.voltage = EMPTY_VOLTAGE
        pack.current = 0.0
    for i in range(craft.rotor_count):
        craft.rotors[i].battery_voltage = pack.voltage
