"""From moments to actuators: who makes roll, pitch and yaw at this tilt, and who yields when something saturates.

Roll and yaw come from two pairs, the wing rotors apart and the ailerons apart. In hover the rotors roll and the
ailerons, in the slipstream, yaw; in cruise the rotors yaw and the ailerons roll; on the way both do both. What each
does per unit comes from differentiating the model (`vehicle_model.force_map`). Priority: roll and pitch, then
collective thrust, then yaw.
"""

import math

from vehicle_model.compiled import compiled

__all__ = ["apart", "pitch_share"]


@compiled
def reach(at_rest: float, change: float, limit: float) -> float:
    """Largest share 0..1 of `change` that keeps |at_rest + share change| within the limit; 0 if it is beyond it now."""
    if abs(at_rest + change) <= limit:
        return 1.0
    if abs(at_rest) >= limit or change == 0.0:
        return 0.0
    return (math.copysign(limit, change) - at_rest) / change


@compiled
def apart(
    roll: float, yaw: float, roll_per_rotor: float, yaw_per_rotor: float, roll_per_aileron: float,
    yaw_per_aileron: float, collective: float, slowest: float, fastest: float, aileron_limit: float,
) -> tuple[float, float, float]:  # fmt: skip
    """Rotor speeds apart (left - right)/2 [rad/s], ailerons apart (left - right)/2 [rad], collective speed [rad/s].

    Moments in N m, effectiveness as in the force map, speeds in rad/s. First yaw is given up as far as needed, then
    the collective moves to make room for roll, then what is left is limited.
    """
    determinant = roll_per_rotor * yaw_per_aileron - yaw_per_rotor * roll_per_aileron
    rotor_for_roll = yaw_per_aileron * roll / determinant
    aileron_for_roll = -yaw_per_rotor * roll / determinant
    rotor_for_yaw = -roll_per_aileron * yaw / determinant
    aileron_for_yaw = roll_per_rotor * yaw / determinant
    room = max(min(fastest - collective, collective - slowest), 0.0)
    share = min(reach(rotor_for_roll, rotor_for_yaw, room), reach(aileron_for_roll, aileron_for_yaw, aileron_limit))
    rotor = rotor_for_roll + share * rotor_for_yaw
    aileron = aileron_for_roll + share * aileron_for_yaw
    if abs(aileron) > aileron_limit:
        # Roll alone asks for more than the ailerons have: they stay at the limit and the rotors roll on, yaw or not.
        aileron = math.copysign(aileron_limit, aileron)
        if abs(roll_per_rotor) > 0.1 * abs(yaw_per_rotor):
            rotor = (roll - roll_per_aileron * aileron) / roll_per_rotor
    widest = 0.5 * (fastest - slowest)
    rotor = min(max(rotor, -widest), widest)
    collective = min(max(collective, slowest + abs(rotor)), fastest - abs(rotor))
    return rotor, aileron, collective


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
