"""Flight dynamics of a single tilt-wing UAV: parameter records and compiled functions, useful without a process."""
