"""How fast and how steeply the laws may do what they are asked, by regime and by who flies."""

import math

from sitl.flight.demand import Demand
from sitl.flight.parameters import Parameters

__all__ = ["set_limits"]


def set_limits(demand: Demand, parameters: Parameters, *, cruise: bool, by_pilot: bool) -> None:
    """Give the laws the climb and sink rates and the bank that the parameters allow in a regime.

    `by_pilot` says that sticks or a computer outside choose the rates: in hover they may ask for more than modes do.
    """
    if cruise:
        climb, sink = "FW_T_CLMB_MAX", "FW_T_SINK_MAX"
    elif by_pilot:
        climb, sink = "MPC_Z_VEL_MAX_UP", "MPC_Z_VEL_MAX_DN"
    else:
        climb, sink = "MPC_Z_V_AUTO_UP", "MPC_Z_V_AUTO_DN"
    demand.limits(
        climb_rate=parameters[climb], sink_rate=parameters[sink], max_bank=math.radians(parameters["FW_R_LIM"])
    )
