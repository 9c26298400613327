"""Where a flight begins: standing on the ground, trimmed in level flight, or as a file says.

- `ground`: at home on its landing gear, wing up, motors off;
- `trim:20`: level flight at 20 m/s true airspeed, 100 m above home;
- FILE: as a TOML file says, all keys optional; see `sitl.start_file` and docs/start-file.md.
"""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sitl.start_file import RPM, TRIM_HEIGHT, StartError, read_start_file
from vehicle_model.earth import gravitation, make_environment, ned_from_geodetic
from vehicle_model.integrate import advance
from vehicle_model.rotation import (
    body_to_ned,
    euler_from_quaternion,
    ned_to_body,
    quaternion_from_euler,
    quaternion_multiply,
)
from vehicle_model.state import (
    AILERON_LEFT,
    ELEVATOR,
    POSITION,
    QUATERNION,
    RATES,
    ROTOR_SPEED,
    TILT,
    TILT_COMMAND,
    VELOCITY,
    blank_controls,
    blank_state,
)

if TYPE_CHECKING:
    from vehicle_model.aircraft import Aircraft

__all__ = ["Start", "StartError", "described", "standing", "start_at", "trimmed"]

FARTHEST = 50e3  # from home that a start may be [m]
DOWN = np.array([0.0, 0.0, 1.0])
SETTLING_STEP = 1.0 / 400.0  # [s]
SETTLING_TIME = 5.0  # [s]
CREEP = 0.05  # [m/s]; the gear's friction is viscous near rest (`vehicle_model.ground`), so in wind it creeps


@dataclass(frozen=True)
class Start:
    """State (20,) and controls (7,) a flight begins with, and what to call them."""

    state: np.ndarray
    controls: np.ndarray
    description: str

    def moved(self, latitude: float, longitude: float, environment: np.ndarray) -> "Start":
        """The same start above another place of the map [deg, deg].

        Raises StartError for a place that is none, or too far from home for the local frame's flat directions.
        """
        if not (abs(latitude) <= 90.0 and abs(longitude) <= 180.0):
            msg = f"start: expected a latitude and a longitude [deg], got {latitude}, {longitude}"
            raise StartError(msg)
        origin = environment[0]
        height = float(origin["height_ellipsoid"])
        place = ned_from_geodetic(math.radians(latitude), math.radians(longitude), height, origin)
        distance = math.hypot(place[0], place[1])
        if distance > FARTHEST:
            msg = f"start: expected a place up to {FARTHEST / 1e3:g} km from home, got {distance / 1e3:.0f} km"
            raise StartError(msg)
        state = self.state.copy()
        state[POSITION : POSITION + 2] = place[:2]
        state[POSITION + 2] += place[2]
        return Start(state, self.controls, f"{self.description}, at {latitude:g}, {longitude:g}")


def start_at(
    option: str, aircraft: "Aircraft", environment: np.ndarray, heading: float, height: float = TRIM_HEIGHT
) -> Start:
    """Start of the kind named on the command line: `ground`, `trim:AIRSPEED` or the path of a file.

    `environment` is one ENVIRONMENT record, `heading` that of home [rad], `height` that of level flight above home [m].
    Raises StartError.
    """
    if option == "ground":
        return standing(aircraft, environment, heading)
    kind, colon, value = option.partition(":")
    if kind == "trim" and colon:
        try:
            airspeed = float(value)
        except ValueError:
            airspeed = math.nan
        if not 0.0 <= airspeed < math.inf:
            msg = f"{option}: expected trim:AIRSPEED with an airspeed in m/s, such as trim:20"
            raise StartError(msg)
        return trimmed(aircraft, environment, airspeed, heading, height)
    path = Path(option)
    if not path.is_file():
        problem = "this is a folder" if path.is_dir() else "there is no such file"
        msg = f"{option}: expected ground, trim:AIRSPEED or the path of a start file, and {problem}"
        raise StartError(msg)
    return described(path, aircraft, environment, heading)


def standing(aircraft: "Aircraft", environment: np.ndarray, heading: float) -> Start:
    """At home on the landing gear in equilibrium, wing up (tilt 90 deg), motors off.

    The equilibrium is flown to, in the wind of the environment: gear deflection and all. Raises StartError where
    the aircraft does not come to rest on its gear.
    """
    vehicle = aircraft.vehicle
    craft = vehicle[0]
    contacts = craft["contacts"][: craft["contact_count"]]
    if len(contacts) == 0:
        msg = "ground: the aircraft has no landing gear to stand on"
        raise StartError(msg)
    state, controls = blank_state(), blank_controls()
    state[TILT] = controls[TILT_COMMAND] = min(math.radians(90.0), float(craft["servos"]["maximum"][0]))
    above_ground = float(contacts["position"][:, 2].max())
    origin_above_ground = float(environment[0]["height_ellipsoid"] - environment[0]["ground_height"])
    state[POSITION + 2] = origin_above_ground - above_ground
    _turn(state, quaternion_from_euler(0.0, 0.0, heading))
    _rotate_with_earth(state, environment)
    advance(state, controls, vehicle, environment, SETTLING_STEP, round(SETTLING_TIME / SETTLING_STEP))
    attitude = state[QUATERNION : QUATERNION + 4]
    north, east, down = body_to_ned(*attitude, *state[VELOCITY : VELOCITY + 3])
    _, _, upright = body_to_ned(*attitude, *DOWN)
    if not (math.hypot(north, east) < CREEP and abs(down) < 0.1 * CREEP and upright > math.cos(math.radians(20.0))):
        msg = "ground: the aircraft does not come to rest on its landing gear (is the wind too strong to stand in?)"
        raise StartError(msg)
    state[POSITION : POSITION + 2] = 0.0
    _, _, yaw = euler_from_quaternion(*attitude)
    _turn(state, quaternion_from_euler(0.0, 0.0, heading - yaw))
    return Start(state, controls, "on the ground, wing up")


