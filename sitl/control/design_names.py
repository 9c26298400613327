"""Columns of the schedule of gains, over the forward airflow (the first axis of the force map)."""

__all__ = [
    "BRAKE", "COLUMNS", "FORWARD_GAIN", "INTEGRAL_SHARE", "LATERAL_GAIN", "LOWEST_FORCE", "PITCH_GAIN",
    "PITCH_RATE_GAIN", "RATE_INTEGRAL_SHARE", "ROLL_GAIN", "ROLL_RATE_GAIN", "VERTICAL_GAIN", "YAW_RATE_GAIN",
]  # fmt: skip

COLUMNS = (
    "roll_gain",  # attitude to rate [1/s]
    "pitch_gain",
    "roll_rate_gain",  # rate to angular acceleration [1/s]
    "pitch_rate_gain",
    "yaw_rate_gain",
    "rate_integral_share",  # integral gain over the square of the rate gain
    "forward_gain",  # velocity to acceleration [1/s]
    "lateral_gain",
    "vertical_gain",
    "integral_share",  # integral gain over the square of the velocity gain
    "brake",  # planned deceleration [m/s^2]
    "lowest_force",  # forward, per mass, that keeps the wing from stalling in level flight [m/s^2]
)
(
    ROLL_GAIN, PITCH_GAIN, ROLL_RATE_GAIN, PITCH_RATE_GAIN, YAW_RATE_GAIN, RATE_INTEGRAL_SHARE,
    FORWARD_GAIN, LATERAL_GAIN, VERTICAL_GAIN, INTEGRAL_SHARE, BRAKE, LOWEST_FORCE,
) = range(len(COLUMNS))  # fmt: skip
