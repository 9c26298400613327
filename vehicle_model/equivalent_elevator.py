"""The paper's "equivalent elevator": one pitch command that moves the elevator and drives the tail propeller.

Positive is trailing edge down and tail thrust up, both nose down. The tail propeller's part fades with sin^2 of the
tilt, so that it works in hover, where the elevator feels no air, and rests in cruise.
"""

import math

from vehicle_model.compiled import compiled

__all__ = ["tail_speed"]


@compiled
def tail_speed(craft, command: float, tilt: float) -> float:
    """Tail rotor speed [rad/s] for an equivalent elevator command and a tilt [rad]; negative runs backwards.

    speed |speed| = tail_gain sin^2(tilt) command: thrust goes with the square of the speed, so it is linear in the
    command.
    """
    square = craft.tail_gain * math.sin(tilt) ** 2 * command
    return math.copysign(math.sqrt(abs(square)), square)
