"""One moment of a flight as logs hold it: in the types of the log, filled by compiled code from the vehicle's state.

A snapshot would cost five times as much, and at hundreds of times real time that is the flight's time.
"""

import math

import numpy as np

from sitl.control.records import Horizontal, Level, Vertical, Yaw
from sitl.control.truth import true_estimate
from vehicle_model.atmosphere import atmosphere
from vehicle_model.compiled import compiled
from vehicle_model.earth import geodetic
from vehicle_model.rotation import ned_to_body, quaternion_from_euler
from vehicle_model.state import TILT, TILT_COMMAND

__all__ = ["MOMENT", "MOTORS", "fill_row"]

MOTORS = 3
MOST_MOTORS, MOST_SERVOS = 12, 8  # that PX4's topics have room for

_u64, _f64, _f32, _i32, _u16, _u8 = "<u8", "<f8", "<f4", "<i4", "<u2", "u1"

MOMENT = np.dtype(
    [
        ("time", _u64),  # simulated [us]
        ("utc", _u64),  # [us since 1970]
        ("latitude", _f64),  # [deg]
        ("longitude", _f64),
        ("height", _f64),  # above mean sea level and ellipsoid, one surface here [m]
        ("altitude", _f32),  # the same
        ("ground_altitude", _f32),  # of the ground below
        ("quaternion", _f32, (4,)),  # body to NED, scalar first
        ("rates", _f32, (3,)),  # body axes [rad/s]
        ("specific_force", _f32, (3,)),  # body axes [m/s^2]
        *((name, _f32) for name in ("north", "east", "down", "vn", "ve", "vd", "heading")),
        ("ground_speed", _f32),
        ("course", _f32),  # over ground [rad]
        # What the control laws are asked; not a number where they are asked for something else, or do not fly.
        ("asked_quaternion", _f32, (4,)),
        ("asked_thrust", _f32, (3,)),  # body axes, collective thrust 1 at full throttle
        *((name, _f32) for name in ("asked_north", "asked_east", "asked_down", "asked_vn", "asked_ve", "asked_vd")),
        ("asked_heading", _f32),
        ("asked_yaw_rate", _f32),
        ("motors", _f32, (MOST_MOTORS,)),  # throttles
        ("servos", _f32, (MOST_SERVOS,)),  # commands, -1..1 over the range of each
        ("airspeed", _f32),  # true
        ("equivalent_airspeed", _f32),
        ("velocity_air", _f32, (3,)),  # body axes [m/s]
        ("angle_of_attack", _f32),  # of the body
        ("sideslip", _f32),
        ("tilt", _f32),
        ("tilt_command", _f32),
        ("tilt_fault", _u8),
        ("turning", _u8),  # a bit for each motor that is told to turn
        ("wind_north", _f32),  # blowing to [m/s]
        ("wind_east", _f32),
        ("pressure", _f32),  # static [Pa]
        ("temperature", _f32),  # [deg C]
        ("density", _f32),
        ("voltage", _f32),
        ("current", _f32),
        ("discharged", _f32),  # [mAh]; -1: the battery never empties
        ("remaining", _f32),  # 0..1, or -1
        ("esc_rpm", _i32, (MOTORS,)),
        ("esc_current", _f32, (MOTORS,)),  # from the battery [A]
        # What `fill_row` leaves to the flight log.
        ("utc_at_start", _u64),  # UTC at simulated time zero [us]
        ("armed_time", _u64),  # [us]; 0: not armed
        ("takeoff_time", _u64),  # [us]; 0: not in the air
        ("nav_state_time", _u64),
        ("origin_latitude", _f64),  # of the NED frame [deg]
        ("origin_longitude", _f64),
        ("home_latitude", _f64),
        ("home_longitude", _f64),
        *((name, _f32) for name in ("origin_altitude", "home_altitude", "home_north", "home_east", "home_down")),
        ("mission_reached", _i32),  # last item done, -1: none
        ("mission_current", _u16),
        ("mission_total", _u16),
        ("reversible", _u16),  # a bit for each motor that can turn backwards
        ("esc_function", _u8, (MOTORS,)),  # PX4's numbers of output functions
        *((name, _u8) for name in ("arming_state", "nav_state", "vehicle_type", "vtol_state", "failsafe", "landed")),
        *((name, _u8) for name in ("in_transition", "in_transition_to_cruise", "mission_finished", "system", "cells")),
    ],
    align=True,
)  # fmt: skip

SEA_LEVEL_DENSITY = 1.225  # US Standard Atmosphere 1976 [kg/m^3]
ZERO_CELSIUS = 273.15  # [K]
DEGREES = math.degrees(1.0)
RPM = 30.0 / math.pi  # for 1 rad/s
NAN = math.nan
ATTITUDE, VELOCITY = int(Level.ATTITUDE), int(Level.VELOCITY)
POINT, HEIGHT, HEADING = int(Horizontal.POINT), int(Vertical.ALTITUDE), int(Yaw.HEADING)


@compiled
def _fill_slow(craft, estimate, moment, drains) -> None:
    """The part of a moment that only full rows hold."""
    out, pack, rotors = craft.outputs[0], craft.battery[0], craft.vehicle[0].rotors
    temperature, pressure, density, _ = atmosphere(moment.height)
    moment.temperature, moment.pressure, moment.density = temperature - ZERO_CELSIUS, pressure, density
    moment.wind_north, moment.wind_east = estimate.wind_ned[0], estimate.wind_ned[1]
    voltage = rotors[0].battery_voltage
    total = 0.0
    for k in range(MOTORS):
        current = out.electrical_power[k] / voltage
        total += current
        moment.esc_rpm[k] = round(estimate.rotor_speed[k] * RPM)
        moment.esc_current[k] = current
    if drains:
        moment.voltage, moment.current = pack.voltage, pack.current
        moment.discharged = (pack.capacity - pack.charge) / 3.6
        moment.remaining = pack.charge / pack.capacity
    else:
        moment.voltage, moment.current, moment.discharged, moment.remaining = voltage, total, -1.0, -1.0


