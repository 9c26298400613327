"""One tick of the control laws: estimate and setpoint in, actuator commands out.

The same laws from hover to cruise. Guidance asks for a velocity, the velocity loop for an acceleration, and the
force map turns the force it needs, in the plane of symmetry and at the present airflow, into tilt, rotor speed and
flap. Force to the side comes from bank. Attitude and rate loops ask for moments, the allocation gives them to whatever
makes them at this tilt. Nothing switches between copter and plane: what differs is what the map says at this airflow.

Unified velocity control over the force demand follows Hartmann, Meyer, Moormann, "Unified Velocity Control and Flight
State Transition of Unmanned Tilt-Wing Aircraft", JGCD 40 (2017), doi:10.2514/1.G002168, in its idea, not its equations.
"""

import math

from sitl.control.allocation import apart, pitch_share
from sitl.control.attitude import moment_demand, rate_demand
from sitl.control.design_names import (
    BRAKE,
    PITCH_GAIN,
    PITCH_RATE_GAIN,
    RATE_INTEGRAL_SHARE,
    ROLL_GAIN,
    ROLL_RATE_GAIN,
    YAW_RATE_GAIN,
)
from sitl.control.lookup import map_lookup, schedule_lookup
from sitl.control.records import Horizontal, Level, Yaw
from sitl.control.translation import (
    STANDARD_GRAVITY,
    acceleration_demand,
    advance_reference,
    integrate_velocity,
    limited,
)
from vehicle_model.compiled import compiled
from vehicle_model.force_map import SEA_LEVEL_DENSITY
from vehicle_model.motor import servo_rate, throttle_for
from vehicle_model.rotation import ned_to_body

__all__ = ["control_step"]

OFF, IDLE, DIRECT, ATTITUDE, VELOCITY = (int(level) for level in Level)
HEADING, RATE, COURSE, WEATHERVANE = (int(yaw) for yaw in Yaw)
POINT = int(Horizontal.POINT)

STRONGEST_FORCE = -2.0  # demand down the body, per mass, kept from falling to weightlessness [m/s^2]
SLOW_AIRFLOW = 3.0  # below it the airflow gives the nose no direction [m/s]
SLOW_COURSE = 1.5  # below it neither the ground track nor the wind does [m/s]
RATE_INTEGRAL_LIMIT = (12.0, 12.0, 6.0)  # [rad/s^2]
TILT_ASTRAY = math.radians(5.0)  # from where it should be: the tilt drive does not follow
TILT_MOVED = math.radians(2.0)
TILT_JUDGEMENT = 0.5  # time to be sure of that [s]
STUCK_PITCH = math.radians(20.0)  # that the fuselage takes up for a stuck wing: more, and the tail meets the ground
FASTEST_LIMIT = 1.02  # of the speed at full throttle and rest that the rotors are asked for


@compiled
def wrapped(angle: float) -> float:
    """Angle [rad] within half a turn of zero."""
    return angle - 2.0 * math.pi * math.floor(angle / (2.0 * math.pi) + 0.5)


@compiled
def restart(estimate, setpoint, memory) -> None:
    """Begin a new task from the motion that is: the velocity reference starts where the vehicle is."""
    if memory.sequence == -1.0:
        for k in range(3):
            memory.velocity_reference_ned[k] = estimate.velocity_ned[k]
            memory.velocity_integral_ned[k] = 0.0
            memory.rate_integral[k] = 0.0
        memory.heading_reference = estimate.euler[2]
    memory.sequence = float(setpoint.sequence)


