"""What the paper prints, as numbers: Table 1 and the axes of its figures. Its curves are known by their axes only."""

from vehicle_model.identify import TABLE_1
from vehicle_model.linearise import Hold

__all__ = [
    "CALIBRATED_HOLD",
    "CRUISE_AIRSPEED",
    "DAMPING_GRID",
    "ELEVATOR_AXIS",
    "FREQUENCY_GRID",
    "LITERAL_LIFT_COEFFICIENT",
    "PRINTED_DAMPING",
    "PRINTED_FREQUENCY",
    "Q_AXIS",
    "RPM_AXIS",
    "TABLE_1",
    "THETA_AXIS",
    "TILT_AXIS",
    "U_AXIS",
    "W_AXIS",
]

CALIBRATED_HOLD: Hold = "throttle"  # what ours was fitted with; the paper does not say what its propellers keep
CRUISE_AIRSPEED = 30.0  # of Figs 11-13 and Table 1 [m/s]

PRINTED_FREQUENCY = {"short_period": 11.1, "phugoid": 0.452}  # [rad/s]
PRINTED_DAMPING = {"short_period": 2.41, "phugoid": 0.138}  # as printed: the first has lost a factor of ten

LITERAL_LIFT_COEFFICIENT = 0.2  # eq. (9): 0.1 per degree times 2 deg of incidence

# Fig. 10, lowest and highest tick
RPM_AXIS = (2000.0, 7000.0)
TILT_AXIS = (0.0, 80.0)  # [deg]
ELEVATOR_AXIS = (-12.0, 2.0)  # [deg]

# Fig. 12
U_AXIS = (0.0, 0.1)  # [m/s]
W_AXIS = (-0.4, 0.1)  # [m/s]
Q_AXIS = (-4.0, 4.0)  # [deg/s]
THETA_AXIS = (-1.0, 1.0)  # [deg]

# Fig. 13
DAMPING_GRID = (0.016, 0.036, 0.056, 0.085, 0.115, 0.17, 0.26, 0.5)
FREQUENCY_GRID = (2.0, 4.0, 6.0, 8.0, 10.0, 12.0, 14.0)  # [rad/s]
