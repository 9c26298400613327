"""The tilt-wing as a process: airframe, flight controller, clock, MAVLink, viewer.

`Simulation` and `Scenario` are loaded when first asked for, so that the command line can answer a typing error without
waiting for the compiled core.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sitl.scenario import Scenario
    from sitl.simulation import Simulation

__all__ = ["Scenario", "Simulation"]


def __getattr__(name: str) -> Any:
    if name == "Simulation":
        from sitl.simulation import Simulation

        return Simulation
    if name == "Scenario":
        from sitl.scenario import Scenario

        return Scenario
    msg = f"module {__name__!r} has no attribute {name!r}"
    raise AttributeError(msg)
