"""What telemetry, viewer and logs see of the vehicle: one immutable moment."""

from dataclasses import dataclass

import numpy as np

__all__ = ["Snapshot"]


@dataclass(frozen=True, slots=True)
class Snapshot:
    """The vehicle at one simulated instant. Arrays are private copies, marked read-only.

    `state` (20,) and `controls` (7,) are laid out as in `vehicle_model.state`; `outputs` is one record of
    `vehicle_model.records.OUTPUTS`. Latitude and longitude are geodetic [rad]; heights are in metres above the
    WGS-84 ellipsoid (`height_ellipsoid`) and above mean sea level (`altitude_msl`); roll, pitch and yaw [rad] and
    `quaternion` relate to the local NED axes at the vehicle, `velocity_ned` [m/s] as well; `position_ned` [m] to
    the home position. `specific_force` [m/s^2] is what a perfect accelerometer at the centre of mass reads, body axes.

    The last fields are those of the vehicle's own flight controller, by the names of its enumerations (`sitl.flight`);
    they are None while it does not fly, for it is off or an outside controller has the actuators.
    """

    time: float  # simulated seconds since start
    state: np.ndarray
    controls: np.ndarray
    outputs: np.void
    latitude: float
    longitude: float
    height_ellipsoid: float
    altitude_msl: float
    position_ned: tuple[float, float, float]
    velocity_ned: tuple[float, float, float]
    quaternion: tuple[float, float, float, float]
    roll: float
    pitch: float
    yaw: float
    rates: tuple[float, float, float]
    specific_force: tuple[float, float, float]
    airspeed: float  # true [m/s]
    pressure: float  # static [Pa]
    temperature: float  # [K]
    density: float  # [kg/m^3]
    wind_ned: tuple[float, float, float]  # blowing to [m/s]
    tilt: float  # [rad]
    on_ground: bool  # a point of the landing gear bears load
    battery_voltage: float = 0.0  # under load [V]
    battery_current: float = 0.0  # [A]
    battery_remaining: float | None = None  # 0..1; None: it never empties
    armed: bool | None = None
    mode: str | None = None  # of sitl.flight.mode.Mode
    landed: str | None = None  # of sitl.flight.landed.LandedState
    regime: str | None = None  # of sitl.flight.regime.Regime
