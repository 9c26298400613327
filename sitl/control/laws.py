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
from sitl.control.records import NO_LEVEL, Level, Yaw
from sitl.control.translation import (
    acceleration_demand,
    advance_reference,
    integrate_velocity,
    limited,
)
from vehicle_model import force_columns as column
from vehicle_model.compiled import compiled
from vehicle_model.earth import STANDARD_GRAVITY
from vehicle_model.force_map import SEA_LEVEL_DENSITY
from vehicle_model.motor import servo_rate, throttle_for
from vehicle_model.rotation import Vector, ned_to_body

__all__ = ["control_step"]

OFF, IDLE, DIRECT, ATTITUDE, VELOCITY = (int(level) for level in Level)
HEADING, RATE, COURSE, WEATHERVANE = (int(yaw) for yaw in Yaw)

STEEPEST_COSINE = 0.5  # of the bank beyond which lift no longer makes up for it
STRONGEST_FORCE = -2.0  # demand down the body, per mass, kept from falling to weightlessness [m/s^2]
SLOW_AIRFLOW = 3.0  # below it the airflow gives the nose no direction [m/s]
SLOW_COURSE = 1.5  # below it neither the ground track nor the wind does [m/s]
LEAST_LACK = 0.05  # of angular acceleration that counts as falling short [rad/s^2]
RATE_INTEGRAL_LIMIT = (12.0, 12.0, 6.0)  # [rad/s^2]
TILT_ASTRAY = math.radians(5.0)  # from where it should be: the tilt drive does not follow
TILT_MOVED = math.radians(2.0)
TILT_JUDGEMENT = 0.5  # time to be sure of that [s]
RELIEF_GAIN = 60.0  # of what a stuck wing is left, per angle that the fuselage cannot take up [m/s^3]
RELIEF_TIME = 8.0  # [s]
RELIEF_LIMIT = 12.0  # [m/s^2]
STUCK_PITCH = math.radians(20.0)  # that the fuselage takes up for a stuck wing: more, and the tail meets the ground
FASTEST_LIMIT = 1.02  # of the speed at full throttle and rest that the rotors are asked for


@compiled
def wrapped(angle: float) -> float:
    """Angle [rad] within half a turn of zero."""
    return angle - 2.0 * math.pi * math.floor(angle / (2.0 * math.pi) + 0.5)


@compiled
def begin(estimate, memory, controls) -> None:
    """Fill an empty memory from the present: nothing was asked for yet, and the tilt stands where it is told."""
    memory.tilt_command = controls[3]
    memory.tilt_expected = estimate.servo[0]
    memory.tilt_fault = 0.0
    memory.stuck_relief = 0.0
    for k in range(3):
        memory.rate_integral[k] = 0.0


@compiled
def change_level(estimate, memory, level: int) -> None:
    """Begin with other loops closed: the references start from the motion that is, the outer integrals from nothing."""
    for k in range(3):
        memory.velocity_reference_ned[k] = estimate.velocity_ned[k]
        memory.velocity_integral_ned[k] = 0.0
        if memory.level < ATTITUDE:
            memory.rate_integral[k] = 0.0
    memory.heading_reference = estimate.euler[2]
    memory.level = float(level)


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
        # What is asked for, not what has been reached: a start in a tail wind needs no look into it.
        demand, wind = memory.velocity_demand_ned, estimate.wind_ned
        north, east = demand[0], demand[1]
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
def rest(setpoint, gains, status, controls) -> None:
    """Controls where no loop is closed: the setpoint's own, or motors off and the wing as for hover."""
    for k in range(7):
        controls[k] = setpoint.direct[k] if setpoint.level == DIRECT else 0.0
    if setpoint.level == OFF:
        controls[3] = gains.hover_tilt
    status.thrust = 0.0
    for k in range(3):
        status.rotor_speed_command[k] = 0.0


