"""What the control laws read, are told, remember and report: estimate, setpoint, gains, memory, status.

Numpy structured arrays of length one, as in `vehicle_model.records`: SI and radians, NED axes of home, body axes
forward-right-down. `sitl.flight` writes the setpoint at up to 50 Hz, through `sitl.flight.demand`; the compiled laws
read both at every tick.
"""

from enum import IntEnum

import numpy as np

__all__ = ["ESTIMATE", "GAINS", "MEMORY", "NO_LEVEL", "SETPOINT", "STATUS", "Horizontal", "Level", "Vertical", "Yaw"]

_f = np.float64
_i = np.int64


class Level(IntEnum):
    """Which loops are closed."""

    OFF = 0  # motors stand still, servos at rest: disarmed or terminated
    IDLE = 1  # motors turn at idle, every integrator at rest: armed on the ground
    DIRECT = 2  # `direct` goes to the actuators
    ATTITUDE = 3  # roll, pitch, yaw rate, collective thrust and tilt
    VELOCITY = 4  # everything: guidance by `horizontal`, `vertical` and `yaw`


class Horizontal(IntEnum):
    """Guidance in the horizontal plane."""

    POINT = 0  # fly to `position_ned` and stop there
    LEG = 1  # along the straight line from `start_ned` to `position_ned`, and on beyond its end
    CIRCLE = 2  # around `position_ned` at `radius`, positive clockwise seen from above
    VELOCITY = 3  # `velocity_ned` over the ground
    ACCELERATION = 4  # `acceleration`, forward and right of the heading
    BANK = 5  # `bank` at the true airspeed `speed`, turning as it may


class Vertical(IntEnum):
    """Guidance in the vertical."""

    ALTITUDE = 0  # to the height of `position_ned`, at no more than `climb_rate` and `sink_rate`
    RATE = 1  # `velocity_ned[2]`


class Yaw(IntEnum):
    """What the nose does in hover; wing-borne flight always turns it into the airflow."""

    HEADING = 0  # `heading`
    RATE = 1  # `yaw_rate`
    COURSE = 2  # into the airflow that guidance asks for
    WEATHERVANE = 3  # into the wind


# How the vehicle is believed to move: the truth until sensors and a filter stand between the two.
ESTIMATE = np.dtype(
    [
        ("position_ned", _f, (3,)),  # north and east of home, down from home's height [m]
        ("velocity_ned", _f, (3,)),  # over the ground [m/s]
        ("quaternion", _f, (4,)),  # body to NED, scalar first
        ("rates", _f, (3,)),  # body axes [rad/s]
        ("euler", _f, (3,)),  # roll, pitch, yaw [rad]
        ("wind_ned", _f, (3,)),  # blowing to [m/s]
        ("airspeed", _f),  # true [m/s]
        ("density", _f),  # [kg/m^3]
        ("rotor_speed", _f, (3,)),  # left, right, tail [rad/s], as the speed controllers report
        ("servo", _f, (4,)),  # tilt, aileron left and right, elevator [rad], as their sensors report
        ("battery_voltage", _f),  # [V]
    ],
    align=True,
)

SETPOINT = np.dtype(
    [
        ("level", _i),  # Level
        ("direct", _f, (7,)),  # Level.DIRECT: controls as in `vehicle_model.state`
        ("roll", _f),  # Level.ATTITUDE [rad]
        ("pitch", _f),  # [rad]
        ("thrust", _f),  # collective force of the wing's rotors, 0..1 of what they give at most
        ("tilt", _f),  # [rad]; not a number: as wing-borne or hovering flight at this airspeed has it
        ("horizontal", _i),  # Horizontal
        ("vertical", _i),  # Vertical
        ("yaw", _i),  # Yaw
        ("position_ned", _f, (3,)),  # point, end of leg or centre of circle [m]
        ("start_ned", _f, (3,)),  # start of leg [m]
        ("radius", _f),  # [m]
        ("velocity_ned", _f, (3,)),  # [m/s]
        ("acceleration", _f, (2,)),  # forward, right [m/s^2]
        ("bank", _f),  # [rad]
        ("cruise", _i),  # 1: wing-borne, `speed` is true airspeed; 0: hover, `speed` is the largest ground speed
        ("speed", _f),  # [m/s]
        ("climb_rate", _f),  # largest [m/s]
        ("sink_rate", _f),  # largest [m/s]
        ("heading", _f),  # [rad]
        ("yaw_rate", _f),  # [rad/s]
        ("max_bank", _f),  # [rad]
        ("thrust_limit", _f),  # 1; lower to let the vehicle settle on its gear: share of the largest collective thrust
    ],
    align=True,
)

