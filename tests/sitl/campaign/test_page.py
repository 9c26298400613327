"""The tables of a campaign name the right flights and the right numbers."""

import math

from sitl.campaign.cases import Scatter, draw_case
from sitl.campaign.outcome import Outcome
from sitl.campaign.page import lost_table, markdown, short_table, spread_table, worst_table
from sitl.flight_summary import FlightSummary


def outcome(number: int, lost: tuple[str, ...] = (), **values: float) -> Outcome:
    """An outcome whose numbers are all 1 but for those given."""
    fields = dict.fromkeys(FlightSummary.__dataclass_fields__, 1.0) | values
    return Outcome(draw_case(0, number, Scatter()), lost, 300.0, FlightSummary(**fields))


OUTCOMES = (
    outcome(0, cross_track=2.0, margin_wetted=0.3),
    outcome(1, cross_track=5.0, margin_wetted=0.1),
    outcome(2, cross_track=3.0, touchdown_speed=math.nan),
    outcome(3, ("fence left at t = 20.0 s", "mission not finished"), cross_track=900.0, margin_wetted=-1.0),
)


def cell(table: tuple[tuple[str, ...], list[tuple[str, ...]]], row: str, column: str) -> str:
    """The cell of a table in the row and column of these names."""
    head, rows = table
    (found,) = [line for line in rows if line[0] == row]
    return found[head.index(column)]


def test_the_worst_flight_of_each_number_is_found_and_marked() -> None:
    table = worst_table(OUTCOMES)
    assert cell(table, "widest off its track", "case") == "1"
    assert cell(table, "widest off its track", "cross-track [m]") == "**5.00**"
    assert cell(table, "widest off its track", "touch-down [m/s]") == "1.00"


def test_the_worst_margin_is_the_smallest() -> None:
    table = worst_table(OUTCOMES)
    assert cell(table, "nearest to stall, in the slipstream", "case") == "1"
    assert cell(table, "nearest to stall, in the slipstream", "margin, slipstream [°]") == "**5.7**"


def test_lost_flights_stand_by_themselves_and_not_among_the_worst() -> None:
    head, rows = lost_table(OUTCOMES)
    assert [line[0] for line in rows] == ["3"]
    assert rows[0][head.index("why")] == "fence left at t = 20.0 s; mission not finished"


def test_the_spread_goes_towards_the_worse_whichever_way_that_is() -> None:
    table = spread_table(OUTCOMES)
    assert cell(table, "median", "cross-track [m]") == "3.00"
    assert cell(table, "worst", "cross-track [m]") == "5.00"
    assert cell(table, "worst", "margin, slipstream [°]") == "5.7"
    assert cell(table, "median", "margin, slipstream [°]") == f"{math.degrees(0.3):.1f}"


def test_the_short_table_names_the_worst_flight_of_each_number() -> None:
    table = short_table(OUTCOMES)
    assert cell(table, "cross-track [m]", "worst") == "5.00"
    assert cell(table, "cross-track [m]", "case") == "1"


def test_without_a_flight_that_landed_the_tables_are_dashes() -> None:
    table = short_table(OUTCOMES[3:])
    assert cell(table, "cross-track [m]", "worst") == "–"
    assert cell(table, "cross-track [m]", "case") == ""


def test_a_number_that_never_was_is_a_dash() -> None:
    table = worst_table([outcome(2, touchdown_speed=math.nan)])
    assert cell(table, "steepest bank", "touch-down [m/s]") == "–"
    assert "hardest touch-down" not in [line[0] for line in table[1]]


def test_the_page_says_how_many_were_lost() -> None:
    page = markdown(OUTCOMES, seed=7, scatter=Scatter(), mission="survey_3km.plan", aircraft="hong2013")
    assert "4 flights of survey_3km.plan by hong2013, seed 7: **1 lost**" in page
    assert "## Lost" in page
    assert "## Lost" not in markdown(OUTCOMES[:3], seed=7, scatter=Scatter(), mission="a.plan", aircraft="hong2013")
