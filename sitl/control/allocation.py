"""From moments to actuators: who makes roll, pitch and yaw at this tilt, and who yields when something saturates.

Roll and yaw come from two pairs, the wing rotors apart and the ailerons apart. In hover the rotors roll and the
ailerons, in the slipstream, yaw; in cruise the rotors yaw and the ailerons roll; on the way both do both. What each
does per unit comes from differentiating the model (`vehicle_model.force_map`). Priority: roll and pitch, then
collective thrust, then yaw.
"""

from vehicle_model.compiled import compiled

__all__ = ["apart", "pitch_share"]

ROLL_WEIGHT = 100.0  # of an error in roll squared, over one in yaw: roll before yaw
LEAST_MOMENT = 0.3  # that the whole travel of a pair must be worth to be used for it [N m]


@compiled
def apart(
    roll: float, yaw: float, roll_per_rotor: float, yaw_per_rotor: float, roll_per_aileron: float,
    yaw_per_aileron: float, collective: float, slowest: float, fastest: float, aileron_limit: float,
) -> tuple[float, float, float]:  # fmt: skip
    """Rotor speeds apart (left - right)/2 [rad/s], ailerons apart (left - right)/2 [rad], collective speed [rad/s].

    Moments in N m, effectiveness as in the force map, speeds in rad/s. The collective moves to make room for the roll
    moment, not for yaw. Within the limits that are left the two pairs make the least weighted error of both moments,
    plus a little for their use: so a pair that hardly yaws, as propellers that windmill, is not driven to its end for
    nothing. That sum is convex: where its least lies outside the limits, the best has one pair at its own.
    """
    widest = max(0.5 * (fastest - slowest), 1.0)  # none is left where the thrust is taken away
    use_rotor, use_aileron = LEAST_MOMENT / widest, LEAST_MOMENT / aileron_limit
    rr = ROLL_WEIGHT * roll_per_rotor * roll_per_rotor + yaw_per_rotor * yaw_per_rotor + use_rotor * use_rotor
    aa = ROLL_WEIGHT * roll_per_aileron * roll_per_aileron + yaw_per_aileron * yaw_per_aileron
    aa += use_aileron * use_aileron
    ra = ROLL_WEIGHT * roll_per_rotor * roll_per_aileron + yaw_per_rotor * yaw_per_aileron
    determinant = rr * aa - ra * ra
    # What roll alone takes of the rotors decides about the collective.
    wants_rotor, wants_aileron = ROLL_WEIGHT * roll_per_rotor * roll, ROLL_WEIGHT * roll_per_aileron * roll
    for_roll = min(abs(aa * wants_rotor - ra * wants_aileron) / determinant, 0.5 * (fastest - slowest))
    collective = min(max(collective, slowest + for_roll), fastest - for_roll)
    room = max(min(fastest - collective, collective - slowest), 0.0)

    wants_rotor += yaw_per_rotor * yaw
    wants_aileron += yaw_per_aileron * yaw
    rotor = (aa * wants_rotor - ra * wants_aileron) / determinant
    aileron = (rr * wants_aileron - ra * wants_rotor) / determinant
    if abs(rotor) <= room and abs(aileron) <= aileron_limit:
        return rotor, aileron, collective
    most = limited(rotor, room)
    rest = limited((wants_aileron - ra * most) / aa, aileron_limit)
    other = limited(aileron, aileron_limit)
    turned = limited((wants_rotor - ra * other) / rr, room)
    cost = rr * most * most + 2.0 * ra * most * rest + aa * rest * rest
    cost -= 2.0 * (wants_rotor * most + wants_aileron * rest)
    cost_turned = rr * turned * turned + 2.0 * ra * turned * other + aa * other * other
    cost_turned -= 2.0 * (wants_rotor * turned + wants_aileron * other)
    if cost <= cost_turned:
        return most, rest, collective
    return turned, other, collective


@compiled
def limited(value: float, limit: float) -> float:
    """Value within +-limit."""
    return min(max(value, -limit), limit)


@compiled
def pitch_share(
    pitch: float, per_elevator: float, elevator_limit: float, tail_arm: float, tail_limit: float, preference: float
) -> tuple[float, float]:
    """Elevator [rad] and tail thrust [N] that make a pitch moment [N m] together.

    Least sum of squares of the shares used of each, the tail rotor's counted `preference` times: power is dearer than
    elevator. What the elevator cannot, the tail rotor does.
    """
    by_elevator = per_elevator * elevator_limit
    by_tail = tail_arm * tail_limit
    both = by_elevator * by_elevator + by_tail * by_tail / preference
    elevator = pitch * per_elevator * elevator_limit * elevator_limit / both
    elevator = min(max(elevator, -elevator_limit), elevator_limit)
    thrust = -(pitch - per_elevator * elevator) / tail_arm
    return elevator, min(max(thrust, -tail_limit), tail_limit)