def trimmed(
    aircraft: "Aircraft", environment: np.ndarray, airspeed: float, heading: float, height: float = TRIM_HEIGHT
) -> Start:
    """Level flight at a true airspeed [m/s] and height above home [m], fuselage level, in the environment's wind.

    The trim is the paper's, of a flat Earth with the gravity and the air of that place (`vehicle_model.trim`). On a
    curved Earth what is left out, Coriolis and the curvature of the path, is less than 1e-3 of the weight.
    Raises StartError where the aircraft has no such trim.
    """
    from vehicle_model.trim import TrimError, trim_level

    home = environment[0]
    state, controls = blank_state(), blank_controls()
    state[POSITION + 2] = -height
    still = make_environment(
        "flat",
        latitude=float(home["latitude"]),
        longitude=float(home["longitude"]),
        height_ellipsoid=float(home["height_ellipsoid"]) + height,
        ground_height=-1e6,
        gravity=_gravity(environment, height),
    )
    try:
        trim = trim_level(aircraft, airspeed, still)
    except TrimError as error:
        msg = f"trim:{airspeed:g}: {error}"
        raise StartError(msg) from None
    state[VELOCITY:] = trim.state[VELOCITY:]
    controls[:] = trim.controls
    _turn(state, quaternion_from_euler(0.0, 0.0, heading))
    state[VELOCITY : VELOCITY + 3] += ned_to_body(*state[QUATERNION : QUATERNION + 4], *home["wind_ned"])
    _rotate_with_earth(state, environment)
    return Start(state, controls, f"level flight at {airspeed:g} m/s, {height:g} m above home")


def described(path: Path, aircraft: "Aircraft", environment: np.ndarray, heading: float) -> Start:
    """Start as a file describes it (`sitl.start_file.StartFile`), servos commanded to where they stand.

    Raises StartError with one line that names the file, the key and what was expected.
    """
    given = read_start_file(path, aircraft, environment)
    state, controls = blank_state(), blank_controls()
    roll, pitch, yaw = (0.0, 0.0, math.degrees(heading)) if given.attitude_deg is None else given.attitude_deg
    state[POSITION : POSITION + 3] = given.position_ned
    state[VELOCITY : VELOCITY + 3] = given.velocity_body
    attitude = quaternion_from_euler(math.radians(roll), math.radians(pitch), math.radians(yaw))
    state[QUATERNION : QUATERNION + 4] = attitude
    state[RATES : RATES + 3] = np.radians(given.rates_deg_s)
    state[ROTOR_SPEED : ROTOR_SPEED + 3] = np.multiply(given.rotor_rpm, RPM)
    state[TILT] = math.radians(given.tilt_deg)
    state[AILERON_LEFT : AILERON_LEFT + 2] = np.radians(given.aileron_deg)
    state[ELEVATOR] = math.radians(given.elevator_deg)
    controls[:TILT_COMMAND] = given.throttle
    controls[TILT_COMMAND:] = state[TILT : ELEVATOR + 1]
    _rotate_with_earth(state, environment)
    return Start(state, controls, f"as in {path.name}")


def _gravity(environment: np.ndarray, height: float) -> float:
    """Weight per mass of what is at rest above home [m/s^2]: attraction less the Earth's rotation."""
    home = environment[0]
    from_centre = np.array([0.0, 0.0, -height]) - home["centre_ned"]
    rotation = home["rotation_ned"]
    attraction = np.array(gravitation(0.0, 0.0, -height, home))
    return float(np.linalg.norm(attraction - np.cross(rotation, np.cross(rotation, from_centre))))


def _turn(state: np.ndarray, rotation: tuple[float, float, float, float]) -> None:
    """Turn the vehicle by a rotation in NED axes."""
    state[QUATERNION : QUATERNION + 4] = quaternion_multiply(*rotation, *state[QUATERNION : QUATERNION + 4])


def _rotate_with_earth(state: np.ndarray, environment: np.ndarray) -> None:
    """Turn rates relative to the Earth into the rates against inertial space that the state holds."""
    state[RATES : RATES + 3] += ned_to_body(*state[QUATERNION : QUATERNION + 4], *environment[0]["rotation_ned"])
