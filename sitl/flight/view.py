"""What the events see of the vehicle: one moment, in plain Python numbers."""

from dataclasses import dataclass

__all__ = ["EVENTS_RATE", "View"]

EVENTS_RATE = 50  # of the flight's updates [Hz]


@dataclass(slots=True)
class View:
    """Estimate, status of the control laws and battery at one simulated time; refilled at every update of the flight.

    NED from home [m, m/s], radians, SI. Nothing in it is the simulator's own truth: all could be had on an aircraft.
    """

    time: float = 0.0
    north: float = 0.0
    east: float = 0.0
    down: float = 0.0
    vn: float = 0.0
    ve: float = 0.0
    vd: float = 0.0
    roll: float = 0.0
    pitch: float = 0.0
    yaw: float = 0.0
    p: float = 0.0
    q: float = 0.0
    r: float = 0.0
    airspeed: float = 0.0  # true
    wind_north: float = 0.0  # blowing to
    wind_east: float = 0.0
    tilt: float = 0.0
    tilt_command: float = 0.0
    thrust: float = 0.0  # collective command, 0..1
    rotor_speeds: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rotor_speed_commands: tuple[float, float, float] = (0.0, 0.0, 0.0)
    battery_voltage: float = 0.0
    battery_current: float = 0.0
    battery_remaining: float = 1.0  # 0..1
    tilt_fault: float = 0.0  # the control laws' judgement; 1: the tilt servo does not follow