# What the laws say of themselves: for events, telemetry, plots.
STATUS = np.dtype(
    [
        ("velocity_reference_ned", _f, (3,)),  # [m/s]
        ("attitude_reference", _f, (3,)),  # roll, pitch, yaw [rad]
        ("force_demand", _f, (2,)),  # forward and down in the plane of symmetry, per mass [m/s^2]
        ("thrust", _f),  # collective force of the wing's rotors, 0..1 of what they give at most
        ("servo_command", _f, (4,)),  # tilt, aileron left and right, elevator [rad]
        ("rotor_speed_command", _f, (3,)),  # [rad/s]
        ("airflow_forward", _f),  # airspeed along the body [m/s]
        ("tilt_fault", _f),  # 1: the tilt drive does not follow
        ("node", _f, (14,)),  # of the force map, at the force demand (vehicle_model.force_map.COLUMNS)
        ("schedule", _f, (12,)),  # gains at this airflow (sitl.control.design_names.COLUMNS)
    ],
    align=True,
)

NO_LEVEL = -1.0  # as the level that a memory was at last: it holds nothing yet

# What the laws remember from tick to tick.
MEMORY = np.dtype(
    [
        ("level", _f),  # of the setpoint last followed, as a number, or NO_LEVEL
        ("velocity_reference_ned", _f, (3,)),  # [m/s]
        ("velocity_integral_ned", _f, (3,)),  # [m/s^2]
        ("heading_reference", _f),  # [rad]
        ("rate_integral", _f, (3,)),  # [rad/s^2]
        ("airflow", _f, (2,)),  # forward and down the body, as filtered [m/s]
        ("tilt_command", _f),  # last given [rad]
        ("tilt_expected", _f),  # where the tilt drive would be if it were sound [rad]
        ("tilt_stuck_at", _f),  # where it was seen not to follow [rad]
        ("tilt_fault", _f),  # 0: the tilt drive follows, 1: it does not and the fuselage pitches instead
        ("stuck_relief", _f),  # force forward per mass that a wing stuck too flat gets beyond what is asked [m/s^2]
        ("velocity_demand_ned", _f, (2,)),  # that guidance asks for, north and east [m/s]
    ],
    align=True,
)

# Gains that do not change over the corridor; those that do are in the schedule (sitl.control.design_names).
GAINS = np.dtype(
    [
        ("position", _f),  # hover, horizontal [1/s]
        ("path", _f),  # wing-borne, across a leg or circle [1/s]
        ("altitude", _f),  # [1/s]
        ("reference", _f),  # of the velocity reference on its way to the demand [1/s]
        ("heading", _f),  # [1/s]
        ("sideslip", _f),  # [1/s]
        ("max_yaw_rate", _f),  # [rad/s]
        ("max_roll_rate", _f),
        ("lateral_acceleration", _f),  # largest of the velocity reference in hover [m/s^2]
        ("forward_acceleration", _f),
        ("vertical_acceleration", _f),
        ("wing_borne_from", _f),  # forward airspeed at which the nose begins to follow the airflow [m/s]
        ("wing_borne_at", _f),  # and at which it does so wholly
        ("rotor_lag", _f),  # of the wing rotors' speed loops [s]
        ("elevator_preference", _f),  # how much dearer the tail rotor's thrust is than elevator, shares squared
        ("upwash_share", _f),  # of the airflow down the body that the map is told
        ("airflow_filter", _f),  # of the airflow forward [s]
        ("upwash_filter", _f),  # and of that down the body: what the wing gives way to gusts, heave damping keeps [s]
        ("idle_speed", _f),  # of the wing rotors [rad/s]
        ("top_speed", _f),  # of the wing rotors at full throttle [rad/s]
        ("torque_factor", _f),  # of the wing rotors: torque per speed |speed| at rest at sea level [N m s^2/rad^2]
        ("tail_thrust_factor", _f),  # thrust per speed |speed| of the tail rotor [N s^2/rad^2]
        ("tail_torque_factor", _f),
        ("tail_top_thrust", _f),  # [N]
        ("tail_arm", _f),  # of the tail rotor behind the centre of mass [m]
        ("hover_tilt", _f),  # [rad]
    ],
    align=True,
)