@compiled
def fill_row(crafts, setpoints, rows, size, tick, rate, controlled, drains) -> bool:
    """Fill the moment of a row (1,) from a CRAFT and a SETPOINT array (1,), then copy what the log shows of it.

    A row is a record of `topics.row_type`. The first `size` bytes of its text are copied, each from the place
    among the record's bytes that `places` says; what only the whole text shows is left alone for less. The moment is
    that of a `tick` of 1/`rate` s. `controlled` says that the control laws fly, `drains` that the battery is one.
    Returns whether a motor is told to turn.
    """
    row = rows[0]
    estimates, moment = row.estimate, row.moment[0]
    craft, setpoint, estimate = crafts[0], setpoints[0], estimates[0]
    state, controls, status, out = craft.state, craft.controls, craft.status[0], craft.outputs[0]
    vehicle, world = craft.vehicle[0], craft.environment[0]
    true_estimate(state, craft.vehicle, craft.environment, estimates)
    q0, q1, q2, q3 = estimate.quaternion[0], estimate.quaternion[1], estimate.quaternion[2], estimate.quaternion[3]
    vn, ve, vd = estimate.velocity_ned[0], estimate.velocity_ned[1], estimate.velocity_ned[2]
    moment.time = np.uint64(tick * 1e6 / rate + 0.5)
    moment.utc = moment.utc_at_start + moment.time

    latitude, longitude, height = geodetic(state[0], state[1], state[2], world)
    moment.latitude, moment.longitude = latitude * DEGREES, longitude * DEGREES
    moment.height = height
    moment.altitude = height
    moment.ground_altitude = world.ground_height
    moment.quaternion[0], moment.quaternion[1], moment.quaternion[2], moment.quaternion[3] = q0, q1, q2, q3
    for k in range(3):
        moment.rates[k] = estimate.rates[k]
        # Of the latest right-hand side, which saw the present moment but for the error of one step.
        moment.specific_force[k] = out.force_body[k] / vehicle.mass
    moment.north, moment.east, moment.down = (
        estimate.position_ned[0], estimate.position_ned[1], estimate.position_ned[2],
    )  # fmt: skip
    moment.vn, moment.ve, moment.vd = vn, ve, vd
    moment.heading = estimate.euler[2]
    moment.ground_speed = math.sqrt(vn * vn + ve * ve)
    moment.course = math.atan2(ve, vn)

    tilt = state[TILT]
    moment.tilt, moment.tilt_command = tilt, controls[TILT_COMMAND]
    moment.tilt_fault = 1 if controlled and status.tilt_fault >= 1.0 else 0
    for k in range(4):
        moment.asked_quaternion[k] = NAN
    for k in range(3):
        moment.asked_thrust[k] = NAN
    moment.asked_north, moment.asked_east, moment.asked_down = NAN, NAN, NAN
    moment.asked_vn, moment.asked_ve, moment.asked_vd = NAN, NAN, NAN
    moment.asked_heading, moment.asked_yaw_rate = NAN, NAN
    if controlled and setpoint.level >= ATTITUDE:
        reference = status.attitude_reference
        a0, a1, a2, a3 = quaternion_from_euler(reference[0], reference[1], reference[2])
        moment.asked_quaternion[0], moment.asked_quaternion[1] = a0, a1
        moment.asked_quaternion[2], moment.asked_quaternion[3] = a2, a3
        moment.asked_thrust[0] = status.thrust * math.cos(tilt)
        moment.asked_thrust[1] = 0.0
        moment.asked_thrust[2] = -status.thrust * math.sin(tilt)
        moment.asked_yaw_rate = setpoint.yaw_rate
    if controlled and setpoint.level == VELOCITY:
        moment.asked_vn = status.velocity_reference_ned[0]
        moment.asked_ve = status.velocity_reference_ned[1]
        moment.asked_vd = status.velocity_reference_ned[2]
        if setpoint.horizontal == POINT:
            moment.asked_north, moment.asked_east = setpoint.position_ned[0], setpoint.position_ned[1]
        if setpoint.vertical == HEIGHT:
            moment.asked_down = setpoint.position_ned[2]
        if setpoint.yaw == HEADING:
            moment.asked_heading = setpoint.heading

    turning = 0
    for k in range(MOTORS):
        moment.motors[k] = controls[k]
        if controls[k] != 0.0:
            turning |= 1 << k
    moment.turning = turning
    for k in range(4):
        low, high = vehicle.servos[k].minimum, vehicle.servos[k].maximum
        moment.servos[k] = 2.0 * (controls[TILT_COMMAND + k] - low) / (high - low) - 1.0 if high > low else 0.0

    u, v, w = ned_to_body(
        q0, q1, q2, q3, vn - estimate.wind_ned[0], ve - estimate.wind_ned[1], vd - estimate.wind_ned[2]
    )
    moment.airspeed = estimate.airspeed
    moment.equivalent_airspeed = estimate.airspeed * math.sqrt(estimate.density / SEA_LEVEL_DENSITY)
    moment.velocity_air[0], moment.velocity_air[1], moment.velocity_air[2] = u, v, w
    moment.angle_of_attack = math.atan2(w, u)
    moment.sideslip = math.atan2(v, math.sqrt(u * u + w * w))

    places, content, text = row.places, row.bytes, row.text
    if size == len(places):
        _fill_slow(craft, estimate, moment, drains)
    for i in range(size):
        text[i] = content[places[i]]
    return turning != 0