@compiled
def feel_airflow(estimate, gains, memory, dt: float) -> tuple[float, float]:
    """Airflow forward and from the right [m/s]; the memory gets that forward and down the body, filtered."""
    wind, velocity, attitude = estimate.wind_ned, estimate.velocity_ned, estimate.quaternion
    u, v, w = ned_to_body(
        attitude[0], attitude[1], attitude[2], attitude[3],
        velocity[0] - wind[0], velocity[1] - wind[1], velocity[2] - wind[2],
    )  # fmt: skip
    if memory.level < IDLE or memory.level == DIRECT:  # nobody has followed it so far
        memory.airflow[0], memory.airflow[1] = u, w
    memory.airflow[0] += dt / (gains.airflow_filter + dt) * (u - memory.airflow[0])
    memory.airflow[1] += dt / (gains.upwash_filter + dt) * (w - memory.airflow[1])
    return u, v


@compiled
def follow_velocity(
    estimate, setpoint, gains, row, schedule, axes, memory, status, blend: float, u: float, v: float, thin: float, dt
):
    """Force, attitude and turn that bring the velocity to what guidance asks for.

    Returns the force forward and down the heading's axes per mass [m/s^2], how far the force to the right falls short
    of what was asked, the roll and pitch wanted [rad] and the rate of the heading [rad/s].
    """
    feed = advance_reference(
        estimate, setpoint, gains, row, schedule[:, BRAKE], axes[0, 0], axes[0, 1], memory.airflow[0] * thin, memory, dt
    )
    forward, right, down = acceleration_demand(estimate, row, memory, feed[0], feed[1], feed[2])
    lift = min(down - STANDARD_GRAVITY, STRONGEST_FORCE)
    steepest = math.tan(setpoint.max_bank)
    lean = limited(right / -lift, -steepest, steepest)
    climb = math.atan2(-memory.velocity_reference_ned[2], max(u, gains.wing_borne_from))
    turn = turn_demand(estimate, setpoint, gains, memory, blend, u, v)
    for k in range(3):
        status.velocity_reference_ned[k] = memory.velocity_reference_ned[k]
    return forward, lift, -lift * lean - right, math.atan(lean), blend * climb, turn


@compiled
def collective_speed(setpoint, gains, map_speed: float, top: float) -> tuple[float, float]:
    """Speed asked of both wing rotors, and the highest allowed [rad/s].

    `map_speed` is what the force takes, `top` what full throttle gives at rest.
    """
    fastest = FASTEST_LIMIT * top * math.sqrt(limited(setpoint.thrust_limit, 0.0, 1.0))
    fastest = max(fastest, gains.idle_speed)
    collective = map_speed
    if setpoint.level == ATTITUDE:
        collective = top * math.sqrt(limited(setpoint.thrust, 0.0, 1.0))
    elif setpoint.level == IDLE:
        collective = gains.idle_speed
    return limited(collective, gains.idle_speed, fastest), fastest


@compiled
def shortfall(estimate, memory, node, force_x: float, force_z: float, turned: float, share: float):
    """Force forward and down the heading's axes per mass [m/s^2] that is had beyond what is asked for.

    `turned` is the angle by which a stuck wing keeps the force from where it is asked [rad], `share` the part of the
    rotors' force that their limit leaves.
    """
    roll, pitch = estimate.euler[0], estimate.euler[1]
    lack_x = node[column.FORCE_FORWARD] - force_x - memory.tilt_fault * force_z * turned
    lack_z = (node[column.FORCE_DOWN] - force_z) * math.cos(roll) - (1.0 - share) * force_z
    cosine, sine = math.cos(pitch), math.sin(pitch)
    return lack_x * cosine + lack_z * sine, lack_z * cosine - lack_x * sine


@compiled
def moments(estimate, craft, row, memory, node, wanted: Vector, thin: float) -> Vector:
    """Moments [N m] that the actuators should make for the body rates wanted [rad/s]."""
    rates, integral = estimate.rates, memory.rate_integral
    mx, my, mz = moment_demand(
        craft, rates,
        (
            row[ROLL_RATE_GAIN] * (wanted[0] - rates[0]) + integral[0],
            row[PITCH_RATE_GAIN] * (wanted[1] - rates[1]) + integral[1],
            row[YAW_RATE_GAIN] * (wanted[2] - rates[2]) + integral[2],
        ),
    )  # fmt: skip
    return mx - node[column.ROLL_PER_YAW_RATE] * thin * rates[2], my - node[column.PITCH_MOMENT], mz


