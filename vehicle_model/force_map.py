"""Which tilt and rotor speed give a wanted force in the plane of symmetry, at any airflow: the trim map of a tilt-wing.

Steady flight is one force for each flight-path angle and load factor, accelerated flight another, so one table
over airflow and force (forward and down the body, per mass) covers hover, transition, cruise, climbs, turns and
braking. Where a force cannot be had, the table holds what comes nearest: vertical force first, the wing kept below
its stall, rotors within their power. Where the stall is near, the ailerons droop together as flaps: lift at a smaller
angle of attack (the XC-142 and the CL-84 programmed their flaps with the wing's tilt for the same reason).
"""

import math

import numpy as np

from vehicle_model import force_columns as column
from vehicle_model.aircraft import Aircraft
from vehicle_model.authority import speed_at
from vehicle_model.compiled import compiled, compiled_loop
from vehicle_model.earth import STANDARD_GRAVITY
from vehicle_model.force_columns import COLUMNS
from vehicle_model.loads import describe_parts, vehicle_loads
from vehicle_model.records import OUTPUTS
from vehicle_model.state import AILERON_LEFT, AILERON_RIGHT, ELEVATOR, ROTOR_SPEED, STATE_COUNT, TILT
from vehicle_model.surface import coefficients

__all__ = ["COLUMNS", "SEA_LEVEL_DENSITY", "STALL_MARGIN", "force_grid", "force_map", "stall_speed"]

SEA_LEVEL_DENSITY = 1.225  # of the table [kg/m^3]; at another, the same forces act at the same dynamic pressures
STALL_MARGIN = math.radians(3.0)  # kept where the force allows
FLAP_SHARE = 0.8  # of the ailerons' travel that droop may take
SLOWEST_ROTOR = 0.12  # of the rotor speed at full throttle
UNKNOWNS = 3
CONTROL_STEP = 0.01  # [rad]
TURN_STEP = 0.05  # [rad/s]


def force_grid(aircraft: Aircraft) -> np.ndarray:
    """Axes of an aircraft's table (4, 3): first node, step and count of each.

    Airflow along the body's x and z axes [m/s] at sea-level density, as far as the aircraft flies by its stall speed;
    force per mass along them [m/s^2].
    """
    step = stall_speed(aircraft) / 8.5
    return np.array([[-7.0 * step, step, 25.0], [-4.5 * step, 1.5 * step, 7.0], [-6.0, 1.5, 9.0], [-18.0, 2.0, 9.0]])


def stall_speed(aircraft: Aircraft) -> float:
    """Airspeed [m/s] at which the wing outside any slipstream carries the weight at its greatest lift, at sea level."""
    craft = aircraft.vehicle[0]
    lift = sum(
        float(surface["area"]) * coefficients(surface, math.sin(angle), math.cos(angle), 0.0)[0]
        for surface in craft["surfaces"][: craft["surface_count"]]
        if surface["tilts"] == 1
        for angle in (float(surface["max_lift_angle"]),)
    )
    return math.sqrt(2.0 * float(craft["mass"]) * STANDARD_GRAVITY / (SEA_LEVEL_DENSITY * lift))


@compiled
def point_loads(craft, u: float, w: float, x, state, controls, out):
    """Force along x and z [N], pitch moment [N m], least stall margin [rad] of the strips in the slipstream.

    Symmetric flow u, w [m/s] along the body at x = (tilt, rotor speed, flap); tail rotor and elevator at rest.
    `state` (20,), `controls` (7,) and the OUTPUTS record `out` are scratch.
    """
    for k in range(STATE_COUNT):
        state[k] = 0.0
    state[TILT] = x[0]
    state[ROTOR_SPEED] = x[1]
    state[ROTOR_SPEED + 1] = x[1]
    state[AILERON_LEFT] = x[2]
    state[AILERON_RIGHT] = x[2]
    fx, _, fz, _, my, _ = vehicle_loads(
        state, controls, craft, (u, 0.0, w), (0.0, 0.0, 0.0), 0.0, SEA_LEVEL_DENSITY, out
    )
    describe_parts(state, craft, out)
    margin = math.pi
    for i in range(craft.surface_count):
        if craft.surfaces[i].tilts == 1 and craft.surfaces[i].rotor >= 0:
            margin = min(margin, out.stall_margin[i])
    return fx, fz, my, margin


@compiled
def short_of(value: float, limit: float, width: float) -> float:
    """How far a value falls short of a limit, rounded off over `width` so that a search sees it coming."""
    x = (limit - value) / width
    return limit - value if x > 30.0 else width * math.log1p(math.exp(x))


