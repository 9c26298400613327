"""The whole vehicle in process on a whole mission in wind: how many times real time, and where the time goes.

Laws, guidance and flight events included; no link, no recorder. Times are CPU time of this process, which flies on one
core. The compiled parts are timed apart, from moments of that very flight on: calls with everything, without the laws,
and with no tick to fly, and what surrounds the equations of motion alone. The rest of the flight's time is its events'.
"""

import statistics
from collections.abc import Callable
from pathlib import Path

import numpy as np
from figures import Figure, cpu_time

from sitl import Simulation
from sitl.control.design import design_for
from sitl.control.truth import true_estimate
from sitl.flight.view import View
from sitl.simulation import EVENTS_RATE
from sitl.tick import fly
from vehicle_model.battery import battery_step
from vehicle_model.compiled import compiled_loop
from vehicle_model.state import POSITION
from vehicle_model.wind import wind_step

__all__ = ["measure"]

MISSION = Path(__file__).parents[1] / "docs" / "examples" / "survey_3km.plan"
WIND = (3.0, -2.0, 0.0)  # NED, blowing to [m/s]
LONGEST = 900.0  # that the mission may last [s]
ROUNDS = 7
BETWEEN_MOMENTS = 5.0  # of flight [s]
REPEATS = 20  # from each moment
CALLS = 20_000

# On such a machine and on a mission, with their filters, which ours does not have yet: from issue 3 of this project.
QUOTED = (("ArduPilot SITL, of 23 to 59", 59.0), ("PX4 SITL, of 17 to 30", 30.0))

Moment = tuple[np.ndarray, np.ndarray]  # CRAFT and SETPOINT arrays (1,): all it takes to go on from there


def measure() -> list[Figure]:
    """Simulated over CPU time of the mission, each part's share of it, and what others are said to reach."""
    simulation = Simulation(wind=WIND)
    moments: list[Moment] = []
    begin(simulation)
    airframe = simulation.airframe
    complete(simulation, lambda: moments.append((airframe.craft.copy(), airframe.setpoint.copy())))
    factors: list[float] = []
    shares: list[dict[str, float]] = []
    for _ in range(ROUNDS):
        begin(simulation)
        spent = cpu_time(lambda: complete(simulation), 1)
        factors.append(simulation.time / spent)
        parts = compiled_parts(simulation, moments)
        between_updates = spent / (simulation.time * EVENTS_RATE)
        parts["flight events, in Python"] = between_updates - sum(parts.values())
        shares.append({name: 100.0 * seconds / between_updates for name, seconds in parts.items()})
    return [
        Figure("whole vehicle, whole mission, CPU time of one core", statistics.median(factors), "x real", goal=400.0),
        *(Figure(f"share of {name}", statistics.median(share[name] for share in shares), "%") for name in shares[0]),
        *(Figure(f"quoted, not measured: {name}", best, "x real") for name, best in QUOTED),
    ]


def begin(simulation: Simulation) -> None:
    """Put the vehicle on the ground, armed and about to fly the mission."""
    simulation.reset("ground")
    simulation.load_plan(MISSION)
    simulation.flight.start_mission()
    simulation.flight.arm()


def complete(simulation: Simulation, look: Callable[[], object] = lambda: None) -> None:
    """Fly until it is disarmed, looking every now and then; raises RuntimeError unless the mission is finished."""
    while simulation.flight.armed and simulation.time < LONGEST:
        look()
        simulation.advance(BETWEEN_MOMENTS)
    if simulation.flight.armed or not simulation.flight.mission.finished:
        raise RuntimeError(f"after {simulation.time} s the mission is not finished: the figure would not be one of it")


def compiled_parts(simulation: Simulation, moments: list[Moment]) -> dict[str, float]:
    """CPU time [s] from one update of the flight to the next: of what is compiled, part by part, and of calling it."""
    airframe, design, view = simulation.airframe, design_for(simulation.aircraft), View()
    dt, between_updates = 1.0 / simulation.rate, round(simulation.rate / EVENTS_RATE)

    def all_parts(craft: np.ndarray, setpoint: np.ndarray, ticks: int = between_updates, laws: bool = True) -> None:
        fly(
            craft, setpoint, design.gains, design.table, design.axes, design.schedule, design.vehicle,
            laws, True, 0, simulation.rate, ticks,
        )  # fmt: skip

    no_tick = mean_time(moments, lambda craft, setpoint: all_parts(craft, setpoint, ticks=0))
    without_laws = mean_time(moments, lambda craft, setpoint: all_parts(craft, setpoint, laws=False))
    laws = mean_time(moments, all_parts) - without_laws
    around = mean_time(moments, lambda craft, _: surroundings(craft, dt, between_updates)) - mean_time(
        moments, lambda craft, _: surroundings(craft, dt, 0)
    )
    return {
        "physics: equations of motion, RK4": without_laws - no_tick - around,
        "control laws": laws,
        "estimate, wind and battery": around,
        "calls of compiled code": cpu_time(lambda: airframe.advance(0), CALLS)
        + cpu_time(lambda: airframe.look(view), CALLS),
    }


@compiled_loop
def surroundings(crafts, dt, ticks) -> None:
    """What `sitl.tick.fly` does at every tick besides laws and equations of motion."""
    craft = crafts[0]
    for tick in range(ticks):
        craft.state[POSITION] += 1e-9  # another state at every tick, as in flight, or its results would be kept
        true_estimate(craft.state, craft.vehicle, craft.environment, craft.estimate)
        wind_step(craft.wind, tick * dt, -craft.state[POSITION + 2], craft.estimate[0].airspeed, dt, craft.environment)
        battery_step(craft.battery, craft.vehicle, craft.outputs, dt)


def mean_time(moments: list[Moment], go_on: Callable[[np.ndarray, np.ndarray], object]) -> float:
    """Mean CPU time [s] of a call that goes on from a moment; each begins from the moment itself."""
    total = 0.0
    for craft, setpoint in moments:
        copies = iter(np.repeat(craft, REPEATS).reshape(-1, 1))
        total += cpu_time(lambda copies=copies, setpoint=setpoint: go_on(next(copies), setpoint), REPEATS)
    return total / len(moments)
