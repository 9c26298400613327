"""Scenarios: where a flight begins, the wind it meets, what happens in it and when.

`load_scenario` reads one from a TOML file (docs/scenario.md); a `Script` carries out its steps in a flight.
"""

from sitl.scenario.scenario import Earth, Scenario, ScenarioError, Wind, load_scenario
from sitl.scenario.script import Script, Step

__all__ = ["Earth", "Scenario", "ScenarioError", "Script", "Step", "Wind", "load_scenario"]
