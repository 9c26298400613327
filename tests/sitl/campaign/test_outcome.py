"""What counts as lost, on flights made up to be just that."""

import json
import math

import numpy as np
import pytest

from sitl.campaign.cases import Scatter, draw_case
from sitl.campaign.outcome import Outcome, as_table, losses
from sitl.flight_summary import summarise
from sitl.history import ROW

LANDING_ITEM = 5


def good_flight() -> np.ndarray:
    """Ten seconds on the ground, thirty in the air, ten on the ground again, at 50 Hz."""
    rows = np.zeros(2500, ROW)
    rows["time"] = np.arange(2500) / 50.0
    rows["contact"], rows["height_above_ground"] = 1, 0.27
    rows["contact"][500:2000], rows["height_above_ground"][500:2000] = 0, 40.0
    rows["position_ned"][500:2000, 2] = -40.0
    rows["velocity_ned"][1990:2000, 2] = 0.4
    rows["mission_item"][1500:] = LANDING_ITEM
    return rows


def judged(rows: np.ndarray, finished: bool = True) -> tuple[str, ...]:
    """Losses with a fence of 500 m and the landing point at home."""
    return losses(
        rows,
        landing_item=LANDING_ITEM,
        landing_point=(0.0, 0.0),
        inside=lambda north, east, down: math.hypot(north, east) < 500.0 and -down < 120.0,
        finished=finished,
    )


def test_a_flight_that_lands_where_it_should_is_not_lost() -> None:
    assert judged(good_flight()) == ()


def test_an_unfinished_mission_is_lost() -> None:
    assert judged(good_flight()[:1200], finished=False) == ("mission not finished",)


@pytest.mark.parametrize("bank", [-95.0, 100.0])
def test_bank_beyond_90_deg_is_lost(bank: float) -> None:
    rows = good_flight()
    rows["euler"][1000, 0] = math.radians(bank)
    assert judged(rows) == ("bank beyond 90 deg at t = 20.0 s",)


def test_bank_within_90_deg_is_not() -> None:
    rows = good_flight()
    rows["euler"][1000, 0] = math.radians(85.0)
    assert judged(rows) == ()


def test_contact_before_the_landing_item_is_lost() -> None:
    rows = good_flight()
    rows["contact"][1200] = 1
    assert judged(rows) == ("ground touched in mission item 0 at t = 24.0 s",)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_leaving_the_fence_is_lost(axis: int) -> None:
    rows = good_flight()
    rows["position_ned"][1000:1050, axis] = -600.0
    assert judged(rows) == ("fence left at t = 20.0 s",)


def test_a_crash_at_the_landing_point_is_no_landing() -> None:
    rows = good_flight()
    rows["velocity_ned"][1999, 2] = 5.0
    rows["euler"][2000, 1] = math.radians(-50.0)
    assert judged(rows) == (
        "touched down leaning 50 deg at t = 40.0 s",
        "touched down with 5.0 m/s at t = 40.0 s",
    )


def test_a_landing_elsewhere_is_lost() -> None:
    rows = good_flight()
    rows["position_ned"][1900:, 1] = 25.0
    assert judged(rows) == ("touched down 25 m from the landing point at t = 40.0 s",)


def test_losses_come_in_the_order_of_time() -> None:
    rows = good_flight()
    rows["position_ned"][800:, 0] = 1000.0
    rows["euler"][1000, 0] = 3.0
    assert [reason.partition(" at")[0] for reason in judged(rows, finished=False)] == [
        "fence left",
        "bank beyond 90 deg",
        "touched down 1000 m from the landing point",
        "mission not finished",
    ]


def test_an_outcome_survives_json_whatever_never_was() -> None:
    rows = good_flight()[:1200]
    outcome = Outcome(draw_case(0, 3, Scatter()), ("mission not finished",), 24.0, summarise(rows, (0.0, 0.0)))
    table = json.loads(json.dumps(as_table(outcome), allow_nan=False))
    assert table["summary"]["touchdown_speed"] is None
    assert table["case"]["number"] == 3
    assert table["lost"] == ["mission not finished"]
