"""The control laws: one compiled step from estimate and setpoint to actuators, and how its gains are designed."""