@compiled
def integrate_rates(estimate, craft, row, memory, wanted: Vector, lacks: Vector, dt: float) -> None:
    """Advance the rate loops' integrals, but not further into what the actuators could not make, `lacks` [N m]."""
    gain = (row[ROLL_RATE_GAIN], row[PITCH_RATE_GAIN], row[YAW_RATE_GAIN])
    for k in range(3):
        error = wanted[k] - estimate.rates[k]
        if error * lacks[k] < 0.0 and abs(lacks[k]) > LEAST_LACK * craft.inertia[k, k]:
            error = 0.0
        step = row[RATE_INTEGRAL_SHARE] * gain[k] * gain[k] * error * dt
        integral = memory.rate_integral[k] + step
        memory.rate_integral[k] = limited(integral, -RATE_INTEGRAL_LIMIT[k], RATE_INTEGRAL_LIMIT[k])


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
    if memory.level == NO_LEVEL:
        begin(estimate, memory, controls)
    watch_tilt(estimate, craft, memory, memory.tilt_command, dt)
    status.tilt_fault = memory.tilt_fault
    if level in (DIRECT, OFF):
        rest(setpoint, gains, status, controls)
        memory.level = float(level)
        memory.tilt_command = controls[3]
        for k in range(4):
            status.servo_command[k] = controls[3 + k]
        return

    u, v = feel_airflow(estimate, gains, memory, dt)
    if memory.level != level:
        change_level(estimate, memory, level)
    # The map is at home at sea level: at another density the same forces act at the same dynamic pressure.
    thin = math.sqrt(estimate.density / SEA_LEVEL_DENSITY)
    # A part of the airflow down the body is left to heave damping; with the fuselage pitched far it is no small thing.
    told = gains.upwash_share + memory.tilt_fault * (1.0 - gains.upwash_share)
    flow_u, flow_w = memory.airflow[0] * thin, memory.airflow[1] * thin * told
    row, node = status.schedule, status.node
    schedule_lookup(schedule, axes, flow_u, row)
    blend = limited((flow_u - gains.wing_borne_from) / (gains.wing_borne_at - gains.wing_borne_from), 0.0, 1.0)
    roll, pitch = estimate.euler[0], estimate.euler[1]

    forward, lift, lack_right = 0.0, -STANDARD_GRAVITY, 0.0
    roll_wanted, pitch_wanted, turn = setpoint.roll, setpoint.pitch, setpoint.yaw_rate
    if level == VELOCITY:
        forward, lift, lack_right, roll_wanted, pitch_wanted, turn = follow_velocity(
            estimate, setpoint, gains, row, schedule, axes, memory, status, blend, u, v, thin, dt
        )

    # Force in the plane of symmetry, by wing tilt, rotor speed and flap; a wing that is stuck is inclined by the body.
    # An attitude asked for moves the vehicle: its wing stands as with the fuselage level.
    reference_pitch = pitch if level == VELOCITY else 0.0
    cosine, sine = math.cos(reference_pitch), math.sin(reference_pitch)
    force_x = (forward + memory.stuck_relief) * cosine - lift * sine
    force_z = (forward * sine + lift * cosine) / max(math.cos(roll), STEEPEST_COSINE)
    map_lookup(table, axes, flow_u, flow_w, force_x, force_z, node)
    tilt, map_speed = node[column.TILT], node[column.ROTOR_SPEED] / thin
    if level == ATTITUDE and not math.isnan(setpoint.tilt):
        tilt = setpoint.tilt
    # Thin air takes less torque: a motor that gives its power there turns faster.
    top = gains.top_speed if craft.rotors[0].throttle_sets_power == 0 else gains.top_speed * thin ** (-2.0 / 3.0)
    collective, fastest = collective_speed(setpoint, gains, map_speed, top)
    if level == VELOCITY:
        inclined = pitch + tilt - estimate.servo[0]
        leaning = limited(inclined, -STUCK_PITCH, STUCK_PITCH)
        pitch_wanted += memory.tilt_fault * (leaning - pitch_wanted)
        # A wing that even so stands too flat carries at a higher speed only, which the force forward must then make;
        # one that stands too steep slows the vehicle down by itself.
        relief = RELIEF_GAIN * memory.tilt_fault * (inclined - leaning) - memory.stuck_relief / RELIEF_TIME
        memory.stuck_relief = limited(memory.stuck_relief + dt * relief, 0.0, RELIEF_LIMIT)
        turned = tilt - pitch_wanted - estimate.servo[0] + pitch
        share = min((collective / map_speed) ** 2, 1.0)
        lack_forward, lack_down = shortfall(estimate, memory, node, force_x, force_z, turned, share)
        integrate_velocity(estimate, setpoint, row, memory, lack_forward, lack_right, lack_down, dt)

    # Moments, and who makes them.
    mx = my = mz = 0.0
    wanted = rate_demand(
        estimate, roll_wanted, pitch_wanted, turn, row[ROLL_GAIN], row[PITCH_GAIN], gains.max_roll_rate
    )
    if level != IDLE:
        mx, my, mz = moments(estimate, craft, row, memory, node, wanted, thin)
    aileron_limit = craft.servos[1].maximum
    roll_per_rotor, yaw_per_rotor = node[column.ROLL_PER_ROTOR] * thin, node[column.YAW_PER_ROTOR] * thin
    roll_per_aileron, yaw_per_aileron = node[column.ROLL_PER_AILERON], node[column.YAW_PER_AILERON]
    rotor, aileron, collective = apart(
        mx, mz, roll_per_rotor, yaw_per_rotor, roll_per_aileron, yaw_per_aileron, collective, gains.idle_speed,
        fastest, aileron_limit,
    )  # fmt: skip
    flap = min(node[column.FLAP], aileron_limit - abs(aileron))
    elevator, tail_thrust = pitch_share(
        my, node[column.PITCH_PER_ELEVATOR], craft.servos[3].maximum, gains.tail_arm, gains.tail_top_thrust,
        gains.elevator_preference,
    )  # fmt: skip
    if level != IDLE:
        made_roll = roll_per_rotor * rotor + roll_per_aileron * aileron
        made_yaw = yaw_per_rotor * rotor + yaw_per_aileron * aileron
        made_pitch = node[column.PITCH_PER_ELEVATOR] * elevator - gains.tail_arm * tail_thrust
        integrate_rates(estimate, craft, row, memory, wanted, (made_roll - mx, made_pitch - my, made_yaw - mz), dt)
    tail = math.copysign(math.sqrt(abs(tail_thrust) / (gains.tail_thrust_factor * thin * thin)), tail_thrust)

    # A propeller's torque coefficient falls with the advance ratio, so its torque at another speed in the same flow is
    # a parabola through none at rest and what the map says.
    left, right, tail_torque = collective + rotor, collective - rotor, gains.tail_torque_factor * thin * thin
    lag, idle, at_rest = gains.rotor_lag, gains.idle_speed, gains.torque_factor * thin * thin
    relief = node[column.SHAFT_TORQUE] / map_speed - at_rest * map_speed
    controls[0] = rotor_throttle(estimate, craft, 0, left, (at_rest * left + relief) * left, lag, idle)
    controls[1] = rotor_throttle(estimate, craft, 1, right, (at_rest * right + relief) * right, lag, idle)
    controls[2] = rotor_throttle(estimate, craft, 2, tail, tail_torque * tail * abs(tail), lag, idle)
    controls[3], controls[4], controls[5], controls[6] = tilt, flap + aileron, flap - aileron, elevator

    memory.tilt_command = tilt
    status.thrust = (collective / top) ** 2
    status.attitude_reference[0], status.attitude_reference[1] = roll_wanted, pitch_wanted
    status.attitude_reference[2] = memory.heading_reference
    status.force_demand[0], status.force_demand[1] = force_x, force_z
    status.airflow_forward = u
    for k in range(4):
        status.servo_command[k] = controls[3 + k]
    status.rotor_speed_command[0], status.rotor_speed_command[1] = left, right
    status.rotor_speed_command[2] = tail
