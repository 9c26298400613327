"""Programs on the ground. They speak MAVLink and nothing else, so they also fly another autopilot."""