@compiled
def turn_demand(estimate, setpoint, gains, memory, blend: float, u: float, v: float) -> float:
    """Rate of the heading [rad/s]: towards its reference in hover, coordinated and into the airflow wing-borne."""
    heading = estimate.euler[2]
    target = memory.heading_reference
    if setpoint.yaw == RATE:
        target = wrapped(heading + setpoint.yaw_rate / gains.heading)
    elif setpoint.yaw == HEADING and setpoint.cruise == 0:
        target = setpoint.heading
    else:
        reference, wind = memory.velocity_reference_ned, estimate.wind_ned
        north, east = reference[0], reference[1]
        slow = SLOW_COURSE
        if setpoint.cruise == 1:
            north, east, slow = north - wind[0], east - wind[1], SLOW_AIRFLOW
        elif setpoint.yaw == WEATHERVANE:
            north, east = -wind[0], -wind[1]
        if north * north + east * east > slow * slow:
            target = math.atan2(east, north)
    memory.heading_reference = target
    hover = gains.heading * wrapped(target - heading)
    hover = limited(hover, -gains.max_yaw_rate, gains.max_yaw_rate)
    if blend <= 0.0:
        return hover
    # Coordinated: the horizontal part of the lift turns the path, the heading goes with it.
    airspeed = max(u, gains.wing_borne_from)
    coordinated = STANDARD_GRAVITY * math.tan(limited(estimate.euler[0], -1.0, 1.0)) / airspeed
    wing_borne = coordinated + gains.sideslip * math.atan2(v, airspeed)
    return hover + blend * (limited(wing_borne, -1.0, 1.0) - hover)


@compiled
def watch_tilt(estimate, craft, memory, command: float, dt: float) -> None:
    """Judge whether the tilt drive follows its command [rad]: it should be where a sound one would be by now.

    Once judged stuck it has to move to be believed again: standing where it is told to stand proves nothing.
    """
    tilt = estimate.servo[0]
    memory.tilt_expected += dt * servo_rate(craft.servos[0], memory.tilt_expected, command)
    if abs(tilt - memory.tilt_expected) > TILT_ASTRAY:
        memory.tilt_stuck_at = tilt
        memory.tilt_fault = min(memory.tilt_fault + dt / TILT_JUDGEMENT, 1.0)
    elif memory.tilt_fault < 1.0 or abs(tilt - memory.tilt_stuck_at) > TILT_MOVED:
        memory.tilt_fault = max(memory.tilt_fault - dt / TILT_JUDGEMENT, 0.0)


@compiled
def rotor_throttle(estimate, craft, index: int, wanted: float, torque: float, lag: float, idle: float) -> float:
    """Throttle that brings a rotor to a speed [rad/s] where it takes a torque [N m].

    A controller that sets voltage holds the speed by itself; one that sets power is told what accelerates the rotor
    too, to be there within `lag` [s]. At rest that takes no power whatever the torque, so a motor below half its idle
    speed is asked for what it would take there.
    """
    rotor = craft.rotors[index]
    if rotor.throttle_sets_power == 0:
        sag = rotor.battery_voltage / estimate.battery_voltage
        return limited(throttle_for(rotor, wanted, torque) * sag, rotor.min_throttle, 1.0)
    speed = estimate.rotor_speed[index]
    torque += rotor.inertia * (wanted - speed) / lag
    return limited(throttle_for(rotor, max(speed, 0.5 * idle), torque), rotor.min_throttle, 1.0)