@compiled
def residuals(craft, u, w, want_x, want_z, x, fastest, tail_arm, state, controls, out, r) -> float:
    """Errors of force per mass (down counts most), lack of stall margin, excess of speed, droop; and their square."""
    fx, fz, my, margin = point_loads(craft, u, w, x, state, controls, out)
    r[0] = fx / craft.mass - want_x
    # The tail rotor balances the moment, and its thrust is part of the force.
    r[1] = 3.0 * ((fz - my / tail_arm) / craft.mass - want_z)
    r[2] = 60.0 * short_of(margin, STALL_MARGIN, math.radians(0.5))
    r[3] = 200.0 * short_of(fastest - x[1], 0.0, 0.01 * fastest) / fastest
    r[4] = 0.5 * x[2]
    total = 0.0
    for k in range(5):
        total += r[k] * r[k]
    return total


@compiled
def search(craft, u, w, want_x, want_z, fastest, tail_arm, x, work, state, controls, out) -> float:
    """Levenberg-Marquardt from x = (tilt, rotor speed, flap), in place, within their limits; the square left over."""
    r, moved_r, slope, trial = work[0, :5], work[1, :5], work[2:5, :5], work[5, :3]
    low = (craft.servos[0].minimum, SLOWEST_ROTOR * fastest, 0.0)
    high = (craft.servos[0].maximum, 1.05 * fastest, FLAP_SHARE * craft.servos[1].maximum)
    scale = (1.0, fastest, 1.0)
    damping = 1e-3
    matrix = np.empty((UNKNOWNS, UNKNOWNS))
    gradient = np.empty(UNKNOWNS)
    cost = residuals(craft, u, w, want_x, want_z, x, fastest, tail_arm, state, controls, out, r)
    for _ in range(80):
        for j in range(UNKNOWNS):
            for k in range(UNKNOWNS):
                trial[k] = x[k]
            step = 1e-5 * scale[j]
            trial[j] += step
            residuals(craft, u, w, want_x, want_z, trial, fastest, tail_arm, state, controls, out, moved_r)
            for k in range(5):
                slope[j, k] = (moved_r[k] - r[k]) / 1e-5
        for i in range(UNKNOWNS):
            gradient[i] = 0.0
            for k in range(5):
                gradient[i] += slope[i, k] * r[k]
        moved = 0.0
        for _ in range(12):
            for i in range(UNKNOWNS):
                for j in range(UNKNOWNS):
                    matrix[i, j] = 0.0
                    for k in range(5):
                        matrix[i, j] += slope[i, k] * slope[j, k]
                matrix[i, i] += damping * (matrix[i, i] + 1e-6)
            change = np.linalg.solve(matrix, gradient)
            for k in range(UNKNOWNS):
                change[k] = min(max(change[k], -0.1), 0.1)
                trial[k] = min(max(x[k] - change[k] * scale[k], low[k]), high[k])
            new = residuals(craft, u, w, want_x, want_z, trial, fastest, tail_arm, state, controls, out, moved_r)
            if new < cost:
                for k in range(UNKNOWNS):
                    moved += abs(trial[k] - x[k]) / scale[k]
                    x[k] = trial[k]
                for k in range(5):
                    r[k] = moved_r[k]
                cost = new
                damping = max(0.2 * damping, 1e-9)
                break
            damping = min(4.0 * damping, 1e9)
        if moved < 1e-9:
            break
    return cost


