"""What the force map holds at each node (`vehicle_model.force_map`): the columns' names, and where they stand."""

COLUMNS = (
    "tilt",  # [rad]
    "rotor_speed",  # of both wing rotors [rad/s]
    "flap",  # both ailerons, trailing edge down [rad]
    "shaft_torque",  # of one wing rotor [N m]
    "pitch_moment",  # with elevator and tail rotor at rest [N m]
    "roll_per_rotor",  # moment per (left - right)/2 of the rotor speeds [N m s/rad]
    "yaw_per_rotor",
    "roll_per_aileron",  # moment per (left - right)/2 of the ailerons [N m/rad]
    "yaw_per_aileron",
    "pitch_per_elevator",  # [N m/rad]
    "stall_margin",  # least of the strips in the slipstream [rad]
    "force_forward",  # reached, per mass [m/s^2]
    "force_down",
    "roll_per_yaw_rate",  # moment of the faster outer wing in a turn [N m s/rad]
)
(
    TILT, ROTOR_SPEED, FLAP, SHAFT_TORQUE, PITCH_MOMENT, ROLL_PER_ROTOR, YAW_PER_ROTOR, ROLL_PER_AILERON,
    YAW_PER_AILERON, PITCH_PER_ELEVATOR, STALL_MARGIN, FORCE_FORWARD, FORCE_DOWN, ROLL_PER_YAW_RATE,
) = range(len(COLUMNS))  # fmt: skip