@compiled
def control_step(estimates, setpoints, gain_records, table, axes, schedule, vehicle, memories, statuses, controls, dt):
    """One tick of `dt` seconds: writes the controls (7,), the MEMORY and the STATUS records.

    `estimates`, `setpoints`, `gain_records`, `vehicle`, `memories`, `statuses` are arrays of length one of ESTIMATE,
    SETPOINT, GAINS, VEHICLE (the aircraft that the laws believe in), MEMORY and STATUS; `table` and `axes` are the
    force map and its grid, `schedule` the gains over its first axis (`sitl.control.design`).
    """
    estimate, setpoint, gains, craft = estimates[0], setpoints[0], gain_records[0], vehicle[0]
    memory, status = memories[0], statuses[0]
    level = setpoint.level
    watch_tilt(estimate, craft, memory, status.servo_command[0], dt)
    status.tilt_fault = memory.tilt_fault
    if level in (DIRECT, OFF):
        memory.sequence = -1.0
        for k in range(7):
            controls[k] = setpoint.direct[k] if level == DIRECT else 0.0
        if level == OFF:
            controls[3] = gains.hover_tilt
        status.thrust = 0.0
        for k in range(4):
            status.servo_command[k] = controls[3 + k]
        for k in range(3):
            status.rotor_speed_command[k] = 0.0
        return

    # Airflow, and its equivalent at sea level, where the map is at home.
    wind, velocity, attitude = estimate.wind_ned, estimate.velocity_ned, estimate.quaternion
    u, v, w = ned_to_body(
        attitude[0], attitude[1], attitude[2], attitude[3],
        velocity[0] - wind[0], velocity[1] - wind[1], velocity[2] - wind[2],
    )  # fmt: skip
    thin = math.sqrt(estimate.density / SEA_LEVEL_DENSITY)
    if memory.sequence == -1.0:
        memory.airflow[0], memory.airflow[1] = u, w
    restart(estimate, setpoint, memory)
    memory.airflow[0] += dt / (gains.airflow_filter + dt) * (u - memory.airflow[0])
    memory.airflow[1] += dt / (gains.upwash_filter + dt) * (w - memory.airflow[1])
    flow_u, flow_w = memory.airflow[0] * thin, memory.airflow[1] * thin
    row = status.schedule
    schedule_lookup(schedule, axes, flow_u, row)
    blend = limited((flow_u - gains.wing_borne_from) / (gains.wing_borne_at - gains.wing_borne_from), 0.0, 1.0)
    roll, pitch = estimate.euler[0], estimate.euler[1]

    # Force in the plane of symmetry, attitude, turn.
    node = status.node
    forward = right = 0.0
    if level == VELOCITY:
        feed = advance_reference(
            estimate, setpoint, gains, row, schedule[:, BRAKE], axes[0, 0], axes[0, 1], flow_u, memory, dt
        )
        forward, right, down = acceleration_demand(estimate, row, memory, feed[0], feed[1], feed[2])
        lift = min(down - STANDARD_GRAVITY, STRONGEST_FORCE)  # force down, per mass
        steepest = math.tan(setpoint.max_bank)
        lean = limited(right / -lift, -steepest, steepest)
        roll_wanted = math.atan(lean)
        climb = math.atan2(-memory.velocity_reference_ned[2], max(u, gains.wing_borne_from))
        pitch_wanted = blend * climb
        turn = turn_demand(estimate, setpoint, gains, memory, blend, u, v)
    else:
        down, lean = 0.0, 0.0
        lift = -STANDARD_GRAVITY
        roll_wanted, pitch_wanted = setpoint.roll, setpoint.pitch
        turn = setpoint.yaw_rate
        if level == IDLE:
            roll_wanted, pitch_wanted, turn = roll, pitch, 0.0
    cosine, sine = math.cos(pitch), math.sin(pitch)
    force_x = forward * cosine - lift * sine
    force_z = (forward * sine + lift * cosine) / max(math.cos(roll), 0.5)
    memory.force_demand[0], memory.force_demand[1] = force_x, force_z
    map_lookup(table, axes, flow_u, flow_w, force_x, force_z, node)
    tilt, map_speed, flap, torque = node[0], node[1] / thin, node[2], node[3]
    if level == VELOCITY:
        # A wing that cannot tilt is inclined by the fuselage.
        leaning = limited(pitch + tilt - estimate.servo[0], -STUCK_PITCH, STUCK_PITCH)
        pitch_wanted += memory.tilt_fault * (leaning - pitch_wanted)
    collective = map_speed
    fastest = FASTEST_LIMIT * gains.top_speed
    if level == ATTITUDE:
        collective = gains.top_speed * math.sqrt(limited(setpoint.thrust, 0.0, 1.0))
        if not math.isnan(setpoint.tilt):
            tilt = setpoint.tilt
    fastest *= math.sqrt(limited(setpoint.thrust_limit, 0.0, 1.0))
    fastest = max(fastest, gains.idle_speed)
    if level == IDLE:
        collective = gains.idle_speed
    collective = limited(collective, gains.idle_speed, fastest)
    if level == VELOCITY:
        bank_lift = lift / max(math.cos(roll), 0.5)
        reached_x, reached_z = node[11] - force_x, (node[12] - force_z) * math.cos(roll)
        if collective < map_speed:
            reached_z += (1.0 - (collective / map_speed) ** 2) * -bank_lift
        # With the wing at another tilt than asked for the force points elsewhere, by about that angle.
        reached_x -= memory.tilt_fault * force_z * (tilt - pitch_wanted - estimate.servo[0] + pitch)
        integrate_velocity(
            estimate, setpoint, row, memory,
            reached_x * cosine + reached_z * sine, -lift * lean - right, reached_z * cosine - reached_x * sine, dt,
        )  # fmt: skip

    # Moments.
    rates = estimate.rates
    wanted = rate_demand(
        estimate, roll_wanted, pitch_wanted, turn, row[ROLL_GAIN], row[PITCH_GAIN], gains.max_roll_rate
    )
    integral = memory.rate_integral
    if level == IDLE:
        for k in range(3):
            integral[k] = 0.0
    gain = (row[ROLL_RATE_GAIN], row[PITCH_RATE_GAIN], row[YAW_RATE_GAIN])
    for k in range(3):
        error = wanted[k] - rates[k]
        if level != IDLE:
            step = row[RATE_INTEGRAL_SHARE] * gain[k] * gain[k] * error * dt
            integral[k] = limited(integral[k] + step, -RATE_INTEGRAL_LIMIT[k], RATE_INTEGRAL_LIMIT[k])
    mx, my, mz = moment_demand(
        craft, rates,
        (
            gain[0] * (wanted[0] - rates[0]) + integral[0],
            gain[1] * (wanted[1] - rates[1]) + integral[1],
            gain[2] * (wanted[2] - rates[2]) + integral[2],
        ),
    )  # fmt: skip
    my -= node[4]
    mx -= node[13] * thin * rates[2]
    if level == IDLE:
        mx = my = mz = 0.0

    # Actuators.
    aileron_limit = craft.servos[1].maximum
    rotor, aileron, collective = apart(
        mx, mz, node[5] * thin, node[6] * thin, node[7], node[8], collective, gains.idle_speed, fastest, aileron_limit
    )
    flap = min(flap, aileron_limit - abs(aileron))
    elevator, tail_thrust = pitch_share(
        my, node[9], craft.servos[3].maximum, gains.tail_arm, gains.tail_top_thrust, gains.elevator_preference
    )
    tail = math.copysign(math.sqrt(abs(tail_thrust) / (gains.tail_thrust_factor * thin * thin)), tail_thrust)
    left, right_speed = collective + rotor, collective - rotor
    # The torque a propeller takes goes with the square of its speed.
    lag, idle = gains.rotor_lag, gains.idle_speed
    controls[0] = rotor_throttle(estimate, craft, 0, left, torque * (left / map_speed) ** 2, lag, idle)
    controls[1] = rotor_throttle(estimate, craft, 1, right_speed, torque * (right_speed / map_speed) ** 2, lag, idle)
    controls[2] = rotor_throttle(estimate, craft, 2, tail, gains.tail_torque_factor * tail * abs(tail), lag, idle)
    controls[3] = tilt
    controls[4] = flap + aileron
    controls[5] = flap - aileron
    controls[6] = elevator

    status.thrust = (collective / gains.top_speed) ** 2
    status.attitude_reference[0], status.attitude_reference[1] = roll_wanted, pitch_wanted
    status.attitude_reference[2] = memory.heading_reference
    status.force_demand[0], status.force_demand[1] = force_x, force_z
    status.airflow_forward = u
    for k in range(3):
        status.velocity_reference_ned[k] = memory.velocity_reference_ned[k]
    for k in range(4):
        status.servo_command[k] = controls[3 + k]
    status.rotor_speed_command[0] = left
    status.rotor_speed_command[1] = right_speed
    status.rotor_speed_command[2] = tail
