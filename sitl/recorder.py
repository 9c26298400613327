"""Writes a flight's history while it is flown: the true state, what the wing has left, what the flight was about."""

import math
from typing import TYPE_CHECKING

import numpy as np

from sitl.control.records import ESTIMATE
from sitl.control.truth import true_estimate
from sitl.history import History
from vehicle_model.compiled import compiled
from vehicle_model.integrate import observe
from vehicle_model.records import OUTPUTS
from vehicle_model.state import CONTROL_COUNT, STATE_COUNT, TILT

if TYPE_CHECKING:
    from sitl.airframe import Airframe
    from sitl.flight.flight import Flight

__all__ = ["Recorder"]

NO_MISSION = -1


class Recorder:
    """Adds rows to `history`, one at each call of `keep`."""

    def __init__(self, airframe: "Airframe") -> None:
        self.history = History()
        self._airframe = airframe
        self._wetted, self._outer = airframe.aircraft.wing_strips
        self._estimate = np.zeros(1, ESTIMATE)
        self._outputs = np.zeros(1, OUTPUTS)
        self._rate_of_change = np.empty(STATE_COUNT)

    def keep(self, flight: "Flight | None") -> None:
        """Keep this moment; without a flight what is the flight's stays zero."""
        airframe = self._airframe
        rows = self.history.new_row()
        _keep(
            rows, airframe.state, airframe.controls, airframe.vehicle, airframe.environment, airframe.setpoint,
            self._wetted, self._outer, self._estimate, self._outputs, self._rate_of_change,
        )  # fmt: skip
        row = rows[0]
        voltage, current, remaining = airframe.battery
        row["time"] = airframe.time
        row["voltage"], row["current"], row["power"] = voltage, current, voltage * current
        row["battery_remaining"] = 1.0 if remaining is None else remaining
        row["mission_item"] = NO_MISSION
        if flight is not None:
            row["armed"], row["mode"] = flight.armed, flight.mode
            row["regime"], row["landed"] = flight.regime, flight.landed
            if flight.mission.items:
                row["mission_item"] = flight.mission.current


@compiled
def _keep(rows, state, controls, vehicle, environment, setpoints, wetted, outer, estimates, outputs, rate) -> None:
    """What follows from the state of the moment, and the setpoint."""
    row = rows[0]
    observe(state, controls, vehicle, environment, outputs, rate)
    true_estimate(state, vehicle, environment, estimates)
    out, estimate, setpoint = outputs[0], estimates[0], setpoints[0]
    for k in range(STATE_COUNT):
        row.state[k] = state[k]
    for k in range(CONTROL_COUNT):
        row.controls[k] = controls[k]
    for k in range(3):
        row.position_ned[k] = estimate.position_ned[k]
        row.velocity_ned[k] = estimate.velocity_ned[k]
        row.euler[k] = estimate.euler[k]
        row.wind_ned[k] = estimate.wind_ned[k]
        row.start_ned[k] = setpoint.start_ned[k]
        row.target_ned[k] = setpoint.position_ned[k]
    row.airspeed = estimate.airspeed
    row.height_above_ground = out.height_above_ground
    row.stall_margin_wetted = math.inf
    for i in wetted:
        row.stall_margin_wetted = min(row.stall_margin_wetted, out.stall_margin[i])
    row.stall_margin_outer = math.inf
    for i in outer:
        row.stall_margin_outer = min(row.stall_margin_outer, out.stall_margin[i])
    row.tilt, row.tilt_command = state[TILT], controls[3]
    for i in range(vehicle[0].contact_count):
        if out.contact_force_body[i, 2] != 0.0:
            row.contact = 1
    row.level, row.horizontal, row.vertical = setpoint.level, setpoint.horizontal, setpoint.vertical
    row.cruise, row.radius = setpoint.cruise, setpoint.radius
