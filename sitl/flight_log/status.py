"""The part of a log's moment that the flight's events decide: modes, arming, regime, home, mission; PX4's numbers."""

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from sitl.flight.failsafe import Action
from sitl.flight.mode import Mode
from sitl.flight.regime import Regime

if TYPE_CHECKING:
    from sitl.airframe import Airframe
    from sitl.flight.flight import Flight

__all__ = ["StatusNotes"]

# https://docs.px4.io/main/en/msg_docs/VehicleStatus.html and VtolVehicleStatus.html
NAV_STATES = {
    Mode.MANUAL: 0,
    Mode.ALTITUDE: 1,
    Mode.POSITION: 2,
    Mode.MISSION: 3,
    Mode.HOLD: 4,
    Mode.RETURN: 5,
    Mode.TERMINATION: 13,
    Mode.OFFBOARD: 14,
    Mode.STABILIZED: 15,
    Mode.TAKEOFF: 17,
    Mode.LAND: 18,
    Mode.ORBIT: 21,
}
DISARMED, ARMED = 1, 2
UNKNOWN_TYPE, ROTARY_WING, FIXED_WING = 0, 1, 2
UNDEFINED_STATE = 0
VTOL_STATES = {Regime.TO_CRUISE: 1, Regime.TO_HOVER: 2, Regime.HOVER: 3, Regime.CRUISE: 4}
NO_ITEM = -1
HIGHEST_ITEM = 0xFFFF


class StatusNotes:
    """Keeps the status in a MOMENT array (1,) up to date, at little cost while nothing changes."""

    def __init__(self, moment: np.ndarray, airframe: "Airframe") -> None:
        """Begin a flight of this airframe."""
        self._moment = moment
        self._rate = airframe.rate
        self._flags: tuple[Any, ...] = ()
        self._details: tuple[Any, ...] = ()
        world, rotors = airframe.environment[0], airframe.vehicle[0]["rotors"]
        self._write(
            reversible=sum(1 << k for k, rotor in enumerate(rotors) if rotor["min_throttle"] < 0.0),
            cells=round(airframe.aircraft.battery.cells),
            origin_latitude=math.degrees(world["latitude"]),
            origin_longitude=math.degrees(world["longitude"]),
            origin_altitude=world["height_ellipsoid"],
            home_latitude=math.degrees(world["latitude"]),
            home_longitude=math.degrees(world["longitude"]),
            home_altitude=world["height_ellipsoid"],
            **dict.fromkeys(("home_north", "home_east", "home_down"), 0.0),
            **dict.fromkeys(("armed_time", "takeoff_time", "nav_state_time", "mission_current", "mission_total"), 0),
            mission_reached=NO_ITEM,
            mission_finished=False,
        )

    def note_flight(self, flight: "Flight", tick: int) -> bool:
        """Take modes, arming and regime down at a tick; returns whether any of them has changed."""
        flags = (flight.armed, flight.mode, flight.landed, flight.regime)
        if flags == self._flags:
            return False
        self._flags = flags
        regime = flight.regime
        self._write(
            landed=flight.on_ground,
            vehicle_type=FIXED_WING if regime == Regime.CRUISE else ROTARY_WING,
            vtol_state=VTOL_STATES[regime],
            in_transition=regime in (Regime.TO_CRUISE, Regime.TO_HOVER),
            in_transition_to_cruise=regime == Regime.TO_CRUISE,
        )
        self._note_arming(flight.armed, flight.flying, NAV_STATES[flight.mode], tick)
        return True

    def note_details(self, flight: "Flight", reached: int | None) -> None:
        """Take down what may be told a little later: home, failsafe, mission; `reached` is the item done last."""
        mission, home, action = flight.mission, flight.home, flight.failsafes.action
        count = len(mission.items)
        details = (mission.current, count, mission.finished, reached, action, home.north, home.east, home.down)
        if details == self._details:
            return
        self._details = details
        latitude, longitude, altitude = home.geodetic
        self._write(
            failsafe=action > Action.WARN,
            home_latitude=latitude,
            home_longitude=longitude,
            home_altitude=altitude,
            home_north=home.north,
            home_east=home.east,
            home_down=home.down,
            mission_current=min(mission.current, HIGHEST_ITEM),
            mission_total=min(count, HIGHEST_ITEM),
            mission_reached=NO_ITEM if reached is None else reached,
            mission_finished=bool(count) and mission.finished,
        )

    def note_outside(self, turning: bool, touching: bool, tick: int) -> bool:
        """As `note_flight` while its own controller does not fly: armed as long as a motor is told to turn."""
        flags = (turning, touching)
        if flags == self._flags:
            return False
        self._flags, self._details = flags, ()
        self._write(
            landed=touching,
            vehicle_type=UNKNOWN_TYPE,
            vtol_state=UNDEFINED_STATE,
            in_transition=False,
            in_transition_to_cruise=False,
            failsafe=False,
        )
        self._note_arming(turning, turning and not touching, NAV_STATES[Mode.MANUAL], tick)
        return True

    def _note_arming(self, armed: bool, flying: bool, nav_state: int, tick: int) -> None:
        time_us = round(tick / self._rate * 1e6)
        values = self._moment[0]
        changed = values["nav_state"] != nav_state
        self._write(
            arming_state=ARMED if armed else DISARMED,
            armed_time=(values["armed_time"] or max(time_us, 1)) if armed else 0,
            takeoff_time=(values["takeoff_time"] or max(time_us, 1)) if flying else 0,
            nav_state=nav_state,
            nav_state_time=time_us if changed else values["nav_state_time"],
        )

    def _write(self, **values: Any) -> None:
        moment = self._moment[0]
        for name, value in values.items():
            moment[name] = value
