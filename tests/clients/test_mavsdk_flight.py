"""MAVSDK's Action plugin: a sortie, every action, and what it is told when it asks for something that cannot be."""

import math
from typing import Any

import pytest
from mavsdk.plugins.action import ActionError, OrbitYawBehavior
from mavsdk.plugins.telemetry import FlightMode, LandedState, VtolState

from tests.clients.mavsdk_station import MavsdkStation
from tests.clients.vehicle import HOME, place, until


@pytest.fixture(scope="module")
def vehicle_options() -> dict[str, Any]:
    return {"speed": 16}


CRUISE_ALTITUDE = HOME[2] + 60.0


def changes(values: list[int]) -> list[int]:
    """Without what repeats the value before."""
    return [value for index, value in enumerate(values) if index == 0 or values[index - 1] != value]


def test_it_takes_off_to_the_height_it_has_set_and_lands(station: MavsdkStation) -> None:
    landed: list[int] = []
    heard = station.telemetry.subscribe_landed_state(lambda state, _: landed.append(state))
    station.take_off(12.0)
    assert station.action.get_takeoff_altitude() == 12.0
    assert station.height == pytest.approx(12.0, abs=0.6)
    assert station.telemetry.armed()
    assert station.telemetry.in_air()
    station.action.land()
    until(lambda: not station.telemetry.armed())
    station.telemetry.unsubscribe_landed_state(heard)
    assert changes(landed)[-4:] == [
        LandedState.TAKING_OFF, LandedState.IN_AIR, LandedState.LANDING, LandedState.ON_GROUND,
    ]  # fmt: skip
    assert not station.telemetry.in_air()
    assert {"Armed", "Take-off detected", "Landing detected", "Disarmed: landed"} <= set(station.texts)


def test_it_makes_both_transitions_and_sees_them(station: MavsdkStation) -> None:
    states: list[int] = []
    heard = station.telemetry.subscribe_vtol_state(lambda state, _: states.append(state))
    station.take_off(30.0)
    station.action.transition_to_fixedwing()
    until(lambda: station.telemetry.vtol_state() == VtolState.FW)
    metrics = station.telemetry.fixedwing_metrics
    until(lambda: metrics().airspeed_m_s > 18.0)
    assert station.height == pytest.approx(30.0, abs=2.0)
    station.action.transition_to_multicopter()
    until(lambda: station.telemetry.vtol_state() == VtolState.MC)
    until(lambda: metrics().groundspeed_m_s < 0.3)
    station.telemetry.unsubscribe_vtol_state(heard)
    assert changes(states)[-5:] == [
        VtolState.MC, VtolState.TRANSITION_TO_FW, VtolState.FW, VtolState.TRANSITION_TO_MC, VtolState.MC,
    ]  # fmt: skip


def test_it_is_sent_to_a_place_in_hover_at_a_speed_and_a_heading(station: MavsdkStation) -> None:
    station.take_off(20.0)
    station.action.goto_location(*place(40.0, 30.0), HOME[2] + 25.0, 90.0)
    station.action.set_current_speed(3.0)
    speeds: list[float] = []
    heard = station.telemetry.subscribe_velocity_ned(lambda v, _: speeds.append(math.hypot(v.north_m_s, v.east_m_s)))
    until(lambda: station.at(40.0, 30.0, 25.0))
    station.telemetry.unsubscribe_velocity_ned(heard)
    assert max(speeds) == pytest.approx(3.0, abs=0.3)
    until(lambda: abs(station.telemetry.heading().heading_deg - 90.0) < 2.0)


def test_it_circles_a_place_wing_borne_and_comes_home(station: MavsdkStation) -> None:
    station.begin("trim:20")
    assert station.telemetry.vtol_state() == VtolState.FW
    station.action.goto_location_fixedwing(*place(300.0, 0.0), CRUISE_ALTITUDE, 120.0)
    until(lambda: abs(distance(station, 300.0, 0.0) - 120.0) < 5.0 and abs(station.height - 60.0) < 2.0)
    station.action.do_orbit(
        100.0, 20.0, OrbitYawBehavior.HOLD_FRONT_TANGENT_TO_CIRCLE, *place(300.0, 0.0), CRUISE_ALTITUDE
    )
    until(lambda: abs(distance(station, 300.0, 0.0) - 100.0) < 5.0)
    station.action.hold()
    station.wait_for_mode(FlightMode.HOLD)
    station.action.set_return_to_launch_altitude(30.0)
    assert station.action.get_return_to_launch_altitude() == 30.0
    station.action.return_to_launch()
    station.wait_for_mode(FlightMode.RETURN_TO_LAUNCH)
    until(lambda: not station.telemetry.armed())
    assert distance(station, 0.0, 0.0) < 1.0
    assert station.telemetry.vtol_state() == VtolState.MC


def distance(station: MavsdkStation, north: float, east: float) -> float:
    """Over ground, to a place near home [m]."""
    position = station.telemetry.position_velocity_ned().position
    return math.hypot(position.north_m - north, position.east_m - east)


def test_what_cannot_be_is_denied_with_the_reason(station: MavsdkStation) -> None:
    with pytest.raises(ActionError, match="COMMAND_DENIED"):
        station.action.transition_to_fixedwing()
    until(lambda: any("on the ground" in text for text in station.texts))
    with pytest.raises(ActionError, match="COMMAND_DENIED"):
        station.action.set_current_speed(50.0)
    until(lambda: any("50" in text for text in station.texts))
    station.take_off(10.0)
    with pytest.raises(ActionError, match="COMMAND_DENIED"):
        station.action.disarm()
    until(lambda: "not disarmed: flying" in station.texts)
    assert station.telemetry.armed()


def test_it_moves_home_and_returns_there(station: MavsdkStation) -> None:
    station.take_off(15.0)
    station.action.set_home(False, *place(8.0, 0.0), HOME[2])
    until(lambda: abs(station.telemetry.home().latitude_deg - place(8.0, 0.0)[0]) < 1e-6)
    station.action.return_to_launch()
    until(lambda: not station.telemetry.armed())
    assert distance(station, 8.0, 0.0) < 1.0


def test_an_actuator_is_set_beside_the_flight(station: MavsdkStation) -> None:
    station.action.set_actuator(1, 0.5)


@pytest.mark.parametrize("end", ["kill", "terminate"])
def test_the_flight_is_ended_by_force(station: MavsdkStation, end: str) -> None:
    station.begin("trim:20")
    getattr(station.action, end)()
    if end == "kill":
        until(lambda: not station.telemetry.armed())
    else:
        until(lambda: "Flight terminated" in station.texts)
    until(lambda: station.height < 50.0)


def test_it_begins_anew_when_rebooted(station: MavsdkStation) -> None:
    station.take_off(5.0)
    with pytest.raises(ActionError, match="COMMAND_DENIED"):
        station.action.reboot()
    station.action.land()
    until(lambda: not station.telemetry.armed())
    before = station.telemetry.attitude_euler().timestamp_us
    station.action.reboot()
    until(lambda: station.telemetry.attitude_euler().timestamp_us < before)
    until(station.telemetry.health_all_ok)
