"""The report page: a picture of the promised size that shows what was flown, for whole and for cut-off flights."""

import math
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

from sitl.control.records import Horizontal, Level, Vertical
from sitl.flight.mode import Mode
from sitl.flight.regime import Regime
from sitl.flight_report import flight_report
from sitl.history import ROW
from sitl.report_page import Page

RATE = 10
CORNERS = ((0.0, 0.0), (900.0, 0.0), (900.0, 600.0), (0.0, 600.0), (0.0, 0.0))


def flown() -> np.ndarray:
    """A made-up flight: up, to cruise, around a rectangle, back to hover and down."""
    phases = (
        (10, Regime.HOVER),
        (8, Regime.TO_CRUISE),
        (150, Regime.CRUISE),
        (12, Regime.TO_HOVER),
        (40, Regime.HOVER),
    )
    regime = np.concatenate([np.full(seconds * RATE, kind) for seconds, kind in phases])
    rows = np.zeros(len(regime), ROW)
    time = np.arange(len(rows)) / RATE
    share = np.interp(time, [18.0, 168.0], [0.0, 3000.0])  # along the rectangle [m]
    way = np.cumsum([0.0, 900.0, 600.0, 900.0, 600.0])
    north, east = (np.interp(share, way, [corner[axis] for corner in CORNERS]) for axis in (0, 1))
    height = np.interp(time, [0.0, 2.0, 10.0, 60.0, 120.0, 168.0, 180.0, 225.0], [0, 0, 40, 70, 70, 45, 40, 0])
    speed = np.interp(time, [10.0, 18.0, 168.0, 180.0], [0.0, 20.0, 20.0, 0.0])
    rows["time"], rows["regime"] = time, regime
    rows["mode"] = np.where(time < 10.0, Mode.TAKEOFF, np.where(time > 185.0, Mode.LAND, Mode.MISSION))
    rows["position_ned"] = np.column_stack([north, east, -height])
    rows["velocity_ned"] = np.gradient(rows["position_ned"], 1.0 / RATE, axis=0)
    rows["airspeed"] = np.abs(speed + 0.4 * np.sin(time))
    rows["wind_ned"] = 3.0, -4.0, 0.0
    rows["height_above_ground"] = height + 0.27
    rows["contact"] = height < 0.01
    rows["tilt_command"] = np.radians(90.0 - 4.2 * speed)
    rows["tilt"] = np.roll(rows["tilt_command"], 3)
    rows["power"] = np.where(rows["contact"] == 1, 60.0, 2700.0 - 110.0 * speed + 60.0 * np.sin(3.0 * time))
    rows["current"] = rows["power"] / 44.0
    rows["battery_remaining"] = 1.0 - np.cumsum(rows["current"]) / RATE / 43200.0
    rows["stall_margin_wetted"] = math.radians(22.0) - 0.012 * speed * np.cos(0.3 * time)
    rows["stall_margin_outer"] = np.radians(speed - 9.0 + np.sin(time))
    rows["euler"][:, 0] = 0.3 * np.sin(0.2 * time) * (speed > 15.0)
    rows["level"], rows["vertical"], rows["horizontal"] = Level.VELOCITY, Vertical.ALTITUDE, Horizontal.LEG
    rows["target_ned"][:, 2] = -np.select([time < 60.0, time < 120.0, time < 185.0], [40.0, 70.0, 45.0], 0.0)
    return rows


PAGE = Page(
    "Survey of 3 km",
    ("hong2013 · 47.397742° N, 8.545594° E, 488 m · seed 0", "made up for a test"),
    route=CORNERS,
    fences=(np.array([(-200.0, -200.0), (1100.0, -200.0), (1100.0, 800.0), (-200.0, 800.0)]),),
)


def test_the_report_is_an_a4_page_at_150_dots_per_inch(tmp_path: Path) -> None:
    path = flight_report(flown(), PAGE, tmp_path / "flight.png")
    picture = matplotlib.image.imread(path)
    assert picture.shape[:2] == (1753, 1240)


def test_the_same_history_gives_the_same_page(tmp_path: Path) -> None:
    first = flight_report(flown(), PAGE, tmp_path / "first.png").read_bytes()
    assert flight_report(flown(), PAGE, tmp_path / "second.png").read_bytes() == first


def test_another_track_is_another_page(tmp_path: Path) -> None:
    rows = flown()
    first = flight_report(rows, PAGE, tmp_path / "first.png").read_bytes()
    rows["position_ned"][:, 0] *= 0.5
    assert flight_report(rows, PAGE, tmp_path / "second.png").read_bytes() != first


@pytest.mark.parametrize("seconds", [0.2, 5.0, 30.0])
def test_a_flight_cut_off_early_still_has_a_page(tmp_path: Path, seconds: float) -> None:
    assert (
        flight_report(flown()[: round(seconds * RATE)], Page("Cut off"), tmp_path / "cut.png").stat().st_size > 10_000
    )


def test_too_short_a_history_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="history: expected at least 2 rows to draw, got 1"):
        flight_report(flown()[:1], PAGE, tmp_path / "none.png")
