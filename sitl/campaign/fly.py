"""Flies one case of a campaign, from arming to disarming, and judges it."""

import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from sitl import Simulation
from sitl.airframe import FlightDivergedError
from sitl.campaign.cases import Case, Scatter, draw_case, scattered_aircraft
from sitl.campaign.outcome import Outcome, losses
from sitl.flight.plan_file import read_plan
from sitl.flight.refused import Refused
from sitl.flight_summary import summarise
from sitl.report_page import Page, landing_of, mission_page
from vehicle_model.aircraft import load_aircraft

__all__ = ["LONGEST", "Campaign", "Flown", "Flyer"]

LONGEST = 900.0  # simulated [s]; the mission takes about 250 s in calm air
ROW_INTERVAL = 0.02  # of the history [s]: a touch-down speed is that of the row before it


@dataclass(frozen=True)
class Campaign:
    """What all flights of a campaign have in common; small, for it travels to other processes."""

    seed: int
    mission: Path  # QGroundControl plan; home is where it says
    aircraft: Path | None = None  # None: the one that comes with the package
    scatter: Scatter = field(default_factory=Scatter)


@dataclass(frozen=True)
class Flown:
    """One case flown, with all that its report needs."""

    outcome: Outcome
    rows: np.ndarray
    page: Page


class Flyer:
    """Flies cases of one campaign, one after the other."""

    def __init__(self, campaign: Campaign) -> None:
        """Raises AircraftFileError or PlanError for a file that is none."""
        self.campaign = campaign
        self.nominal = load_aircraft(campaign.aircraft)
        self._home = read_plan(campaign.mission).home

    def fly(self, number: int) -> Flown:
        """Fly the case of this number.

        Raises what a plan or an aircraft that cannot be flown at all raises; what goes wrong in the air is a loss.
        """
        case = draw_case(self.campaign.seed, number, self.campaign.scatter)
        simulation = Simulation(
            aircraft=scattered_aircraft(self.nominal, case),
            design_aircraft=self.nominal,
            seed=case.seed,
            wind=case.wind_ned,
            home=(*self._home, math.degrees(case.heading)),
        )
        simulation.load_plan(self.campaign.mission)
        flight = simulation.flight
        landing = landing_of(flight)
        history = simulation.record(ROW_INTERVAL)
        trouble: tuple[str, ...] = ()
        try:
            flight.start_mission()
            flight.arm()
            simulation.run_until(lambda s: not s.flight.armed, timeout=LONGEST)
        except Refused as refusal:
            trouble = (refusal.reason,)
        except FlightDivergedError as error:
            trouble = (str(error),)
        lost = losses(
            history.rows,
            landing_item=landing.item,
            landing_point=landing.point,
            inside=lambda north, east, down: flight.fence.breach(north, east, down) is None,
            finished=flight.mission.finished and not flight.armed and not trouble,
        )
        summary = summarise(history.rows, landing.point)
        outcome = Outcome(case, (*trouble, *lost), simulation.time, summary)
        title = f"{self.campaign.mission.stem}: case {number} of seed {case.seed}"
        return Flown(outcome, history.rows, mission_page(flight, title, self._lines(case)))

    def _lines(self, case: Case) -> tuple[str, str]:
        x, y, z = (100.0 * part for part in case.centre_of_mass)
        north, east, _ = case.wind_ned
        aircraft = (
            f"{self.nominal.name}, mass {100.0 * (case.mass - 1.0):+.1f} %, centre of mass {x:+.1f} {y:+.1f} {z:+.1f}"
            f" cm (forward, right, down), start heading {math.degrees(case.heading):.0f}°"
        )
        world = (
            f"wind {math.hypot(north, east):.1f} m/s from {math.degrees(math.atan2(-east, -north)) % 360.0:.0f}°; "
            f"every aerodynamic coefficient within ±{100.0 * self.campaign.scatter.aerodynamics:g} %"
        )
        return aircraft, world
