"""Where things stand in the state and control vectors.

The NED axes are those of the origin in the environment, fixed to the Earth: on a flat Earth the local axes
everywhere, on a curved one a tangent frame. Position is measured from that origin. Velocity is relative to the Earth,
in body axes (U, V, W of eq. 1). The quaternion is scalar first and turns body vectors into NED. Rates (P, Q, R) are
those of the body against inertial space, in body axes.
"""

import numpy as np

__all__ = [
    "AILERON_LEFT", "AILERON_RIGHT", "CONTROL_COUNT", "CONTROL_NAMES", "ELEVATOR", "POSITION", "QUATERNION",
    "RATES", "ROTOR_SPEED", "SERVO_NAMES", "STATE_COUNT", "STATE_NAMES", "TILT", "TILT_COMMAND", "VELOCITY",
    "blank_controls", "blank_state",
]  # fmt: skip

POSITION = 0  # north, east, down [m]
VELOCITY = 3  # U, V, W [m/s]
QUATERNION = 6  # w, x, y, z
RATES = 10  # P, Q, R [rad/s]
ROTOR_SPEED = 13  # left, right, tail [rad/s]
TILT = 16  # [rad]; the four servos follow each other in the order of the vehicle's servos
AILERON_LEFT = 17  # trailing edge down positive [rad]
AILERON_RIGHT = 18
ELEVATOR = 19
STATE_COUNT = 20

SERVO_NAMES = ("tilt", "aileron_left", "aileron_right", "elevator")
STATE_NAMES = (
    "north", "east", "down", "u", "v", "w", "q0", "q1", "q2", "q3", "p", "q", "r",
    "rotor_left", "rotor_right", "rotor_tail", *SERVO_NAMES,
)  # fmt: skip

# Controls: throttle of the three motors (-1..1), then the commanded angles of the four servos [rad].
TILT_COMMAND = 3  # the other servos' commands follow
CONTROL_COUNT = 7
CONTROL_NAMES = ("throttle_left", "throttle_right", "throttle_tail", *SERVO_NAMES)


def blank_state() -> np.ndarray:
    """State at rest at the origin, level and heading north, rotors stopped; shape (20,)."""
    state = np.zeros(STATE_COUNT)
    state[QUATERNION] = 1.0
    return state


def blank_controls() -> np.ndarray:
    """Controls all zero; shape (7,)."""
    return np.zeros(CONTROL_COUNT)
