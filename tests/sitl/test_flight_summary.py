"""A flight's summary against flights whose numbers are known beforehand."""

import math

import numpy as np
import pytest

from sitl.control.records import Horizontal, Level, Vertical
from sitl.flight_summary import airborne, summarise
from sitl.history import ROW, History

STANDING = 0.27  # height of the centre of mass above the ground on the gear [m]
RATE = 50


def standing(seconds: float) -> np.ndarray:
    """Rows of an aircraft on its gear at home."""
    rows = np.zeros(round(seconds * RATE), ROW)
    rows["contact"], rows["height_above_ground"], rows["level"] = 1, STANDING, Level.IDLE
    rows["battery_remaining"] = 1.0
    return rows


def leg(seconds: float, height: float = 40.0, speed: float = 20.0) -> np.ndarray:
    """Rows of a flight north along a leg that begins at home, at its height and without any error."""
    rows = np.zeros(round(seconds * RATE), ROW)
    along = np.arange(len(rows)) / RATE * speed
    rows["position_ned"][:, 0], rows["position_ned"][:, 2] = along, -height
    rows["height_above_ground"] = height + STANDING
    rows["velocity_ned"][:, 0] = rows["airspeed"] = speed
    rows["level"], rows["horizontal"], rows["vertical"] = Level.VELOCITY, Horizontal.LEG, Vertical.ALTITUDE
    rows["target_ned"] = 1000.0, 0.0, -height
    rows["stall_margin_wetted"] = rows["stall_margin_outer"] = 0.2
    rows["battery_remaining"] = 1.0
    return rows


def flight(*parts: np.ndarray) -> np.ndarray:
    """Parts of a flight after one another, with the time going on."""
    rows = np.concatenate(parts)
    rows["time"] = np.arange(len(rows)) / RATE
    return rows


def test_airborne_is_from_lift_off_to_the_first_contact_after_it() -> None:
    rows = flight(standing(2.0), leg(10.0), standing(3.0))
    assert airborne(rows) == slice(100, 600)
    assert summarise(rows, (0.0, 0.0)).duration == pytest.approx(10.0, abs=0.03)


def test_a_hop_on_the_gear_is_no_flight() -> None:
    rows = flight(standing(2.0))
    rows["contact"][50:60] = 0
    rows["height_above_ground"][50:60] += 0.1
    assert airborne(rows) == slice(0, 0)
    assert math.isnan(summarise(rows, (0.0, 0.0)).bank)


def test_a_flight_that_begins_in_the_air_is_airborne_from_the_start() -> None:
    assert airborne(flight(leg(5.0))) == slice(0, 250)


def test_cross_track_is_the_distance_from_the_line_once_joined_and_settled() -> None:
    rows = flight(leg(30.0))
    rows["position_ned"][:300, 1] = 0.2  # across the line
    rows["position_ned"][300:600, 1] = 40.0  # the turn onto it, 10 s and more after the leg began
    rows["position_ned"][700:, 1] = 1.5
    assert summarise(rows, (0.0, 0.0)).cross_track == pytest.approx(1.5)


def test_a_leg_that_is_never_joined_counts_in_full() -> None:
    rows = flight(leg(30.0))
    rows["position_ned"][:, 1] = 40.0
    assert summarise(rows, (0.0, 0.0)).cross_track == pytest.approx(40.0)


def test_cross_track_is_measured_from_a_line_in_any_direction() -> None:
    rows = flight(leg(30.0))
    turn = math.radians(127.0)
    across = 2.5
    along = rows["position_ned"][:, 0].copy()
    rows["position_ned"][:, 0] = 100.0 + along * math.cos(turn) - across * math.sin(turn)
    rows["position_ned"][:, 1] = -50.0 + along * math.sin(turn) + across * math.cos(turn)
    rows["start_ned"][:, :2] = 100.0, -50.0
    rows["target_ned"][:, :2] = 100.0 + 1000.0 * math.cos(turn), -50.0 + 1000.0 * math.sin(turn)
    assert summarise(rows, (0.0, 0.0)).cross_track == pytest.approx(across)


def test_beyond_the_end_of_a_leg_nothing_is_off_it() -> None:
    rows = flight(leg(60.0))
    rows["position_ned"][2600:, 1] = 30.0  # 1040 m along, the leg ends at 1000 m
    assert summarise(rows, (0.0, 0.0)).cross_track == 0.0


def test_altitude_error_counts_from_when_the_height_is_first_reached() -> None:
    rows = flight(leg(30.0))
    rows["position_ned"][:250, 2] = -20.0  # still climbing
    rows["position_ned"][500, 2] = -43.0  # captured long before
    assert summarise(rows, (0.0, 0.0)).altitude_error == pytest.approx(3.0)


def test_touch_down_is_the_sink_rate_before_and_the_place_of_the_first_contact() -> None:
    rows = flight(standing(2.0), leg(10.0), standing(3.0))
    rows["velocity_ned"][599, 2] = 0.45
    rows["position_ned"][600, :2] = 3.0, 4.0
    summary = summarise(rows, (0.0, 0.0))
    assert summary.touchdown_speed == pytest.approx(0.45)
    assert summary.touchdown_distance == pytest.approx(5.0)


def test_a_flight_that_never_lands_has_no_touch_down() -> None:
    assert math.isnan(summarise(flight(standing(2.0), leg(5.0)), (0.0, 0.0)).touchdown_speed)


def test_margins_are_the_smallest_in_the_air_and_of_the_outer_wing_at_speed() -> None:
    rows = flight(standing(2.0), leg(10.0), standing(3.0))
    rows["stall_margin_wetted"][:100] = -1.0  # on the ground, in the wind
    rows["stall_margin_wetted"][300] = 0.07
    rows["airspeed"][400:410] = 5.0
    rows["stall_margin_outer"][400:410] = -1.2  # hardly any air flows there
    rows["stall_margin_outer"][450] = 0.11
    summary = summarise(rows, (0.0, 0.0))
    assert summary.margin_wetted == pytest.approx(0.07)
    assert summary.margin_outer == pytest.approx(0.11)


def test_energy_is_power_over_time_and_bank_counts_either_way() -> None:
    rows = flight(leg(10.0))
    rows["power"] = 500.0
    rows["euler"][77, 0] = -0.6
    rows["battery_remaining"] = np.linspace(0.9, 0.7, len(rows))
    summary = summarise(rows, (0.0, 0.0))
    assert summary.energy == pytest.approx(500.0 * (len(rows) - 1) / RATE)
    assert summary.bank == pytest.approx(0.6)
    assert summary.battery_used == pytest.approx(0.2)


def test_a_history_grows_and_keeps_what_was_written() -> None:
    history = History(capacity=2)
    for number in range(100):
        history.new_row()["time"] = number
    assert len(history) == 100
    assert history.rows["time"].tolist() == list(range(100))
    assert not history.rows["power"].any()


def test_a_history_needs_room() -> None:
    with pytest.raises(ValueError, match="capacity: expected room for at least 1 row, got 0"):
        History(capacity=0)
