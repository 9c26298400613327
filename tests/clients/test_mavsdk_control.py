"""MAVSDK's Offboard and ManualControl plugins: setpoints of every kind, and sticks."""

import math
import threading
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from mavsdk.plugins.manual_control import ManualControl, ManualControlError
from mavsdk.plugins.offboard import (
    AccelerationNed,
    Attitude,
    AttitudeRate,
    Offboard,
    OffboardError,
    PositionGlobalYaw,
    PositionNedYaw,
    VelocityBodyYawspeed,
    VelocityNedYaw,
)
from mavsdk.plugins.telemetry import FlightMode

from tests.clients.mavsdk_station import MavsdkStation
from tests.clients.vehicle import place, until

RATE = 20.0  # of the sticks [Hz], wall time
STILL = VelocityNedYaw(0.0, 0.0, 0.0, 0.0)


@pytest.fixture
def offboard(station: MavsdkStation) -> Iterator[Any]:
    """The plugin, the vehicle holding 20 m above home."""
    station.take_off(20.0)
    made = station.plugin(Offboard)
    yield made
    if made.is_active():
        made.stop()


def velocity(station: MavsdkStation) -> tuple[float, float, float]:
    now = station.telemetry.position_velocity_ned().velocity
    return now.north_m_s, now.east_m_s, now.down_m_s


def turned(station: MavsdkStation, start: float) -> float:
    """Degrees from a heading, to the right."""
    return (station.telemetry.heading().heading_deg - start + 180.0) % 360.0 - 180.0


def test_offboard_needs_a_setpoint_first(station: MavsdkStation) -> None:
    with pytest.raises(OffboardError, match="NO_SETPOINT_SET"):
        station.plugin(Offboard).start()


def test_positions_are_flown_and_held_until_it_stops(station: MavsdkStation, offboard: Any) -> None:
    offboard.set_position_ned(PositionNedYaw(6.0, -4.0, -25.0, 90.0))
    offboard.start()
    station.wait_for_mode(FlightMode.OFFBOARD)
    assert offboard.is_active()
    until(lambda: station.at(6.0, -4.0, 25.0, within=0.3))
    until(lambda: abs(turned(station, 90.0)) < 2.0)
    offboard.set_position_velocity_ned(PositionNedYaw(0.0, 0.0, -22.0, 0.0), STILL)
    until(lambda: station.at(0.0, 0.0, 22.0, within=0.3))
    offboard.set_position_velocity_acceleration_ned(
        PositionNedYaw(4.0, 0.0, -22.0, 0.0), STILL, AccelerationNed(0.0, 0.0, 0.0)
    )
    until(lambda: station.at(4.0, 0.0, 22.0, within=0.3))
    offboard.set_position_global(
        PositionGlobalYaw(*place(0.0, 5.0), 30.0, 0.0, PositionGlobalYaw.AltitudeType.REL_HOME)
    )
    until(lambda: station.at(0.0, 5.0, 30.0, within=0.5))
    offboard.stop()
    station.wait_for_mode(FlightMode.HOLD)
    assert not offboard.is_active()


def test_velocities_and_accelerations_are_flown(station: MavsdkStation, offboard: Any) -> None:
    offboard.set_velocity_ned(VelocityNedYaw(0.0, 3.0, -1.0, 90.0))
    offboard.start()
    until(lambda: math.dist(velocity(station), (0.0, 3.0, -1.0)) < 0.2)
    until(lambda: abs(turned(station, 90.0)) < 2.0)
    offboard.set_velocity_body(VelocityBodyYawspeed(-2.0, 0.0, 0.0, 0.0))  # backwards: to the west
    until(lambda: math.dist(velocity(station), (0.0, -2.0, 0.0)) < 0.3)
    offboard.set_velocity_body(VelocityBodyYawspeed(0.0, 0.0, 0.0, -20.0))
    until(lambda: turned(station, 90.0) < -60.0)
    offboard.set_acceleration_ned(AccelerationNed(0.5, 0.0, 0.0))
    until(lambda: velocity(station)[0] > 2.0)


def test_attitudes_and_rates_are_flown(station: MavsdkStation, offboard: Any) -> None:
    offboard.set_attitude(Attitude(0.0, -4.0, 0.0, 0.55))
    offboard.start()
    until(lambda: abs(station.telemetry.attitude_euler().pitch_deg + 4.0) < 0.5)
    heading = station.telemetry.heading().heading_deg
    offboard.set_attitude_rate(AttitudeRate(0.0, 0.0, 20.0, 0.55))
    until(lambda: turned(station, heading) > 30.0)


def test_another_mode_ends_it(station: MavsdkStation, offboard: Any) -> None:
    offboard.set_velocity_ned(VelocityNedYaw(1.0, 0.0, 0.0, 0.0))
    offboard.start()
    station.wait_for_mode(FlightMode.OFFBOARD)
    station.action.hold()  # MAVSDK sends no more when it sees another mode, and Hold goes on
    station.wait_for_mode(FlightMode.HOLD)
    until(lambda: not offboard.is_active())
    until(lambda: math.hypot(*velocity(station)) < 0.1)


class Sticks:
    """Moved by a pilot.

    Attributes:
        at: x (forward), y (right), z (throttle, 0 to 1), r (turn).
    """

    def __init__(self, plugin: Any) -> None:
        self.at = (0.0, 0.0, 0.5, 0.0)
        self._plugin = plugin
        self._stop = threading.Event()

    def _send(self) -> None:
        while not self._stop.wait(1.0 / RATE):
            self._plugin.set_manual_control_input(*self.at)

    @contextmanager
    def held(self) -> Generator[None]:
        thread = threading.Thread(target=self._send)
        thread.start()
        try:
            yield
        finally:
            self._stop.set()
            thread.join()


def test_sticks_fly_it_in_position_and_altitude_and_their_loss_brings_it_home(station: MavsdkStation) -> None:
    plugin = station.plugin(ManualControl)
    station.take_off(20.0)
    sticks = Sticks(plugin)
    with pytest.raises(ManualControlError, match="INPUT_NOT_SET"):
        plugin.start_position_control()
    plugin.set_manual_control_input(*sticks.at)
    with sticks.held():
        until(lambda: station.telemetry.rc_status().is_available)
        plugin.start_position_control()
        station.wait_for_mode(FlightMode.POSCTL)
        sticks.at = (1.0, 0.0, 0.5, 0.0)
        until(lambda: velocity(station)[0] > 6.0)  # to the north, where it looks
        sticks.at = (0.0, 0.0, 0.5, 1.0)
        until(lambda: turned(station, 0.0) > 30.0)
        sticks.at = (0.0, 0.0, 0.5, 0.0)
        until(lambda: math.hypot(*velocity(station)) < 0.2)
        plugin.start_altitude_control()
        station.wait_for_mode(FlightMode.ALTCTL)
        sticks.at = (0.0, 0.0, 1.0, 0.0)
        until(lambda: velocity(station)[2] < -1.5)
    station.wait_for_mode(FlightMode.RETURN_TO_LAUNCH)
    until(lambda: not station.telemetry.rc_status().is_available)
    assert "Manual control lost" in station.texts
