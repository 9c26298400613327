"""TIME_ESTIMATE_TO_TARGET: how long it would take to return, to land, to fly on with the mission or the present action.

Estimates are those of a pilot with a pocket calculator: distances at the speeds of the parameters, heights at their
rates, in calm air.
"""

import math
from typing import Any

from sitl.flight.flight import Flight
from sitl.flight.manoeuvres import SLOWING
from sitl.flight.mission_items import PLACED, Command
from sitl.flight.mode import Mode
from sitl.flight.parameters import Parameters
from sitl.flight.returning import FAR
from sitl.mavlink.telemetry.context import Context
from sitl.mavlink.telemetry.guidance import Guidance
from sitl.snapshot import Snapshot

__all__ = ["landing_time", "return_time", "time_estimate_to_target"]

UNKNOWN = -1
LONGEST = 0x7FFFFFFF  # [s]
EARTH_RADIUS = 6.371e6  # mean [m]
TIMED = (Command.WAYPOINT, Command.LOITER_TIME, Command.DELAY)  # mission items whose param1 is a wait [s]
LANDINGS = (Command.LAND, Command.VTOL_LAND)


def time_estimate_to_target(_: Snapshot, context: Context) -> tuple[Any, ...]:
    """TIME_ESTIMATE_TO_TARGET [s]; -1 for what is not under way or not known."""
    flight, guidance = context.flight, context.guidance
    if flight is None or not flight.flying or context.simulation.is_flown_from_outside:
        return (UNKNOWN,) * 5
    guidance.look()
    home, land = return_time(flight), landing_time(flight.parameters, flight.height)
    to_place = _to_place(flight, guidance)
    next_item = end = action = math.nan
    match flight.mode:
        case Mode.MISSION if not flight.mission.finished:
            next_item = to_place
            end = to_place + _after(flight, guidance)
        case Mode.RETURN:
            action = home
        case Mode.LAND:
            action = land
        case Mode.TAKEOFF:
            action = max(flight.view.down - guidance.place[2], 0.0) / flight.parameters["MPC_TKO_SPEED"]
        case Mode.HOLD if not guidance.is_circle:
            action = to_place
        case _:
            pass
    return tuple(_whole(seconds) for seconds in (home, land, next_item, end, action))


def landing_time(parameters: Parameters, height: float) -> float:
    """From a hover at a height [m] down to the ground [s]: the sink rate of `sitl.flight.manoeuvres.landing_rate`."""
    slow = parameters["MPC_LAND_SPEED"]
    fast = max(parameters["MPC_Z_V_AUTO_DN"], slow)
    slow_below = parameters["MPC_LAND_ALT2"]
    fast_above = slow_below + (fast - slow) / SLOWING
    height = max(height, 0.0)
    rate = slow + SLOWING * (min(max(height, slow_below), fast_above) - slow_below)
    return max(height - fast_above, 0.0) / fast + math.log(rate / slow) / SLOWING + min(height, slow_below) / slow


def return_time(flight: Flight) -> float:
    """For the way home, or to the nearest rally point, and the landing there [s]: up, across, down, wait, land."""
    parameters, view = flight.parameters, flight.view
    north, east, ground_down = flight.rally.nearest(view.north, view.east)
    distance = math.hypot(north - view.north, east - view.east)
    cruise = flight.regime.wing_borne or distance > FAR
    up, speed = ("FW_T_CLMB_MAX", "FW_AIRSPD_TRIM") if cruise else ("MPC_Z_V_AUTO_UP", "MPC_XY_CRUISE")
    height = ground_down - view.down
    top = max(height, parameters["RTL_RETURN_ALT"])
    wait = max(parameters["RTL_LAND_DELAY"], 0.0)
    return (top - height) / parameters[up] + distance / parameters[speed] + wait + landing_time(parameters, top)


def _to_place(flight: Flight, guidance: Guidance) -> float:
    """Until guidance has come to the place it leads to [s]; nan if it leads to none."""
    if not guidance.has_place:
        return math.nan
    north, east, _ = guidance.place
    return math.hypot(north - flight.view.north, east - flight.view.east) / max(guidance.speed, 0.1)


def _after(flight: Flight, guidance: Guidance) -> float:
    """From the end of the current mission item to that of the mission, jumps and transitions left out [s]."""
    parameters, places = flight.parameters, flight.places
    home_latitude, home_longitude, _ = flight.home.geodetic
    latitude, longitude, height = home_latitude, home_longitude, flight.height
    metres = seconds = 0.0
    for number, item in enumerate(flight.mission.items):
        is_home = item.command == Command.RETURN_TO_LAUNCH
        before = latitude, longitude
        if is_home:
            latitude, longitude = home_latitude, home_longitude
        elif item.command in PLACED and not item.here:
            latitude, longitude = item.x, item.y
        lands = is_home or item.command in LANDINGS
        if number > flight.mission.current:
            metres += _distance(*before, latitude, longitude)
            if item.command in TIMED and math.isfinite(item.param1):
                seconds += max(item.param1, 0.0)
        if lands and number >= flight.mission.current:
            seconds += landing_time(parameters, height)
        elif item.command in PLACED and math.isfinite(item.z):
            height = flight.home.down - item.down(item.z, places)
    return metres / max(guidance.speed, 0.1) + seconds


def _distance(latitude: float, longitude: float, to_latitude: float, to_longitude: float) -> float:
    """Between places [deg] not too far from each other [m]."""
    east = (to_longitude - longitude) * math.cos(math.radians(latitude))
    return math.radians(math.hypot(to_latitude - latitude, east)) * EARTH_RADIUS


def _whole(seconds: float) -> int:
    return UNKNOWN if math.isnan(seconds) else round(min(seconds, LONGEST))