@compiled
def describe(craft, u, w, x, tail_arm, state, controls, out, node) -> None:
    """Fill a node of the table for x = (tilt, rotor speed, flap): torque, moments and what each actuator does."""
    fx, fz, my, margin = point_loads(craft, u, w, x, state, controls, out)
    for k in range(UNKNOWNS):
        node[k] = x[k]
    node[column.SHAFT_TORQUE] = out.shaft_torque[0]
    node[column.PITCH_MOMENT] = my
    node[column.STALL_MARGIN] = margin
    node[column.FORCE_FORWARD] = fx / craft.mass
    node[column.FORCE_DOWN] = (fz - my / tail_arm) / craft.mass
    speed_step = 0.01 * x[1]
    air, still = (u, 0.0, w), (0.0, 0.0, 0.0)
    # Ends of the differences: rotors apart, ailerons apart, elevator.
    for k in range(UNKNOWNS):
        step = speed_step if k == 0 else CONTROL_STEP
        roll = pitch = yaw = 0.0
        for side in (1.0, -1.0):
            point_loads(craft, u, w, x, state, controls, out)
            if k == 0:
                state[ROTOR_SPEED] += side * step
                state[ROTOR_SPEED + 1] -= side * step
            elif k == 1:
                state[AILERON_LEFT] += side * step
                state[AILERON_RIGHT] -= side * step
            else:
                state[ELEVATOR] += side * step
            _, _, _, mx, m, mz = vehicle_loads(state, controls, craft, air, still, 0.0, SEA_LEVEL_DENSITY, out)
            # In a steady differential the motors bear the propellers' torque, which reacts on the airframe.
            for i in range(2):
                reaction = -craft.rotors[i].spin * out.shaft_torque[i]
                mx += reaction * math.cos(x[0])
                mz -= reaction * math.sin(x[0])
            roll += side * mx / (2.0 * step)
            pitch += side * m / (2.0 * step)
            yaw += side * mz / (2.0 * step)
        if k < 2:
            node[column.ROLL_PER_ROTOR + 2 * k] = roll
            node[column.YAW_PER_ROTOR + 2 * k] = yaw
        else:
            node[column.PITCH_PER_ELEVATOR] = pitch
    point_loads(craft, u, w, x, state, controls, out)
    _, _, _, mx, _, _ = vehicle_loads(state, controls, craft, air, (0.0, 0.0, TURN_STEP), 0.0, SEA_LEVEL_DENSITY, out)
    node[column.ROLL_PER_YAW_RATE] = mx / TURN_STEP


@compiled_loop
def fill(vehicle, axes, route, fastest: float, tail_arm: float, outputs, table) -> None:
    """Solve the nodes of the table (n_u, n_w, n_fx, n_fz, columns) in the order of `route`.

    A row of `route` (n, 2, 4) is a node and the neighbour, already solved, whose solution is the first guess.
    """
    craft, out = vehicle[0], outputs[0]
    state, controls, work, x = np.empty(STATE_COUNT), np.zeros(7), np.empty((6, 8)), np.empty(UNKNOWNS)
    for n in range(route.shape[0]):
        a, b, c, d = route[n, 0]
        e, f, g, h = route[n, 1]
        if n == 0:
            x[0], x[1], x[2] = math.radians(83.0), 0.77 * fastest, 0.0  # hover, more or less
        else:
            for k in range(UNKNOWNS):
                x[k] = table[e, f, g, h, k]
        u = axes[0, 0] + a * axes[0, 1]
        w = axes[1, 0] + b * axes[1, 1]
        want_x = axes[2, 0] + c * axes[2, 1]
        want_z = axes[3, 0] + d * axes[3, 1]
        search(craft, u, w, want_x, want_z, fastest, tail_arm, x, work, state, controls, out)
        describe(craft, u, w, x, tail_arm, state, controls, out, table[a, b, c, d])


def _route(axes: np.ndarray) -> np.ndarray:
    """Order of the nodes, each with a neighbour before it: (n, 2, 4).

    From hover along the airspeed, from each of these along the force forward, then the force down, then the flow
    across. So the table keeps to the one branch of solutions that joins hover with cruise.
    """
    near = ((value - first) / step for value, (first, step, _) in zip((0.0, 0.0, 0.0, -10.0), axes, strict=True))
    hover = tuple(round(index) for index in near)
    reached = [(hover, hover)]
    for axis in (0, 2, 3, 1):
        for node, _ in list(reached):
            for side in (1, -1):
                before = node
                for index in range(node[axis] + side, int(axes[axis, 2]) if side > 0 else -1, side):
                    here = (*node[:axis], index, *node[axis + 1 :])
                    reached.append((here, before))
                    before = here
    return np.array(reached)


def force_map(aircraft: Aircraft, axes: np.ndarray) -> np.ndarray:
    """Table (n_u, n_w, n_fx, n_fz, len(COLUMNS)) of an aircraft over a grid, as `force_grid` gives it.

    Airspeeds and rotor speeds are equivalent ones: at density rho they count times sqrt(rho/1.225).
    """
    table = np.empty((*(int(count) for count in axes[:, 2]), len(COLUMNS)))
    tail_arm = -float(aircraft.vehicle[0]["rotors"]["position"][2, 0])
    fill(aircraft.vehicle, axes, _route(axes), speed_at(aircraft, 0, 1.0), tail_arm, np.zeros(1, OUTPUTS), table)
    return table
